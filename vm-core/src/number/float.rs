//! Unpacked floats: the working form of everything that is computed with floats.
//!
//! A significand as wide as a payload holds the integers and floats of the profile exactly, and the mathematical functions
//! have six or eight bits more than a result for their errors, so that it is rounded once. Everything is integer
//! arithmetic, which no floating-point library or unit can do differently.
//!
//! # Special numbers
//! Zero, infinity and NaN are told by their exponents alone, which are so far apart that the exponents of products and
//! ratios tell what those are.
//!
//! # Size
//! An AVR passes structures in registers at great cost, and shifts bit by bit. So operations change a number in its place,
//! and are not inlined.

use core::cmp::Ordering;

use super::profile::{Full, Profile};
use super::word::Word;

/// The exponent of zero: no sum of exponents of numbers that are not zero comes near.
pub(super) const ZERO_EXPONENT: i16 = -0x2000;
pub(super) const INFINITE_EXPONENT: i16 = 0x2000;
pub(super) const NAN_EXPONENT: i16 = 0x3000;
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

/// The number `significand / 2^bits * 2^exponent`, with a sign, where the significand has that many bits. The first is set,
/// but for zero and NaN.
#[derive(Clone, Copy, Debug)]
// Two words are copied by two instructions; six bytes would be by the library's function, of 600 bytes.
#[cfg_attr(not(target_arch = "avr"), repr(align(4)))]
pub struct Float<P: Profile = Full> {
    pub(super) significand: P::Raw,
    pub(super) exponent: i16,
    pub(super) negative: bool,
}

impl Float {
    /// A binary32.
    #[inline(never)]
    pub fn from_f32(value: f32) -> Float {
        let bits = value.to_bits();
        let fraction = bits << 9;
        let mut number = match (bits >> 23) as u8 {
            0 => Float::normalized(fraction, -126),
            255 if fraction == 0 => Float::new(1 << 31, INFINITE_EXPONENT),
            255 => Float::new(0, NAN_EXPONENT),
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
}

impl<P: Profile> Float<P> {
    /// As a place of the point.
    const BITS: i16 = P::Raw::BITS as i16;

    /// `significand / 2^bits * 2^exponent`, where the first bit of the significand is set.
    #[inline(always)]
    pub(super) fn new(significand: P::Raw, exponent: i16) -> Self {
        Float { significand, exponent, negative: false }
    }

    /// `fraction / 2^bits * 2^exponent`.
    #[inline(never)]
    pub(super) fn normalized(fraction: P::Raw, exponent: i16) -> Self {
        let mut number = Float::new(fraction, exponent);
        if fraction == P::ZERO {
            number.exponent = ZERO_EXPONENT;
        } else {
            number.normalize();
        }
        number
    }

    /// The same of two words. The last bit also stands for all bits after it.
    #[inline(never)]
    pub(super) fn from_words(high: P::Raw, low: P::Raw, exponent: i16) -> Self {
        let mut number = Float::normalized(high, exponent);
        number.add(&Float::normalized(low, exponent.wrapping_sub(Self::BITS)));
        number
    }

    /// `fraction / 2^32 * 2^exponent`, likewise.
    #[inline(never)]
    pub(super) fn from_fraction(fraction: u32, exponent: i16) -> Self {
        let low = P::Raw::from_u32(fraction);
        if P::FULL {
            return Float::normalized(low, exponent);
        }
        Float::from_words(P::Raw::from_u32(fraction >> 16), low, exponent)
    }

    /// An integer of the profile.
    #[inline(never)]
    pub fn from_int(value: P::Raw) -> Self {
        let negative = value.has_first();
        let mut number = Float::normalized(if negative { value.neg() } else { value }, Self::BITS);
        number.negative = negative;
        number
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

    /// Shifts the significand, which is not 0, until its first bit is set.
    #[inline(never)]
    fn normalize(&mut self) {
        let (mut significand, mut exponent) = (self.significand, self.exponent);
        while !significand.has_first() {
            significand = significand << 1;
            exponent = exponent.wrapping_sub(1);
        }
        if exponent > FINITE_LIMIT {
            exponent = INFINITE_EXPONENT;
        }
        (self.significand, self.exponent) = (significand, exponent);
    }

    /// Adds a number. The last bit of the sum also stands for all bits after it, so that rounding to fewer bits is right.
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

    /// Sets it to the result of an [`operation`] on it and `other`.
    ///
    /// One function for all: its frame, and loading and storing numbers, are a large part of each of them on an AVR.
    #[inline(never)]
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
        // Whether a result without bits is NaN, as 0 * infinity and infinity - infinity are.
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
                    // With an even exponent the root has its first bit set. The bit that may get lost is 0 in every number
                    // of the profile, where exactness matters.
                    if exponent & 1 != 0 {
                        left = left >> 1;
                    }
                    exponent = exponent.wrapping_add(1) >> 1;
                }
                let root = operation > operation::REMAINDER;
                if steps >= 0 {
                    let (quotient, rest) = divide(left, right, steps as u16, carry, root);
                    // The last bit also stands for all bits after it.
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

    /// The order of two numbers; `None` if one is NaN.
    #[inline(never)]
    pub fn compare(&self, other: &Self) -> Option<Ordering> {
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
    pub(super) fn is_smaller(&self, other: &Self) -> bool {
        if self.exponent == other.exponent {
            self.significand < other.significand
        } else {
            self.exponent < other.exponent
        }
    }

    /// An integer of the profile; the nearest if that does not fit, 0 for NaN.
    #[inline(never)]
    pub fn to_int(&self, rounding: Rounding) -> P::Raw {
        if self.is_nan() {
            return P::ZERO;
        }
        let quarters = match rounding {
            Rounding::Floor if self.negative => 3,
            Rounding::Ceil if !self.negative => 3,
            Rounding::Nearest => 2,
            _ => 0,
        };
        // All that are larger than that are integers.
        let shift = (Self::BITS - 2).wrapping_sub(self.exponent);
        let whole = if shift >= 0 {
            // Four times the magnitude, whose last bit also stands for all after it.
            shift_right(self.significand, shift).add(P::raw_from_u16(quarters)) >> 2
        } else if shift == -1 {
            self.significand >> 1
        } else if self.negative {
            return P::Raw::FIRST;
        } else {
            return !P::Raw::FIRST;
        };
        if self.negative { whole.neg() } else { whole }
    }

    /// Its integer part; the nearest `i32` if that does not fit, 0 for NaN.
    pub fn to_i32(&self) -> i32 {
        if P::FULL {
            return P::int_to_i32(self.to_int(Rounding::Truncate));
        }
        if self.is_nan() {
            return 0;
        }
        if self.exponent > 31 {
            return if self.negative { i32::MIN } else { i32::MAX };
        }
        let shift = 31_i16.wrapping_sub(self.exponent.max(0));
        let fixed = (self.significand.to_u32() as i32).wrapping_shl(u32::from(31 - P::Raw::BITS));
        let whole = fixed.wrapping_shr(shift as u32);
        if self.negative { whole.wrapping_neg() } else { whole }
    }

    /// The integer of the profile that it is, if it is one.
    #[inline(never)]
    pub fn as_int(&self) -> Option<P::Raw> {
        let int = self.to_int(Rounding::Truncate);
        let equal = Self::from_int(int).compare(self) == Some(Ordering::Equal);
        if equal { Some(int) } else { None }
    }

    /// Sets it to the Euclidean remainder of its division by `other`, the `r` in `0..|other|` for which the number minus
    /// `r` is a multiple of `other`, as a float of the profile.
    ///
    /// That is always below `|other|`: where the nearest float would be `|other|` itself (of a tiny negative number), it is
    /// the float before. NaN if `other` is 0, the number is infinite or either is NaN. With an infinite `other` the
    /// number itself, or for a negative one the largest float.
    #[inline(never)]
    pub fn modulo(&mut self, other: &Self) {
        self.operate(operation::REMAINDER, other);
        if self.negative && !self.is_zero() {
            // The magnitude is added.
            let operation = if other.negative { operation::SUB } else { operation::ADD };
            self.operate(operation, other);
        }
        self.negative = false;
        let raw = P::pack(self);
        *self = P::unpack(raw);
        if !self.is_nan() && !self.is_smaller(other) {
            // Positive floats are ordered like their bits.
            *self = P::unpack(P::sub(raw, P::raw_from_u16(1)));
        }
    }
}

/// For the functions of [`super::maths`].
#[cfg(feature = "maths")]
impl<P: Profile> Float<P> {
    /// Sets it to 1.
    #[inline(never)]
    pub(super) fn set_one(&mut self) {
        self.significand = P::Raw::FIRST;
        self.exponent = 1;
        self.negative = false;
    }

    /// Whether it is 1.
    pub(super) fn is_one(&self) -> bool {
        self.exponent == 1 && self.significand == P::Raw::FIRST && !self.negative
    }

    /// The square of a magnitude of at most 1, as a fraction.
    #[inline(never)]
    pub(super) fn square(&self) -> P::Raw {
        let fixed = if self.exponent > 0 {
            !P::ZERO
        } else {
            shift_right(self.significand, self.exponent.wrapping_neg())
        };
        fixed.multiply_high(fixed)
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

/// A quotient and what is left, digit by digit: what is left of `left`, with a bit before it if `carry`, is doubled at each of
/// `steps` steps, less the divisor if that is not negative. The quotient's bits tell where it was not. Or the square root.
#[inline(never)]
fn divide<W: Word>(left: W, right: W, steps: u16, carry: bool, root: bool) -> (W, W) {
    let (mut left, mut right, mut steps, mut carry) = (left, right, steps, carry);
    let mut quotient = W::ZERO;
    let mut bit = W::FIRST;
    loop {
        if root {
            // The divisor of a root is twice the root so far and the next bit, here halved.
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

/// `bits / 2^count`; the last bit also stands for all that are shifted out.
#[inline(never)]
pub(super) fn shift_right<W: Word>(bits: W, count: i16) -> W {
    if count >= i16::from(W::BITS) {
        return W::of(bits != W::ZERO);
    }
    let (mut bits, mut count) = (bits, count as u8);
    while count > 0 {
        bits = bits >> 1 | bits & W::ONE;
        count = count.wrapping_sub(1);
    }
    bits
}
