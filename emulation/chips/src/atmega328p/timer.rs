//! Timers 0, 1 and 2 (data sheet DS40002061B, chapters 15, 16 and 18).
//!
//! A timer is computed on access: between two accesses only the flags that were raised are stored.
//! `OCRnx` takes effect at once in the PWM modes, too, where the chip waits for the end of the
//! slope.

/// TOVn, OCFnA, OCFnB and ICF1 in TIFRn; the same bits of TIMSKn enable the interrupts.
pub const OVERFLOW: u8 = 1 << 0;
pub const COMPARE_A: u8 = 1 << 1;
pub const COMPARE_B: u8 = 1 << 2;
pub const CAPTURE: u8 = 1 << 5;

/// Bits of TCCR1B: input capture on the rising edge, and its noise canceler.
pub const RISING: u8 = 1 << 6;
pub const CANCEL_NOISE: u8 = 1 << 7;

/// One of the three timers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TimerNumber {
    Timer0,
    Timer1,
    Timer2,
}

/// The counting mode.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct CountingMode {
    top: u32,
    /// True if the timer counts down again from the top instead of restarting at 0.
    two_slopes: bool,
}

/// A pulse-width modulated output.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Wave {
    /// The counts for which the signal is high, of [`period`](Self::period).
    pub high: u32,
    /// The counts of a period.
    pub period: u32,
    /// Cycles of the chip's clock per count.
    pub prescaler: u32,
}

/// A timer and its registers.
#[derive(Clone, Debug)]
pub struct Timer {
    kind: TimerNumber,
    pub tccra: u8,
    pub tccrb: u8,
    pub ocr: [u16; 2],
    pub icr: u16,
    /// TIFRn.
    pub flags: u8,
    /// TIMSKn.
    pub enabled: u8,
    count: u32,
    is_falling: bool,
    /// The cycle of the peripherals' clock up to which the timer is computed.
    computed: u64,
    /// The cycle at which the prescaler was 0.
    origin: u64,
}

impl Timer {
    pub fn new(kind: TimerNumber) -> Self {
        Timer {
            kind,
            tccra: 0,
            tccrb: 0,
            ocr: [0; 2],
            icr: 0,
            flags: 0,
            enabled: 0,
            count: 0,
            is_falling: false,
            computed: 0,
            origin: 0,
        }
    }

    /// Returns the largest count.
    fn max(&self) -> u32 {
        if self.kind == TimerNumber::Timer1 { 0xffff } else { 0xff }
    }

    /// Returns the cycles per count; none if the timer stands still, as it does with an external
    /// clock.
    fn prescaler(&self) -> Option<u32> {
        match (self.kind, self.tccrb & 7) {
            (TimerNumber::Timer2, select) => {
                [None, Some(1), Some(8), Some(32), Some(64), Some(128), Some(256), Some(1024)]
                    [usize::from(select)]
            }
            (_, select) => [None, Some(1), Some(8), Some(64), Some(256), Some(1024), None, None]
                [usize::from(select)],
        }
    }

    /// Returns the counting mode (tables 15-8, 16-4 and 18-8).
    fn shape(&self) -> CountingMode {
        let one = |top| CountingMode { top, two_slopes: false };
        let two = |top| CountingMode { top, two_slopes: true };
        let (a, icr) = (u32::from(self.ocr[0]), u32::from(self.icr));
        if self.kind == TimerNumber::Timer1 {
            return match (self.tccrb >> 3 & 3) << 2 | self.tccra & 3 {
                0 | 13 => one(0xffff),
                1 => two(0xff),
                2 => two(0x1ff),
                3 => two(0x3ff),
                4 | 15 => one(a),
                5 => one(0xff),
                6 => one(0x1ff),
                7 => one(0x3ff),
                8 | 10 => two(icr),
                9 | 11 => two(a),
                _ => one(icr),
            };
        }
        match self.tccrb >> 1 & 4 | self.tccra & 3 {
            1 => two(0xff),
            5 => two(a),
            2 | 7 => one(a),
            _ => one(0xff),
        }
    }

    /// Returns the number of counts between two cycles.
    fn ticks(&self, from: u64, to: u64, prescaler: u32) -> u64 {
        let since = |cycle: u64| (cycle - self.origin) / u64::from(prescaler);
        since(to) - since(from)
    }

    /// Counts until `cycle` and raises the flags.
    pub fn compute(&mut self, cycle: u64) {
        if cycle <= self.computed {
            return;
        }
        let from = std::mem::replace(&mut self.computed, cycle);
        let Some(prescaler) = self.prescaler() else { return };
        let mut left = self.ticks(from, cycle, prescaler);
        let shape = self.shape();
        while left > 0 {
            // Each turn goes to the next count at which anything happens: a compare match, whose
            // flag comes with the count after it, or the end of a slope. Two periods raise every
            // flag that can be raised.
            let period = self.period(shape);
            if left > 2 * u64::from(period) {
                left = u64::from(period) + left % u64::from(period);
            }
            let step = u64::from(self.step(shape)).min(left);
            left -= step;
            self.move_by(step as u32, shape);
        }
    }

    fn period(&self, shape: CountingMode) -> u32 {
        if self.count > shape.top {
            return self.max() + 1;
        }
        if shape.two_slopes { (2 * shape.top).max(1) } else { shape.top + 1 }
    }

    /// Returns the number of counts to the next flag or end of a slope.
    fn step(&self, shape: CountingMode) -> u32 {
        let end = if self.count > shape.top { self.max() } else { shape.top };
        let matches = self.ocr.map(u32::from);
        if shape.two_slopes && self.is_falling {
            let lower = matches.into_iter().filter(|ocr| *ocr <= self.count);
            let next = lower.map(|ocr| self.count - ocr + 1).min().unwrap_or(u32::MAX);
            return next.min(self.count).max(1);
        }
        let higher = matches.into_iter().filter(|ocr| *ocr >= self.count && *ocr <= end);
        let next = higher.map(|ocr| ocr - self.count + 1).min().unwrap_or(u32::MAX);
        let turn = end - self.count + u32::from(!shape.two_slopes);
        next.min(turn).max(1)
    }

    /// Advances by `counts`, which is not beyond the next flag or end of a slope.
    fn move_by(&mut self, counts: u32, shape: CountingMode) {
        let before = self.count;
        let last = if shape.two_slopes && self.is_falling {
            before + 1 - counts
        } else {
            before + counts - 1
        };
        for (ocr, flag) in self.ocr.into_iter().zip([COMPARE_A, COMPARE_B]) {
            // The flag comes with the count after the match.
            if u32::from(ocr) == last {
                self.flags |= flag;
            }
        }
        let end = if before > shape.top { self.max() } else { shape.top };
        if !shape.two_slopes {
            self.count = before + counts;
            if self.count > end {
                self.count = 0;
                if end == self.max() || self.overflows_at_top() {
                    self.flags |= OVERFLOW;
                }
            }
            return;
        }
        if self.is_falling {
            self.count = before.saturating_sub(counts);
            if self.count == 0 {
                self.is_falling = false;
                self.flags |= OVERFLOW;
            }
        } else {
            self.count = before + counts;
            if self.count >= end {
                self.count = end;
                self.is_falling = end > 0;
            }
        }
    }

    /// Returns true if TOVn is raised at the top, as in fast PWM. CTC raises it at the largest
    /// count only.
    fn overflows_at_top(&self) -> bool {
        match self.kind {
            TimerNumber::Timer1 => {
                matches!((self.tccrb >> 3 & 3) << 2 | self.tccra & 3, 5..=7 | 14 | 15)
            }
            _ => self.tccra & 3 == 3,
        }
    }

    /// Returns the time at which the next enabled flag that is not yet set is raised, in cycles of
    /// the peripherals' clock.
    pub fn next_event(&self) -> Option<u64> {
        let wanted = self.enabled & !self.flags & (OVERFLOW | COMPARE_A | COMPARE_B);
        if wanted == 0 {
            return None;
        }
        let prescaler = u64::from(self.prescaler()?);
        let mut ahead = self.clone();
        ahead.flags = 0;
        let shape = self.shape();
        let mut counts = 0_u64;
        // Two periods raise every flag that can be raised, and a period has at most six turns and
        // flags.
        for _ in 0..16 {
            let step = ahead.step(shape);
            ahead.move_by(step, shape);
            counts += u64::from(step);
            if ahead.flags & wanted != 0 {
                let ticks = (self.computed - self.origin) / prescaler + counts;
                return Some(self.origin + ticks * prescaler);
            }
        }
        None
    }

    /// Returns TCNTn, as last computed.
    pub fn count(&self) -> u16 {
        self.count as u16
    }

    pub fn set_count(&mut self, count: u16) {
        self.count = u32::from(count) & self.max();
    }

    /// Writes TCCRnA and TCCRnB.
    pub fn configure(&mut self, tccra: u8, tccrb: u8) {
        self.tccra = tccra;
        self.tccrb = tccrb;
        if !self.shape().two_slopes {
            self.is_falling = false;
        }
    }

    /// Resets the prescaler, as GTCCR does.
    pub fn reset_prescaler(&mut self, cycle: u64) {
        self.origin = cycle;
    }

    /// Handles an edge that TCCR1B selects: stores the count.
    pub fn capture(&mut self) {
        self.icr = self.count as u16;
        self.flags |= CAPTURE;
    }

    /// Returns the signal at OCnA or OCnB. Returns none if the pin belongs to the port or is not a
    /// PWM output.
    pub fn wave(&self, output: usize) -> Option<Wave> {
        let mode = self.tccra >> (6 - 2 * output) & 3;
        let shape = self.shape();
        let is_pwm = shape.two_slopes || self.overflows_at_top();
        let prescaler = self.prescaler();
        if mode < 2 || !is_pwm {
            return None;
        }
        let ocr = u32::from(self.ocr[output]).min(shape.top);
        // In fast PWM the output is high for OCRnx + 1 of TOP + 1 counts; with two slopes it can be
        // constantly low or high (15.7.3, 15.7.4).
        let (high, period) =
            if shape.two_slopes { (2 * ocr, 2 * shape.top) } else { (ocr + 1, shape.top + 1) };
        let high = if mode == 2 { high } else { period - high };
        Some(Wave { high, period, prescaler: prescaler.unwrap_or(0) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn timer(kind: TimerNumber, tccra: u8, tccrb: u8) -> Timer {
        let mut timer = Timer::new(kind);
        timer.configure(tccra, tccrb);
        timer
    }

    #[test]
    fn an_eight_bit_timer_overflows_after_256_counts_of_1024_cycles() {
        let mut timer = timer(TimerNumber::Timer0, 0, 5);
        timer.ocr = [0xff, 10];
        timer.enabled = COMPARE_A | COMPARE_B;
        // The flag comes with the count after the match: 15.9, figure 15-10.
        assert_eq!(timer.next_event(), Some(11 * 1024));
        timer.compute(11 * 1024 - 1);
        assert_eq!((timer.count(), timer.flags), (10, 0));
        timer.compute(11 * 1024);
        assert_eq!((timer.count(), timer.flags), (11, COMPARE_B));
        assert_eq!(timer.next_event(), Some(256 * 1024));
        timer.compute(256 * 1024);
        assert_eq!((timer.count(), timer.flags), (0, COMPARE_A | COMPARE_B | OVERFLOW));
    }

    #[test]
    fn motors_frequency_is_that_of_two_slopes() {
        // 18.7.4: clk / (N * 510); the overflow comes at the bottom.
        let mut timer = timer(TimerNumber::Timer2, 0xa1, 2);
        timer.ocr = [75, 255];
        timer.enabled = OVERFLOW;
        assert_eq!(timer.next_event(), Some(510 * 8));
        timer.compute(100 * 8);
        assert_eq!(timer.count(), 100);
        timer.compute(300 * 8);
        assert_eq!((timer.count(), timer.flags & OVERFLOW), (210, 0));
        timer.compute(510 * 8);
        assert_eq!((timer.count(), timer.flags), (0, OVERFLOW | COMPARE_A | COMPARE_B));
        assert_eq!(timer.next_event(), None, "the flag is up");
        timer.flags = 0;
        assert_eq!(timer.next_event(), Some(1020 * 8));
        assert_eq!(timer.wave(0), Some(Wave { high: 150, period: 510, prescaler: 8 }));
        assert_eq!(timer.wave(1), Some(Wave { high: 510, period: 510, prescaler: 8 }));
    }

    #[test]
    fn ctc_ends_at_the_compare_value_and_a_count_above_it_runs_on() {
        let mut timer = timer(TimerNumber::Timer1, 0, 0x09);
        timer.ocr = [999, 0xffff];
        timer.compute(1000);
        assert_eq!((timer.count(), timer.flags), (0, COMPARE_A));
        timer.flags = 0;
        timer.set_count(1000);
        timer.compute(1000 + 64_535);
        assert_eq!((timer.count(), timer.flags), (65_535, 0));
        timer.compute(1000 + 64_536);
        assert_eq!((timer.count(), timer.flags), (0, OVERFLOW | COMPARE_B));
    }

    #[test]
    fn computing_often_changes_nothing() {
        for (tccra, tccrb) in [(0, 1), (1, 1), (3, 1), (0, 9), (2, 0x12), (1, 0x11), (3, 0x1a)] {
            let mut timers = [(); 2].map(|()| timer(TimerNumber::Timer1, tccra, tccrb));
            for timer in &mut timers {
                timer.ocr = [700, 90];
                timer.icr = 500;
            }
            let mut raised = 0;
            for cycle in 1..5_000 {
                timers[0].compute(cycle);
                raised |= timers[0].flags;
            }
            timers[1].compute(4_999);
            assert_eq!(timers[0].count(), timers[1].count(), "{tccra} {tccrb}");
            assert_eq!(raised, timers[1].flags, "{tccra} {tccrb}");
        }
    }

    #[test]
    fn events_come_when_they_were_announced() {
        for (tccra, tccrb) in [(0, 2), (1, 2), (3, 2), (2, 2), (1, 0x0a), (3, 0x0a)] {
            let mut timer = timer(TimerNumber::Timer0, tccra, tccrb);
            (timer.ocr, timer.enabled) = ([77, 30], OVERFLOW | COMPARE_A | COMPARE_B);
            for _ in 0..20 {
                let Some(at) = timer.next_event() else { break };
                timer.compute(at - 1);
                assert_eq!(timer.flags, 0, "{tccra} {tccrb} {at}");
                timer.compute(at);
                assert_ne!(timer.flags, 0, "{tccra} {tccrb} {at}");
                timer.flags = 0;
            }
        }
    }
}
