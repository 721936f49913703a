//! The conversion to and from the units of scripts: mm, degrees and radians as floats. The
//! functions only change the exponent, so no floating-point multiplication is needed.

use crate::{Angle, Length, MM};

/// Converts a length to mm.
pub fn mm(length: Length) -> f32 {
    scaled(length, MM.trailing_zeros())
}

/// Converts mm to a length, rounded towards zero; `None` for 32768 mm or more, and for NaN.
pub fn from_mm(mm: f32) -> Option<Length> {
    let bits = mm.to_bits();
    let magnitude = bits & !SIGN;
    if magnitude >= MM_MAX.to_bits() {
        return None;
    }
    // The number is the significand, an integer, times a power of two. MM is 16, so below 2^15 mm
    // the significand is shifted to the right.
    let significand = (magnitude & ((1 << FRACTION) - 1)) | 1 << FRACTION;
    let right = BIAS + FRACTION - MM.trailing_zeros() - (magnitude >> FRACTION);
    let length = significand.checked_shr(right).unwrap_or(0) as Length;
    Some(if bits & SIGN == 0 { length } else { -length })
}

/// Converts an angle to degrees in (-180, 180].
pub fn degrees(angle: Angle) -> f32 {
    // 360 / 65536 = 45 / 2^13
    scaled(angle.signed() * 45, 13)
}

/// Converts an angle to radians in (-pi, pi].
pub fn radians(angle: Angle) -> f32 {
    // 2 pi / 65536 = 6433.98 / 2^26
    scaled(angle.signed() * 6434, 26)
}

const FRACTION: u32 = 23;
const BIAS: u32 = 127;
const SIGN: u32 = 1 << 31;
const MM_MAX: f32 = 32_768.0;

/// Returns `value / 2^bits`.
fn scaled(value: i32, bits: u32) -> f32 {
    match value {
        0 => 0.0,
        _ => f32::from_bits((value as f32).to_bits() - (bits << FRACTION)),
    }
}
