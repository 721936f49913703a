//! Timers (RM0090 18; RM0091 17 to 20), counting up: compare and update interrupts, PWM, input
//! capture with DMA.
//!
//! A timer is computed, not stepped. The model stores a count and the time at which the counter had
//! this count, and derives the present count from the present time. Nothing runs between two
//! accesses of the firmware, so a timer costs the same at 1 kHz and at 84 MHz. The next event is
//! the earliest time at which a channel matches or the counter wraps; the board reads this time and
//! calls back then.
//!
//! The firmware sets the timer's clock through the clock tree (RCC). A new prescaler takes effect
//! with the next update, as on the chip.
//!
//! # Known differences
//! * Compare values and the reload value take effect at once, as if they were not preloaded: at
//!   most one period of the timer too early.
//! * Not modeled are counting down, centered counting, one-pulse and slave modes, repetition,
//!   captures that are filtered, divided or taken from another channel's pin, and break.
//!   [`Timer::write`] reports an error when the firmware enables any of these except break.

use super::bus::Write;
use crate::Time;

const CR1: u32 = 0x00;
const SMCR: u32 = 0x08;
const DIER: u32 = 0x0c;
const SR: u32 = 0x10;
const EGR: u32 = 0x14;
const CCMR1: u32 = 0x18;
const CCMR2: u32 = 0x1c;
const CCER: u32 = 0x20;
const CNT: u32 = 0x24;
const PSC: u32 = 0x28;
const ARR: u32 = 0x2c;
const RCR: u32 = 0x30;
const CCR1: u32 = 0x34;
const CCR4: u32 = 0x40;
const BDTR: u32 = 0x44;
const REGISTERS: usize = 0x54 / 4;

const CR1_CEN: u32 = 1 << 0;
const CR1_UDIS: u32 = 1 << 1;
const CR1_URS: u32 = 1 << 2;
/// One-pulse mode, direction and centered counting.
const CR1_UNMODELED: u32 = 1 << 3 | 1 << 4 | 3 << 5;
const SMCR_SMS: u32 = 7;
/// Fields of CCMR for each channel: it captures its own pin; it captures another channel's pin or
/// the trigger, or divides or filters the signal.
const CCMR_OWN_INPUT: u32 = 1;
const CCMR_UNMODELED: u32 = 0xfe;
/// Fields of CCER for each channel: enabled, and the edges that are captured. The codes are rising,
/// falling, a reserved value, and both (18.4.9).
const CCER_ENABLE: u32 = 1 << 0;
const CCER_EDGES: u32 = 0b1010;
const CCER_FALLING: u32 = 0b0010;
const CCER_BOTH: u32 = 0b1010;
const UIF: u32 = 1 << 0;
/// Update and the four compare interrupts.
const INTERRUPTS: u32 = 0x1f;
/// Main output enable.
const BDTR_MOE: u32 = 1 << 15;

/// The kind of a timer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum TimerKind {
    /// 32 bits, four channels: TIM2, and TIM5 of the STM32F4.
    Wide,
    /// 16 bits, four channels: TIM3, TIM4.
    General,
    /// 16 bits, four channels with a main output enable: TIM1.
    Advanced,
    /// Two channels with a main output enable: TIM15 of the STM32F0.
    Dual,
    /// One channel with a main output enable: TIM16 and TIM17 of the STM32F0.
    SingleGated,
    /// One channel: TIM14 of the STM32F0.
    Single,
    /// 16 bits, no channels: TIM6 and TIM7 of the STM32F4.
    Basic,
}

impl TimerKind {
    const fn channels(self) -> u32 {
        match self {
            TimerKind::Wide | TimerKind::General | TimerKind::Advanced => 4,
            TimerKind::Dual => 2,
            TimerKind::SingleGated | TimerKind::Single => 1,
            TimerKind::Basic => 0,
        }
    }

    const fn has_main_output(self) -> bool {
        matches!(self, TimerKind::Advanced | TimerKind::Dual | TimerKind::SingleGated)
    }

    /// Returns the largest count.
    const fn limit(self) -> u32 {
        if matches!(self, TimerKind::Wide) { 0xffff_ffff } else { 0xffff }
    }
}

/// The output signal of a channel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pwm {
    /// The fraction of time that the signal is high, 0 to 1.
    pub duty: f64,
    /// Periods per second; 0 for a constant level.
    pub frequency_hz: f64,
}

impl Pwm {
    /// A constant low level.
    pub const LOW: Pwm = Pwm { duty: 0.0, frequency_hz: 0.0 };
    /// A constant high level.
    pub const HIGH: Pwm = Pwm { duty: 1.0, frequency_hz: 0.0 };
}

/// A timer with its channels.
pub struct Timer {
    /// The registers by offset / 4. CNT is computed instead.
    registers: [u32; REGISTERS],
    kind: TimerKind,
    hz: u64,
    /// The prescaler in use; the value of PSC replaces it at the next update.
    prescaler: u32,
    /// The counter was at `count` at the time `since`. While the timer runs, `count` continues
    /// beyond the reload value, and CNT is the remainder.
    count: u64,
    since: Time,
    /// The count up to which flags were raised.
    seen: u64,
    /// The result of [`Timer::next_event`], stored because it is read much more often than it
    /// changes.
    next: Option<Time>,
    /// No flag is raised before this count, whether enabled or not.
    calm: u64,
}

impl Timer {
    pub(crate) fn new(kind: TimerKind, hz: u64, now: Time) -> Self {
        let mut registers = [0; REGISTERS];
        registers[ARR as usize / 4] = kind.limit();
        Timer {
            registers,
            kind,
            hz,
            prescaler: 0,
            count: 0,
            since: now,
            seen: 0,
            next: None,
            calm: 0,
        }
    }

    /// Returns true if a read of the register at this offset never clears a flag.
    pub(crate) const fn is_only_looked_at(offset: u32) -> bool {
        offset < CCR1
    }

    pub(crate) fn kind(&self) -> TimerKind {
        self.kind
    }

    fn register(&self, offset: u32) -> u32 {
        self.registers[offset as usize / 4]
    }

    /// Returns true if the timer counts. A reload value of 0 blocks the counter (18.4.12).
    fn runs(&self) -> bool {
        self.register(CR1) & CR1_CEN != 0 && self.register(ARR) != 0
    }

    fn period(&self) -> u64 {
        u64::from(self.register(ARR)) + 1
    }

    /// Returns the bits of CCMR that belong to this channel.
    fn mode(&self, channel: u32) -> u32 {
        let register = if channel < 2 { CCMR1 } else { CCMR2 };
        self.register(register) >> (8 * (channel % 2)) & 0xff
    }

    /// Returns the channels that capture, as a mask of their flags in SR.
    fn captures(&self) -> u32 {
        (0..self.kind.channels())
            .filter(|channel| self.mode(*channel) & 3 == CCMR_OWN_INPUT)
            .fold(0, |channels, channel| channels | 2 << channel)
    }

    fn divider(&self) -> u64 {
        u64::from(self.prescaler) + 1
    }

    fn count_at(&self, now: Time) -> u64 {
        if !self.runs() {
            return self.count;
        }
        self.count + (now - self.since).ticks(self.hz) / self.divider()
    }

    fn time_of(&self, count: u64) -> Time {
        self.since + Time::of_ticks((count - self.count).saturating_mul(self.divider()), self.hz)
    }

    /// Starts to count from `count` at `now`.
    fn restart(&mut self, count: u64, now: Time) {
        self.count = count;
        self.seen = count;
        self.since = now;
        self.calm = 0;
    }

    /// Returns the first count after `seen` at which the counter matches compare register
    /// `channel`. A value beyond the reload value matches when the counter overflows (18.4.5,
    /// CC1IF).
    fn next_match(&self, channel: u32) -> u64 {
        let value = u64::from(self.register(CCR1 + 4 * channel));
        self.next_count(if value < self.period() { value } else { 0 })
    }

    /// Returns the first count after `seen` at which CNT is `value`.
    fn next_count(&self, value: u64) -> u64 {
        let count = self.seen / self.period() * self.period() + value;
        if count > self.seen { count } else { count + self.period() }
    }

    /// Raises the flags of all matches and overflows until `now`.
    pub(crate) fn advance(&mut self, now: Time) {
        let count = self.count_at(now);
        if count == self.seen || count < self.calm {
            return;
        }
        let mut raised = 0;
        for channel in 0..self.kind.channels() {
            if self.next_match(channel) <= count {
                raised |= 2 << channel;
            }
        }
        raised &= !self.captures();
        let overflow = self.next_count(0);
        if overflow <= count && self.register(CR1) & CR1_UDIS == 0 {
            raised |= UIF;
        }
        self.registers[SR as usize / 4] |= raised;
        self.seen = count;
        if raised & UIF != 0 && self.register(PSC) != self.prescaler {
            let at = self.time_of(overflow);
            self.prescaler = self.register(PSC);
            self.restart(0, at);
            self.advance(now);
        }
        self.next = self.find_next_event();
        let matches = (0..self.kind.channels()).map(|channel| self.next_match(channel));
        self.calm = matches.fold(self.next_count(0), u64::min);
    }

    /// Returns the time at which the next enabled interrupt is raised.
    pub(crate) fn next_event(&self) -> Option<Time> {
        self.next
    }

    fn find_next_event(&self) -> Option<Time> {
        let waiting = self.register(DIER) & !self.register(SR) & !self.captures() & INTERRUPTS;
        if !self.runs() || waiting == 0 {
            return None;
        }
        let update = (waiting & UIF != 0).then(|| self.next_count(0));
        let compares = (0..self.kind.channels())
            .filter(|n| waiting & 2 << n != 0)
            .map(|channel| self.next_match(channel));
        compares.chain(update).min().map(|count| self.time_of(count))
    }

    /// Handles an edge at the pin of channel `channel`. If the previous capture was not read yet, a
    /// further flag reports the loss (18.3.5).
    pub(crate) fn capture(&mut self, channel: u32, high: bool, now: Time) {
        let edges = self.register(CCER) >> (4 * channel);
        let is_captured = match edges & CCER_EDGES {
            0 => high,
            CCER_FALLING => !high,
            edges => edges == CCER_BOTH,
        };
        let flag = 2 << channel;
        if edges & CCER_ENABLE == 0 || !is_captured || self.captures() & flag == 0 {
            return;
        }
        self.registers[(CCR1 / 4 + channel) as usize] = (self.count_at(now) % self.period()) as u32;
        let raised = self.register(SR) & flag;
        self.registers[SR as usize / 4] |= flag | raised << 8;
    }

    /// Returns true if a capture raises an interrupt.
    pub(crate) fn interrupts_on_capture(&self) -> bool {
        self.register(DIER) & self.captures() != 0
    }

    /// Returns true if channel `channel` requests a DMA transfer of its capture.
    pub(crate) fn dma_request(&self, channel: u32) -> bool {
        let flag = 2 << channel;
        self.register(SR) & self.register(DIER) >> 8 & flag != 0 && self.captures() & flag != 0
    }

    pub(crate) fn interrupt(&self) -> bool {
        self.register(SR) & self.register(DIER) & INTERRUPTS != 0
    }

    /// Returns the interrupts of TIM1, which have lines of their own: update, and compare.
    pub(crate) fn separate_interrupts(&self) -> [bool; 2] {
        let raised = self.register(SR) & self.register(DIER) & INTERRUPTS;
        [raised & UIF != 0, raised & !UIF != 0]
    }

    /// Changes the clock of the timer; the count is kept.
    pub(crate) fn set_clock(&mut self, hz: u64, now: Time) {
        self.advance(now);
        self.restart(self.count_at(now) % self.period(), now);
        self.hz = hz;
        self.next = self.find_next_event();
    }

    pub(crate) fn read(&mut self, offset: u32, now: Time) -> u32 {
        self.advance(now);
        match offset {
            CNT => (self.count_at(now) % self.period()) as u32,
            EGR => 0,
            // A read of the capture clears the flag (18.4.5).
            CCR1..=CCR4 => {
                let flag = 2 << ((offset - CCR1) / 4);
                self.registers[SR as usize / 4] &= !(flag & self.captures());
                self.register(offset)
            }
            _ => self.registers.get(offset as usize / 4).copied().unwrap_or(0),
        }
    }

    /// Writes a register; returns false if that enables a function without a model.
    pub(crate) fn write(&mut self, offset: u32, write: Write, now: Time) -> bool {
        self.advance(now);
        self.calm = 0;
        let modeled = self.set(offset, write, now);
        self.next = self.find_next_event();
        modeled
    }

    fn set(&mut self, offset: u32, write: Write, now: Time) -> bool {
        let width = self.kind.limit();
        let count = self.count_at(now) % self.period();
        match offset {
            CR1 => {
                self.restart(count, now);
                self.registers[0] = write.merge(self.registers[0]) & 0x3ff;
                return self.registers[0] & CR1_UNMODELED == 0;
            }
            // Flags are cleared by writing zeros (18.4.5).
            SR => self.registers[SR as usize / 4] &= !write.zeros(),
            EGR => {
                if write.ones() & UIF != 0 {
                    self.prescaler = self.register(PSC);
                    self.restart(0, now);
                    if self.register(CR1) & (CR1_URS | CR1_UDIS) == 0 {
                        self.registers[SR as usize / 4] |= UIF;
                    }
                }
                self.registers[SR as usize / 4] |= write.ones() & 0x1e;
            }
            CNT => {
                let value = write.merge(count as u32) & width;
                self.restart(u64::from(value), now);
            }
            PSC => self.registers[PSC as usize / 4] = write.merge(self.register(PSC)) & 0xffff,
            ARR => {
                let reload = write.merge(self.register(ARR)) & width;
                self.registers[ARR as usize / 4] = reload;
                // On the chip, a counter already beyond the new value continues to the end of its
                // width and wraps there.
                self.restart(if count > u64::from(reload) { 0 } else { count }, now);
            }
            CCR1..=CCR4 if (offset - CCR1) / 4 >= self.kind.channels() => {}
            RCR => return write.ones() == 0,
            // The register of a channel that captures is read-only (18.4.13).
            CCR1..=CCR4 if self.captures() & 2 << ((offset - CCR1) / 4) != 0 => {}
            CCR1..=CCR4 => {
                let register = &mut self.registers[offset as usize / 4];
                *register = write.merge(*register) & width;
            }
            CCMR1 | CCMR2 => {
                self.registers[offset as usize / 4] = write.merge(self.register(offset));
                return (0..self.kind.channels())
                    .map(|channel| self.mode(channel))
                    .all(|mode| mode & 3 == 0 || mode & CCMR_UNMODELED == 0);
            }
            _ => {
                if let Some(register) = self.registers.get_mut(offset as usize / 4) {
                    *register = write.merge(*register);
                    return offset != SMCR || *register & SMCR_SMS == 0;
                }
            }
        }
        true
    }

    /// Returns the signal of channel 0 to 3 at its pin. Returns none if the output is off (CCxE,
    /// MOE) or the channel is an input.
    pub fn output(&self, channel: u32) -> Option<Pwm> {
        let enable = self.register(CCER) >> (4 * channel);
        let mode = self.mode(channel);
        let gated = self.kind.has_main_output() && self.register(BDTR) & BDTR_MOE == 0;
        if enable & 1 == 0 || mode & 3 != 0 || gated {
            return None;
        }
        let inverted = enable & 2 != 0;
        let reload = u64::from(self.register(ARR));
        let compare = u64::from(self.register(CCR1 + 4 * channel));
        let active_part = compare.min(self.period()) as f64 / self.period() as f64;
        let active = match mode >> 4 & 7 {
            4 => Pwm::LOW,
            5 => Pwm::HIGH,
            pwm @ (6 | 7) => {
                let (duty, frequency_hz) = if !self.runs() {
                    // The counter stands still, and so does the output.
                    (if self.count % self.period() < compare { 1.0 } else { 0.0 }, 0.0)
                } else if compare == 0 || compare > reload {
                    (active_part, 0.0)
                } else {
                    (active_part, self.hz as f64 / (self.divider() * self.period()) as f64)
                };
                Pwm { duty: if pwm == 6 { duty } else { 1.0 - duty }, frequency_hz }
            }
            // Frozen, and the modes that act only at a match. No motor here uses them.
            _ => Pwm::LOW,
        };
        Some(if inverted { Pwm { duty: 1.0 - active.duty, ..active } } else { active })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Width;

    const HZ: u64 = 84_000_000;

    fn timer() -> Timer {
        Timer::new(TimerKind::Wide, HZ, Time::ZERO)
    }

    fn write(timer: &mut Timer, offset: u32, value: u32, now: Time) {
        assert!(timer.write(offset, Write::new(offset, Width::Word, value), now));
    }

    #[test]
    fn counts_at_clock_divided_by_prescaler_plus_one() {
        let mut timer = timer();
        write(&mut timer, PSC, 83, Time::ZERO);
        write(&mut timer, EGR, 1, Time::ZERO);
        write(&mut timer, CR1, CR1_CEN, Time::ZERO);
        assert_eq!(timer.read(CNT, Time::from_micros(1_234_567)), 1_234_567);
        assert_eq!(timer.read(CNT, Time::from_nanos(1_234_567_999)), 1_234_567);
    }

    #[test]
    fn the_prescaler_waits_for_an_update() {
        let mut timer = timer();
        write(&mut timer, ARR, 8399, Time::ZERO);
        write(&mut timer, CR1, CR1_CEN, Time::ZERO);
        write(&mut timer, PSC, 83, Time::ZERO);
        assert_eq!(timer.read(CNT, Time::from_micros(50)), 4200, "still undivided");
        // The update comes after 100 µs; from then on a count takes 1 µs.
        assert_eq!(timer.read(CNT, Time::from_micros(123)), 23);
    }

    #[test]
    fn compare_and_update_interrupts_come_on_time() {
        let mut timer = timer();
        for (offset, value) in [(PSC, 83), (ARR, 0xffff), (EGR, 1), (SR, 0)] {
            write(&mut timer, offset, value, Time::ZERO);
        }
        write(&mut timer, CCR1, 0x8000, Time::ZERO);
        write(&mut timer, DIER, 3, Time::ZERO);
        write(&mut timer, CR1, CR1_CEN, Time::ZERO);
        let half = Time::from_micros(0x8000);
        assert_eq!(timer.next_event(), Some(half));
        timer.advance(half - Time::from_picos(1));
        assert!(!timer.interrupt());
        timer.advance(half);
        assert!(timer.interrupt());
        assert_eq!(timer.read(SR, half) & 3, 2);
        write(&mut timer, SR, !2, half);
        assert!(!timer.interrupt());
        let full = Time::from_micros(0x1_0000);
        assert_eq!(timer.next_event(), Some(full));
        timer.advance(full);
        assert_eq!(timer.read(SR, full) & 3, 1);
    }

    #[test]
    fn a_compare_value_beyond_the_reload_value_matches_at_overflow() {
        let mut timer = timer();
        write(&mut timer, ARR, 83, Time::ZERO);
        write(&mut timer, CCR1, 1000, Time::ZERO);
        write(&mut timer, DIER, 2, Time::ZERO);
        write(&mut timer, CR1, CR1_CEN, Time::ZERO);
        assert_eq!(timer.next_event(), Some(Time::from_micros(1)));
    }

    #[test]
    fn update_generation_obeys_urs() {
        let mut timer = timer();
        write(&mut timer, CR1, CR1_URS, Time::ZERO);
        write(&mut timer, EGR, 1, Time::ZERO);
        assert_eq!(timer.read(SR, Time::ZERO), 0);
        write(&mut timer, CR1, 0, Time::ZERO);
        write(&mut timer, EGR, 1, Time::ZERO);
        assert_eq!(timer.read(SR, Time::ZERO), UIF);
    }

    #[test]
    fn bitcrazes_motor_signal() {
        let mut timer = timer();
        write(&mut timer, ARR, 255, Time::ZERO);
        write(&mut timer, CCMR1, 6 << 12 | 1 << 11, Time::ZERO);
        write(&mut timer, CCR1 + 4, 64, Time::ZERO);
        assert_eq!(timer.output(1), None, "CC2E is off");
        write(&mut timer, CCER, 1 << 4, Time::ZERO);
        assert_eq!(timer.output(1), Some(Pwm::HIGH), "the counter stands below the compare value");
        write(&mut timer, CR1, CR1_CEN, Time::ZERO);
        assert_eq!(timer.output(1), Some(Pwm { duty: 0.25, frequency_hz: 328_125.0 }));
        write(&mut timer, CCER, 3 << 4, Time::ZERO);
        assert_eq!(timer.output(1), Some(Pwm { duty: 0.75, frequency_hz: 328_125.0 }));
        write(&mut timer, CCR1 + 4, 0, Time::ZERO);
        write(&mut timer, CCER, 1 << 4, Time::ZERO);
        assert_eq!(timer.output(1), Some(Pwm::LOW));
    }

    #[test]
    fn a_reload_value_of_zero_blocks_the_counter() {
        let mut timer = timer();
        write(&mut timer, DIER, 1, Time::ZERO);
        write(&mut timer, ARR, 0, Time::ZERO);
        write(&mut timer, CR1, CR1_CEN, Time::ZERO);
        assert_eq!(timer.next_event(), None);
        assert_eq!(timer.read(CNT, Time::from_micros(1)), 0);
        write(&mut timer, ARR, 83, Time::from_micros(1));
        assert_eq!(timer.next_event(), Some(Time::from_micros(2)));
    }

    #[test]
    fn modes_without_a_model_are_refused() {
        let mut timer = timer();
        assert!(!timer.write(CR1, Write::new(0, Width::Word, 1 << 4), Time::ZERO));
        assert!(!timer.write(SMCR, Write::new(0, Width::Word, 7), Time::ZERO));
    }

    #[test]
    fn an_advanced_timer_needs_its_main_output() {
        let mut timer = Timer::new(TimerKind::Advanced, 48_000_000, Time::ZERO);
        for (offset, value) in [(PSC, 23), (ARR, 9999), (CCMR2, 6 << 4), (CCER, 1 << 8 | 1 << 9)] {
            write(&mut timer, offset, value, Time::ZERO);
        }
        write(&mut timer, EGR, 1, Time::ZERO);
        write(&mut timer, CCR1 + 8, 2500, Time::ZERO);
        write(&mut timer, CR1, CR1_CEN, Time::ZERO);
        assert_eq!(timer.output(2), None);
        write(&mut timer, BDTR, BDTR_MOE, Time::ZERO);
        assert_eq!(timer.output(2), Some(Pwm { duty: 0.75, frequency_hz: 200.0 }));
        assert_eq!(timer.separate_interrupts(), [false; 2]);
        write(&mut timer, DIER, 1 << 3, Time::ZERO);
        timer.advance(Time::from_micros(1_250));
        assert_eq!(timer.separate_interrupts(), [false, true]);
    }

    #[test]
    fn missing_channels_of_a_timer_are_ignored() {
        let mut timer = Timer::new(TimerKind::Single, 48_000_000, Time::ZERO);
        write(&mut timer, CCR1 + 4, 5, Time::ZERO);
        assert_eq!(timer.read(CCR1 + 4, Time::ZERO), 0);
        write(&mut timer, DIER, 0x1e, Time::ZERO);
        write(&mut timer, CR1, CR1_CEN, Time::ZERO);
        timer.advance(Time::from_millis(2));
        assert_eq!(timer.read(SR, Time::from_millis(2)), UIF | 2, "one channel");
    }

    /// A timer at 1 MHz with a period of 2^16, whose channel 2 captures these edges of its pin.
    fn capturing(edges: u32) -> Timer {
        let mut timer = Timer::new(TimerKind::General, 48_000_000, Time::ZERO);
        let enabled = (CCER_ENABLE | edges) << 4;
        for (offset, value) in
            [(PSC, 47), (CCMR1, 1 << 8), (CCER, enabled), (DIER, 1 << 10), (EGR, 1)]
        {
            write(&mut timer, offset, value, Time::ZERO);
        }
        write(&mut timer, CR1, CR1_CEN, Time::ZERO);
        timer
    }

    #[test]
    fn captures_the_edges_that_are_chosen() {
        for (edges, expected) in
            [(0, vec![10, 30]), (CCER_FALLING, vec![20, 40]), (CCER_BOTH, vec![10, 20, 30, 40])]
        {
            let mut timer = capturing(edges);
            let mut captured = vec![];
            for (us, high) in [(10, true), (20, false), (30, true), (40, false)] {
                let now = Time::from_micros(65_536 + us);
                timer.capture(1, high, now);
                timer.capture(0, high, now);
                if timer.dma_request(1) {
                    captured.push(timer.read(CCR1 + 4, now));
                    assert!(!timer.dma_request(1), "reading clears the flag");
                }
            }
            assert_eq!(captured, expected);
        }
    }

    #[test]
    fn an_unread_capture_is_lost_and_reported() {
        let mut timer = capturing(CCER_BOTH);
        timer.capture(1, true, Time::from_micros(5));
        write(&mut timer, CCR1 + 4, 1234, Time::from_micros(6));
        assert_eq!(timer.register(SR) & 0x404, 0x004);
        timer.capture(1, false, Time::from_micros(7));
        assert_eq!(timer.register(SR) & 0x404, 0x404);
        assert_eq!(timer.read(CCR1 + 4, Time::from_micros(8)), 7);
        assert_eq!(timer.register(SR) & 0x404, 0x400);
        // A match of the timer's own count is no event of a capturing channel.
        write(&mut timer, DIER, 1 << 2, Time::from_micros(9));
        assert_eq!(timer.next_event(), None);
        assert_eq!(timer.read(SR, Time::from_millis(70)) & 4, 0);
        timer.capture(1, true, Time::from_millis(71));
        assert!(timer.interrupt());
    }

    #[test]
    fn captures_without_a_model_are_refused() {
        // A capture of the neighboring pin, one divided by two, and one with a filter.
        for mode in [2, 1 | 1 << 2, 1 | 1 << 4] {
            let mut timer = Timer::new(TimerKind::General, 48_000_000, Time::ZERO);
            assert!(!timer.write(CCMR2, Write::new(CCMR2, Width::Word, mode << 8), Time::ZERO));
        }
    }

    #[test]
    fn a_change_of_clock_keeps_the_count() {
        let mut timer = timer();
        write(&mut timer, CR1, CR1_CEN, Time::ZERO);
        timer.set_clock(42_000_000, Time::from_micros(1));
        assert_eq!(timer.read(CNT, Time::from_micros(2)), 84 + 42);
    }
}
