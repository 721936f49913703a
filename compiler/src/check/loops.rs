//! Finds loops that never end, because nothing in them changes the condition, and loops that take
//! numbers from 0 on for the ids of neighbors.

use bittybuzz_vm_core::builtin;

use crate::ast::BinaryOp;
use crate::check::names::{Meaning, Meanings};
use crate::check::tree::{
    CheckedBlock, CheckedExpr, CheckedExprKind, CheckedStmt, CheckedStmtKind, LocalKind, NameId,
    ResolvedScript, children, each_expr, each_stmt,
};
use crate::check::tree::{CheckedFunction, LocalId};
use crate::codes::DiagnosticCode;
use crate::diagnostic::Diagnostic;

/// Checks every loop of a script.
pub fn check_loops(program: &ResolvedScript, meanings: &Meanings<'_>) -> Vec<Diagnostic> {
    let mut diagnostics = Vec::new();
    // A statement with a syntax error may change the condition.
    if program.hidden.is_any() {
        return diagnostics;
    }
    for function in &program.functions {
        each_stmt(&function.body, &mut |stmt| {
            if let CheckedStmtKind::While { condition, body, update } = &stmt.kind {
                let body = LoopBody { body, update: update.as_deref() };
                let checked = LoopCheck { program, meanings, function };
                diagnostics.extend(checked.endless(condition, &body));
                diagnostics.extend(checked.neighbors_by_number(condition, &body));
            }
        });
    }
    diagnostics
}

struct LoopBody<'a> {
    body: &'a CheckedBlock,
    update: Option<&'a CheckedStmt>,
}

impl<'a> LoopBody<'a> {
    fn stmts(&self) -> [&'a [CheckedStmt]; 2] {
        [&self.body.stmts, self.update.map_or(&[], std::slice::from_ref)]
    }

    fn each_stmt(&self, visit: &mut dyn FnMut(&'a CheckedStmt)) {
        self.stmts().into_iter().for_each(|stmts| each_stmt(stmts, visit));
    }

    fn each_expr(&self, visit: &mut dyn FnMut(&'a CheckedExpr)) {
        self.stmts().into_iter().for_each(|stmts| each_expr(stmts, visit));
    }
}

struct LoopCheck<'a> {
    program: &'a ResolvedScript,
    meanings: &'a Meanings<'a>,
    function: &'a CheckedFunction,
}

impl LoopCheck<'_> {
    /// Returns the warning about a loop that never ends once it has begun. A `return` may end any.
    fn endless(&self, condition: &CheckedExpr, body: &LoopBody<'_>) -> Option<Diagnostic> {
        let mut has_return = false;
        body.each_stmt(&mut |stmt| has_return |= matches!(stmt.kind, CheckedStmtKind::Return(_)));
        let is_never = match condition.kind {
            CheckedExprKind::Nil | CheckedExprKind::Int(0) | CheckedExprKind::Error => true,
            CheckedExprKind::Name(name) => self.meanings.of(name) == Meaning::Nil,
            _ => false,
        };
        if has_return || is_never || !self.stays(condition, body) {
            return None;
        }
        Some(
            Diagnostic::new(
                DiagnosticCode::EndlessLoop,
                condition.span,
                "nothing in this loop changes its condition: once it begins, it never ends",
            )
            .label("the same in each turn")
            .help(
                "a robot acts and hears others between two steps: test it with `if` once per step, without a loop",
            ),
        )
    }

    /// Returns true if the value of an expression is the same in each turn of a loop.
    fn stays(&self, expr: &CheckedExpr, body: &LoopBody<'_>) -> bool {
        let stays = match &expr.kind {
            CheckedExprKind::Local(local) => self.local_stays(*local, body),
            CheckedExprKind::Name(name) => self.name_stays(*name, body),
            CheckedExprKind::Call { callee, args } => {
                // Messages are handled between two steps.
                let is_count = self
                    .meanings
                    .built_in(callee)
                    .is_some_and(|info| info.number == builtin::NEIGHBORS_COUNT);
                return is_count && args.is_empty();
            }
            CheckedExprKind::Field { .. }
            | CheckedExprKind::Index { .. }
            | CheckedExprKind::Table(_)
            | CheckedExprKind::Lambda(_)
            | CheckedExprKind::SelfValue
            | CheckedExprKind::Error => false,
            CheckedExprKind::Nil
            | CheckedExprKind::Int(_)
            | CheckedExprKind::Float(_)
            | CheckedExprKind::Str(_)
            | CheckedExprKind::Unary { .. }
            | CheckedExprKind::Chain { .. } => true,
        };
        let mut all = stays;
        children(expr, |child| all &= self.stays(child, body));
        all
    }

    fn local_stays(&self, local: LocalId, body: &LoopBody<'_>) -> bool {
        let mut is_assigned =
            matches!(self.function.local(local).kind, LocalKind::Captured { assigned: true, .. });
        body.each_stmt(&mut |stmt| {
            if let CheckedStmtKind::Assign { target, .. } = &stmt.kind {
                is_assigned |= matches!(target.kind, CheckedExprKind::Local(it) if it == local);
            }
        });
        !is_assigned
    }

    /// A function that the loop calls may assign a global.
    fn name_stays(&self, name: NameId, body: &LoopBody<'_>) -> bool {
        if self.meanings.of(name) != Meaning::Global {
            return true;
        }
        let mut may_change = false;
        body.each_stmt(&mut |stmt| {
            if let CheckedStmtKind::Assign { target, .. } = &stmt.kind {
                may_change |= matches!(target.kind, CheckedExprKind::Name(it) if it == name);
            }
        });
        body.each_expr(&mut |expr| {
            if let CheckedExprKind::Call { callee, args } = &expr.kind {
                let is_known = match &callee.kind {
                    CheckedExprKind::Name(callee) => {
                        matches!(self.meanings.of(*callee), Meaning::Builtin(_) | Meaning::Robot)
                    }
                    _ => self.meanings.built_in(callee).is_some(),
                };
                let calls_back = args.iter().any(|arg| self.meanings.function(arg).is_some());
                may_change |= !is_known || calls_back;
            }
        });
        !may_change
    }

    /// Returns the warning about `neighbors.get(i)` in a loop over `i < neighbors.count()`.
    fn neighbors_by_number(
        &self,
        condition: &CheckedExpr,
        body: &LoopBody<'_>,
    ) -> Option<Diagnostic> {
        let CheckedExprKind::Chain { first, links } = &condition.kind else { return None };
        let [link] = links.as_slice() else { return None };
        let is_count = |expr: &CheckedExpr| match &expr.kind {
            CheckedExprKind::Call { callee, .. } => self
                .meanings
                .built_in(callee)
                .is_some_and(|info| info.number == builtin::NEIGHBORS_COUNT),
            _ => false,
        };
        let is_bound =
            matches!(link.op, BinaryOp::Less | BinaryOp::LessEq) && is_count(&link.right);
        if !is_bound {
            return None;
        }
        let counter = |expr: &CheckedExpr| match (&first.kind, &expr.kind) {
            (CheckedExprKind::Local(one), CheckedExprKind::Local(other)) => one == other,
            (CheckedExprKind::Name(one), CheckedExprKind::Name(other)) => one == other,
            _ => false,
        };
        let mut found = None;
        let program = self.program;
        body.each_expr(&mut |expr| {
            if let CheckedExprKind::Call { callee, args } = &expr.kind
                && let [arg] = args.as_slice()
                && counter(arg)
                && self
                    .meanings
                    .built_in(callee)
                    .is_some_and(|info| info.number == builtin::NEIGHBORS_GET)
            {
                found = found.or(Some(arg.span));
            }
        });
        let name = match first.kind {
            CheckedExprKind::Local(local) => &self.function.local(local).name,
            CheckedExprKind::Name(name) => &program.name(name).text,
            _ => return None,
        };
        let message =
            format!("`neighbors.get` takes the id of a robot, and `{name}` counts from 0");
        Some(
            Diagnostic::new(DiagnosticCode::NeighborByNumber, found?, message)
                .label("not the id of a neighbor")
                .help("visit all neighbors by `neighbors.foreach(function(rid, data) { ... })`"),
        )
    }
}
