//! Unpacked floats: the working form of everything that is computed with floats.
//!
//! A significand as wide as a payload holds the integers and floats of the profile exactly, and the mathematical functions
//! have six or eight bits more than a result for their errors, so that it is rounded once. Everything is integer
//! arithmetic, which no floating-point library or unit can do differently.
//!
//! # Special numbers
//! Zero, infinity and NaN are told by their exponents alone, which are so far apart that the exponents of products and
//! ratios tell what those are.

use core::cmp::Ordering;

use super::arithmetic::shift_right;
use super::profile::{Full, Profile};
use super::wide;
use super::word::Word;

/// The exponent of zero: no sum of exponents of numbers that are not zero comes near.
pub(super) const ZERO_EXPONENT: i16 = -0x2000;
pub(super) const INFINITE_EXPONENT: i16 = 0x2000;
pub(super) const NAN_EXPONENT: i16 = 0x3000;
/// Beyond every exponent of a number that is neither zero nor infinite nor NaN.
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

impl<P: Profile> Float<P> {
    /// The bits of a payload, as a place of the point.
    pub(super) const BITS: i16 = P::Raw::BITS as i16;

    /// `significand / 2^bits * 2^exponent`, where the first bit of the significand is set.
    #[hot]
    pub(super) fn new(significand: P::Raw, exponent: i16) -> Self {
        Float { significand, exponent, negative: false }
    }

    /// `fraction / 2^bits * 2^exponent`.
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

    /// Returns the float of two words. The last bit also stands for all bits after it.
    #[one_copy]
    pub(super) fn from_words(high: P::Raw, low: P::Raw, exponent: i16) -> Self {
        if wide::IS_WIDE && high != P::ZERO && !high.has_first() {
            let zeros = wide::leading_zeros(high);
            let mut number = Float::new(high << zeros, exponent.wrapping_sub(zeros.into()));
            // The bits that move up from the other word.
            let rest = shift_right(low, Self::BITS.wrapping_sub(zeros.into()));
            number.significand = number.significand | rest;
            return number;
        }
        let mut number = Float::normalized(high, exponent);
        number.add(&Float::normalized(low, exponent.wrapping_sub(Self::BITS)));
        number
    }

    /// `fraction / 2^32 * 2^exponent`, likewise.
    #[one_copy]
    pub(super) fn from_fraction(fraction: u32, exponent: i16) -> Self {
        let low = P::Raw::from_u32(fraction);
        if P::FULL {
            return Float::normalized(low, exponent);
        }
        Float::from_words(P::Raw::from_u32(fraction >> 16), low, exponent)
    }

    /// An integer of the profile.
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

    /// Makes it NaN.
    pub(super) fn set_nan(&mut self) {
        self.exponent = NAN_EXPONENT;
    }

    /// Makes it its magnitude.
    pub fn abs(&mut self) {
        self.negative = false;
    }

    /// The order of two numbers; `None` if one is NaN.
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

    /// An integer of the profile; the nearest if that does not fit, 0 for NaN.
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
        // Digit by digit: an AVR shifts bit by bit anyway.
        let (mut whole, mut rest) = (0_i32, self.significand);
        for _ in 0..self.exponent {
            whole = whole << 1 | i32::from(rest.has_first());
            rest = rest << 1;
        }
        if self.negative { whole.wrapping_neg() } else { whole }
    }

    /// The integer of the profile that it is, if it is one.
    #[one_copy]
    pub fn as_int(&self) -> Option<P::Raw> {
        let int = self.to_int(Rounding::Truncate);
        let equal = Self::from_int(int).compare(self) == Some(Ordering::Equal);
        if equal { Some(int) } else { None }
    }
}

/// For the functions of [`super::maths`].
impl<P: Profile> Float<P> {
    /// Sets it to 1.
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

    /// The square of a magnitude of at most 1, as a fraction.
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
