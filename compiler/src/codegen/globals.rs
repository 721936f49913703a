//! Numbers the globals by the frequency of their use, because the lowest numbers have short
//! instructions.

use std::cmp::Reverse;
use std::collections::BTreeMap;

use crate::check::names::{Meaning, Meanings};
use crate::check::tree::{CheckedExprKind, NameId, ResolvedScript, each_expr};

/// Returns the names of the global variables, by number.
pub fn number(program: &ResolvedScript, meanings: &Meanings<'_>) -> Vec<NameId> {
    let mut uses: BTreeMap<NameId, usize> = (0..program.names.len())
        .map(NameId)
        .filter(|id| meanings.of(*id) == Meaning::Global)
        .map(|id| (id, 0))
        .collect();
    for function in &program.functions {
        each_expr(&function.body, &mut |expr| {
            if let CheckedExprKind::Name(name) = expr.kind
                && let Some(count) = uses.get_mut(&name)
            {
                *count += 1;
            }
        });
    }
    let mut counted: Vec<(NameId, usize)> = uses.into_iter().collect();
    // The sort is stable, so globals with equal counts stay in order of appearance.
    counted.sort_by_key(|(_, count)| Reverse(*count));
    counted.into_iter().map(|(id, _)| id).collect()
}
