//! The two number profiles of the virtual machine.
//!
//! A profile determines the width of a value's payload, and the representation of integers and
//! floats in it. The interpreter is generic over the profile, so a robot's firmware contains
//! exactly one.

use core::fmt::Debug;

use super::float::Float;
use super::float16::F16;
use super::tables::Polynomials;
use super::word::Word;
use crate::heap::CollectionState;
use crate::message;
use crate::network::{Buffer, content_bytes};
use crate::rom;
use crate::slots::Stored;

mod sealed {
    pub trait Sealed {}
    impl Sealed for super::Tiny {}
    impl Sealed for super::Full {}
}

/// A number profile: [`Tiny`] or [`Full`].
///
/// Integer operations have the payload's own width and wrap, so that the tiny profile compiles to
/// 16-bit code on an 8-bit processor.
pub trait Profile: sealed::Sealed + Stored + Copy + Default + Debug + 'static {
    /// The payload of a value.
    type Raw: Word;
    /// The payload of which all bits are zero.
    const ZERO: Self::Raw;
    /// The float that is not a number.
    const NAN: Self::Raw;

    /// The name in images, robot files and messages to people.
    const NAME: &'static str;
    /// The number in an image's header.
    const ID: u8;
    /// True for the full profile.
    const FULL: bool;
    /// Width of an integer.
    const INT_BITS: u32;
    /// The smallest integer.
    const INT_MIN: i32;
    /// The largest integer.
    const INT_MAX: i32;
    /// Bytes of a literal in an image.
    const WORD_BYTES: usize;
    /// A buffer for a frame.
    type Frame: Buffer;
    /// A buffer for the contents of all fragments of a message.
    type Content: Buffer;
    /// The time that work on text has taken. It is empty in the tiny profile, which has no text.
    type TextWork: TextWork;
    /// The state of a collection that stops and goes on between slices. It is empty in the tiny
    /// profile: chips with little memory collect at once.
    type Collection: CollectionState;
    /// The machine's own tables.
    const ROM: &'static [u8];
    /// The tables of a machine without [`Part::Maths`](crate::Part::Maths).
    const ROM_WITHOUT_MATHS: &'static [u8];
    /// The offsets of the coefficients of polynomials in these tables.
    const POLYNOMIALS: Polynomials;

    /// Makes a payload from 16 bits, such as an index or an id; the other bits are zero.
    fn raw_from_u16(value: u16) -> Self::Raw;
    /// Returns the low 16 bits of a payload.
    fn raw_to_u16(raw: Self::Raw) -> u16;
    /// Returns the payload of a literal: the first [`Profile::WORD_BYTES`] bytes, little endian.
    fn literal_from_le(bytes: [u8; 4]) -> Self::Raw;
    /// Returns true if all bits are zero. The only such integer is 0.
    fn is_zero(raw: Self::Raw) -> bool;

    /// Returns the value of an integer.
    fn int_to_i32(raw: Self::Raw) -> i32;
    /// Makes an integer; bits that do not fit are dropped.
    fn int_from_i32(value: i32) -> Self::Raw;
    /// Returns the value of a float, which is always exact.
    fn float_to_f32(raw: Self::Raw) -> f32;
    /// Returns the nearest float; every NaN becomes the profile's only one.
    fn float_from_f32(value: f32) -> Self::Raw;
    /// Returns the value of a float, unpacked for computation.
    fn unpack(raw: Self::Raw) -> Float<Self>;
    /// Returns the nearest float, with ties to even.
    fn pack(number: &Float<Self>) -> Self::Raw;

    /// Returns `a + b`, wrapping.
    fn add(a: Self::Raw, b: Self::Raw) -> Self::Raw;
    /// Returns `a - b`, wrapping.
    fn sub(a: Self::Raw, b: Self::Raw) -> Self::Raw;
    /// Returns `a * b`, wrapping.
    fn mul(a: Self::Raw, b: Self::Raw) -> Self::Raw;
    /// Returns `-a`, wrapping.
    fn neg(a: Self::Raw) -> Self::Raw;
    /// Returns `a / b` rounded towards zero; `None` if `b` is 0. The smallest integer divided by -1
    /// wraps to itself.
    fn div(a: Self::Raw, b: Self::Raw) -> Option<Self::Raw>;
    /// Returns the Euclidean remainder, from 0 to `|b| - 1`; `None` if `b` is 0.
    fn modulo(a: Self::Raw, b: Self::Raw) -> Option<Self::Raw>;

    /// Returns the bitwise and.
    fn and(a: Self::Raw, b: Self::Raw) -> Self::Raw;
    /// Returns the bitwise or.
    fn or(a: Self::Raw, b: Self::Raw) -> Self::Raw;
    /// Returns the bitwise complement.
    fn not(a: Self::Raw) -> Self::Raw;
    /// Returns `a << count`; `None` unless `count` is in 0..[`Profile::INT_BITS`].
    fn shl(a: Self::Raw, count: Self::Raw) -> Option<Self::Raw>;
    /// Returns `a >> count` with the sign kept; `None` unless `count` is in
    /// 0..[`Profile::INT_BITS`].
    fn shr(a: Self::Raw, count: Self::Raw) -> Option<Self::Raw>;

    /// Returns true if `a < b` as integers.
    fn int_less(a: Self::Raw, b: Self::Raw) -> bool;
}

/// The time of work on text, in instructions, until it is taken from the budget.
pub trait TextWork: Copy + Debug {
    /// No instructions.
    const NONE: Self;

    /// Adds instructions.
    fn add(&mut self, instructions: u16);

    /// Returns the instructions and resets them to none.
    fn take(&mut self) -> u16;
}

impl TextWork for () {
    const NONE: Self = ();

    #[hot]
    fn add(&mut self, _: u16) {}

    #[hot]
    fn take(&mut self) -> u16 {
        0
    }
}

impl TextWork for u16 {
    const NONE: Self = 0;

    #[hot]
    fn add(&mut self, instructions: u16) {
        *self = self.saturating_add(instructions);
    }

    #[hot]
    fn take(&mut self) -> u16 {
        core::mem::take(self)
    }
}

/// 16-bit integers and the 16-bit floats of [`F16`].
#[derive(Clone, Copy, Default, PartialEq, Eq, Debug)]
pub struct Tiny;

/// 32-bit integers and IEEE binary32 with a single NaN.
#[derive(Clone, Copy, Default, PartialEq, Eq, Debug)]
pub struct Full;

/// The integer operations of a profile, written once for both widths.
macro_rules! integer_operations {
    ($raw:ty, $int:ty) => {
        const ZERO: $raw = 0;
        const INT_BITS: u32 = <$int>::BITS;
        const INT_MIN: i32 = <$int>::MIN as i32;
        const INT_MAX: i32 = <$int>::MAX as i32;
        const WORD_BYTES: usize = size_of::<$raw>();

        #[inline]
        fn raw_from_u16(value: u16) -> $raw {
            <$raw>::from(value)
        }

        #[inline]
        fn raw_to_u16(raw: $raw) -> u16 {
            raw as u16
        }

        #[inline]
        fn literal_from_le(bytes: [u8; 4]) -> $raw {
            u32::from_le_bytes(bytes) as $raw
        }

        #[inline]
        fn is_zero(raw: $raw) -> bool {
            raw == 0
        }

        #[inline]
        fn int_to_i32(raw: $raw) -> i32 {
            i32::from(raw as $int)
        }

        #[inline]
        fn int_from_i32(value: i32) -> $raw {
            value as $raw
        }

        #[inline]
        fn add(a: $raw, b: $raw) -> $raw {
            a.wrapping_add(b)
        }

        #[inline]
        fn sub(a: $raw, b: $raw) -> $raw {
            a.wrapping_sub(b)
        }

        #[inline]
        fn mul(a: $raw, b: $raw) -> $raw {
            a.wrapping_mul(b)
        }

        #[inline]
        fn neg(a: $raw) -> $raw {
            a.wrapping_neg()
        }

        #[inline]
        fn div(a: $raw, b: $raw) -> Option<$raw> {
            if b == 2 {
                // Two is the most frequent divisor, and a division is a long subroutine on small
                // chips.
                let a = a as $int;
                return Some((a.wrapping_sub(a >> (<$int>::BITS - 1)) >> 1) as $raw);
            }
            if b == 0 { None } else { Some((a as $int).wrapping_div(b as $int) as $raw) }
        }

        #[inline]
        fn modulo(a: $raw, b: $raw) -> Option<$raw> {
            // A power of two needs no division, which is a long subroutine on small chips.
            if b.is_power_of_two() && (b as $int) > 0 {
                return Some(a & (b - 1));
            }
            if b == 0 { None } else { Some((a as $int).wrapping_rem_euclid(b as $int) as $raw) }
        }

        #[inline]
        fn and(a: $raw, b: $raw) -> $raw {
            a & b
        }

        #[inline]
        fn or(a: $raw, b: $raw) -> $raw {
            a | b
        }

        #[inline]
        fn not(a: $raw) -> $raw {
            !a
        }

        #[inline]
        fn shl(a: $raw, count: $raw) -> Option<$raw> {
            if count < <$int>::BITS as $raw { Some(a.wrapping_shl(count as u32)) } else { None }
        }

        #[inline]
        fn shr(a: $raw, count: $raw) -> Option<$raw> {
            if count < <$int>::BITS as $raw {
                Some((a as $int).wrapping_shr(count as u32) as $raw)
            } else {
                None
            }
        }

        #[inline]
        fn int_less(a: $raw, b: $raw) -> bool {
            (a as $int) < (b as $int)
        }
    };
}

impl Profile for Tiny {
    type Raw = u16;
    const NAN: u16 = F16::NAN.0;
    type Frame = [u8; message::TINY_FRAME];
    type Content = [u8; content_bytes(message::TINY_FRAME)];
    type TextWork = ();
    type Collection = ();

    const NAME: &'static str = "tiny";
    const ID: u8 = 0;
    const FULL: bool = false;
    const ROM: &'static [u8] = &rom::TINY;
    const ROM_WITHOUT_MATHS: &'static [u8] = &rom::TINY_WITHOUT_MATHS;
    const POLYNOMIALS: Polynomials = Polynomials::TINY;

    integer_operations!(u16, i16);

    // These functions are not inlined: one copy of each conversion serves the whole machine.
    #[one_copy]
    fn float_to_f32(raw: u16) -> f32 {
        F16(raw).to_f32()
    }

    #[one_copy]
    fn float_from_f32(value: f32) -> u16 {
        F16::from_f32(value).0
    }

    #[inline]
    fn unpack(raw: u16) -> Float<Tiny> {
        F16(raw).unpack()
    }

    #[inline]
    fn pack(number: &Float<Tiny>) -> u16 {
        F16::pack(number).0
    }
}

impl Profile for Full {
    type Raw = u32;
    const NAN: u32 = 0x7FC0_0000;
    type Frame = [u8; message::FULL_FRAME];
    type Content = [u8; content_bytes(message::FULL_FRAME)];
    type TextWork = u16;
    type Collection = crate::heap::Collection;

    const NAME: &'static str = "full";
    const ID: u8 = 1;
    const FULL: bool = true;
    const ROM: &'static [u8] = &rom::FULL;
    const ROM_WITHOUT_MATHS: &'static [u8] = &rom::FULL_WITHOUT_MATHS;
    const POLYNOMIALS: Polynomials = Polynomials::FULL;

    integer_operations!(u32, i32);

    #[inline]
    fn float_to_f32(raw: u32) -> f32 {
        f32::from_bits(raw)
    }

    #[inline]
    fn float_from_f32(value: f32) -> u32 {
        if value.is_nan() { Self::NAN } else { value.to_bits() }
    }

    #[inline]
    fn unpack(raw: u32) -> Float {
        Float::from_f32(f32::from_bits(raw))
    }

    #[inline]
    fn pack(number: &Float) -> u32 {
        number.to_f32().to_bits()
    }
}
