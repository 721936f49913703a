//! Equality and order of values.

use core::cmp::Ordering;

use super::Vm;
use crate::builtin::string;
use crate::bytecode::ByteCode;
use crate::fault::{FaultCode, Stopped};
use crate::number::Profile;
use crate::opcode::order;
use crate::part::Part;
use crate::value::{Tag, Value};

/// The orders of values that are not equal.
const UNEQUAL: u8 = order::LESS | order::GREATER;

impl<P: Profile, C: ByteCode, const SLOTS: usize> Vm<P, C, SLOTS> {
    /// `a == b`: numbers by value, strings by text, tables and closures by identity.
    #[inline(never)]
    pub(super) fn equal(&self, a: Value<P>, b: Value<P>) -> bool {
        if a.is_number() && b.is_number() {
            return Self::order_of_numbers(a, b) == Some(Ordering::Equal);
        }
        if Self::BINDS && a.is(Tag::BOUND) && b.is(Tag::BOUND) {
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
            return Ok(Self::order_of_numbers(a, b));
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
        let found = match instruction & (order::LESS | order::EQUAL | order::GREATER) {
            order::EQUAL | UNEQUAL if self.equal(a, b) => order::EQUAL,
            order::EQUAL | UNEQUAL => order::LESS,
            _ => match self.order(a, b)? {
                Some(Ordering::Less) => order::LESS,
                Some(Ordering::Equal) => order::EQUAL,
                Some(Ordering::Greater) => order::GREATER,
                None => order::NONE,
            },
        };
        Ok(instruction & found != 0)
    }

    /// The order of two numbers, `None` if one is NaN.
    #[inline(never)]
    fn order_of_numbers(a: Value<P>, b: Value<P>) -> Option<Ordering> {
        if !Self::has(Part::Floats) || a.is(Tag::INT) && b.is(Tag::INT) {
            // To unpack integers takes ten times as long.
            return Some(match P::int_less(a.raw(), b.raw()) {
                true => Ordering::Less,
                false if a.same(b) => Ordering::Equal,
                false => Ordering::Greater,
            });
        }
        a.unpack().compare(&b.unpack())
    }
}
