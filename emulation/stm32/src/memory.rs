//! Which memory there is, and who writes to it beside the core: the flash interface and the DMA controller.

use bittybuzz_chips::{Board, CoreKind, FlashChange, FlashContent, Transfer};
use bittybuzz_emulation::MachineError;
use unicorn_engine::RegisterARM as Register;

use crate::core::{CCM, Core, FLASH, SRAM};
use crate::exception::Lockup;

pub fn is_within(address: u32, length: usize, start: u32, size: u32) -> bool {
    address.checked_sub(start).is_some_and(|at| at as usize + length <= size as usize)
}

impl<B: Board> Core<'_, B> {
    /// Whether `length` bytes from `address` on are RAM.
    pub fn is_ram(address: u32, length: usize) -> bool {
        is_within(address, length, SRAM, B::MEMORY.ram)
            || is_within(address, length, CCM, B::MEMORY.ccm)
    }

    pub fn check_memory(address: u32, length: usize) -> Result<(), MachineError> {
        if Self::is_ram(address, length) || is_within(address, length, FLASH, B::MEMORY.flash) {
            Ok(())
        } else {
            Err(MachineError::NoMemory { address, length })
        }
    }

    /// Whether the access that failed was a write of a halfword to the flash, by an instruction of 16 bits.
    pub fn is_flash_write(&self) -> bool {
        let system = self.uc.get_data();
        system.failed_write.0 == 2
            && is_within(system.failed_address, 2, FLASH, B::MEMORY.flash)
            && B::CORE == CoreKind::CortexM0
    }

    /// The core has written a halfword to the flash: the flash interface decides what becomes of it.
    pub fn program_flash(&mut self) -> Result<Result<(), Lockup>, MachineError> {
        // An erasure that the same block of code has begun.
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

    /// The flash changes, and the core waits.
    pub fn change_flash(&mut self, change: FlashChange) -> Result<(), MachineError> {
        match change.content {
            FlashContent::Erased(bytes) => {
                self.write_bytes(change.address, &vec![0xff; bytes as usize])?;
            }
            FlashContent::Halfword(value) => {
                self.write_bytes(change.address, &value.to_le_bytes())?;
            }
        }
        let system = self.system();
        let cycles = system.cycles;
        let end = system.now() + change.takes;
        system.clock.skip_to(end, cycles);
        Ok(())
    }

    /// Moves a data item for the DMA controller. Where there is no memory it reads 0 and loses what it writes.
    pub fn transfer(&mut self, transfer: Transfer) -> Result<(), MachineError> {
        let (from, from_width) = transfer.from;
        let (to, to_width) = transfer.to;
        let mut bytes = [0; 4];
        let length = from_width.bytes() as usize;
        if Self::check_memory(from, length).is_ok() {
            self.read_bytes(from, &mut bytes[..length])?;
        } else {
            bytes = self.system().board.read(from, from_width).to_le_bytes();
        }
        let length = to_width.bytes() as usize;
        if Self::is_ram(to, length) {
            self.write_bytes(to, &bytes[..length])
        } else {
            self.system().board.write(to, to_width, u32::from_le_bytes(bytes));
            Ok(())
        }
    }
}
