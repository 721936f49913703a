//! What the mathematical functions keep in flash ([`crate::rom`]): programs of the [calculator](super::calculator), constants,
//! and the coefficients of polynomials.
//!
//! The polynomials are minimax approximations with relative errors of 2^-34 or less. Their coefficients alternate in sign.

use super::float::{Float, multiply_high};
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
    /// How many registers there are.
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

/// The instructions of the calculator: an operation, and in the low four bits its operand or what it does.
pub(super) mod instruction {
    use super::super::float::operation;

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
    /// X is multiplied by the value of a polynomial.
    pub const SERIES: u8 = 0x90;
    /// The next instruction is skipped unless the point is nearer to the axis of Y.
    pub const IF_STEEP: u8 = 0xA0;
    /// The next instruction is skipped unless the point is to the left of the axis of Y.
    pub const IF_LEFT: u8 = 0xA1;
    /// X becomes what an angle is beyond or lacks to a multiple of a quarter turn. The sign of its sine is kept.
    pub const TURN: u8 = 0xB0;
    /// The same of the angle and a quarter turn.
    pub const TURN_MORE: u8 = 0xB1;
    /// X becomes a number near 1, T the power of two by which it was multiplied; ends if X has no logarithm.
    pub const SPLIT: u8 = 0xC0;
    /// X becomes X to the power Y, and the program ends, or its magnitude. The sign of the power is kept.
    pub const POWER: u8 = 0xC1;
    /// The point (Y, X) is mirrored to where neither is negative. The sign of its angle is kept.
    pub const POINT: u8 = 0xD0;
    /// X gets the sign that was kept, at first plus.
    pub const SIGN: u8 = 0xD1;
    /// X becomes negative.
    pub const MINUS: u8 = 0xD2;
    /// X and Y are exchanged.
    pub const SWAP: u8 = 0xD3;
    /// Goes on at the program in the next byte.
    pub const JUMP: u8 = 0xE0;
    /// The same, and behind that byte when that program ends.
    pub const CALL: u8 = 0xE1;
    /// Ends the program.
    pub const END: u8 = 0xF0;
}

/// A polynomial: the places of its coefficients in [`WORDS`], the highest power first.
#[derive(Clone, Copy)]
pub(super) struct Series {
    first: u8,
    end: u8,
}

/// `sin(pi/2 * x) / 2x` in `x^2`, for x from 0 to 1.
pub(super) const SINE: Series = Series { first: 0, end: 6 };
/// `atan(x) / x` in `x^2`, for x from 0 to 1.
pub(super) const ARC_TANGENT: Series = Series { first: 6, end: 18 };
/// `2 atanh(x) / (4 x ln 2)` in [`LARGEST_SQUARE`] less `x^2`, for x from 0 to 1/3.
pub(super) const LOGARITHM: Series = Series { first: 18, end: 25 };
/// `1 / 9` as a fraction of 2^32, rounded up.
pub(super) const LARGEST_SQUARE: u32 = 0x1C71_C71D;
/// `(1 - 2^-x) / x` in `x`, for x from 0 to 1.
pub(super) const EXPONENTIAL: Series = Series { first: 25, end: 32 };

const WORDS: [u32; 32] = [
    // SINE
    0x0000_1CC3,
    0x0005_4040,
    0x0099_6889,
    0x0A33_5DFE,
    0x52AE_F394,
    0xC90F_DAA2,
    // ARC_TANGENT
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
    // LOGARITHM
    0x1433_7CC2,
    0x1D45_825E,
    0x211D_D807,
    0x2609_5C43,
    0x2F83_A0B4,
    0x46DD_CB7A,
    0xC000_0000,
    // EXPONENTIAL
    0x0000_B4FD,
    0x0009_A4D5,
    0x0057_027B,
    0x0276_293A,
    0x0E35_7957,
    0x3D7F_7AAA,
    0xB172_17EA,
];

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

/// The first 192 bits after the point of 2/pi, behind four bytes of zeros.
const TWO_OVER_PI_BITS: [u8; 28] = [
    0, 0, 0, 0, 0xA2, 0xF9, 0x83, 0x6E, 0x4E, 0x44, 0x15, 0x29, 0xFC, 0x27, 0x57, 0xD1, 0xF5, 0x34,
    0xDD, 0xC0, 0xDB, 0x62, 0x95, 0x99, 0x3C, 0x43, 0x90, 0x41,
];

/// The programs, with their places among each other.
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
        SIN = TURN, SERIES, SIGN, END;
        /// The cosine.
        COS = TURN_MORE, SERIES, SIGN, END;
        /// The tangent.
        TAN = STORE | R, CALL, COS, STORE | Y, LOAD | R, CALL, SIN, DIV | Y, END;
        /// The arc cosine.
        ACOS = CALL, LEG, JUMP, ATAN;
        /// The arc sine.
        ASIN = CALL, LEG, SWAP, JUMP, ATAN;
        /// The leg of a triangle with hypotenuse 1 and the other leg x, which becomes y.
        LEG = STORE | Y, ADD | ONE, STORE | R, LOAD | ONE, SUB | Y, MUL | R, ROOT, END;
        /// The angle of the point (y, x).
        ATAN = POINT, IF_STEEP, SWAP, DIV | Y, SERIES | 1, MINUS, IF_STEEP, ADD | HALF_PI, MINUS, IF_LEFT,
            ADD | PI, SIGN, END;
    }

    pub(in crate::number) const BYTES: &[u8] = PROGRAMS;

    /// Where the functions begin, in the order of [`crate::number::maths::Function`].
    pub(in crate::number) const STARTS: [u8; 12] =
        [SQRT, EXP, LN, LOG2, LOG10, SIN, COS, TAN, ASIN, ACOS, ATAN, RAISE];
}

const CONSTANTS_AT: usize = 4 * WORDS.len();
const TWO_OVER_PI_AT: usize = CONSTANTS_AT + 5 * CONSTANTS.len();
const STARTS_AT: usize = TWO_OVER_PI_AT + TWO_OVER_PI_BITS.len();
const PROGRAMS_AT: usize = STARTS_AT + program::STARTS.len();

/// All of it.
pub(crate) const BYTES: [u8; PROGRAMS_AT + program::BYTES.len()] = {
    let mut bytes = [0; PROGRAMS_AT + program::BYTES.len()];
    let mut at = 0;
    while at < bytes.len() {
        bytes[at] = if at < CONSTANTS_AT {
            WORDS[at / 4].to_be_bytes()[at % 4]
        } else if at < TWO_OVER_PI_AT {
            let (significand, exponent) = CONSTANTS[(at - CONSTANTS_AT) / 5];
            let byte = (at - CONSTANTS_AT) % 5;
            if byte == 4 { exponent as u8 } else { significand.to_be_bytes()[byte] }
        } else if at < STARTS_AT {
            TWO_OVER_PI_BITS[at - TWO_OVER_PI_AT]
        } else if at < PROGRAMS_AT {
            program::STARTS[at - STARTS_AT]
        } else {
            program::BYTES[at - PROGRAMS_AT]
        };
        at += 1;
    }
    bytes
};

#[inline(never)]
fn word<C: ByteCode>(at: usize) -> u32 {
    let mut word = 0;
    for byte in 0..4 {
        word = word << 8 | u32::from(C::rom(rom::MATHS_AT + at + byte));
    }
    word
}

/// The word of 2/pi that begins with that byte; the first 32 bits are before the point.
pub(super) fn two_over_pi<C: ByteCode>(byte: u8) -> u32 {
    word::<C>(TWO_OVER_PI_AT + usize::from(byte))
}

/// A constant, by its number as an operand.
#[inline(never)]
pub(super) fn constant<C: ByteCode>(number: u8) -> Float {
    let at = CONSTANTS_AT + 5 * usize::from(number.wrapping_sub(operand::REGISTERS));
    Float::new(word::<C>(at), i16::from(C::rom(rom::MATHS_AT + at + 4) as i8))
}

/// Where a function of [`super::maths::Function`] begins.
pub(super) fn start<C: ByteCode>(function: u8) -> u8 {
    C::rom(rom::MATHS_AT + STARTS_AT + usize::from(function))
}

/// A byte of the programs.
pub(super) fn instruction_at<C: ByteCode>(at: u8) -> u8 {
    C::rom(rom::MATHS_AT + PROGRAMS_AT + usize::from(at))
}

/// The value of a polynomial.
#[inline(never)]
pub(super) fn evaluate<C: ByteCode>(series: Series, x: u32) -> u32 {
    let mut value = 0;
    for index in series.first..series.end {
        value = word::<C>(4 * usize::from(index)).wrapping_sub(multiply_high(x, value));
    }
    value
}
