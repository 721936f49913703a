//! To and from what scripts reckon with: mm, degrees and radians as floats. Only the point is moved, so that no floating-point
//! multiplication is needed.

use crate::{Angle, Length, MM};

/// In mm.
pub fn mm(length: Length) -> f32 {
    scaled(length, MM.trailing_zeros())
}

/// From mm; `None` beyond 32 m, and for what is no number.
pub fn from_mm(mm: f32) -> Option<Length> {
    const EXPONENT: u32 = MM.trailing_zeros() << FRACTION;
    let bits = mm.to_bits();
    match bits & !SIGN {
        0 => Some(0),
        magnitude if magnitude < MOST_MM.to_bits() => {
            Some(f32::from_bits(bits.wrapping_add(EXPONENT)) as Length)
        }
        _ => None,
    }
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
const SIGN: u32 = 1 << 31;
const MOST_MM: f32 = 32_768.0;

/// `value / 2^bits`.
fn scaled(value: i32, bits: u32) -> f32 {
    match value {
        0 => 0.0,
        _ => f32::from_bits((value as f32).to_bits() - (bits << FRACTION)),
    }
}
