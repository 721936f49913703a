//! Powers and logarithms, all by way of base 2.
//!
//! `log2 x` comes from the series of `atanh`, which converges fast for `x` near 1, and `2^t` from a
//! polynomial in the fraction of `t`. A natural or decimal logarithm is one more product. The polynomials are
//! minimax approximations; their errors, 2^-34 or less, vanish in 32 bits.

use super::rounding::truncate;
use super::wide::{Wide, horner_add, multiply, multiply_high};

const LOG2_E: Wide = Wide::new(0xB8AA_3B29, 1);
/// `ln 2`, the factor from base 2 to base e.
pub const LN_2: Wide = Wide::new(0xB172_17F8, 0);
const LOG10_2: Wide = Wide::new(0x9A20_9A85, -1);
/// The square root of 1/2, as a fraction.
const SQRT_HALF: u32 = 0xB504_F334;
/// Integer exponents up to here take repeated multiplication: 3^15 is the longest power of an odd
/// number that fits binary32.
const LONGEST_PRODUCT: u32 = 15;

/// The magnitude of `log2 x`. It is negative if `x` is less than 1: if its exponent is 0 or less.
#[inline(never)]
pub extern "C" fn log2_wide(x: Wide) -> Wide {
    // x = 2^power * (1 + f), where 1 + f is from sqrt(1/2) to sqrt(2).
    let f_negative = x.significand() >= SQRT_HALF;
    let (power, f, two_plus_f) = if f_negative {
        let f = x.significand().wrapping_neg();
        (x.exponent(), f, Wide::new((f >> 1).wrapping_neg(), 1))
    } else {
        let f = x.significand() << 1;
        (x.exponent().wrapping_sub(1), f, Wide::new(f >> 2 | 1 << 31, 2))
    };
    // With 16 bits before and 32 bits after the point.
    let whole = u64::from(power.unsigned_abs()) << 32;
    if f == 0 {
        return Wide::normalize(whole, 32);
    }

    // log2 (1 + f) = 2 / ln 2 * atanh s = s * (c + z * series), where s = f / (2 + f), z = s^2.
    let s = Wide::from_fraction(f, 0).div(two_plus_f);
    let fixed = s.fraction(0);
    let z = multiply_high(fixed, fixed);
    let series = horner_add(0x6965_9F7C, z, 0x5717_EA51);
    let series = horner_add(0x93BB_B380, z, series);
    let series = horner_add(0xF638_4EA3, z, series);
    // In units of 2^-30, rounded; c is 0.36 units more than its constant.
    let factor = 0xB8AA_3B29_u32.wrapping_add(multiply_high(z, series).wrapping_add(3) >> 2);
    let log = s.mul(Wide::new(factor, 2));
    if power == 0 {
        return log;
    }
    let part = u64::from(log.fraction(0));
    let sum =
        if (power < 0) == f_negative { whole.wrapping_add(part) } else { whole.wrapping_sub(part) };
    Wide::normalize(sum, 32)
}

/// `2^(y * log)`, or `2^-(y * log)` if `log_negative`, with the sign of `negative`.
///
/// `y` may be zero or infinite.
#[inline(never)]
fn exp2_product(y: f32, log: Wide, log_negative: bool, negative: bool) -> f32 {
    let y_wide = Wide::from_f32(y);
    let mut product = multiply(y_wide.significand(), log.significand());
    let mut shift = y_wide.exponent().wrapping_add(log.exponent());
    let mut power = 0_i16;
    // From a shift of 10 on the product is 256 or more, beyond every float, and so is 2^511.
    if shift > 9 {
        (power, product, shift) = (511, 0, 0);
    }
    while shift > 0 {
        power = power << 1 | (product >> 63) as i16;
        product <<= 1;
        shift = shift.wrapping_sub(1);
    }
    let mut fraction = Wide::new((product >> 32) as u32, shift).fraction(0);
    if log_negative != y.is_sign_negative() {
        power = power.wrapping_neg();
        if fraction != 0 {
            // 2^-(n + f) = 2^(-n - 1) * 2^(1 - f)
            power = power.wrapping_sub(1);
            fraction = fraction.wrapping_neg();
        }
    }
    // 2^f = 1 + f * series. The series approaches 1 and must not reach it.
    let series = horner_add(0x0009_6C18, fraction, 0x0001_678C);
    let series = horner_add(0x0057_F15F, fraction, series);
    let series = horner_add(0x0276_14E8, fraction, series);
    let series = horner_add(0x0E35_93C3, fraction, series);
    let series = horner_add(0x3D7F_7A4A, fraction, series);
    let series = 0xB172_1808_u32.saturating_add(multiply_high(fraction, series));
    let significand = multiply_high(fraction, series) >> 1 | 1 << 31;
    Wide::new(significand, power.wrapping_add(1)).to_f32(negative)
}

/// `x^y` as the operator `^` means it: like `pow` of C.
///
/// Exact whenever `y` is an integer and the power is a float; else within 1.5 units in the last place.
/// NaN for a negative `x` and a `y` that is not an integer; `x^0` and `1^y` are 1 even for NaN.
#[inline(never)]
pub fn power(x: f32, y: f32) -> f32 {
    if y == 0.0 || x == 1.0 {
        return 1.0;
    }
    if x.is_nan() || y.is_nan() {
        return f32::NAN;
    }
    // From 2^24 on every float is an even integer.
    let small = y.abs() < 16_777_216.0;
    let whole = if small { truncate(y) } else { 0 };
    let integer = !small || whole as f32 == y;
    let negative = x.is_sign_negative() && integer && whole & 1 != 0;
    if x == 0.0 || x.is_infinite() {
        let zero = (x == 0.0) != y.is_sign_negative();
        return Wide::new(1 << 31, if zero { -200 } else { 200 }).to_f32(negative);
    }
    if x < 0.0 && !integer {
        return f32::NAN;
    }
    let base = Wide::from_f32(x);
    let factors = whole.unsigned_abs();
    if small && integer && factors <= LONGEST_PRODUCT {
        // A product of up to 32 bits is exact, and a longer one better than the logarithm.
        let mut power = Wide::ONE;
        for _ in 0..factors as u8 {
            power = power.mul(base);
        }
        if whole < 0 {
            power = Wide::ONE.div(power);
        }
        return power.to_f32(negative);
    }
    exp2_product(y, log2_wide(base), base.exponent() <= 0, negative)
}

/// The logarithm with base 2, times `scale`.
#[inline(never)]
fn scaled_log(x: f32, scale: Wide) -> f32 {
    if x == 0.0 {
        return f32::NEG_INFINITY;
    }
    // Written so that NaN fails.
    let valid = x > 0.0;
    if !valid {
        return f32::NAN;
    }
    if x.is_infinite() {
        return x;
    }
    let x = Wide::from_f32(x);
    log2_wide(x).mul(scale).to_f32(x.exponent() <= 0)
}

/// The natural logarithm. -infinity for 0, NaN for negative numbers.
pub fn log(x: f32) -> f32 {
    scaled_log(x, LN_2)
}

/// The logarithm with base 2. -infinity for 0, NaN for negative numbers.
pub fn log2(x: f32) -> f32 {
    scaled_log(x, Wide::ONE)
}

/// The logarithm with base 10. -infinity for 0, NaN for negative numbers.
pub fn log10(x: f32) -> f32 {
    scaled_log(x, LOG10_2)
}

/// `e^x`.
pub fn exp(x: f32) -> f32 {
    if x.is_nan() { f32::NAN } else { exp2_product(x, LOG2_E, false, false) }
}
