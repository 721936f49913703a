//! Shifts, products, ratios and roots on processors with registers of 64 bits, such as those of
//! computers that simulate robots.
//!
//! The chips of robots have no instructions for these operations: they shift bit by bit, divide
//! digit by digit and multiply in halves. Here each operation takes one or two instructions. The
//! results are the same bit for bit, as the tests of this file show.

use super::word::Word;

/// True if the processor has these instructions. It is a constant, so that the code which it
/// excludes is not compiled.
pub(crate) const IS_WIDE: bool = cfg!(any(target_pointer_width = "64", target_family = "wasm"));

/// Returns the word of two or four bytes at an offset of a table, the highest byte first; 0 if the
/// table is too short.
#[inline]
pub(super) fn word_at(table: &[u8], at: usize, has_four: bool) -> u32 {
    let bytes = table.get(at..).unwrap_or(&[]);
    if has_four {
        bytes.first_chunk().map_or(0, |bytes| u32::from_be_bytes(*bytes))
    } else {
        bytes.first_chunk().map_or(0, |bytes| u16::from_be_bytes(*bytes).into())
    }
}

/// Returns the number of zero bits before the first bit that is set.
#[inline]
pub(super) fn leading_zeros<W: Word>(bits: W) -> u8 {
    (bits.to_u32().leading_zeros() as u8).wrapping_sub(32 - W::BITS)
}

/// Returns `bits / 2^count`. The last bit is also set if any bit that is shifted out is. `count` is
/// less than the width of a word.
#[inline]
pub(super) fn shift_right<W: Word>(bits: W, count: u8) -> W {
    let bits = bits.to_u32();
    let shifted = bits.checked_shr(count.into()).unwrap_or(0);
    let is_exact = shifted.checked_shl(count.into()) == Some(bits);
    W::from_u32(shifted | u32::from(!is_exact))
}

/// Returns the result of [`divide`](super::arithmetic::divide) for a ratio or a remainder; `None`
/// if the digits of the quotient do not fit a word.
#[inline]
pub(super) fn divide<W: Word>(left: W, right: W, steps: u16, carry: bool) -> Option<(W, W)> {
    let (bits, right) = (u16::from(W::BITS), u64::from(right.to_u32()));
    let dividend = u64::from(left.to_u32()) | u64::from(carry) << bits;
    // Every digit is 0 or 1 only if the first one is.
    if steps >= bits || dividend >= 2 * right {
        return None;
    }
    let dividend = dividend << steps;
    let quotient = dividend.checked_div(right)? << (bits - 1 - steps);
    let rest = dividend.checked_rem(right)?;
    Some((W::from_u32(quotient as u32), W::from_u32(rest as u32)))
}

/// Returns the result of [`divide`](super::arithmetic::divide) for a square root with as many
/// digits as a word.
#[inline]
pub(super) fn root<W: Word>(square: W) -> (W, W) {
    // The root without its last digit.
    let scaled = u64::from(square.to_u32()) << (W::BITS - 2);
    let root = scaled.isqrt();
    let rest = scaled.wrapping_sub(root.wrapping_mul(root));
    // The divisor includes half of the digit to be found. For the last digit this half has no place
    // in a word, so it is not subtracted.
    let last = u64::from(rest >= root);
    let rest = rest.wrapping_sub(root.wrapping_mul(last));
    (W::from_u32((2 * root + last) as u32), W::from_u32((2 * rest) as u32))
}

#[cfg(test)]
mod tests {
    extern crate std;

    use super::super::arithmetic;
    use super::super::calculator::calculate;
    use super::super::float::Float;
    use super::super::maths::MathFunction;
    use super::super::profile::{Full, Profile, Tiny};
    use super::super::tables::{start, two_over_pi, wide_two_over_pi};
    use super::super::trigonometry::sine_quickly;
    use super::super::word::multiply;
    use super::*;
    use std::vec::Vec;

    /// Returns words with few and with many bits set, and random ones.
    fn words() -> Vec<u32> {
        let mut state = 1_u32;
        let mut words: Vec<u32> = (0..32)
            .flat_map(|bit| [1 << bit, (1 << bit) - 1, !(1 << bit), u32::MAX << bit])
            .collect();
        words.extend((0..200).map(|_| {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            state ^ state >> 15
        }));
        words
    }

    #[test]
    fn shifts_are_those_bit_by_bit() {
        fn check<W: Word>(word: u32) {
            let mut shifted = W::from_u32(word);
            for count in 0..W::BITS {
                assert_eq!(shift_right(W::from_u32(word), count), shifted, "{word:#x} >> {count}");
                shifted = shifted >> 1 | shifted & W::ONE;
            }
        }
        for word in words() {
            check::<u16>(word);
            check::<u32>(word);
        }
    }

    #[test]
    fn leading_zeros_are_counted_in_the_width_of_the_word() {
        for bit in 0..16 {
            assert_eq!(leading_zeros(1_u16 << bit), 15 - bit);
            assert_eq!(leading_zeros(1_u32 << bit), 31 - bit);
            assert_eq!(leading_zeros(0x1_0000_u32 << bit), 15 - bit);
        }
    }

    #[test]
    fn products_are_those_in_halves() {
        for a in words() {
            for b in words() {
                assert_eq!(multiply(a, b), u64::from(a) * u64::from(b), "{a:#x} * {b:#x}");
            }
        }
    }

    #[test]
    fn two_words_are_joined_as_if_they_were_added() {
        fn check<P: Profile>(high: P::Raw, low: P::Raw) {
            let mut sum = Float::<P>::normalized(high, 2);
            sum.add(&Float::normalized(low, 2 - Float::<P>::BITS));
            let joined = Float::from_words(high, low, 2);
            let parts = |number: Float<P>| (number.significand, number.exponent, number.negative);
            assert_eq!(parts(joined), parts(sum), "{high:?}, {low:?}");
        }
        for high in words() {
            for low in words() {
                check::<Full>(high, low);
                check::<Tiny>(high as u16, low as u16);
            }
        }
    }

    #[test]
    fn quarter_turns_are_counted_in_the_same_bits() {
        for exponent in 0..=128 {
            let word = |number| u128::from(two_over_pi::<Full, &[u8]>(exponent, number));
            let joined = word(0) << 64 | word(1) << 32 | word(2);
            assert_eq!(wide_two_over_pi(exponent), joined, "2^{exponent}");
        }
    }

    #[test]
    fn sines_are_those_of_the_calculator() {
        let mut floats = words();
        floats.extend(
            (0..=255).flat_map(|exponent| [0, 1, 0x49_0FDB].map(|bits| exponent << 23 | bits)),
        );
        for bits in floats {
            for quarters in [0, 1] {
                let angle = Full::unpack(bits);
                let mut expected = angle;
                let function = MathFunction::Sin as u8 + quarters;
                calculate::<Full, &[u8]>(start::<Full, &[u8]>(function), &mut expected, &angle);
                let mut sine = angle;
                if sine_quickly::<Full, &[u8]>(&mut sine, quarters) {
                    assert_eq!(Full::pack(&sine), Full::pack(&expected), "{bits:#x}, {quarters}");
                } else {
                    assert!(angle.is_special());
                }
            }
        }
    }

    #[test]
    fn ratios_are_those_digit_by_digit() {
        fn check<W: Word>(left: W, right: W) {
            for steps in [0, 1, 7, W::BITS - 2, W::BITS - 1].map(u16::from) {
                for carry in [false, true] {
                    if let Some(result) = divide(left, right, steps, carry) {
                        let digits = arithmetic::divide(left, right, steps, carry, false);
                        assert_eq!(result, digits, "{left:?} / {right:?}, {steps}, {carry}");
                    }
                }
            }
            let is_normal = left.has_first() && right.has_first();
            assert!(!is_normal || divide(left, right, 15, false).is_some(), "{left:?} / {right:?}");
        }
        for left in words() {
            for right in words() {
                check(left, right);
                check(left as u16, right as u16);
            }
        }
    }

    #[test]
    fn roots_are_those_digit_by_digit() {
        fn check<W: Word>(square: W) {
            let digits = arithmetic::divide(square, W::ZERO, u16::from(W::BITS) - 1, false, true);
            assert_eq!(root(square), digits, "{square:?}");
        }
        (0..=u16::MAX).for_each(check);
        words().into_iter().for_each(check);
        // Squares, and the words next to them.
        for word in words() {
            let square = ((u64::from(word) * u64::from(word)) >> 32) as u32;
            (0..3).for_each(|more| check(square.wrapping_sub(1).wrapping_add(more)));
        }
    }
}
