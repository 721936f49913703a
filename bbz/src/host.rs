//! This computer in the role of a robot: robot functions print their calls, `log` prints, `delay`
//! waits.
//!
//! A robot function prints its call (`led(3)`) and completes at once, even if it takes time on the
//! robot. It returns 0 if the robot file declares an integer, 0.0 for a number, else nil. Its
//! arguments are checked as on the robot. Positions that the robot knows are 0.0.

use std::time::{Duration, Instant};

use bittybuzz_arena::robot::{Piece, unknown_string};
use bittybuzz_robot_spec::{Robot, RobotFunction, accepted_lists, accepting, idle_result};
use bittybuzz_vm_core::number::{Profile, format_float, format_int};
use bittybuzz_vm_core::{
    Argument, Axis, ByteCode, CallArguments, Calls, Fault, Host, Reply, RobotFault, Text,
};

use crate::output::{OutputForm, ScriptOutput};
use crate::program::LoadedProgram;

/// The clock of the script.
pub enum HostClock {
    /// Delays end at once.
    Simulated,
    /// Delays take real time.
    Real {
        /// The end of the running `delay`.
        until: Option<Instant>,
    },
}

/// The host of a script, which stands for all robots that the script may run on.
pub struct HostRobot<'a> {
    functions: Vec<&'a RobotFunction>,
    /// The fields of `pos` that at least one of the robots has.
    position: Vec<&'a str>,
    program: &'a LoadedProgram,
    /// The destination of calls and logs.
    pub output: ScriptOutput,
    pub clock: HostClock,
    /// The reason why the last robot function refused its arguments.
    pub refusal: Option<String>,
}

impl<'a> HostRobot<'a> {
    /// Creates a host with the functions of all `robots`.
    pub fn new(
        robots: impl Iterator<Item = &'a Robot> + Clone,
        program: &'a LoadedProgram,
        clock: HostClock,
        form: OutputForm,
    ) -> Self {
        let tables = robots.clone().filter_map(|robot| robot.table("pos"));
        HostRobot {
            position: tables.flat_map(|pos| &pos.fields).map(|field| field.name.as_str()).collect(),
            functions: robots.flat_map(|robot| &robot.functions).collect(),
            program,
            output: ScriptOutput::of(form),
            clock,
            refusal: None,
        }
    }

    /// Returns the rest of the running `delay`.
    pub fn remaining_delay(&self) -> Duration {
        match self.clock {
            HostClock::Real { until: Some(until) } => {
                until.saturating_duration_since(Instant::now())
            }
            HostClock::Real { until: None } | HostClock::Simulated => Duration::ZERO,
        }
    }

    /// Returns the bytes of a string, or a placeholder for a constant whose text is neither in the
    /// image nor in the symbols.
    fn bytes<P: Profile, C: ByteCode, const N: usize>(&self, text: &Text<'_, P, C, N>) -> Vec<u8> {
        if let Some(known) = text.number().and_then(|number| self.program.string(number)) {
            return known.as_bytes().to_vec();
        }
        match text.number() {
            Some(number) if !self.program.has_text() => unknown_string(number),
            _ => text.bytes().collect(),
        }
    }

    /// Returns the call as the script could write it.
    fn call_text<P: Profile, C: ByteCode, const SLOTS: usize>(
        &self,
        name: &str,
        arguments: &CallArguments<'_, P, C, SLOTS>,
    ) -> Vec<u8> {
        let mut line = format!("{name}(").into_bytes();
        for index in 0..arguments.count() {
            if index > 0 {
                line.extend(b", ");
            }
            match arguments.item(index) {
                Argument::Nil => line.extend(b"nil"),
                Argument::String(text) => quote(&self.bytes(&text), &mut line),
                Argument::Table(0) => line.extend(b"{}"),
                Argument::Table(_) => line.extend(b"{...}"),
                Argument::Function => line.extend(b"[closure]"),
                Argument::Int(value) => format_int(value, &mut |byte| line.push(byte)),
                Argument::Float(value) => format_float(value, &mut |byte| line.push(byte)),
            }
        }
        line.push(b')');
        line
    }
}

impl<P: Profile> Host<P> for HostRobot<'_> {
    fn call<C: ByteCode, const SLOTS: usize>(
        &mut self,
        function: u16,
        arguments: CallArguments<'_, P, C, SLOTS>,
        _again: bool,
    ) -> Result<Reply<P>, RobotFault> {
        let candidates: Vec<&RobotFunction> =
            self.functions.iter().filter(|known| known.hash() == function).copied().collect();
        let (accepted, _) = accepting(&candidates, &arguments)
            .inspect_err(|_| self.refusal = Some(accepted_lists(&candidates)))?;
        // No script calls a function that reads a value.
        if !accepted.is_reader() {
            let line = self.call_text(&accepted.name, &arguments);
            self.output.line(&line);
        }
        Ok(Reply::Value(idle_result(accepted)))
    }

    fn log<C: ByteCode, const SLOTS: usize>(&mut self, arguments: CallArguments<'_, P, C, SLOTS>) {
        let mut line = Vec::new();
        for index in 0..arguments.count() {
            let piece = match arguments.item(index) {
                Argument::Nil => Piece::Nil,
                Argument::String(text) => Piece::Text(self.bytes(&text)),
                Argument::Table(size) => Piece::Table(size),
                Argument::Function => Piece::Function,
                Argument::Int(value) => Piece::Int(value),
                Argument::Float(value) => Piece::Float(value),
            };
            piece.append_to(None, &mut line);
        }
        self.output.line(&line);
    }

    fn delay_is_over(&mut self, ms: i32, again: bool) -> bool {
        let HostClock::Real { until } = &mut self.clock else { return true };
        let now = Instant::now();
        if !again {
            // A negative delay is over at once.
            *until = Some(now + Duration::from_millis(ms.max(0).unsigned_abs().into()));
        }
        until.is_none_or(|until| until <= now)
    }

    fn position(&mut self, axis: Axis) -> Option<f32> {
        let name = match axis {
            Axis::X => "x",
            Axis::Y => "y",
            Axis::Z => "z",
            Axis::Orientation => "orientation",
        };
        self.position.contains(&name).then_some(0.0)
    }

    /// Ends the run, as with any other fault. No listener runs here, because no frame arrives.
    fn contain<C: ByteCode, const SLOTS: usize>(
        &mut self,
        _fault: &Fault,
        _calls: Calls<'_, P, C, SLOTS>,
    ) -> bool {
        false
    }
}

/// Writes a string in quotes, as in a script.
fn quote(text: &[u8], line: &mut Vec<u8>) {
    line.push(b'"');
    for byte in text {
        match byte {
            b'"' => line.extend(b"\\\""),
            b'\\' => line.extend(b"\\\\"),
            b'\n' => line.extend(b"\\n"),
            b'\t' => line.extend(b"\\t"),
            _ => line.push(*byte),
        }
    }
    line.push(b'"');
}
