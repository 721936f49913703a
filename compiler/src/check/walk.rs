//! Visits every expression of a script and checks it with knowledge of the conditions around it.

use bittybuzz_vm_core::builtin;

use crate::ast::{BinaryOp, UnaryOp};
use crate::check::checker::Checker;
use crate::check::names::{LibraryMember, Meaning, Meanings};
use crate::check::resolve::self_is_nil;
use crate::check::suggest;
use crate::check::tree::{
    CheckedBlock, CheckedBranch, CheckedExpr, CheckedExprKind, CheckedLink, CheckedStmt,
    CheckedStmtKind, FunctionId, NameId, ResolvedScript,
};
use crate::check::values::{OperandValue, StaticType, kind_of, result_kind};
use crate::codes::DiagnosticCode;
use crate::diagnostic::Diagnostic;
use crate::profile::NumberProfile;
use crate::source::Span;

/// Checks every expression of a script.
pub fn check_expressions(
    program: &ResolvedScript,
    meanings: &Meanings<'_>,
    profile: NumberProfile,
) -> Vec<Diagnostic> {
    let mut checker = Checker::new(program, meanings, profile);
    for (number, function) in program.functions.iter().enumerate() {
        // A lambda is visited where it occurs, under the conditions around it.
        if function.creator.is_none() {
            checker.enter(FunctionId(number));
        }
    }
    checker.diagnostics
}

impl Checker<'_> {
    fn enter(&mut self, id: FunctionId) {
        let outer = std::mem::replace(&mut self.function, id);
        let program = self.program;
        self.stmts(&program.function(id).body);
        self.function = outer;
    }

    fn stmts(&mut self, stmts: &[CheckedStmt]) {
        for stmt in stmts {
            self.stmt(stmt);
        }
    }

    fn block(&mut self, block: &CheckedBlock) {
        self.stmts(&block.stmts);
    }

    fn stmt(&mut self, stmt: &CheckedStmt) {
        match &stmt.kind {
            CheckedStmtKind::Var { value, .. } | CheckedStmtKind::Return(value) => {
                if let Some(value) = value {
                    self.expr(value);
                }
            }
            CheckedStmtKind::Assign { target, value } => {
                self.target(target);
                self.expr(value);
            }
            CheckedStmtKind::If { branches, otherwise } => {
                let before = self.guarded.len();
                for CheckedBranch { condition, then } in branches {
                    self.tested(condition);
                    self.under(not_nil_if(condition, true, self.meanings), |me| me.block(then));
                    self.guarded.extend(not_nil_if(condition, false, self.meanings));
                }
                self.block(otherwise);
                self.guarded.truncate(before);
            }
            CheckedStmtKind::While { condition, body, update } => {
                self.tested(condition);
                self.under(not_nil_if(condition, true, self.meanings), |me| {
                    me.block(body);
                    if let Some(update) = update {
                        me.stmt(update);
                    }
                });
            }
            CheckedStmtKind::Call(call) => self.expr(call),
        }
    }

    /// Visits code that runs only if these names are not nil.
    fn under(&mut self, names: Vec<NameId>, visit: impl FnOnce(&mut Self)) {
        let before = self.guarded.len();
        self.guarded.extend(names);
        visit(self);
        self.guarded.truncate(before);
    }

    fn target(&mut self, target: &CheckedExpr) {
        match &target.kind {
            CheckedExprKind::Field { object, .. } => self.expr(object),
            CheckedExprKind::Index { object, index } => {
                self.expr(object);
                self.expr(index);
                self.check_key(index);
            }
            _ => {}
        }
    }

    /// Visits an expression of which only the truth counts, where a name may be nil.
    fn tested(&mut self, expr: &CheckedExpr) {
        match &expr.kind {
            CheckedExprKind::Name(name) => self.tested_name(*name, expr.span),
            CheckedExprKind::Unary { op: UnaryOp::Not, operand } => self.tested(operand),
            CheckedExprKind::Chain { first, links }
                if links.iter().any(|link| link.op.is_logic()) =>
            {
                self.tested_in_row(first, links);
            }
            CheckedExprKind::Call { callee, args } => {
                match is_nil_test(callee, args, self.meanings) {
                    Some(name) => {
                        self.tested_name(name, args.first().map_or(expr.span, |arg| arg.span))
                    }
                    None => self.expr(expr),
                }
            }
            _ => self.expr(expr),
        }
    }

    /// Visits the operands of `and` and `or`. Each is guarded by the operands before it.
    fn tested_in_row(&mut self, first: &CheckedExpr, links: &[CheckedLink]) {
        let outside = self.guarded.len();
        self.tested(first);
        let (mut before, mut run) = (first, links.first().map(|link| link.op));
        for link in links {
            if run == Some(link.op) {
                let names = not_nil_if(before, link.op == BinaryOp::And, self.meanings);
                self.guarded.extend(names);
            } else {
                // A true `or` guarantees none of its operands, and neither does a false `and`.
                self.guarded.truncate(outside);
                run = Some(link.op);
            }
            self.tested(&link.right);
            before = &link.right;
        }
        self.guarded.truncate(outside);
    }

    /// Visits a name whose value is only tested. Testing for a function of another robot is not
    /// reported, because a script for robots of several types needs such tests.
    fn tested_name(&mut self, name: NameId, span: Span) {
        let text = &self.program.name(name).text;
        if self.meanings.robots().elsewhere(text).is_empty() && text != "string" {
            self.name(name, span);
        }
    }

    fn expr(&mut self, expr: &CheckedExpr) {
        match &expr.kind {
            CheckedExprKind::Int(value) => self.check_int(*value, expr.span),
            CheckedExprKind::Float(value) => self.check_float(*value, expr.span),
            CheckedExprKind::Name(name) => self.name(*name, expr.span),
            CheckedExprKind::SelfValue => self.self_value(expr.span),
            CheckedExprKind::Lambda(function) => self.enter(*function),
            CheckedExprKind::Call { callee, args } => {
                self.callee(callee);
                args.iter().for_each(|arg| self.expr(arg));
                self.check_call(callee, args, expr.span);
            }
            CheckedExprKind::Field { object, key, key_span } => {
                self.expr(object);
                self.member(object, key, *key_span);
            }
            CheckedExprKind::Unary { op: UnaryOp::Not, .. } => self.tested(expr),
            CheckedExprKind::Chain { links, .. } if links.iter().any(|link| link.op.is_logic()) => {
                self.tested(expr);
            }
            CheckedExprKind::Chain { first, links } => self.operations(first, links),
            CheckedExprKind::Unary { op, operand } => {
                self.expr(operand);
                self.check_unary(*op, operand, expr.span);
            }
            CheckedExprKind::Index { object, index } => {
                self.expr(object);
                self.expr(index);
                self.check_key(index);
            }
            CheckedExprKind::Table(entries) => {
                for (key, value) in entries {
                    self.expr(key);
                    self.expr(value);
                }
            }
            CheckedExprKind::Nil
            | CheckedExprKind::Str(_)
            | CheckedExprKind::Local(_)
            | CheckedExprKind::Error => {}
        }
    }

    fn operations(&mut self, first: &CheckedExpr, links: &[CheckedLink]) {
        let mut links = links.iter();
        let mut left = OperandValue { kind: kind_of(first, self.meanings), span: first.span };
        if let Some(link) = links.as_slice().first()
            && let Some((name, span)) = compared_with_nil(link.op, first, &link.right)
        {
            self.tested_name(name, span);
            left = OperandValue { kind: Some(StaticType::Int), span: link.span };
            links.next();
        } else {
            self.expr(first);
        }
        for link in links {
            self.expr(&link.right);
            let right =
                OperandValue { kind: kind_of(&link.right, self.meanings), span: link.right.span };
            self.check_binary(link.op, left, right, &link.right, link.span);
            left = OperandValue {
                kind: Some(result_kind(link.op, left.kind, right.kind)),
                span: link.span,
            };
        }
    }

    /// Visits the parts of a callee. `check_call` checks the name or member itself.
    fn callee(&mut self, callee: &CheckedExpr) {
        match &callee.kind {
            CheckedExprKind::Name(_) => {}
            CheckedExprKind::Field { object, .. } => self.expr(object),
            _ => self.expr(callee),
        }
    }

    fn self_value(&mut self, span: Span) {
        if !self.meanings.self_is_nil(self.function) {
            return;
        }
        if let Some(name) = &self.program.function(self.function).name
            && !self.program.hidden.is_lost(name)
        {
            let message =
                format!("`self` is always nil here, because `{name}` is only called as `{name}()`");
            self.report(self_is_nil(span, &message));
        }
    }

    fn name(&mut self, name: NameId, span: Span) {
        let text = &self.program.name(name).text;
        let is_nil =
            self.meanings.of(name) == Meaning::Nil && !self.program.hidden.may_define(text);
        if !is_nil || self.is_guarded(name) {
            return;
        }
        let robots = self.meanings.robots();
        if text == "io" {
            self.report(
                Diagnostic::new(
                    DiagnosticCode::NoFiles,
                    span,
                    "a robot has no files: there is no `io`",
                )
                .label("does not exist")
                .help("to print values, call `log(...)`; `bbz sim` writes tables of values with `--csv`, and all that robots do with `--record`"),
            );
            return;
        }
        if text == "string" {
            self.report(
                Diagnostic::new(
                    DiagnosticCode::ProfileLacks,
                    span,
                    "the `tiny` profile has no `string`: its strings are those written in the script",
                )
                .label("needs the `full` profile")
                .help("build with `--profile full`, or write the parts that need it under `if(string) { ... }`"),
            );
            return;
        }
        if !self.reported.insert(name) {
            return;
        }
        let others = robots.elsewhere(text);
        let mut diagnostic = match robots.target.filter(|_| !others.is_empty()) {
            Some(robot) => Diagnostic::new(
                DiagnosticCode::NeverAssigned,
                span,
                format!("the {} has no `{text}`: it is nil", robot.title),
            )
            .help(format!("a script for unlike robots uses it under `if({text}) {{ ... }}`")),
            None => Diagnostic::new(
                DiagnosticCode::NeverAssigned,
                span,
                format!("nothing ever assigns `{text}`: it is nil"),
            ),
        };
        if diagnostic.help.is_none()
            && let Some(advice) = self.likely_name(text)
        {
            diagnostic = advice.give(diagnostic, span);
        }
        self.report(diagnostic.label("always nil"));
    }

    /// Checks a field of a library that is read, not called.
    fn member(&mut self, object: &CheckedExpr, key: &str, span: Span) {
        if let Some(field) = self.host_field(object, key) {
            let message = format!("`{}` has no `{key}`: it is nil", field.table);
            let diagnostic = Diagnostic::new(DiagnosticCode::UnknownMember, span, message);
            self.report(field.advise(key, diagnostic, span).label("always nil"));
            return;
        }
        let Some(library) = self.meanings.library(object) else { return };
        if !matches!(self.meanings.member(library, key), LibraryMember::Absent)
            || self.may_be_member(library, key)
        {
            return;
        }
        let path = suggest::library_path(library);
        let mut diagnostic = Diagnostic::new(
            DiagnosticCode::UnknownMember,
            span,
            format!("`{path}` has no `{key}`: it is nil"),
        )
        .label("always nil");
        if let Some(advice) = suggest::for_member(library, key, self.meanings.robots()) {
            diagnostic = advice.give(diagnostic, object.span.to(span));
        }
        self.report(diagnostic);
    }
}

/// Returns the name that a call of `isnil` tests.
fn is_nil_test(
    callee: &CheckedExpr,
    args: &[CheckedExpr],
    meanings: &Meanings<'_>,
) -> Option<NameId> {
    let CheckedExprKind::Name(function) = callee.kind else { return None };
    match args {
        [arg] if meanings.of(function) == Meaning::Builtin(builtin::IS_NIL) => match arg.kind {
            CheckedExprKind::Name(name) => Some(name),
            _ => None,
        },
        _ => None,
    }
}

/// Returns the name that is compared with nil in `name == nil`, `nil != name` and the like.
fn compared_with_nil(
    op: BinaryOp,
    left: &CheckedExpr,
    right: &CheckedExpr,
) -> Option<(NameId, Span)> {
    match (op, &left.kind, &right.kind) {
        (BinaryOp::Eq | BinaryOp::NotEq, CheckedExprKind::Name(name), CheckedExprKind::Nil) => {
            Some((*name, left.span))
        }
        (BinaryOp::Eq | BinaryOp::NotEq, CheckedExprKind::Nil, CheckedExprKind::Name(name)) => {
            Some((*name, right.span))
        }
        _ => None,
    }
}

/// Returns the names that cannot be nil if the truth of the condition is `wanted`.
fn not_nil_if(condition: &CheckedExpr, wanted: bool, meanings: &Meanings<'_>) -> Vec<NameId> {
    match &condition.kind {
        CheckedExprKind::Name(name) if wanted => vec![*name],
        CheckedExprKind::Unary { op: UnaryOp::Not, operand } => {
            not_nil_if(operand, !wanted, meanings)
        }
        CheckedExprKind::Chain { first, links } => {
            if let [CheckedLink { op, right, .. }] = links.as_slice()
                && wanted == (*op == BinaryOp::NotEq)
                && let Some((name, _)) = compared_with_nil(*op, first, right)
            {
                return vec![name];
            }
            // All operands of a true `and` are true, and all operands of a false `or` are false.
            let deciding = if wanted { BinaryOp::And } else { BinaryOp::Or };
            let run = links.iter().rev().take_while(|link| link.op == deciding).count();
            let first = Some(&**first).filter(|_| run == links.len());
            let parts =
                first.into_iter().chain(links.iter().rev().take(run).map(|link| &link.right));
            parts.flat_map(|part| not_nil_if(part, wanted, meanings)).collect()
        }
        CheckedExprKind::Call { callee, args } if !wanted => {
            is_nil_test(callee, args, meanings).into_iter().collect()
        }
        _ => Vec::new(),
    }
}
