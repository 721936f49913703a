//! Finds library functions that are used without a call although their result is meant, and
//! stigmergies that every step creates again.

use std::collections::{BTreeMap, BTreeSet};

use bittybuzz_vm_core::builtin::{self, BuiltinInfo};

use crate::ast::{BinaryOp, UnaryOp};
use crate::check::names::{LibraryMember, Meaning, Meanings};
use crate::check::suggest;
use crate::check::tree::{
    CheckedBranch, CheckedExpr, CheckedExprKind, CheckedLink, CheckedStmt, CheckedStmtKind,
    FunctionId, LocalId, NameId, ResolvedScript, children,
};
use crate::codes::DiagnosticCode;
use crate::diagnostic::Diagnostic;
use crate::source::Span;

/// Checks a whole script.
pub fn check_forgotten(program: &ResolvedScript, meanings: &Meanings<'_>) -> Vec<Diagnostic> {
    let mut scan = Scan {
        meanings,
        function: FunctionId::GLOBAL,
        diagnostics: Vec::new(),
        operands: BTreeSet::new(),
        stored: BTreeMap::new(),
        others: BTreeSet::new(),
    };
    for (number, function) in program.functions.iter().enumerate() {
        scan.function = FunctionId(number);
        scan.stmts(&function.body);
        if let Some(creator) = function.creator {
            let captures = function.captures.iter();
            scan.others.extend(captures.map(|capture| Variable::Local(creator, *capture)));
        }
    }
    let Scan { mut diagnostics, operands, stored, others, .. } = scan;
    for (variable, (info, span)) in stored {
        let is_function = match variable {
            Variable::Local(function, local) => {
                let local = &program.function(function).local(local).name;
                others.contains(&variable) || program.hidden.is_lost(local)
            }
            Variable::Global(name) => {
                let name = program.name(name);
                program.hidden.is_lost(&name.text)
                    || !name.calls.is_empty()
                    || !name.reads.iter().all(|read| operands.contains(read))
            }
        };
        if !is_function {
            diagnostics.push(forgotten(info, span));
        }
    }
    diagnostics.extend(created_in_step(program, meanings));
    diagnostics
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Variable {
    Global(NameId),
    Local(FunctionId, LocalId),
}

struct Scan<'a> {
    meanings: &'a Meanings<'a>,
    function: FunctionId,
    diagnostics: Vec<Diagnostic>,
    /// Places where the value of a global is computed with, compared, tested or printed.
    operands: BTreeSet<Span>,
    /// Variables that are assigned a library function without parameters, with the place of that
    /// assignment.
    stored: BTreeMap<Variable, (&'static BuiltinInfo, Span)>,
    /// Locals that are used other than as operands.
    others: BTreeSet<Variable>,
}

impl Scan<'_> {
    fn stmts(&mut self, stmts: &[CheckedStmt]) {
        for stmt in stmts {
            self.stmt(stmt);
        }
    }

    fn stmt(&mut self, stmt: &CheckedStmt) {
        match &stmt.kind {
            CheckedStmtKind::Var { local, value } => {
                if let Some(value) = value {
                    self.store(Variable::Local(self.function, *local), value);
                }
            }
            CheckedStmtKind::Assign { target, value } => match target.kind {
                CheckedExprKind::Name(name) => self.store(Variable::Global(name), value),
                CheckedExprKind::Local(local) => {
                    self.store(Variable::Local(self.function, local), value);
                }
                _ => {
                    self.expr(target);
                    self.expr(value);
                }
            },
            CheckedStmtKind::If { branches, otherwise } => {
                for CheckedBranch { condition, then } in branches {
                    self.operand(condition, 0);
                    self.stmts(&then.stmts);
                }
                self.stmts(&otherwise.stmts);
            }
            CheckedStmtKind::While { condition, body, update } => {
                self.operand(condition, 0);
                self.stmts(&body.stmts);
                update.iter().for_each(|update| self.stmt(update));
            }
            CheckedStmtKind::Return(value) => value.iter().for_each(|value| self.expr(value)),
            CheckedStmtKind::Call(call) => self.expr(call),
        }
    }

    fn store(&mut self, variable: Variable, value: &CheckedExpr) {
        match self.uncalled(value, 0) {
            Some(info) => {
                self.stored.entry(variable).or_insert((info, value.span));
            }
            None => self.expr(value),
        }
    }

    /// Returns the library function that an expression refers to without calling it; `most` is the
    /// maximum number of arguments that the function may take.
    fn uncalled(&self, expr: &CheckedExpr, most: u8) -> Option<&'static BuiltinInfo> {
        if !matches!(expr.kind, CheckedExprKind::Field { .. }) {
            return None;
        }
        let info = self.meanings.built_in(expr)?;
        (info.kind != builtin::BuiltinKind::Value && info.max <= most).then_some(info)
    }

    /// Visits an expression whose value is computed with, compared, tested or printed.
    fn operand(&mut self, expr: &CheckedExpr, most: u8) {
        match &expr.kind {
            CheckedExprKind::Name(_) => {
                self.operands.insert(expr.span);
            }
            CheckedExprKind::Local(_) => {}
            _ => match self.uncalled(expr, most) {
                Some(info) => self.diagnostics.push(forgotten(info, expr.span)),
                None => self.expr(expr),
            },
        }
    }

    fn expr(&mut self, expr: &CheckedExpr) {
        match &expr.kind {
            CheckedExprKind::Local(local) => {
                self.others.insert(Variable::Local(self.function, *local));
            }
            CheckedExprKind::Chain { first, links } => {
                let mut left = Some(&**first);
                for CheckedLink { op, right, .. } in links {
                    let most = match op {
                        BinaryOp::And | BinaryOp::Or | BinaryOp::Eq | BinaryOp::NotEq => 0,
                        _ => u8::MAX,
                    };
                    let sides = left.take().into_iter().chain([right]);
                    let is_nil_test = matches!(op, BinaryOp::Eq | BinaryOp::NotEq)
                        && sides.clone().any(|side| matches!(side.kind, CheckedExprKind::Nil));
                    for side in sides {
                        if is_nil_test { self.expr(side) } else { self.operand(side, most) }
                    }
                }
            }
            CheckedExprKind::Unary { op, operand } => {
                self.operand(operand, if *op == UnaryOp::Not { 0 } else { u8::MAX });
            }
            CheckedExprKind::Call { callee, args } => {
                self.expr(callee);
                let is_log = matches!(callee.kind, CheckedExprKind::Name(name)
                    if self.meanings.of(name) == Meaning::Builtin(builtin::LOG));
                for arg in args {
                    if is_log { self.operand(arg, 0) } else { self.expr(arg) }
                }
            }
            _ => children(expr, |child| self.expr(child)),
        }
    }
}

fn forgotten(info: &BuiltinInfo, span: Span) -> Diagnostic {
    let path = suggest::path(info);
    let diagnostic = Diagnostic::new(
        DiagnosticCode::CallForgotten,
        span,
        format!("`{path}` is a function, not its result"),
    )
    .label("not called");
    match info.max {
        0 => {
            let end = Span { start: span.end, ..span };
            diagnostic.help(format!("did you mean `{path}()`?")).guess(end, "()")
        }
        _ => diagnostic.help(format!("call it: {}", info.help)),
    }
}

/// Returns a warning for the first `stigmergy.create` that every step runs.
fn created_in_step(program: &ResolvedScript, meanings: &Meanings<'_>) -> Option<Diagnostic> {
    // A statement with a syntax error may return from `step` before.
    let step = program.find_name("step").filter(|_| !program.hidden.is_any())?;
    let Meaning::Function(step) = meanings.of(step) else { return None };
    for stmt in &program.function(step).body {
        let value = match &stmt.kind {
            CheckedStmtKind::Var { value, .. } => value.as_ref(),
            CheckedStmtKind::Assign { value, .. } | CheckedStmtKind::Call(value) => Some(value),
            // After a conditional statement, not every step may continue. After a return, none
            // does.
            CheckedStmtKind::If { .. }
            | CheckedStmtKind::While { .. }
            | CheckedStmtKind::Return(_) => return None,
        };
        let Some(value) = value else { continue };
        if let CheckedExprKind::Call { callee, .. } = &value.kind
            && let CheckedExprKind::Field { object, key, .. } = &callee.kind
            && let Some(library) = meanings.library(object)
            && let LibraryMember::Known(info) = meanings.member(library, key)
            && info.number == builtin::STIGMERGY_CREATE
        {
            return Some(
                Diagnostic::new(
                    DiagnosticCode::CreateInStep,
                    value.span,
                    "every step creates the stigmergy again and loses its entries",
                )
                .label("empty again in each step")
                .help("create it once, in `init`"),
            );
        }
    }
    None
}
