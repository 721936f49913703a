//! Powers and logarithms, all by way of base 2.
//!
//! `log2 x` comes from the series of `atanh`, which converges fast for `x` near 1, and `2^-t` from a polynomial in the
//! fraction of `t`.

use super::arithmetic::shift_right;
use super::float::{Float, INFINITE_EXPONENT};
use super::profile::Profile;
use super::tables::evaluate;
use super::word::Word;
use crate::bytecode::ByteCode;

/// Integers up to that take repeated multiplication: 3^15 is the longest power of an odd number that fits binary32.
const LONGEST_PRODUCT: u16 = 15;

/// Multiplies `x` by a power of two, so that it is from 1/2 to 1 or from 1 to 2 as it was less or more than 1; the exponent
/// of the inverse of that power. `None`, and `x` is the logarithm, if it is -infinity for 0, NaN for negative numbers, infinity or NaN.
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
    // No cancellation: the logarithm of the rest has the sign of the power.
    let remaining = i16::from(x.exponent > 0);
    let power = x.exponent.wrapping_sub(remaining);
    x.exponent = remaining;
    Some(power)
}

/// Sets `x` to `2^(x * y)`. Neither is NaN.
#[hot]
pub(super) fn exp2_product<P: Profile, C: ByteCode>(x: &mut Float<P>, y: &Float<P>) {
    // All bits of the product count, since those before the point are no bits of the result.
    let (high, mut low) = x.significand.multiply(y.significand);
    let shift = x.exponent.wrapping_add(y.exponent);
    let (mut power, mut fraction) = (0, shift_right(high, shift.wrapping_neg().max(0)));
    // A product of 512 or more is beyond every float, and so are its first ten bits.
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
    // 2^-f = 1 - f * series; 1 is as good as the number before it.
    let series = evaluate::<P, C>(P::POLYNOMIALS.exponential, fraction);
    *x = Float::normalized(!fraction.multiply_high(series), power);
}

/// The simple powers: true, and `x` is `x^y`, if `y` is a small integer, or `x` or `y` is a special number. Else `x` is
/// positive and finite. With that the sign of the power.
#[hot]
pub(super) fn simple_power<P: Profile>(x: &mut Float<P>, y: &Float<P>) -> (bool, bool) {
    // A float beyond the integers of the profile is an even integer.
    let (integer, whole) = match y.as_int() {
        Some(int) if y.negative => (true, int.neg()),
        Some(int) => (true, int),
        None => (y.exponent >= i16::from(P::Raw::BITS), !P::Raw::ONE),
    };
    let negative = x.negative && whole.to_i16() & 1 != 0;
    let factor = *x;
    if whole <= P::raw_from_u16(LONGEST_PRODUCT) {
        // A product without rounding is exact, and a longer one better than the logarithm.
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
