//! SysTick, the core's own timer (ARMv7-M B3.3).

use bittybuzz_chips::Time;

const ENABLE: u32 = 1 << 0;
const TICKINT: u32 = 1 << 1;
/// Set for the core's clock, clear for an eighth of it.
const CLKSOURCE: u32 = 1 << 2;
const COUNTFLAG: u32 = 1 << 16;
const RELOAD_MAX: u32 = 0x00ff_ffff;

#[derive(Default)]
pub struct SysTick {
    control: u32,
    reload: u32,
    /// Ticks until the counter reaches zero, counted from `since`.
    left: u32,
    since: Time,
    wrapped: bool,
    core_hz: u64,
}

impl SysTick {
    pub fn new(core_hz: u64) -> Self {
        SysTick { core_hz, ..SysTick::default() }
    }

    fn hz(&self) -> u64 {
        if self.control & CLKSOURCE == 0 { self.core_hz / 8 } else { self.core_hz }
    }

    fn runs(&self) -> bool {
        self.control & ENABLE != 0 && self.reload != 0
    }

    pub fn set_core_hz(&mut self, hz: u64, now: Time) -> bool {
        let fired = self.advance(now);
        self.core_hz = hz;
        fired
    }

    /// Counts until `now`. Returns true if the counter reached zero and its interrupt is enabled.
    pub fn advance(&mut self, now: Time) -> bool {
        if !self.runs() {
            self.since = now;
            return false;
        }
        let ticks = (now - self.since).ticks(self.hz());
        if ticks == 0 {
            return false;
        }
        self.since = self.since + Time::of_ticks(ticks, self.hz());
        let period = u64::from(self.reload) + 1;
        // A counter at zero loads the reload value with the next tick.
        let left = if self.left == 0 { period } else { u64::from(self.left) };
        if ticks < left {
            self.left = (left - ticks) as u32;
            return false;
        }
        let beyond = (ticks - left) % period;
        self.left = if beyond == 0 { 0 } else { (period - beyond) as u32 };
        self.wrapped = true;
        self.control & TICKINT != 0
    }

    /// Returns the time of the next interrupt.
    pub fn next_event(&self) -> Option<Time> {
        let left = if self.left == 0 { self.reload + 1 } else { self.left };
        (self.runs() && self.control & TICKINT != 0)
            .then(|| self.since + Time::of_ticks(u64::from(left), self.hz()))
    }

    /// Reads the register at `offset` from SYST_CSR, at the time of the last
    /// [`advance`](Self::advance).
    pub fn read(&mut self, offset: u32) -> u32 {
        match offset {
            0x0 => {
                let flag = if std::mem::take(&mut self.wrapped) { COUNTFLAG } else { 0 };
                self.control | flag
            }
            0x4 => self.reload,
            0x8 => self.left,
            // SYST_CALIB: no reference clock, no calibration.
            _ => 0,
        }
    }

    pub fn write(&mut self, offset: u32, value: u32) {
        match offset {
            0x0 => self.control = value & (ENABLE | TICKINT | CLKSOURCE),
            0x4 => self.reload = value & RELOAD_MAX,
            // Any write clears the counter and COUNTFLAG.
            0x8 => {
                self.left = 0;
                self.wrapped = false;
            }
            _ => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fires_every_reload_plus_one_cycles() {
        let mut systick = SysTick::new(168_000_000);
        systick.write(4, 167_999);
        systick.write(8, 0);
        systick.write(0, 7);
        assert_eq!(systick.next_event(), Some(Time::from_millis(1)));
        assert!(!systick.advance(Time::from_micros(999)));
        assert_eq!(systick.read(8), 168);
        assert!(systick.advance(Time::from_millis(1)));
        assert_eq!(systick.read(8), 0);
        assert_eq!(systick.read(0), 7 | COUNTFLAG);
        assert_eq!(systick.read(0), 7, "reading clears it");
        assert_eq!(systick.next_event(), Some(Time::from_millis(2)));
    }
}
