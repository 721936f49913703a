//! The 16-bit float of the tiny profile.
//!
//! ```text
//!  15 14        9 8               0
//! +--+-----------+-----------------+
//! | s| exponent  |    fraction     |   (-1)^s * 2^(exponent - 31) * (1 + fraction / 512)
//! +--+-----------+-----------------+
//! ```
//!
//! A number with exponent 0 is zero whatever its fraction (there are no subnormals). With exponent
//! 63 it is infinity if the fraction is 0 and NaN otherwise; only [`F16::NAN`] is ever produced.
//! Magnitudes run from 2^-30 to just below 2^32. This is more range than IEEE's binary16 has, since
//! distances in millimeters and their squares occur in the same script.
//!
//! Arithmetic is done by [`Float`]. [`F16::pack`] rounds its results once, so they are correctly
//! rounded.

use super::float::{Float, INFINITE_EXPONENT, NAN_EXPONENT, ZERO_EXPONENT};
use super::profile::Tiny;

/// The number of bits by which the fraction of binary32 is longer.
const EXTRA_FRACTION: u32 = 23 - 9;
/// The difference of the exponent biases, 127 - 31.
const BIAS_DIFFERENCE: u32 = 96;

/// A 16-bit float, as its bits.
#[derive(Clone, Copy, Default, PartialEq, Eq, Debug)]
pub struct F16(pub u16);

impl F16 {
    /// The only NaN that is ever produced.
    pub const NAN: F16 = F16(0x7F00);
    /// Positive infinity.
    pub const INFINITY: F16 = F16(0x7E00);
    /// The largest finite number, 2^32 - 2^22.
    pub const MAX: F16 = F16(0x7DFF);
    /// The smallest positive number, 2^-30.
    pub const MIN_POSITIVE: F16 = F16(0x0200);

    /// Returns the nearest 16-bit float, with ties to even.
    ///
    /// A value that is below 2^-30 after rounding becomes a zero of the same sign; one that is 2^32
    /// or more becomes infinity.
    pub fn from_f32(value: f32) -> F16 {
        let bits = value.to_bits();
        let sign = (bits >> 16) as u16 & 0x8000;
        let magnitude = bits & 0x7FFF_FFFF;
        if magnitude > 0x7F80_0000 {
            return F16::NAN;
        }
        // Exponent and fraction are rounded as one integer: a carry out of the fraction is the step
        // to the next binade. Adding a little less than a half, and the last kept bit, rounds ties
        // to even.
        let last_kept = (magnitude >> EXTRA_FRACTION) & 1;
        let half = (1 << (EXTRA_FRACTION - 1)) - 1;
        let rounded = magnitude.wrapping_add(half).wrapping_add(last_kept) >> EXTRA_FRACTION;
        let rebased = rounded.wrapping_sub(BIAS_DIFFERENCE << 9) as i32;
        let bits = if rebased < i32::from(F16::MIN_POSITIVE.0) {
            0
        } else if rebased > i32::from(F16::MAX.0) {
            F16::INFINITY.0
        } else {
            rebased as u16
        };
        F16(sign | bits)
    }

    /// Returns the same number in binary32, which is always exact.
    pub fn to_f32(self) -> f32 {
        let sign = u32::from(self.0 & 0x8000) << 16;
        let magnitude = self.0 & 0x7FFF;
        let bits = if magnitude < F16::MIN_POSITIVE.0 {
            0
        } else if magnitude < F16::INFINITY.0 {
            (u32::from(magnitude) << EXTRA_FRACTION).wrapping_add(BIAS_DIFFERENCE << 23)
        } else if magnitude == F16::INFINITY.0 {
            0x7F80_0000
        } else {
            return f32::from_bits(0x7FC0_0000);
        };
        f32::from_bits(sign | bits)
    }

    /// Returns the nearest 16-bit float, with ties to even.
    #[one_copy]
    pub fn pack(number: &Float<Tiny>) -> F16 {
        if number.is_nan() {
            return F16::NAN;
        }
        // Ten bits are kept, of which the first is implied. Adding a little less than a half, and
        // the last kept bit, rounds ties to even. A carry is the step to the next binade, whose
        // fraction is 0.
        let half = if number.significand & 0x40 == 0 { 0x1F } else { 0x20 };
        let (rounded, carry) = number.significand.overflowing_add(half);
        let field = number.exponent.wrapping_add(30 + i16::from(carry));
        let bits = if field > 62 {
            F16::INFINITY.0
        } else if field < 1 {
            0
        } else {
            (field as u16) << 9 | rounded << 1 >> 7
        };
        F16(if number.negative { bits | 1 << 15 } else { bits })
    }

    /// Returns the same number unpacked.
    #[one_copy]
    pub fn unpack(self) -> Float<Tiny> {
        let field = (self.0 >> 9 & 63) as u8;
        let mut number = Float::new(self.0 << 6 | 1 << 15, i16::from(field).wrapping_sub(30));
        if field == 0 {
            number.significand = 0;
            number.exponent = ZERO_EXPONENT;
        } else if field == 63 {
            number.exponent = if self.0 << 7 == 0 { INFINITE_EXPONENT } else { NAN_EXPONENT };
        }
        number.negative = self.0 >> 15 != 0;
        number
    }
}
