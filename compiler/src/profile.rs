//! The ranges and encodings of numbers in the two profiles.

pub use bittybuzz_robot_spec::NumberProfile;
use bittybuzz_vm_core::number::{Full, Profile as _, Tiny};

/// Returns the smallest and the largest integer of a profile.
pub fn int_range(profile: NumberProfile) -> (i32, i32) {
    match profile {
        NumberProfile::Tiny => (Tiny::INT_MIN, Tiny::INT_MAX),
        NumberProfile::Full => (Full::INT_MIN, Full::INT_MAX),
    }
}

/// Returns the size of a literal in bytes.
pub fn word_bytes(profile: NumberProfile) -> usize {
    match profile {
        NumberProfile::Tiny => Tiny::WORD_BYTES,
        NumberProfile::Full => Full::WORD_BYTES,
    }
}

/// Returns the payload of the float nearest to a literal.
pub fn float_bits(profile: NumberProfile, value: f64) -> u32 {
    match profile {
        NumberProfile::Tiny => u32::from(Tiny::float_from_f32(to_odd(value))),
        NumberProfile::Full => Full::float_from_f32(value as f32),
    }
}

/// Returns the value of a float's payload.
pub fn from_bits(profile: NumberProfile, bits: u32) -> f32 {
    match profile {
        NumberProfile::Tiny => Tiny::float_to_f32(bits as u16),
        NumberProfile::Full => Full::float_to_f32(bits),
    }
}

/// Converts to binary32 by rounding to odd: the value is truncated, and the last bit is set if bits
/// were cut off. Rounding the result once more to fewer bits gives the same value as rounding the
/// binary64 directly.
fn to_odd(value: f64) -> f32 {
    let nearest = value as f32;
    if f64::from(nearest) == value || !nearest.is_finite() || nearest == 0.0 {
        return nearest;
    }
    let away = f64::from(nearest).abs() > value.abs();
    let truncated = if away { nearest.to_bits() - 1 } else { nearest.to_bits() };
    f32::from_bits(truncated | 1)
}
