//! Whether a script can get hold of the machine's own strings, such as the name of a type or of a neighbor's field.
//!
//! Where it cannot, the numbers of its strings are their order.

use bittybuzz_vm_core::builtin;

use crate::check::names::{Meaning, Meanings};
use crate::check::tree::{ExprKind, ResolvedScript, each_expr};
use crate::strings::own_number;

/// Looks at the whole script, also at what is never run on this robot: others may send it.
pub fn may_observe_builtin_strings(program: &ResolvedScript, meanings: &Meanings<'_>) -> bool {
    // A variable of such a name holds the built-in at first.
    let gets_them = program.names.iter().any(|name| {
        let is_used = !name.reads.is_empty() || !name.calls.is_empty();
        is_used && gives_own_strings(meanings.offered(&name.text))
    });
    let mut writes_them = false;
    for function in &program.functions {
        // Names of fields are no values, unless the table is iterated.
        each_expr(&function.body, &mut |expr| {
            if let ExprKind::Str(text) = &expr.kind {
                writes_them |= own_number(text).is_some();
            }
        });
    }
    gets_them || writes_them
}

/// Built-ins that give names of types, or keys of tables that the machine made.
fn gives_own_strings(meaning: Meaning) -> bool {
    matches!(
        meaning,
        Meaning::Builtin(
            builtin::TYPE | builtin::FOREACH | builtin::MAP | builtin::FILTER | builtin::REDUCE
        )
    )
}
