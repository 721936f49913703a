//! The constants of the mathematical functions in flash ([`crate::rom`]): programs of the
//! [calculator](super::calculator), constants, and the coefficients of polynomials.
//!
//! The polynomials are minimax approximations, as fractions of the profile's words. Their
//! coefficients alternate in sign. The relative errors are 2^-34 or less in the full profile. In
//! the tiny profile the coefficients were rounded one after the other, and the remaining ones
//! fitted again each time. Its errors are 2^-18 or less, except 2^-15.9 for the arc tangent, since
//! there is no fraction 1.

use super::float::Float;
use super::profile::Profile;
use super::wide;
use super::word::Word;
use crate::bytecode::ByteCode;
use crate::rom;

/// The operands of the calculator: the registers, then the constants.
pub(super) mod operand {
    /// The second argument.
    pub const Y: u8 = 0;
    /// Registers for intermediate results; all but U are used by logarithms.
    pub const R: u8 = 1;
    pub const S: u8 = 2;
    pub const T: u8 = 3;
    pub const U: u8 = 4;
    /// The number of registers.
    pub const REGISTERS: u8 = 5;
    pub const ONE: u8 = REGISTERS;
    pub const HALF_PI: u8 = REGISTERS + 1;
    pub const PI: u8 = REGISTERS + 2;
    pub const TWO_OVER_PI: u8 = REGISTERS + 3;
    pub const LOG2_E: u8 = REGISTERS + 4;
    pub const LN_2: u8 = REGISTERS + 5;
    pub const LOG10_2: u8 = REGISTERS + 6;
    /// `ln 2 / 2^29`
    pub const LN_2_SCALED: u8 = REGISTERS + 7;
}

/// The instructions of the calculator: an operation, and its operand or its variant in the low four
/// bits.
pub(super) mod instruction {
    use super::super::arithmetic::operation;

    pub const ADD: u8 = operation::ADD << 4;
    pub const SUB: u8 = operation::SUB << 4;
    pub const MUL: u8 = operation::MUL << 4;
    pub const DIV: u8 = operation::DIV << 4;
    pub const ROOT: u8 = operation::ROOT << 4;
    /// X becomes the operand.
    pub const LOAD: u8 = 0x60;
    /// The register becomes X.
    pub const STORE: u8 = 0x70;
    /// X becomes `2^(X * operand)`.
    pub const EXP2: u8 = 0x80;
    /// X is multiplied by the value of a polynomial and 2 to the power of its number.
    pub const SERIES: u8 = 0x90;
    /// The register and X are exchanged.
    pub const SWAP: u8 = 0xA0;
    /// X becomes its magnitude. An angle of at least 1/2 becomes its distance from a multiple of a
    /// quarter turn, see [`turn`](super::super::trigonometry::turn). The sign of its sine is kept.
    pub const TURN: u8 = 0xB0;
    /// Like [`TURN`], after a quarter turn is added to the angle.
    pub const TURN_MORE: u8 = 0xB1;
    /// X becomes a number near 1, and T the exponent of the power of two by which X was divided.
    /// Ends the program if X has no finite logarithm.
    pub const SPLIT: u8 = 0xC0;
    /// X becomes X to the power Y, and the program ends, if that power is simple. Otherwise X
    /// becomes its magnitude. The sign of the power is kept.
    pub const POWER: u8 = 0xC1;
    /// The point (Y, X) is mirrored to the quadrant where neither coordinate is negative. The sign
    /// of its angle is kept.
    pub const POINT: u8 = 0xD0;
    /// X gets the sign that was kept, at first plus.
    pub const SIGN: u8 = 0xD1;
    /// X becomes negative.
    pub const MINUS: u8 = 0xD2;
    /// The next instruction is skipped unless the point is nearer to the axis of Y, or the angle is
    /// below 1/2.
    pub const IF_STEEP: u8 = 0xE0;
    /// The next instruction is skipped unless the point is to the left of the axis of Y.
    pub const IF_LEFT: u8 = 0xE1;
    /// Continues with the program in the next byte, and after that byte when that program ends.
    pub const CALL: u8 = 0xE2;
    /// Ends the program.
    pub const END: u8 = 0xF0;
}

/// A polynomial: the indices of its coefficients, the highest power first.
#[derive(Clone, Copy, Debug)]
pub struct Series {
    first: u8,
    end: u8,
}

/// The polynomials of a profile.
#[derive(Clone, Copy, Debug)]
pub struct Polynomials {
    /// `sin(pi/2 * x) / 2x` in `x^2`, for x from 0 to 1.
    pub(super) sine: Series,
    /// `atan(x) / x` in `x^2`, for x from 0 to 1.
    pub(super) arc_tangent: Series,
    /// `2 atanh(x) / (4 x ln 2)` in [`largest_square`] less `x^2`, for x from 0 to 1/3.
    pub(super) logarithm: Series,
    /// `(1 - 2^-x) / x` in `x`, for x from 0 to 1.
    pub(super) exponential: Series,
}

impl Polynomials {
    pub(super) const TINY: Polynomials = Polynomials::of([4, 6, 4, 5]);
    pub(super) const FULL: Polynomials = Polynomials::of([6, 12, 7, 7]);

    /// Returns the indices of polynomials with these numbers of coefficients.
    const fn of(lengths: [u8; 4]) -> Polynomials {
        let [sine, arc_tangent, logarithm, exponential] = lengths;
        let logarithm_at = sine + arc_tangent;
        let exponential_at = logarithm_at + logarithm;
        Polynomials {
            sine: Series { first: 0, end: sine },
            arc_tangent: Series { first: sine, end: logarithm_at },
            logarithm: Series { first: logarithm_at, end: exponential_at },
            exponential: Series { first: exponential_at, end: exponential_at + exponential },
        }
    }

    /// Returns the number of coefficients.
    const fn count(&self) -> usize {
        self.exponential.end as usize
    }
}

const TINY_WORDS: [u16; Polynomials::TINY.count()] = [
    // Sine
    0x008F, 0x0A2D, 0x52AE, 0xC910, // Arc tangent
    0x0373, 0x0EB6, 0x1F09, 0x3215, 0x553F, 0xFFFF, // Logarithm
    0x1F9A, 0x2F16, 0x46DB, 0xC000, // Exponential
    0x0042, 0x0265, 0x0E30, 0x3D7F, 0xB172,
];

const FULL_WORDS: [u32; Polynomials::FULL.count()] = [
    // Sine
    0x0000_1CC3,
    0x0005_4040,
    0x0099_6889,
    0x0A33_5DFE,
    0x52AE_F394,
    0xC90F_DAA2,
    // Arc tangent
    0x002C_E0E0,
    0x013D_E8F3,
    0x041F_E49A,
    0x08C1_F531,
    0x0DE5_3B93,
    0x128C_8D5F,
    0x16FD_49F1,
    0x1C66_1102,
    0x2491_264D,
    0x3333_2472,
    0x5555_550A,
    0xFFFF_FFFF,
    // Logarithm
    0x1433_7CC2,
    0x1D45_825E,
    0x211D_D807,
    0x2609_5C43,
    0x2F83_A0B4,
    0x46DD_CB7A,
    0xC000_0000,
    // Exponential
    0x0000_B4FD,
    0x0009_A4D5,
    0x0057_027B,
    0x0276_293A,
    0x0E35_7957,
    0x3D7F_7AAA,
    0xB172_17EA,
];

/// Returns `1 / 9` as a fraction, rounded up.
pub(super) fn largest_square<P: Profile>() -> P::Raw {
    P::Raw::from_u32(if P::FULL { 0x1C71_C71D } else { 0x1C72 })
}

/// Significands and exponents of the constants.
const CONSTANTS: [(u32, i8); 8] = [
    (0x8000_0000, 1),
    (0xC90F_DAA2, 1),
    (0xC90F_DAA2, 2),
    (0xA2F9_836E, 0),
    (0xB8AA_3B29, 1),
    (0xB172_17F8, 0),
    (0x9A20_9A85, -1),
    (0xB172_17F8, -29),
];

/// The first 192 bits after the point of 2/pi.
const TWO_OVER_PI_BITS: [u8; 24] = [
    0xA2, 0xF9, 0x83, 0x6E, 0x4E, 0x44, 0x15, 0x29, 0xFC, 0x27, 0x57, 0xD1, 0xF5, 0x34, 0xDD, 0xC0,
    0xDB, 0x62, 0x95, 0x99, 0x3C, 0x43, 0x90, 0x41,
];

/// The programs, with constants for their offsets.
macro_rules! programs {
    ($($(#[$documentation:meta])* $name:ident = $($code:expr),+;)+) => {
        programs! { @place 0; $($(#[$documentation])* $name = [$(stringify!($code)),+];)+ }
        const PROGRAMS: &[u8] = &[$($($code),+),+];
    };
    (@place $at:expr; $(#[$documentation:meta])* $name:ident = $code:expr; $($rest:tt)*) => {
        $(#[$documentation])*
        pub(in crate::number) const $name: u8 = $at;
        programs! { @place $name + $code.len() as u8; $($rest)* }
    };
    (@place $at:expr;) => {};
}

/// See [`super::calculator::calculate`].
pub(super) mod program {
    use super::instruction::*;
    use super::operand::*;

    programs! {
        /// The square root.
        SQRT = ROOT, END;
        /// `e^x`
        EXP = EXP2 | LOG2_E, END;
        /// The natural logarithm.
        LN = CALL, LOG2, MUL | LN_2, END;
        /// The decimal logarithm.
        LOG10 = CALL, LOG2, MUL | LOG10_2, END;
        /// `x^y`
        RAISE = POWER, CALL, LOG2, EXP2 | Y, SIGN, END;
        /// The magnitude of the natural logarithm.
        MINUS_LN = CALL, LOG2, MUL | LN_2, SIGN, END;
        /// `y / 2^15 * sqrt(-2 ln x / x)`
        NORMAL = STORE | U, CALL, LOG2, MUL | LN_2_SCALED, SIGN, DIV | U, ROOT, MUL | Y, END;
        /// The logarithm with base 2.
        LOG2 = SPLIT, STORE | R, ADD | ONE, STORE | S, LOAD | R, SUB | ONE, DIV | S,
            SERIES | 2, ADD | T, END;
        /// The sine.
        SIN = TURN, IF_STEEP, MUL | TWO_OVER_PI, SERIES | 1, SIGN, END;
        /// The cosine.
        COS = TURN_MORE, IF_STEEP, MUL | TWO_OVER_PI, IF_STEEP, MINUS, IF_STEEP, ADD | ONE, SERIES | 1, SIGN, END;
        /// The tangent.
        TAN = STORE | R, CALL, COS, STORE | Y, LOAD | R, CALL, SIN, DIV | Y, END;
        /// The arc cosine.
        ACOS = CALL, LEG, CALL, ATAN, END;
        /// The arc sine.
        ASIN = CALL, LEG, SWAP | Y, CALL, ATAN, END;
        /// The leg of a triangle with hypotenuse 1 and the other leg x, which becomes y.
        LEG = STORE | Y, ADD | ONE, STORE | R, LOAD | ONE, SUB | Y, MUL | R, ROOT, END;
        /// The angle of the point (y, x).
        ATAN = POINT, IF_STEEP, SWAP | Y, DIV | Y, SERIES, MINUS, IF_STEEP, ADD | HALF_PI, MINUS, IF_LEFT,
            ADD | PI, SIGN, END;
    }

    pub(in crate::number) const BYTES: &[u8] = PROGRAMS;

    /// The starts of the functions, in the order of [`crate::number::maths::MathFunction`].
    pub(in crate::number) const STARTS: [u8; 12] =
        [SQRT, EXP, LN, LOG2, LOG10, SIN, COS, TAN, ASIN, ACOS, ATAN, RAISE];
}

const PROGRAMS_AT: usize = program::STARTS.len();
const WORDS_AT: usize = PROGRAMS_AT + program::BYTES.len();

/// Returns the number of bytes of all tables for words of `width` bytes, `count` coefficients, and
/// the first `bits` bytes of 2/pi.
const fn length(width: usize, count: usize, bits: usize) -> usize {
    WORDS_AT + width * count + (width + 1) * CONSTANTS.len() + width + 1 + bits
}

/// All tables of the tiny profile. It has as many bits of 2/pi as the largest float needs.
pub(crate) const TINY: [u8; length(2, TINY_WORDS.len(), 8)] = {
    let mut words = [0; TINY_WORDS.len()];
    let mut at = 0;
    while at < words.len() {
        words[at] = (TINY_WORDS[at] as u32) << 16;
        at += 1;
    }
    bytes(2, &words)
};

/// All tables of the full profile.
pub(crate) const FULL: [u8; length(4, FULL_WORDS.len(), 24)] = bytes(4, &FULL_WORDS);

/// Returns all tables as bytes. The words are fractions of 2^32, of which the first `width` bytes
/// are kept.
const fn bytes<const LENGTH: usize>(width: usize, words: &[u32]) -> [u8; LENGTH] {
    let mut bytes = [0; LENGTH];
    let mut at = 0;
    while at < WORDS_AT {
        bytes[at] =
            if at < PROGRAMS_AT { program::STARTS[at] } else { program::BYTES[at - PROGRAMS_AT] };
        at += 1;
    }
    let mut index = 0;
    while index < words.len() {
        at = put(&mut bytes, at, width, words[index]);
        index += 1;
    }
    index = 0;
    while index < CONSTANTS.len() {
        let (significand, exponent) = CONSTANTS[index];
        // The significand is rounded to the nearest.
        let half = if width == 2 { 1 << 15 } else { 0 };
        at = put(&mut bytes, at, width, significand + half);
        bytes[at] = exponent as u8;
        at += 1;
        index += 1;
    }
    // There are only zeros before the point.
    at += width + 1;
    index = 0;
    while at < bytes.len() {
        bytes[at] = TWO_OVER_PI_BITS[index];
        at += 1;
        index += 1;
    }
    bytes
}

/// Stores the first `width` bytes of a word, and returns the offset after them.
const fn put(bytes: &mut [u8], at: usize, width: usize, word: u32) -> usize {
    let mut byte = 0;
    while byte < width {
        bytes[at + byte] = word.to_be_bytes()[byte];
        byte += 1;
    }
    at + width
}

const fn constants_at<P: Profile>() -> usize {
    WORDS_AT + P::WORD_BYTES * P::POLYNOMIALS.count()
}

#[one_copy]
fn word<P: Profile, C: ByteCode>(at: usize) -> P::Raw {
    if wide::IS_WIDE {
        return P::Raw::from_u32(wide::word_at(P::ROM, rom::MATHS_AT + at, P::FULL));
    }
    let mut word = P::ZERO;
    for byte in 0..P::WORD_BYTES {
        let byte = P::raw_from_u16(C::rom::<P>(rom::MATHS_AT + at + byte).into());
        word = word << 8 | byte;
    }
    word
}

/// Returns a word of 2/pi for an angle of `significand * 2^exponent`. The number of quarter turns
/// in the angle is the product of the significand and these words, in fractions of four quarter
/// turns.
#[one_copy]
pub(super) fn two_over_pi<P: Profile, C: ByteCode>(exponent: u8, number: u8) -> P::Raw {
    let bits_at = constants_at::<P>() + (P::WORD_BYTES + 1) * CONSTANTS.len();
    let place = exponent.wrapping_add(6);
    let at = bits_at + usize::from(place >> 3) + P::WORD_BYTES * usize::from(number);
    let next = C::rom::<P>(rom::MATHS_AT + at + P::WORD_BYTES);
    let more = u16::from(next) << (place & 7) >> 8;
    word::<P, C>(at) << (place & 7) | P::raw_from_u16(more)
}

/// Returns the three words of [`two_over_pi`] of the full profile, as one number.
#[hot]
pub(super) fn wide_two_over_pi(exponent: u8) -> u128 {
    let bits_at = FULL.len() - TWO_OVER_PI_BITS.len() - 5;
    let place = exponent.wrapping_add(6);
    // The three words are in the last of the 16 bytes from there on.
    let at = bits_at + usize::from(place >> 3) - 3;
    let bytes = FULL.get(at..).and_then(<[u8]>::first_chunk);
    bytes.map_or(0, |bytes| u128::from_be_bytes(*bytes) << 24 << (place & 7) >> 32)
}

/// Returns a constant by its number as an operand.
#[one_copy]
pub(super) fn constant<P: Profile, C: ByteCode>(number: u8) -> Float<P> {
    let number = number.wrapping_sub(operand::REGISTERS);
    let at = constants_at::<P>() + usize::from(number.wrapping_mul(P::WORD_BYTES as u8 + 1));
    let exponent = C::rom::<P>(rom::MATHS_AT + at + P::WORD_BYTES);
    Float::new(word::<P, C>(at), i16::from(exponent as i8))
}

/// Returns the start of a function of [`super::maths::MathFunction`].
pub(super) fn start<P: Profile, C: ByteCode>(function: u8) -> u8 {
    C::rom::<P>(rom::MATHS_AT + usize::from(function))
}

/// Returns a byte of the programs.
pub(super) fn instruction_at<P: Profile, C: ByteCode>(at: u8) -> u8 {
    C::rom::<P>(rom::MATHS_AT + PROGRAMS_AT + usize::from(at))
}

/// Returns the value of a polynomial.
#[one_copy]
pub(super) fn evaluate<P: Profile, C: ByteCode>(series: Series, x: P::Raw) -> P::Raw {
    let mut value = P::ZERO;
    if wide::IS_WIDE && P::FULL {
        let words = FULL_WORDS.get(series.first.into()..series.end.into()).unwrap_or(&[]);
        for word in words {
            value = P::Raw::from_u32(*word).sub(x.multiply_high(value));
        }
        return value;
    }
    let mut index = series.first;
    while index != series.end {
        let coefficient = word::<P, C>(WORDS_AT + P::WORD_BYTES * usize::from(index));
        value = coefficient.sub(x.multiply_high(value));
        index = index.wrapping_add(1);
    }
    value
}
