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
        if a.is(Tag::FLOAT) || b.is(Tag::FLOAT) {
            return match (a.as_number(), b.as_number()) {
                (Some(a), Some(b)) => number::compare(a, b) == Some(Ordering::Equal),
                _ => false,
            };
        }
        if a.same(b) {
            return true;
        }
        if a.is(Tag::BOUND) && b.is(Tag::BOUND) {
            // Reading a method twice binds it twice: still the same method of the same table.
            let (a, b) = (a.index(), b.index());
            return self.arena.closure_function(a).same(self.arena.closure_function(b))
                && self.arena.closure_self(a).same(self.arena.closure_self(b));
        }
        self.arena.same_text(a, b)
    }

    /// The order of `a` and `b`: `None` if one is not a number, a fault if they have no order.
    #[inline(never)]
    pub(super) fn order(&mut self, a: Value<P>, b: Value<P>) -> Result<Option<Ordering>, Stopped> {
        match (a.is_nil(), b.is_nil()) {
            (true, true) => return Ok(Some(Ordering::Equal)),
            (true, false) => return Ok(Some(Ordering::Less)),
            (false, true) => return Ok(Some(Ordering::Greater)),
            (false, false) => {}
        }
        if let (Some(a), Some(b)) = (a.as_number(), b.as_number()) {
            return Ok(number::compare(a, b));
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
        // A string of the script with n own strings before it is above number n - 1 and below n.
        if a < string::COUNT {
            if a < u16::from(program.string_order(b)) { Ordering::Less } else { Ordering::Greater }
        } else if b < u16::from(program.string_order(a)) {
            Ordering::Greater
        } else {
            Ordering::Less
        }
    }

    /// Whether the relation of an instruction holds.
    #[inline(never)]
    pub(super) fn compare_slow(
        &mut self,
        instruction: u8,
        a: Value<P>,
        b: Value<P>,
    ) -> Result<bool, Stopped> {
        match instruction {
            opcode::EQ | opcode::JUMP_EQ => return Ok(self.equal(a, b)),
            opcode::NE | opcode::JUMP_NE => return Ok(!self.equal(a, b)),
            _ => {}
        }
        let order = self.order(a, b)?;
        Ok(match instruction {
            opcode::LT | opcode::JUMP_LT => order == Some(Ordering::Less),
            opcode::GT | opcode::JUMP_GT => order == Some(Ordering::Greater),
            opcode::LE | opcode::JUMP_LE => matches!(order, Some(Ordering::Less | Ordering::Equal)),
            opcode::GE | opcode::JUMP_GE => {
                matches!(order, Some(Ordering::Greater | Ordering::Equal))
            }
            opcode::JUMP_NOT_LT => order != Some(Ordering::Less),
            opcode::JUMP_NOT_GT => order != Some(Ordering::Greater),
            opcode::JUMP_NOT_LE => !matches!(order, Some(Ordering::Less | Ordering::Equal)),
            _ => !matches!(order, Some(Ordering::Greater | Ordering::Equal)),
        })
    }
}
