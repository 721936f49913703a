//! A number of either type.

use super::float::Float;
use super::profile::Profile;

/// An integer or a float of a script.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Number {
    /// An integer, of 16 or 32 bits according to the profile.
    Int(i32),
    /// A float of the profile, which binary32 holds exactly.
    Float(f32),
}

impl Number {
    /// Returns the exact value.
    pub fn unpack(self) -> Float {
        match self {
            Number::Int(value) => Float::from_int(value as u32),
            Number::Float(value) => Float::from_f32(value),
        }
    }

    /// Returns the value as a float of the profile. Integers of the full profile round to the
    /// nearest float, as a float literal would; all others are exact.
    pub fn unpack_float<P: Profile>(self) -> Float<P> {
        match self {
            Number::Int(value) if !P::FULL => Float::from_int(P::int_from_i32(value)),
            Number::Int(value) => P::unpack(P::float_from_f32(value as f32)),
            Number::Float(value) => P::unpack(P::float_from_f32(value)),
        }
    }
}
