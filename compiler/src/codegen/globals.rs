//! Numbers the globals: those that the code names most often first, because the first numbers have short instructions.

use std::collections::BTreeMap;

use crate::check::names::{Meaning, Meanings};
use crate::check::tree::{Block, Expr, ExprKind, NameId, Program, Stmt, StmtKind, children};

/// The names that are global variables, by number.
pub fn number(program: &Program, meanings: &Meanings<'_>) -> Vec<NameId> {
    let mut uses: BTreeMap<NameId, usize> = (0..program.names.len())
        .map(NameId)
        .filter(|id| meanings.of(*id) == Meaning::Global)
        .map(|id| (id, 0))
        .collect();
    for function in &program.functions {
        count_stmts(&function.body, &mut uses);
    }
    let mut names: Vec<NameId> = uses.keys().copied().collect();
    // Stable: equal counts stay in order of appearance.
    names.sort_by_key(|id| std::cmp::Reverse(uses.get(id).copied().unwrap_or(0)));
    names
}

fn count_block(block: &Block, uses: &mut BTreeMap<NameId, usize>) {
    count_stmts(&block.stmts, uses);
}

fn count_stmts(stmts: &[Stmt], uses: &mut BTreeMap<NameId, usize>) {
    for stmt in stmts {
        count_stmt(stmt, uses);
    }
}

fn count_stmt(stmt: &Stmt, uses: &mut BTreeMap<NameId, usize>) {
    match &stmt.kind {
        StmtKind::Var { value, .. } | StmtKind::Return(value) => {
            if let Some(value) = value {
                count_expr(value, uses);
            }
        }
        StmtKind::Assign { target, value } => {
            count_expr(target, uses);
            count_expr(value, uses);
        }
        StmtKind::If { condition, then, otherwise } => {
            count_expr(condition, uses);
            count_block(then, uses);
            count_block(otherwise, uses);
        }
        StmtKind::While { condition, body, update } => {
            count_expr(condition, uses);
            count_block(body, uses);
            if let Some(update) = update {
                count_stmt(update, uses);
            }
        }
        StmtKind::Call(call) => count_expr(call, uses),
    }
}

fn count_expr(expr: &Expr, uses: &mut BTreeMap<NameId, usize>) {
    if let ExprKind::Name(name) = expr.kind
        && let Some(count) = uses.get_mut(&name)
    {
        *count += 1;
    }
    children(expr, |child| count_expr(child, uses));
}
