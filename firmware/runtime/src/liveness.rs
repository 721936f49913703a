//! The tasks' signs of life. The watchdog is fed only if every task has shown one since it was last
//! fed.

use core::cell::Cell;
use core::marker::PhantomData;

use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_time::Duration;

/// The longest time between two signs of life of a task, also while the task waits.
pub const BEAT: Duration = Duration::from_millis(50);

/// The period of the watchdog's task. Each task shows at least one sign of life between two checks.
pub const CHECK_PERIOD: Duration = Duration::from_millis(100);

/// The enum of the tasks of a robot. [`tasks!`](crate::tasks) implements this trait, so that no
/// task is left out of `ALL`.
pub trait TaskEnum: Copy + 'static {
    /// All tasks, in the order of their numbers.
    const ALL: &'static [Self];

    /// Returns the task's number, counted from 0.
    fn number(self) -> u8;
}

/// Declares the enum of the tasks that the watchdog observes, at most eight. The compiler numbers
/// them, so no number can stand twice and hide a dead task.
#[macro_export]
macro_rules! tasks {
    ($(#[$attribute:meta])* $visibility:vis enum $name:ident { $($task:ident),+ $(,)? }) => {
        $(#[$attribute])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        $visibility enum $name {
            $($task),+
        }

        impl $crate::liveness::TaskEnum for $name {
            const ALL: &'static [Self] = &[$($name::$task),+];

            fn number(self) -> u8 {
                self as u8
            }
        }
    };
}

/// The tasks that have shown a sign of life, with one bit each.
type Seen = Mutex<CriticalSectionRawMutex, Cell<u8>>;

/// The signs of life of a robot's tasks.
pub struct Liveness<T> {
    seen: Seen,
    tasks: PhantomData<T>,
}

/// The handle with which one task shows its sign of life.
#[derive(Clone, Copy)]
pub struct Pulse {
    seen: &'static Seen,
    bit: u8,
}

impl<T: TaskEnum> Liveness<T> {
    const ALL_SEEN: u8 = {
        assert!(T::ALL.len() <= 8, "there is one bit per task");
        u8::MAX >> (8 - T::ALL.len())
    };

    /// Returns the liveness of a robot whose tasks have shown no sign of life yet.
    pub const fn new() -> Self {
        Liveness { seen: Mutex::new(Cell::new(0)), tasks: PhantomData }
    }

    /// Returns the pulse of this task.
    pub fn pulse(&'static self, task: T) -> Pulse {
        Pulse { seen: &self.seen, bit: bit(task) }
    }

    /// Returns true if all tasks have shown a sign of life since this function last returned true.
    pub fn all_live(&self) -> bool {
        self.seen.lock(|seen| {
            let live = seen.get() == Self::ALL_SEEN;
            if live {
                seen.set(0);
            }
            live
        })
    }

    /// Returns the tasks without a sign of life.
    pub fn missing(&self) -> impl Iterator<Item = T> + use<T> {
        let seen = self.seen.lock(Cell::get);
        T::ALL.iter().copied().filter(move |task| seen & bit(*task) == 0)
    }
}

impl<T: TaskEnum> Default for Liveness<T> {
    fn default() -> Self {
        Self::new()
    }
}

fn bit<T: TaskEnum>(task: T) -> u8 {
    1_u8.wrapping_shl(task.number().into())
}

impl Pulse {
    /// Shows that the task lives.
    pub fn beat(&self) {
        self.seen.lock(|seen| seen.set(seen.get() | self.bit));
    }
}

#[cfg(test)]
mod tests {
    extern crate std;

    use std::vec::Vec;

    use super::{Liveness, TaskEnum};

    tasks! {
        enum Task { Script, Motors, Radio }
    }

    #[test]
    fn one_dead_task_is_enough() {
        static TASKS: Liveness<Task> = Liveness::new();
        let pulses = [Task::Script, Task::Motors, Task::Radio].map(|task| TASKS.pulse(task));
        assert!(!TASKS.all_live());
        pulses.iter().for_each(super::Pulse::beat);
        assert!(TASKS.all_live());
        // Each task has to show a new sign of life after that.
        let [script, motors, radio] = pulses;
        for _ in 0..10 {
            script.beat();
            radio.beat();
        }
        assert!(!TASKS.all_live());
        assert_eq!(TASKS.missing().collect::<Vec<_>>(), [Task::Motors]);
        motors.beat();
        assert_eq!(TASKS.missing().count(), 0);
        assert!(TASKS.all_live());
        assert_eq!(TASKS.missing().collect::<Vec<_>>(), Task::ALL);
    }

    #[test]
    fn up_to_eight_tasks() {
        tasks! {
            enum Eight { A, B, C, D, E, F, G, H }
        }
        static TASKS: Liveness<Eight> = Liveness::new();
        for task in Eight::ALL {
            assert!(!TASKS.all_live());
            TASKS.pulse(*task).beat();
        }
        assert!(TASKS.all_live());
    }
}
