//! Requests of a client.

use serde::Deserialize;

/// A request: an object whose `do` names it.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(tag = "do", rename_all = "snake_case", deny_unknown_fields)]
pub enum Request {
    /// The run goes on.
    Play {
        /// Times real time; without it as fast as it can.
        rate: Option<f64>,
    },
    /// The run stands still.
    Pause,
    /// The run goes on for some ticks and stands still.
    Step {
        /// The number of ticks.
        ticks: u32,
    },
    /// The run is taken to a tick.
    GoTo {
        /// The tick.
        tick: u64,
    },
    /// A command is given.
    Command {
        /// The keys of an `[[event]]` without `at`.
        text: String,
    },
    /// The memory of a robot is an event from now on.
    Inspect {
        /// Its number in the scenario; none: no robot's memory is told.
        robot: Option<usize>,
    },
    /// All commands are an event.
    Commands,
}
