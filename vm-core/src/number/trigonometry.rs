//! Trigonometric functions.
//!
//! An angle becomes a number of quarter turns by a product with 2/pi that is exact where it matters, so results are right
//! for every float, however large.

use super::float::{Float, multiply};
use super::tables::operand::{ONE, TWO_OVER_PI};
use super::tables::{constant, two_over_pi};
use crate::bytecode::ByteCode;

/// Sets `x`, an angle to which a number of quarter turns is added, 0 or 1, to what it is beyond a multiple of a quarter
/// turn if that multiple is even, or what it lacks to the next; in quarter turns. Whether the sine is
/// negative.
#[inline(always)]
pub(super) fn turn<C: ByteCode>(x: &mut Float, quarters: u8) -> bool {
    let mut negative = x.negative;
    if quarters != 0 {
        negative = false;
    }
    x.negative = false;
    if x.exponent < 0 {
        x.mul(&constant::<C>(TWO_OVER_PI));
        if quarters != 0 {
            x.negative = true;
            x.add(&constant::<C>(ONE));
        }
        return negative;
    }
    // Three words of the product of 24 bits and those of 2/pi that count: what is before them are multiples of four
    // quarter turns, and what is behind them changes less than 2^-61.
    let place = x.exponent.wrapping_add(6) as u8;
    let factor = x.significand >> 8 << (place & 7);
    let byte = place >> 3;
    let (mut sum, mut low) = (0_u64, 0);
    for offset in [8, 4, 0] {
        low = sum as u32;
        let word = two_over_pi::<C>(byte.wrapping_add(offset));
        sum = multiply(factor, word).wrapping_add(sum >> 32);
    }
    let mut high = sum as u32;
    let quarters = quarters.wrapping_add((high >> 30) as u8);
    if quarters & 1 != 0 {
        (high, low) = (!high, !low);
    }
    *x = Float::normalized(high << 2, 0);
    x.add(&Float::normalized(low, -30));
    negative != (quarters & 2 != 0)
}
