//! The costs of messages: the frames that each broadcast and each put takes, and how often steps
//! send it.
//!
//! A value that is nil, a number or a constant string fits one frame. All other values travel in
//! fragments, and every frame takes its share of a robot's air. The analysis states the costs as
//! far as the source determines them: a range contains the number of frames that a robot really
//! sends.

mod calls;
mod form;
mod rate;
mod size;
mod warning;

use std::collections::BTreeMap;

use bittybuzz_robot_spec::{Medium, Robot};

use crate::check::names::{Meaning, Meanings};
use crate::check::tree::{NameId, ResolvedScript};
use crate::diagnostic::Diagnostic;
use crate::profile::NumberProfile;
use crate::source::Span;
use crate::stigmergies::StigmergyNumbers;
pub use rate::Rate;

/// The numbers of frames that one message may take.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Frames {
    pub least: u32,
    /// At most [`FRAGMENTS_MAX`](bittybuzz_vm_core::message::FRAGMENTS_MAX), because a longer message is a fault at the sender.
    pub most: u32,
}

impl Frames {
    /// Describes the number: `4 frames`, `1 to 8 frames`.
    pub fn text(self) -> String {
        match self {
            Frames { least: 1, most: 1 } => "1 frame".to_owned(),
            Frames { least, most } if least == most => format!("{most} frames"),
            Frames { least, most } => format!("{least} to {most} frames"),
        }
    }
}

/// A call that sends a message.
#[derive(Debug, Clone, PartialEq)]
pub struct SentMessage {
    /// The place of the call.
    pub span: Span,
    /// True for an entry of a stigmergy, false for a broadcast.
    pub is_entry: bool,
    /// The topic or key as written; `None` if the script computes it.
    pub name: Option<String>,
    /// `None` if the value is too long for a message.
    pub frames: Option<Frames>,
    /// `None` if no bound is known, as in a loop or outside of steps.
    pub rate: Option<Rate>,
}

/// Returns the time in seconds that a robot's link takes for a number of frames.
pub fn link_seconds(medium: Medium, frames: u32) -> f64 {
    f64::from(frames) * f64::from(medium.frame_period_us()) / 1e6
}

/// The messages of a script. They are analyzed once for each profile that is asked for.
pub struct MessageCosts<'a> {
    program: &'a ResolvedScript,
    meanings: &'a Meanings<'a>,
    stigmergies: &'a StigmergyNumbers,
    found: BTreeMap<&'static str, Vec<SentMessage>>,
}

impl<'a> MessageCosts<'a> {
    /// Returns the analysis of a script, in which no message has been found yet.
    pub fn new(
        program: &'a ResolvedScript,
        meanings: &'a Meanings<'a>,
        stigmergies: &'a StigmergyNumbers,
    ) -> Self {
        MessageCosts { program, meanings, stigmergies, found: BTreeMap::new() }
    }

    /// Returns all messages of the script, in the order of the source.
    pub fn messages(&mut self, profile: NumberProfile) -> &[SentMessage] {
        let MessageCosts { program, meanings, stigmergies, found } = self;
        let analyzed = || calls::messages(program, meanings, profile, stigmergies);
        found.entry(profile.name()).or_insert_with(analyzed)
    }

    /// Returns a warning for each message of several frames that steps send at a fixed rate.
    /// `profile` is the one that was asked for; `None` stands for that of each robot.
    pub fn warnings(&mut self, profile: Option<NumberProfile>) -> Vec<Diagnostic> {
        let mut found: BTreeMap<Span, (f64, Diagnostic)> = BTreeMap::new();
        let (program, meanings) = (self.program, self.meanings);
        for robot in meanings.robots().targets().filter(|robot| can_run(robot, program, meanings)) {
            let Some(medium) = robot.link else { continue };
            let profile = profile.unwrap_or(robot.profile);
            // The frames of a robot with small numbers are too short for the other profile.
            if robot.profile == NumberProfile::Tiny && profile == NumberProfile::Full {
                continue;
            }
            for message in self.messages(profile) {
                // The warning names the robot for which the message takes the largest share.
                if let Some((share, warning)) = warning::long_in_step(message, robot, medium)
                    && found.get(&message.span).is_none_or(|(known, _)| *known < share)
                {
                    found.insert(message.span, (share, warning));
                }
            }
        }
        found.into_values().map(|(_, warning)| warning).collect()
    }
}

/// Returns true if the robot has every robot function that the script calls.
fn can_run(robot: &Robot, program: &ResolvedScript, meanings: &Meanings<'_>) -> bool {
    program.names.iter().enumerate().all(|(number, name)| {
        meanings.of(NameId(number)) != Meaning::Robot
            || name.calls.is_empty()
            || robot.function(&name.text).is_some()
    })
}

/// Returns a time with its unit: `2 s`, `40.8 ms`.
pub fn seconds_text(seconds: f64) -> String {
    let digits = |value: f64| format!("{:.1}", value).trim_end_matches(".0").to_owned();
    if seconds >= 1.0 {
        format!("{} s", digits(seconds))
    } else {
        format!("{} ms", digits(1000.0 * seconds))
    }
}
