//! Unpacked floats: the working form of everything that is computed with floats.
//!
//! A significand of 32 bits holds the integers and floats of both profiles exactly, and the mathematical functions have
//! eight bits more than binary32 for their errors, so that a result is rounded once. Everything is integer arithmetic,
//! which no floating-point library or unit can do differently.
//!
//! # Special numbers
//! Zero, infinity and NaN are told by their exponents alone, which are so far apart that the exponents of products and
//! ratios tell what those are.
//!
//! # Size
//! An AVR passes eight bytes in registers at great cost, and 32-bit operations are long there. So operations change a
//! number in its place, are not inlined, and shift bit by bit.

use core::cmp::Ordering;

use super::profile::Profile;

/// The exponent of zero: no sum of exponents of numbers that are not zero comes near.
const ZERO_EXPONENT: i16 = -0x2000;
const INFINITE_EXPONENT: i16 = 0x2000;
const NAN_EXPONENT: i16 = 0x3000;
/// Beyond every exponent of a number that is neither zero nor infinite nor NaN.
const FINITE_LIMIT: i16 = 0x07FF;

/// How a number becomes an integer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rounding {
    /// Towards zero.
    Truncate,
    /// Towards minus infinity.
    Floor,
    /// Towards infinity.
    Ceil,
    /// To the nearest, that farther from zero of two.
    Nearest,
}

/// The number `significand / 2^32 * 2^exponent`, with a sign. Bit 31 of the significand is set, but for zero and NaN.
#[derive(Clone, Copy, Debug)]
pub struct Float {
    pub(super) significand: u32,
    pub(super) exponent: i16,
    pub(super) negative: bool,
}

impl Float {
    /// 0.
    pub const ZERO: Float = Float::new(0, ZERO_EXPONENT);
    /// 1.
    pub const ONE: Float = Float::new(1 << 31, 1);
    /// Infinity.
    pub const INFINITY: Float = Float::new(1 << 31, INFINITE_EXPONENT);
    /// NaN.
    pub const NAN: Float = Float::new(0, NAN_EXPONENT);

    /// `significand / 2^32 * 2^exponent`, where bit 31 of the significand is set.
    pub(super) const fn new(significand: u32, exponent: i16) -> Float {
        Float { significand, exponent, negative: false }
    }

    /// `fraction / 2^32 * 2^exponent`.
    #[inline(never)]
    pub(super) fn normalized(fraction: u32, exponent: i16) -> Float {
        let mut number = Float::new(fraction, exponent);
        number.add(&Float::new(0, ZERO_EXPONENT));
        number
    }

    /// An integer.
    #[inline(never)]
    pub fn from_int(value: i32) -> Float {
        let mut number = Float::normalized(value.unsigned_abs(), 32);
        number.negative = value < 0;
        number
    }

    /// A binary32.
    #[inline(never)]
    pub fn from_f32(value: f32) -> Float {
        let bits = value.to_bits();
        let fraction = bits << 9;
        let mut number = match (bits >> 23) as u8 {
            0 => Float::normalized(fraction, -126),
            255 if fraction == 0 => Float::INFINITY,
            255 => Float::NAN,
            field => Float::new(bits << 8 | 1 << 31, i16::from(field).wrapping_sub(126)),
        };
        number.negative = bits >> 31 != 0;
        number
    }

    /// The nearest binary32, the even one of two; every NaN becomes one.
    #[inline(never)]
    pub fn to_f32(&self) -> f32 {
        if self.is_nan() {
            return f32::from_bits(0x7FC0_0000);
        }
        let (mut significand, mut field) = (self.significand, self.exponent.wrapping_add(126));
        if field < 1 {
            // Subnormal or zero.
            significand = shift_right(significand, 1_i16.wrapping_sub(field));
            field = 1;
        }
        let bits = if field > 254 {
            0x7F80_0000
        } else {
            // The leading bit of a normal significand makes up for the 1 that is subtracted.
            let truncated = ((field.wrapping_sub(1) as u32) << 23).wrapping_add(significand >> 8);
            let half_or_less = 0x7F_u16.wrapping_add(truncated as u16 & 1);
            let carry = (significand as u16 & 0xFF).wrapping_add(half_or_less) >> 8;
            truncated.wrapping_add(u32::from(carry))
        };
        f32::from_bits(if self.negative { bits | 1 << 31 } else { bits })
    }

    /// Whether it is NaN.
    pub fn is_nan(&self) -> bool {
        self.exponent == NAN_EXPONENT
    }

    /// Whether it is zero.
    pub(super) fn is_zero(&self) -> bool {
        self.exponent < -FINITE_LIMIT
    }

    /// Whether it is infinite or NaN.
    pub(super) fn is_endless(&self) -> bool {
        self.exponent > FINITE_LIMIT
    }

    /// Whether it is zero, infinite or NaN.
    pub(super) fn is_special(&self) -> bool {
        self.is_zero() || self.is_endless()
    }

    /// Makes it NaN.
    pub(super) fn set_nan(&mut self) {
        self.exponent = NAN_EXPONENT;
    }

    /// Makes it its magnitude.
    pub fn abs(&mut self) {
        self.negative = false;
    }

    /// Changes the sign.
    pub fn negate(&mut self) {
        self.negative = !self.negative;
    }

    /// Adds a number. The last bit of the sum also stands for all bits after it, so that rounding to fewer bits is right.
    pub fn add(&mut self, other: &Float) {
        self.operate(operation::ADD, other);
    }

    /// Subtracts a number.
    pub fn sub(&mut self, other: &Float) {
        self.operate(operation::SUB, other);
    }

    /// Multiplies by a number.
    pub fn mul(&mut self, other: &Float) {
        self.operate(operation::MUL, other);
    }

    /// Divides by a number.
    pub fn div(&mut self, other: &Float) {
        self.operate(operation::DIV, other);
    }

    /// Sets it to the result of an [`operation`] on it and `other`.
    ///
    /// One function for all: its frame, and loading and storing numbers, are a large part of each of them on an AVR.
    #[inline(never)]
    pub fn operate(&mut self, operation: u8, other: &Float) {
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
        // What a result without bits is: of a sum zero, positive unless both were negative.
        let mut zero_exponent = exponent;
        let mut differ = false;
        match operation {
            operation::ADD | operation::SUB => {
                let mut other_negative = other.negative != (operation == operation::SUB);
                differ = negative != other_negative;
                if distance < 0 {
                    (left, right) = (right, left);
                    (negative, other_negative) = (other_negative, negative);
                    exponent = other.exponent;
                    distance = distance.wrapping_neg();
                }
                zero_exponent = if exponent > FINITE_LIMIT { 0 } else { ZERO_EXPONENT };
                right = shift_right(right, distance);
                if differ {
                    let borrow;
                    (left, borrow) = left.overflowing_sub(right);
                    if borrow {
                        left = left.wrapping_neg();
                        negative = other_negative;
                    }
                } else {
                    let carry;
                    (left, carry) = left.overflowing_add(right);
                    if carry {
                        left = left >> 1 | left & 1 | 1 << 31;
                        exponent = exponent.wrapping_add(1);
                    }
                }
            }
            operation::MUL => {
                negative ^= other.negative;
                exponent = exponent.wrapping_add(other.exponent);
                zero_exponent = exponent;
                let product = multiply(left, right);
                let mut low = product as u32;
                left = (product >> 32) as u32;
                if left >> 31 == 0 {
                    left = left << 1 | low >> 31;
                    low <<= 1;
                    exponent = exponent.wrapping_sub(1);
                }
                left = left.saturating_add(low >> 31);
            }
            _ => {
                // Digit by digit: what is left of the first number, doubled at each step, less the second if that is not
                // negative. The quotient's bits tell where it was not.
                let mut steps = 31;
                let mut carry = false;
                if operation == operation::DIV {
                    negative ^= other.negative;
                    zero_exponent = distance;
                    exponent = distance.wrapping_add(1);
                    if left < right {
                        exponent = distance;
                        carry = left >> 31 != 0;
                        left <<= 1;
                    }
                    if distance == 0 && other.is_special() {
                        self.set_nan();
                        return;
                    }
                } else if operation == operation::REMAINDER {
                    steps = distance;
                    zero_exponent = ZERO_EXPONENT;
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
                    // With an even exponent the root has its first bit set. The bit that may get lost is 0 in a
                    // binary32, where exactness matters.
                    if exponent & 1 != 0 {
                        left >>= 1;
                    }
                    exponent = exponent.wrapping_add(1) >> 1;
                }
                let mut quotient = 0_u32;
                let mut bit = 1_u32 << 31;
                while steps >= 0 {
                    if operation > operation::REMAINDER {
                        // The divisor of a root is twice the root so far and the next bit, here halved.
                        right = quotient | bit >> 1;
                    }
                    if carry || left >= right {
                        left = left.wrapping_sub(right);
                        quotient |= bit;
                    }
                    if steps == 0 {
                        break;
                    }
                    steps = steps.wrapping_sub(1);
                    bit >>= 1;
                    carry = left >> 31 != 0;
                    left <<= 1;
                }
                if operation != operation::REMAINDER {
                    // The last bit also stands for all bits after it.
                    left = quotient | u32::from(left != 0);
                }
            }
        }
        let mut most = 32_u8;
        while left >> 31 == 0 {
            if most == 0 {
                // 0 * infinity and infinity - infinity are NaN.
                exponent = if zero_exponent < -FINITE_LIMIT { ZERO_EXPONENT } else { NAN_EXPONENT };
                negative &= !differ;
                break;
            }
            most = most.wrapping_sub(1);
            left <<= 1;
            exponent = exponent.wrapping_sub(1);
        }
        if exponent > FINITE_LIMIT && exponent != NAN_EXPONENT {
            exponent = INFINITE_EXPONENT;
        }
        *self = Float { significand: left, exponent, negative };
    }

    /// The order of two numbers; `None` if one is NaN.
    #[inline(never)]
    pub fn compare(&self, other: &Float) -> Option<Ordering> {
        if self.is_nan() || other.is_nan() {
            return None;
        }
        if self.is_zero() && other.is_zero() {
            return Some(Ordering::Equal);
        }
        let less = if self.negative == other.negative {
            if self.exponent == other.exponent && self.significand == other.significand {
                return Some(Ordering::Equal);
            }
            self.is_smaller(other) != self.negative
        } else {
            self.negative
        };
        Some(if less { Ordering::Less } else { Ordering::Greater })
    }

    /// Whether its magnitude is smaller.
    #[inline(never)]
    pub(super) fn is_smaller(&self, other: &Float) -> bool {
        if self.exponent == other.exponent {
            self.significand < other.significand
        } else {
            self.exponent < other.exponent
        }
    }

    /// Four times its magnitude if that is below 2^32, and the last bit also stands for all after it; else 0.
    #[inline(never)]
    pub(super) fn quarters(&self) -> u32 {
        let shift = 30_i16.wrapping_sub(self.exponent);
        if shift < 0 { 0 } else { shift_right(self.significand, shift) }
    }

    /// An integer; the nearest `i32` if that does not fit, 0 for NaN.
    #[inline(never)]
    pub fn to_int(&self, rounding: Rounding) -> i32 {
        if self.is_nan() {
            return 0;
        }
        let quarters = match rounding {
            Rounding::Floor if self.negative => 3,
            Rounding::Ceil if !self.negative => 3,
            Rounding::Nearest => 2,
            _ => 0,
        };
        // From 2^23 on all floats are integers.
        let mut whole = (self.quarters().wrapping_add(quarters) >> 2) as i32;
        if self.exponent > 30 {
            whole = (self.significand >> 1) as i32;
        }
        if self.exponent > 31 {
            whole = i32::MAX;
            if self.negative {
                return i32::MIN;
            }
        }
        if self.negative { whole.wrapping_neg() } else { whole }
    }

    /// The integer that it is, if it is one.
    pub fn as_int(&self) -> Option<i32> {
        let int = self.to_int(Rounding::Truncate);
        let equal = Float::from_int(int).compare(self) == Some(Ordering::Equal);
        if equal { Some(int) } else { None }
    }

    /// Sets it to the Euclidean remainder of its division by `other`, the `r` in `0..|other|` for which the number minus
    /// `r` is a multiple of `other`, as a float of the profile.
    ///
    /// That is always below `|other|`: where the nearest float would be `|other|` itself (of a tiny negative number), it is
    /// the float before. NaN if `other` is 0, the number is infinite or either is NaN. With an infinite `other` the
    /// number itself, or for a negative one the largest float.
    #[inline(never)]
    pub fn modulo<P: Profile>(&mut self, other: &Float) {
        self.operate(operation::REMAINDER, other);
        let mut bound = *other;
        bound.negative = false;
        if self.negative && !self.is_zero() {
            self.add(&bound);
        }
        self.negative = false;
        let mut raw = P::pack(self);
        *self = P::unpack(raw);
        if !self.is_nan() && !self.is_smaller(&bound) {
            // Positive floats are ordered like their bits.
            raw = P::sub(raw, P::raw_from_u16(1));
            *self = P::unpack(raw);
        }
    }
}

/// For the functions of [`super::maths`].
#[cfg(feature = "maths")]
impl Float {
    /// Sets it to 1.
    #[inline(never)]
    pub(super) fn set_one(&mut self) {
        self.significand = 1 << 31;
        self.exponent = 1;
        self.negative = false;
    }

    /// Whether it is 1.
    pub(super) fn is_one(&self) -> bool {
        self.exponent == 1 && self.significand == 1 << 31 && !self.negative
    }

    /// Makes infinity of zero, and zero of infinity.
    pub(super) fn invert_special(&mut self) {
        self.significand ^= 1 << 31;
        self.exponent = self.exponent.wrapping_neg();
    }

    /// The square of a magnitude of at most 1, as a fraction of 2^32.
    #[inline(never)]
    pub(super) fn square(&self) -> u32 {
        let fixed = if self.exponent > 0 {
            u32::MAX
        } else {
            shift_right(self.significand, self.exponent.wrapping_neg())
        };
        multiply_high(fixed, fixed)
    }
}

/// The operations of [`Float::operate`].
pub mod operation {
    /// The sum. Its last bit also stands for all bits after it, so that rounding to fewer bits is right.
    pub const ADD: u8 = 0;
    /// The difference, likewise.
    pub const SUB: u8 = 1;
    /// The product, rounded to the nearest.
    pub const MUL: u8 = 2;
    /// The ratio, rounded to the nearest.
    pub const DIV: u8 = 3;
    /// The remainder of the magnitudes, exact, with the sign of the first.
    pub const REMAINDER: u8 = 4;
    /// The square root of the first. The last bit is set if it is not exact, so that rounding to fewer bits is right; the
    /// one before it is 0.
    #[cfg(feature = "maths")]
    pub const ROOT: u8 = 5;
}

/// `bits / 2^count`; the last bit also stands for all that are shifted out.
#[inline(never)]
pub(super) fn shift_right(bits: u32, count: i16) -> u32 {
    if count > 31 {
        return u32::from(bits != 0);
    }
    let (mut bits, mut count) = (bits, count as u8);
    while count > 0 {
        bits = bits >> 1 | bits & 1;
        count = count.wrapping_sub(1);
    }
    bits
}

/// The product of two words.
///
/// Schoolbook multiplication in halves: multiplying 64-bit numbers would call a slow and large library routine on
/// processors that multiply at most 32 bits.
#[inline(never)]
pub extern "C" fn multiply(a: u32, b: u32) -> u64 {
    let (a_high, a_low) = (a >> 16, a & 0xFFFF);
    let (b_high, b_low) = (b >> 16, b & 0xFFFF);
    // No sum overflows: (2^16 - 1)^2 + 2 (2^16 - 1) = 2^32 - 1.
    let lowest = a_low.wrapping_mul(b_low);
    let middle = a_high.wrapping_mul(b_low).wrapping_add(lowest >> 16);
    let other = a_low.wrapping_mul(b_high).wrapping_add(middle & 0xFFFF);
    let high = a_high.wrapping_mul(b_high).wrapping_add(middle >> 16).wrapping_add(other >> 16);
    u64::from(high) << 32 | u64::from(other << 16 | lowest & 0xFFFF)
}

/// The high word of the product: the product of two fractions of 2^32.
#[cfg_attr(not(feature = "maths"), allow(dead_code))]
pub(super) fn multiply_high(a: u32, b: u32) -> u32 {
    (multiply(a, b) >> 32) as u32
}
