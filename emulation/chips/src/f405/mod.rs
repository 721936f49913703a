//! The STM32F405: its peripherals, their clocks and their interrupt lines.

mod access;
mod adc;
mod dma;
mod flash;
mod i2c;
mod rcc;
mod spi;
mod system;
mod usart;
mod usb;

use std::collections::BTreeMap;

use self::adc::Adc;
use self::dma::{Dma, DmaWrite, STREAMS};
use self::flash::Flash;
use self::i2c::I2c;
use self::rcc::Rcc;
use self::spi::Spi;
pub use self::system::OTP;
use self::system::{Backup, Identity, Power};
pub use self::usart::{SentByte, Usart};
use crate::stm32::watchdog::APB1_FREEZE;
use crate::stm32::{
    ErrorLog, Exti, GpioPort, Pin, PortReset, Timer, TimerKind, Transfer, Watchdog, Write,
};
use crate::{
    BusAction, BusAnswer, BusRelease, HardwareError, Lines, MemoryMap, ResetCause, Time, Width,
};

/// The kinds and the interrupts of TIM2 to TIM7 (RM0090 table 62). Their address ranges follow each
/// other.
const TIMERS: [(TimerKind, u8); 6] = [
    (TimerKind::Wide, 28),
    (TimerKind::General, 29),
    (TimerKind::General, 30),
    (TimerKind::Wide, 50),
    (TimerKind::Basic, 54),
    (TimerKind::Basic, 55),
];
const TIM2: u32 = 0x4000_0000;
const TIM7: u32 = 0x4000_1400;
const RTC: u32 = 0x4000_2800;
const WATCHDOG: u32 = 0x4000_3000;
const USART3: u32 = 0x4000_4800;
const USART3_IRQ: u8 = 39;
const I2C1: u32 = 0x4000_5400;
const I2C3: u32 = 0x4000_5c00;
/// The interrupts of I2C1 and I2C3 for events; those for errors follow.
const I2C_IRQ: [u8; 2] = [31, 72];
const POWER: u32 = 0x4000_7000;
const USART6: u32 = 0x4001_1400;
const USART6_IRQ: u8 = 71;
const ADC: u32 = 0x4001_2000;
const ADC_IRQ: u8 = 18;
const SPI1: u32 = 0x4001_3000;
const SPI1_IRQ: u8 = 35;
const SYSCFG: u32 = 0x4001_3800;
const EXTI: u32 = 0x4001_3c00;
const GPIO: u32 = 0x4002_0000;
const GPIO_LAST: u32 = 0x4002_2000;
const RCC: u32 = 0x4002_3800;
const FLASH: u32 = 0x4002_3c00;
const DMA1: u32 = 0x4002_6000;
const DMA2: u32 = 0x4002_6400;
/// The interrupts of the streams of DMA1 and DMA2.
const DMA_IRQ: [[u8; STREAMS]; 2] =
    [[11, 12, 13, 14, 15, 16, 17, 47], [56, 57, 58, 59, 60, 68, 69, 70]];
const USB_OTG: u32 = 0x5000_0000;
const USB_OTG_LAST: u32 = 0x5003_fc00;
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
/// The memories that the DMA controllers reach: first addresses and sizes of the flash and of the
/// static RAM. Core-coupled memory is not connected to them (RM0090 2.1).
const DMA_MEMORIES: [(u32, u32); 2] = [(0x0800_0000, 0x10_0000), (0x2000_0000, 0x2_0000)];

/// An action of the chip at its pins.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PinAction {
    /// A byte has left USART6 at pin PC6.
    Usart(SentByte),
    /// SPI1 has sent this byte; the answer is [`F405::spi_received`].
    Spi(Time, u8),
    /// I2C1 (0) or I2C3 (1) has finished this action; the answer is [`F405::i2c_answered`].
    I2c(usize, Time, BusAction),
}

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
    /// USART3, whose pins are on the expansion port. Nothing listens there.
    usart3: Usart,
    /// I2C1 and I2C3.
    i2c: [I2c; 2],
    spi: Spi,
    adc: Adc,
    dma: [Dma; 2],
    /// TIM2 to TIM7.
    timers: [Timer; TIMERS.len()],
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
    /// True if the firmware has written to the flash since the last reset.
    has_written_flash: bool,
    lines: Lines,
}

impl F405 {
    /// The memory of an STM32F405RG (RM0090 2.3).
    pub const MEMORY: MemoryMap = MemoryMap {
        flash: 1024 * 1024,
        ram: 128 * 1024,
        ccm: 64 * 1024,
        peripherals: &[(0x4000_0000, 0x8_0000), (0x5000_0000, 0x6_1000)],
        read_only: &[(0x1fff_7000, 0x1000)],
    };

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
            usart3: Usart::new(clocks.pclk1),
            i2c: [I2c::new(clocks.pclk1), I2c::new(clocks.pclk1)],
            spi: Spi::new(clocks.pclk2),
            adc: Adc::new(clocks.pclk2),
            dma: [Dma::new(), Dma::new()],
            timers: TIMERS.map(|(kind, _)| Timer::new(kind, clocks.timers1, Time::ZERO)),
            watchdog: Watchdog::new(lsi_hz),
            lsi_hz,
            identity: Identity::new(unique_id, device_type),
            storage: BTreeMap::new(),
            unknown: BTreeMap::new(),
            errors: ErrorLog::default(),
            has_written_flash: false,
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
        self.usart3.reset();
        for i2c in &mut self.i2c {
            i2c.reset(self.now);
        }
        let clocks = self.rcc.clocks();
        self.spi = Spi::new(clocks.pclk2);
        self.adc = Adc::new(clocks.pclk2);
        self.dma = [Dma::new(), Dma::new()];
        self.has_written_flash = false;
        self.watchdog = Watchdog::new(self.lsi_hz);
        self.storage.clear();
        for timer in &mut self.timers {
            *timer = Timer::new(timer.kind(), clocks.timers1, self.now);
        }
        self.clocks_changed();
        self.pins_changed();
    }

    /// Advances time to `now`, which is not beyond the next event. Returns an action at the pins;
    /// if there are more at this moment, the next event is not later than `now`.
    pub fn advance(&mut self, now: Time) -> Option<PinAction> {
        self.now = now;
        for (timer, (_, irq)) in self.timers.iter_mut().zip(TIMERS) {
            if timer.next_event().is_some_and(|at| at <= now) {
                timer.advance(now);
                self.lines.set(irq, timer.interrupt());
            }
        }
        if self.usart3.next_event().is_some_and(|at| at <= now) {
            self.usart3.advance(now);
            self.update_line(USART3);
        }
        if self.adc.next_event().is_some_and(|at| at <= now) {
            self.adc.advance(now);
            self.update_line(ADC);
        }
        if self.usart.next_event().is_some_and(|at| at <= now) {
            let sent = self.usart.advance(now);
            self.update_line(USART6);
            // Bytes reach the line only if pin PC6 belongs to USART6.
            if let Some(sent) = sent.filter(|_| self.ports[2].pin(6) == Pin::Alternate(8)) {
                return Some(PinAction::Usart(sent));
            }
        }
        if let Some((end, byte)) = self.spi.advance(now) {
            return Some(PinAction::Spi(end, byte));
        }
        for bus in 0..self.i2c.len() {
            if self.i2c[bus].next_event().is_some_and(|at| at <= now) {
                let action = self.i2c[bus].advance(now);
                self.update_i2c(bus);
                if let Some((end, action)) = action {
                    return Some(PinAction::I2c(bus, end, action));
                }
            }
        }
        None
    }

    /// Returns the time of the next internal event.
    pub fn next_event(&self) -> Option<Time> {
        let timers = self.timers.iter().filter_map(Timer::next_event);
        let buses = self.i2c.iter().filter_map(I2c::next_event).chain(self.spi.next_event());
        let usarts = self.usart.next_event().into_iter().chain(self.usart3.next_event());
        let others = self.watchdog.expires().into_iter().chain(self.adc.next_event());
        timers.chain(buses).chain(usarts).chain(others).min()
    }

    /// Receives the byte that the device returned for the one that SPI1 sent.
    pub fn spi_received(&mut self, byte: u8, end: Time) {
        self.spi.received(byte, end);
        self.update_line(SPI1);
    }

    /// Answers the action of I2C1 (0) or I2C3 (1) that ended at `end`.
    pub fn i2c_answered(&mut self, bus: usize, action: BusAction, answer: BusAnswer, end: Time) {
        let i2c = &mut self.i2c[bus];
        match answer {
            BusAnswer::Acknowledge(acknowledged) => i2c.acknowledge(action, acknowledged, end),
            BusAnswer::Byte(byte) => i2c.receive(byte, end),
            BusAnswer::None => {}
        }
        self.update_i2c(bus);
    }

    /// Returns the state of the bus of I2C1 (0) or I2C3 (1) if the program or a reset has let it go
    /// since the last call.
    pub fn take_i2c_release(&mut self, bus: usize) -> Option<BusRelease> {
        self.i2c[bus].take_release()
    }

    /// Sets if a device holds SDA of I2C1 (0) or I2C3 (1) low outside of a transfer.
    pub fn set_i2c_held(&mut self, bus: usize, is_held: bool) {
        self.i2c[bus].set_held(is_held, self.now);
    }

    /// Returns true if the peripheral with this stream and channel of DMA1 (0) or DMA2 (1) requests
    /// a transfer (RM0090 tables 42 and 43).
    fn is_requested(&self, controller: usize, stream: usize, channel: u32) -> bool {
        let [deck, sensors] = &self.i2c;
        match (controller, stream, channel) {
            (0, 6 | 7, 1) => deck.dma_requests()[0],
            (0, 0 | 5, 1) => deck.dma_requests()[1],
            (0, 4, 3) => sensors.dma_requests()[0],
            (0, 2, 3) => sensors.dma_requests()[1],
            (0, 3, 4) | (0, 4, 7) => self.usart3.dma_requests()[0],
            (0, 1, 4) => self.usart3.dma_requests()[1],
            (1, 6 | 7, 5) => self.usart.dma_requests()[0],
            (1, 1 | 2, 5) => self.usart.dma_requests()[1],
            (1, 3 | 5, 3) => self.spi.dma_requests()[0],
            (1, 0 | 2, 3) => self.spi.dma_requests()[1],
            _ => false,
        }
    }

    /// Returns the DMA controller and the stream that move a data item now.
    fn due_stream(&self) -> Option<(usize, usize)> {
        self.dma.iter().enumerate().filter(|(_, dma)| dma.is_on()).find_map(|(number, dma)| {
            let due = dma.first_due(|stream, channel| self.is_requested(number, stream, channel));
            due.map(|stream| (number, stream))
        })
    }

    /// Returns true if a DMA transfer is due.
    pub fn wants_memory(&self) -> bool {
        self.due_stream().is_some()
    }

    /// Returns the data item that a DMA controller moves now, if any.
    pub fn next_transfer(&mut self) -> Option<Transfer> {
        while let Some((controller, stream)) = self.due_stream() {
            let moved = self.dma[controller].request(stream, |address, length| {
                DMA_MEMORIES.iter().any(|(start, size)| {
                    address.checked_sub(*start).is_some_and(|at| at + length <= *size)
                })
            });
            let irq = DMA_IRQ[controller][stream];
            self.lines.set(irq, self.dma[controller].interrupt(stream));
            match moved {
                Ok(moved) => {
                    match (controller, stream) {
                        (0, 0 | 5) if moved.one_left => self.i2c[0].expect_last(),
                        (0, 2) if moved.one_left => self.i2c[1].expect_last(),
                        _ => {}
                    }
                    return Some(moved.transfer);
                }
                Err(address) => self.errors.report(HardwareError::DmaOutOfReach { address }),
            }
        }
        None
    }

    /// Handles a write of the core to the flash, which does not change it.
    pub fn program(&mut self, address: u32) {
        self.flash.program();
        if !std::mem::replace(&mut self.has_written_flash, true) {
            self.errors.report(HardwareError::FlashWrite { address });
        }
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

    /// Returns timer `number`, 2 to 7.
    pub fn timer(&self, number: usize) -> &Timer {
        &self.timers[number - 2]
    }

    /// Returns the number of accesses to peripherals whose clock was off.
    pub fn accesses_without_clock(&self) -> u64 {
        self.errors.accesses_without_clock()
    }

    /// Returns true if [`take_errors`](Self::take_errors) has errors to return.
    pub fn has_errors(&self) -> bool {
        !self.errors.is_empty()
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
            self.update_line(USART6);
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
        self.exti.drive(&mut self.lines);
    }

    fn update_i2c(&mut self, bus: usize) {
        let [event, error] = self.i2c[bus].interrupts();
        self.lines.set(I2C_IRQ[bus], event);
        self.lines.set(I2C_IRQ[bus] + 1, error);
    }

    /// Updates the interrupt lines of the peripheral whose registers begin at `base`.
    fn update_line(&mut self, base: u32) {
        match base {
            TIM2..=TIM7 => {
                let number = ((base - TIM2) / BLOCK) as usize;
                self.lines.set(TIMERS[number].1, self.timers[number].interrupt());
            }
            USART3 => self.lines.set(USART3_IRQ, self.usart3.interrupt()),
            USART6 => self.lines.set(USART6_IRQ, self.usart.interrupt()),
            I2C1 => self.update_i2c(0),
            I2C3 => self.update_i2c(1),
            SPI1 => self.lines.set(SPI1_IRQ, self.spi.interrupt()),
            ADC => self.lines.set(ADC_IRQ, self.adc.interrupt()),
            DMA1 | DMA2 => {
                let controller = ((base - DMA1) / BLOCK) as usize;
                for (stream, irq) in DMA_IRQ[controller].into_iter().enumerate() {
                    self.lines.set(irq, self.dma[controller].interrupt(stream));
                }
            }
            SYSCFG | EXTI => self.exti.drive(&mut self.lines),
            // A change of clocks or a reset concerns every peripheral.
            RCC => {
                let all = [USART3, USART6, I2C1, I2C3, SPI1, ADC, DMA1, DMA2, EXTI];
                for base in (TIM2..=TIM7).step_by(BLOCK as usize).chain(all) {
                    self.update_line(base);
                }
            }
            _ => {}
        }
    }
}
