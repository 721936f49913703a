//! Code of conditions: jumps instead of truth values.

use bittybuzz_vm_core::builtin;
use bittybuzz_vm_core::opcode;

use crate::ast::{BinaryOp, UnaryOp};
use crate::check::names::Meaning;
use crate::check::tree::{Expr, ExprKind};
use crate::codegen::asm::Label;
use crate::codegen::fold;
use crate::codegen::function::Code;

impl<'a> Code<'_, 'a> {
    /// Jumps to `target` if the truth of the expression is `wanted`, else goes on.
    pub fn condition(&mut self, expr: &'a Expr, wanted: bool, target: Label) {
        let span = expr.span;
        if let Some(truth) = fold::truth(expr, self.generator.meanings) {
            if truth == wanted {
                self.builder.jump(opcode::JUMP, target, span);
            }
            return;
        }
        match &expr.kind {
            ExprKind::Unary { op: UnaryOp::Not, operand } => {
                self.condition(operand, !wanted, target);
            }
            ExprKind::Binary { op: op @ (BinaryOp::And | BinaryOp::Or), left, right } => {
                // The side that decides alone: a false left side of `and`, a true one of `or`.
                let deciding = *op == BinaryOp::Or;
                if wanted == deciding {
                    self.condition(left, wanted, target);
                    self.condition(right, wanted, target);
                } else {
                    let otherwise = self.builder.label();
                    self.condition(left, deciding, otherwise);
                    self.condition(right, wanted, target);
                    self.builder.bind(otherwise, span);
                }
            }
            ExprKind::Binary { op, left, right } => match compare_and_jump(*op, wanted) {
                Some(opcode) => {
                    self.expr(left);
                    let immediate = match right.kind {
                        ExprKind::Int(value) => i16::try_from(value).ok(),
                        _ => None,
                    };
                    let is_done = immediate.is_some_and(|immediate| {
                        self.builder.jump_int(opcode, immediate, target, span)
                    });
                    if !is_done {
                        self.expr(right);
                        self.note_order(*op, left, right);
                        self.builder.jump(opcode, target, span);
                    }
                }
                None => self.truth_jump(expr, wanted, target),
            },
            ExprKind::Call { callee, args } => match args.as_slice() {
                // One instruction shorter than the call.
                [arg] if self.is_builtin(callee, builtin::IS_NIL) => {
                    self.expr(arg);
                    self.builder.plain(opcode::NIL, span);
                    let opcode = if wanted { opcode::JUMP_EQ } else { opcode::JUMP_NE };
                    self.builder.jump(opcode, target, span);
                }
                _ => self.truth_jump(expr, wanted, target),
            },
            _ => self.truth_jump(expr, wanted, target),
        }
    }

    fn truth_jump(&mut self, expr: &'a Expr, wanted: bool, target: Label) {
        self.expr(expr);
        let opcode = if wanted { opcode::JUMP_TRUE } else { opcode::JUMP_FALSE };
        self.builder.jump(opcode, target, expr.span);
    }

    /// Whether a name is certainly that global built-in.
    pub fn is_builtin(&self, callee: &Expr, number: u8) -> bool {
        matches!(callee.kind, ExprKind::Name(name)
            if self.generator.meanings.of(name) == Meaning::Builtin(number))
    }
}

/// The jump taken if the comparison is `wanted`. With NaN an order and its opposite are both false, so the jump for
/// a false one is an instruction of its own.
fn compare_and_jump(op: BinaryOp, wanted: bool) -> Option<u8> {
    Some(match (op, wanted) {
        (BinaryOp::Eq, true) | (BinaryOp::NotEq, false) => opcode::JUMP_EQ,
        (BinaryOp::NotEq, true) | (BinaryOp::Eq, false) => opcode::JUMP_NE,
        (BinaryOp::Less, true) => opcode::JUMP_LT,
        (BinaryOp::LessEq, true) => opcode::JUMP_LE,
        (BinaryOp::Greater, true) => opcode::JUMP_GT,
        (BinaryOp::GreaterEq, true) => opcode::JUMP_GE,
        (BinaryOp::Less, false) => opcode::JUMP_NOT_LT,
        (BinaryOp::LessEq, false) => opcode::JUMP_NOT_LE,
        (BinaryOp::Greater, false) => opcode::JUMP_NOT_GT,
        (BinaryOp::GreaterEq, false) => opcode::JUMP_NOT_GE,
        _ => return None,
    })
}
