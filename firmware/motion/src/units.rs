//! To and from what scripts reckon with: mm, degrees and radians as floats. Only the point is moved, so that no floating-point
//! multiplication is needed.

use crate::{Angle, Length, MM};

/// In mm.
pub fn mm(length: Length) -> f32 {
    scaled(length, MM.trailing_zeros())
}

/// From mm, towards zero; `None` from 32768 mm on, and for what is no number.
pub fn from_mm(mm: f32) -> Option<Length> {
    let bits = mm.to_bits();
    let magnitude = bits & !SIGN;
    if magnitude >= MOST_MM.to_bits() {
        return None;
    }
    // The significand is an integer times 2 to the exponent: MM is 16, so that below 2^15 mm it is shifted to the right.
    let significand = (magnitude & ((1 << FRACTION) - 1)) | 1 << FRACTION;
    let right = BIAS + FRACTION - MM.trailing_zeros() - (magnitude >> FRACTION);
    let length = significand.checked_shr(right).unwrap_or(0) as Length;
    Some(if bits & SIGN == 0 { length } else { -length })
}

/// In degrees in (-180, 180].
pub fn degrees(angle: Angle) -> f32 {
    // 360 / 65536 = 45 / 2^13
    scaled(angle.signed() * 45, 13)
}

/// In radians in (-pi, pi].
pub fn radians(angle: Angle) -> f32 {
    // 2 pi / 65536 = 6433.98 / 2^26
    scaled(angle.signed() * 6434, 26)
}

const FRACTION: u32 = 23;
const BIAS: u32 = 127;
const SIGN: u32 = 1 << 31;
const MOST_MM: f32 = 32_768.0;

/// `value / 2^bits`.
fn scaled(value: i32, bits: u32) -> f32 {
    match value {
        0 => 0.0,
        _ => f32::from_bits((value as f32).to_bits() - (bits << FRACTION)),
    }
}
