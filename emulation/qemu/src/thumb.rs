//! Decoder of Thumb-2 loads and stores (ARMv7-M Architecture Reference Manual, DDI 0403, A5 and
//! A7.7), for an instruction that was stopped before its access.

use bittybuzz_chips::Width;

use crate::registers::CoreRegisters;

/// An access to memory that is not yet done.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Access {
    /// True for a load from memory to registers, false for a store.
    pub load: bool,
    /// Size of each element.
    pub width: Width,
    /// True if a loaded element is sign-extended.
    pub signed: bool,
    /// Address of the first element; the others follow.
    pub address: u32,
    /// Numbers of the registers, one per element.
    pub registers: Vec<u8>,
    /// The base register and its new value, if the instruction writes it back.
    pub writeback: Option<(u8, u32)>,
    /// The register that a store-exclusive sets to 0 when it succeeds.
    pub status: Option<u8>,
    /// Length of the instruction in bytes.
    pub length: u32,
}

/// A reason why the bridge cannot execute an instruction in the core's place.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum DecodeError {
    /// VLDR, VSTR and the like.
    #[error("a floating-point load or store; peripherals are accessed with the core's registers")]
    FloatingPoint,
    /// A load of the program counter.
    #[error("a load of the program counter")]
    Jump,
    /// Not a load or store that this bridge knows.
    #[error("no load or store")]
    Other,
}

const SP: u8 = CoreRegisters::SP;
const PC: u8 = CoreRegisters::PC;

/// Returns the access of the instruction with the half-words `first` and `second`, for these values
/// of registers. `second` is ignored for a 16-bit instruction.
pub fn decode(first: u16, second: u16, registers: &CoreRegisters) -> Result<Access, DecodeError> {
    let access = match first >> 11 {
        0b11101..=0b11111 => decode_32(first, second, registers)?,
        _ => decode_16(first, registers)?,
    };
    if access.load && access.registers.contains(&PC) {
        return Err(DecodeError::Jump);
    }
    Ok(access)
}

impl Access {
    fn single(load: bool, width: Width, register: u8, address: u32, length: u32) -> Self {
        Access {
            load,
            width,
            signed: false,
            address,
            registers: vec![register],
            writeback: None,
            status: None,
            length,
        }
    }

    /// Returns the value of a register after `raw` was loaded into it.
    pub fn extended(&self, raw: u32) -> u32 {
        match (self.width, self.signed) {
            (Width::Byte, false) => raw & 0xff,
            (Width::Byte, true) => raw as u8 as i8 as u32,
            (Width::Half, false) => raw & 0xffff,
            (Width::Half, true) => raw as u16 as i16 as u32,
            (Width::Word, _) => raw,
        }
    }

    /// Returns the distance in bytes between two elements.
    pub fn stride(&self) -> u32 {
        match self.width {
            Width::Byte => 1,
            Width::Half => 2,
            Width::Word => 4,
        }
    }
}

/// Returns `count` bits of `word` from bit `low` on.
fn bits(word: u16, low: u32, count: u32) -> u32 {
    u32::from(word) >> low & ((1 << count) - 1)
}

fn bit(word: u16, position: u32) -> bool {
    bits(word, position, 1) != 0
}

/// Returns the register number in the four bits from bit `low` on.
fn register(word: u16, low: u32) -> u8 {
    bits(word, low, 4) as u8
}

/// Decodes 16-bit instructions: A5.2.4, and load and store multiple of A5.2.
fn decode_16(op: u16, registers: &CoreRegisters) -> Result<Access, DecodeError> {
    let value = |number: u32| registers.r[number as usize];
    let low = |position: u32| bits(op, position, 3);
    let (rt, rn) = (low(0) as u8, value(low(3)));
    let load = bit(op, 11);
    let immediate = bits(op, 6, 5);
    Ok(match op >> 12 {
        0b0101 => {
            use Width::{Byte, Half, Word};
            // opB of table A5-6.
            let (load, width, signed) = match bits(op, 9, 3) {
                0b000 => (false, Word, false),
                0b001 => (false, Half, false),
                0b010 => (false, Byte, false),
                0b011 => (true, Byte, true),
                0b100 => (true, Word, false),
                0b101 => (true, Half, false),
                0b110 => (true, Byte, false),
                _ => (true, Half, true),
            };
            let address = rn.wrapping_add(value(low(6)));
            Access { signed, ..Access::single(load, width, rt, address, 2) }
        }
        0b0110 => Access::single(load, Width::Word, rt, rn.wrapping_add(4 * immediate), 2),
        0b0111 => Access::single(load, Width::Byte, rt, rn.wrapping_add(immediate), 2),
        0b1000 => Access::single(load, Width::Half, rt, rn.wrapping_add(2 * immediate), 2),
        0b1001 => {
            let address = registers.sp().wrapping_add(4 * bits(op, 0, 8));
            Access::single(load, Width::Word, low(8) as u8, address, 2)
        }
        // PUSH and POP; bit 8 is the link register or the program counter.
        0b1011 if bits(op, 9, 2) == 0b10 => {
            let extra = if load { 15 } else { 14 };
            let list = op & 0xff | u16::from(bit(op, 8)) << extra;
            multiple(load, SP, list, true, !load, registers, 2)
        }
        0b1100 => {
            let base = low(8) as u8;
            let list = op & 0xff;
            let writeback = !load || list >> base & 1 == 0;
            multiple(load, base, list, writeback, false, registers, 2)
        }
        _ => return Err(DecodeError::Other),
    })
}

/// Decodes 32-bit instructions: A5.3.5 to A5.3.10.
fn decode_32(first: u16, second: u16, registers: &CoreRegisters) -> Result<Access, DecodeError> {
    match first >> 9 {
        0b1110100 if !bit(first, 6) => {
            let down = match bits(first, 7, 2) {
                0b01 => false,
                0b10 => true,
                _ => return Err(DecodeError::Other),
            };
            let (load, base) = (bit(first, 4), register(first, 0));
            Ok(multiple(load, base, second, bit(first, 5), down, registers, 4))
        }
        0b1110100 if bit(first, 8) || bit(first, 5) => Ok(dual(first, second, registers)),
        0b1110100 => exclusive(first, second, registers),
        0b1110110 => Err(DecodeError::FloatingPoint),
        0b1111100 => single(first, second, registers),
        _ => Err(DecodeError::Other),
    }
}

/// Returns the access of LDM and STM: the lowest register is at the lowest address.
fn multiple(
    load: bool,
    base: u8,
    list: u16,
    writeback: bool,
    down: bool,
    registers: &CoreRegisters,
    length: u32,
) -> Access {
    let start = registers.r[usize::from(base)];
    let size = 4 * list.count_ones();
    let lowest = if down { start.wrapping_sub(size) } else { start };
    let end = if down { lowest } else { start.wrapping_add(size) };
    Access {
        registers: (0..16).filter(|number| list >> number & 1 != 0).collect(),
        writeback: writeback.then_some((base, end)),
        ..Access::single(load, Width::Word, 0, lowest, length)
    }
}

/// Returns the address of the access, and the base register's new value. `pre` and `up` are the
/// bits `P` and `U` of A7.7.
fn indexed(base: u8, offset: u32, pre: bool, up: bool, registers: &CoreRegisters) -> (u32, u32) {
    let start = match base {
        PC => registers.pc().wrapping_add(4) & !3,
        _ => registers.r[usize::from(base)],
    };
    let moved = if up { start.wrapping_add(offset) } else { start.wrapping_sub(offset) };
    (if pre { moved } else { start }, moved)
}

/// LDRD and STRD.
fn dual(first: u16, second: u16, registers: &CoreRegisters) -> Access {
    let base = register(first, 0);
    let offset = 4 * bits(second, 0, 8);
    let (address, moved) = indexed(base, offset, bit(first, 8), bit(first, 7), registers);
    Access {
        registers: vec![register(second, 12), register(second, 8)],
        writeback: bit(first, 5).then_some((base, moved)),
        ..Access::single(bit(first, 4), Width::Word, 0, address, 4)
    }
}

/// Returns the access of LDREX and STREX. No other master accesses a peripheral, so the store
/// always succeeds.
fn exclusive(first: u16, second: u16, registers: &CoreRegisters) -> Result<Access, DecodeError> {
    let base = registers.r[usize::from(register(first, 0))];
    let (load, rt) = (bit(first, 4), register(second, 12));
    let (width, address, status) = match (bits(first, 7, 2), bits(second, 4, 4)) {
        (0b00, _) => (Width::Word, base.wrapping_add(4 * bits(second, 0, 8)), register(second, 8)),
        (0b01, 0b0100) => (Width::Byte, base, register(second, 0)),
        (0b01, 0b0101) => (Width::Half, base, register(second, 0)),
        _ => return Err(DecodeError::Other),
    };
    let status = (!load).then_some(status);
    Ok(Access { status, ..Access::single(load, width, rt, address, 4) })
}

/// LDR, STR and their byte and half-word forms.
fn single(first: u16, second: u16, registers: &CoreRegisters) -> Result<Access, DecodeError> {
    let width = match bits(first, 5, 2) {
        0b00 => Width::Byte,
        0b01 => Width::Half,
        0b10 => Width::Word,
        _ => return Err(DecodeError::Other),
    };
    let (signed, load) = (bit(first, 8), bit(first, 4));
    if signed && !load {
        return Err(DecodeError::Other);
    }
    let base = register(first, 0);
    let (address, moved, writeback) = if base == PC {
        let (address, moved) = indexed(base, bits(second, 0, 12), true, bit(first, 7), registers);
        (address, moved, false)
    } else if bit(first, 7) {
        let (address, moved) = indexed(base, bits(second, 0, 12), true, true, registers);
        (address, moved, false)
    } else if bit(second, 11) {
        let (pre, up, writeback) = (bit(second, 10), bit(second, 9), bit(second, 8));
        let (address, moved) = indexed(base, bits(second, 0, 8), pre, up, registers);
        (address, moved, writeback)
    } else if bits(second, 6, 5) == 0 {
        let offset = registers.r[usize::from(register(second, 0))] << bits(second, 4, 2);
        let (address, moved) = indexed(base, offset, true, true, registers);
        (address, moved, false)
    } else {
        return Err(DecodeError::Other);
    };
    Ok(Access {
        signed,
        writeback: writeback.then_some((base, moved)),
        ..Access::single(load, width, register(second, 12), address, 4)
    })
}

#[cfg(test)]
#[path = "thumb_tests.rs"]
mod tests;
