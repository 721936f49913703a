//! Finds out if a script can get hold of the machine's own strings, such as the name of a type or
//! of a neighbor's field.
//!
//! If a script cannot, the numbers of its strings give their order, and the image needs no order
//! table.

use bittybuzz_vm_core::builtin;

use crate::check::names::{Meaning, Meanings};
use crate::check::tree::{CheckedExprKind, ResolvedScript, each_expr};
use crate::strings::own_number;

/// Returns true if the script may get hold of the machine's own strings. Code that never runs on
/// this robot counts too, because other robots may send such a string.
pub fn may_observe_builtin_strings(program: &ResolvedScript, meanings: &Meanings<'_>) -> bool {
    // A variable with the name of a built-in holds the built-in at first.
    let gets_them = program.names.iter().any(|name| {
        let is_used = !name.reads.is_empty() || !name.calls.is_empty();
        is_used && gives_own_strings(meanings.offered(&name.text))
    });
    let mut writes_them = false;
    for function in &program.functions {
        // The names of fields do not count: they become values only if a table is iterated.
        each_expr(&function.body, &mut |expr| {
            if let CheckedExprKind::Str(text) = &expr.kind {
                writes_them |= own_number(text).is_some();
            }
        });
    }
    gets_them || writes_them
}

/// Returns true for built-ins that return names of types, or keys of tables that the machine made.
fn gives_own_strings(meaning: Meaning) -> bool {
    matches!(
        meaning,
        Meaning::Builtin(
            builtin::TYPE | builtin::FOREACH | builtin::MAP | builtin::FILTER | builtin::REDUCE
        )
    )
}
