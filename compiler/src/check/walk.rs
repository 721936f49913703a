//! Visits every expression of a script and checks it with knowledge of the conditions around it.

use std::collections::BTreeMap;

use bittybuzz_vm_core::builtin::{self, Library};

use crate::ast::{BinaryOp, Precedence, UnaryOp};
use crate::check::checker::Checker;
use crate::check::names::{LibraryMember, Meaning, Meanings};
use crate::check::resolve::self_is_nil;
use crate::check::static_type::{OperandValue, StaticType, kind_of, result_kind};
use crate::check::suggest;
use crate::check::tree::{
    CheckedBlock, CheckedBranch, CheckedExpr, CheckedExprKind, CheckedLink, CheckedStmt,
    CheckedStmtKind, FunctionId, NameId, ResolvedScript, assigned_values,
};
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
                self.toggle(target, value);
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
            CheckedExprKind::Field { object, key_span, .. } => {
                self.expr(object);
                self.check_table(object, target.span);
                if let Some(library) = self.meanings.object_of(object) {
                    self.no_elements(library, *key_span);
                }
            }
            CheckedExprKind::Index { object, index } => self.element(object, index, target.span),
            _ => {}
        }
    }

    /// Visits `object[index]`.
    fn element(&mut self, object: &CheckedExpr, index: &CheckedExpr, span: Span) {
        self.expr(object);
        self.expr(index);
        self.check_key(index);
        self.check_table(object, span);
        if let Some(library) = self.meanings.object_of(object) {
            self.no_elements(library, span);
        }
        // A robot's id is a number, and `neighbors` looks like a list of robots.
        let is_number = || kind_of(index, self.meanings).is_some_and(StaticType::is_number);
        if self.meanings.library(object) == Some(Library::Neighbors) && is_number() {
            let diagnostic = Diagnostic::new(
                DiagnosticCode::UnknownMember,
                span,
                "`neighbors` has no elements: this is nil",
            );
            let end = Span { start: index.span.end, ..span };
            self.report(
                diagnostic
                    .help("the data of the robot with an id is `neighbors.get(id)`")
                    .guess(Span { start: object.span.end, end: index.span.start, ..span }, ".get(")
                    .guess(end, ")"),
            );
        }
    }

    fn no_elements(&mut self, library: Library, span: Span) {
        let noun = suggest::object_noun(library);
        let message = format!("{noun} has no fields and no elements");
        let diagnostic = Diagnostic::new(DiagnosticCode::UnknownMember, span, message);
        self.report(match library {
            Library::StigmergyObject => diagnostic
                .help("its entries are read by `get(key)` and written by `put(key, value)`"),
            _ => diagnostic.help("its functions are called by name"),
        });
    }

    /// Visits an expression of which only the truth counts, where a name may be nil.
    fn tested(&mut self, expr: &CheckedExpr) {
        match &expr.kind {
            CheckedExprKind::Name(name) => self.tested_name(*name, expr.span),
            CheckedExprKind::Unary { op: UnaryOp::Not, operand } => self.tested(operand),
            CheckedExprKind::Unary { op: UnaryOp::BitNot, operand } => {
                self.expr(expr);
                self.bit_not_for_not(expr.span, operand);
            }
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
                let is_log =
                    self.meanings.built_in(callee).is_some_and(|info| info.number == builtin::LOG);
                for arg in args {
                    self.in_log = is_log;
                    self.expr(arg);
                    self.in_log = false;
                }
                self.check_call(callee, args, expr.span);
            }
            CheckedExprKind::Field { object, key, key_span } => {
                self.expr(object);
                self.check_table(object, expr.span);
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
            CheckedExprKind::Index { object, index } => self.element(object, index, expr.span),
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

    /// Reports `!` where a condition is meant. The parser has reported it in front of a condition in
    /// parentheses.
    fn bit_not_for_not(&mut self, span: Span, operand: &CheckedExpr) {
        if gives_truth(operand) {
            return;
        }
        let sign = Span { end: span.start + 1, ..span };
        let end = Span { start: span.end, ..span };
        self.report(
            Diagnostic::new(
                DiagnosticCode::BitwiseNotOfCondition,
                span,
                "`!` inverts bits: `!0` is -1 and `!1` is -2, which are both true",
            )
            .help("the logical operator is the word `not`")
            .edit(sign, "(not ")
            .edit(end, ")"),
        );
    }

    /// Checks `x = !x` and `x = !0`, with which a condition is meant.
    fn toggle(&mut self, target: &CheckedExpr, value: &CheckedExpr) {
        let CheckedExprKind::Unary { op: UnaryOp::BitNot, operand } = &value.kind else { return };
        let is_own = match (&target.kind, &operand.kind) {
            (CheckedExprKind::Name(one), CheckedExprKind::Name(other)) => {
                one == other && self.holds_truth(*one)
            }
            (_, CheckedExprKind::Int(0 | 1)) => true,
            _ => false,
        };
        if is_own {
            self.bit_not_for_not(value.span, operand);
        }
    }

    /// Returns true if a global gets only conditions, 0 and 1, and its own value with `!`.
    fn holds_truth(&self, name: NameId) -> bool {
        let mut values = BTreeMap::new();
        for function in &self.program.functions {
            assigned_values(&function.body, &mut values);
        }
        let is_truth = |value: &&CheckedExpr| match &value.kind {
            CheckedExprKind::Int(0 | 1) | CheckedExprKind::Nil => true,
            CheckedExprKind::Unary { op: UnaryOp::BitNot, .. } => true,
            _ => gives_truth(value),
        };
        values.get(&name).is_some_and(|values| values.iter().all(is_truth))
    }

    fn operations(&mut self, first: &CheckedExpr, links: &[CheckedLink]) {
        let whole = std::mem::take(&mut self.in_log).then_some((first, links));
        let mut links = links.iter();
        // The types of variables are certain unless they are nil, which can be compared.
        let computes = |op: BinaryOp| op.is_arithmetic() || op.is_bitwise();
        let kind = |checker: &Self, expr: &CheckedExpr, op: BinaryOp| match computes(op) {
            true => checker.kind(expr),
            false => kind_of(expr, checker.meanings),
        };
        let op = links.as_slice().first().map_or(BinaryOp::Eq, |link| link.op);
        let mut left = OperandValue { kind: kind(self, first, op), span: first.span };
        let mut left_integer = self.kind(first);
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
                OperandValue { kind: kind(self, &link.right, link.op), span: link.right.span };
            self.check_fraction(link.op, left_integer, &link.right, link.span);
            left_integer = None;
            self.check_truth_of_bits(link);
            self.check_binary(link.op, left, right, &link.right, link.span, whole);
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
            CheckedExprKind::Field { object, .. } => {
                self.expr(object);
                self.check_table(object, callee.span);
            }
            _ => self.expr(callee),
        }
    }

    /// Checks `x == !y`, and the like with `!=`.
    fn check_truth_of_bits(&mut self, link: &CheckedLink) {
        if let (
            BinaryOp::Eq | BinaryOp::NotEq,
            CheckedExprKind::Unary { op: UnaryOp::BitNot, operand },
        ) = (link.op, &link.right.kind)
            && matches!(operand.kind, CheckedExprKind::Name(name) if self.holds_truth(name))
        {
            self.bit_not_for_not(link.right.span, operand);
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
        if let Some(library) = self.meanings.object_of(object) {
            if builtin::find(library, key).is_none() {
                let message =
                    format!("{} has no `{key}`: it is nil", suggest::object_noun(library));
                let diagnostic = Diagnostic::new(DiagnosticCode::UnknownMember, span, message);
                let diagnostic = self.with_method(library, key, span, diagnostic);
                self.report(diagnostic.label("always nil"));
            }
            return;
        }
        if let Some((missing, table)) = self.missing_field(object, key) {
            let message = format!("no table of the script has a field `{key}`: it is nil");
            let diagnostic = Diagnostic::new(DiagnosticCode::UnknownMember, span, message);
            let diagnostic = match missing.advice(key, table) {
                Some(advice) => advice.give(diagnostic, span),
                None => diagnostic,
            };
            self.report(diagnostic.label("always nil"));
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

/// Returns true for expressions that give 0 or 1.
fn gives_truth(expr: &CheckedExpr) -> bool {
    match &expr.kind {
        CheckedExprKind::Chain { links, .. } => links.last().is_some_and(|link| {
            matches!(link.op.power(), Precedence::Logic | Precedence::Comparison)
        }),
        CheckedExprKind::Unary { op, .. } => *op == UnaryOp::Not,
        _ => false,
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
