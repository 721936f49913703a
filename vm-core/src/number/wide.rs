//! Positive numbers with 32 significant bits, the working precision of the mathematical functions.
//!
//! The eight bits more than binary32 has absorb the errors of a computation, so that its result is
//! rounded once and is nearly always the nearest float. Everything is integer arithmetic, which no
//! floating-point library or unit can do differently, and which is faster than soft float on
//! processors without one.
//!
//! The AVR has 28 kB for everything, and 32-bit operations are long there. So shared steps are
//! functions that are not inlined, shifts by a variable go bit by bit, and results of 64 bits are
//! returned in registers, which only the calling convention of C does.

/// The product of two words.
///
/// Schoolbook multiplication in halves: multiplying 64-bit numbers would call a slow and large
/// library routine on processors that multiply at most 32 bits.
#[inline(never)]
pub extern "C" fn multiply(a: u32, b: u32) -> u64 {
    let (a_high, a_low) = (a >> 16, a & 0xFFFF);
    let (b_high, b_low) = (b >> 16, b & 0xFFFF);
    // No sum overflows: (2^16 - 1)^2 + 2 (2^16 - 1) = 2^32 - 1.
    let lowest = a_low.wrapping_mul(b_low);
    let middle = a_high.wrapping_mul(b_low).wrapping_add(lowest >> 16);
    let other = a_low.wrapping_mul(b_high).wrapping_add(middle & 0xFFFF);
    let high = a_high.wrapping_mul(b_high).wrapping_add(middle >> 16).wrapping_add(other >> 16);
    u64::from(high) << 32 | u64::from(other << 16 | lowest & 0xFFFF)
}

/// The high word of the product: the product of two fractions of 2^32.
#[inline(never)]
pub fn multiply_high(a: u32, b: u32) -> u32 {
    (multiply(a, b) >> 32) as u32
}

/// `a + b * x`, where all three are fractions of 2^32: a step of Horner's scheme.
#[cfg(feature = "maths")]
pub fn horner_add(a: u32, x: u32, b: u32) -> u32 {
    a.wrapping_add(multiply_high(x, b))
}

/// `a - b * x`, where all three are fractions of 2^32.
#[cfg(feature = "maths")]
pub fn horner_sub(a: u32, x: u32, b: u32) -> u32 {
    a.wrapping_sub(multiply_high(x, b))
}

/// The exponent of zero: below that of every product or quotient of binary32 numbers.
const ZERO_EXPONENT: i16 = -1000;

/// The number `significand / 2^32 * 2^exponent`. Bit 31 of the significand is set, or all are 0 in
/// the number zero.
///
/// The significand is the high word, the exponent the lowest 16 bits: a structure would be passed
/// through memory.
#[derive(Clone, Copy, Debug)]
#[repr(transparent)]
pub struct Wide(u64);

impl Wide {
    /// `significand / 2^32 * 2^exponent`.
    pub const fn new(significand: u32, exponent: i16) -> Wide {
        Wide((significand as u64) << 32 | exponent as u16 as u64)
    }

    /// `words / 2^64 * 2^exponent`, rounded.
    #[inline(never)]
    pub extern "C" fn normalize(words: u64, exponent: i16) -> Wide {
        let (mut words, mut exponent) = (words, exponent);
        if words == 0 {
            return Wide::new(0, ZERO_EXPONENT);
        }
        while words >> 63 == 0 {
            words <<= 1;
            exponent = exponent.wrapping_sub(1);
        }
        Wide::new((words.saturating_add(1 << 31) >> 32) as u32, exponent)
    }

    /// `fraction / 2^32 * 2^exponent`.
    pub fn from_fraction(fraction: u32, exponent: i16) -> Wide {
        Wide::normalize(u64::from(fraction) << 32, exponent)
    }

    /// The magnitude of a number; infinity and NaN count as 2^128.
    #[inline(never)]
    pub extern "C" fn from_f32(value: f32) -> Wide {
        let bits = value.to_bits();
        let field = (bits >> 23) as u8;
        if field == 0 {
            Wide::from_fraction(bits << 9, -126)
        } else {
            Wide::new(bits << 8 | 1 << 31, i16::from(field).wrapping_sub(126))
        }
    }

    /// The first 32 bits of the number.
    pub const fn significand(self) -> u32 {
        (self.0 >> 32) as u32
    }

    /// The power of two above the number: far from the limits of its type, since binary32 needs
    /// -148 to 128.
    pub const fn exponent(self) -> i16 {
        self.0 as i16
    }

    /// The nearest binary32, the even one of two, with a sign.
    #[inline(never)]
    pub fn to_f32(self, negative: bool) -> f32 {
        let (mut significand, mut field) = (self.significand(), self.exponent().wrapping_add(126));
        while field < 1 {
            // Subnormal: the last bit collects what is shifted out.
            significand = significand >> 1 | significand & 1;
            field = if significand == 0 { 1 } else { field.wrapping_add(1) };
        }
        let bits = if field > 254 {
            0x7F80_0000
        } else {
            // The leading bit of a normal significand makes up for the 1 that is subtracted.
            let truncated = ((field.wrapping_sub(1) as u32) << 23).wrapping_add(significand >> 8);
            let half_or_less = 0x7F_u16.wrapping_add(truncated as u16 & 1);
            let carry = (significand as u16 & 0xFF).wrapping_add(half_or_less) >> 8;
            truncated.wrapping_add(u32::from(carry))
        };
        f32::from_bits(if negative { bits | 1 << 31 } else { bits })
    }
}

#[cfg(feature = "maths")]
impl Wide {
    /// 1.
    pub const ONE: Wide = Wide::new(1 << 31, 1);

    /// The product, rounded.
    #[inline(never)]
    pub extern "C" fn mul(self, other: Wide) -> Wide {
        let product = multiply(self.significand(), other.significand());
        Wide::normalize(product, self.exponent().wrapping_add(other.exponent()))
    }

    /// The quotient, rounded. If `other` is zero, only the exponent means something: it is large.
    #[inline(never)]
    pub extern "C" fn div(self, other: Wide) -> Wide {
        let (mut rest, divisor) = (self.significand(), other.significand());
        let mut exponent = self.exponent().wrapping_sub(other.exponent());
        if rest >= divisor {
            exponent = exponent.wrapping_add(1);
        }
        // The first of 33 bits is before the point; if it is set, the last is not needed.
        let mut quotient = 0_u32;
        let mut carry = false;
        for _ in 0..33_u8 {
            quotient <<= 1;
            if carry || rest >= divisor {
                rest = rest.wrapping_sub(divisor);
                quotient |= 1;
            }
            if quotient >> 31 != 0 {
                break;
            }
            carry = rest >> 31 != 0;
            rest <<= 1;
        }
        // Rounding cannot carry into a 33rd bit, since the divisor has only 32.
        let up = rest >= divisor.wrapping_sub(rest);
        Wide::new(quotient.wrapping_add(u32::from(up)), exponent)
    }

    /// The square root. The last bit is set if the root is not exact, so that rounding to fewer
    /// bits is right; the one before it is 0.
    #[inline(never)]
    pub extern "C" fn sqrt(self) -> Wide {
        // With an even exponent the fraction is at least 1/4, and the root has its first bit set. The
        // bit that may get lost is 0 in a binary32, where exactness matters.
        let exponent = self.exponent().wrapping_add(1) & !1;
        let mut radicand = self.fraction(exponent);
        // Digit by digit. Thirty bits: then four times the rest still fits a word.
        let (mut root, mut rest) = (0_u32, 0_u32);
        for _ in 0..30_u8 {
            rest = rest << 2 | radicand >> 30;
            radicand <<= 2;
            let trial = root << 2 | 1;
            root <<= 1;
            if rest >= trial {
                rest = rest.wrapping_sub(trial);
                root |= 1;
            }
        }
        Wide::new(root << 2 | u32::from(rest != 0), exponent >> 1)
    }

    /// The value as a fixed-point number `fraction / 2^32 * 2^exponent`, rounded; the exponent is not
    /// smaller than the number's own.
    #[inline(never)]
    pub fn fraction(self, exponent: i16) -> u32 {
        let mut fraction = self.significand();
        let mut shift = exponent.wrapping_sub(self.exponent());
        let mut last_out = 0;
        while shift > 0 && fraction != 0 {
            last_out = fraction & 1;
            fraction >>= 1;
            shift = shift.wrapping_sub(1);
        }
        // No overflow: what has been shifted has a leading 0.
        fraction.wrapping_add(last_out)
    }
}
