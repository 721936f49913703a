//! A symbolic operand stack: each instruction pushes the expression that it computes.
//!
//! The Buzz compiler evaluates every expression from left to right and leaves the stack empty after
//! every statement. The expression that an instruction pops is therefore the one in the script.

use crate::ast::{BinaryOp, Precedence, UnaryOp};
use crate::bo::error::BoCause;
use crate::bo::names::check_name;
use crate::check::tree::{CheckedExpr, CheckedExprKind, CheckedLink};
use crate::codegen::fold::is_truth_value;
use crate::parser::NESTING_MAX;
use crate::source::Span;

#[derive(Debug)]
enum StackEntry {
    /// A value.
    Value(CheckedExpr),
    /// A copy of the table below, made by `dup`.
    Copy,
    /// The function under this key in the table below.
    Method(CheckedExpr),
}

/// The symbolic operand stack.
#[derive(Debug, Default)]
pub struct Stack {
    /// The entries, each with the height of its expression.
    entries: Vec<(StackEntry, u32)>,
    /// The number of open blocks, which add to the height of the tree.
    pub depth: u32,
    /// The height of the tree so far, open blocks included.
    pub highest: u32,
}

/// Returns the expression of a table access: `t.x` if the key is a string.
pub fn element(table: CheckedExpr, key: CheckedExpr, span: Span) -> CheckedExpr {
    let object = Box::new(table);
    let kind = match key.kind {
        CheckedExprKind::Str(text) => {
            CheckedExprKind::Field { object, key: text, key_span: key.span }
        }
        _ => CheckedExprKind::Index { object, index: Box::new(key) },
    };
    CheckedExpr { kind, span }
}

impl Stack {
    /// Returns true if the stack is empty.
    pub fn is_empty(&self) -> bool {
        self.entries.is_empty()
    }

    /// Fails unless the stack is empty.
    pub fn expect_empty(&self) -> Result<(), BoCause> {
        if self.is_empty() { Ok(()) } else { Err(BoCause::StackNotEmpty) }
    }

    /// Pushes an expression without subexpressions.
    pub fn push(&mut self, kind: CheckedExprKind, span: Span) -> Result<(), BoCause> {
        self.push_value(CheckedExpr { kind, span }, 1)
    }

    /// Pushes an expression of that height.
    pub fn push_value(&mut self, expr: CheckedExpr, height: u32) -> Result<(), BoCause> {
        self.check_height(height)?;
        self.entries.push((StackEntry::Value(expr), height));
        Ok(())
    }

    fn check_height(&mut self, height: u32) -> Result<(), BoCause> {
        self.highest = self.highest.max(height + self.depth);
        if self.highest > NESTING_MAX { Err(BoCause::TooDeep) } else { Ok(()) }
    }

    /// Enters a block.
    pub fn open_block(&mut self) -> Result<(), BoCause> {
        self.depth += 1;
        self.check_height(0)
    }

    /// Leaves a block.
    pub fn close_block(&mut self) {
        self.depth -= 1;
    }

    /// Pops a value.
    pub fn pop(&mut self) -> Result<CheckedExpr, BoCause> {
        self.pop_with_height().map(|(expr, _)| expr)
    }

    fn pop_with_height(&mut self) -> Result<(CheckedExpr, u32), BoCause> {
        match self.entries.pop() {
            Some((StackEntry::Value(expr), height)) => Ok((expr, height)),
            Some((StackEntry::Copy, _)) => Err(BoCause::StrayCopy),
            Some((StackEntry::Method(_), _)) => Err(BoCause::MethodWithoutTable),
            None => Err(BoCause::StackEmpty),
        }
    }

    /// Pops a string constant, which is the name of a global.
    pub fn pop_name(&mut self) -> Result<(String, Span), BoCause> {
        match self.pop()? {
            CheckedExpr { kind: CheckedExprKind::Str(name), span } => {
                check_name(&name)?;
                Ok((name, span))
            }
            _ => Err(BoCause::ComputedName),
        }
    }

    /// Executes `dup`.
    pub fn copy(&mut self) -> Result<(), BoCause> {
        match self.entries.last() {
            Some((StackEntry::Value(_), _)) => {
                self.entries.push((StackEntry::Copy, 0));
                Ok(())
            }
            Some(_) => Err(BoCause::StrayCopy),
            None => Err(BoCause::StackEmpty),
        }
    }

    /// Executes `tget`.
    pub fn get(&mut self, span: Span) -> Result<(), BoCause> {
        let (key, key_height) = self.pop_with_height()?;
        if let Some((entry @ StackEntry::Copy, height)) = self.entries.last_mut() {
            *entry = StackEntry::Method(key);
            *height = key_height;
            return Ok(());
        }
        let (table, height) = self.pop_with_height()?;
        self.push_value(element(table, key, span), 1 + height.max(key_height))
    }

    /// Executes `tput`. Adds a field to the table literal below, or returns the target and the
    /// value of an assignment.
    pub fn put(&mut self, span: Span) -> Result<Option<(CheckedExpr, CheckedExpr)>, BoCause> {
        let (value, value_height) = self.pop_with_height()?;
        let (key, key_height) = self.pop_with_height()?;
        let height = 1 + value_height.max(key_height);
        if !matches!(self.entries.last(), Some((StackEntry::Copy, _))) {
            let (table, table_height) = self.pop_with_height()?;
            self.check_height(height.max(1 + table_height))?;
            return Ok(Some((element(table, key, span), value)));
        }
        self.entries.pop();
        if !matches!(
            key.kind,
            CheckedExprKind::Str(_) | CheckedExprKind::Int(_) | CheckedExprKind::Float(_)
        ) {
            return Err(BoCause::ComputedField);
        }
        match self.entries.last_mut() {
            Some((
                StackEntry::Value(CheckedExpr { kind: CheckedExprKind::Table(fields), .. }),
                of_table,
            )) => {
                fields.push((key, value));
                *of_table = height.max(*of_table);
                self.check_height(height).map(|()| None)
            }
            _ => Err(BoCause::StrayCopy),
        }
    }

    /// Executes `callc`.
    pub fn call(&mut self, span: Span) -> Result<(), BoCause> {
        let count = match self.pop()?.kind {
            CheckedExprKind::Int(count) => {
                usize::try_from(count).map_err(|_| BoCause::ComputedArgumentCount)?
            }
            _ => return Err(BoCause::ComputedArgumentCount),
        };
        if count >= self.entries.len() {
            return Err(BoCause::StackEmpty);
        }
        let mut args = Vec::with_capacity(count);
        let mut height = 0;
        for _ in 0..count {
            let (arg, arg_height) = self.pop_with_height()?;
            args.push(arg);
            height = height.max(arg_height);
        }
        args.reverse();
        let callee = match self.entries.pop() {
            Some((StackEntry::Method(key), key_height)) => {
                let (table, table_height) = self.pop_with_height()?;
                height = height.max(1 + key_height.max(table_height));
                let key_span = key.span;
                element(table, key, key_span)
            }
            Some((StackEntry::Value(callee), callee_height)) => {
                let (self_value, _) = self.pop_with_height()?;
                // In the tree, a table access as callee would be a method call.
                let is_element = matches!(
                    callee.kind,
                    CheckedExprKind::Field { .. } | CheckedExprKind::Index { .. }
                );
                if !matches!(self_value.kind, CheckedExprKind::Nil) || is_element {
                    return Err(BoCause::SelfOfPlainCall);
                }
                height = height.max(callee_height);
                callee
            }
            Some((StackEntry::Copy, _)) => return Err(BoCause::StrayCopy),
            None => return Err(BoCause::StackEmpty),
        };
        let kind = CheckedExprKind::Call { callee: Box::new(callee), args };
        self.push_value(CheckedExpr { kind, span }, 1 + height)
    }

    /// Executes an operation on one value.
    pub fn unary(&mut self, op: UnaryOp, span: Span) -> Result<(), BoCause> {
        let (operand, height) = self.pop_with_height()?;
        let kind = CheckedExprKind::Unary { op, operand: Box::new(operand) };
        self.push_value(CheckedExpr { kind, span }, 1 + height)
    }

    /// Executes an operation on two values.
    pub fn binary(&mut self, op: BinaryOp, span: Span) -> Result<(), BoCause> {
        let (mut right, mut right_height) = self.pop_with_height()?;
        let (mut left, mut left_height) = self.pop_with_height()?;
        let mut op = op;
        if matches!(op, BinaryOp::And | BinaryOp::Or) && !does_nothing(&right) {
            // `land` and `lor` always evaluate their right side, but `and` and `or` may skip it.
            op = if op == BinaryOp::And { BinaryOp::BitAnd } else { BinaryOp::BitOr };
            (left, left_height) = truth(left, left_height);
            (right, right_height) = truth(right, right_height);
        }
        let link = CheckedLink { op, right, span };
        if let CheckedExprKind::Chain { links, .. } = &mut left.kind
            && links.last().is_some_and(|last| last.op.power() == op.power())
        {
            links.push(link);
            left.span = span;
            return self.push_value(left, left_height.max(1 + right_height));
        }
        let kind = CheckedExprKind::Chain { first: Box::new(left), links: vec![link] };
        self.push_value(CheckedExpr { kind, span }, 1 + left_height.max(right_height))
    }
}

/// Returns true if an expression may be left out: it has no effect and cannot fault.
fn does_nothing(expr: &CheckedExpr) -> bool {
    match &expr.kind {
        CheckedExprKind::Nil
        | CheckedExprKind::Int(_)
        | CheckedExprKind::Float(_)
        | CheckedExprKind::Str(_)
        | CheckedExprKind::Name(_)
        | CheckedExprKind::SelfValue => true,
        CheckedExprKind::Unary { op: UnaryOp::Not, operand } => does_nothing(operand),
        CheckedExprKind::Chain { first, links } => {
            let is_harmless =
                |op| matches!(op, BinaryOp::And | BinaryOp::Or | BinaryOp::Eq | BinaryOp::NotEq);
            does_nothing(first)
                && links.iter().all(|link| is_harmless(link.op) && does_nothing(&link.right))
        }
        // Reading a local may fault, because a parameter may be missing.
        _ => false,
    }
}

/// Returns the truth of an expression, 0 or 1, with the height of the new expression.
fn truth(expr: CheckedExpr, height: u32) -> (CheckedExpr, u32) {
    if is_made_truth(&expr) {
        return (expr, height);
    }
    let span = expr.span;
    let not = |operand| CheckedExpr {
        kind: CheckedExprKind::Unary { op: UnaryOp::Not, operand: Box::new(operand) },
        span,
    };
    (not(not(expr)), height + 2)
}

/// Returns true if the value is certainly 0 or 1: a truth value, or the result of a `land` or `lor`
/// that [`Stack::binary`] rewrote.
fn is_made_truth(expr: &CheckedExpr) -> bool {
    match &expr.kind {
        CheckedExprKind::Chain { first, links }
            if links.iter().all(|link| link.op.power() == Precedence::Bits) =>
        {
            is_made_truth(first) && links.iter().all(|link| is_made_truth(&link.right))
        }
        _ => is_truth_value(expr),
    }
}
