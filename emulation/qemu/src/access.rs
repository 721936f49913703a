//! The execution of a trapped load or store in the core's place, with the board's registers.

use bittybuzz_chips::{Board, Width};
use bittybuzz_cortex_m::registers::{AIRCR, VTOR, requests_reset};

use crate::core::{CoreError, QemuProcessor};
use crate::memory::{CCM, FLASH, MemoryLayout, SRAM};
use crate::thumb::{self, DecodeError};

/// The address ranges of the board: the peripherals, and the area with the one-time programmable
/// bytes, the system memory and the unique id, whose addresses differ between chips.
const PERIPHERALS: Region = Region { start: 0x4000_0000, length: 0x2000_0000 };
const SYSTEM_MEMORY: Region = Region { start: 0x1fff_7000, length: 0x9000 };
/// SysTick's registers (ARMv7-M manual, B3.3.2).
const SYSTICK: Region = Region { start: 0xe000_e010, length: 0x10 };

/// The result of an access.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AccessOutcome {
    /// The access is done.
    Done,
    /// The access is done, and resets the chip (AIRCR.SYSRESETREQ).
    SystemReset,
    /// The access was to SysTick: a read gives 0, a write is lost.
    SysTick,
}

/// A reason why an access cannot be done.
#[derive(Debug, thiserror::Error)]
pub enum AccessError {
    /// The core failed.
    #[error(transparent)]
    Core(#[from] CoreError),
    /// The instruction is not one that a driver uses for a peripheral.
    #[error("the instruction at {pc:#010x} accesses a peripheral, but is {source}")]
    Instruction {
        /// The program counter.
        pc: u32,
        /// The decoder's error.
        source: DecodeError,
    },
    /// The access is not aligned, or only a part of it is to a trapped address.
    #[error(
        "the instruction at {pc:#010x} accesses {address:#010x} in a way that no peripheral allows"
    )]
    Address {
        /// The program counter.
        pc: u32,
        /// The accessed address.
        address: u32,
    },
}

struct Region {
    start: u32,
    length: u32,
}

impl Region {
    fn contains(&self, address: u32) -> bool {
        address.wrapping_sub(self.start) < self.length
    }
}

/// Makes `core` stop before accesses that QEMU must not execute itself.
pub fn trap(core: &mut QemuProcessor) -> Result<(), CoreError> {
    for region in [PERIPHERALS, SYSTEM_MEMORY, SYSTICK] {
        core.trap_accesses(region.start, region.length)?;
    }
    if core.layout() == MemoryLayout::CcmBehindSram {
        core.trap_accesses(CCM.start, CCM.end - CCM.start)?;
    }
    core.trap_writes(VTOR, AIRCR + 4 - VTOR)
}

/// Executes the load or store before which `core` stopped, an instruction in `flash` or in RAM.
pub fn perform(
    core: &mut QemuProcessor,
    board: &mut impl Board,
    flash: &[u8],
) -> Result<AccessOutcome, AccessError> {
    let before = core.next.clone();
    let pc = before.pc();
    let [first, second] = instruction(core, flash, pc)?;
    let access = thumb::decode(first, second, &before)
        .map_err(|source| AccessError::Instruction { pc, source })?;
    core.next.skip_instruction(access.length);
    if let Some((base, value)) = access.writeback {
        core.next.r[usize::from(base)] = value;
    }
    let mut outcome = AccessOutcome::Done;
    for (index, &register) in access.registers.iter().enumerate() {
        let address = access.address.wrapping_add(access.stride() * index as u32);
        let mut bus = AccessElement { core, board, pc, address, width: access.width };
        let register = usize::from(register);
        if access.load {
            let (value, what) = bus.load()?;
            core.next.r[register] = access.extended(value);
            outcome = what;
        } else {
            outcome = bus.store(before.r[register])?;
        }
    }
    if let Some(status) = access.status {
        core.next.r[usize::from(status)] = 0;
    }
    Ok(outcome)
}

/// Returns the half-word at `pc` and the one after it, which is 0 at the end of a memory.
fn instruction(core: &mut QemuProcessor, flash: &[u8], pc: u32) -> Result<[u16; 2], CoreError> {
    let mut code = [0; 4];
    match flash.get(pc.wrapping_sub(FLASH.start) as usize..) {
        Some(rest) => code.iter_mut().zip(rest).for_each(|(to, from)| *to = *from),
        None => {
            if !core.read_memory(pc, &mut code)? {
                core.read_memory(pc, &mut code[..2])?;
            }
        }
    }
    Ok([[code[0], code[1]], [code[2], code[3]]].map(u16::from_le_bytes))
}

/// Returns true for RAM: either QEMU has it at another address, or it is the untrapped part of an
/// access, such as several registers stored across the start of the RAM.
fn is_memory(address: u32) -> bool {
    CCM.contains(&address) || SRAM.contains(&address)
}

/// One element of an access.
struct AccessElement<'a, B> {
    core: &'a mut QemuProcessor,
    board: &'a mut B,
    pc: u32,
    address: u32,
    width: Width,
}

impl<B: Board> AccessElement<'_, B> {
    fn load(&mut self) -> Result<(u32, AccessOutcome), AccessError> {
        let address = self.address;
        if is_memory(address) {
            let mut bytes = [0; 4];
            let place = self.core.layout().relocate(address);
            self.core.read_memory(place, &mut bytes[..self.length()])?;
            return Ok((u32::from_le_bytes(bytes), AccessOutcome::Done));
        }
        self.check_alignment()?;
        if PERIPHERALS.contains(address) || SYSTEM_MEMORY.contains(address) {
            Ok((self.board.read(address, self.width), AccessOutcome::Done))
        } else if SYSTICK.contains(address) {
            Ok((0, AccessOutcome::SysTick))
        } else {
            Err(AccessError::Address { pc: self.pc, address })
        }
    }

    fn store(&mut self, value: u32) -> Result<AccessOutcome, AccessError> {
        let address = self.address;
        if is_memory(address) {
            let place = self.core.layout().relocate(address);
            self.core.write_memory(place, &value.to_le_bytes()[..self.length()])?;
            return Ok(AccessOutcome::Done);
        }
        self.check_alignment()?;
        if PERIPHERALS.contains(address) || SYSTEM_MEMORY.contains(address) {
            self.board.write(address, self.width, value);
        } else if SYSTICK.contains(address) {
            return Ok(AccessOutcome::SysTick);
        } else if address == VTOR && self.width == Width::Word {
            self.core.set_vector_table(value)?;
        } else if address == AIRCR && self.width == Width::Word {
            if requests_reset(value) {
                return Ok(AccessOutcome::SystemReset);
            }
            self.core.write_register(AIRCR, value);
        } else {
            return Err(AccessError::Address { pc: self.pc, address });
        }
        Ok(AccessOutcome::Done)
    }

    fn length(&self) -> usize {
        match self.width {
            Width::Byte => 1,
            Width::Half => 2,
            Width::Word => 4,
        }
    }

    fn check_alignment(&self) -> Result<(), AccessError> {
        match self.address as usize % self.length() {
            0 => Ok(()),
            _ => Err(AccessError::Address { pc: self.pc, address: self.address }),
        }
    }
}
