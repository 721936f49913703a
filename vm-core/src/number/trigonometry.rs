//! Trigonometric functions.
//!
//! A product with 2/pi turns an angle into a number of quarter turns. All bits of the product that
//! matter are exact, so results are right for every float, however large.

use super::float::Float;
use super::profile::Profile;
use super::tables::{constant, evaluate, operand, two_over_pi, wide_two_over_pi};
use super::wide::IS_WIDE;
use super::word::Word;
use crate::bytecode::ByteCode;

/// Reduces the angle `x`, which is not negative, after adding `quarters`, 0 or 1, quarter turns to
/// it. If the number of whole quarter turns is even, sets `x` to the remainder; else to 1 minus the
/// remainder. Both are in quarter turns. Returns true if the sine of the angle is the negative sine
/// of `x`.
#[hot]
pub(super) fn turn<P: Profile, C: ByteCode>(x: &mut Float<P>, quarters: u8) -> bool {
    // The product needs three words, with only those bits of 2/pi that count. The bits before them
    // stand for multiples of four quarter turns; the bits after them change the last bit of the
    // first two words by less than one.
    let (mut high, mut low, mut carried) = (P::ZERO, P::ZERO, P::ZERO);
    let mut word = 3_u8;
    if IS_WIDE && P::FULL {
        let product = u128::from(x.significand.to_u32()) * wide_two_over_pi(x.exponent as u8);
        (high, low) =
            (P::Raw::from_u32((product >> 64) as u32), P::Raw::from_u32((product >> 32) as u32));
        word = 0;
    }
    while word != 0 {
        word = word.wrapping_sub(1);
        let bits = two_over_pi::<P, C>(x.exponent as u8, word);
        let (product, rest) = x.significand.multiply(bits);
        let carry;
        low = high;
        (high, carry) = rest.add_carry(carried);
        carried = product.add(P::Raw::of(carry));
    }
    let quarters = quarters.wrapping_add((high >> (P::Raw::BITS - 2)).to_i16() as u8);
    if quarters & 1 != 0 {
        (high, low) = (!high, !low);
    }
    *x = Float::from_words(high & !P::ZERO >> 2, low, 2);
    quarters & 2 != 0
}

/// Sets `x` to the sine of an angle, after adding `quarters`, 0 or 1, quarter turns to it. Returns
/// false, and leaves `x` unchanged, if the angle is zero, infinite or NaN.
///
/// The result equals that of the programs `SIN` and `COS` bit for bit, with less than a third of
/// the calculator's instructions. Only computers use this function.
pub(super) fn sine_quickly<P: Profile, C: ByteCode>(x: &mut Float<P>, quarters: u8) -> bool {
    if x.is_special() {
        return false;
    }
    let mut sign = x.negative && quarters == 0;
    x.negative = false;
    if x.exponent >= 0 {
        sign ^= turn::<P, C>(x, quarters);
    } else {
        x.scale(&constant::<P, C>(operand::TWO_OVER_PI));
        if quarters != 0 {
            x.negative = true;
            x.add(&constant::<P, C>(operand::ONE));
        }
    }
    let series = evaluate::<P, C>(P::POLYNOMIALS.sine, x.square());
    x.scale(&Float::new(series, 1));
    x.negative = sign;
    true
}
