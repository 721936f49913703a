//! Powers and logarithms, all by way of base 2.
//!
//! `log2 x` comes from `atanh`, whose series converges fast near 1, and `2^t` from a polynomial on
//! the fraction of `t`. A natural or decimal logarithm is one more product. The polynomials are
//! minimax approximations; their errors, 2^-34 or less, vanish in 32 bits.

use super::wide::{Wide, horner_add, multiply, multiply_high};

#[cfg(feature = "maths")]
const LOG2_E: Wide = Wide { significand: 0xB8AA_3B29, exponent: 1 };
/// `ln 2`, the factor from base 2 to base e.
#[cfg(feature = "maths")]
pub const LN_2: Wide = Wide { significand: 0xB172_17F8, exponent: 0 };
#[cfg(feature = "maths")]
const LOG10_2: Wide = Wide { significand: 0x9A20_9A85, exponent: -1 };
/// The square root of 1/2, as a fraction.
const SQRT_HALF: u32 = 0xB504_F334;
/// Integer exponents up to here are tried by repeated multiplication: 3^15 is the last power of an
/// odd number that fits binary32, 3^20 the last that fits a word.
const LONGEST_PRODUCT: i32 = 20;

/// The magnitude of `log2 x`, and whether it is negative. `x` is not 1.
#[inline(never)]
pub fn log2_wide(x: Wide) -> (Wide, bool) {
    let Wide { significand, exponent } = x;
    // x = 2^power * (1 + f), where 1 + f is from sqrt(1/2) to sqrt(2).
    let (power, f_negative, f, two_plus_f) = if significand >= SQRT_HALF {
        let f = significand.wrapping_neg();
        let denominator = Wide { significand: (f >> 1).wrapping_neg(), exponent: 1 };
        (exponent, true, f, denominator)
    } else {
        let f = significand << 1;
        let denominator = Wide { significand: f >> 2 | 1 << 31, exponent: 2 };
        (exponent.wrapping_sub(1), false, f, denominator)
    };
    let whole = u32::from(power.unsigned_abs());
    if f == 0 {
        return (Wide::new(whole, 32), power < 0);
    }

    // log2 (1 + f) = 2 / ln 2 * atanh s = s * (c + z * series), where s = f / (2 + f), z = s^2.
    let s = Wide::new(f, 0).div(two_plus_f);
    let fixed = s.fraction(0);
    let z = multiply_high(fixed, fixed);
    let series = horner_add(0x6965_9F7C, z, 0x5717_EA51);
    let series = horner_add(0x93BB_B380, z, series);
    let series = horner_add(0xF638_4EA3, z, series);
    let factor = 0xB8AA_3B29_u32.wrapping_add(multiply_high(z, series) >> 2);
    let log = s.mul(Wide { significand: factor, exponent: 2 });
    if power == 0 {
        return (log, f_negative);
    }

    let part = log.fraction(0);
    let (mut whole, mut fraction) = if (power < 0) == f_negative {
        (whole, part)
    } else {
        (whole.wrapping_sub(1), part.wrapping_neg())
    };
    if whole == 0 {
        return (Wide::new(fraction, 0), power < 0);
    }
    let (mut exponent, mut last_out) = (0_i16, 0);
    while whole != 0 {
        last_out = fraction & 1;
        fraction = fraction >> 1 | whole << 31;
        whole >>= 1;
        exponent = exponent.wrapping_add(1);
    }
    (Wide { significand: fraction.saturating_add(last_out), exponent }, power < 0)
}

/// `2^(y * log)`, or `2^-(y * log)` if `log_negative`, with the sign of `negative`.
///
/// `y` may be zero or infinite.
#[inline(never)]
fn exp2_product(y: f32, log: Wide, log_negative: bool, negative: bool) -> f32 {
    let y_wide = Wide::from_f32(y);
    let (high, low) = multiply(y_wide.significand, log.significand);
    let shift = y_wide.exponent.wrapping_add(log.exponent);
    let (whole, fraction) = if shift > 9 {
        // 256 or more, beyond every float; 511 makes what follows overflow.
        (511, 0)
    } else if shift > 0 {
        let left = shift as u32;
        let right = 32_u32.wrapping_sub(left) & 31;
        (high >> right, high << left | low >> right)
    } else {
        (0, Wide { significand: high, exponent: shift }.fraction(0))
    };
    let mut power = whole as i16;
    let mut fraction = fraction;
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
    Wide { significand, exponent: power.wrapping_add(1) }.to_f32(negative)
}

/// `x^n` if the odd part of `x` to that power fits a word: then the result is rounded once.
fn integer_power(x: Wide, n: i32, negative: bool) -> Option<f32> {
    let (mut odd, mut exponent) = (x.significand, x.exponent.wrapping_sub(32));
    while odd & 1 == 0 && odd != 0 {
        odd >>= 1;
        exponent = exponent.wrapping_add(1);
    }
    let (mut product, mut scale) = (1, 32_i16);
    for _ in 0..n.unsigned_abs() {
        let (high, low) = multiply(product, odd);
        if high != 0 {
            return None;
        }
        product = low;
        scale = scale.wrapping_add(exponent);
    }
    let power = Wide::new(product, scale);
    let one = Wide { significand: 1 << 31, exponent: 1 };
    let power = if n < 0 { one.div(power) } else { power };
    Some(power.to_f32(negative))
}

/// `x^y` as the operator `^` means it: like `pow` of C.
///
/// Exact whenever `y` is an integer and the power is a float; within one unit in the last place
/// else. NaN for a negative `x` and a `y` that is not an integer; `x^0` and `1^y` are 1 even for NaN.
pub fn power(x: f32, y: f32) -> f32 {
    if y == 0.0 || x == 1.0 {
        return 1.0;
    }
    if x.is_nan() || y.is_nan() {
        return f32::NAN;
    }
    // From 2^24 on every float is an even integer.
    let whole = y as i32;
    let large = y.abs() >= 16_777_216.0;
    let integer = large || whole as f32 == y;
    let odd = integer && !large && whole & 1 != 0;
    let negative = odd && x.is_sign_negative();
    let signed = |magnitude: f32| if negative { -magnitude } else { magnitude };
    if x == 0.0 || x.is_infinite() {
        return signed(if (x == 0.0) == (y > 0.0) { 0.0 } else { f32::INFINITY });
    }
    if x < 0.0 && !integer {
        return f32::NAN;
    }
    if x == -1.0 {
        return signed(1.0);
    }
    if integer
        && (-LONGEST_PRODUCT..=LONGEST_PRODUCT).contains(&whole)
        && let Some(power) = integer_power(Wide::from_f32(x), whole, negative)
    {
        return power;
    }
    let (log, log_negative) = log2_wide(Wide::from_f32(x));
    exp2_product(y, log, log_negative, negative)
}

/// The logarithm with base 2, times `scale`.
#[cfg(feature = "maths")]
#[inline(never)]
fn scaled_log(x: f32, scale: Option<Wide>) -> f32 {
    if x.is_nan() || x < 0.0 {
        return f32::NAN;
    }
    if x == 0.0 {
        return f32::NEG_INFINITY;
    }
    if x == 1.0 {
        return 0.0;
    }
    if x.is_infinite() {
        return x;
    }
    let (log2, negative) = log2_wide(Wide::from_f32(x));
    let log = match scale {
        Some(scale) => log2.mul(scale),
        None => log2,
    };
    log.to_f32(negative)
}

/// The natural logarithm. -infinity for 0, NaN for negative numbers.
#[cfg(feature = "maths")]
pub fn log(x: f32) -> f32 {
    scaled_log(x, Some(LN_2))
}

/// The logarithm with base 2. -infinity for 0, NaN for negative numbers.
#[cfg(feature = "maths")]
pub fn log2(x: f32) -> f32 {
    scaled_log(x, None)
}

/// The logarithm with base 10. -infinity for 0, NaN for negative numbers.
#[cfg(feature = "maths")]
pub fn log10(x: f32) -> f32 {
    scaled_log(x, Some(LOG10_2))
}

/// `e^x`.
#[cfg(feature = "maths")]
pub fn exp(x: f32) -> f32 {
    if x.is_nan() { f32::NAN } else { exp2_product(x, LOG2_E, false, false) }
}
