//! Equality and order of values.

use core::cmp::Ordering;

use super::Vm;
use super::interpret::order_of;
use crate::builtin::string;
use crate::bytecode::ByteCode;
use crate::fault::{FaultCode, Stopped};
use crate::number::Profile;
use crate::number::wide::IS_WIDE;
use crate::opcode::order;
use crate::part::Part;
use crate::value::{Tag, Value};

/// The bits of both orders of unequal values.
const UNEQUAL: u8 = order::LESS | order::GREATER;

impl<P: Profile, C: ByteCode, const SLOTS: usize> Vm<P, C, SLOTS> {
    /// Returns true if `a == b`. Numbers are compared by value, strings by text, tables and
    /// closures by identity.
    #[one_copy]
    pub(super) fn equal(&self, a: Value<P>, b: Value<P>) -> bool {
        if a.is_number() && b.is_number() {
            return Self::order_of_numbers(a, b) == order::EQUAL;
        }
        if Self::HAS_BOUND_METHODS && a.is(Tag::BOUND) && b.is(Tag::BOUND) {
            // Each read of a method makes a new bound function. Two of them are equal if they bind
            // the same function to the same table.
            let (a, b) = (a.index(), b.index());
            return self.arena.closure_function(a).same(self.arena.closure_function(b))
                && self.arena.closure_self(a).same(self.arena.closure_self(b));
        }
        a.same(b) || self.arena.same_text(a, b)
    }

    /// Returns the order of `a` and `b` as one bit of [`order`], `NONE` if one of them is NaN.
    /// Fails if the types have no order.
    #[one_copy]
    pub(super) fn order(&mut self, a: Value<P>, b: Value<P>) -> Result<u8, Stopped> {
        // nil is less than every other value.
        if b.is_nil() {
            return Ok(if a.is_nil() { order::EQUAL } else { order::GREATER });
        }
        if a.is_nil() {
            return Ok(order::LESS);
        }
        if a.is_number() && b.is_number() {
            return Ok(Self::order_of_numbers(a, b));
        }
        if let (Some(a), Some(b)) = (a.as_string(), b.as_string()) {
            return Ok(self.order_of_constants(a, b));
        }
        if P::FULL && self.is_text(a) && self.is_text(b) {
            return Ok(bit_of(Some(self.order_of_texts(a, b))));
        }
        Err(self.fail_on(FaultCode::Unordered, a, b))
    }

    /// Returns the order of two constant strings. The machine's own strings and those of the script
    /// are each numbered in order; the image's order table merges the two orders.
    fn order_of_constants(&self, a: u16, b: u16) -> u8 {
        let a_is_own = a < string::COUNT;
        let is_less = if a_is_own == (b < string::COUNT) {
            if a == b {
                return order::EQUAL;
            }
            a < b
        } else {
            let Some(program) = self.program() else { return order::EQUAL };
            if !program.header().has_order() {
                return order::EQUAL;
            }
            let (own, other) = if a_is_own { (a, b) } else { (b, a) };
            // A string of the script with n own strings before it sorts after own string n - 1 and
            // before own string n.
            let own_is_less = own < u16::from(program.string_order(other));
            own_is_less == a_is_own
        };
        if is_less { order::LESS } else { order::GREATER }
    }

    /// Returns true if the relation that an instruction tests holds.
    #[one_copy]
    pub(super) fn compare_slow(
        &mut self,
        instruction: u8,
        a: Value<P>,
        b: Value<P>,
    ) -> Result<bool, Stopped> {
        let found = match instruction & (order::LESS | order::EQUAL | order::GREATER) {
            order::EQUAL | UNEQUAL if self.equal(a, b) => order::EQUAL,
            order::EQUAL | UNEQUAL => order::LESS,
            _ => self.order(a, b)?,
        };
        Ok(instruction & found != 0)
    }

    /// Returns the order of two numbers.
    #[one_copy]
    pub(super) fn order_of_numbers(a: Value<P>, b: Value<P>) -> u8 {
        if !Self::has(Part::Floats) || a.is(Tag::INT) && b.is(Tag::INT) {
            // Unpacking integers would take ten times as long.
            return order_of::<P>(a.raw(), b.raw());
        }
        if IS_WIDE {
            return bit_of(a.as_f64().partial_cmp(&b.as_f64()));
        }
        bit_of(a.unpack().compare(&b.unpack()))
    }
}

/// Returns an order as one bit of [`order`].
fn bit_of(order: Option<Ordering>) -> u8 {
    match order {
        Some(Ordering::Less) => order::LESS,
        Some(Ordering::Equal) => order::EQUAL,
        Some(Ordering::Greater) => order::GREATER,
        None => order::NONE,
    }
}
