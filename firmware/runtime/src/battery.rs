//! The reactions to a battery that runs down, in steps: the robot warns, stops its motors, and
//! switches off.
//!
//! A voltage counts only after several low readings in a row, because starting motors pull it down
//! for a moment. A battery recovers without its load, so a step down is final until the battery is
//! charged or the robot is switched on again.

/// The number of readings in a row below a limit that lead one step down. Robots read the voltage
/// once per second.
const LOW_READINGS: u8 = 5;

/// The phases from one flash of a low battery to the next, in units of
/// [`PHASE`](crate::blink::PHASE): 2 s. An empty battery flashes four times as often.
const FLASH_PHASES: u32 = 40;

/// The state of charge of a battery, after the steps down that were taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd)]
#[repr(u8)]
pub enum Charge {
    /// The battery has enough charge for all functions.
    Enough,
    /// The battery will be empty soon: the robot warns.
    Low,
    /// The robot's motors have no power.
    Empty,
    /// The robot switches itself off, since further discharge would damage the battery.
    Flat,
}

impl Charge {
    /// Returns the charge with this number, as `charge as u8` gives it. Greater numbers are
    /// [`Charge::Flat`].
    pub const fn of_number(number: u8) -> Self {
        match number {
            0 => Charge::Enough,
            1 => Charge::Low,
            2 => Charge::Empty,
            _ => Charge::Flat,
        }
    }

    /// Returns true if the warning LED is lit in this phase, in units of
    /// [`PHASE`](crate::blink::PHASE).
    pub const fn is_flash(self, phase: u32) -> bool {
        match self {
            Charge::Low => phase.is_multiple_of(FLASH_PHASES),
            Charge::Empty => phase.is_multiple_of(FLASH_PHASES / 4),
            Charge::Enough | Charge::Flat => false,
        }
    }
}

/// The state machine of the charge: steps down at low readings, and back up at the charger.
pub struct Ladder {
    limits_mv: [u16; 3],
    charge: Charge,
    low_readings: u8,
}

impl Ladder {
    /// Returns a ladder at `charge`. The limits, in mV, are those below which [`Charge::Low`],
    /// [`Charge::Empty`] and [`Charge::Flat`] begin.
    pub const fn new(limits_mv: [u16; 3], charge: Charge) -> Self {
        Ladder { limits_mv, charge, low_readings: 0 }
    }

    /// Processes one reading. The charge steps down after enough low readings in a row; with the
    /// charger it returns to [`Charge::Enough`].
    pub fn update(&mut self, battery_mv: u16, is_charging: bool) -> Charge {
        let step = self.charge as u8;
        let is_low = self.limits_mv.get(usize::from(step)).is_some_and(|limit| battery_mv < *limit);
        if is_charging {
            self.charge = Charge::Enough;
        }
        if is_charging || !is_low {
            self.low_readings = 0;
            return self.charge;
        }
        self.low_readings += 1;
        if self.low_readings == LOW_READINGS {
            self.charge = Charge::of_number(step + 1);
            self.low_readings = 0;
        }
        self.charge
    }
}

#[cfg(test)]
mod tests {
    use super::{Charge, Ladder};

    const LIMITS_MV: [u16; 3] = [3200, 3100, 3000];

    fn updated(ladder: &mut Ladder, times: usize, battery_mv: u16) -> Charge {
        let mut charge = ladder.charge;
        for _ in 0..times {
            charge = ladder.update(battery_mv, false);
        }
        charge
    }

    #[test]
    fn each_step_takes_five_low_readings_in_a_row() {
        let mut ladder = Ladder::new(LIMITS_MV, Charge::Enough);
        assert_eq!(updated(&mut ladder, 4, 3199), Charge::Enough);
        assert_eq!(
            updated(&mut ladder, 1, 3200),
            Charge::Enough,
            "not below the limit: from the start"
        );
        assert_eq!(updated(&mut ladder, 4, 3199), Charge::Enough);
        assert_eq!(updated(&mut ladder, 1, 3199), Charge::Low);
        assert_eq!(updated(&mut ladder, 100, 3100), Charge::Low);
        // The charge falls one step at a time, even at 0 V.
        assert_eq!(updated(&mut ladder, 5, 0), Charge::Empty);
        assert_eq!(updated(&mut ladder, 4, 0), Charge::Empty);
        assert_eq!(updated(&mut ladder, 1, 0), Charge::Flat);
        assert_eq!(updated(&mut ladder, 1000, 0), Charge::Flat);
    }

    #[test]
    fn only_the_charger_leads_up() {
        for charge in [Charge::Low, Charge::Empty, Charge::Flat] {
            let mut ladder = Ladder::new(LIMITS_MV, charge);
            assert_eq!(updated(&mut ladder, 100, 4200), charge);
            assert_eq!(ladder.update(2500, true), Charge::Enough);
        }
        // Low readings from before the charger do not count.
        let mut ladder = Ladder::new(LIMITS_MV, Charge::Enough);
        updated(&mut ladder, 4, 3000);
        ladder.update(3000, true);
        assert_eq!(updated(&mut ladder, 4, 3000), Charge::Enough);
    }

    #[test]
    fn a_low_battery_flashes_every_two_seconds_and_an_empty_one_four_times_as_often() {
        let flashes = |charge: Charge| (0..400).filter(|phase| charge.is_flash(*phase)).count();
        let all = [Charge::Enough, Charge::Low, Charge::Empty, Charge::Flat];
        assert_eq!(all.map(flashes), [0, 10, 40, 0]);
    }

    #[test]
    fn numbers_are_those_of_the_charges() {
        for charge in [Charge::Enough, Charge::Low, Charge::Empty, Charge::Flat] {
            assert_eq!(Charge::of_number(charge as u8), charge);
        }
    }
}
