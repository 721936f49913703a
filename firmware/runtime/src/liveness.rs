//! The tasks' signs of life. The watchdog is fed only if every task has shown one since it was last
//! fed.

use core::cell::Cell;

use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_time::Duration;

/// The longest time between two signs of life of a task, also while the task waits.
pub const BEAT: Duration = Duration::from_millis(50);

/// The period of the watchdog's task. Each task shows at least one sign of life between two checks.
pub const LOOK: Duration = Duration::from_millis(100);

/// The tasks of a robot that have shown a sign of life, up to eight, with one bit each.
pub struct Liveness {
    all: u8,
    seen: Mutex<CriticalSectionRawMutex, Cell<u8>>,
}

/// The handle with which one task shows its sign of life.
#[derive(Clone, Copy)]
pub struct Pulse {
    of: &'static Liveness,
    bit: u8,
}

impl Liveness {
    /// Returns the liveness of a robot with this number of tasks, at most eight.
    pub const fn new(tasks: u8) -> Self {
        let all = if tasks < 8 { (1 << tasks) - 1 } else { u8::MAX };
        Liveness { all, seen: Mutex::new(Cell::new(0)) }
    }

    /// Returns the pulse of task `number`, counted from 0.
    pub const fn pulse(&'static self, number: u8) -> Pulse {
        Pulse { of: self, bit: 1 << (number & 7) }
    }

    /// Returns true if all tasks have shown a sign of life since this function last returned true.
    pub fn all_live(&self) -> bool {
        self.seen.lock(|seen| {
            let live = seen.get() == self.all;
            if live {
                seen.set(0);
            }
            live
        })
    }

    /// Returns the tasks without a sign of life, one bit each.
    pub fn missing(&self) -> u8 {
        self.seen.lock(|seen| self.all & !seen.get())
    }
}

impl Pulse {
    /// Shows that the task lives.
    pub fn beat(&self) {
        self.of.seen.lock(|seen| seen.set(seen.get() | self.bit));
    }
}

#[cfg(test)]
mod tests {
    use super::Liveness;

    #[test]
    fn one_dead_task_is_enough() {
        static TASKS: Liveness = Liveness::new(3);
        let [a, b, c] = [TASKS.pulse(0), TASKS.pulse(1), TASKS.pulse(2)];
        assert!(!TASKS.all_live());
        [a, b, c].iter().for_each(super::Pulse::beat);
        assert!(TASKS.all_live());
        // Each task has to show a new sign of life after that.
        for _ in 0..10 {
            a.beat();
            c.beat();
        }
        assert!(!TASKS.all_live());
        assert_eq!(TASKS.missing(), 0b010);
        b.beat();
        assert!(TASKS.all_live());
    }

    #[test]
    fn up_to_eight_tasks() {
        static TASKS: Liveness = Liveness::new(8);
        (0..8).for_each(|number| TASKS.pulse(number).beat());
        assert!(TASKS.all_live());
    }
}
