//! The core's bus: flash, RAM, the core's own registers, and the board.

use bittybuzz_chips::{Board, CoreClock, FlashChange, FlashContent, Width};
use rp2040_emu::bus::ppb::Ppb;
use rp2040_emu::core::{CoreBus, Nvic};

use crate::private::Private;

pub const FLASH: u32 = 0x0800_0000;
pub const RAM: u32 = 0x2000_0000;
const PRIVATE: u32 = 0xe000_0000;

/// The memory and the board on the core's bus.
pub struct ChipBus<B> {
    pub board: B,
    pub flash: Vec<u8>,
    pub ram: Vec<u8>,
    pub private: Private,
    pub clock: CoreClock,
    /// Cycles that the core executed before the current instruction, without the cycles that it
    /// slept.
    pub cycles: u64,
    /// Number of the exception that is being handled; 0 for none.
    pub active: u32,
    /// Levels of the interrupt lines.
    lines: u32,
    /// True if the flash changed, so that the core's cache of decoded instructions may be wrong.
    pub flash_has_changed: bool,
    /// True after an access to the board or to the core's own registers, which may change the time
    /// of the next event.
    pub touched: bool,
    /// The event register, and true while the core waits.
    pub event: bool,
    pub waits: bool,
    fault: Option<u32>,
}

impl<B: Board> ChipBus<B> {
    /// Creates the bus of robot `number` of several, with an erased flash.
    pub fn new(number: usize) -> Self {
        let board = B::power_on(number);
        let clock = CoreClock::new(board.core_clock_hz());
        ChipBus {
            board,
            flash: vec![0xff; B::MEMORY.flash as usize],
            ram: vec![0; B::MEMORY.ram as usize],
            private: Private::new(),
            clock,
            cycles: 0,
            active: 0,
            lines: 0,
            flash_has_changed: false,
            touched: true,
            event: false,
            waits: false,
            fault: None,
        }
    }

    /// Advances the board to the core's time, and passes its interrupts to the core. A line makes
    /// its interrupt pending when the line rises, or while the line is high and the handler does
    /// not run.
    pub fn catch_up(&mut self) {
        self.board.advance(self.clock.time(self.cycles));
        self.look();
    }

    fn look(&mut self) {
        let lines = self.board.interrupts().bits() as u32;
        let running = (self.private.ppb.active >> 16) as u32;
        self.private.nvic.pending |= lines & !self.lines | lines & !running;
        self.lines = lines;
    }

    /// Returns true if an enabled interrupt is pending.
    pub fn any_pending(&self) -> bool {
        self.private.nvic.pending & self.private.nvic.enabled != 0
            || self.private.ppb.icsr & (1 << 28 | 1 << 26) != 0
    }

    /// Returns the `length` bytes of memory at `address`, if all of them are in one memory.
    pub fn memory(&mut self, address: u32, length: usize) -> Option<&mut [u8]> {
        let at = |start: u32| address.wrapping_sub(start) as usize;
        if at(RAM) < self.ram.len() {
            return self.ram.get_mut(at(RAM)..at(RAM) + length);
        }
        // The flash has an alias at 0.
        let at = if at(FLASH) < self.flash.len() { at(FLASH) } else { at(0) };
        if at < self.flash.len() { self.flash.get_mut(at..at + length) } else { None }
    }

    fn read(&mut self, address: u32, width: Width) -> u32 {
        if let Some(bytes) = self.memory(address, width.bytes() as usize) {
            return bytes.iter().rev().fold(0, |value, byte| value << 8 | u32::from(*byte));
        }
        if address >= PRIVATE {
            self.touched = true;
            return self.private.read(address & !3, self.active) >> ((address & 3) * 8);
        }
        if !B::MEMORY.is_readable(address) {
            self.fault = Some(address);
            return 0;
        }
        self.catch_up();
        let value = self.board.read(address, width);
        self.after_access();
        value
    }

    fn write(&mut self, address: u32, width: Width, value: u32) {
        let at = address.wrapping_sub(RAM) as usize;
        if let Some(bytes) =
            self.ram.get_mut(at..).and_then(|ram| ram.get_mut(..width.bytes() as usize))
        {
            bytes.copy_from_slice(&value.to_le_bytes()[..width.bytes() as usize]);
        } else if address >= PRIVATE {
            self.touched = true;
            let mask = match width {
                Width::Byte => 0xff,
                Width::Half => 0xffff,
                Width::Word => 0xffff_ffff,
            };
            let shift = (address & 3) * 8;
            self.private.write(address & !3, value << shift, mask << shift);
            self.look();
        } else if B::MEMORY.is_peripheral(address) {
            self.catch_up();
            self.board.write(address, width, value);
            self.after_access();
        } else if width == Width::Half && (address.wrapping_sub(FLASH) as usize) < self.flash.len()
        {
            self.program(address, value as u16);
        } else {
            self.fault = Some(address);
        }
    }

    /// Updates the clock and the interrupts after an access to the board, which may have changed
    /// them.
    fn after_access(&mut self) {
        self.touched = true;
        self.clock.set_hz(self.board.core_clock_hz(), self.cycles);
        self.look();
    }

    /// Programs a halfword of the flash; the flash interface determines the change.
    fn program(&mut self, address: u32, new: u16) {
        self.catch_up();
        let at = (address - FLASH) as usize;
        let old = u16::from_le_bytes([self.flash[at], self.flash[at + 1]]);
        if let Some(change) = self.board.program(address, old, new) {
            self.change_flash(change);
        }
        self.touched = true;
    }

    /// Applies a change of the flash; the core waits until it is complete.
    pub fn change_flash(&mut self, change: FlashChange) {
        let (value, length) = match change.content {
            FlashContent::Erased(bytes) => (vec![0xff; bytes as usize], bytes as usize),
            FlashContent::Halfword(value) => (value.to_le_bytes().to_vec(), 2),
        };
        if let Some(bytes) = self.memory(change.address, length) {
            bytes.copy_from_slice(&value);
            self.flash_has_changed = true;
        }
        let end = self.clock.time(self.cycles) + change.takes;
        self.clock.skip_to(end, self.cycles);
    }
}

/// The bus has one core, number 0.
impl<B: Board> CoreBus for ChipBus<B> {
    fn read8(&mut self, address: u32) -> u8 {
        self.read(address, Width::Byte) as u8
    }

    fn read16(&mut self, address: u32) -> u16 {
        self.read(address, Width::Half) as u16
    }

    fn read32(&mut self, address: u32) -> u32 {
        self.read(address, Width::Word)
    }

    fn write8(&mut self, address: u32, value: u8) {
        self.write(address, Width::Byte, value.into());
    }

    fn write16(&mut self, address: u32, value: u16) {
        self.write(address, Width::Half, value.into());
    }

    fn write32(&mut self, address: u32, value: u32) {
        self.write(address, Width::Word, value);
    }

    fn set_active_pc(&mut self, _pc: u32) {}

    fn bus_fault(&self) -> bool {
        self.fault.is_some()
    }

    fn bus_fault_addr(&self) -> u32 {
        self.fault.unwrap_or(0)
    }

    fn clear_bus_fault(&mut self) {
        self.fault = None;
    }

    fn ppb(&self, _core: usize) -> &Ppb {
        &self.private.ppb
    }

    fn ppb_mut(&mut self, _core: usize) -> &mut Ppb {
        &mut self.private.ppb
    }

    fn nvic(&self, _core: usize) -> &Nvic {
        &self.private.nvic
    }

    fn nvic_mut(&mut self, _core: usize) -> &mut Nvic {
        &mut self.private.nvic
    }

    fn active_core(&self) -> usize {
        0
    }

    fn event_flag(&self, _core: usize) -> bool {
        self.event
    }

    fn consume_event_flag(&mut self, _core: usize) -> bool {
        std::mem::take(&mut self.event)
    }

    fn set_wfe_waiting(&mut self, _core: usize, waits: bool) {
        self.waits = waits;
    }

    fn signal_sev(&mut self) {
        self.event = true;
    }
}
