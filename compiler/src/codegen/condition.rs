//! Code of conditions: jumps instead of truth values.

use bittybuzz_vm_core::builtin;
use bittybuzz_vm_core::opcode;

use crate::asm::Label;
use crate::ast::{BinaryOp, UnaryOp};
use crate::check::names::Meaning;
use crate::check::tree::{CheckedExpr, CheckedExprKind, CheckedLink};
use crate::codegen::fold;
use crate::codegen::function::GeneratedFunction;

impl<'a> GeneratedFunction<'_, 'a> {
    /// Generates a jump to `target` that is taken if the truth of the expression is `wanted`.
    pub fn condition(&mut self, expr: &'a CheckedExpr, wanted: bool, target: Label) {
        let span = expr.span;
        if let Some(truth) = fold::truth(expr, self.generator.meanings) {
            if truth == wanted {
                self.builder.jump(opcode::JUMP, target, span);
            }
            return;
        }
        match &expr.kind {
            CheckedExprKind::Unary { op: UnaryOp::Not, operand } => {
                self.condition(operand, !wanted, target);
            }
            CheckedExprKind::Chain { first, links } => match links.split_last() {
                Some((last, _)) if last.op.is_logic() => {
                    self.logic_condition(first, links, wanted, target);
                }
                Some((last, before)) => match compare_and_jump(last.op, wanted) {
                    Some(opcode) => self.comparison(first, before, last, opcode, target),
                    None => self.truth_jump(expr, wanted, target),
                },
                None => self.condition(first, wanted, target),
            },
            CheckedExprKind::Call { callee, args } => match args.as_slice() {
                // This form saves the instruction that puts the result of `isnil` on the stack.
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

    /// Generates a condition such as `a and b or c`, which jumps as soon as the truth of the whole
    /// is known.
    fn logic_condition(
        &mut self,
        first: &'a CheckedExpr,
        links: &'a [CheckedLink],
        wanted: bool,
        target: Label,
    ) {
        // Links are visited from the last to the first, because each link determines where the
        // operand before it jumps, and on which truth.
        let (mut wanted, mut target) = (wanted, target);
        let mut ends = Vec::with_capacity(links.len());
        for link in links.iter().rev() {
            let of_right = (wanted, target);
            // The truth of the left side that decides the result alone: false for `and`, true for
            // `or`.
            let deciding = link.op == BinaryOp::Or;
            let skipped = (wanted != deciding).then(|| self.builder.label());
            if let Some(skipped) = skipped {
                (wanted, target) = (deciding, skipped);
            }
            ends.push((link, of_right, skipped));
        }
        self.condition(first, wanted, target);
        for (link, (wanted, target), skipped) in ends.into_iter().rev() {
            self.condition(&link.right, wanted, target);
            if let Some(skipped) = skipped {
                self.builder.bind(skipped, link.span);
            }
        }
    }

    /// Generates the comparison `last` of the value before it as the jump `opcode`.
    fn comparison(
        &mut self,
        first: &'a CheckedExpr,
        before: &'a [CheckedLink],
        last: &'a CheckedLink,
        opcode: u8,
        target: Label,
    ) {
        self.chain(first, before);
        let immediate = match last.right.kind {
            CheckedExprKind::Int(value) => i16::try_from(value).ok(),
            _ => None,
        };
        let is_done = immediate
            .is_some_and(|immediate| self.builder.jump_int(opcode, immediate, target, last.span));
        if !is_done {
            self.expr(&last.right);
            self.note_order(last.op, before.is_empty().then_some(first), &last.right);
            self.builder.jump(opcode, target, last.span);
        }
    }

    fn truth_jump(&mut self, expr: &'a CheckedExpr, wanted: bool, target: Label) {
        self.expr(expr);
        let opcode = if wanted { opcode::JUMP_TRUE } else { opcode::JUMP_FALSE };
        self.builder.jump(opcode, target, expr.span);
    }

    /// Returns true if the callee certainly is the global built-in with that number.
    fn is_builtin(&self, callee: &CheckedExpr, number: u8) -> bool {
        matches!(callee.kind, CheckedExprKind::Name(name)
            if self.generator.meanings.of(name) == Meaning::Builtin(number))
    }
}

/// Returns the jump that is taken if the comparison is `wanted`. With NaN, an order and its
/// opposite are both false, so the jump for a false comparison is an instruction of its own.
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
