//! The independent watchdog (RM0090 21, RM0091 23). Its window is always open, because no robot
//! uses it.

use super::bus::Write;
use crate::Time;

/// Offset of DBGMCU_APB1_FZ in DBGMCU, and its bit that stops the watchdog while the core is halted
/// (RM0090 38.16.4, RM0091 32.9.4).
pub(crate) const APB1_FREEZE: u32 = 0x08;
const FREEZE_WATCHDOG: u32 = 1 << 12;

pub(crate) struct Watchdog {
    lsi_hz: u64,
    prescaler: u32,
    reload: u32,
    unlocked: bool,
    expires: Option<Time>,
    /// The time that was left when the watchdog was stopped.
    left: Option<Time>,
}

impl Watchdog {
    /// Creates a stopped watchdog that counts the periods of an oscillator of `lsi_hz`.
    pub fn new(lsi_hz: u64) -> Self {
        Watchdog { lsi_hz, prescaler: 0, reload: 0xfff, unlocked: false, expires: None, left: None }
    }

    /// Returns the time at which the watchdog resets the chip.
    pub fn expires(&self) -> Option<Time> {
        self.expires
    }

    /// Returns true if the watchdog has expired. It then stands still until the reset that it
    /// requests.
    pub fn take_expiry(&mut self, now: Time) -> bool {
        let is_expired = self.expires.is_some_and(|at| at <= now);
        if is_expired {
            *self = Watchdog::new(self.lsi_hz);
        }
        is_expired
    }

    /// Called when a debugger halts or resumes the core. `freeze` is DBGMCU_APB1_FZ.
    pub fn set_halted(&mut self, is_halted: bool, freeze: u32, now: Time) {
        if !is_halted {
            self.go_on(now);
        } else if freeze & FREEZE_WATCHDOG != 0 {
            self.stop(now);
        }
    }

    /// Stops the watchdog, as DBGMCU does while the core is halted.
    fn stop(&mut self, now: Time) {
        if let Some(expires) = self.expires.take() {
            self.left = Some(expires.max(now) - now);
        }
    }

    /// Resumes counting after [`Self::stop`].
    fn go_on(&mut self, now: Time) {
        if let Some(left) = self.left.take() {
            self.expires = Some(now + left);
        }
    }

    /// Returns the time from a full counter to the reset: RLR + 1 periods of LSI / (4 * 2^PR), with
    /// a divider of at most 256.
    fn period(&self) -> Time {
        let divider = 4 << self.prescaler.min(6);
        Time::of_ticks(u64::from(self.reload + 1) * divider, self.lsi_hz)
    }

    pub fn read(&self, offset: u32) -> u32 {
        match offset {
            0x04 => self.prescaler,
            0x08 => self.reload,
            // WINR exists on the STM32F0 only.
            0x10 => 0xfff,
            // The key cannot be read. New values take effect at once, so SR reads as 0.
            _ => 0,
        }
    }

    pub fn write(&mut self, offset: u32, write: Write, now: Time) {
        match offset {
            0x00 => {
                let key = write.ones() & 0xffff;
                self.unlocked = key == 0x5555;
                if key == 0xcccc || key == 0xaaaa && self.expires.is_some() {
                    self.expires = Some(now + self.period());
                }
            }
            0x04 if self.unlocked => self.prescaler = write.merge(self.prescaler) & 7,
            0x08 if self.unlocked => self.reload = write.merge(self.reload) & 0xfff,
            _ => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Width;

    fn write(watchdog: &mut Watchdog, offset: u32, value: u32, now: Time) {
        watchdog.write(offset, Write::new(offset, Width::Word, value), now);
    }

    #[test]
    fn time_outs_are_the_manuals() {
        // RM0090 table 107: PR and RLR 0xfff to milliseconds at 32 kHz.
        for (prescaler, millis) in
            [(0, 512), (1, 1024), (2, 2048), (3, 4096), (4, 8192), (5, 16_384), (6, 32_768)]
        {
            let mut watchdog = Watchdog::new(32_000);
            write(&mut watchdog, 0x00, 0x5555, Time::ZERO);
            write(&mut watchdog, 0x04, prescaler, Time::ZERO);
            write(&mut watchdog, 0x00, 0xcccc, Time::ZERO);
            assert_eq!(watchdog.expires(), Some(Time::from_millis(millis)));
        }
    }

    #[test]
    fn a_stopped_watchdog_does_not_count() {
        let mut watchdog = Watchdog::new(32_000);
        watchdog.stop(Time::ZERO);
        watchdog.go_on(Time::from_millis(1));
        assert_eq!(watchdog.expires(), None, "it was never started");
        write(&mut watchdog, 0x00, 0xcccc, Time::from_millis(10));
        watchdog.stop(Time::from_millis(100));
        assert_eq!(watchdog.expires(), None);
        watchdog.go_on(Time::from_millis(5000));
        assert_eq!(watchdog.expires(), Some(Time::from_millis(5000 + 10 + 512 - 100)));
    }

    #[test]
    fn protected_until_unlocked_and_fed_by_key() {
        let mut watchdog = Watchdog::new(32_000);
        write(&mut watchdog, 0x08, 100, Time::ZERO);
        assert_eq!(watchdog.read(0x08), 0xfff);
        write(&mut watchdog, 0x00, 0xaaaa, Time::ZERO);
        assert_eq!(watchdog.expires(), None, "feeding does not start it");
        write(&mut watchdog, 0x00, 0xcccc, Time::ZERO);
        write(&mut watchdog, 0x00, 0xaaaa, Time::from_millis(100));
        assert_eq!(watchdog.expires(), Some(Time::from_millis(612)));
    }
}
