//! The STM32F051: its peripherals, their clocks and their interrupt lines.

mod access;
mod adc;
mod dma;
mod flash;
mod i2c;
mod identity;
mod rcc;
mod spi;

use std::collections::BTreeMap;

use self::adc::Adc;
use self::dma::Dma;
use self::flash::FlashInterface;
pub use self::flash::{FlashChange, FlashContent};
use self::i2c::I2c;
use self::identity::Identity;
use self::rcc::{Clocks, Rcc};
use self::spi::Spi;
use crate::stm32::watchdog::APB1_FREEZE;
use crate::stm32::{ErrorLog, Exti, GpioPort, Pin, PortReset, Timer, TimerKind, Watchdog, Write};
use crate::{BusAction, BusRelease, HardwareError, Lines, ResetCause, Time, Transfer, Width};

/// For each timer its first address (RM0091 table 1), its kind, and its interrupt (table 36). For
/// TIM1 this is the update interrupt, and the next one is the compare interrupt.
const TIMERS: [(u32, TimerKind, u8); 7] = [
    (0x4001_2c00, TimerKind::Advanced, 13),
    (0x4000_0000, TimerKind::Wide, 15),
    (0x4000_0400, TimerKind::General, 16),
    (0x4000_2000, TimerKind::Single, 19),
    (0x4001_4000, TimerKind::Dual, 20),
    (0x4001_4400, TimerKind::SingleGated, 21),
    (0x4001_4800, TimerKind::SingleGated, 22),
];
const TIM1: usize = 0;
const WATCHDOG: u32 = 0x4000_3000;
const I2C2: u32 = 0x4000_5800;
const SYSCFG: u32 = 0x4001_0000;
const EXTI: u32 = 0x4001_0400;
const ADC: u32 = 0x4001_2400;
const SPI1: u32 = 0x4001_3000;
const DBGMCU: u32 = 0x4001_5800;
const DMA1: u32 = 0x4002_0000;
const RCC: u32 = 0x4002_1000;
const FLASH: u32 = 0x4002_2000;
const GPIO: u32 = 0x4800_0000;
const GPIO_LAST: u32 = 0x4800_1400;
const PWR: u32 = 0x4000_7000;
/// Interrupts (RM0091 table 36).
const FLASH_IRQ: u8 = 3;
const DMA_IRQ: [u8; dma::CHANNELS] = [9, 10, 10, 11, 11];
const ADC_IRQ: u8 = 12;
const I2C2_IRQ: u8 = 24;
const SPI1_IRQ: u8 = 25;
const EXTI_IRQ: [u8; 16] = [5, 5, 6, 6, 7, 7, 7, 7, 7, 7, 7, 7, 7, 7, 7, 7];
/// DMA channels, counted from 0 (RM0091 table 29).
const ADC_CHANNEL: usize = 0;
const SPI1_CHANNELS: [usize; 2] = [2, 1];
const I2C2_CHANNELS: [usize; 2] = [3, 4];
/// A pin whose edges a timer captures.
struct Capture {
    port: usize,
    pin: u8,
    /// The alternate function of the pin (data sheet, table 15).
    function: u8,
    /// Index in [`TIMERS`].
    timer: usize,
    channel: u32,
    /// DMA channel, counted from 0.
    dma: usize,
}
/// Captures of PB1 by TIM3 and of PB9 by TIM17. Other pins and timers have no model.
const CAPTURES: [Capture; 2] = [
    Capture { port: 1, pin: 1, function: 1, timer: 2, channel: 3, dma: 2 },
    Capture { port: 1, pin: 9, function: 2, timer: 6, channel: 0, dma: 0 },
];
/// DBGMCU_IDCODE of the STM32F051, revision 1.0 (32.4.1).
const DEBUG_ID: u32 = 0x1000_0440;
/// The modes of the ports after a reset. Only the pins of the debugger are not inputs (RM0091 8.4).
/// There is no port E.
const PORTS: [PortReset; 6] = {
    let mut ports = [PortReset { moder: 0, ospeedr: 0, pupdr: 0 }; 6];
    ports[0] = PortReset { moder: 0x2800_0000, ospeedr: 0x0c00_0000, pupdr: 0x2400_0000 };
    ports
};
/// The size of a peripheral's address range; each begins at a multiple of it.
const BLOCK: u32 = 0x400;

/// Bytes of flash.
pub const FLASH_SIZE: u32 = flash::SIZE;

/// An action of the chip at its pins that needs an answer of the connected device.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PinAction {
    /// SPI1 has sent this byte; the answer is [`F051::spi_received`].
    Spi(Time, u8),
    /// I2C2 has finished this action; the answer is [`F051::i2c_acknowledge`] or
    /// [`F051::i2c_received`].
    I2c(Time, BusAction),
}

/// The chip without its core and its memory.
pub struct F051 {
    now: Time,
    rcc: Rcc,
    /// The frequencies of the clock tree, stored because they are read much more often than they
    /// change.
    clocks: Clocks,
    flash: FlashInterface,
    /// Ports A to F; there is no port E.
    pub ports: [GpioPort; 6],
    exti: Exti,
    spi: Spi,
    i2c: I2c,
    i2c_release: Option<BusRelease>,
    adc: Adc,
    dma: Dma,
    timers: [Timer; TIMERS.len()],
    /// The earliest event of all timers, stored because it is read much more often than it changes.
    next_timer: Option<Time>,
    watchdog: Watchdog,
    identity: Identity,
    /// Registers without a model: the value of every word that was written.
    storage: BTreeMap<u32, u32>,
    /// For each block, the first address used that has no model: a block without a model, or a
    /// register that a model does not know.
    pub unknown: BTreeMap<u32, u32>,
    flash_change: Option<FlashChange>,
    errors: ErrorLog,
    lines: Lines,
}

impl F051 {
    /// Creates a chip at the moment of its power-on.
    pub fn new(unique_id: [u8; 12], battery_volts: f64) -> Self {
        let rcc = Rcc::new();
        let clocks = rcc.clocks();
        F051 {
            now: Time::ZERO,
            flash: FlashInterface::new(),
            ports: PORTS.map(GpioPort::new),
            exti: Exti::new(EXTI_IRQ),
            spi: Spi::new(clocks.pclk),
            i2c: I2c::new(clocks.pclk),
            i2c_release: None,
            adc: Adc::new(clocks.pclk, clocks.hsi14, battery_volts),
            dma: Dma::default(),
            timers: TIMERS.map(|(_, kind, _)| Timer::new(kind, clocks.timers, Time::ZERO)),
            next_timer: None,
            watchdog: Watchdog::new(rcc.lsi_hz),
            identity: Identity::new(unique_id),
            storage: BTreeMap::new(),
            unknown: BTreeMap::new(),
            flash_change: None,
            errors: ErrorLog::default(),
            lines: Lines::default(),
            clocks,
            rcc,
        }
    }

    /// Sets the properties that differ from chip to chip. A reset must follow.
    pub fn set_oscillators(&mut self, lsi_hz: u64, has_crystal: bool) {
        self.rcc.lsi_hz = lsi_hz;
        self.rcc.has_crystal = has_crystal;
    }

    /// Resets the chip. The board continues to drive its pins.
    pub fn reset(&mut self, cause: ResetCause) {
        self.rcc.reset(cause);
        self.flash = FlashInterface::new();
        for port in &mut self.ports {
            port.reset();
        }
        self.exti = Exti::new(EXTI_IRQ);
        let clocks = self.rcc.clocks();
        self.clocks = clocks;
        self.spi = Spi::new(clocks.pclk);
        self.restart_i2c();
        self.adc = Adc::new(clocks.pclk, clocks.hsi14, self.adc.battery_volts);
        self.dma = Dma::default();
        self.watchdog = Watchdog::new(self.rcc.lsi_hz);
        self.storage.clear();
        self.flash_change = None;
        self.lines = Lines::default();
        for timer in &mut self.timers {
            *timer = Timer::new(timer.kind(), clocks.timers, self.now);
        }
        self.next_timer = None;
        self.pins_changed();
    }

    fn restart_i2c(&mut self) {
        self.i2c_release = Some(self.i2c.release(self.now));
        self.i2c = I2c::new(self.clocks.pclk);
    }

    /// Advances time to `now`, which is not beyond [`Self::next`]. Returns the signal that needs an
    /// answer.
    pub fn advance(&mut self, now: Time) -> Option<PinAction> {
        self.now = now;
        if self.next_timer.is_some_and(|at| at <= now) {
            for number in 0..self.timers.len() {
                if self.timers[number].next_event().is_some_and(|at| at <= now) {
                    self.timers[number].advance(now);
                    self.update_timer_line(number);
                }
            }
        }
        let buses = self.spi.next_event().into_iter().chain(self.i2c.next_event());
        if buses.chain(self.adc.next_event()).min().is_none_or(|at| at > now) {
            return None;
        }
        self.adc.advance(now);
        let spi = self.spi.advance(now).map(|(end, byte)| PinAction::Spi(end, byte));
        let signal =
            spi.or_else(|| self.i2c.advance(now).map(|(end, action)| PinAction::I2c(end, action)));
        self.update_lines();
        signal
    }

    /// Returns the time of the next internal event.
    pub fn next(&self) -> Option<Time> {
        let buses = self.spi.next_event().into_iter().chain(self.i2c.next_event());
        buses.chain(self.adc.next_event()).chain(self.next_event()).min()
    }

    /// Returns the time at which an interrupt line may change or a DMA transfer is due. Changes
    /// that a program sees only on access are not included.
    pub fn next_event(&self) -> Option<Time> {
        let spi = self.spi.next_event().filter(|_| self.spi.is_watched());
        let i2c = self.i2c.next_event().filter(|_| self.i2c.is_watched());
        let adc = self.adc.next_event().filter(|_| self.adc.is_watched());
        let timers = self.next_timer.into_iter();
        timers.chain(self.watchdog.expires()).chain(spi).chain(i2c).chain(adc).min()
    }

    /// Receives the byte that the device returned for the one that SPI1 sent.
    pub fn spi_received(&mut self, byte: u8, end: Time) {
        self.spi.received(byte, end);
        self.update_lines();
    }

    /// Answers I2C2 with an acknowledge bit that ends at `end`.
    pub fn i2c_acknowledge(&mut self, acknowledged: bool, end: Time) {
        self.i2c.acknowledge(acknowledged, end);
        self.update_lines();
    }

    /// Sets if a device holds SDA of I2C2 low outside of a transfer.
    pub fn set_i2c_held(&mut self, is_held: bool) {
        self.i2c.set_held(is_held, self.now);
    }

    /// Returns the state of the bus of I2C2 if the program or a reset has let it go since the last
    /// call.
    pub fn take_i2c_release(&mut self) -> Option<BusRelease> {
        self.i2c_release.take()
    }

    /// Answers I2C2 with a byte whose last bit ends at `end`.
    pub fn i2c_received(&mut self, byte: u8, end: Time) {
        self.i2c.receive(byte, end);
        self.update_lines();
    }

    /// Returns the DMA channel that has data to move now, and true if the data goes to the
    /// peripheral. Such a channel is on, and its peripheral requests a transfer.
    fn due(&self) -> Option<(usize, bool)> {
        let due = |channel, to| self.dma.is_ready(channel, to).then_some((channel, to));
        let captured = |capture: &Capture| {
            due(capture.dma, false)
                .filter(|_| self.timers[capture.timer].dma_request(capture.channel))
        };
        let adc = || due(ADC_CHANNEL, false).filter(|_| self.adc.dma_request());
        let spi =
            |way: usize| due(SPI1_CHANNELS[way], way == 0).filter(|_| self.spi.dma_requests()[way]);
        let i2c =
            |way: usize| due(I2C2_CHANNELS[way], way == 0).filter(|_| self.i2c.dma_requests()[way]);
        CAPTURES
            .iter()
            .find_map(captured)
            .or_else(adc)
            .or_else(|| [1, 0].into_iter().find_map(spi))
            .or_else(|| [0, 1].into_iter().find_map(i2c))
    }

    /// Returns true if a DMA transfer or a change of the flash is due.
    pub fn wants_memory(&self) -> bool {
        self.flash_change.is_some() || self.dma.is_on() && self.due().is_some()
    }

    /// Returns the data item that the DMA controller moves now, if any.
    pub fn next_transfer(&mut self) -> Option<Transfer> {
        let (channel, to_peripheral) = self.due()?;
        let transfer = self.dma.request(channel, to_peripheral);
        self.update_lines();
        transfer
    }

    /// Returns true if an edge at a pin that a timer may capture can raise an interrupt, so that
    /// the core notices the edge before its next access.
    pub fn interrupts_on_capture(&self) -> bool {
        self.dma.is_watched()
            || CAPTURES.iter().any(|Capture { port, pin, timer, .. }| {
                self.exti.is_enabled(*port, *pin) || self.timers[*timer].interrupts_on_capture()
            })
    }

    /// Returns true if the watchdog has expired. It then stands still until the reset that it
    /// requests.
    pub fn take_watchdog_expiry(&mut self) -> bool {
        self.watchdog.take_expiry(self.now)
    }

    /// Called when a debugger halts or resumes the core. DBGMCU can stop several peripherals; only
    /// the watchdog is modeled.
    pub fn set_halted(&mut self, halted: bool) {
        let freeze = self.storage.get(&(DBGMCU + APB1_FREEZE)).copied().unwrap_or(0);
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

    /// Returns the frequencies in Hz of the core and of the bus of all peripherals.
    pub fn clocks_hz(&self) -> [u64; 2] {
        [self.clocks.hclk, self.clocks.pclk]
    }

    /// Returns the frequency of the core in Hz, as the RCC registers set it.
    pub fn core_clock_hz(&self) -> u64 {
        self.clocks.hclk
    }

    /// Returns the frequency in Hz at the pin MCO (PA8 with alternate function 0); 0 for no signal.
    pub fn mco_hz(&self) -> u64 {
        if self.ports[0].pin(8) == Pin::Alternate(0) { self.clocks.mco } else { 0 }
    }

    /// Returns the bits per second on SPI1.
    pub fn spi_bit_rate(&self) -> u64 {
        self.spi.bit_rate()
    }

    /// Returns timer `number`, 1 or 2.
    pub fn timer(&self, number: usize) -> &Timer {
        &self.timers[number - 1]
    }

    /// Returns true if [`take_errors`](Self::take_errors) has errors to return.
    pub fn has_errors(&self) -> bool {
        !self.errors.is_empty()
    }

    /// Returns true if a read of the register at this address never has a side effect. These are
    /// ports, and the counts and flags of timers.
    pub fn is_only_looked_at(address: u32) -> bool {
        let base = address & !(BLOCK - 1);
        match base {
            GPIO..=GPIO_LAST => true,
            _ => {
                Timer::is_only_looked_at(address - base)
                    && TIMERS.iter().any(|(timer, _, _)| *timer == base)
            }
        }
    }

    /// Returns the number of accesses to peripherals whose clock was off.
    pub fn accesses_without_clock(&self) -> u64 {
        self.errors.accesses_without_clock()
    }

    /// Returns the errors of the firmware since the last call.
    pub fn take_errors(&mut self) -> Vec<HardwareError> {
        self.errors.take()
    }

    /// Returns the change of the flash that the firmware started.
    pub fn take_flash_change(&mut self) -> Option<FlashChange> {
        self.flash_change.take()
    }

    /// Sets the time; nothing may be due until `now`.
    pub fn set_now(&mut self, now: Time) {
        self.now = now;
    }

    /// Sets the voltage of the supply before the regulator, which the converter measures.
    pub fn set_battery_volts(&mut self, volts: f64) {
        self.adc.battery_volts = volts;
    }

    /// Drives a pin from the board.
    pub fn drive(&mut self, port: usize, pin: u8, high: bool) {
        let before = self.ports[port].level(pin);
        self.ports[port].drive(pin, high);
        let capture = CAPTURES.iter().find(|capture| (capture.port, capture.pin) == (port, pin));
        if let Some(Capture { function, timer, channel, .. }) = capture
            && before != high
            && self.ports[port].pin(pin) == Pin::Alternate(*function)
        {
            self.timers[*timer].capture(*channel, high, self.now);
            self.update_timer_line(*timer);
        }
        if self.exti.port(pin) == port {
            self.exti.observe_one(pin, self.ports[port].level(pin));
            self.exti.drive(&mut self.lines);
        }
    }

    fn pins_changed(&mut self) {
        self.exti.observe_ports(&self.ports);
        self.exti.drive(&mut self.lines);
    }

    fn update_timer_line(&mut self, number: usize) {
        self.next_timer = self.timers.iter().filter_map(Timer::next_event).min();
        let (timer, (_, _, irq)) = (&self.timers[number], TIMERS[number]);
        if number == TIM1 {
            let [update, compare] = timer.separate_interrupts();
            self.lines.set(irq, update);
            self.lines.set(irq + 1, compare);
        } else {
            self.lines.set(irq, timer.interrupt());
        }
    }

    /// Updates all interrupt lines except those of timers and pins.
    fn update_lines(&mut self) {
        for irq in [DMA_IRQ[0], DMA_IRQ[1], DMA_IRQ[3]] {
            let raised = |channel: usize| DMA_IRQ[channel] == irq && self.dma.interrupt(channel);
            self.lines.set(irq, (0..dma::CHANNELS).any(raised));
        }
        self.lines.set(FLASH_IRQ, self.flash.interrupt());
        self.lines.set(ADC_IRQ, self.adc.interrupt());
        self.lines.set(I2C2_IRQ, self.i2c.interrupt());
        self.lines.set(SPI1_IRQ, self.spi.interrupt());
    }
}
