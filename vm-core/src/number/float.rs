//! Unpacked floats, in which all computations with floats are done.
//!
//! A significand is as wide as a payload, so it holds the integers and floats of the profile
//! exactly. In the mathematical functions it has six or eight bits more than a result, which absorb
//! their errors, so that the result is rounded once. All operations are integer arithmetic, so no
//! floating-point library or unit can change a result.
//!
//! # Special numbers
//! The exponent alone identifies zero, infinity and NaN. The exponents of these are at such a
//! distance from all others that those of products and ratios also show the result's class.

use core::cmp::Ordering;

use super::arithmetic::shift_right;
use super::profile::{Full, Profile};
use super::wide;
use super::word::Word;

/// The exponent of zero. No sum of exponents of numbers that are not zero comes near it.
pub(super) const ZERO_EXPONENT: i16 = -0x2000;
pub(super) const INFINITE_EXPONENT: i16 = 0x2000;
pub(super) const NAN_EXPONENT: i16 = 0x3000;
/// A limit above every exponent of a number that is neither zero nor infinite nor NaN.
pub(super) const FINITE_LIMIT: i16 = 0x07FF;

/// The rounding of a number to an integer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rounding {
    /// Towards zero.
    Truncate,
    /// Towards minus infinity.
    Floor,
    /// Towards infinity.
    Ceil,
    /// To the nearest integer, with ties away from zero.
    Nearest,
}

/// The number `significand / 2^bits * 2^exponent`, with a sign, where `bits` is the width of the
/// significand. The first bit of the significand is set, except for zero and NaN.
#[derive(Clone, Copy, Debug)]
// Two words are copied by two instructions; six bytes would be copied by a library function of 600
// bytes.
#[cfg_attr(not(target_arch = "avr"), repr(align(4)))]
pub struct Float<P: Profile = Full> {
    pub(super) significand: P::Raw,
    pub(super) exponent: i16,
    pub(super) negative: bool,
}

impl<P: Profile> Float<P> {
    /// The number of bits of a payload.
    pub(super) const BITS: i16 = P::Raw::BITS as i16;

    /// Makes `significand / 2^bits * 2^exponent`, where the first bit of the significand is set.
    #[hot]
    pub(super) fn new(significand: P::Raw, exponent: i16) -> Self {
        Float { significand, exponent, negative: false }
    }

    /// Makes `fraction / 2^bits * 2^exponent` for any fraction.
    #[one_copy]
    pub(super) fn normalized(fraction: P::Raw, exponent: i16) -> Self {
        let mut number = Float::new(fraction, exponent);
        if fraction == P::ZERO {
            number.exponent = ZERO_EXPONENT;
        } else {
            number.normalize();
        }
        number
    }

    /// Returns the float of two words. The last bit is also set if any bit after it is.
    #[one_copy]
    pub(super) fn from_words(high: P::Raw, low: P::Raw, exponent: i16) -> Self {
        if wide::IS_WIDE && high != P::ZERO && !high.has_first() {
            let zeros = wide::leading_zeros(high);
            let mut number = Float::new(high << zeros, exponent.wrapping_sub(zeros.into()));
            // These bits move up from the other word.
            let rest = shift_right(low, Self::BITS.wrapping_sub(zeros.into()));
            number.significand = number.significand | rest;
            return number;
        }
        let mut number = Float::normalized(high, exponent);
        number.add(&Float::normalized(low, exponent.wrapping_sub(Self::BITS)));
        number
    }

    /// Makes `fraction / 2^32 * 2^exponent` like [`Float::from_words`].
    #[one_copy]
    pub(super) fn from_fraction(fraction: u32, exponent: i16) -> Self {
        let low = P::Raw::from_u32(fraction);
        if P::FULL {
            return Float::normalized(low, exponent);
        }
        Float::from_words(P::Raw::from_u32(fraction >> 16), low, exponent)
    }

    /// Unpacks an integer of the profile.
    #[one_copy]
    pub fn from_int(value: P::Raw) -> Self {
        let negative = value.has_first();
        let mut number = Float::normalized(if negative { value.neg() } else { value }, Self::BITS);
        number.negative = negative;
        number
    }

    /// Returns true if it is NaN.
    pub fn is_nan(&self) -> bool {
        self.exponent == NAN_EXPONENT
    }

    /// Returns true if it is zero.
    pub(super) fn is_zero(&self) -> bool {
        self.exponent < -FINITE_LIMIT
    }

    /// Returns true if it is infinite or NaN.
    pub(super) fn is_endless(&self) -> bool {
        self.exponent > FINITE_LIMIT
    }

    /// Returns true if it is zero, infinite or NaN.
    pub(super) fn is_special(&self) -> bool {
        self.is_zero() || self.is_endless()
    }

    /// Sets the number to NaN.
    pub(super) fn set_nan(&mut self) {
        self.exponent = NAN_EXPONENT;
    }

    /// Sets the number to its magnitude.
    pub fn abs(&mut self) {
        self.negative = false;
    }

    /// Returns the order of two numbers; `None` if one is NaN.
    #[one_copy]
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

    /// Returns true if its magnitude is smaller.
    #[one_copy]
    pub(super) fn is_smaller(&self, other: &Self) -> bool {
        if self.exponent == other.exponent {
            self.significand < other.significand
        } else {
            self.exponent < other.exponent
        }
    }

    /// Rounds to an integer of the profile. Returns the nearest one if the result does not fit, and
    /// 0 for NaN.
    #[one_copy]
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
        // Numbers with a negative shift are integers.
        let shift = (Self::BITS - 2).wrapping_sub(self.exponent);
        let whole = if shift >= 0 {
            // This is four times the magnitude; its last bit is also set if any bit after it is.
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

    /// Returns the integer part; the nearest `i32` if that does not fit, 0 for NaN.
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
        // The loop moves one bit at a time, as an AVR does for every shift.
        let (mut whole, mut rest) = (0_i32, self.significand);
        for _ in 0..self.exponent {
            whole = whole << 1 | i32::from(rest.has_first());
            rest = rest << 1;
        }
        if self.negative { whole.wrapping_neg() } else { whole }
    }

    /// Returns the integer of the profile that equals the number, if there is one.
    #[one_copy]
    pub fn as_int(&self) -> Option<P::Raw> {
        let int = self.to_int(Rounding::Truncate);
        let equal = Self::from_int(int).compare(self) == Some(Ordering::Equal);
        if equal { Some(int) } else { None }
    }
}

/// Helpers of the functions of [`super::maths`].
impl<P: Profile> Float<P> {
    /// Sets the number to 1.
    #[one_copy]
    pub(super) fn set_one(&mut self) {
        self.significand = P::Raw::FIRST;
        self.exponent = 1;
        self.negative = false;
    }

    /// Returns true if it is 1.
    pub(super) fn is_one(&self) -> bool {
        self.exponent == 1 && self.significand == P::Raw::FIRST && !self.negative
    }

    /// Returns the square of a magnitude of at most 1, as a fraction.
    #[one_copy]
    pub(super) fn square(&self) -> P::Raw {
        let fixed = if self.exponent > 0 {
            !P::ZERO
        } else {
            shift_right(self.significand, self.exponent.wrapping_neg())
        };
        fixed.multiply_high(fixed)
    }
}
