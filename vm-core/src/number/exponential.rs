//! Powers and logarithms, all of which are computed with base 2.
//!
//! `log2 x` is computed by the series of `atanh`, which converges fast for `x` near 1, and `2^-t`
//! by a polynomial in the fraction of `t`.

use super::arithmetic::shift_right;
use super::float::{Float, INFINITE_EXPONENT};
use super::profile::Profile;
use super::tables::evaluate;
use super::word::Word;
use crate::bytecode::ByteCode;

/// The largest exponent for which a power is computed by repeated multiplication: 3^15 is the
/// longest power of an odd number that fits binary32.
const EXPONENT_MAX: u16 = 15;

/// Splits `x` for a logarithm: multiplies it by a power of two, so that an `x` below 1 is then from
/// 1/2 to 1, and any other from 1 to 2. Returns the exponent of the inverse of that power. For an
/// `x` that is zero, negative, infinite or NaN, sets `x` to its logarithm (-infinity, NaN, infinity
/// or NaN) and returns `None`.
#[hot]
pub(super) fn split<P: Profile>(x: &mut Float<P>) -> Option<i16> {
    if x.is_zero() {
        x.exponent = INFINITE_EXPONENT;
        x.significand = P::Raw::FIRST;
        x.negative = true;
    } else if x.negative {
        x.set_nan();
    }
    if x.is_endless() {
        return None;
    }
    // The logarithm of the rest has the sign of the power, so the sum of both has no cancellation.
    let remaining = i16::from(x.exponent > 0);
    let power = x.exponent.wrapping_sub(remaining);
    x.exponent = remaining;
    Some(power)
}

/// Sets `x` to `2^(x * y)`. Neither is NaN.
#[hot]
pub(super) fn exp2_product<P: Profile, C: ByteCode>(x: &mut Float<P>, y: &Float<P>) {
    // All bits of the product are needed, since those before the binary point only determine the
    // exponent of the result.
    let (high, mut low) = x.significand.multiply(y.significand);
    let shift = x.exponent.wrapping_add(y.exponent);
    let (mut power, mut fraction) = (0, shift_right(high, shift.wrapping_neg().max(0)));
    // The powers for a product of 512 or more are beyond every float, and so are those for its
    // first ten bits.
    for _ in 0..shift.min(10) {
        power = power << 1 | i16::from(fraction.has_first());
        fraction = fraction << 1;
        if low.has_first() {
            fraction = fraction | P::Raw::ONE;
        }
        low = low << 1;
    }
    if x.negative != y.negative {
        power = power.wrapping_neg();
    } else if fraction != P::ZERO {
        // 2^(n + f) = 2^(n + 1) * 2^-(1 - f)
        power = power.wrapping_add(1);
        fraction = fraction.neg();
    }
    // 2^-f = 1 - f * series. The complement takes the number before 1 in place of 1, which is as
    // good.
    let series = evaluate::<P, C>(P::POLYNOMIALS.exponential, fraction);
    *x = Float::normalized(!fraction.multiply_high(series), power);
}

/// Computes simple powers: if `y` is a small integer, or `x` or `y` is a special number, sets `x`
/// to `x^y` and returns true. Otherwise makes `x` positive, and returns false. The second result is
/// true if the power is negative.
#[hot]
pub(super) fn simple_power<P: Profile>(x: &mut Float<P>, y: &Float<P>) -> (bool, bool) {
    // A float that exceeds the integers of the profile is an even integer.
    let (integer, whole) = match y.as_int() {
        Some(int) if y.negative => (true, int.neg()),
        Some(int) => (true, int),
        None => (y.exponent >= i16::from(P::Raw::BITS), !P::Raw::ONE),
    };
    let negative = x.negative && whole.to_i16() & 1 != 0;
    let factor = *x;
    if whole <= P::raw_from_u16(EXPONENT_MAX) {
        // A product without rounding is exact, and one with rounding is still better than the
        // result by the logarithm.
        x.set_one();
        for _ in 0..P::raw_to_u16(whole) {
            x.mul(&factor);
        }
    } else if !x.is_one() {
        let special = x.is_special();
        if y.is_nan() || x.negative && !integer && !special {
            x.set_nan();
        }
        x.negative = negative;
        if !special && !x.is_nan() {
            x.negative = false;
            return (false, negative);
        }
    }
    if y.negative {
        let product = *x;
        x.set_one();
        x.div(&product);
    }
    (true, negative)
}
