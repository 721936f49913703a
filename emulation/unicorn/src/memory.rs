//! Checks of addresses, and writes of the core to the flash.

use bittybuzz_chips::{Board, CoreKind};
use bittybuzz_emulation::{Control, Core, MachineError};
use unicorn_engine::RegisterARM as Register;

use crate::core::{FLASH, UnicornCore};
use crate::exception::Lockup;

pub fn is_within(address: u32, length: usize, start: u32, size: u32) -> bool {
    address.checked_sub(start).is_some_and(|at| at as usize + length <= size as usize)
}

impl<B: Board> UnicornCore<'_, B> {
    pub(crate) fn check_memory(address: u32, length: usize) -> Result<(), MachineError> {
        if B::MEMORY.is_ram(address, length) || is_within(address, length, FLASH, B::MEMORY.flash) {
            Ok(())
        } else {
            Err(MachineError::NoMemory { address, length })
        }
    }

    /// Returns true if the failed access was a write of a halfword to the flash by a 16-bit
    /// instruction.
    pub(crate) fn is_flash_write(&self) -> bool {
        let system = self.uc.get_data();
        system.failed_write.0 == 2
            && is_within(system.failed_address, 2, FLASH, B::MEMORY.flash)
            && B::CORE == CoreKind::CortexM0
    }
}

impl<B: Control> UnicornCore<'_, B> {
    /// Handles a write of a halfword to the flash; the flash interface decides about its effect.
    pub(crate) fn program_flash(&mut self) -> Result<Result<(), Lockup>, MachineError> {
        // The same block of code may have started an erasure.
        if let Some(change) = self.system().board.take_flash_change() {
            self.change_flash(change)?;
        }
        let address = self.system().failed_address;
        let mut old = [0; 2];
        self.read_bytes(address, &mut old)?;
        let system = self.system();
        let new = system.failed_write.1 as u16;
        let change = system.board.program(address, u16::from_le_bytes(old), new);
        if let Some(change) = change {
            self.change_flash(change)?;
        }
        let pc = self.register(Register::PC)?;
        self.set_register(Register::PC, (pc + 2) | 1)?;
        Ok(Ok(()))
    }
}
