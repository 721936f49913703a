//! Trigonometric functions and their inverses.
//!
//! An angle becomes a number of quarter turns by a product with 2/pi that is exact where it matters,
//! so results are right for every float, however large. Polynomials are minimax approximations with
//! errors of 2^-33 or less.

use super::wide::{Wide, horner_sub, multiply, multiply_high};

/// The fraction 0.785..., pi/4; with exponent 1 and 2 pi/2 and pi.
const QUARTER_PI: u32 = 0xC90F_DAA2;
const TWO_OVER_PI: Wide = Wide { significand: 0xA2F9_836E, exponent: 0 };
/// `tan(pi / 8)`, as a fraction.
const TAN_EIGHTH: u32 = 0x6A09_E668;

/// The fraction bits of 2/pi in words, from the first; 0 before them.
///
/// A match, because an array would take RAM on the AVR.
fn two_over_pi(word: u8) -> u32 {
    match word {
        1 => 0xA2F9_836E,
        2 => 0x4E44_1529,
        3 => 0xFC27_57D1,
        4 => 0xF534_DDC0,
        5 => 0xDB62_9599,
        6 => 0x3C43_9041,
        7 => 0xFE51_63AB,
        _ => 0,
    }
}

/// An angle as `quarters + distance` quarter turns, where `|distance|` is at most 1/2.
struct QuarterTurns {
    /// Modulo 4.
    quarters: u8,
    distance: Wide,
    negative: bool,
}

/// Takes the magnitude of an angle that is finite and not 0.
#[inline(never)]
fn quarter_turns(angle: f32) -> QuarterTurns {
    let x = Wide::from_f32(angle);
    if x.exponent < 0 {
        return QuarterTurns { quarters: 0, distance: x.mul(TWO_OVER_PI), negative: false };
    }
    // Of 2/pi only a window of 96 bits counts: what stands before it gives multiples of four
    // quarter turns, what stands after it less than 2^-70. It starts at bit `exponent - 26`; with
    // a word of zeros in front that is never negative.
    let start = x.exponent.wrapping_add(32 - 26) as u8;
    let (word, bit) = (start >> 5, u32::from(start & 31));
    let window = |index: u8| {
        let word = word.wrapping_add(index);
        let next = two_over_pi(word.wrapping_add(1));
        two_over_pi(word) << bit | next >> 1 >> (31 - bit)
    };
    let (top, upper) = multiply(x.significand, window(0));
    let (middle, lower) = multiply(x.significand, window(1));
    let (last, _) = multiply(x.significand, window(2));
    let (lower, carry) = lower.overflowing_add(last);
    let (upper, carry) = {
        let (sum, first) = upper.overflowing_add(middle);
        let (sum, second) = sum.overflowing_add(u32::from(carry));
        (sum, first | second)
    };
    let top = top.wrapping_add(u32::from(carry));

    // The point is below bit 6 of the top word.
    let mut quarters = (top >> 6) as u8;
    let mut high = top << 26 | upper >> 6;
    let mut low = upper << 26 | lower >> 6;
    let negative = high >> 31 != 0;
    if negative {
        // Nearer to the next quarter turn.
        quarters = quarters.wrapping_add(1);
        high = !high;
        low = !low;
    }
    let mut exponent = 0_i16;
    while high >> 31 == 0 && exponent > -63 {
        high = high << 1 | low >> 31;
        low <<= 1;
        exponent = exponent.wrapping_sub(1);
    }
    QuarterTurns {
        quarters: quarters & 3,
        distance: Wide { significand: high, exponent },
        negative,
    }
}

/// The sine of up to half a quarter turn.
#[inline(never)]
fn sine(distance: Wide) -> Wide {
    let fixed = distance.fraction(0);
    let z = multiply_high(fixed, fixed);
    let series = horner_sub(0x0132_CA85, z, 0x000A_5E13);
    let series = horner_sub(0x1466_BBA9, z, series);
    let series = horner_sub(0xA55D_E72B, z, series);
    let factor = 0xC90F_DAA2_u32.wrapping_sub(multiply_high(z, series) >> 1);
    distance.mul(Wide { significand: factor, exponent: 1 })
}

/// The cosine of up to half a quarter turn.
#[inline(never)]
fn cosine(distance: Wide) -> Wide {
    let fixed = distance.fraction(0);
    let z = multiply_high(fixed, fixed);
    let series = horner_sub(0x0557_177F, z, 0x003B_3AB0);
    let series = horner_sub(0x40F0_7766, z, series);
    let series = 0x9DE9_E63E_u32.wrapping_sub(multiply_high(z, series) >> 1);
    Wide::new((1_u32 << 31).wrapping_sub(multiply_high(z, series)), 1)
}

/// The sine of an angle in radians; NaN for infinity.
pub fn sin(x: f32) -> f32 {
    if x.is_nan() || x.is_infinite() {
        return f32::NAN;
    }
    if x == 0.0 {
        return x;
    }
    quarter_sine(quarter_turns(x), x.is_sign_negative())
}

/// The cosine of an angle in radians; NaN for infinity.
pub fn cos(x: f32) -> f32 {
    if x.is_nan() || x.is_infinite() {
        return f32::NAN;
    }
    if x == 0.0 {
        return 1.0;
    }
    let mut turns = quarter_turns(x);
    turns.quarters = turns.quarters.wrapping_add(1);
    quarter_sine(turns, false)
}

/// The sine of an angle in quarter turns.
fn quarter_sine(turns: QuarterTurns, negative: bool) -> f32 {
    let lower_half = turns.quarters & 2 != 0;
    if turns.quarters & 1 == 0 {
        sine(turns.distance).to_f32(negative ^ lower_half ^ turns.negative)
    } else {
        cosine(turns.distance).to_f32(negative ^ lower_half)
    }
}

/// The tangent of an angle in radians; NaN for infinity.
pub fn tan(x: f32) -> f32 {
    if x.is_nan() || x.is_infinite() {
        return f32::NAN;
    }
    if x == 0.0 {
        return x;
    }
    let turns = quarter_turns(x);
    let (sine, cosine) = (sine(turns.distance), cosine(turns.distance));
    let negative = x.is_sign_negative() ^ turns.negative;
    if turns.quarters & 1 == 0 {
        sine.div(cosine).to_f32(negative)
    } else {
        cosine.div(sine).to_f32(!negative)
    }
}

/// The angle of the point with these coordinates, from 0 to pi.
#[inline(never)]
fn angle(y: Wide, x: Wide, x_negative: bool) -> Wide {
    let steep = (y.exponent, y.significand) > (x.exponent, x.significand);
    let (small, large) = if steep { (x, y) } else { (y, x) };
    let ratio = small.div(large);
    let beyond_eighth = ratio.exponent > 0 || ratio.fraction(0) > TAN_EIGHTH;
    let tangent = if beyond_eighth {
        // atan t = pi/4 - atan((1 - t) / (1 + t))
        let aligned = small.fraction(large.exponent);
        let difference = large.significand.wrapping_sub(aligned);
        if difference == 0 {
            // An angle that vanishes beside pi/4.
            Wide { significand: 1 << 31, exponent: -40 }
        } else {
            let mean = (large.significand >> 1).wrapping_add(aligned >> 1);
            Wide::new(difference, -1).div(Wide::new(mean, 0))
        }
    } else {
        ratio
    };

    let fixed = tangent.fraction(0);
    let z = multiply_high(fixed, fixed);
    let series = horner_sub(0x15B3_0289, z, 0x0C25_1089);
    let series = horner_sub(0x1C46_3FD9, z, series);
    let series = horner_sub(0x248F_DB4C, z, series);
    let series = horner_sub(0x3333_2314, z, series);
    let series = horner_sub(0x5555_5532, z, series);
    let factor = (1_u32 << 31).wrapping_sub(multiply_high(z, series) >> 1);
    let arc = tangent.mul(Wide { significand: factor, exponent: 1 });
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
    Wide::new(angle, 2)
}

/// A quarter turn, or half a turn, with a sign.
fn right_angles(count: i16, negative: bool) -> f32 {
    Wide { significand: QUARTER_PI, exponent: count }.to_f32(negative)
}

/// The angle of the point `(x, y)`, from -pi to pi, like `atan2` of C.
pub fn atan2(y: f32, x: f32) -> f32 {
    if x.is_nan() || y.is_nan() {
        return f32::NAN;
    }
    let negative = y.is_sign_negative();
    // At infinity only the direction counts.
    let (y, x) = match (y.is_infinite(), x.is_infinite()) {
        (false, false) => (y, x),
        (true, false) => (1.0, 0.0),
        (false, true) => (0.0, 1.0_f32.copysign(x)),
        (true, true) => (1.0, 1.0_f32.copysign(x)),
    };
    if y == 0.0 {
        if x.is_sign_negative() {
            right_angles(2, negative)
        } else {
            0.0_f32.copysign(if negative { -1.0 } else { 1.0 })
        }
    } else if x == 0.0 {
        right_angles(1, negative)
    } else {
        angle(Wide::from_f32(y), Wide::from_f32(x), x < 0.0).to_f32(negative)
    }
}

/// The other leg of a triangle with hypotenuse 1: `sqrt(1 - x^2)`, where `0 < |x| < 1`.
fn other_leg(x: Wide) -> Wide {
    let fraction = x.fraction(0);
    let sum = Wide { significand: fraction >> 1 | 1 << 31, exponent: 1 };
    let product = if fraction == 0 { sum } else { sum.mul(Wide::new(fraction.wrapping_neg(), 0)) };
    product.sqrt()
}

/// The angle in `-pi/2..=pi/2` whose sine is `x`; NaN beyond -1 and 1.
pub fn asin(x: f32) -> f32 {
    let negative = x.is_sign_negative();
    if x == 0.0 {
        x
    } else if x.abs() < 1.0 {
        let opposite = Wide::from_f32(x);
        angle(opposite, other_leg(opposite), false).to_f32(negative)
    } else if x.abs() == 1.0 {
        right_angles(1, negative)
    } else {
        f32::NAN
    }
}

/// The angle in `0..=pi` whose cosine is `x`; NaN beyond -1 and 1.
pub fn acos(x: f32) -> f32 {
    if x == 0.0 {
        right_angles(1, false)
    } else if x.abs() < 1.0 {
        let adjacent = Wide::from_f32(x);
        angle(other_leg(adjacent), adjacent, x < 0.0).to_f32(false)
    } else if x == 1.0 {
        0.0
    } else if x == -1.0 {
        right_angles(2, false)
    } else {
        f32::NAN
    }
}
