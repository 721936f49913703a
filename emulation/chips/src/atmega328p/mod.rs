//! The ATmega328P without its core (data sheet DS40002061B).
//!
//! The core reports the number of cycles that have passed. A register is computed when it is read;
//! the chip announces only the cycles at which an interrupt may come without an access. Peripherals
//! count cycles of their own clock, which stands still in deep sleep.

mod access;
mod adc;
mod board;
mod clock;
mod eeprom;
mod self_programming;
mod timer;
mod usart;
mod watchdog;

pub use adc::AdcSample;
pub use board::AvrBoard;
pub use clock::RcClock;
pub use eeprom::SIZE as EEPROM_SIZE;
pub use self_programming::{BOOT_SECTION, Change, Mistake, PAGE};
pub use timer::Wave;
pub use usart::Sent;

use self::adc::Adc;
use self::eeprom::Eeprom;
use self::self_programming::SelfProgramming;
use self::timer::{
    CANCEL_NOISE, CAPTURE, COMPARE_A, COMPARE_B, OVERFLOW, RISING, Timer, TimerNumber,
};
use self::usart::Usart;
use self::watchdog::Watchdog;
use crate::ResetCause;

/// The first address of RAM.
pub const RAM: u16 = 0x100;

/// ACSR.
const ACD: u8 = 1 << 7;
const ACO: u8 = 1 << 5;
const ACI: u8 = 1 << 4;
const ACIE: u8 = 1 << 3;
const ACIC: u8 = 1 << 2;

/// MCUSR.
pub const POWER_ON_RESET: u8 = 1 << 0;
pub(crate) const BROWN_OUT_RESET: u8 = 1 << 2;
pub(crate) const WATCHDOG_RESET: u8 = 1 << 3;

/// MCUCR.
const IVSEL: u8 = 1 << 1;
const IVCE: u8 = 1 << 0;
/// CLKPR.
const CLKPCE: u8 = 1 << 7;
/// The accesses that IVCE and CLKPCE unlock must come within this number of cycles.
const UNLOCKED: u64 = 4;

/// Index of port B.
pub const B: usize = 0;
/// Index of port C.
pub const C: usize = 1;
/// Index of port D.
pub const D: usize = 2;

/// The registers of a port, and the levels that the board drives.
#[derive(Clone, Copy, Debug, Default)]
pub struct AvrPort {
    /// Bit n is 1 if pin n is an output.
    pub direction: u8,
    /// The levels of outputs, and the pull-ups of inputs.
    pub port: u8,
    /// The pins that the board drives, and their levels.
    driven: u8,
    levels: u8,
}

impl AvrPort {
    /// Returns the levels of all pins.
    pub fn pins(self) -> u8 {
        let inputs = self.driven & self.levels | !self.driven & self.port;
        self.direction & self.port | !self.direction & inputs
    }
}

/// A request to the board, or an event for it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Signal {
    /// The converter samples an input; the board passes the value to [`Atmega328p::measured`].
    Sample(AdcSample),
    /// The last bit of a byte has left PD1.
    Sent(Sent),
}

/// The depth of the core's sleep.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sleep {
    /// The peripherals continue.
    Idle,
    /// Only the watchdog continues.
    PowerDown,
}

/// The chip without its core.
#[derive(Clone, Debug)]
pub struct Atmega328p {
    /// The oscillator, which converts cycles to time.
    pub clock: RcClock,
    /// Ports B, C and D.
    pub ports: [AvrPort; 3],
    /// The EEPROM and its interface.
    pub eeprom: Eeprom,
    timers: [Timer; 3],
    adc: Adc,
    usart: Usart,
    watchdog: Watchdog,
    flash: SelfProgramming,
    acsr: u8,
    comparator_input: bool,
    mcusr: u8,
    mcucr: u8,
    smcr: u8,
    unlocked_until: [u64; 2],
    clkpr: u8,
    /// High half of the 16-bit registers of timer 1.
    temporary: u8,
    storage: [u8; 0x100],
    /// Bit n is set if register n was used, which is plain storage in this model but not on the
    /// chip.
    unknown: [u64; 4],
    now: u64,
    asleep: Option<Sleep>,
    /// The number of cycles for which the clock of the peripherals stood still.
    stopped: u64,
    /// The cycles for which the core still has to halt.
    halt: u64,
    /// The result of `outlook`; none after any change of the state.
    outlook: Option<Outlook>,
}

#[derive(Clone, Copy, Debug)]
struct Outlook {
    next: u64,
    pending: u32,
}

impl Atmega328p {
    /// Creates a chip whose oscillator has its nominal frequency at the OSCCAL `best`, and starts
    /// with `factory`.
    pub fn new(best: u8, factory: u8, eeprom: [u8; EEPROM_SIZE]) -> Self {
        Atmega328p {
            clock: RcClock::new(best, factory),
            ports: [AvrPort::default(); 3],
            eeprom: Eeprom::new(eeprom),
            timers: [TimerNumber::Timer0, TimerNumber::Timer1, TimerNumber::Timer2].map(Timer::new),
            adc: Adc::default(),
            usart: Usart::new(),
            watchdog: Watchdog::default(),
            flash: SelfProgramming::new(),
            acsr: 0,
            comparator_input: false,
            mcusr: POWER_ON_RESET,
            mcucr: 0,
            smcr: 0,
            unlocked_until: [0; 2],
            clkpr: 0,
            temporary: 0,
            storage: [0; 0x100],
            unknown: [0; 4],
            now: 0,
            asleep: None,
            stopped: 0,
            halt: 0,
            outlook: None,
        }
    }

    /// Resets everything except the EEPROM. MCUSR collects the causes, and only power-on clears
    /// them (11.9.1). Brown-out detection, which a fuse enables, is on.
    pub fn reset(&mut self, factory: u8, cause: ResetCause) {
        let mut fresh = Atmega328p::new(factory, factory, self.eeprom.cells);
        fresh.eeprom = self.eeprom.clone();
        fresh.eeprom.reset();
        fresh.clock = self.clock.clone();
        fresh.clock.set_osccal(self.now, factory);
        fresh.clock.set_divider(self.now, 0);
        (fresh.now, fresh.stopped) = (self.now, self.stopped);
        fresh.unknown = self.unknown;
        fresh.comparator_input = self.comparator_input;
        fresh.mcusr = match cause {
            ResetCause::IndependentWatchdog => self.mcusr | WATCHDOG_RESET,
            ResetCause::BrownOut => self.mcusr | BROWN_OUT_RESET,
            _ => POWER_ON_RESET,
        };
        for (fresh, port) in fresh.ports.iter_mut().zip(self.ports) {
            *fresh = AvrPort { direction: 0, port: 0, ..port };
        }
        let by_watchdog = cause == ResetCause::IndependentWatchdog;
        fresh.watchdog.reset(by_watchdog, self.clock.time(self.now));
        let io = fresh.io(fresh.now);
        for timer in &mut fresh.timers {
            timer.reset_prescaler(io);
            timer.compute(io);
        }
        *self = fresh;
    }

    /// Returns the cycle of the peripherals' clock at this cycle of the core.
    fn io(&self, cycle: u64) -> u64 {
        cycle - self.stopped
    }

    fn runs(&self) -> bool {
        self.asleep != Some(Sleep::PowerDown)
    }

    /// Returns the cycle that all peripherals have reached.
    pub fn now(&self) -> u64 {
        self.now
    }

    /// Advances to the next signal for the board, at most to cycle `to`.
    pub fn advance(&mut self, to: u64) -> Option<Signal> {
        if self.outlook.is_some_and(|outlook| outlook.next <= to) {
            self.outlook = None;
        }
        while let Some(at) = self.next_internal().filter(|at| *at <= to) {
            self.outlook = None;
            self.now = self.now.max(at);
            self.watchdog.advance(self.clock.time(at));
            if !self.runs() {
                continue;
            }
            let io = self.io(at);
            self.eeprom.advance(io);
            self.flash.advance(io);
            if let Some(sent) = self.usart.advance(io) {
                return Some(Signal::Sent(sent));
            }
            self.adc.finish(io);
            if let Some(sample) = self.adc.sample(io) {
                return Some(Signal::Sample(sample));
            }
        }
        self.now = self.now.max(to);
        None
    }

    /// Brings the timers up to date.
    fn compute_timers(&mut self) {
        if self.runs() {
            let io = self.io(self.now);
            for timer in &mut self.timers {
                timer.compute(io);
            }
        }
    }

    /// Returns the next internal event that is not computed on access.
    fn next_internal(&self) -> Option<u64> {
        let watchdog = self.watchdog.next_event().map(|due| self.clock.cycle(due));
        if !self.runs() {
            return watchdog;
        }
        let io = [
            self.eeprom.next_event(),
            self.flash.next_event(),
            self.usart.next_event(),
            self.adc.next_event(),
        ];
        let io = io.into_iter().flatten().min().map(|at| at + self.stopped);
        io.into_iter().chain(watchdog).min()
    }

    fn outlook(&mut self) -> Outlook {
        if let Some(outlook) = self.outlook {
            return outlook;
        }
        self.compute_timers();
        let mut next = self.next_internal();
        if self.runs() {
            let timers = self.timers.iter().filter_map(Timer::next_event).min();
            next = next.into_iter().chain(timers.map(|at| at + self.stopped)).min();
        }
        let outlook = Outlook { next: next.unwrap_or(u64::MAX), pending: self.pending() };
        self.outlook = Some(outlook);
        outlook
    }

    /// Returns the next cycle at which an interrupt may come or a change is visible from outside.
    pub fn next_event(&mut self) -> u64 {
        self.outlook().next
    }

    /// Returns the pending interrupts: bit n is vector n of table 12-6, beginning with reset.
    fn pending(&self) -> u32 {
        let mut pending = 0;
        let mut set = |vector: u8, is: bool| pending |= u32::from(is) << vector;
        let [timer0, timer1, timer2] = [0, 1, 2].map(|timer: usize| {
            let timer = &self.timers[timer];
            timer.flags & timer.enabled
        });
        set(6, self.watchdog.interrupts());
        for (flags, first) in [(timer2, 7), (timer1, 11), (timer0, 14)] {
            set(first, flags & COMPARE_A != 0);
            set(first + 1, flags & COMPARE_B != 0);
            set(first + 2, flags & OVERFLOW != 0);
        }
        set(10, timer1 & CAPTURE != 0);
        set(19, self.usart.is_empty_interrupt());
        set(20, self.usart.is_complete_interrupt());
        set(21, self.adc.interrupts());
        set(22, self.eeprom.interrupts());
        set(23, self.acsr & (ACI | ACIE) == ACI | ACIE);
        set(25, self.flash.interrupts());
        pending
    }

    /// Returns the pending interrupt with the highest priority, as its number in the table of
    /// vectors.
    pub fn interrupt(&mut self) -> Option<u8> {
        let pending = self.outlook().pending;
        (pending != 0).then(|| pending.trailing_zeros() as u8)
    }

    /// Acknowledges an interrupt: clears its flag and returns the address of its vector.
    pub fn acknowledge(&mut self, vector: u8) -> u16 {
        self.outlook = None;
        match vector {
            6 => self.watchdog.acknowledge(),
            7..=9 => self.timers[2].flags &= !flag_of(vector - 7),
            10 => self.timers[1].flags &= !CAPTURE,
            11..=13 => self.timers[1].flags &= !flag_of(vector - 11),
            14..=16 => self.timers[0].flags &= !flag_of(vector - 14),
            20 => self.usart.acknowledge_complete(),
            21 => self.adc.acknowledge(),
            23 => self.acsr &= !ACI,
            _ => {}
        }
        let table = if self.mcucr & IVSEL != 0 { BOOT_SECTION } else { 0 };
        table + 4 * u16::from(vector)
    }

    /// Executes `sleep` and returns the depth of the sleep; none if SMCR does not enable sleep.
    pub fn sleep(&mut self) -> Option<Sleep> {
        if self.smcr & 1 == 0 {
            return None;
        }
        let sleep = match self.smcr >> 1 & 7 {
            0 => Sleep::Idle,
            1 => {
                self.adc.start_for_sleep(self.io(self.now));
                Sleep::Idle
            }
            _ => Sleep::PowerDown,
        };
        self.compute_timers();
        self.asleep = Some(sleep);
        self.outlook = None;
        self.asleep
    }

    /// Wakes the core after `slept` cycles, as an interrupt does.
    pub fn wake(&mut self, slept: u64) {
        if self.asleep.take() == Some(Sleep::PowerDown) {
            self.stopped += slept;
        }
        self.outlook = None;
    }

    /// Returns true if the watchdog has expired.
    pub fn is_expired(&self) -> bool {
        self.watchdog.is_expired
    }

    /// Executes `wdr`.
    pub fn restart_watchdog(&mut self) {
        self.watchdog.restart(self.clock.time(self.now));
        self.outlook = None;
    }

    /// Returns the number of `wdr` instructions since the last reset.
    pub fn watchdog_restarts(&self) -> u64 {
        self.watchdog.restarts
    }

    /// Executes `spm` at address `pc`.
    pub fn store_program(&mut self, pc: u16, z: u16, word: u16) -> Result<Option<Change>, Mistake> {
        self.outlook = None;
        let (change, halt) = self.flash.execute(pc, z, word, self.io(self.now))?;
        self.halt += halt;
        Ok(change)
    }

    /// Returns true if the application's flash cannot be read now.
    pub fn is_application_busy(&self) -> bool {
        self.flash.is_application_busy()
    }

    /// Returns the number of cycles for which the core halts, and clears it.
    pub fn take_halt(&mut self) -> u64 {
        std::mem::take(&mut self.halt)
    }

    /// Takes the value of the input that the board was asked for.
    pub fn measured(&mut self, value: u16) {
        self.adc.measured(value);
        self.outlook = None;
    }

    /// Sets the comparator's input; `positive` is the sign of the difference between its two
    /// inputs.
    pub fn compare(&mut self, positive: bool) {
        self.comparator_input = positive;
        self.settle_comparator();
    }

    fn settle_comparator(&mut self) {
        let output = self.comparator_input && self.acsr & ACD == 0;
        if output == (self.acsr & ACO != 0) || !self.runs() {
            return;
        }
        self.outlook = None;
        self.acsr ^= ACO;
        let io = self.io(self.now);
        let is_flagged = match self.acsr & 3 {
            0 => true,
            2 => !output,
            3 => output,
            _ => false,
        };
        if is_flagged {
            let was = self.acsr & ACI != 0;
            self.acsr |= ACI;
            if !was {
                self.adc.trigger(adc::COMPARATOR, io);
            }
        }
        if self.acsr & ACIC != 0 {
            self.capture(output);
        }
    }

    /// Handles an edge at timer 1's capture input.
    fn capture(&mut self, rises: bool) {
        let io = self.io(self.now);
        let timer = &mut self.timers[1];
        if (timer.tccrb & RISING != 0) != rises {
            return;
        }
        timer.compute(io);
        let was = timer.flags & CAPTURE != 0;
        timer.capture();
        if timer.tccrb & CANCEL_NOISE != 0 {
            // The noise canceler waits for four equal samples (16.6.2).
            let mut later = timer.clone();
            later.compute(io + 4);
            timer.icr = later.count();
        }
        self.outlook = None;
        if !was {
            self.adc.trigger(adc::CAPTURE, io);
        }
    }

    /// Drives a pin from the board.
    pub fn drive(&mut self, port: usize, pin: u8, level: bool) {
        let port = &mut self.ports[port];
        port.driven |= 1 << pin;
        port.levels = port.levels & !(1 << pin) | u8::from(level) << pin;
    }

    /// Returns the signal at OC2A (`output` 0) or OC2B (1).
    pub fn motor(&self, output: usize) -> Option<Wave> {
        self.timers[2].wave(output)
    }

    /// Returns the addresses that were used and are plain storage in this model, each once.
    pub fn take_unknown(&self) -> Vec<u32> {
        (0..0x100_u32).filter(|n| self.unknown[*n as usize / 64] >> (n % 64) & 1 != 0).collect()
    }
}

/// Returns the flag of an interrupt vector, counted from the timer's first one. COMPA, COMPB and
/// OVF are consecutive in the table of vectors.
fn flag_of(vector: u8) -> u8 {
    [COMPARE_A, COMPARE_B, OVERFLOW][usize::from(vector % 3)]
}
