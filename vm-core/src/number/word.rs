//! The words in which numbers are computed: as wide as a profile's payloads, 16 or 32 bits.

use core::fmt::Debug;
use core::ops::{BitAnd, BitOr, BitXor, Not, Shl, Shr};

use super::wide;

/// The trait of `u16` and `u32`. Its functions never panic: additions wrap, and no number is
/// shifted by its width.
pub trait Word:
    Copy
    + Ord
    + Debug
    + BitAnd<Output = Self>
    + BitOr<Output = Self>
    + BitXor<Output = Self>
    + Not<Output = Self>
    + Shl<u8, Output = Self>
    + Shr<u8, Output = Self>
    + 'static
{
    /// The number of bits.
    const BITS: u8;
    /// 0
    const ZERO: Self;
    /// 1
    const ONE: Self;
    /// The word in which only the first bit is set.
    const FIRST: Self;

    /// Returns 1 for true, 0 for false.
    fn of(bit: bool) -> Self;
    /// Returns the last bits of a number.
    fn from_u32(bits: u32) -> Self;
    /// Returns the same number as 32 bits.
    fn to_u32(self) -> u32;
    /// Returns the last 16 bits.
    fn to_i16(self) -> i16;

    /// Returns `self + other`, wrapping.
    fn add(self, other: Self) -> Self;
    /// Returns `self - other`, wrapping.
    fn sub(self, other: Self) -> Self;
    /// Returns `self + other`, wrapping, and true if the sum wrapped.
    fn add_carry(self, other: Self) -> (Self, bool);
    /// Returns the product, its high word first.
    fn multiply(self, other: Self) -> (Self, Self);
    /// Returns the product of two fractions, as a fraction.
    fn multiply_high(self, other: Self) -> Self;
    /// Returns the integer part of `self * fraction / 2^32`.
    fn scale(self, fraction: u32) -> Self;
    /// Returns the significand of a product from its two words. The first bit of `high` is set.
    fn round(high: Self, low: Self) -> Self;

    /// Returns true if the first bit is set.
    #[hot]
    fn has_first(self) -> bool {
        self & Self::FIRST != Self::ZERO
    }

    /// Returns `-self`, wrapping.
    #[hot]
    fn neg(self) -> Self {
        Self::ZERO.sub(self)
    }
}

macro_rules! common {
    ($word:ty) => {
        const BITS: u8 = <$word>::BITS as u8;
        const ZERO: $word = 0;
        const ONE: $word = 1;
        const FIRST: $word = 1 << (<$word>::BITS - 1);

        #[hot]
        fn of(bit: bool) -> $word {
            <$word>::from(bit)
        }

        #[hot]
        fn from_u32(bits: u32) -> $word {
            bits as $word
        }

        #[hot]
        fn to_u32(self) -> u32 {
            self as u32
        }

        #[hot]
        fn to_i16(self) -> i16 {
            self as i16
        }

        #[hot]
        fn add(self, other: $word) -> $word {
            self.wrapping_add(other)
        }

        #[hot]
        fn sub(self, other: $word) -> $word {
            self.wrapping_sub(other)
        }

        #[hot]
        fn add_carry(self, other: $word) -> ($word, bool) {
            self.overflowing_add(other)
        }
    };
}

impl Word for u16 {
    common!(u16);

    #[hot]
    fn multiply(self, other: u16) -> (u16, u16) {
        let product = multiply_halves(self, other);
        ((product >> 16) as u16, product as u16)
    }

    /// Rounds to the nearest, since 16 bits leave little room for errors.
    #[hot]
    fn multiply_high(self, other: u16) -> u16 {
        let (high, low) = self.multiply(other);
        high.wrapping_add(low >> 15)
    }

    #[hot]
    fn scale(self, fraction: u32) -> u16 {
        let (high, middle) = self.multiply((fraction >> 16) as u16);
        let (_, carry) = middle.overflowing_add(self.multiply(fraction as u16).0);
        high.wrapping_add(u16::from(carry))
    }

    /// Sets the last bit if any bit after it is set, so that rounding to fewer bits is right.
    #[hot]
    fn round(high: u16, low: u16) -> u16 {
        high | u16::from(low != 0)
    }
}

impl Word for u32 {
    common!(u32);

    #[hot]
    fn multiply(self, other: u32) -> (u32, u32) {
        let product = if wide::IS_WIDE {
            u64::from(self).wrapping_mul(u64::from(other))
        } else {
            multiply(self, other)
        };
        ((product >> 32) as u32, product as u32)
    }

    #[hot]
    fn multiply_high(self, other: u32) -> u32 {
        self.multiply(other).0
    }

    #[hot]
    fn scale(self, fraction: u32) -> u32 {
        self.multiply(fraction).0
    }

    /// Rounds to the nearest.
    #[hot]
    fn round(high: u32, low: u32) -> u32 {
        high.saturating_add(low >> 31)
    }
}

/// Returns the product of two half words.
// On the AVR, one copy holds the call of the 32-bit multiplication.
#[cfg_attr(target_arch = "avr", one_copy)]
pub(super) fn multiply_halves(a: u16, b: u16) -> u32 {
    u32::from(a).wrapping_mul(u32::from(b))
}

/// Returns the product of two words.
///
/// This is schoolbook multiplication in halves. Multiplying 64-bit numbers would call a slow and
/// large library routine on processors that multiply at most 32 bits.
#[one_copy]
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
