//! Positive numbers with 32 significant bits, the working precision of the mathematical functions.
//!
//! The eight bits more than binary32 has absorb the errors of a computation, so that its result is
//! rounded once and is nearly always the nearest float. Everything is integer arithmetic, which no
//! floating-point library or unit can do differently, and which is faster than soft float on
//! processors without one.

/// The product of two words, as high and low word.
///
/// Schoolbook multiplication in halves: a 64-bit product would call a slow and large library
/// routine on processors that multiply at most 32 bits.
pub fn multiply(a: u32, b: u32) -> (u32, u32) {
    let (a_high, a_low) = (a >> 16, a & 0xFFFF);
    let (b_high, b_low) = (b >> 16, b & 0xFFFF);
    // No sum overflows: (2^16 - 1)^2 + 2 (2^16 - 1) = 2^32 - 1.
    let lowest = a_low.wrapping_mul(b_low);
    let middle = a_high.wrapping_mul(b_low).wrapping_add(lowest >> 16);
    let other = a_low.wrapping_mul(b_high).wrapping_add(middle & 0xFFFF);
    let high = a_high.wrapping_mul(b_high).wrapping_add(middle >> 16).wrapping_add(other >> 16);
    (high, other << 16 | lowest & 0xFFFF)
}

/// The rounded high word of the product: the product of two fractions of 2^32.
#[inline(never)]
pub fn multiply_high(a: u32, b: u32) -> u32 {
    let (high, low) = multiply(a, b);
    // No overflow: the largest product has the high word 2^32 - 2 and the low word 1.
    high.wrapping_add(low >> 31)
}

/// `a + b * x`, where all three are fractions of 2^32: a step of Horner's scheme.
pub fn horner_add(a: u32, x: u32, b: u32) -> u32 {
    a.wrapping_add(multiply_high(x, b))
}

/// `a - b * x`, where all three are fractions of 2^32.
#[cfg(feature = "maths")]
pub fn horner_sub(a: u32, x: u32, b: u32) -> u32 {
    a.wrapping_sub(multiply_high(x, b))
}

/// The number `significand / 2^32 * 2^exponent`.
#[derive(Clone, Copy, Debug)]
pub struct Wide {
    /// Bit 31 is set.
    pub significand: u32,
    /// Far from the limits of its type: binary32 needs -148 to 128.
    pub exponent: i16,
}

impl Wide {
    /// `fraction / 2^32 * 2^exponent`; `fraction` is not 0.
    #[inline(never)]
    pub fn new(fraction: u32, exponent: i16) -> Wide {
        let (mut significand, mut exponent) = (fraction, exponent);
        for _ in 0..31 {
            if significand >> 31 != 0 {
                break;
            }
            significand <<= 1;
            exponent = exponent.wrapping_sub(1);
        }
        Wide { significand, exponent }
    }

    /// The magnitude of a number that is not 0, infinite or NaN.
    pub fn from_f32(value: f32) -> Wide {
        let bits = value.to_bits();
        let field = (bits >> 23 & 0xFF) as i16;
        if field == 0 {
            Wide::new(bits << 9, -126)
        } else {
            Wide { significand: bits << 8 | 1 << 31, exponent: field.wrapping_sub(126) }
        }
    }

    /// The nearest binary32, the even one of two, with a sign.
    #[inline(never)]
    pub fn to_f32(self, negative: bool) -> f32 {
        let (mut significand, mut field) = (self.significand, self.exponent.wrapping_add(126));
        while field < 1 {
            // Subnormal: the last bit collects what is shifted out.
            significand = significand >> 1 | significand & 1;
            field = field.wrapping_add(1);
        }
        let bits = if field > 254 {
            0x7F80_0000
        } else {
            // The leading bit of a normal significand makes up for the 1 that is subtracted.
            let truncated = ((field.wrapping_sub(1) as u32) << 23).wrapping_add(significand >> 8);
            let half_or_less = 0x7F_u32.wrapping_add(truncated & 1);
            truncated.wrapping_add((significand & 0xFF).wrapping_add(half_or_less) >> 8)
        };
        f32::from_bits(if negative { bits | 1 << 31 } else { bits })
    }

    /// The product.
    pub fn mul(self, other: Wide) -> Wide {
        let fraction = multiply_high(self.significand, other.significand);
        Wide::new(fraction, self.exponent.wrapping_add(other.exponent))
    }

    /// The quotient.
    #[inline(never)]
    pub fn div(self, other: Wide) -> Wide {
        let (mut rest, divisor) = (self.significand, other.significand);
        let mut exponent = self.exponent.wrapping_sub(other.exponent);
        let mut quotient = 0_u32;
        let mut bits = 32_u8;
        if rest >= divisor {
            // The quotient is 1 or more: its first bit stands before the point.
            rest = rest.wrapping_sub(divisor);
            exponent = exponent.wrapping_add(1);
            quotient = 1;
            bits = 31;
        }
        while bits > 0 {
            let carry = rest >> 31 != 0;
            rest <<= 1;
            quotient <<= 1;
            if carry || rest >= divisor {
                rest = rest.wrapping_sub(divisor);
                quotient |= 1;
            }
            bits -= 1;
        }
        // Rounding cannot carry into a 33rd bit, since the divisor has only 32.
        let up = rest >= divisor.wrapping_sub(rest);
        Wide { significand: quotient.wrapping_add(u32::from(up)), exponent }
    }

    /// The square root. The last bit is set if the root is not exact, so that rounding to fewer
    /// bits is right; the one before it is 0.
    #[cfg(feature = "maths")]
    #[inline(never)]
    pub fn sqrt(self) -> Wide {
        // An even exponent, and a fraction from 1/4: the root has its first bit set.
        let odd = self.exponent & 1;
        let mut radicand = self.significand >> odd;
        let lost = self.significand & odd as u32;
        let exponent = self.exponent.wrapping_add(odd) >> 1;
        // Digit by digit. Thirty bits: then four times the rest still fits a word.
        let (mut root, mut rest) = (0_u32, 0_u32);
        for _ in 0..30 {
            rest = rest << 2 | radicand >> 30;
            radicand <<= 2;
            let trial = root << 2 | 1;
            root <<= 1;
            if rest >= trial {
                rest = rest.wrapping_sub(trial);
                root |= 1;
            }
        }
        let inexact = u32::from(rest | lost != 0);
        Wide { significand: root << 2 | inexact, exponent }
    }

    /// The value as a fixed-point number `fraction / 2^32 * 2^exponent`, truncated; the exponent
    /// is not smaller than the number's own.
    pub fn fraction(self, exponent: i16) -> u32 {
        let shift = exponent.wrapping_sub(self.exponent);
        if shift < 32 { self.significand >> (shift & 31) } else { 0 }
    }
}
