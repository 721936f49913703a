//! Requests of a client.

use serde::Deserialize;

/// A request: its name, or an object with its name as the only key.
// Not with a key `do` beside the others: serde would have to keep those, and does not give numbers back if another crate asks
// serde_json for `arbitrary_precision`.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
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
        /// Its number in the scenario; without it the events end.
        robot: Option<usize>,
    },
    /// Messages, or a quantity of each robot, are events from now on.
    Watch {
        /// Messages are.
        messages: bool,
        /// The quantity, as `plot` has it.
        quantity: Option<String>,
    },
    /// All commands are an event.
    Commands,
    /// The session is an event, as a scenario.
    Scenario,
    /// The text of a script is an event.
    Script {
        /// Its path from the folder of the scenario.
        name: String,
    },
    /// The compiler's messages about a text are an event.
    Check {
        /// The script in whose place the text is.
        name: String,
        /// The text.
        text: String,
    },
    /// Robots get a text as their script.
    Run {
        /// The script of which the text is a draft.
        name: String,
        /// The text.
        text: String,
        /// Their ids; without them all that have the script.
        robots: Option<Vec<u16>>,
        /// Globals that hold numbers keep them.
        #[serde(default)]
        keep: bool,
    },
    /// A text is written to the file of a script.
    Write {
        /// The script.
        name: String,
        /// The text.
        text: String,
    },
    /// The explanation of a message of the compiler is an event.
    Explain {
        /// The code of the message.
        code: String,
    },
    /// The number that stands for the state of the run is an event.
    Digest,
    /// Trials are run beside the session, each an event.
    Sweep {
        /// A key of the scenario as `medium.ir.loss`, or a global as `global.JOIN`; without it all trials have the scenario's numbers.
        key: Option<String>,
        /// Its values.
        #[serde(default)]
        values: Vec<String>,
        /// The number of seeds with which each value is tried.
        seeds: u32,
        /// The quantity that is measured at the end of each trial, as in `plot`.
        quantity: Option<String>,
    },
    /// Run the scripts to the end of the scenario. The result is an event: a file to be handed in.
    HandIn {
        /// The name of who hands it in.
        by: String,
    },
    /// Trials that were not finished are given up.
    StopTrials,
}
