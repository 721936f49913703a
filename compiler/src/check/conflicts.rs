//! Finds handlers of conflicts that choose the same side in every case.
//!
//! Both robots of a conflict call their handlers, and each calls the other's entry `remote`. Only a
//! choice that depends on the entries can be the same on both sides.

use std::collections::BTreeSet;

use bittybuzz_vm_core::builtin;

use crate::check::names::Meanings;
use crate::check::resolve::leaves;
use crate::check::tree::{
    CheckedExpr, CheckedExprKind, CheckedFunction, CheckedStmtKind, LocalId, ResolvedScript,
    each_expr, each_stmt,
};
use crate::codes::DiagnosticCode;
use crate::diagnostic::Diagnostic;
use crate::source::Span;

/// The parameter of a handler that holds the entry of this robot.
const LOCAL: LocalId = LocalId(1);
/// The parameter of a handler that holds the entry that was received.
const REMOTE: LocalId = LocalId(2);
/// The field of an entry, and of a result, by which the machine tells which entry is chosen.
const DATA: &str = "data";

/// Checks every handler of a script.
pub fn check_conflicts(program: &ResolvedScript, meanings: &Meanings<'_>) -> Vec<Diagnostic> {
    // A statement with a syntax error may return the other side.
    if program.hidden.is_any() {
        return Vec::new();
    }
    let (mut diagnostics, mut known) = (Vec::new(), BTreeSet::new());
    for function in &program.functions {
        each_expr(&function.body, &mut |expr| {
            if let CheckedExprKind::Call { callee, args } = &expr.kind
                && let [arg] = args.as_slice()
                && meanings
                    .built_in(callee)
                    .is_some_and(|info| info.number == builtin::STIGMERGY_ONCONFLICT)
                && let Some(handler) = meanings.function(arg)
                && known.insert(handler)
            {
                diagnostics.extend(one_sided(program.function(handler), arg.span));
            }
        });
    }
    diagnostics
}

/// Returns a warning if each result of the handler is the entry of one side, or has its data.
fn one_sided(handler: &CheckedFunction, call: Span) -> Option<Diagnostic> {
    // At the end of its body a function returns nil, which decides nothing.
    if !handler.body.iter().any(leaves) {
        return None;
    }
    let mut results = Vec::new();
    each_stmt(&handler.body, &mut |stmt| {
        if let CheckedStmtKind::Return(value) = &stmt.kind {
            results.push(value.as_ref());
        }
    });
    let first = (*results.first()?)?;
    let side = side_of(first, handler)?;
    if !results.iter().all(|result| result.and_then(|it| side_of(it, handler)) == Some(side)) {
        return None;
    }
    let name = |side: LocalId| {
        let parameter = handler.locals.get(side.0).filter(|_| side.0 < handler.parameters);
        parameter.map_or(if side == LOCAL { "local" } else { "remote" }, |it| it.name.as_str())
    };
    let (local, remote) = (name(LOCAL), name(REMOTE));
    let (message, label) = if side == LOCAL {
        (
            "each robot would keep its own entry, so the greater id wins as without a handler",
            "always this robot's entry",
        )
    } else {
        (
            "the robots would exchange their entries, so the greater id wins as without a handler",
            "always the other robot's entry",
        )
    };
    let mut diagnostic = Diagnostic::new(DiagnosticCode::OneSidedConflict, first.span, message)
        .label(label)
        .help(format!(
            "choose by the entries, so that both robots choose the same one: \
             `if({local}.data > {remote}.data) return {local} else return {remote}`"
        ));
    if handler.name.is_some() {
        diagnostic = diagnostic.related(call, "decides conflicts here");
    }
    Some(diagnostic)
}

/// Returns the parameter whose data a result of the handler certainly has.
fn side_of(result: &CheckedExpr, handler: &CheckedFunction) -> Option<LocalId> {
    match &result.kind {
        CheckedExprKind::Local(local) => source_of(*local, handler),
        CheckedExprKind::Table(entries) => {
            let mut data = entries.iter().filter(|(key, _)| is_data(key));
            let CheckedExprKind::Field { object, key, .. } = &data.next_back()?.1.kind else {
                return None;
            };
            let CheckedExprKind::Local(local) = object.kind else { return None };
            if key == DATA { source_of(local, handler) } else { None }
        }
        _ => None,
    }
}

fn is_data(key: &CheckedExpr) -> bool {
    matches!(&key.kind, CheckedExprKind::Str(key) if key == DATA)
}

/// Returns the parameter that a local certainly holds: itself, or the only value of a variable.
fn source_of(local: LocalId, handler: &CheckedFunction) -> Option<LocalId> {
    let (mut values, mut is_changed) = (Vec::new(), false);
    each_stmt(&handler.body, &mut |stmt| match &stmt.kind {
        CheckedStmtKind::Var { local: declared, value } if *declared == local => {
            values.push(value.as_ref());
        }
        CheckedStmtKind::Assign { target, .. } => is_changed |= is_inside(target, local),
        _ => {}
    });
    match values.as_slice() {
        _ if is_changed => None,
        [] => {
            [LOCAL, REMOTE].into_iter().find(|side| *side == local && side.0 < handler.parameters)
        }
        [Some(CheckedExpr { kind: CheckedExprKind::Local(from), .. })] => source_of(*from, handler),
        _ => None,
    }
}

/// Returns true if an assignment to `target` changes a local or a field of its table.
fn is_inside(target: &CheckedExpr, local: LocalId) -> bool {
    match &target.kind {
        CheckedExprKind::Local(changed) => *changed == local,
        CheckedExprKind::Field { object, .. } | CheckedExprKind::Index { object, .. } => {
            is_inside(object, local)
        }
        _ => false,
    }
}
