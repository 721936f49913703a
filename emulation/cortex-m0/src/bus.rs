//! The core's address space: flash, RAM, its own registers, and the board.

use bittybuzz_chips::{Board, CoreClock, CoreKind, FlashChange, FlashContent, Time, Width};
use bittybuzz_cortex_m::Nvic;
use bittybuzz_cortex_m::registers::{
    AIRCR, CCR, CPUID, ICSR, NVIC, NVIC_END, SCR, SHPR2, SHPR3, SYST, SYST_END, VECTKEY_READ,
    cpuid, requests_reset,
};

use crate::code::FlashCode;
use crate::decode::{Op, Operation, decode};
use crate::ram;

pub const FLASH: u32 = 0x0800_0000;
pub const RAM: u32 = 0x2000_0000;
const PRIVATE: u32 = 0xe000_0000;

/// CCR: STKALIGN and UNALIGN_TRP are always on.
const CCR_VALUE: u32 = 1 << 9 | 1 << 3;
/// The memory, the board, and the interrupt controller.
pub struct Bus<B> {
    pub board: B,
    pub flash: Vec<u8>,
    /// The decoded instructions of the flash.
    pub code: FlashCode,
    pub flash_has_changed: bool,
    pub ram: Vec<u8>,
    pub nvic: Nvic,
    pub clock: CoreClock,
    /// The core's cycles since power-on, without those asleep.
    pub cycles: u64,
    /// No instruction begins at or after this cycle.
    pub deadline: u64,
    /// The event register, which wakes a core that waits in WFE.
    pub event: bool,
    pub reset_requested: bool,
    pub systick_used: bool,
    pub scr: u32,
}

impl<B: Board> Bus<B> {
    /// Creates the bus of robot `number` of several, with erased flash.
    pub fn new(number: usize) -> Self {
        let board = B::power_on(number);
        let clock = CoreClock::new(board.core_clock_hz());
        Bus {
            board,
            flash: vec![0xff; B::MEMORY.flash as usize],
            code: FlashCode::new(B::MEMORY.flash),
            flash_has_changed: false,
            ram: vec![0; B::MEMORY.ram as usize],
            nvic: Nvic::new(CoreKind::CortexM0),
            clock,
            cycles: 0,
            deadline: 0,
            event: false,
            reset_requested: false,
            systick_used: false,
            scr: 0,
        }
    }

    pub fn now(&self) -> Time {
        self.clock.time(self.cycles)
    }

    /// Advances the board to the core's time and passes its interrupt lines to the core.
    pub fn catch_up(&mut self) {
        self.board.advance(self.now());
        self.nvic.set_lines(self.board.interrupts().bits());
    }

    /// Updates the core after an access, which may have changed clocks, raised interrupts or moved
    /// the next event to an earlier time.
    fn after_access(&mut self) {
        self.nvic.set_lines(self.board.interrupts().bits());
        let hz = self.board.core_clock_hz();
        if hz != self.clock.hz() {
            self.clock.set_hz(hz, self.cycles);
            self.deadline = 0;
        }
        if self.nvic.any_pending() || self.board.wants_memory() {
            self.deadline = 0;
        } else if let Some(next) = self.board.next_event() {
            self.deadline = self.deadline.min(self.clock.cycle(next));
        }
    }

    /// Returns the index in the flash of `length` bytes at `address`. The flash is also mapped at
    /// 0.
    fn flash_index(&self, address: u32, length: usize) -> Option<usize> {
        let at = address.wrapping_sub(FLASH) as usize;
        let at = if at < self.flash.len() { at } else { address as usize };
        (at + length <= self.flash.len()).then_some(at)
    }

    /// Returns `length` bytes at `address`, if all of them are in one memory.
    pub fn memory(&self, address: u32, length: usize) -> Option<&[u8]> {
        let at = address.wrapping_sub(RAM) as usize;
        if at < self.ram.len() {
            return self.ram.get(at..at.checked_add(length)?);
        }
        let at = self.flash_index(address, length)?;
        self.flash.get(at..at + length)
    }

    /// Writes to RAM or flash, as a debugger does.
    pub fn write_memory(&mut self, address: u32, bytes: &[u8]) -> Option<()> {
        let at = address.wrapping_sub(RAM) as usize;
        let place = if at < self.ram.len() {
            self.ram.get_mut(at..at.checked_add(bytes.len())?)
        } else {
            let at = self.flash_index(address, bytes.len())?;
            self.flash_has_changed = true;
            self.flash.get_mut(at..at + bytes.len())
        };
        place?.copy_from_slice(bytes);
        Some(())
    }

    /// Decodes the operation at `pc`, in any memory.
    pub fn decode_at(&self, pc: u32) -> Op {
        // Nothing is executed from peripherals and beyond (B3.1).
        let halfword = |address: u32| {
            let bytes = self.memory(address, 2).filter(|_| pc < 0x4000_0000)?;
            bytes.first_chunk().copied().map(u16::from_le_bytes)
        };
        match halfword(pc) {
            Some(first) => decode(first, halfword(pc.wrapping_add(2)).unwrap_or(0)),
            None => Op::UNDEFINED,
        }
    }

    /// Decodes the operation at `pc` in the flash. The result is valid until the flash changes,
    /// because literal loads are resolved, too.
    pub fn decode_in_flash(&self, pc: u32) -> Op {
        let op = self.decode_at(pc);
        if op.kind == Operation::LdrLiteral {
            let address = (pc.wrapping_add(4) & !3).wrapping_add(op.imm);
            let word = self.flash_index(address, 4).and_then(|at| self.flash[at..].first_chunk());
            if let Some(word) = word {
                return Op { kind: Operation::Constant, imm: u32::from_le_bytes(*word), ..op };
            }
        }
        op
    }

    pub fn read_word(&mut self, address: u32) -> Option<u32> {
        match ram::word(&self.ram, address) {
            Some(value) => Some(value),
            None => self.read(address, Width::Word),
        }
    }

    pub fn write_word(&mut self, address: u32, value: u32) -> Option<()> {
        match ram::set_word(&mut self.ram, address, value) {
            Some(()) => Some(()),
            None => self.write(address, Width::Word, value),
        }
    }

    /// Reads from anything but RAM: flash, core registers or the board.
    pub fn read(&mut self, address: u32, width: Width) -> Option<u32> {
        let length = width.bytes() as usize;
        if !address.is_multiple_of(width.bytes()) {
            return None;
        }
        if let Some(at) = self.flash_index(address, length) {
            let mut bytes = [0; 4];
            bytes[..length].copy_from_slice(&self.flash[at..at + length]);
            return Some(u32::from_le_bytes(bytes));
        }
        if address >= PRIVATE {
            return Some(self.read_private(address & !3) >> ((address & 3) * 8));
        }
        if !B::MEMORY.is_readable(address) {
            return None;
        }
        self.catch_up();
        let value = self.board.read(address, width);
        if self.board.reading_acts(address) {
            self.after_access();
        }
        Some(value)
    }

    /// Writes to anything but RAM: core registers, the board or the flash.
    pub fn write(&mut self, address: u32, width: Width, value: u32) -> Option<()> {
        if !address.is_multiple_of(width.bytes()) {
            return None;
        }
        if address >= PRIVATE {
            // The private registers accept writes of words only (B3.1.1).
            self.write_private(address & !3, value);
            self.deadline = 0;
        } else if B::MEMORY.is_peripheral(address) {
            self.catch_up();
            self.board.write(address, width, value);
            self.after_access();
        } else if width == Width::Half && address.wrapping_sub(FLASH) < B::MEMORY.flash {
            self.program(address, value as u16);
        } else {
            return None;
        }
        Some(())
    }

    /// Writes a halfword to the flash; the flash interface decides about its effect.
    fn program(&mut self, address: u32, new: u16) {
        self.catch_up();
        let at = (address - FLASH) as usize;
        let old = u16::from_le_bytes([self.flash[at], self.flash[at + 1]]);
        if let Some(change) = self.board.program(address, old, new) {
            self.change_flash(change);
        }
        self.deadline = 0;
    }

    /// Applies a change of the flash, during which the core waits.
    pub fn change_flash(&mut self, change: FlashChange) {
        match change.content {
            FlashContent::Erased(bytes) => {
                self.write_memory(change.address, &vec![0xff; bytes as usize]);
            }
            FlashContent::Halfword(value) => {
                self.write_memory(change.address, &value.to_le_bytes());
            }
        }
        let end = self.now() + change.takes;
        self.clock.skip_to(end, self.cycles);
    }

    fn read_private(&self, address: u32) -> u32 {
        match address {
            NVIC..NVIC_END => self.nvic.read(address - NVIC),
            CPUID => cpuid(CoreKind::CortexM0),
            ICSR => self.nvic.read_icsr(),
            AIRCR => VECTKEY_READ,
            SCR => self.scr,
            CCR => CCR_VALUE,
            SHPR2 => self.nvic.read_priorities(8),
            SHPR3 => self.nvic.read_priorities(12),
            _ => 0,
        }
    }

    fn write_private(&mut self, address: u32, value: u32) {
        match address {
            SYST..SYST_END => self.systick_used = true,
            NVIC..NVIC_END => self.nvic.write(address - NVIC, value, !0),
            ICSR => self.nvic.write_icsr(value),
            AIRCR => self.reset_requested |= requests_reset(value),
            SCR => self.scr = value & 0x16,
            SHPR2 => self.nvic.write_priorities(8, value, !0),
            SHPR3 => self.nvic.write_priorities(12, value, !0),
            _ => {}
        }
    }
}
