//! Finds the calls whose results a script uses as texts.

use std::collections::HashSet;

use bittybuzz_vm_core::builtin::{self, Library};

use crate::ast::BinaryOp;
use crate::check::names::{LibraryMember, Meanings};
use crate::check::tree::{
    CheckedExpr, CheckedExprKind, CheckedStmtKind, FunctionId, LocalId, NameId, ResolvedScript,
    each_expr, each_stmt,
};
use crate::source::Span;

/// A variable.
#[derive(PartialEq, Eq, Hash)]
pub enum Holder {
    Local(FunctionId, LocalId),
    Global(NameId),
}

/// Returns the places of calls whose results go to a function of the library of strings, or are
/// compared with a text, directly or through one variable.
pub fn texts(program: &ResolvedScript, meanings: &Meanings<'_>) -> HashSet<Span> {
    let mut places = HashSet::new();
    let mut holders = HashSet::new();
    let functions = || (0..).map(FunctionId).zip(&program.functions);
    for (id, function) in functions() {
        each_expr(&function.body, &mut |expr| {
            for text in used_as_text(expr, meanings) {
                places
                    .extend(matches!(text.kind, CheckedExprKind::Call { .. }).then_some(text.span));
                holders.extend(holder(id, text));
            }
        });
    }
    for (id, function) in functions() {
        each_stmt(&function.body, &mut |stmt| {
            let (held, value) = match &stmt.kind {
                CheckedStmtKind::Var { local, value: Some(value) } => {
                    (Some(Holder::Local(id, *local)), value)
                }
                CheckedStmtKind::Assign { target, value } => (holder(id, target), value),
                _ => return,
            };
            let is_call = matches!(value.kind, CheckedExprKind::Call { .. });
            if is_call && held.is_some_and(|held| holders.contains(&held)) {
                places.insert(value.span);
            }
        });
    }
    places
}

/// Returns the variable that an expression in a function names.
pub fn holder(function: FunctionId, expr: &CheckedExpr) -> Option<Holder> {
    match expr.kind {
        CheckedExprKind::Local(local) => Some(Holder::Local(function, local)),
        CheckedExprKind::Name(name) => Some(Holder::Global(name)),
        _ => None,
    }
}

/// Returns the parts of an expression that must be texts.
fn used_as_text<'a>(expr: &'a CheckedExpr, meanings: &Meanings<'_>) -> Vec<&'a CheckedExpr> {
    match &expr.kind {
        CheckedExprKind::Call { callee, args } => {
            let CheckedExprKind::Field { object, key, .. } = &callee.kind else {
                return Vec::new();
            };
            if meanings.library(object) != Some(Library::String) {
                return Vec::new();
            }
            match meanings.member(Library::String, key) {
                // It takes any value.
                LibraryMember::Known(info) if info.number == builtin::TO_STRING => Vec::new(),
                LibraryMember::Known(info) if info.number == builtin::CONCAT => {
                    args.iter().collect()
                }
                _ => args.iter().take(1).collect(),
            }
        }
        CheckedExprKind::Chain { first, links } => match links.as_slice() {
            [link] if matches!(link.op, BinaryOp::Eq | BinaryOp::NotEq) => {
                let is_text = |side: &CheckedExpr| matches!(side.kind, CheckedExprKind::Str(_));
                let sides = [(&**first, &link.right), (&link.right, &**first)];
                sides.iter().filter(|(_, other)| is_text(other)).map(|(side, _)| *side).collect()
            }
            _ => Vec::new(),
        },
        _ => Vec::new(),
    }
}
