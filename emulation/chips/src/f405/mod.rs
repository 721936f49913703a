//! The STM32F405: its peripherals, their clocks and their interrupt lines.

mod rcc;
mod system;
mod usart;

use std::collections::BTreeMap;

use self::rcc::Rcc;
pub use self::system::OTP;
use self::system::{Backup, Flash, Identity, Power};
pub use self::usart::{SentByte, Usart};
use crate::stm32::watchdog::APB1_FREEZE;
use crate::stm32::{ErrorLog, Exti, GpioPort, Pin, PortReset, Timer, TimerKind, Watchdog, Write};
use crate::{HardwareError, Lines, ResetCause, Time, Width};

/// The first address and the interrupt of TIM2 to TIM5 (RM0090 tables 1 and 62).
const TIMERS: [(u32, u8); 4] =
    [(0x4000_0000, 28), (0x4000_0400, 29), (0x4000_0800, 30), (0x4000_0c00, 50)];
const RTC: u32 = 0x4000_2800;
const WATCHDOG: u32 = 0x4000_3000;
const POWER: u32 = 0x4000_7000;
const USART6: u32 = 0x4001_1400;
const USART6_IRQ: u8 = 71;
const SYSCFG: u32 = 0x4001_3800;
const EXTI: u32 = 0x4001_3c00;
const GPIO: u32 = 0x4002_0000;
const GPIO_LAST: u32 = 0x4002_2000;
const RCC: u32 = 0x4002_3800;
const FLASH: u32 = 0x4002_3c00;
const DEBUG: u32 = 0xe004_2000;
/// The interrupts of EXTI lines 0 to 15 (RM0090 table 62).
const EXTI_IRQ: [u8; 16] = [6, 7, 8, 9, 10, 23, 23, 23, 23, 23, 40, 40, 40, 40, 40, 40];
/// The modes of the ports after a reset. Only the pins of the debugger are not inputs (RM0090 8.4).
const PORTS: [PortReset; 9] = {
    let mut ports = [PortReset { moder: 0, ospeedr: 0, pupdr: 0 }; 9];
    ports[0] = PortReset { moder: 0xa800_0000, ospeedr: 0, pupdr: 0x6400_0000 };
    ports[1] = PortReset { moder: 0x0000_0280, ospeedr: 0x0000_00c0, pupdr: 0x0000_0100 };
    ports
};
/// The size of a peripheral's address range; each begins at a multiple of it.
const BLOCK: u32 = 0x400;

/// The chip without its core and its memory.
pub struct F405 {
    now: Time,
    rcc: Rcc,
    power: Power,
    backup: Backup,
    flash: Flash,
    /// Ports A to I.
    pub ports: [GpioPort; 9],
    exti: Exti,
    /// USART6, which is connected to the radio's processor.
    pub usart: Usart,
    /// TIM2 to TIM5.
    timers: [Timer; 4],
    watchdog: Watchdog,
    /// Frequency in Hz of the oscillator LSI, which clocks the watchdog.
    lsi_hz: u64,
    identity: Identity,
    /// Registers without a model: the value of every word that was written.
    storage: BTreeMap<u32, u32>,
    /// For each block, the first address used that has no model: a block without a model, or a
    /// register that a model does not know.
    pub unknown: BTreeMap<u32, u32>,
    errors: ErrorLog,
    lines: Lines,
}

impl F405 {
    /// Creates a chip at the moment of its power-on.
    pub fn new(unique_id: [u8; 12], device_type: &str, lsi_hz: u64) -> Self {
        let rcc = Rcc::new();
        let clocks = rcc.clocks();
        F405 {
            now: Time::ZERO,
            rcc,
            power: Power::new(),
            backup: Backup::new(),
            flash: Flash::new(),
            ports: PORTS.map(GpioPort::new),
            exti: Exti::new(EXTI_IRQ),
            usart: Usart::new(clocks.pclk2),
            timers: [TimerKind::Wide, TimerKind::General, TimerKind::General, TimerKind::Wide]
                .map(|kind| Timer::new(kind, clocks.timers1, Time::ZERO)),
            watchdog: Watchdog::new(lsi_hz),
            lsi_hz,
            identity: Identity::new(unique_id, device_type),
            storage: BTreeMap::new(),
            unknown: BTreeMap::new(),
            errors: ErrorLog::default(),
            lines: Lines::default(),
        }
    }

    /// Sets the properties that differ from chip to chip. A reset must follow.
    pub fn set_oscillators(&mut self, lsi_hz: u64, has_crystal: bool) {
        self.lsi_hz = lsi_hz;
        self.rcc.set_crystal(has_crystal);
    }

    /// Replaces the content of the one-time programmable bytes.
    pub fn set_otp(&mut self, content: &[u8]) {
        self.identity.set_otp(content);
    }

    /// Fills the backup registers, whose content after a power-on is undefined.
    pub fn fill_backup(&mut self, content: impl FnMut() -> u32) {
        self.backup.fill(content);
    }

    /// Resets the chip. The board continues to drive its pins.
    pub fn reset(&mut self, cause: ResetCause) {
        self.rcc.reset(cause);
        self.power = Power::new();
        self.flash = Flash::new();
        for port in &mut self.ports {
            port.reset();
        }
        self.exti = Exti::new(EXTI_IRQ);
        self.lines = Lines::default();
        self.usart.reset();
        self.watchdog = Watchdog::new(self.lsi_hz);
        self.storage.clear();
        let clocks = self.rcc.clocks();
        for timer in &mut self.timers {
            *timer = Timer::new(timer.kind(), clocks.timers1, self.now);
        }
        self.usart.set_clock(clocks.pclk2);
        self.pins_changed();
    }

    /// Advances time to `now`, which is not beyond the next event. Returns the byte that has left
    /// USART6 at this moment.
    pub fn advance(&mut self, now: Time) -> Option<SentByte> {
        self.now = now;
        let sent = self.usart.advance(now);
        for timer in &mut self.timers {
            if timer.next_event().is_some_and(|at| at <= now) {
                timer.advance(now);
            }
        }
        self.update_lines();
        // Bytes reach the line only if pin PC6 belongs to USART6.
        sent.filter(|_| self.ports[2].pin(6) == Pin::Alternate(8))
    }

    /// Returns the time of the next internal event.
    pub fn next_event(&self) -> Option<Time> {
        let timers = self.timers.iter().filter_map(Timer::next_event);
        timers.chain(self.usart.next_event()).chain(self.watchdog.expires()).min()
    }

    /// Returns true if the watchdog has expired. It then stands still until the reset that it
    /// requests.
    pub fn take_watchdog_expiry(&mut self) -> bool {
        self.watchdog.take_expiry(self.now)
    }

    /// Called when a debugger halts or resumes the core. DBGMCU can stop several peripherals; only
    /// the watchdog is modeled.
    pub fn set_halted(&mut self, halted: bool) {
        let freeze = self.storage.get(&(DEBUG + APB1_FREEZE)).copied().unwrap_or(0);
        self.watchdog.set_halted(halted, freeze, self.now);
    }

    /// Returns true once the firmware has started the watchdog.
    pub fn watchdog_runs(&self) -> bool {
        self.watchdog.expires().is_some()
    }

    /// Returns the levels of the interrupt lines.
    pub fn lines(&self) -> Lines {
        self.lines
    }

    /// Returns the frequencies of the core, of APB1 and of APB2 in Hz.
    pub fn clocks_hz(&self) -> [u64; 3] {
        let clocks = self.rcc.clocks();
        [clocks.hclk, clocks.pclk1, clocks.pclk2]
    }

    /// Returns the frequency of the core in Hz, as the RCC registers set it.
    pub fn core_clock_hz(&self) -> u64 {
        self.rcc.clocks().hclk
    }

    /// Returns timer `number`, 2 to 5.
    pub fn timer(&self, number: usize) -> &Timer {
        &self.timers[number - 2]
    }

    /// Returns the number of accesses to peripherals whose clock was off.
    pub fn accesses_without_clock(&self) -> u64 {
        self.errors.accesses_without_clock()
    }

    /// Returns the errors of the firmware since the last call.
    pub fn take_errors(&mut self) -> Vec<HardwareError> {
        self.errors.take()
    }

    /// Returns true if USART6 is connected to its receive pin PC7.
    pub fn listens(&self) -> bool {
        self.ports[2].pin(7) == Pin::Alternate(8)
    }

    /// Handles the begin of a byte at PC7.
    pub fn begin_byte(&mut self) {
        if self.listens() {
            self.usart.begin();
        }
    }

    /// Receives a byte that arrived at PC7.
    pub fn receive(&mut self, byte: u8, baud: u64) {
        if self.listens() {
            self.usart.receive(byte, baud, self.now);
            self.update_lines();
        }
    }

    /// Sets the time; nothing may be due until `now`.
    pub fn set_now(&mut self, now: Time) {
        self.now = now;
    }

    /// Drives a pin from the board.
    pub fn drive(&mut self, port: usize, pin: u8, high: bool) {
        self.ports[port].drive(pin, high);
        self.pins_changed();
    }

    fn pins_changed(&mut self) {
        self.exti.observe_ports(&self.ports);
        self.update_lines();
    }

    fn update_lines(&mut self) {
        for (timer, (_, irq)) in self.timers.iter().zip(TIMERS) {
            self.lines.set(irq, timer.interrupt());
        }
        self.lines.set(USART6_IRQ, self.usart.interrupt());
        self.exti.drive(&mut self.lines);
    }

    fn has_clock(&mut self, base: u32) -> bool {
        self.errors.check_clock(base, self.rcc.is_clocked(base))
    }

    /// Reads a register, at an address that is aligned to `width`.
    pub fn read(&mut self, address: u32, width: Width) -> u32 {
        let word = address & !3;
        let value = if let Some(value) = self.identity.read(word) {
            value
        } else {
            let base = word & !(BLOCK - 1);
            if self.has_clock(base) { self.read_block(base, word) } else { 0 }
        };
        width.part(value, address)
    }

    fn read_block(&mut self, base: u32, address: u32) -> u32 {
        let offset = address - base;
        let value = match base {
            0x4000_0000..=0x4000_0c00 => {
                self.timers[((base >> 10) & 3) as usize].read(offset, self.now)
            }
            WATCHDOG => self.watchdog.read(offset),
            RTC if self.backup.read(offset).is_some() => self.backup.read(offset).unwrap_or(0),
            POWER => self.power.read(offset),
            USART6 => self.usart.read(offset, self.now),
            SYSCFG if (0x08..0x18).contains(&offset) => {
                self.exti.read_choice(offset as usize / 4 - 2)
            }
            EXTI => self.exti.read(offset),
            GPIO..=GPIO_LAST => self.ports[((base - GPIO) / BLOCK) as usize].read(offset),
            RCC => self.rcc.read(offset),
            FLASH => self.flash.read(offset),
            DEBUG if offset == 0 => system::DEBUG_ID,
            _ => {
                self.note_unknown(base, address);
                self.storage.get(&address).copied().unwrap_or(0)
            }
        };
        self.update_lines();
        value
    }

    fn note_unknown(&mut self, base: u32, address: u32) {
        // The other registers of SYSCFG and DBGMCU are storage on the chip, too.
        if base != SYSCFG && base != DEBUG {
            self.unknown.entry(base).or_insert(address);
        }
    }

    /// Writes a register, at an address that is aligned to `width`.
    pub fn write(&mut self, address: u32, width: Width, value: u32) {
        let word = address & !3;
        let base = word & !(BLOCK - 1);
        if self.identity.read(word).is_none() && self.has_clock(base) {
            self.write_block(base, word, Write::new(address, width, value));
        }
    }

    fn write_block(&mut self, base: u32, address: u32, write: Write) {
        let offset = address - base;
        match base {
            0x4000_0000..=0x4000_0c00 => {
                let timer = &mut self.timers[((base >> 10) & 3) as usize];
                if !timer.write(offset, write, self.now) {
                    self.unknown.entry(base).or_insert(address);
                }
            }
            // Without DBP nothing is written; while the domain is in reset all registers stay 0.
            RTC if self.backup.read(offset).is_some() => {
                if self.power.is_backup_writable() && !self.rcc.is_backup_reset() {
                    self.backup.write(offset, write);
                }
            }
            WATCHDOG => self.watchdog.write(offset, write, self.now),
            POWER => {
                self.power.write(offset, write);
                self.check_clocks();
            }
            USART6 => self.usart.write(offset, write, self.now),
            SYSCFG if (0x08..0x18).contains(&offset) => {
                self.exti.write_choice(offset as usize / 4 - 2, write);
                self.pins_changed();
            }
            EXTI => self.exti.write(offset, write),
            GPIO..=GPIO_LAST => {
                self.ports[((base - GPIO) / BLOCK) as usize].write(offset, write);
                self.pins_changed();
            }
            RCC => {
                let reset = self.rcc.write(offset, write);
                if self.rcc.is_backup_reset() {
                    self.backup = Backup::new();
                }
                self.clocks_changed();
                if let Some((register, bits)) = reset {
                    self.reset_peripherals(register, bits);
                }
            }
            FLASH => {
                self.flash.write(offset, write);
                self.check_clocks();
            }
            _ => {
                self.note_unknown(base, address);
                let word = self.storage.entry(address).or_insert(0);
                *word = write.merge(*word);
            }
        }
        self.update_lines();
    }

    fn clocks_changed(&mut self) {
        let clocks = self.rcc.clocks();
        for timer in &mut self.timers {
            timer.set_clock(clocks.timers1, self.now);
        }
        self.usart.set_clock(clocks.pclk2);
        self.check_clocks();
    }

    fn check_clocks(&mut self) {
        let hclk = self.rcc.clocks().hclk;
        let errors = self.rcc.errors(self.power.is_scale_1());
        for error in errors.into_iter().chain(self.flash.error(hclk)) {
            self.errors.report(error);
        }
    }

    /// Resets peripherals through RCC_xxxRSTR, whose bits are those of RCC_xxxENR.
    fn reset_peripherals(&mut self, register: usize, bits: u32) {
        let is_set = |number: usize, bit: usize| register == number && bits >> bit & 1 != 0;
        for (number, port) in self.ports.iter_mut().enumerate() {
            if is_set(0, number) {
                port.reset();
            }
        }
        let hz = self.rcc.clocks().timers1;
        for (number, timer) in self.timers.iter_mut().enumerate() {
            if is_set(4, number) {
                *timer = Timer::new(timer.kind(), hz, self.now);
            }
        }
        if is_set(4, 28) {
            self.power = Power::new();
        }
        if is_set(5, 5) {
            self.usart.reset();
        }
        self.pins_changed();
    }
}
