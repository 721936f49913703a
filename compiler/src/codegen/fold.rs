//! Constant folding: computes values that are known at compile time, and empties branches that
//! never run.
//!
//! Operations that fault are never folded, because the fault has to occur when the script reaches
//! them.

use bittybuzz_vm_core::builtin::{self, Library};

use crate::ast::{BinaryOp, Power, UnaryOp};
use crate::check::names::{Meaning, Meanings, Member};
use crate::check::tree::{Block, Expr, ExprKind, FunctionId, Link, ResolvedScript, Stmt, StmtKind};
use crate::codegen::constant::{self, Number, Profile};

/// Folds every function of a program.
pub fn fold(program: &mut ResolvedScript, meanings: &Meanings<'_>, profile: Profile) {
    for (number, function) in program.functions.iter_mut().enumerate() {
        let folder =
            Folder { meanings, profile, self_is_nil: meanings.self_is_nil(FunctionId(number)) };
        folder.stmts(&mut function.body);
    }
}

/// Returns the truth of an expression if the truth is known and the evaluation has no effects.
pub fn truth(expr: &Expr, meanings: &Meanings<'_>) -> Option<bool> {
    match &expr.kind {
        ExprKind::Nil => Some(false),
        ExprKind::Int(value) => Some(*value != 0),
        ExprKind::Float(_) | ExprKind::Str(_) => Some(true),
        ExprKind::Name(name) => match meanings.of(*name) {
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
pub fn is_truth_value(expr: &Expr) -> bool {
    match &expr.kind {
        ExprKind::Int(value) => matches!(value, 0 | 1),
        ExprKind::Unary { op: UnaryOp::Not, .. } => true,
        ExprKind::Chain { links, .. } => {
            let last = links.last().map(|link| link.op.power());
            matches!(last, Some(Power::Logic | Power::Comparison))
        }
        _ => false,
    }
}

struct Folder<'a> {
    meanings: &'a Meanings<'a>,
    profile: Profile,
    self_is_nil: bool,
}

impl Folder<'_> {
    fn block(&self, block: &mut Block) {
        self.stmts(&mut block.stmts);
    }

    fn stmts(&self, stmts: &mut [Stmt]) {
        for stmt in stmts {
            self.stmt(stmt);
        }
    }

    fn stmt(&self, stmt: &mut Stmt) {
        match &mut stmt.kind {
            StmtKind::Var { value, .. } | StmtKind::Return(value) => {
                if let Some(value) = value {
                    self.expr(value);
                }
            }
            StmtKind::Assign { target, value } => {
                match &mut target.kind {
                    ExprKind::Field { object, .. } => self.expr(object),
                    ExprKind::Index { object, index } => {
                        self.expr(object);
                        self.expr(index);
                    }
                    _ => {}
                }
                self.expr(value);
            }
            StmtKind::If { branches, otherwise } => {
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
            StmtKind::While { condition, body, update } => {
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
            StmtKind::Call(call) => self.expr(call),
        }
    }

    fn expr(&self, expr: &mut Expr) {
        let folded = match &mut expr.kind {
            ExprKind::Name(name) => {
                (self.meanings.of(*name) == Meaning::Nil).then_some(ExprKind::Nil)
            }
            ExprKind::SelfValue => self.self_is_nil.then_some(ExprKind::Nil),
            ExprKind::Field { object, key, .. } => match self.meanings.library(object) {
                Some(library) => self.member(library, key),
                None => {
                    self.expr(object);
                    None
                }
            },
            ExprKind::Index { object, index } => {
                self.expr(object);
                self.expr(index);
                None
            }
            ExprKind::Call { callee, args } => {
                args.iter_mut().for_each(|arg| self.expr(arg));
                self.call(callee, args)
            }
            ExprKind::Table(entries) => {
                entries.iter_mut().for_each(|(_, value)| self.expr(value));
                None
            }
            ExprKind::Unary { op, operand } => {
                self.expr(operand);
                self.unary(*op, operand)
            }
            ExprKind::Chain { first, links } => {
                self.expr(first);
                links.iter_mut().for_each(|link| self.expr(&mut link.right));
                self.chain(first, links)
            }
            ExprKind::Int(_)
            | ExprKind::Float(_)
            | ExprKind::Str(_)
            | ExprKind::Nil
            | ExprKind::Local(_)
            | ExprKind::Lambda(_)
            | ExprKind::Error => None,
        };
        if let Some(kind) = folded {
            expr.kind = kind;
        }
    }

    fn member(&self, library: Library, key: &str) -> Option<ExprKind> {
        match self.meanings.member(library, key) {
            Member::Known(info) if info.number == builtin::PI => {
                Some(ExprKind::Float(std::f64::consts::PI))
            }
            Member::Absent => Some(ExprKind::Nil),
            Member::Known(_) | Member::Changing => None,
        }
    }

    fn call(&self, callee: &mut Expr, args: &[Expr]) -> Option<ExprKind> {
        let ExprKind::Name(name) = callee.kind else {
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
    fn callee(&self, callee: &mut Expr) {
        match &mut callee.kind {
            ExprKind::Field { object, .. } if self.meanings.library(object).is_none() => {
                self.expr(object)
            }
            ExprKind::Field { .. } => {}
            ExprKind::Index { object, index } => {
                self.expr(object);
                self.expr(index);
            }
            _ => self.expr(callee),
        }
    }

    /// Returns true if a constant is nil, and `None` if the expression is not a constant.
    fn is_nil(&self, expr: &Expr) -> Option<bool> {
        match expr.kind {
            ExprKind::Nil => Some(true),
            ExprKind::Int(_) | ExprKind::Float(_) | ExprKind::Str(_) => Some(false),
            // The other constants are functions and libraries.
            ExprKind::Name(_) => truth(expr, self.meanings).map(|truth| !truth),
            _ => None,
        }
    }

    fn unary(&self, op: UnaryOp, operand: &Expr) -> Option<ExprKind> {
        if op == UnaryOp::Not {
            return truth(operand, self.meanings).map(|truth| truth_value(!truth));
        }
        let operand = Number::of(self.profile, operand)?;
        constant::unary(self.profile, op, operand).map(Number::to_expr)
    }

    /// Folds the first operations, up to the first one that only the machine can compute. The value
    /// of that operation is unknown, and so are the values of all later ones.
    fn chain(&self, first: &mut Expr, links: &mut Vec<Link>) -> Option<ExprKind> {
        let mut known = 0;
        for link in links.iter_mut() {
            let Some(kind) = self.binary(link.op, first, &mut link.right) else { break };
            *first = Expr { kind, span: link.span };
            known += 1;
        }
        links.drain(..known);
        if links.is_empty() { Some(take(first).kind) } else { None }
    }

    fn binary(&self, op: BinaryOp, left: &mut Expr, right: &mut Expr) -> Option<ExprKind> {
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
                let left = Number::of(self.profile, left)?;
                let right = Number::of(self.profile, right)?;
                constant::arithmetic(self.profile, op, left, right).map(Number::to_expr)
            }
        }
    }

    fn compare(&self, op: BinaryOp, left: &Expr, right: &Expr) -> Option<bool> {
        if let (ExprKind::Str(a), ExprKind::Str(b)) = (&left.kind, &right.kind) {
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
        if let (Some(a), Some(b)) =
            (Number::of(self.profile, left), Number::of(self.profile, right))
        {
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

fn truth_value(truth: bool) -> ExprKind {
    ExprKind::Int(i64::from(truth))
}

fn take(expr: &mut Expr) -> Expr {
    Expr { kind: std::mem::replace(&mut expr.kind, ExprKind::Nil), span: expr.span }
}

fn not(operand: Expr) -> Expr {
    let span = operand.span;
    Expr { kind: ExprKind::Unary { op: UnaryOp::Not, operand: Box::new(operand) }, span }
}
