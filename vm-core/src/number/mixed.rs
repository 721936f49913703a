//! A number of either type.

use core::cmp::Ordering;

use super::profile::Profile;

/// An integer or a float of a script.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Number {
    /// An integer, of 16 or 32 bits according to the profile.
    Int(i32),
    /// A float of the profile, which binary32 holds exactly.
    Float(f32),
}

/// The integer part; the nearest `i32` if that does not fit, 0 for NaN.
pub fn to_int(number: Number) -> i32 {
    match number {
        Number::Int(int) => int,
        Number::Float(float) => float as i32,
    }
}

/// The form in which a float is a table key: an integer of the profile if it has the value of one,
/// so that 1 and 1.0, 0 and -0.0 are one key.
pub fn normalize_key<P: Profile>(float: f32) -> Number {
    // Both ends are powers of two, hence floats; the upper one is no integer of the profile.
    let in_range = float >= P::INT_MIN as f32 && float < -(P::INT_MIN as f32);
    let whole = float as i32;
    if in_range && whole as f32 == float { Number::Int(whole) } else { Number::Float(float) }
}

/// Compares by exact value; `None` if one is NaN.
pub fn compare(a: Number, b: Number) -> Option<Ordering> {
    match (a, b) {
        (Number::Int(a), Number::Int(b)) => Some(a.cmp(&b)),
        (Number::Float(a), Number::Float(b)) => a.partial_cmp(&b),
        (Number::Int(a), Number::Float(b)) => compare_int(a, b),
        (Number::Float(a), Number::Int(b)) => compare_int(b, a).map(Ordering::reverse),
    }
}

/// Converting the integer would round it, so the float is taken apart instead.
fn compare_int(int: i32, float: f32) -> Option<Ordering> {
    if float.is_nan() {
        None
    } else if float >= 2_147_483_648.0 {
        Some(Ordering::Less)
    } else if float < -2_147_483_648.0 {
        Some(Ordering::Greater)
    } else {
        let whole = float as i32;
        match int.cmp(&whole) {
            // The integer part of a float is a float.
            Ordering::Equal => (whole as f32).partial_cmp(&float),
            different => Some(different),
        }
    }
}
