//! The watchdog (chapter 10.8), on its own oscillator of 128 kHz.

use crate::Time;

/// WDTCSR.
const WDIF: u8 = 1 << 7;
const WDIE: u8 = 1 << 6;
const WDCE: u8 = 1 << 4;
const WDE: u8 = 1 << 3;

const HZ: u64 = 128_000;
/// A change must follow the key within this number of cycles.
const UNLOCKED: u64 = 4;

/// The watchdog.
#[derive(Clone, Debug, Default)]
pub struct Watchdog {
    control: u8,
    unlocked_until: u64,
    due: Option<Time>,
    /// True if the watchdog has expired and resets the chip.
    pub is_expired: bool,
    /// The number of `wdr` instructions since the last reset.
    pub restarts: u64,
}

impl Watchdog {
    /// Returns the time-out: 2048 cycles of the watchdog's oscillator, doubled with each step of
    /// the prescaler (table 10-3).
    fn timeout(&self) -> Time {
        let prescaler = (self.control & 7 | self.control >> 2 & 8).min(9);
        Time::of_ticks(2048 << prescaler, HZ)
    }

    fn is_on(&self) -> bool {
        self.control & (WDE | WDIE) != 0
    }

    /// Restarts the time-out, as `wdr` does.
    pub fn restart(&mut self, now: Time) {
        self.restarts += 1;
        self.due = self.is_on().then(|| now + self.timeout());
    }

    /// Resets the watchdog. After a reset by the watchdog itself it stays on, with the shortest
    /// time-out (10.9.2).
    pub fn reset(&mut self, by_watchdog: bool, now: Time) {
        *self = Watchdog { control: if by_watchdog { WDE } else { 0 }, ..Watchdog::default() };
        self.restart(now);
    }

    pub fn next_event(&self) -> Option<Time> {
        self.due
    }

    pub fn advance(&mut self, now: Time) {
        let Some(due) = self.due.filter(|due| *due <= now) else { return };
        if self.control & WDIE != 0 {
            self.control |= WDIF;
        } else {
            self.is_expired = true;
        }
        self.due = Some(due + self.timeout());
    }

    pub fn interrupts(&self) -> bool {
        self.control & (WDIF | WDIE) == WDIF | WDIE
    }

    /// Acknowledges the interrupt. In interrupt and system reset mode the next time-out then resets
    /// the chip (10.9.2).
    pub fn acknowledge(&mut self) {
        self.control &= !WDIF;
        if self.control & WDE != 0 {
            self.control &= !WDIE;
        }
    }

    pub fn control(&self) -> u8 {
        self.control
    }

    /// Writes WDTCSR. With `is_forced`, MCUSR.WDRF keeps the watchdog on.
    pub fn set_control(&mut self, value: u8, cycle: u64, now: Time, is_forced: bool) {
        let was = self.control;
        let is_unlocked = was & WDCE != 0 && cycle <= self.unlocked_until;
        // WDIF is cleared by writing one; WDIE needs no key.
        let mut control = was & WDIF & !value | value & WDIE | was & !(WDIF | WDIE | WDCE);
        if is_unlocked {
            control = control & !0x2f | value & 0x2f;
        } else {
            // WDE can be set at any time.
            control |= value & WDE;
        }
        if is_forced {
            control |= WDE;
        }
        if value & (WDCE | WDE) == WDCE | WDE {
            control |= WDCE;
            self.unlocked_until = cycle + UNLOCKED;
        }
        self.control = control;
        // A change of the settings also restarts the time-out.
        if self.is_on() && (was & (WDE | WDIE) == 0 || is_unlocked) {
            self.restart(now);
        } else if !self.is_on() {
            self.due = None;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SECONDS_8: u8 = 0x21;

    /// Turns the watchdog on as avr-libc does: key, then value within four cycles.
    fn set(watchdog: &mut Watchdog, value: u8, cycle: u64) {
        watchdog.set_control(WDCE | WDE, cycle, Time::ZERO, false);
        watchdog.set_control(value, cycle + 2, Time::ZERO, false);
    }

    #[test]
    fn it_interrupts_after_eight_seconds_and_then_resets() {
        let mut watchdog = Watchdog::default();
        set(&mut watchdog, WDIE | WDE | SECONDS_8, 10);
        let due = Time::of_ticks(1 << 20, 128_000);
        assert_eq!(watchdog.next_event(), Some(due));
        watchdog.advance(due);
        assert!(watchdog.interrupts() && !watchdog.is_expired);
        watchdog.acknowledge();
        assert_eq!(watchdog.control() & WDIE, 0);
        watchdog.advance(due + due);
        assert!(watchdog.is_expired);
    }

    #[test]
    fn turning_off_needs_the_key_in_time() {
        let mut watchdog = Watchdog::default();
        set(&mut watchdog, WDE | 7, 0);
        watchdog.set_control(0, 100, Time::ZERO, false);
        assert_ne!(watchdog.control() & WDE, 0);
        watchdog.set_control(WDCE | WDE, 200, Time::ZERO, false);
        watchdog.set_control(0, 205, Time::ZERO, false);
        assert_ne!(watchdog.control() & WDE, 0);
        set(&mut watchdog, 0, 300);
        assert_eq!((watchdog.control() & WDE, watchdog.next_event()), (0, None));
        watchdog.reset(true, Time::ZERO);
        assert_eq!(watchdog.next_event(), Some(Time::from_millis(16)));
        watchdog.set_control(WDCE | WDE, 400, Time::ZERO, true);
        watchdog.set_control(0, 401, Time::ZERO, true);
        assert_ne!(watchdog.control() & WDE, 0, "MCUSR.WDRF is still set");
    }
}
