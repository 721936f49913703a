//! Prints the messages of a robot.

#[cfg(feature = "view")]
use std::sync::Arc;
#[cfg(feature = "view")]
use std::sync::atomic::{AtomicBool, Ordering};
#[cfg(feature = "view")]
use std::sync::mpsc::SyncSender;

use annotate_snippets::{Group, Level as Severity};
use bittybuzz_arena::robot::Piece;
use bittybuzz_comms::infrared::FaultReport;
use bittybuzz_comms::trace::{Items, PrintedValue, Record, RecordError, Unused};
use bittybuzz_compiler::refusal;
use bittybuzz_fault::{Backtrace, FaultReport as ReportedFault, accepted};
#[cfg(feature = "view")]
use bittybuzz_live::{ReportContent as Reported, RobotReport};
use bittybuzz_robot_spec::Robot;
use bittybuzz_vm_core::image::VERSION;
use bittybuzz_vm_core::{Fault, ImageError};
use serde_json::{Value, json};

use crate::exit::ExitStatus;
use crate::output::{OutputError, ScriptOutput};
use crate::program::LoadedProgram;
use crate::report;

use super::json;
use super::message::{PrintedMessage, TraceContent};

/// The form of the output.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TraceFormat {
    /// Lines with time and subject.
    Text,
    /// The lines that the script logs, nothing else.
    Plain,
    /// A JSON object per line.
    Json,
    /// No output, because a page shows the messages.
    #[cfg(feature = "view")]
    Page,
}

/// The script that the robot is assumed to run, and its name.
pub struct TracedScript<'a> {
    pub name: String,
    pub program: &'a LoadedProgram,
}

/// The comparison of the robot's last report about its script with the assumed one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum ScriptMatch {
    Nothing,
    /// The robot runs the assumed script.
    Same,
    /// The robot runs another script.
    Other,
}

/// Prints messages, and keeps the exit status.
pub struct TracePrinter<'a> {
    script: Option<TracedScript<'a>>,
    /// Stands for a script about which nothing is known.
    unknown: LoadedProgram,
    script_match: ScriptMatch,
    /// True once the note was printed that symbols are missing or are not confirmed by the robot.
    noted: bool,
    robot: Option<&'a Robot>,
    format: TraceFormat,
    until_fault: bool,
    /// True if a fault stopped the script, the robot refused it, or the firmware failed.
    is_stopped: bool,
    /// The time of the last line about discarded messages. `unused` has those not printed yet.
    unused_printed: Option<f64>,
    unused: Option<(Option<f64>, Unused)>,
    /// The printed reports of Kilobots, which send each report repeatedly.
    reported: Vec<FaultReport>,
    output: ScriptOutput,
    /// The id of the robot that reports.
    #[cfg(feature = "view")]
    reporter: u16,
    /// The page that receives the reports, until the flag is true.
    #[cfg(feature = "view")]
    page: Option<(SyncSender<RobotReport>, Arc<AtomicBool>)>,
    ending: ExitStatus,
}

impl<'a> TracePrinter<'a> {
    /// Prints to standard output. With `until_fault`, printing is over when the script stops.
    pub fn new(
        script: Option<TracedScript<'a>>,
        robot: Option<&'a Robot>,
        format: TraceFormat,
        until_fault: bool,
    ) -> Self {
        TracePrinter {
            script,
            unknown: LoadedProgram::unknown(),
            script_match: ScriptMatch::Nothing,
            noted: false,
            robot,
            format,
            until_fault,
            is_stopped: false,
            unused_printed: None,
            unused: None,
            reported: Vec::new(),
            output: ScriptOutput::new(),
            #[cfg(feature = "view")]
            reporter: 0,
            #[cfg(feature = "view")]
            page: None,
            ending: ExitStatus::Success,
        }
    }

    /// Reports to a page instead of printing, until the page is closed and sets the flag.
    #[cfg(feature = "view")]
    pub fn for_page(mut self, page: SyncSender<RobotReport>, is_closed: Arc<AtomicBool>) -> Self {
        self.format = TraceFormat::Page;
        self.page = Some((page, is_closed));
        self
    }

    /// Returns the name of the script that the robot is assumed to run.
    #[cfg(feature = "view")]
    pub fn script_name(&self) -> &str {
        self.script.as_ref().map_or("", |script| &script.name)
    }

    /// Returns true if nothing more need be printed.
    pub fn is_over(&self) -> bool {
        #[cfg(feature = "view")]
        if self.page.as_ref().is_some_and(|(_, is_closed)| is_closed.load(Ordering::Relaxed)) {
            return true;
        }
        (self.until_fault && self.is_stopped) || self.output.has_failed()
    }

    /// Flushes all messages.
    pub fn flush(&mut self) {
        self.output.flush();
    }

    /// Prints the rest, and returns the exit status.
    pub fn finish(mut self) -> Result<ExitStatus, OutputError> {
        self.print_unused();
        self.output.finish()?;
        Ok(self.ending)
    }

    /// Prints a message.
    pub fn print(&mut self, message: &PrintedMessage) {
        let time = message.time;
        match &message.content {
            TraceContent::Record(bytes) => match Record::decode(bytes) {
                Ok(record) => self.record(time, &record),
                Err(error) => self.damaged(time, damage(error), bytes),
            },
            TraceContent::Report(report) => self.report(time, report),
            TraceContent::Received => {}
            TraceContent::Step => self.step(time),
            TraceContent::Damaged(text) => {
                self.damaged(time, "its text is damaged", text.as_bytes())
            }
            TraceContent::Firmware { level, text } => {
                let name = level.map(|level| level.name());
                let object = json!({ "kind": "firmware", "level": name, "text": text });
                let text = report::printable(text);
                self.entry(time, name.unwrap_or("-"), text.as_bytes(), object);
            }
            TraceContent::Output { name, state } => {
                let object = json!({ "kind": "output", "name": name, "state": state });
                self.entry(time, "output", format!("{name} {state}").as_bytes(), object);
            }
            TraceContent::Reset { cause } => {
                let object = json!({ "kind": "reset", "cause": cause });
                self.remark(time, "reset", &format!("the chip was reset: {cause}"), object);
            }
            TraceContent::Failure(text) => {
                self.is_stopped = true;
                self.ending = ExitStatus::RuntimeError;
                self.error(time, text, None, json!({ "kind": "failure", "text": text }));
            }
        }
        self.output.refresh();
    }

    fn record(&mut self, time: Option<f64>, record: &Record<'_>) {
        if let Record::Start { robot_id, script_hash } = *record {
            return self.start(time, robot_id, script_hash);
        }
        self.note_trust();
        match *record {
            Record::Start { .. } => {}
            Record::Log { step, items } => self.log(time, step, items),
            Record::Fault { step, fault, calls } => {
                self.is_stopped = true;
                self.fault(time, Some(step), &fault, calls.collect(), false);
            }
            Record::Contained { step, fault, calls } => {
                self.fault(time, Some(step), &fault, calls.collect(), true);
            }
            Record::Restart { step, pause } => self.restart(time, Some(step), pause),
            Record::Refused(cause) => self.refused(time, cause),
            Record::Overrun { step, missed } => {
                let text = format!(
                    "a step took longer than a tick: {} missed so far",
                    report::counted(missed, "tick")
                );
                let object = json!({ "kind": "overrun", "step": step, "missed": missed });
                self.remark(time, &format!("step {step}"), &text, object);
            }
            Record::Expired { step } => {
                let text = "no step has ended for so long that the robot has stopped its motors";
                let object = json!({ "kind": "expired", "step": step });
                self.remark(time, &format!("step {step}"), text, object);
            }
            Record::Lost(count) => {
                let text = format!(
                    "{} came faster than the robot could send them",
                    report::counted(count, "log line")
                );
                self.remark(time, "lost", &text, json!({ "kind": "lost", "count": count }));
            }
            Record::Unused(unused) => self.unused(time, unused),
        }
    }

    /// Returns the program that the robot runs, as far as it is known.
    fn program(&self) -> &LoadedProgram {
        match &self.script {
            Some(script) if self.script_match != ScriptMatch::Other => script.program,
            _ => &self.unknown,
        }
    }

    fn start(&mut self, time: Option<f64>, robot_id: u16, hash: u32) {
        let mut text = format!("robot {robot_id} runs script {hash:08x}");
        let mut warning = None;
        if let Some(TracedScript { name, program }) = &self.script {
            if program.script_hash() == Some(hash) {
                self.script_match = ScriptMatch::Same;
                text = format!("{text} (`{name}`)");
            } else {
                self.script_match = ScriptMatch::Other;
                let other = program.script_hash();
                let other =
                    other.expect("the script was opened, so its image or symbols are known");
                warning = Some(format!(
                    "the robot runs script {hash:08x}, `{name}` is script {other:08x}"
                ));
            }
        }
        #[cfg(feature = "view")]
        {
            self.reporter = robot_id;
        }
        let object = json!({
            "kind": "start",
            "robot_id": robot_id,
            "script_hash": format!("{hash:08x}"),
            "symbols": self.script_match == ScriptMatch::Same,
        });
        self.entry(time, "start", text.as_bytes(), object);
        if let Some(warning) = warning {
            self.output.flush();
            report::warning(&warning, Some(OTHER_SCRIPT));
        }
    }

    /// Prints once that names, strings and places are missing, or that they come from a script that
    /// the robot has not confirmed.
    fn note_trust(&mut self) {
        let text = match &self.script {
            _ if self.noted => return,
            Some(script) if script.program.symbols.is_none() => format!(
                "strings and places are shown as numbers: there are no symbols (.sym) next to `{}`",
                script.name
            ),
            Some(_) if self.script_match != ScriptMatch::Nothing => return,
            None => "strings and places are shown as numbers: --script names the script".to_owned(),
            Some(script) => {
                format!("the robot began before this trace; it is taken to run `{}`", script.name)
            }
        };
        self.noted = true;
        self.output.flush();
        report::print(Group::with_title(Severity::NOTE.primary_title(text)));
    }

    fn log(&mut self, time: Option<f64>, step: u32, items: Items<'_>) {
        let mut line = Vec::new();
        let mut complete = true;
        for item in items {
            let piece = match item {
                Ok(PrintedValue::Nil) => Piece::Nil,
                Ok(PrintedValue::Int(value)) => Piece::Int(value),
                Ok(PrintedValue::Float(value)) => Piece::Float(value),
                Ok(PrintedValue::String(number)) => Piece::Constant(number),
                Ok(PrintedValue::Text(text)) => Piece::Text(text.to_vec()),
                Ok(PrintedValue::Table(size)) => Piece::Table(usize::from(size)),
                Ok(PrintedValue::Function) => Piece::Function,
                // `Record::decode` checked all items, so that `Err` cannot occur.
                Ok(PrintedValue::Rest) | Err(_) => {
                    complete = false;
                    Piece::Text(b"...".to_vec())
                }
            };
            piece.append_to(self.program().symbols.as_ref(), &mut line);
        }
        if self.format == TraceFormat::Plain {
            return self.output.line(&line);
        }
        let text = String::from_utf8_lossy(&line);
        let object = json!({ "kind": "log", "step": step, "text": text, "complete": complete });
        self.entry(time, &format!("step {step}"), &line, object);
    }

    /// Prints a report of a Kilobot the first time: the Kilobot sends it repeatedly.
    fn report(&mut self, time: Option<f64>, report: &FaultReport) {
        if self.reported.contains(report) {
            return;
        }
        self.reported.push(*report);
        #[cfg(feature = "view")]
        {
            self.reporter = report.robot;
        }
        let Some(fault) = &report.fault else {
            self.is_stopped = true;
            self.ending = ExitStatus::Usage;
            let text = format!("robot {} refuses its script", report.robot);
            let object = json!({ "kind": "refused", "text": text, "help": UNSUITABLE });
            return self.error(time, &text, Some(UNSUITABLE), object);
        };
        let known = self.script.as_ref().and_then(|script| script.program.script_hash());
        if let Some(hash) = known {
            let is_same = hash as u16 == report.script;
            self.script_match = if is_same { ScriptMatch::Same } else { ScriptMatch::Other };
            if !is_same {
                let (robot, script) = (report.robot, report.script);
                let text = format!("robot {robot} runs a script whose hash ends in {script:04x}");
                self.output.flush();
                report::warning(&text, Some(OTHER_SCRIPT));
            }
        }
        self.note_trust();
        self.is_stopped |= !report.is_contained;
        self.fault(time, None, fault, vec![fault.position], report.is_contained);
    }

    /// Handles a step of an emulated Kilobot: after a fault, the script has restarted.
    fn step(&mut self, time: Option<f64>) {
        let count = self.reported.len();
        self.reported.retain(|report| report.is_contained);
        if self.reported.len() < count {
            self.restart(time, None, 0);
        }
    }

    /// Prints that the script restarts in `pause` ticks, or now if that is 0.
    fn restart(&mut self, time: Option<f64>, step: Option<u32>, pause: u16) {
        let seconds = f64::from(pause) / TICKS_PER_SECOND;
        let text = match pause {
            0 => "the script starts again".to_owned(),
            _ => format!("the script starts again in {seconds} s"),
        };
        let subject = step.map_or("-".to_owned(), |step| format!("step {step}"));
        let object = json!({ "kind": "restart", "step": step, "seconds": seconds });
        self.remark(time, &subject, &text, object);
    }

    /// Prints a fault. After a contained fault, the script continues.
    fn fault(
        &mut self,
        time: Option<f64>,
        step: Option<u32>,
        fault: &Fault,
        positions: Vec<u16>,
        is_contained: bool,
    ) {
        self.ending = ExitStatus::RuntimeError;
        let program = self.program().known();
        let expected = accepted(fault, program, self.robot);
        let backtrace = Backtrace::new(program, positions, None);
        let positions = (self.format == TraceFormat::Json).then(|| backtrace.positions());
        let described = ReportedFault::new(fault, backtrace, expected.as_deref());
        #[cfg(feature = "view")]
        if self.format == TraceFormat::Page {
            let description = described.description();
            return self.send(time, Reported::Fault { is_contained, description });
        }
        if let Some(positions) = positions {
            let mut object = described.json();
            object["kind"] = if is_contained { "contained" } else { "fault" }.into();
            object["step"] = step.into();
            object["calls"] = positions.into();
            return self.entry(time, "", b"", object);
        }
        let step = step.map(|step| format!("after {}", report::counted(step, "complete step")));
        let time = time.map(|time| format!("at {time:.6} s"));
        let end = is_contained.then(|| CONTAINED.to_owned());
        let note = [step, time, end].into_iter().flatten().collect::<Vec<_>>().join(", ");
        let notes: Vec<String> = Some(note).filter(|note| !note.is_empty()).into_iter().collect();
        let message = described.message(&notes);
        self.output.flush();
        report::print(message);
    }

    fn refused(&mut self, time: Option<f64>, cause: ImageError) {
        self.is_stopped = true;
        self.ending = ExitStatus::Usage;
        let sentence = match cause {
            // The image has the version of this `bbz`, so it is the firmware that runs another one.
            ImageError::Version(version) if version == u16::from(VERSION) => {
                format!("is an image of version {version}, its firmware is of another version")
            }
            _ => refusal::sentence(&cause),
        };
        let text = format!("the script in the robot's flash {sentence}");
        let help = match cause {
            ImageError::Version(version) if version == u16::from(VERSION) => {
                Some("build the firmware again, and flash it".to_owned())
            }
            ImageError::NotAnImage => Some("`bbz flash` writes one".to_owned()),
            cause => refusal::help(&cause),
        };
        let object = json!({ "kind": "refused", "text": text, "help": help });
        self.error(time, &text, help.as_deref(), object);
    }

    /// Keeps the counts of discarded messages. A robot may report them with every step; they are
    /// printed at most once per second, and at the end.
    fn unused(&mut self, time: Option<f64>, unused: Unused) {
        self.unused = Some((time, unused));
        let is_soon =
            self.unused_printed.zip(time).is_some_and(|(printed, now)| now < printed + 1.0);
        if self.format == TraceFormat::Json || !is_soon {
            self.print_unused();
        }
    }

    fn print_unused(&mut self) {
        let Some((time, unused)) = self.unused.take() else { return };
        self.unused_printed = time;
        let (text, object) = (unused_text(&unused), json::unused(&unused));
        self.remark(time, "unused", &text, object);
    }

    fn damaged(&mut self, time: Option<f64>, why: &str, what: &[u8]) {
        let shown = match std::str::from_utf8(what) {
            Ok(text) if text.starts_with("bbz ") => report::printable(text),
            _ => format!("bbz {what:?}"),
        };
        let text = format!("a record cannot be read, {why}: {shown}");
        self.remark(time, "damaged", &text, json!({ "kind": "damaged", "text": text }));
    }

    /// Prints a message about the script that is not one of its lines. If only its lines are
    /// printed, the message becomes a warning.
    fn remark(&mut self, time: Option<f64>, subject: &str, text: &str, object: Value) {
        if self.format == TraceFormat::Plain {
            self.output.flush();
            return report::warning(text, None);
        }
        self.entry(time, subject, text.as_bytes(), object);
    }

    fn error(&mut self, time: Option<f64>, text: &str, help: Option<&str>, object: Value) {
        if !matches!(self.format, TraceFormat::Text | TraceFormat::Plain) {
            return self.entry(time, "-", text.as_bytes(), object);
        }
        self.output.flush();
        let title = Severity::ERROR.primary_title(text);
        let note = time.map(|time| Severity::NOTE.message(format!("at {time:.6} s")));
        let help = help.map(|help| Severity::HELP.message(help));
        report::print(title.elements(note).elements(help));
    }

    /// Reports to the page. A closed page ignores the report.
    #[cfg(feature = "view")]
    fn send(&self, seconds: Option<f64>, content: Reported) {
        if let Some((page, _)) = &self.page {
            // The receiver is gone once the page is closed.
            let _ = page.send(RobotReport { seconds, robot: self.reporter, content });
        }
    }

    /// Prints a line, unless only the lines of the script are wanted.
    fn entry(&mut self, time: Option<f64>, subject: &str, text: &[u8], mut object: Value) {
        match self.format {
            TraceFormat::Plain => {}
            #[cfg(feature = "view")]
            TraceFormat::Page => {
                let text = String::from_utf8_lossy(text);
                let content = match object["kind"].as_str() {
                    Some("log") => Reported::Line(text.into_owned()),
                    Some("start" | "restart") => Reported::Began(text.into_owned()),
                    _ if subject == "-" => Reported::Line(text.into_owned()),
                    _ => Reported::Line(format!("{subject}: {text}")),
                };
                self.send(time, content);
            }
            TraceFormat::Json => {
                object["time"] = json!(time);
                self.output.line(object.to_string().as_bytes());
            }
            TraceFormat::Text => {
                let time = time.map_or("-".to_owned(), |time| format!("{time:.6}"));
                let mut line = format!("{time:>12} {subject:<9} ").into_bytes();
                line.extend(text);
                self.output.line(&line);
            }
        }
    }
}

/// Ticks per second, in which a robot counts the pause before a restart.
const TICKS_PER_SECOND: f64 = 10.0;

const CONTAINED: &str = "only the listener or handler ended, the script goes on";

const OTHER_SCRIPT: &str = "its strings and places are shown as numbers; name the script that the robot has, built \
                            for the same profile, or write this one with `bbz flash`";

const UNSUITABLE: &str = "it was built for another robot, or put into another program than this: `bbz build --firmware` does it";

/// Lists the counts of discarded messages.
fn unused_text(unused: &Unused) -> String {
    let Unused { dropped: [unread, unsent], messages } = unused;
    let parts = [
        (*unread, "received without room for it"),
        (*unsent, "to be sent without room for it"),
        (messages.foreign, "of another script"),
        (messages.malformed, "malformed"),
        (messages.own_id, "with this robot's id"),
        (messages.not_kept, "not kept, as the stigmergy is full"),
        (messages.incomplete, "incomplete"),
        (messages.undecided, "in conflict and not decided"),
        (messages.failed, "discarded after a fault of their listener or handler"),
    ];
    let there = parts.iter().filter(|(count, _)| *count > 0);
    let parts: Vec<String> = there.map(|(count, what)| format!("{count} {what}")).collect();
    format!("discarded messages so far: {}", parts.join(", "))
}

fn damage(error: RecordError) -> &'static str {
    match error {
        RecordError::Kind(_) => {
            "this `bbz` does not know its kind (is it older than the firmware?)"
        }
        RecordError::Length => "its length is wrong",
        RecordError::Value => {
            "a value in it means nothing (is this `bbz` older than the firmware?)"
        }
    }
}
