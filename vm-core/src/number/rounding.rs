//! From floats to integers, and the remainder of floats.

use super::profile::Profile;
use super::wide::Wide;

/// The integer part; the nearest `i32` if that does not fit, 0 for NaN.
#[inline(never)]
pub fn truncate(x: f32) -> i32 {
    x as i32
}

/// The largest integer that is not above `x`; the nearest `i32` if that does not fit, 0 for NaN.
pub fn floor(x: f32) -> i32 {
    let whole = truncate(x);
    if whole as f32 > x { whole.saturating_sub(1) } else { whole }
}

/// The smallest integer that is not below `x`; the nearest `i32` if that does not fit, 0 for NaN.
pub fn ceil(x: f32) -> i32 {
    let whole = truncate(x);
    if (whole as f32) < x { whole.saturating_add(1) } else { whole }
}

/// The nearest integer, that farther from zero of two; the nearest `i32` if that does not fit, 0
/// for NaN.
pub fn round(x: f32) -> i32 {
    let whole = truncate(x);
    // Exact: a float with a fraction is small enough for all bits of both.
    let fraction = x - whole as f32;
    if fraction >= 0.5 {
        whole.saturating_add(1)
    } else if fraction <= -0.5 {
        whole.saturating_sub(1)
    } else {
        whole
    }
}

/// The magnitude.
pub fn abs(x: f32) -> f32 {
    x.abs()
}

/// `a mod b`, exactly, by long division of the significands. Neither is negative, `a` is finite and
/// `b` not 0.
fn remainder(a: f32, b: f32) -> f32 {
    let (dividend, divisor) = (Wide::from_f32(a), Wide::from_f32(b));
    let mut steps = dividend.exponent().wrapping_sub(divisor.exponent());
    if steps < 0 {
        return a;
    }
    // Binary32 has 24 bits, so these shifts lose nothing, and doubling the rest cannot overflow.
    let (mut rest, b) = (dividend.significand() >> 8, divisor.significand() >> 8);
    loop {
        if rest >= b {
            rest = rest.wrapping_sub(b);
        }
        if rest == 0 {
            return 0.0;
        }
        if steps == 0 {
            return Wide::from_fraction(rest << 8, divisor.exponent()).to_f32(false);
        }
        steps = steps.wrapping_sub(1);
        rest <<= 1;
    }
}

/// The Euclidean remainder of floats: the `r` in `0..|b|` for which `a - r` is a multiple of `b`.
///
/// The result is a float of the profile, and is always below `|b|`: where the nearest float would
/// be `|b|` itself (a tiny negative `a`), it is the float before. NaN if `b` is 0, `a` is infinite or
/// either is NaN. With an infinite `b` the result is `a`, or for a negative `a` the largest float.
#[inline(never)]
pub fn float_modulo<P: Profile>(a: f32, b: f32) -> f32 {
    let (dividend, bound) = (a.abs(), b.abs());
    // Written so that NaN fails both.
    let valid = dividend < f32::INFINITY && bound > 0.0;
    if !valid {
        return f32::NAN;
    }
    let rest = remainder(dividend, bound);
    let exact = if a < 0.0 && rest != 0.0 { bound - rest } else { rest };
    let raw = P::float_from_f32(exact);
    let rounded = P::float_to_f32(raw);
    if rounded >= bound {
        // Positive floats are ordered like their bits.
        P::float_to_f32(P::sub(raw, P::raw_from_u16(1)))
    } else {
        rounded
    }
}
