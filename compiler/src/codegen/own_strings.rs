//! Whether a script can get hold of the machine's own strings, such as the name of a type or of a neighbor's field.
//!
//! Where it cannot, the numbers of its strings are their order.

use bittybuzz_vm_core::builtin;

use crate::check::names::{Meaning, Meanings};
use crate::check::tree::{Block, Expr, ExprKind, NameId, Program, Stmt, StmtKind, children};
use crate::strings::own_number;

/// Looks at the whole script, also at what is never run on this robot: others may send it.
pub fn may_hold(program: &Program, meanings: &Meanings<'_>) -> bool {
    let names_them = program.names.iter().enumerate().any(|(number, name)| {
        let is_used = !name.reads.is_empty() || !name.calls.is_empty();
        let meaning = meanings.of(NameId(number));
        is_used && matches!(meaning, Meaning::Builtin(builtin) if gives_own_strings(builtin))
    });
    names_them || program.functions.iter().any(|f| in_stmts(&f.body))
}

/// Built-ins that give names of types, or keys of tables that the machine made.
fn gives_own_strings(number: u8) -> bool {
    matches!(
        number,
        builtin::TYPE | builtin::FOREACH | builtin::MAP | builtin::FILTER | builtin::REDUCE
    )
}

fn in_block(block: &Block) -> bool {
    in_stmts(&block.stmts)
}

fn in_stmts(stmts: &[Stmt]) -> bool {
    stmts.iter().any(in_stmt)
}

fn in_stmt(stmt: &Stmt) -> bool {
    match &stmt.kind {
        StmtKind::Var { value, .. } | StmtKind::Return(value) => {
            value.as_ref().is_some_and(in_expr)
        }
        StmtKind::Assign { target, value } => in_expr(target) || in_expr(value),
        StmtKind::If { condition, then, otherwise } => {
            in_expr(condition) || in_block(then) || in_block(otherwise)
        }
        StmtKind::While { condition, body, update } => {
            in_expr(condition) || in_block(body) || update.as_deref().is_some_and(in_stmt)
        }
        StmtKind::Call(call) => in_expr(call),
    }
}

fn in_expr(expr: &Expr) -> bool {
    match &expr.kind {
        ExprKind::Str(text) => own_number(text).is_some(),
        // A key becomes a value only where the table is iterated.
        ExprKind::Table(entries) => entries.iter().any(|(_, value)| in_expr(value)),
        _ => {
            let mut found = false;
            children(expr, |child| found = found || in_expr(child));
            found
        }
    }
}
