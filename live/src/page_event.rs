//! The events that a source sends to its client.
//!
//! The test of this module writes the same types as declarations for the scripts of the page,
//! together with the requests of [`Request`](crate::request::Request).

mod world;

use bittybuzz_fault::{FaultDescription, FaultPlace};
use serde::Serialize;

use crate::about::ScriptAbout;
use crate::by_hand::Thing;
use crate::compiler_message::CompilerMessage;
use crate::controls::Control;
use crate::grading::Mark;
use crate::inspection::MemoryDescription;
use crate::words::Word;

pub use world::{
    AssignmentDescription, BandDescription, BeginEvent, CommandDescription, ExpectationDescription,
    FenceDescription, GlyphName, GroupDescription, LightDescription, LinkDescription,
    MeasureDescription, MediumDescription, MovableDescription, ObstacleDescription,
    PatchDescription, PoseErrorDescription, QuantityNames, RecordingDescription,
    ScriptsDescription, SurroundingsDescription, TaskDescription, UnsavedText,
};

/// An event. In JSON, the key `event` has the name of the variant.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(tag = "event", rename_all = "snake_case")]
pub enum PageEvent {
    /// The world, before the first sample.
    Begin(Box<BeginEvent>),
    /// The tick, the pace, and the end of the run.
    State(StateEvent),
    /// The run is on its way to a tick.
    Seeking(SeekingEvent),
    /// Lamps and commands, after they have changed.
    Conditions(ConditionsEvent),
    /// Lines that robots logged.
    Logs(LogsEvent),
    /// The client forgets all log lines and faults, and gets those again that it shows.
    LogCleared,
    /// Answers to questions that are asked while the run is paused.
    Answers(AnswersEvent),
    /// A fault of a script.
    Fault(FaultEvent),
    /// The run was paused because of a fault.
    Stopped(StoppedEvent),
    /// The statement of a robot's script that is shown.
    Stepped(Box<SteppedEvent>),
    /// The lines before which the run pauses.
    Breakpoints(BreakpointsEvent),
    /// A new verdict of an expectation.
    Expectation(ExpectationEvent),
    /// The measures, after they have changed.
    Measures(MeasuresEvent),
    /// The memory of the robot that the client inspects.
    Inspection(Box<InspectionEvent>),
    /// The attitudes of the robots that fly, after they have changed.
    Attitudes(AttitudesEvent),
    /// The messages between robots since the last sample.
    Messages(MessagesEvent),
    /// The quantity that the client watches.
    Quantity(QuantityEvent),
    /// Points of a curve.
    Series(SeriesEvent),
    /// The run goes another way from a tick on: later points of all curves, lines and faults are void.
    SeriesCut(SeriesCutEvent),
    /// The progress of curves whose past is computed.
    SeriesProgress(SeriesProgressEvent),
    /// All commands as text.
    Commands(CommandsEvent),
    /// The session as a scenario.
    Scenario(ScenarioEvent),
    /// The text of a script or of the scenario.
    Script(ScriptEvent),
    /// The compiler's messages about a text.
    Diagnostics(DiagnosticsEvent),
    /// A draft was loaded into robots.
    Ran(RanEvent),
    /// A text was written to its file.
    Written(WrittenEvent),
    /// A text was not written, because its file has changed.
    Changed(ChangedEvent),
    /// The explanation of a message of the compiler.
    Explanation(ExplanationEvent),
    /// The digest of the run.
    Digest(DigestEvent),
    /// The progress of trials.
    Trials(TrialsEvent),
    /// A trial has ended.
    Trial(TrialEvent),
    /// A file to hand in.
    Result(ResultEvent),
    /// The marks of hand-ins.
    Marks(MarksEvent),
    /// The run started from the beginning, as the client requested.
    Began,
    /// The world was changed by hand, and the run started from the beginning.
    Built(BuiltEvent),
    /// A request was not carried out.
    Refused(RefusedEvent),
    /// The run cannot go on.
    Failed(FailedEvent),
    /// A defect of the program ended the session.
    Defect(DefectEvent),
}

impl PageEvent {
    /// Returns the event as JSON text.
    pub fn to_json(&self) -> String {
        serde_json::to_string(self).expect("the keys of all maps are numbers or strings")
    }

    /// Returns the event about a request that is not carried out.
    pub fn refused(text: impl Into<String>, help: Option<String>) -> PageEvent {
        PageEvent::Refused(RefusedEvent { text: text.into(), help })
    }
}

#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct StateEvent {
    pub tick: u64,
    /// True while the run is not paused.
    pub plays: bool,
    /// The speed as a multiple of real time; `None` if the run is paused or has no limit.
    pub rate: Option<f64>,
    /// True at the end of the run.
    pub over: bool,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct ConditionsEvent {
    pub lights: Vec<LightDescription>,
    pub pose_errors: Vec<PoseErrorDescription>,
    /// All commands, including those that are pending because the run was taken back.
    pub commands: Vec<CommandDescription>,
    /// True if a change of the commands can be undone.
    pub can_undo: bool,
    /// True if a change was undone that can be done again.
    pub can_redo: bool,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct LogsEvent {
    /// The number of earlier lines and faults that are left out, because the client was slow.
    pub lost: u64,
    pub lines: Vec<LogEvent>,
}

/// A line that a robot logged.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct LogEvent {
    pub tick: u64,
    /// The number of the robot.
    pub robot: usize,
    pub text: String,
    /// The kind of an answer to a question; `None` for a line that the script logged.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, ts(optional))]
    pub answer: Option<AnswerKind>,
}

#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(rename_all = "snake_case")]
pub enum AnswerKind {
    /// There is a value, or nothing is to be returned.
    Value,
    /// The line has the reason why there is no answer.
    Missing,
}

/// The answers that robots will give in the next tick to the questions that wait for it. They replace
/// those of an earlier event.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct AnswersEvent {
    pub lines: Vec<LogEvent>,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct FaultEvent {
    pub tick: u64,
    /// The number of the robot.
    pub robot: usize,
    pub consequence: FaultConsequence,
    #[serde(flatten)]
    pub description: FaultDescription,
}

/// The run is on its way to a tick, for longer than a moment.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct SeekingEvent {
    /// The tick to which the run goes.
    pub tick: u64,
    /// The time in seconds that the rest of the way takes, as far as it can be known.
    pub left: f64,
}

/// The run was paused because of a fault.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct StoppedEvent {
    pub fault: FaultEvent,
    /// The number of faults of other robots in the same tick.
    pub others: usize,
}

/// The statement of a robot's script that is shown, or the end of that.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct SteppedEvent {
    /// `None` after the run has left the statement.
    pub at: Option<StatementDescription>,
}

/// A statement of a robot's script, before it begins.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct StatementDescription {
    /// The tick of the run. The statement is in the tick that follows.
    pub tick: u64,
    /// The number of the robot.
    pub robot: usize,
    /// The number of the statement in the tick, from 0.
    pub number: usize,
    /// The number of statements that the robot begins in the tick.
    pub count: usize,
    pub place: FaultPlace,
    /// The memory before the statement.
    pub memory: MemoryDescription,
}

#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct BreakpointsEvent {
    /// Empty if the client asked for none, and in a world that cannot pause there.
    pub lines: Vec<BreakpointDescription>,
}

/// A line before which the run pauses.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct BreakpointDescription {
    /// The name of the script.
    pub script: String,
    /// The line that the client asked for.
    pub line: u32,
    /// The next line with a statement; `None` if there is none.
    pub at: Option<u32>,
}

/// The consequence of a fault for the script.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(rename_all = "snake_case")]
pub enum FaultConsequence {
    /// Only a listener or a handler ended.
    Contained,
    /// The script restarts after a pause.
    Pause,
    /// The script stopped.
    Stop,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct ExpectationEvent {
    /// The number of the expectation in the scenario.
    pub number: usize,
    pub verdict: VerdictName,
    /// The tick at which the verdict was decided.
    pub tick: Option<u64>,
}

/// A verdict of an expectation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(rename_all = "snake_case")]
pub enum VerdictName {
    Open,
    Held,
    Failed,
}

#[derive(Debug, Clone, Default, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct MeasuresEvent {
    /// The number of each measure; `None` if it is not known yet, or not finite.
    pub values: Vec<Option<f64>>,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct InspectionEvent {
    /// The number of the robot.
    pub robot: usize,
    pub tick: u64,
    /// `None` if the machine runs in an emulator, or the robot has not joined yet.
    pub memory: Option<MemoryDescription>,
    /// The last fault of the robot.
    pub fault: Option<FaultEvent>,
    /// The memory at that fault, which the robot has forgotten since; `None` if the machine runs in
    /// an emulator.
    pub at_fault: Option<MemoryDescription>,
    pub battery: Option<BatteryDescription>,
    /// The place in mm at which the robot believes to be; an emulated one reports it by radio.
    pub estimate: Option<[f64; 3]>,
}

/// The battery of a robot.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct BatteryDescription {
    /// Voltage in mV.
    pub millivolts: u16,
    /// Remaining charge, 0 to 1; `None` if only the voltage is known.
    pub charge: Option<f32>,
}

/// The attitudes of robots with a flight controller. A robot without one is level.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct AttitudesEvent {
    pub robots: Vec<AttitudeDescription>,
}

/// The attitude of a robot, and the thrust of its rotors.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct AttitudeDescription {
    /// The number of the robot.
    pub robot: usize,
    /// Degrees; positive lifts the left side.
    pub roll: f64,
    /// Degrees; positive lowers the nose.
    pub pitch: f64,
    /// Percent of the thrust in hover.
    pub thrust: f64,
}

/// Messages by their fate. Each is the number of the sender and that of the receiver.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct MessagesEvent {
    pub tick: u64,
    pub heard: Vec<[usize; 2]>,
    pub collided: Vec<[usize; 2]>,
    pub lost: Vec<[usize; 2]>,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct QuantityEvent {
    pub tick: u64,
    pub name: String,
    /// A number for each robot, or a single one for the swarm.
    pub values: Vec<Option<f64>>,
}

/// Points of a curve, which may lie anywhere in it. They replace earlier ones at the same ticks.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct SeriesEvent {
    /// The quantity, written as in `plot`.
    pub name: String,
    /// The unit, if the quantity has one.
    pub unit: Option<&'static str>,
    /// The number of ticks from one point of the curve to the next.
    pub every: u64,
    /// True if the swarm has a single value.
    pub is_single: bool,
    pub ticks: Vec<u64>,
    /// The extremes, quartiles and median of all robots, in ascending order, for each tick. Empty if
    /// the client has them, so that only the values of single robots are new.
    pub five: Vec<[Option<f64>; 5]>,
    /// The numbers of the robots whose own values follow.
    pub robots: Vec<usize>,
    /// The values of these robots for each tick.
    pub own: Vec<Vec<Option<f64>>>,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct SeriesCutEvent {
    /// The last tick of the way before.
    pub tick: u64,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct SeriesProgressEvent {
    /// The percentage of the points up to now that are known, of all curves.
    pub percent: usize,
    /// The reason why the others stay unknown.
    pub problem: Option<String>,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct CommandsEvent {
    /// The commands as `[[event]]`s of a scenario.
    pub text: String,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct ScenarioEvent {
    /// The scenario with all commands as its last events. It has the texts that the run needs.
    pub text: String,
    /// The names of files that are no texts, so that the scenario needs them next to it.
    pub missing: Vec<String>,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct ScriptEvent {
    pub name: String,
    /// The path of the file.
    pub file: String,
    pub text: String,
    /// The text of the file, which differs from `text` if robots run a draft.
    pub saved: String,
    /// SHA-256 of `saved` in hexadecimal; empty if the file cannot be read.
    pub sha256: String,
    /// The names that the text may use.
    pub words: Vec<Word>,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct DiagnosticsEvent {
    pub name: String,
    pub diagnostics: Vec<CompilerMessage>,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct RanEvent {
    /// The script of which the text is a draft.
    pub name: String,
    /// The name of the draft.
    pub draft: String,
    pub quantities: QuantityNames,
    pub controls: Vec<Control>,
    /// The texts about the scripts.
    pub about: Vec<ScriptAbout>,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct BuiltEvent {
    /// The text of the scenario before the change.
    pub before: String,
    /// The text of the scenario now.
    pub text: String,
    /// The thing that was added or changed; `None` after a deletion.
    pub thing: Option<Thing>,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct WrittenEvent {
    pub name: String,
    /// SHA-256 of the text in hexadecimal.
    pub sha256: String,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct ChangedEvent {
    pub name: String,
    /// The text of the file; `None` if it cannot be read.
    pub saved: Option<String>,
    /// SHA-256 of that text in hexadecimal; empty if the file cannot be read.
    pub sha256: String,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct ExplanationEvent {
    /// The code of the message.
    pub code: String,
    /// Markdown.
    pub text: String,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct DigestEvent {
    pub tick: u64,
    /// Hexadecimal, because JavaScript numbers do not hold 64 bits.
    pub digest: String,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct TrialsEvent {
    /// 100 if no trial runs.
    pub percent: u64,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct TrialEvent {
    /// The number of the trial, from 0.
    pub number: usize,
    /// The number of all trials.
    pub count: usize,
    /// The value of the key, as the client wrote it; `None` if no key is varied.
    pub value: Option<String>,
    pub seed: u32,
    /// True if every expectation held, and no script had an unexpected fault.
    pub success: bool,
    pub verdicts: Vec<VerdictName>,
    /// The time in seconds since which each condition was true until the end; `None` if it was
    /// false there.
    pub since: Vec<Option<f64>>,
    /// The quantity of each robot at the end; `None` if no quantity is measured.
    pub numbers: Option<Vec<Option<f64>>>,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct MarksEvent {
    /// The marks, in the order of the files.
    pub marks: Vec<Mark>,
    /// The marks as a table.
    pub csv: String,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct ResultEvent {
    /// The name of the file.
    pub name: String,
    /// The content of the file.
    pub text: String,
    /// The number of expectations that held.
    pub held: usize,
    /// The number of expectations.
    pub count: usize,
    /// True if every expectation held, and no script had an unexpected fault.
    pub success: bool,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct RefusedEvent {
    /// The reason.
    pub text: String,
    pub help: Option<String>,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct FailedEvent {
    /// The reason.
    pub text: String,
}

/// The end of a session by a defect of this program.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct DefectEvent {
    /// The version, the place and the invariant that does not hold.
    pub text: String,
    /// Advice for the user.
    pub help: String,
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;
    use std::fs;

    use ts_rs::{Config, TS, TypeVisitor};

    use super::PageEvent;
    use crate::request::Request;

    /// The committed declarations.
    const DECLARATIONS: &str =
        concat!(env!("CARGO_MANIFEST_DIR"), "/../bbz/page/editor/events.d.ts");

    /// With this variable the test writes the declarations instead of comparing them.
    const WRITE: &str = "BITTYBUZZ_WRITE_DECLARATIONS";

    /// The declarations of types and of all types that these contain, by name.
    struct Declarations {
        config: Config,
        by_name: BTreeMap<String, String>,
    }

    impl TypeVisitor for Declarations {
        fn visit<T: TS + 'static + ?Sized>(&mut self) {
            // Types of the standard library have no declaration.
            if T::output_path().is_some() {
                let declaration = format!("export {}", T::decl(&self.config));
                if self.by_name.insert(T::ident(&self.config), declaration).is_some() {
                    return;
                }
            }
            T::visit_dependencies(self);
            T::visit_generics(self);
        }
    }

    #[test]
    fn the_declarations_for_the_page_are_those_of_the_events_and_requests() {
        let config = Config::new().with_large_int("number");
        let mut declarations = Declarations { config, by_name: BTreeMap::new() };
        declarations.visit::<PageEvent>();
        declarations.visit::<Request>();
        let all: Vec<String> = declarations.by_name.into_values().collect();
        let text = format!(
            "// Written by `{WRITE}=1 cargo test -p bittybuzz-live declarations` from the types of live/src/page_event.rs.\n\n{}\n",
            all.join("\n\n")
        );
        // The comments are those of the Rust types.
        let text = text.replace("`None`", "`null`");
        if std::env::var_os(WRITE).is_some() {
            fs::write(DECLARATIONS, &text).unwrap();
        }
        let committed = fs::read_to_string(DECLARATIONS).unwrap();
        assert!(committed == text, "run this test with {WRITE}=1, which writes {DECLARATIONS}");
    }
}
