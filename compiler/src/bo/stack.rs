//! A symbolic operand stack: each instruction pushes the expression that it computes.
//!
//! The Buzz compiler evaluates every expression from left to right and leaves the stack empty after
//! every statement. The expression that an instruction pops is therefore the one in the script.

use crate::ast::{BinaryOp, Power, UnaryOp};
use crate::bo::error::Cause;
use crate::bo::names::check_name;
use crate::check::tree::{Expr, ExprKind, Link};
use crate::codegen::fold::is_truth_value;
use crate::parser::MAX_NESTING;
use crate::source::Span;

#[derive(Debug)]
enum StackEntry {
    /// A value.
    Value(Expr),
    /// A copy of the table below, made by `dup`.
    Copy,
    /// The function under this key in the table below.
    Method(Expr),
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
pub fn element(table: Expr, key: Expr, span: Span) -> Expr {
    let object = Box::new(table);
    let kind = match key.kind {
        ExprKind::Str(text) => ExprKind::Field { object, key: text, key_span: key.span },
        _ => ExprKind::Index { object, index: Box::new(key) },
    };
    Expr { kind, span }
}

impl Stack {
    /// Returns true if the stack is empty.
    pub fn is_empty(&self) -> bool {
        self.entries.is_empty()
    }

    /// Fails unless the stack is empty.
    pub fn expect_empty(&self) -> Result<(), Cause> {
        if self.is_empty() { Ok(()) } else { Err(Cause::StackNotEmpty) }
    }

    /// Pushes an expression without subexpressions.
    pub fn push(&mut self, kind: ExprKind, span: Span) -> Result<(), Cause> {
        self.push_value(Expr { kind, span }, 1)
    }

    /// Pushes an expression of that height.
    pub fn push_value(&mut self, expr: Expr, height: u32) -> Result<(), Cause> {
        self.check_height(height)?;
        self.entries.push((StackEntry::Value(expr), height));
        Ok(())
    }

    fn check_height(&mut self, height: u32) -> Result<(), Cause> {
        self.highest = self.highest.max(height + self.depth);
        if self.highest > MAX_NESTING { Err(Cause::TooDeep) } else { Ok(()) }
    }

    /// Enters a block.
    pub fn open_block(&mut self) -> Result<(), Cause> {
        self.depth += 1;
        self.check_height(0)
    }

    /// Leaves a block.
    pub fn close_block(&mut self) {
        self.depth -= 1;
    }

    /// Pops a value.
    pub fn pop(&mut self) -> Result<Expr, Cause> {
        self.pop_with_height().map(|(expr, _)| expr)
    }

    fn pop_with_height(&mut self) -> Result<(Expr, u32), Cause> {
        match self.entries.pop() {
            Some((StackEntry::Value(expr), height)) => Ok((expr, height)),
            Some((StackEntry::Copy, _)) => Err(Cause::StrayCopy),
            Some((StackEntry::Method(_), _)) => Err(Cause::MethodWithoutTable),
            None => Err(Cause::StackEmpty),
        }
    }

    /// Pops a string constant, which is the name of a global.
    pub fn pop_name(&mut self) -> Result<(String, Span), Cause> {
        match self.pop()? {
            Expr { kind: ExprKind::Str(name), span } => {
                check_name(&name)?;
                Ok((name, span))
            }
            _ => Err(Cause::ComputedName),
        }
    }

    /// Executes `dup`.
    pub fn copy(&mut self) -> Result<(), Cause> {
        match self.entries.last() {
            Some((StackEntry::Value(_), _)) => {
                self.entries.push((StackEntry::Copy, 0));
                Ok(())
            }
            Some(_) => Err(Cause::StrayCopy),
            None => Err(Cause::StackEmpty),
        }
    }

    /// Executes `tget`.
    pub fn get(&mut self, span: Span) -> Result<(), Cause> {
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
    pub fn put(&mut self, span: Span) -> Result<Option<(Expr, Expr)>, Cause> {
        let (value, value_height) = self.pop_with_height()?;
        let (key, key_height) = self.pop_with_height()?;
        let height = 1 + value_height.max(key_height);
        if !matches!(self.entries.last(), Some((StackEntry::Copy, _))) {
            let (table, table_height) = self.pop_with_height()?;
            self.check_height(height.max(1 + table_height))?;
            return Ok(Some((element(table, key, span), value)));
        }
        self.entries.pop();
        if !matches!(key.kind, ExprKind::Str(_) | ExprKind::Int(_) | ExprKind::Float(_)) {
            return Err(Cause::ComputedField);
        }
        match self.entries.last_mut() {
            Some((StackEntry::Value(Expr { kind: ExprKind::Table(fields), .. }), of_table)) => {
                fields.push((key, value));
                *of_table = height.max(*of_table);
                self.check_height(height).map(|()| None)
            }
            _ => Err(Cause::StrayCopy),
        }
    }

    /// Executes `callc`.
    pub fn call(&mut self, span: Span) -> Result<(), Cause> {
        let count = match self.pop()?.kind {
            ExprKind::Int(count) => {
                usize::try_from(count).map_err(|_| Cause::ComputedArgumentCount)?
            }
            _ => return Err(Cause::ComputedArgumentCount),
        };
        if count >= self.entries.len() {
            return Err(Cause::StackEmpty);
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
                let is_element =
                    matches!(callee.kind, ExprKind::Field { .. } | ExprKind::Index { .. });
                if !matches!(self_value.kind, ExprKind::Nil) || is_element {
                    return Err(Cause::SelfOfPlainCall);
                }
                height = height.max(callee_height);
                callee
            }
            Some((StackEntry::Copy, _)) => return Err(Cause::StrayCopy),
            None => return Err(Cause::StackEmpty),
        };
        let kind = ExprKind::Call { callee: Box::new(callee), args };
        self.push_value(Expr { kind, span }, 1 + height)
    }

    /// Executes an operation on one value.
    pub fn unary(&mut self, op: UnaryOp, span: Span) -> Result<(), Cause> {
        let (operand, height) = self.pop_with_height()?;
        let kind = ExprKind::Unary { op, operand: Box::new(operand) };
        self.push_value(Expr { kind, span }, 1 + height)
    }

    /// Executes an operation on two values.
    pub fn binary(&mut self, op: BinaryOp, span: Span) -> Result<(), Cause> {
        let (mut right, mut right_height) = self.pop_with_height()?;
        let (mut left, mut left_height) = self.pop_with_height()?;
        let mut op = op;
        if matches!(op, BinaryOp::And | BinaryOp::Or) && !does_nothing(&right) {
            // `land` and `lor` always evaluate their right side, but `and` and `or` may skip it.
            op = if op == BinaryOp::And { BinaryOp::BitAnd } else { BinaryOp::BitOr };
            (left, left_height) = truth(left, left_height);
            (right, right_height) = truth(right, right_height);
        }
        let link = Link { op, right, span };
        if let ExprKind::Chain { links, .. } = &mut left.kind
            && links.last().is_some_and(|last| last.op.power() == op.power())
        {
            links.push(link);
            left.span = span;
            return self.push_value(left, left_height.max(1 + right_height));
        }
        let kind = ExprKind::Chain { first: Box::new(left), links: vec![link] };
        self.push_value(Expr { kind, span }, 1 + left_height.max(right_height))
    }
}

/// Returns true if an expression may be left out: it has no effect and cannot fault.
fn does_nothing(expr: &Expr) -> bool {
    match &expr.kind {
        ExprKind::Nil
        | ExprKind::Int(_)
        | ExprKind::Float(_)
        | ExprKind::Str(_)
        | ExprKind::Name(_)
        | ExprKind::SelfValue => true,
        ExprKind::Unary { op: UnaryOp::Not, operand } => does_nothing(operand),
        ExprKind::Chain { first, links } => {
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
fn truth(expr: Expr, height: u32) -> (Expr, u32) {
    if is_made_truth(&expr) {
        return (expr, height);
    }
    let span = expr.span;
    let not = |operand| Expr {
        kind: ExprKind::Unary { op: UnaryOp::Not, operand: Box::new(operand) },
        span,
    };
    (not(not(expr)), height + 2)
}

/// Returns true if the value is certainly 0 or 1: a truth value, or the result of a `land` or `lor`
/// that [`Stack::binary`] rewrote.
fn is_made_truth(expr: &Expr) -> bool {
    match &expr.kind {
        ExprKind::Chain { first, links }
            if links.iter().all(|link| link.op.power() == Power::Bits) =>
        {
            is_made_truth(first) && links.iter().all(|link| is_made_truth(&link.right))
        }
        _ => is_truth_value(expr),
    }
}
