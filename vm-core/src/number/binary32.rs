//! binary32, the float of the full profile and of robots' functions: conversion, and the operations of processors
//! with instructions for it.

use super::arithmetic::{operation, shift_right};
use super::float::{Float, INFINITE_EXPONENT, NAN_EXPONENT};

/// Returns the result of an [`operation`] on two binary32, by the processor's instructions or the compiler's
/// library; `None` for the remainder and the root.
///
/// IEEE 754 leaves no freedom in the result but the bits of NaN, of which
/// [`Profile::float_from_f32`](super::Profile::float_from_f32) makes one. `tests/on-chip` compares the instructions
/// of an emulated Cortex-M4F with [`Float`] and with those of a computer.
#[hot]
pub fn compute(operation: u8, x: f32, y: f32) -> Option<f32> {
    match operation {
        operation::ADD => Some(x + y),
        operation::SUB => Some(x - y),
        operation::MUL => Some(x * y),
        operation::DIV => Some(x / y),
        _ => None,
    }
}

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
