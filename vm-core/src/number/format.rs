//! Conversion of numbers to text and of text to numbers, without `core::fmt`.

use super::float::Float;
use super::word::multiply;

/// Ten to the number of decimals that `%f` prints.
const MILLION: u32 = 1_000_000;

/// The exponents of ten beyond which every integer of up to 20 digits becomes zero or infinity.
const SMALLEST_EXPONENT: i32 = -66;
const LARGEST_EXPONENT: i32 = 38;

/// Prints an integer like `%d` of C.
pub fn format_int(value: i32, sink: &mut impl FnMut(u8)) {
    if value < 0 {
        sink(b'-');
    }
    decimal(value.unsigned_abs(), 1, sink);
}

/// Prints a float like `%f` of C: the exact value, rounded to six decimals, ties to even.
///
/// Infinity is `inf` or `-inf`, NaN is `nan`.
pub fn format_float(value: f32, sink: &mut impl FnMut(u8)) {
    if value.is_nan() {
        b"nan".iter().for_each(|byte| sink(*byte));
        return;
    }
    if value.is_sign_negative() {
        sink(b'-');
    }
    if value.is_infinite() {
        b"inf".iter().for_each(|byte| sink(*byte));
        return;
    }
    let bits = value.to_bits() & 0x7FFF_FFFF;
    let field = bits >> 23;
    // The value is significand * 2^(shift - 150).
    let (significand, shift) =
        if field == 0 { (bits, 1) } else { (bits & 0x7F_FFFF | 0x80_0000, field) };
    if shift >= 150 {
        large_decimal(significand, shift.wrapping_sub(150), sink);
        sink(b'.');
        decimal(0, 6, sink);
        return;
    }
    let shift = 150_u32.wrapping_sub(shift);
    let (mut whole, fraction) = if shift < 32 {
        (significand >> shift, significand & !(!0 << shift))
    } else {
        (0, significand)
    };
    let mut millionths = scaled_down(fraction, shift);
    if millionths == MILLION {
        whole = whole.wrapping_add(1);
        millionths = 0;
    }
    decimal(whole, 1, sink);
    sink(b'.');
    decimal(millionths, 6, sink);
}

/// Returns `fraction * 1000000 / 2^shift`, rounded to the nearest integer, ties to even.
fn scaled_down(fraction: u32, shift: u32) -> u32 {
    // The factors have 24 and 20 bits, so a shift of the product by more than 45 leaves nothing.
    let mut scaled = multiply(fraction, MILLION);
    let mut half = 0;
    let mut rest = 0;
    for _ in 0..shift.min(46) {
        rest |= half;
        half = scaled as u32 & 1;
        scaled >>= 1;
    }
    let whole = scaled as u32;
    whole.wrapping_add(half & (rest | whole))
}

/// Prints an integer in decimal, with at least `digits` digits.
fn decimal(value: u32, digits: u8, sink: &mut impl FnMut(u8)) {
    let mut text = [0_u8; 10];
    let mut rest = value;
    let mut length = 0_u8;
    for place in text.iter_mut().rev() {
        if rest == 0 && length >= digits {
            break;
        }
        *place = (rest % 10) as u8;
        rest /= 10;
        length += 1;
    }
    text.iter()
        .skip(usize::from(10_u8.saturating_sub(length)))
        .for_each(|digit| sink(b'0' | digit));
}

/// Prints `significand * 2^shift`, where the shift is up to 104.
fn large_decimal(significand: u32, shift: u32, sink: &mut impl FnMut(u8)) {
    // Each group has four digits, and the least significant group comes first; 2^128 has 39 digits.
    let mut groups = [0_u16; 10];
    let mut carry = significand;
    for group in &mut groups {
        *group = (carry % 10_000) as u16;
        carry /= 10_000;
    }
    let mut left = shift;
    while left > 0 {
        let step = left.min(16);
        let mut carry = 0_u32;
        for group in &mut groups {
            let shifted = (u32::from(*group) << step).wrapping_add(carry);
            *group = (shifted % 10_000) as u16;
            carry = shifted / 10_000;
        }
        left = left.wrapping_sub(step);
    }
    let mut digits = 1;
    let mut started = false;
    for (index, group) in groups.iter().rev().enumerate() {
        started |= *group != 0 || index == 9;
        if started {
            decimal(u32::from(*group), digits, sink);
            digits = 4;
        }
    }
}

/// Returns true for white space as defined by C.
fn is_space(byte: u8) -> bool {
    byte == b' ' || (b'\t'..=b'\r').contains(&byte)
}

/// A text that is read once from the front.
struct TextReader<I: Iterator<Item = u8>> {
    rest: I,
    next: Option<u8>,
}

impl<I: Iterator<Item = u8>> TextReader<I> {
    fn new(mut rest: I) -> Self {
        let next = rest.next();
        TextReader { rest, next }
    }

    fn advance(&mut self) {
        self.next = self.rest.next();
    }

    fn skip_space(&mut self) {
        while self.next.is_some_and(is_space) {
            self.advance();
        }
    }

    /// Skips a sign. Returns true if it was a minus sign.
    fn sign(&mut self) -> bool {
        let negative = self.next == Some(b'-');
        if negative || self.next == Some(b'+') {
            self.advance();
        }
        negative
    }

    fn digit(&mut self) -> Option<u8> {
        let digit = self.next?.wrapping_sub(b'0');
        if digit > 9 {
            return None;
        }
        self.advance();
        Some(digit)
    }
}

/// Reads the integer at the start of a text: white space, a sign, decimal digits. The rest of the
/// text is ignored.
///
/// Returns `None` if there is no digit, and the nearest `i32` if the integer does not fit.
pub fn parse_int(text: impl Iterator<Item = u8>) -> Option<i32> {
    let mut text = TextReader::new(text);
    text.skip_space();
    let negative = text.sign();
    let mut value = 0_i32;
    let mut any = false;
    while let Some(digit) = text.digit() {
        any = true;
        // The value is counted downwards, since the smallest integer has no positive counterpart.
        value = value.saturating_mul(10).saturating_sub(i32::from(digit));
    }
    any.then(|| if negative { value } else { value.saturating_neg() })
}

/// An unsigned integer of 352 bits, the lowest limb first. This is enough for 20 digits times or
/// divided by every power of ten that matters.
struct Big([u16; 22]);

impl Big {
    fn multiply_add(&mut self, factor: u16, summand: u16) {
        let mut carry = u32::from(summand);
        for limb in &mut self.0 {
            carry = u32::from(*limb).wrapping_mul(u32::from(factor)).wrapping_add(carry);
            *limb = carry as u16;
            carry >>= 16;
        }
    }

    /// Divides by ten. Returns true if there is a remainder.
    fn divide_by_ten(&mut self) -> bool {
        let mut rest = 0_u32;
        for limb in self.0.iter_mut().rev() {
            let dividend = rest << 16 | u32::from(*limb);
            *limb = (dividend / 10) as u16;
            rest = dividend % 10;
        }
        rest != 0
    }

    /// Returns the first 32 bits from the highest set one, as an integer below `2^32`, and the
    /// power of two by which it is scaled. The last bit is also set if any bit after it is.
    fn leading(&self) -> (u32, i16) {
        let (mut bits, mut scale) = (0_u32, 0_i16);
        for limb in self.0.iter().rev() {
            for place in (0..16).rev() {
                let bit = u32::from(*limb >> place & 1);
                if bits >> 31 == 0 {
                    bits = bits << 1 | bit;
                } else {
                    bits |= bit;
                    scale = scale.wrapping_add(1);
                }
            }
        }
        (bits, scale)
    }
}

/// Reads the float at the start of a text: white space, a sign, digits with at most one point among
/// or around them, an exponent. The rest of the text is ignored.
///
/// Returns `None` if there is no digit. The result is the nearest float, with ties to even, if
/// there are at most 20 digits after leading zeros; of more digits, the rest only decides ties.
/// `inf`, `nan` and hexadecimal floats are not read.
pub fn parse_float(text: impl Iterator<Item = u8>) -> Option<f32> {
    let mut text = TextReader::new(text);
    text.skip_space();
    let negative = text.sign();

    let mut big = Big([0; 22]);
    let mut exponent = 0_i32;
    let (mut any, mut point, mut kept, mut dropped) = (false, false, 0_u8, false);
    loop {
        if let Some(digit) = text.digit() {
            any = true;
            if kept < 20 {
                // Leading zeros leave the number as it is.
                if kept > 0 || digit != 0 {
                    big.multiply_add(10, u16::from(digit));
                    kept += 1;
                }
                exponent = exponent.saturating_sub(i32::from(point));
            } else {
                dropped |= digit != 0;
                exponent = exponent.saturating_add(i32::from(!point));
            }
        } else if text.next == Some(b'.') && !point {
            point = true;
            text.advance();
        } else {
            break;
        }
    }
    if !any {
        return None;
    }
    if text.next.is_some_and(|byte| byte | 0x20 == b'e') {
        text.advance();
        let minus = text.sign();
        let mut written = 0_i32;
        while let Some(digit) = text.digit() {
            written = written.saturating_mul(10).saturating_add(i32::from(digit));
        }
        exponent = exponent.saturating_add(if minus { -written } else { written });
    }

    let magnitude = if kept == 0 || exponent < SMALLEST_EXPONENT {
        0.0
    } else if exponent > LARGEST_EXPONENT {
        f32::INFINITY
    } else {
        let mut scale = 32_i16;
        let mut inexact = dropped;
        if exponent < 0 {
            // The number is multiplied by 2^270, so that the quotient has more than 32 bits.
            for _ in 0..18 {
                big.multiply_add(1 << 15, 0);
            }
            scale = 32 - 270;
            for _ in exponent..0 {
                inexact |= big.divide_by_ten();
            }
        } else {
            for _ in 0..exponent {
                big.multiply_add(10, 0);
            }
        }
        let (bits, extra) = big.leading();
        Float::normalized(bits | u32::from(inexact), scale.wrapping_add(extra)).to_f32()
    };
    Some(if negative { -magnitude } else { magnitude })
}
