//! Conversion to and from binary32, the float of the full profile and of robots' functions.

use super::arithmetic::shift_right;
use super::float::{Float, INFINITE_EXPONENT, NAN_EXPONENT};

impl Float {
    /// Unpacks a binary32.
    #[one_copy]
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

    /// Returns the nearest binary32, with ties to even. Every NaN becomes the same one.
    #[one_copy]
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
