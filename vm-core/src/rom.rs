//! The facts from the tables of instructions and built-ins that the verifier and calls need, as
//! bytes that a chip may keep in flash.
//!
//! On the AVR every table of a Rust program is copied to RAM. Therefore the machine reads these
//! bytes through [`ByteCode::rom`], which the firmware there implements by `lpm` over a copy of
//! [`TINY`] in flash.

use crate::builtin::{self, BuiltinKind};
use crate::bytecode::ByteCode;
use crate::number::tables;
use crate::number::{Full, Profile, Tiny};
use crate::opcode::{self, Trailer};

/// The first byte that is an opcode.
const FIRST: u8 = opcode::TABLE[0].byte;

/// The offset of the built-ins, which take a byte each. Before them lie two bytes for each plain
/// and narrow opcode from [`FIRST`] on.
const BUILTINS_AT: usize = 2 * (0x80 - FIRST as usize);

/// The offset of the constants of the mathematical functions.
pub(crate) const MATHS_AT: usize = BUILTINS_AT + builtin::TABLE.len();

/// The tables, with the constants of the tiny profile.
pub const TINY: [u8; MATHS_AT + tables::TINY.len()] = bytes(&tables::TINY, Tiny::WORD_BYTES);

/// The tables of a machine of the tiny profile without [`Part::Maths`](crate::Part::Maths).
pub const TINY_WITHOUT_MATHS: [u8; MATHS_AT] = bytes(&[], Tiny::WORD_BYTES);

/// The tables, with the constants of the full profile.
pub const FULL: [u8; MATHS_AT + tables::FULL.len()] = bytes(&tables::FULL, Full::WORD_BYTES);

/// The tables of a machine of the full profile without [`Part::Maths`](crate::Part::Maths).
pub const FULL_WITHOUT_MATHS: [u8; MATHS_AT] = bytes(&[], Full::WORD_BYTES);

// The first byte of an opcode is the number of its operand with these bits; it is 0 for a byte that
// is no opcode.
const KNOWN: u8 = 1 << 7;
/// The instruction never continues with the next one.
const LEAVES: u8 = 1 << 6;
/// The trailer is [`Trailer::CallArguments`].
const ARGUMENTS: u8 = 1 << 5;
const OPERAND: u8 = 0x0f;
// The second byte of an opcode is pops << 5 | pushes << 3 | length of the trailer.
const PUSHES: u8 = 3;
const TRAILER: u8 = 7;
// The byte of a built-in is its bit of [`Feature`](builtin::Feature) with these bits.
const CALLS: u8 = 1 << 6;
const VALUE: u8 = 1 << 7;
/// The first argument of the built-in is the object from which it was read.
const METHOD: u8 = 1 << 5;

/// Returns the offset of an opcode's two bytes.
const fn row_of(opcode: u8) -> usize {
    // The result is computed as a byte, so that reading at this offset needs no check.
    opcode.wrapping_sub(FIRST).wrapping_mul(2) as usize
}

const fn bytes<const LENGTH: usize>(maths: &[u8], word_bytes: usize) -> [u8; LENGTH] {
    let mut bytes = [0; LENGTH];
    let mut row = 0;
    while row < opcode::TABLE.len() {
        let info = opcode::TABLE[row];
        let at = row_of(info.byte);
        let leaves = match info.byte {
            opcode::JUMP | opcode::RETURN | opcode::RETURN_NIL => LEAVES,
            _ => 0,
        };
        let arguments = match info.trailer {
            Trailer::Arguments => ARGUMENTS,
            _ => 0,
        };
        let length = info.trailer.length(word_bytes) as u8;
        bytes[at] = KNOWN | leaves | arguments | info.operand as u8;
        bytes[at + 1] = info.pops << 5 | info.pushes << 3 | length;
        row += 1;
    }
    let mut row = 0;
    while row < builtin::TABLE.len() {
        let info = builtin::TABLE[row];
        let method = match info.kind {
            BuiltinKind::Plain | BuiltinKind::Calls if info.library.is_object() => METHOD,
            _ => 0,
        };
        bytes[BUILTINS_AT + row] = kind_bits(info.kind) | method | info.feature as u8;
        row += 1;
    }
    let mut at = 0;
    while at < maths.len() {
        bytes[MATHS_AT + at] = maths[at];
        at += 1;
    }
    bytes
}

const fn kind_bits(kind: BuiltinKind) -> u8 {
    match kind {
        BuiltinKind::Plain => 0,
        BuiltinKind::Calls => CALLS,
        BuiltinKind::Value => VALUE,
    }
}

/// The facts about an instruction that the verifier needs.
#[derive(Clone, Copy)]
pub(crate) struct Effect(u8, u8);

impl Effect {
    /// Returns the facts of a plain or narrow opcode; for other bytes only
    /// [`is_known`](Effect::is_known) is meaningful.
    pub(crate) fn of<P: Profile, C: ByteCode>(opcode: u8) -> Effect {
        let at = row_of(opcode);
        Effect(C::rom::<P>(at), C::rom::<P>(at + 1))
    }

    /// Returns true if there is such an opcode. Bytes below [`FIRST`] have no row, so their effect
    /// is arbitrary.
    pub(crate) fn is_known(self, opcode: u8) -> bool {
        opcode >= FIRST && self.0 & KNOWN != 0
    }

    /// Returns the number of its [`Operand`](opcode::Operand).
    pub(crate) fn operand(self) -> u8 {
        self.0 & OPERAND
    }

    /// Returns a number that is not zero if the instruction never continues with the next one.
    pub(crate) fn leaves(self) -> u8 {
        self.0 & LEAVES
    }

    /// Returns true if its trailer counts arguments.
    pub(crate) fn has_arguments(self) -> bool {
        self.0 & ARGUMENTS != 0
    }

    /// Returns the number of bytes of its trailer.
    pub(crate) fn trailer(self) -> usize {
        usize::from(self.1 & TRAILER)
    }

    /// Returns the number of values that it pops, as in the table of instructions.
    pub(crate) fn pops(self) -> u8 {
        self.1 >> 5
    }

    /// Returns the number of values that it pushes, as in the table of instructions.
    pub(crate) fn pushes(self) -> u8 {
        self.1 >> 3 & PUSHES
    }
}

/// The kind of a built-in: its bit of [`Feature`](builtin::Feature), and its behavior.
#[derive(Clone, Copy)]
pub(crate) struct BuiltinFlags(u8);

impl BuiltinFlags {
    /// Returns the flags of a built-in. For a number that is not in the table they are arbitrary.
    pub(crate) fn of<P: Profile, C: ByteCode>(number: u8) -> BuiltinFlags {
        BuiltinFlags(C::rom::<P>(BUILTINS_AT + usize::from(number)))
    }

    /// Restores the flags from [`BuiltinFlags::byte`].
    pub(crate) fn from_byte(byte: u8) -> BuiltinFlags {
        BuiltinFlags(byte)
    }

    /// Returns the flags as one byte.
    pub(crate) fn byte(self) -> u8 {
        self.0
    }

    /// Returns true if the built-in is of that kind.
    pub(crate) fn is(self, kind: BuiltinKind) -> bool {
        self.0 & (CALLS | VALUE) == kind_bits(kind)
    }

    /// Returns true if its first argument is the object from which it was read.
    pub(crate) fn is_method(self) -> bool {
        self.0 & METHOD != 0
    }

    /// Returns true if the feature that it needs is among these features.
    pub(crate) fn are_in(self, features: u8) -> bool {
        self.0 & !(CALLS | VALUE | METHOD | features) == 0
    }

    /// Returns true if it is a function, and the feature that it needs is among these features.
    pub(crate) fn is_function_in(self, features: u8) -> bool {
        self.0 & !(CALLS | METHOD | features) == 0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::builtin::Feature;

    type Code = &'static [u8];

    #[test]
    fn tables_read_back() {
        for byte in 0..0x80 {
            let effect = Effect::of::<Tiny, Code>(byte);
            let Some(info) = opcode::TABLE.iter().find(|info| info.byte == byte) else {
                assert!(!effect.is_known(byte), "{byte:#x}");
                continue;
            };
            assert!(effect.is_known(byte), "{}", info.name);
            assert_eq!(effect.operand(), info.operand as u8, "{}", info.name);
            assert_eq!((effect.pops(), effect.pushes()), (info.pops, info.pushes), "{}", info.name);
            let arguments = info.trailer == Trailer::Arguments;
            assert_eq!(effect.has_arguments(), arguments, "{}", info.name);
            assert_eq!(effect.trailer(), info.trailer.length(2), "{}", info.name);
            let in_full = Effect::of::<Full, Code>(byte);
            assert_eq!(in_full.trailer(), info.trailer.length(4), "{}", info.name);
        }
        for info in builtin::TABLE {
            let needs = BuiltinFlags::of::<Full, Code>(info.number);
            assert!(needs.is(info.kind), "{}", info.name);
            assert_eq!(needs.are_in(0), info.feature == Feature::Core, "{}", info.name);
            assert!(needs.are_in(info.feature as u8), "{}", info.name);
            let function = info.kind != BuiltinKind::Value;
            assert_eq!(needs.is_function_in(info.feature as u8), function, "{}", info.name);
            assert_eq!(needs.is_method(), function && info.library.is_object(), "{}", info.name);
            assert_eq!(needs.byte(), BuiltinFlags::from_byte(needs.byte()).byte());
        }
    }

    #[test]
    fn three_instructions_never_fall_through() {
        let leaves = |info: &&opcode::OpcodeInfo| Effect::of::<Tiny, Code>(info.byte).leaves() != 0;
        let leave = opcode::TABLE.iter().filter(leaves).map(|info| info.byte);
        assert!(leave.eq([opcode::RETURN, opcode::RETURN_NIL, opcode::JUMP]));
    }
}
