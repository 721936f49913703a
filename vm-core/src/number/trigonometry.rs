//! Trigonometric functions and their inverses.
//!
//! An angle becomes a number of quarter turns by a product with 2/pi that is exact where it matters,
//! so results are right for every float, however large. Polynomials are minimax approximations with
//! errors of 2^-33 or less.

use super::wide::{Wide, horner_sub, multiply_high};

/// The fraction 0.785..., pi/4; with exponent 1 and 2 pi/2 and pi.
const QUARTER_PI: u32 = 0xC90F_DAA2;
const TWO_OVER_PI: Wide = Wide::new(0xA2F9_836E, 0);
/// `tan(pi / 8)`, as a fraction.
const TAN_EIGHTH: u32 = 0x6A09_E668;

/// The fraction bits of 2/pi in words.
///
/// A match, because an array would take RAM on the AVR.
fn two_over_pi(word: u8) -> u32 {
    match word {
        0 => 0xA2F9_836E,
        1 => 0x4E44_1529,
        2 => 0xFC27_57D1,
        3 => 0xF534_DDC0,
        4 => 0xDB62_9599,
        _ => 0x3C43_9041,
    }
}

/// The number of quarter turns in an angle of 1/2 or more, modulo 4; their fraction in 64 bits.
fn quarter_turns(angle: Wide) -> (u8, u64) {
    // Long multiplication by the bytes of 2/pi, first to last, keeping 96 bits: what is lost in front
    // are multiples of four quarter turns. The result has its point 24 + 8 n - exponent bits from the
    // end after n bytes. At 87 bits and more, the bytes that are left out change less than 2^-63.
    let factor = angle.significand() >> 8;
    let (mut high, mut low) = (0_u64, 0_u32);
    let mut point = 24_i16.wrapping_sub(angle.exponent());
    let mut bytes = 0;
    for index in 0..24_u8 {
        if index & 3 == 0 {
            bytes = two_over_pi(index >> 2);
        }
        high = high << 8 | u64::from(low >> 24);
        let (sum, carry) = (low << 8).overflowing_add(factor.wrapping_mul(bytes >> 24));
        low = sum;
        high = high.wrapping_add(u64::from(carry));
        bytes <<= 8;
        point = point.wrapping_add(8);
        if point >= 87 {
            break;
        }
    }
    // The point comes to 96 bits from the end, what was before it into the quarters.
    let mut quarters = 0;
    while point < 96 {
        quarters = quarters << 1 | (high >> 63) as u8;
        high = high << 1 | u64::from(low >> 31);
        low <<= 1;
        point = point.wrapping_add(1);
    }
    (quarters, high)
}

/// A function of an angle.
#[derive(Clone, Copy, PartialEq)]
enum Function {
    Sine,
    Cosine,
    Tangent,
}

/// One body for three functions that differ in a quarter turn and a division.
#[inline(never)]
fn evaluate(function: Function, x: f32) -> f32 {
    // Written so that NaN fails.
    let finite = x.abs() < f32::INFINITY;
    if !finite {
        return f32::NAN;
    }
    // The angle is `quarters` quarter turns and a distance of half a quarter turn at most, which is
    // subtracted if `back`.
    let angle = Wide::from_f32(x);
    let (mut quarters, mut back) = (0, false);
    let distance = if angle.exponent() < 0 {
        angle.mul(TWO_OVER_PI)
    } else {
        let (count, mut fraction) = quarter_turns(angle);
        quarters = count;
        back = fraction >> 63 != 0;
        if back {
            quarters = quarters.wrapping_add(1);
            fraction = !fraction;
        }
        Wide::normalize(fraction, 0)
    };
    let mut negative = x.is_sign_negative();
    if function == Function::Cosine {
        quarters = quarters.wrapping_add(1);
        negative = false;
    }

    let fixed = distance.fraction(0);
    let z = multiply_high(fixed, fixed);
    let series = horner_sub(0x0132_CA85, z, 0x000A_5E13);
    let series = horner_sub(0x1466_BBA9, z, series);
    let series = horner_sub(0xA55D_E72B, z, series);
    let factor = 0xC90F_DAA2_u32.wrapping_sub(multiply_high(z, series) >> 1);
    let sine = distance.mul(Wide::new(factor, 1));

    let series = horner_sub(0x0557_177F, z, 0x003B_3AB0);
    let series = horner_sub(0x40F0_7766, z, series);
    let series = 0x9DE9_E63E_u32.wrapping_sub(multiply_high(z, series) >> 1);
    let cosine = Wide::from_fraction((1_u32 << 31).wrapping_sub(multiply_high(z, series)), 1);

    let odd = quarters & 1 != 0;
    let result = if function == Function::Tangent {
        negative ^= back ^ odd;
        if odd { cosine.div(sine) } else { sine.div(cosine) }
    } else {
        negative ^= quarters & 2 != 0;
        if odd {
            cosine
        } else {
            negative ^= back;
            sine
        }
    };
    result.to_f32(negative)
}

/// The sine of an angle in radians; NaN for infinity.
pub fn sin(x: f32) -> f32 {
    evaluate(Function::Sine, x)
}

/// The cosine of an angle in radians; NaN for infinity.
pub fn cos(x: f32) -> f32 {
    evaluate(Function::Cosine, x)
}

/// The tangent of an angle in radians; NaN for infinity.
pub fn tan(x: f32) -> f32 {
    evaluate(Function::Tangent, x)
}

/// The angle of the point with these coordinates, from 0 to pi. Not both are zero.
#[inline(never)]
extern "C" fn angle(y: Wide, x: Wide, x_negative: bool) -> Wide {
    let mut ratio = y.div(x);
    let steep = ratio.exponent() > 0;
    let (small, large) = if steep { (x, y) } else { (y, x) };
    if steep {
        ratio = small.div(large);
    }
    let beyond_eighth = ratio.exponent() > 0 || ratio.fraction(0) > TAN_EIGHTH;
    if beyond_eighth {
        // atan t = pi/4 - atan((1 - t) / (1 + t))
        let aligned = small.fraction(large.exponent());
        let mean = (large.significand() >> 1).wrapping_add(aligned >> 1);
        // Equal coordinates give a difference that vanishes beside pi/4.
        let difference = u64::from(large.significand().wrapping_sub(aligned)) << 32 | 1;
        ratio = Wide::normalize(difference, -1).div(Wide::from_fraction(mean, 0));
    }

    let fixed = ratio.fraction(0);
    let z = multiply_high(fixed, fixed);
    let series = horner_sub(0x15B3_0289, z, 0x0C25_1089);
    let series = horner_sub(0x1C46_3FD9, z, series);
    let series = horner_sub(0x248F_DB4C, z, series);
    let series = horner_sub(0x3333_2314, z, series);
    let series = horner_sub(0x5555_5532, z, series);
    let factor = (1_u32 << 31).wrapping_sub(multiply_high(z, series) >> 1);
    let arc = ratio.mul(Wide::new(factor, 1));
    if !(beyond_eighth || steep || x_negative) {
        return arc;
    }

    // With an exponent of 2 every angle up to pi fits; none of these is small.
    let mut angle = arc.fraction(2);
    if beyond_eighth {
        angle = (QUARTER_PI >> 2).wrapping_sub(angle);
    }
    if steep {
        angle = (QUARTER_PI >> 1).wrapping_sub(angle);
    }
    if x_negative {
        angle = QUARTER_PI.wrapping_sub(angle);
    }
    Wide::from_fraction(angle, 2)
}

/// The angle of the point `(x, y)`, from -pi to pi, like `atan2` of C.
pub fn atan2(y: f32, x: f32) -> f32 {
    if x.is_nan() || y.is_nan() {
        return f32::NAN;
    }
    // Beside zero or infinity only a direction counts.
    let (mut ahead, mut aside) = (x, y);
    if y.is_infinite() {
        aside = 1.0;
        ahead = if x.is_infinite() { 1.0_f32.copysign(x) } else { 0.0 };
    } else if y == 0.0 || x.is_infinite() {
        aside = 0.0;
        ahead = 1.0_f32.copysign(x);
    }
    let angle = angle(Wide::from_f32(aside), Wide::from_f32(ahead), ahead < 0.0);
    angle.to_f32(y.is_sign_negative())
}

/// The angle of a right-angled triangle with hypotenuse 1, in which `x` is the adjacent leg if
/// `adjacent`, else the opposite leg.
#[inline(never)]
fn triangle(x: f32, adjacent: bool) -> f32 {
    // Written so that NaN fails.
    let valid = x.abs() <= 1.0;
    if !valid {
        return f32::NAN;
    }
    let leg = Wide::from_f32(x);
    // The other leg is sqrt((1 + x) (1 - x)).
    let (mut sum, mut difference) = (Wide::ONE, Wide::ONE);
    let fixed = leg.fraction(0);
    if leg.exponent() > 0 {
        difference = Wide::from_f32(0.0);
    } else if fixed != 0 {
        sum = Wide::new(fixed >> 1 | 1 << 31, 1);
        difference = Wide::from_fraction(fixed.wrapping_neg(), 0);
    }
    let other = sum.mul(difference).sqrt();
    let negative = x.is_sign_negative();
    if adjacent {
        angle(other, leg, negative).to_f32(false)
    } else {
        angle(leg, other, false).to_f32(negative)
    }
}

/// The angle in `-pi/2..=pi/2` whose sine is `x`; NaN beyond -1 and 1.
pub fn asin(x: f32) -> f32 {
    triangle(x, false)
}

/// The angle in `0..=pi` whose cosine is `x`; NaN beyond -1 and 1.
pub fn acos(x: f32) -> f32 {
    triangle(x, true)
}
