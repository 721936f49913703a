//! Constant folding: computes values that are known at compile time, and empties branches that
//! never run.
//!
//! Operations that fault are never folded, because the fault has to occur when the script reaches
//! them.

use bittybuzz_vm_core::builtin::{self, Library};

use crate::ast::{BinaryOp, Precedence, UnaryOp};
use crate::check::names::{LibraryMember, Meaning, Meanings};
use crate::check::tree::{
    CheckedBlock, CheckedExpr, CheckedExprKind, CheckedLink, CheckedStmt, CheckedStmtKind,
    FunctionId, ResolvedScript,
};
use crate::constant;
use crate::profile::NumberProfile;

/// Folds every function of a program.
pub fn fold(program: &mut ResolvedScript, meanings: &Meanings<'_>, profile: NumberProfile) {
    for (number, function) in program.functions.iter_mut().enumerate() {
        let folder =
            Folder { meanings, profile, self_is_nil: meanings.self_is_nil(FunctionId(number)) };
        folder.stmts(&mut function.body);
    }
}

/// Returns the truth of an expression if the truth is known and the evaluation has no effects.
pub fn truth(expr: &CheckedExpr, meanings: &Meanings<'_>) -> Option<bool> {
    match &expr.kind {
        CheckedExprKind::Nil => Some(false),
        CheckedExprKind::Int(value) => Some(*value != 0),
        CheckedExprKind::Float(_) | CheckedExprKind::Str(_) => Some(true),
        CheckedExprKind::Name(name) => match meanings.of(*name) {
            Meaning::Function(_) | Meaning::Builtin(_) | Meaning::Library(_) | Meaning::Robot => {
                Some(true)
            }
            Meaning::Nil => Some(false),
            Meaning::Global | Meaning::RobotId => None,
        },
        _ => None,
    }
}

/// Returns true if the value of an expression is certainly 0 or 1.
pub fn is_truth_value(expr: &CheckedExpr) -> bool {
    match &expr.kind {
        CheckedExprKind::Int(value) => matches!(value, 0 | 1),
        CheckedExprKind::Unary { op: UnaryOp::Not, .. } => true,
        CheckedExprKind::Chain { links, .. } => {
            let last = links.last().map(|link| link.op.power());
            matches!(last, Some(Precedence::Logic | Precedence::Comparison))
        }
        _ => false,
    }
}

struct Folder<'a> {
    meanings: &'a Meanings<'a>,
    profile: NumberProfile,
    self_is_nil: bool,
}

impl Folder<'_> {
    fn block(&self, block: &mut CheckedBlock) {
        self.stmts(&mut block.stmts);
    }

    fn stmts(&self, stmts: &mut [CheckedStmt]) {
        for stmt in stmts {
            self.stmt(stmt);
        }
    }

    fn stmt(&self, stmt: &mut CheckedStmt) {
        match &mut stmt.kind {
            CheckedStmtKind::Var { value, .. } | CheckedStmtKind::Return(value) => {
                if let Some(value) = value {
                    self.expr(value);
                }
            }
            CheckedStmtKind::Assign { target, value } => {
                match &mut target.kind {
                    CheckedExprKind::Field { object, .. } => self.expr(object),
                    CheckedExprKind::Index { object, index } => {
                        self.expr(object);
                        self.expr(index);
                    }
                    _ => {}
                }
                self.expr(value);
            }
            CheckedStmtKind::If { branches, otherwise } => {
                let mut always = None;
                for (number, branch) in branches.iter_mut().enumerate() {
                    self.expr(&mut branch.condition);
                    match truth(&branch.condition, self.meanings) {
                        Some(true) => always = Some(number),
                        Some(false) => branch.then.stmts.clear(),
                        None => {}
                    }
                    self.block(&mut branch.then);
                    if always.is_some() {
                        break;
                    }
                }
                if let Some(number) = always {
                    branches.truncate(number + 1);
                    otherwise.stmts.clear();
                }
                self.block(otherwise);
            }
            CheckedStmtKind::While { condition, body, update } => {
                self.expr(condition);
                if truth(condition, self.meanings) == Some(false) {
                    body.stmts.clear();
                    *update = None;
                }
                self.block(body);
                if let Some(update) = update {
                    self.stmt(update);
                }
            }
            CheckedStmtKind::Call(call) => self.expr(call),
        }
    }

    fn expr(&self, expr: &mut CheckedExpr) {
        let folded = match &mut expr.kind {
            CheckedExprKind::Name(name) => {
                (self.meanings.of(*name) == Meaning::Nil).then_some(CheckedExprKind::Nil)
            }
            CheckedExprKind::SelfValue => self.self_is_nil.then_some(CheckedExprKind::Nil),
            CheckedExprKind::Field { object, key, .. } => match self.meanings.library(object) {
                Some(library) => self.member(library, key),
                None => {
                    self.expr(object);
                    None
                }
            },
            CheckedExprKind::Index { object, index } => {
                self.expr(object);
                self.expr(index);
                None
            }
            CheckedExprKind::Call { callee, args } => {
                args.iter_mut().for_each(|arg| self.expr(arg));
                self.call(callee, args)
            }
            CheckedExprKind::Table(entries) => {
                entries.iter_mut().for_each(|(_, value)| self.expr(value));
                None
            }
            CheckedExprKind::Unary { op, operand } => {
                self.expr(operand);
                self.unary(*op, operand)
            }
            CheckedExprKind::Chain { first, links } => {
                self.expr(first);
                links.iter_mut().for_each(|link| self.expr(&mut link.right));
                self.chain(first, links)
            }
            CheckedExprKind::Int(_)
            | CheckedExprKind::Float(_)
            | CheckedExprKind::Str(_)
            | CheckedExprKind::Nil
            | CheckedExprKind::Local(_)
            | CheckedExprKind::Lambda(_)
            | CheckedExprKind::Error => None,
        };
        if let Some(kind) = folded {
            expr.kind = kind;
        }
    }

    fn member(&self, library: Library, key: &str) -> Option<CheckedExprKind> {
        match self.meanings.member(library, key) {
            LibraryMember::Known(info) if info.number == builtin::PI => {
                Some(CheckedExprKind::Float(std::f64::consts::PI))
            }
            LibraryMember::Absent => Some(CheckedExprKind::Nil),
            LibraryMember::Known(_) | LibraryMember::Changing => None,
        }
    }

    fn call(&self, callee: &mut CheckedExpr, args: &[CheckedExpr]) -> Option<CheckedExprKind> {
        let CheckedExprKind::Name(name) = callee.kind else {
            self.callee(callee);
            return None;
        };
        let is_isnil = self.meanings.of(name) == Meaning::Builtin(builtin::IS_NIL);
        match args {
            [arg] if is_isnil => self.is_nil(arg).map(truth_value),
            _ => None,
        }
    }

    /// Folds the parts of a callee, but not the callee itself: its form, a field or a name, decides
    /// how it is called.
    fn callee(&self, callee: &mut CheckedExpr) {
        match &mut callee.kind {
            CheckedExprKind::Field { object, .. } if self.meanings.library(object).is_none() => {
                self.expr(object)
            }
            CheckedExprKind::Field { .. } => {}
            CheckedExprKind::Index { object, index } => {
                self.expr(object);
                self.expr(index);
            }
            _ => self.expr(callee),
        }
    }

    /// Returns true if a constant is nil, and `None` if the expression is not a constant.
    fn is_nil(&self, expr: &CheckedExpr) -> Option<bool> {
        match expr.kind {
            CheckedExprKind::Nil => Some(true),
            CheckedExprKind::Int(_) | CheckedExprKind::Float(_) | CheckedExprKind::Str(_) => {
                Some(false)
            }
            // The other constants are functions and libraries.
            CheckedExprKind::Name(_) => truth(expr, self.meanings).map(|truth| !truth),
            _ => None,
        }
    }

    fn unary(&self, op: UnaryOp, operand: &CheckedExpr) -> Option<CheckedExprKind> {
        if op == UnaryOp::Not {
            return truth(operand, self.meanings).map(|truth| truth_value(!truth));
        }
        let operand = operand.number(self.profile)?;
        constant::unary(self.profile, op, operand).map(CheckedExprKind::from)
    }

    /// Folds the first operations, up to the first one that only the machine can compute. The value
    /// of that operation is unknown, and so are the values of all later ones.
    fn chain(
        &self,
        first: &mut CheckedExpr,
        links: &mut Vec<CheckedLink>,
    ) -> Option<CheckedExprKind> {
        let mut known = 0;
        for link in links.iter_mut() {
            let Some(kind) = self.binary(link.op, first, &mut link.right) else { break };
            *first = CheckedExpr { kind, span: link.span };
            known += 1;
        }
        links.drain(..known);
        if links.is_empty() { Some(take(first).kind) } else { None }
    }

    fn binary(
        &self,
        op: BinaryOp,
        left: &mut CheckedExpr,
        right: &mut CheckedExpr,
    ) -> Option<CheckedExprKind> {
        match op {
            BinaryOp::And | BinaryOp::Or => {
                let known = truth(left, self.meanings)?;
                if known == (op == BinaryOp::Or) {
                    return Some(truth_value(known));
                }
                // The left side does not decide, so the result is the truth of the right side.
                match truth(right, self.meanings) {
                    Some(truth) => Some(truth_value(truth)),
                    None if is_truth_value(right) => Some(take(right).kind),
                    None => Some(not(not(take(right))).kind),
                }
            }
            BinaryOp::Eq
            | BinaryOp::NotEq
            | BinaryOp::Less
            | BinaryOp::LessEq
            | BinaryOp::Greater
            | BinaryOp::GreaterEq => self.compare(op, left, right).map(truth_value),
            _ => {
                let left = left.number(self.profile)?;
                let right = right.number(self.profile)?;
                constant::arithmetic(self.profile, op, left, right).map(CheckedExprKind::from)
            }
        }
    }

    fn compare(&self, op: BinaryOp, left: &CheckedExpr, right: &CheckedExpr) -> Option<bool> {
        if let (CheckedExprKind::Str(a), CheckedExprKind::Str(b)) = (&left.kind, &right.kind) {
            return match op {
                BinaryOp::Eq => Some(a == b),
                BinaryOp::NotEq => Some(a != b),
                BinaryOp::Less => Some(a < b),
                BinaryOp::LessEq => Some(a <= b),
                BinaryOp::Greater => Some(a > b),
                BinaryOp::GreaterEq => Some(a >= b),
                _ => None,
            };
        }
        if let (Some(a), Some(b)) = (left.number(self.profile), right.number(self.profile)) {
            return constant::compare(op, a, b);
        }
        // Nil is less than all other values and equals only itself.
        let order = match (self.is_nil(left)?, self.is_nil(right)?) {
            (true, true) => std::cmp::Ordering::Equal,
            (true, false) => std::cmp::Ordering::Less,
            (false, true) => std::cmp::Ordering::Greater,
            (false, false) => return None,
        };
        match op {
            BinaryOp::Eq => Some(order.is_eq()),
            BinaryOp::NotEq => Some(order.is_ne()),
            BinaryOp::Less => Some(order.is_lt()),
            BinaryOp::LessEq => Some(order.is_le()),
            BinaryOp::Greater => Some(order.is_gt()),
            BinaryOp::GreaterEq => Some(order.is_ge()),
            _ => None,
        }
    }
}

fn truth_value(truth: bool) -> CheckedExprKind {
    CheckedExprKind::Int(i64::from(truth))
}

fn take(expr: &mut CheckedExpr) -> CheckedExpr {
    CheckedExpr { kind: std::mem::replace(&mut expr.kind, CheckedExprKind::Nil), span: expr.span }
}

fn not(operand: CheckedExpr) -> CheckedExpr {
    let span = operand.span;
    CheckedExpr {
        kind: CheckedExprKind::Unary { op: UnaryOp::Not, operand: Box::new(operand) },
        span,
    }
}
