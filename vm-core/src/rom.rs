//! What the verifier and the calls need of the tables of instructions and built-ins, as bytes that a chip may keep in flash.
//!
//! On the AVR every table of a Rust program is copied to RAM. So the machine reads these bytes through
//! [`ByteCode::rom`], which the firmware there implements by `lpm` over a copy of [`BYTES`] in flash.

use crate::builtin::{self, Feature, Kind};
use crate::bytecode::ByteCode;
use crate::opcode::{self, Operand, Trailer};

/// Two bytes for each of the 128 plain and narrow opcodes, then one for each built-in.
const BUILTINS_AT: usize = 256;

/// Length of [`BYTES`].
pub const LENGTH: usize = BUILTINS_AT + builtin::TABLE.len();

/// The tables.
pub const BYTES: [u8; LENGTH] = bytes();

/// First byte: operand, and this bit. Zero for a byte that is no opcode.
const KNOWN: u8 = 0x80;

const fn bytes() -> [u8; LENGTH] {
    let mut bytes = [0; LENGTH];
    let mut row = 0;
    while row < opcode::TABLE.len() {
        let info = opcode::TABLE[row];
        let at = 2 * info.byte as usize;
        bytes[at] = KNOWN | info.operand as u8;
        bytes[at + 1] = (info.trailer as u8) << 4 | info.pops << 2 | info.pushes;
        row += 1;
    }
    let mut row = 0;
    while row < builtin::TABLE.len() {
        let info = builtin::TABLE[row];
        // A feature is one bit or none: its number, counted from 1.
        let feature = match info.feature as u8 {
            0 => 0,
            bit => bit.trailing_zeros() as u8 + 1,
        };
        bytes[BUILTINS_AT + row] = (info.kind as u8) << 4 | feature;
        row += 1;
    }
    bytes
}

/// What the verifier needs of an instruction.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Effect {
    pub(crate) operand: Operand,
    pub(crate) trailer: Trailer,
    pub(crate) pops: u8,
    pub(crate) pushes: u8,
}

/// The effect of a plain or narrow opcode, `None` if there is none.
pub(crate) fn effect<C: ByteCode>(opcode: u8) -> Option<Effect> {
    let at = 2 * usize::from(opcode & 0x7f);
    let (first, second) = (C::rom(at), C::rom(at + 1));
    if first & KNOWN == 0 {
        return None;
    }
    Some(Effect {
        operand: Operand::numbered(first & !KNOWN),
        trailer: Trailer::numbered(second >> 4),
        pops: second >> 2 & 3,
        pushes: second & 3,
    })
}

/// What a built-in is: its bit of [`Feature`], and how it behaves.
#[derive(Clone, Copy)]
pub(crate) struct Needs(u8);

impl Needs {
    /// Those of a number that is in the table, or not.
    pub(crate) fn of<C: ByteCode>(number: u16) -> Option<Needs> {
        let number = usize::from(number);
        if number < builtin::TABLE.len() { Some(Needs(C::rom(BUILTINS_AT + number))) } else { None }
    }

    pub(crate) fn is(self, kind: Kind) -> bool {
        self.0 >> 4 == kind as u8
    }

    /// Whether it is among these features.
    pub(crate) fn is_in(self, features: u8) -> bool {
        let feature = self.0 & 0x0f;
        feature == Feature::Core as u8 || features >> (feature - 1) & 1 != 0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    type Code = &'static [u8];

    #[test]
    fn tables_read_back() {
        for byte in 0..0x80 {
            let info = opcode::TABLE.iter().find(|info| info.byte == byte);
            let expected = info.map(|info| Effect {
                operand: info.operand,
                trailer: info.trailer,
                pops: info.pops,
                pushes: info.pushes,
            });
            assert_eq!(effect::<Code>(byte), expected, "{byte:#x}");
        }
        for info in builtin::TABLE {
            let needs = Needs::of::<Code>(u16::from(info.number)).unwrap();
            assert!(needs.is(info.kind), "{}", info.name);
            assert_eq!(needs.is_in(0), info.feature == Feature::Core, "{}", info.name);
            assert!(needs.is_in(info.feature as u8), "{}", info.name);
        }
        assert!(Needs::of::<Code>(builtin::TABLE.len() as u16).is_none());
    }
}
