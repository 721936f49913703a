//! Equality and order of values.

use core::cmp::Ordering;

use super::Vm;
use crate::builtin::string;
use crate::bytecode::ByteCode;
use crate::fault::{FaultCode, Stopped};
use crate::number::{self, Profile};
use crate::opcode;
use crate::value::{Tag, Value};

impl<P: Profile, C: ByteCode, const SLOTS: usize> Vm<P, C, SLOTS> {
    /// `a == b`: numbers by value, strings by text, tables and closures by identity.
    #[inline(never)]
    pub(super) fn equal(&self, a: Value<P>, b: Value<P>) -> bool {
        if a.is_number() && b.is_number() {
            return order_of_numbers(a, b) == Some(Ordering::Equal);
        }
        if a.is(Tag::BOUND) && b.is(Tag::BOUND) {
            // Reading a method twice binds it twice: still the same method of the same table.
            let (a, b) = (a.index(), b.index());
            return self.arena.closure_function(a).same(self.arena.closure_function(b))
                && self.arena.closure_self(a).same(self.arena.closure_self(b));
        }
        a.same(b) || self.arena.same_text(a, b)
    }

    /// The order of `a` and `b`: `None` if one is not a number, a fault if they have no order.
    #[inline(never)]
    pub(super) fn order(&mut self, a: Value<P>, b: Value<P>) -> Result<Option<Ordering>, Stopped> {
        if a.is_nil() || b.is_nil() {
            // nil is less than all else.
            return Ok(Some(b.is_nil().cmp(&a.is_nil())));
        }
        if a.is_number() && b.is_number() {
            return Ok(order_of_numbers(a, b));
        }
        if let (Some(a), Some(b)) = (a.as_string(), b.as_string()) {
            return Ok(Some(self.order_of_constants(a, b)));
        }
        #[cfg(feature = "strings")]
        if self.is_text(a) && self.is_text(b) {
            return Ok(Some(self.order_of_texts(a, b)));
        }
        Err(self.fail_on(FaultCode::Unordered, a, b))
    }

    /// The machine's own strings and those of the script are each numbered in order; the image's order table tells
    /// how they mix.
    fn order_of_constants(&self, a: u16, b: u16) -> Ordering {
        if (a < string::COUNT) == (b < string::COUNT) {
            return a.cmp(&b);
        }
        let Some(program) = &self.program else { return Ordering::Equal };
        if !program.header().has_order() {
            return Ordering::Equal;
        }
        let a_is_own = a < string::COUNT;
        let (own, other) = if a_is_own { (a, b) } else { (b, a) };
        // A string of the script with n own strings before it is above number n - 1 and below n.
        let own_is_less = own < u16::from(program.string_order(other));
        if own_is_less == a_is_own { Ordering::Less } else { Ordering::Greater }
    }

    /// Whether the relation of an instruction holds.
    #[inline(never)]
    pub(super) fn compare_slow(
        &mut self,
        instruction: u8,
        a: Value<P>,
        b: Value<P>,
    ) -> Result<bool, Stopped> {
        // The relations of jumps and of values are in the same order.
        let relation = if instruction >= opcode::JUMP_EQ {
            instruction - (opcode::JUMP_EQ - opcode::EQ)
        } else {
            instruction
        };
        if relation <= opcode::NE {
            return Ok(self.equal(a, b) == (relation == opcode::EQ));
        }
        let order = self.order(a, b)?;
        let unless = relation > opcode::GE;
        let relation = if unless { relation - NEGATED } else { relation };
        // In the order LT, LE, GT, GE.
        let holds = match order {
            None => false,
            Some(Ordering::Equal) => relation & 1 == opcode::LE & 1,
            Some(order) => (order == Ordering::Less) == (relation <= opcode::LE),
        };
        Ok(holds != unless)
    }
}

/// From a relation to its opposite.
const NEGATED: u8 = opcode::JUMP_NOT_LT - opcode::JUMP_LT;

const _: () = {
    assert!(opcode::NE == opcode::EQ + 1 && opcode::LT == opcode::EQ + 2);
    assert!(opcode::LE == opcode::LT + 1 && opcode::GT == opcode::LT + 2);
    assert!(opcode::GE == opcode::LT + 3);
    assert!(opcode::JUMP_GE - opcode::JUMP_EQ == opcode::GE - opcode::EQ);
    assert!(opcode::JUMP_NOT_GE - opcode::JUMP_EQ == opcode::GE + NEGATED - opcode::EQ);
};

/// The order of two numbers, `None` if one is not a number.
#[inline(never)]
fn order_of_numbers<P: Profile>(a: Value<P>, b: Value<P>) -> Option<Ordering> {
    number::compare(a.as_number()?, b.as_number()?)
}
