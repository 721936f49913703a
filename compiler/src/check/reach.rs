//! The functions that may run: those that the global code or an entry point reaches by their names.

use std::collections::BTreeSet;

use crate::check::tree::{CheckedExprKind, FunctionId, NameId, ResolvedScript, each_expr};
use crate::image::ENTRIES;

/// Returns true if the script defines or assigns an entry point. A file without one is a library or a
/// first trial.
pub fn has_entry(program: &ResolvedScript) -> bool {
    program.names.iter().any(|name| {
        ENTRIES.contains(&name.text.as_str())
            && (!name.definitions.is_empty() || !name.writes.is_empty())
    })
}

/// Returns the functions that may run. In a file without an entry point, and in one in which syntax
/// errors hide names, these are all functions.
pub fn running(program: &ResolvedScript) -> BTreeSet<FunctionId> {
    if !has_entry(program) || program.hidden.is_any() {
        return (0..program.functions.len()).map(FunctionId).collect();
    }
    let mut running = BTreeSet::new();
    let entries = ENTRIES.iter().filter_map(|entry| program.find_name(entry));
    let mut waiting: Vec<FunctionId> = entries.flat_map(|name| named(program, name)).collect();
    waiting.push(FunctionId::GLOBAL);
    while let Some(id) = waiting.pop() {
        if !running.insert(id) {
            continue;
        }
        each_expr(&program.function(id).body, &mut |expr| match expr.kind {
            CheckedExprKind::Name(name) => waiting.extend(named(program, name)),
            CheckedExprKind::Lambda(lambda) => waiting.push(lambda),
            _ => {}
        });
    }
    running
}

/// Returns the functions of that name.
fn named(program: &ResolvedScript, name: NameId) -> impl Iterator<Item = FunctionId> + use<'_> {
    program.name(name).definitions.iter().map(|(id, _)| *id)
}
