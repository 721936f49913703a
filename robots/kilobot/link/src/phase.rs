//! The phase of the script. An emulator reads it in the robot's memory, and so counts steps that
//! the robot does not report.

/// The image's symbol for the byte that holds the [`Phase`]. The symbol takes no memory.
pub const SYMBOL: &str = "bbz_phase";

/// The phase of the script.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u8)]
pub enum Phase {
    /// The script was not started yet.
    New,
    /// The script runs its global code.
    Global,
    /// The script runs `init()` or a step.
    Runs,
    /// The script waits for the next tick.
    Waits,
    /// The robot refuses the image, or a fault stopped the script for good. The script does not run
    /// in this phase or a later one.
    Stopped,
    /// The script waits for the next tick of the pause before its restart.
    Rests,
    /// The robot handles messages at a tick of the pause.
    Relays,
}

/// Counts the completed steps for an observer that reads the phase whenever it may have changed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Steps {
    completed: u64,
    /// The phase that was read last.
    seen: u8,
    /// True if the running entry began with a tick; `init()` did not.
    is_step: bool,
}

impl Steps {
    /// Returns the number of completed steps.
    pub fn completed(&self) -> u64 {
        self.completed
    }

    /// Records the present phase.
    pub fn record(&mut self, phase: u8) {
        const RUNS: u8 = Phase::Runs as u8;
        const WAITS: u8 = Phase::Waits as u8;
        match (core::mem::replace(&mut self.seen, phase), phase) {
            (WAITS, RUNS) => self.is_step = true,
            (RUNS, WAITS) => self.completed += u64::from(core::mem::take(&mut self.is_step)),
            (RUNS, RUNS) => {}
            _ => self.is_step = false,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn completed(phases: &[Phase]) -> u64 {
        let mut steps = Steps::default();
        phases.iter().for_each(|phase| steps.record(*phase as u8));
        steps.completed()
    }

    #[test]
    fn a_step_begins_with_a_tick_and_ends_before_the_next() {
        use Phase::{Global, New, Relays, Rests, Runs, Stopped, Waits};
        assert_eq!(completed(&[New, Global, Runs, Waits]), 0, "init()");
        assert_eq!(completed(&[New, Global, Waits, Waits]), 0, "no step()");
        assert_eq!(completed(&[New, Global, Runs, Waits, Runs, Runs, Waits, Runs, Waits]), 2);
        assert_eq!(completed(&[New, Global, Waits, Runs, Runs, Runs]), 0, "it never ends");
        assert_eq!(completed(&[Waits, Runs, Waits, Runs, Stopped]), 1);
        // A fault, ticks of the pause, and the restart.
        let pause = [Rests, Relays, Rests, Relays, Relays, Rests, Rests];
        assert_eq!(completed(&[&[Waits, Runs][..], &pause, &[Global, Runs, Waits]].concat()), 0);
        assert_eq!(completed(&[&[Waits, Runs][..], &pause, &[Global, Waits]].concat()), 0);
        assert_eq!(completed(&[Rests, Global, Runs, Waits, Runs, Waits, Runs, Rests]), 1);
        // A reset during a step.
        assert_eq!(completed(&[Waits, Runs, New, Global, Runs, Waits]), 0);
    }
}
