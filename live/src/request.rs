//! What a client may ask.

use serde::Deserialize;

/// A request.
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
    /// The run stands still after so many ticks.
    Step {
        /// How many.
        ticks: u32,
    },
    /// The run is taken to a tick.
    GoTo {
        /// Which.
        tick: u64,
    },
    /// A command is given.
    Command {
        /// The keys of an `[[event]]` without `at`.
        text: String,
    },
    /// The memory of a robot is told from now on.
    Inspect {
        /// Its number in the scenario; none: that of nobody.
        robot: Option<usize>,
    },
    /// All commands are told.
    Commands,
}
