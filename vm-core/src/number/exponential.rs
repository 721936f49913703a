//! Powers and logarithms, all by way of base 2.
//!
//! `log2 x` comes from the series of `atanh`, which converges fast for `x` near 1, and `2^-t` from a polynomial in the
//! fraction of `t`.

use super::float::{Float, multiply, multiply_high, shift_right};
use super::tables::{EXPONENTIAL, evaluate};
use crate::bytecode::ByteCode;

/// Integers of so many bits take repeated multiplication: 3^15 is the longest power of an odd number that fits binary32.
const LONGEST_PRODUCT: i16 = 4;

/// Multiplies `x` by a power of two, so that it is from 1/2 to 1 or from 1 to 2 as it was less or more than 1; the exponent
/// of the inverse of that power. `None`, and `x` is the logarithm, if it is -infinity for 0, NaN for negative numbers, infinity or NaN.
#[inline(always)]
pub(super) fn split(x: &mut Float) -> Option<i16> {
    if x.is_zero() {
        x.invert_special();
        x.negative = true;
    } else if x.negative {
        x.set_nan();
    }
    if x.is_endless() {
        return None;
    }
    // No cancellation: the logarithm of what remains has the sign of the power.
    let remaining = i16::from(x.exponent > 0);
    let power = x.exponent.wrapping_sub(remaining);
    x.exponent = remaining;
    Some(power)
}

/// Sets `x` to `2^(x * y)`. Neither is NaN.
#[inline(always)]
pub(super) fn exp2_product<C: ByteCode>(x: &mut Float, y: &Float) {
    // All bits of the product count, since those before the point are no bits of the result.
    let product = multiply(x.significand, y.significand);
    let (high, low) = ((product >> 32) as u32, product as u32);
    let shift = x.exponent.wrapping_add(y.exponent);
    let (mut power, mut fraction) = (0, 0);
    if shift <= 0 {
        fraction = shift_right(high, shift.wrapping_neg());
    } else if shift < 10 {
        let back = 32_u8.wrapping_sub(shift as u8);
        power = high.wrapping_shr(u32::from(back)) as i16;
        fraction = high << (shift as u8) | low.wrapping_shr(u32::from(back));
    } else {
        // The product is 512 or more, beyond every float, and so is 2^511.
        power = 511;
    }
    if x.negative != y.negative {
        power = power.wrapping_neg();
    } else if fraction != 0 {
        // 2^(n + f) = 2^(n + 1) * 2^-(1 - f)
        power = power.wrapping_add(1);
        fraction = fraction.wrapping_neg();
    }
    // 2^-f = 1 - f * series; 1 is as good as the number before it.
    let series = evaluate::<C>(EXPONENTIAL, fraction);
    *x = Float::normalized(!multiply_high(fraction, series), power);
}

/// The simple powers: true, and `x` is `x^y` but for its sign, if `y` is a small integer, or `x` or `y` is a special
/// number. Else `x` is positive and finite. With that the sign of the power.
#[inline(always)]
pub(super) fn simple_power(x: &mut Float, y: &Float) -> (bool, bool) {
    // From 2^30 on every float is an even integer.
    let quarters = y.quarters();
    let (whole, integer) = ((quarters >> 2) as u8, quarters as u8 & 3 == 0);
    let negative = x.negative && integer && whole & 1 != 0;
    if y.is_zero() || x.is_one() {
        x.set_one();
        return (true, false);
    }
    let special = x.is_special();
    if y.is_nan() || x.is_nan() || !integer && x.negative && !special {
        x.set_nan();
        return (true, false);
    }
    x.negative = false;
    if special {
        if y.negative {
            x.invert_special();
        }
        return (true, negative);
    }
    let simple = integer && y.exponent <= LONGEST_PRODUCT;
    if simple {
        // A product of up to 32 bits is exact, and a longer one better than the logarithm.
        let mut product = *x;
        for _ in 1..whole {
            product.mul(x);
        }
        if y.negative {
            x.set_one();
            x.div(&product);
        } else {
            *x = product;
        }
    }
    (simple, negative)
}
