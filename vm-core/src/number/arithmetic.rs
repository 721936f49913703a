//! The basic operations, remainder and square root.
//!
//! # Size
//! An AVR passes structures in registers at great cost, and shifts bit by bit. Operations therefore
//! change a number in place, and are not inlined.

use super::float::{FINITE_LIMIT, Float, INFINITE_EXPONENT, ZERO_EXPONENT};
use super::profile::Profile;
use super::wide;
use super::word::Word;

/// The operations of [`Float::operate`]. The last bit of a result is also set if any bit after it
/// is, so that rounding to fewer bits is right. Products of the full profile are rounded to the
/// nearest instead.
pub mod operation {
    /// The sum.
    pub const ADD: u8 = 0;
    /// The difference.
    pub const SUB: u8 = 1;
    /// The product.
    pub const MUL: u8 = 2;
    /// The ratio.
    pub const DIV: u8 = 3;
    /// The remainder of the magnitudes, exact, with the sign of the first.
    pub const REMAINDER: u8 = 4;
    /// The square root of the first.
    pub const ROOT: u8 = 5;
}

impl<P: Profile> Float<P> {
    /// Shifts the significand, which is not 0, until its first bit is set.
    #[one_copy]
    pub(super) fn normalize(&mut self) {
        let (mut significand, mut exponent) = (self.significand, self.exponent);
        if wide::IS_WIDE {
            let zeros = wide::leading_zeros(significand);
            significand = significand << zeros;
            exponent = exponent.wrapping_sub(zeros.into());
        }
        while !significand.has_first() {
            significand = significand << 1;
            exponent = exponent.wrapping_sub(1);
        }
        if exponent > FINITE_LIMIT {
            exponent = INFINITE_EXPONENT;
        }
        (self.significand, self.exponent) = (significand, exponent);
    }

    /// Adds a number.
    pub fn add(&mut self, other: &Self) {
        self.operate(operation::ADD, other);
    }

    /// Subtracts a number.
    pub fn sub(&mut self, other: &Self) {
        self.operate(operation::SUB, other);
    }

    /// Multiplies by a number.
    pub fn mul(&mut self, other: &Self) {
        self.operate(operation::MUL, other);
    }

    /// Divides by a number.
    pub fn div(&mut self, other: &Self) {
        self.operate(operation::DIV, other);
    }

    /// Sets the number to the result of an [`operation`] on it and `other`.
    ///
    /// One function computes all operations, because its frame, and loading and storing numbers,
    /// are a large part of each of them on an AVR.
    #[one_copy]
    pub fn operate(&mut self, operation: u8, other: &Self) {
        if self.is_nan() {
            return;
        }
        if other.is_nan() {
            self.set_nan();
            return;
        }
        let (mut left, mut right) = (self.significand, other.significand);
        let (mut exponent, mut negative) = (self.exponent, self.negative);
        let mut distance = exponent.wrapping_sub(other.exponent);
        // True if a result without bits is NaN, as for 0 * infinity and infinity - infinity.
        let mut no_zero = false;
        match operation {
            operation::ADD | operation::SUB => {
                let other_negative = other.negative != (operation == operation::SUB);
                let differ = negative != other_negative;
                if distance < 0 || distance == 0 && left < right {
                    (left, right) = (right, left);
                    negative = other_negative;
                    exponent = other.exponent;
                    distance = distance.wrapping_neg();
                }
                right = shift_right(right, distance);
                if differ {
                    left = left.sub(right);
                    if left == P::ZERO {
                        negative = false;
                        no_zero = exponent > FINITE_LIMIT;
                    }
                } else {
                    let carry;
                    (left, carry) = left.add_carry(right);
                    if carry {
                        left = left >> 1 | left & P::Raw::ONE | P::Raw::FIRST;
                        exponent = exponent.wrapping_add(1);
                    }
                }
            }
            operation::MUL => {
                negative ^= other.negative;
                exponent = exponent.wrapping_add(other.exponent);
                no_zero = exponent >= -FINITE_LIMIT;
                let mut low;
                (left, low) = left.multiply(right);
                if !left.has_first() {
                    left = left << 1 | P::Raw::of(low.has_first());
                    low = low << 1;
                    exponent = exponent.wrapping_sub(1);
                }
                left = P::Raw::round(left, low);
            }
            _ => {
                let mut steps = Self::BITS - 1;
                let mut carry = false;
                if operation == operation::DIV {
                    negative ^= other.negative;
                    exponent = distance.wrapping_add(1);
                    if left < right {
                        exponent = distance;
                        carry = left.has_first();
                        left = left << 1;
                    }
                    if distance == 0 && other.is_special() {
                        self.set_nan();
                        return;
                    }
                } else if operation == operation::REMAINDER {
                    steps = distance;
                    if other.is_zero() || exponent > FINITE_LIMIT {
                        self.set_nan();
                        return;
                    }
                    if distance >= 0 {
                        exponent = other.exponent;
                    }
                } else {
                    if negative && !self.is_zero() {
                        self.set_nan();
                        return;
                    }
                    // With an even exponent the first bit of the root is set. The bit that may be
                    // lost is 0 in every number of the profile, for which exactness matters.
                    if exponent & 1 != 0 {
                        left = left >> 1;
                    }
                    exponent = exponent.wrapping_add(1) >> 1;
                }
                let root = operation > operation::REMAINDER;
                if steps >= 0 {
                    let (quotient, rest) = if wide::IS_WIDE {
                        divide_quickly(left, right, steps as u16, carry, root)
                    } else {
                        divide(left, right, steps as u16, carry, root)
                    };
                    // The last bit is also set if any bit after it is.
                    left = quotient | P::Raw::of(rest != P::ZERO);
                    if operation == operation::REMAINDER {
                        left = rest;
                    }
                }
            }
        }
        *self = Float { significand: left, exponent, negative };
        if left != P::ZERO {
            self.normalize();
        } else if no_zero {
            self.set_nan();
        } else {
            self.exponent = ZERO_EXPONENT;
        }
    }

    /// Multiplies the magnitude by a number that is neither zero nor endless, as [`Float::mul`]
    /// does. The number itself must not be endless.
    pub(super) fn scale(&mut self, other: &Self) {
        let (mut high, mut low) = self.significand.multiply(other.significand);
        let mut exponent = self.exponent.wrapping_add(other.exponent);
        if !high.has_first() {
            high = high << 1 | P::Raw::of(low.has_first());
            low = low << 1;
            exponent = exponent.wrapping_sub(1);
        }
        if self.significand != P::ZERO {
            self.significand = P::Raw::round(high, low);
            self.exponent = exponent;
        }
    }

    /// Returns the Euclidean remainder of the division by `other` as a float of the profile: the
    /// `r` in `0..|other|` for which the number minus `r` is a multiple of `other`.
    ///
    /// The result is always below `|other|`. For a tiny negative number the nearest float would be
    /// `|other|` itself; then the result is the float before. It is NaN if `other` is 0, the number
    /// is infinite or either is NaN. With an infinite `other` it is the number itself, or for a
    /// negative one the largest float.
    #[one_copy]
    pub fn modulo(&mut self, other: &Self) -> P::Raw {
        self.operate(operation::REMAINDER, other);
        if self.negative && !self.is_zero() {
            // This adds the magnitude of `other`.
            let operation = if other.negative { operation::SUB } else { operation::ADD };
            self.operate(operation, other);
        }
        self.negative = false;
        let raw = P::pack(self);
        let rounded = P::unpack(raw);
        if rounded.is_nan() || rounded.is_smaller(other) {
            return raw;
        }
        // Positive floats are ordered like their bits.
        P::sub(raw, P::raw_from_u16(1))
    }
}

/// Computes a quotient and its remainder digit by digit. Each of `steps` steps doubles the
/// remainder, which starts as `left` with a bit before it if `carry`, and subtracts the divisor if
/// the result is not negative. The bits of the quotient are set for the steps that subtracted. With
/// `root` it computes the square root of `left` instead.
#[one_copy]
pub(super) fn divide<W: Word>(left: W, right: W, steps: u16, carry: bool, root: bool) -> (W, W) {
    let (mut left, mut right, mut steps, mut carry) = (left, right, steps, carry);
    let mut quotient = W::ZERO;
    let mut bit = W::FIRST;
    loop {
        if root {
            // The divisor of a root is twice the root found until now plus the next bit, here
            // halved.
            right = quotient | bit >> 1;
        }
        if carry || left >= right {
            left = left.sub(right);
            quotient = quotient | bit;
        }
        if steps == 0 {
            return (quotient, left);
        }
        steps = steps.wrapping_sub(1);
        bit = bit >> 1;
        carry = left.has_first();
        left = left << 1;
    }
}

/// Divides or extracts a root, with the instructions of a processor of 64 bits.
fn divide_quickly<W: Word>(left: W, right: W, steps: u16, carry: bool, root: bool) -> (W, W) {
    if root {
        return wide::root(left);
    }
    let result = wide::divide(left, right, steps, carry);
    result.unwrap_or_else(|| divide(left, right, steps, carry, false))
}

/// Returns `bits / 2^count`. The last bit is also set if any bit that is shifted out is.
#[one_copy]
pub(super) fn shift_right<W: Word>(bits: W, count: i16) -> W {
    if count >= i16::from(W::BITS) {
        return W::of(bits != W::ZERO);
    }
    let (mut bits, mut count) = (bits, count as u8);
    if wide::IS_WIDE {
        return wide::shift_right(bits, count);
    }
    while count > 0 {
        bits = bits >> 1 | bits & W::ONE;
        count = count.wrapping_sub(1);
    }
    bits
}
