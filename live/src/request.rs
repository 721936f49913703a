//! Requests of a client.

use std::collections::{BTreeMap, BTreeSet};

use serde::Deserialize;

use crate::by_hand::WorldEdit;
use crate::stepping::StepTo;

/// Texts of scripts and of the scenario by their names, relative to the folder of the scenario.
pub type Texts = BTreeMap<String, String>;

/// A request. It is written as its name, or as an object with its name as the only key.
// A key `do` next to the others would not work: serde would have to buffer those, and then fails to
// return numbers if another crate enables serde_json's `arbitrary_precision`.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Request {
    /// Runs the session. At the end of the run it starts again at the beginning.
    Play {
        /// The speed as a multiple of real time; `None` is as fast as possible.
        #[cfg_attr(test, ts(optional))]
        rate: Option<f64>,
    },
    /// Pauses the run.
    Pause,
    /// Runs for some ticks, then pauses.
    Step {
        /// The number of ticks to run.
        ticks: u32,
    },
    /// Goes to a tick, back or forward, and pauses.
    GoTo {
        /// The tick to go to. A tick after the end means the end.
        tick: u64,
    },
    /// Gives a command.
    Command {
        /// The keys of an `[[event]]` without `at`.
        text: String,
    },
    /// Undoes the last change of the commands. The run is then the one to which only the commands
    /// that remain were given, at the same tick as before.
    Undo,
    /// Does a change again that was undone.
    Redo,
    /// Leaves a command out.
    DeleteCommand {
        /// The number of the command in the list of all commands.
        number: usize,
    },
    /// Subscribes to the memory of a robot.
    Inspect {
        /// The number of the robot in the scenario; `None` ends the subscription.
        robot: Option<usize>,
    },
    /// Subscribes to messages, and to a quantity of each robot.
    Watch {
        /// True to receive messages.
        messages: bool,
        /// The quantity, written as in `plot`.
        quantity: Option<String>,
    },
    /// Subscribes to curves: quantities from the beginning of the run up to now. Events have their
    /// points as they become known.
    Series {
        /// The quantities, written as in `plot`. Curves that are not named end.
        quantities: Vec<String>,
        /// The numbers of the robots whose own values are in the events, too.
        #[serde(default)]
        robots: Vec<usize>,
    },
    /// Computes no more points of the past.
    StopSeries,
    /// Sets whether the run pauses at a fault of a script.
    StopOnError { on: bool },
    /// Shows the script of a robot before a statement, while the world waits.
    Debug {
        /// The number of the robot.
        robot: usize,
        to: StepTo,
    },
    /// Sets the lines of scripts before which the run pauses, in place of the earlier ones.
    Breakpoints {
        /// The lines of scripts, by the names of the scripts.
        lines: BTreeMap<String, BTreeSet<u32>>,
        /// The number of the only robot for which the run pauses; `None` stands for all.
        #[serde(default)]
        robot: Option<usize>,
    },
    /// Requests all commands.
    Commands,
    /// Requests the session as a scenario.
    Scenario,
    /// Requests the text of a script.
    Script {
        /// The path of the script relative to the folder of the scenario.
        name: String,
    },
    /// Requests the compiler's messages about a text.
    Check {
        /// The script that the text would replace.
        name: String,
        text: String,
    },
    /// Starts the run again from the beginning with these texts.
    Run {
        /// The texts that the client shows. A text that is not given stays as it is; that of a script
        /// which no robot has is ignored.
        texts: Texts,
        /// True if the session's commands act again at their times, except those that load scripts.
        #[serde(default)]
        keep_changes: bool,
    },
    /// Changes the start of the world in the text of the scenario, and starts the run again from the
    /// beginning.
    Build {
        edit: WorldEdit,
        /// The texts that the client shows, as for `Run`. The text of the scenario must be the one
        /// with which the run began: numbers of things count in it.
        texts: Texts,
        #[serde(default)]
        keep_changes: bool,
    },
    /// Loads a text into robots as their script at the present tick.
    Load {
        /// The script of which the text is a draft.
        name: String,
        text: String,
        /// The ids of the robots; `None` selects all that have the script.
        #[cfg_attr(test, ts(optional))]
        robots: Option<Vec<u16>>,
        /// True if globals that hold numbers keep them.
        #[serde(default)]
        keep: bool,
    },
    /// Writes a text to the file of a script.
    Write {
        /// The path of the script relative to the folder of the scenario.
        name: String,
        text: String,
        /// SHA-256 of the text that the client takes for that of the file. If the file has another
        /// one, it is not written. `None` writes it in any case.
        #[serde(default)]
        over: Option<String>,
    },
    /// Keeps a text that was typed and not saved, so that the next session can offer it.
    Unsaved {
        /// The script, or the scenario.
        name: String,
        /// `None` if no text of this client is unsaved.
        text: Option<String>,
        /// SHA-256 of the text of the file.
        over: String,
    },
    /// Forgets an unsaved text that was offered.
    Discard {
        /// The `id` of the text.
        id: String,
    },
    /// Requests the explanation of a message of the compiler.
    Explain {
        /// The code of the message.
        code: String,
    },
    /// Requests the digest of the run.
    Digest,
    /// Runs trials next to the session. Each trial ends with an event.
    Sweep {
        /// A key of the scenario, such as `medium.ir.loss`, or a global, such as `global.JOIN`;
        /// `None` varies nothing.
        key: Option<String>,
        /// The values of the key.
        #[serde(default)]
        values: Vec<String>,
        /// The number of seeds for each value.
        seeds: u32,
        /// The quantity that is measured at the end of each trial, written as in `plot`.
        quantity: Option<String>,
    },
    /// Runs the texts of the run from the start to the end of the scenario. The result is an event
    /// with a file to hand in.
    HandIn {
        /// The name of the person who hands it in.
        by: String,
        /// The texts that the client shows. If the run is not one of these texts, nothing is handed in.
        texts: Texts,
    },
    /// Runs files that were handed in again, in the scenario with which the session was opened. The
    /// result is an event with the marks.
    Grade {
        /// The texts of the files, by their names.
        files: Texts,
    },
    /// Cancels the trials that have not finished.
    StopTrials,
}

impl Request {
    /// Returns true if the result depends on the tick of the run.
    pub fn is_about_now(&self) -> bool {
        use Request::{
            Build, Command, Commands, Debug, DeleteCommand, Digest, GoTo, Load, Play, Redo, Run,
            Scenario, Step, Undo,
        };
        matches!(
            self,
            Play { .. }
                | Step { .. }
                | GoTo { .. }
                | Command { .. }
                | Undo
                | Redo
                | DeleteCommand { .. }
                | Debug { .. }
                | Commands
                | Scenario
                | Run { .. }
                | Build { .. }
                | Load { .. }
                | Digest
        )
    }
}
