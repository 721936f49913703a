//! A number of either type.

use core::cmp::Ordering;

use super::profile::Profile;
use super::rounding::truncate;

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
        Number::Float(float) => truncate(float),
    }
}

/// The form in which a float is a table key: an integer of the profile if it has the value of one,
/// so that 1 and 1.0, 0 and -0.0 are one key.
pub fn normalize_key<P: Profile>(float: f32) -> Number {
    let int = truncate(float);
    // 2^31 is the one float that is not the integer it is cut to, but equals it as a float.
    if int as f32 == float && int >= P::INT_MIN && int <= P::INT_MAX && int != i32::MAX {
        Number::Int(int)
    } else {
        Number::Float(float)
    }
}

/// Compares by exact value; `None` if one is NaN.
#[inline(never)]
pub fn compare(a: Number, b: Number) -> Option<Ordering> {
    match (a, b) {
        (Number::Int(a), Number::Int(b)) => Some(a.cmp(&b)),
        (Number::Float(a), Number::Float(b)) => Some(order_key(a)?.cmp(&order_key(b)?)),
        (Number::Int(a), Number::Float(b)) => compare_int(a, b),
        (Number::Float(a), Number::Int(b)) => compare_int(b, a).map(Ordering::reverse),
    }
}

/// An integer that orders like the float; `None` for NaN.
fn order_key(float: f32) -> Option<i32> {
    let magnitude = (float.to_bits() & 0x7FFF_FFFF) as i32;
    if magnitude > 0x7F80_0000 {
        None
    } else {
        Some(if float.is_sign_negative() { magnitude.wrapping_neg() } else { magnitude })
    }
}

/// Converting the integer would round it, so the float is taken apart instead.
#[inline(never)]
fn compare_int(int: i32, float: f32) -> Option<Ordering> {
    if float >= 2_147_483_648.0 {
        return Some(Ordering::Less);
    }
    let whole = truncate(float);
    match int.cmp(&whole) {
        // The integer part of a float is a float, so this compares its fraction; or what is below
        // the smallest integer, or NaN.
        Ordering::Equal => (whole as f32).partial_cmp(&float),
        _ if float.is_nan() => None,
        different => Some(different),
    }
}
