//! The host as a robot: robot functions print themselves, `log` prints, `delay` waits.
//!
//! A robot function prints its call (`led(3)`), is finished at once even where the robot's would take a while, and
//! returns 0 where the robot file promises an integer, 0.0 for a number, else nil. Its arguments are checked as on the
//! robot. Positions are 0.0 where a robot knows them.

use std::time::{Duration, Instant};

use bittybuzz_robots::{Function, Parameter, Robot, Type as Kind};
use bittybuzz_vm_core::number::{Profile, format_float, format_int};
use bittybuzz_vm_core::{
    Arguments, Axis, ByteCode, Host, Item, Refusal, Reply, RobotFault, Text, Value,
};

use crate::output::Output;
use crate::printed::{Printed, unknown_string};
use crate::program::Program;

/// How time passes for the script.
pub enum Clock {
    /// Waits are over at once.
    Simulated,
    /// Waits take as long as the script says.
    Real {
        /// When the running `delay` is over.
        until: Option<Instant>,
    },
}

/// Plays the robots that a script may run on.
pub struct HostRobot<'a> {
    functions: Vec<&'a Function>,
    /// Fields of `pos` that one of the robots knows.
    position: Vec<&'a str>,
    program: &'a Program,
    /// Where calls and logs go.
    pub output: Output,
    /// How time passes.
    pub clock: Clock,
    /// Why the last robot function refused its arguments.
    pub refusal: Option<String>,
}

impl<'a> HostRobot<'a> {
    /// Plays all of `robots` at once.
    pub fn new(
        robots: impl Iterator<Item = &'a Robot> + Clone,
        program: &'a Program,
        clock: Clock,
    ) -> Self {
        let tables = robots.clone().filter_map(|robot| robot.table("pos"));
        HostRobot {
            position: tables.flat_map(|pos| &pos.fields).map(|field| field.name.as_str()).collect(),
            functions: robots.flat_map(|robot| &robot.functions).collect(),
            program,
            output: Output::new(),
            clock,
            refusal: None,
        }
    }

    /// How long the running `delay` still lasts.
    pub fn remaining_delay(&self) -> Duration {
        match self.clock {
            Clock::Real { until: Some(until) } => until.saturating_duration_since(Instant::now()),
            Clock::Real { until: None } | Clock::Simulated => Duration::ZERO,
        }
    }

    /// Bytes of a string; a stand-in for a constant whose text is known neither from the image nor from symbols.
    fn bytes<P: Profile, C: ByteCode, const N: usize>(&self, text: &Text<'_, P, C, N>) -> Vec<u8> {
        if let Some(known) = text.number().and_then(|number| self.program.string(number)) {
            return known.as_bytes().to_vec();
        }
        match text.number() {
            Some(number) if !self.program.has_text() => unknown_string(number),
            _ => text.bytes().collect(),
        }
    }

    /// The call as the script could write it.
    fn call_text<P: Profile, C: ByteCode, const SLOTS: usize>(
        &self,
        name: &str,
        arguments: &Arguments<'_, P, C, SLOTS>,
    ) -> Vec<u8> {
        let mut line = format!("{name}(").into_bytes();
        for index in 0..arguments.count() {
            if index > 0 {
                line.extend(b", ");
            }
            match arguments.item(index) {
                Item::Nil => line.extend(b"nil"),
                Item::String(text) => quote(&self.bytes(&text), &mut line),
                Item::Table(0) => line.extend(b"{}"),
                Item::Table(_) => line.extend(b"{...}"),
                Item::Function => line.extend(b"[closure]"),
                Item::Int(value) => format_int(value, &mut |byte| line.push(byte)),
                Item::Float(value) => format_float(value, &mut |byte| line.push(byte)),
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
        arguments: Arguments<'_, P, C, SLOTS>,
        _again: bool,
    ) -> Result<Reply<P>, RobotFault> {
        let candidates: Vec<&Function> =
            self.functions.iter().filter(|known| known.hash() == function).copied().collect();
        let accepted = candidates.iter().find(|known| {
            known.accepts.iter().any(|list| first_mismatch(list, &arguments) == Mismatch::None)
        });
        let Some(accepted) = accepted else {
            return Err(self.refuse(&candidates, &arguments));
        };
        let line = self.call_text(&accepted.name, &arguments);
        self.output.line(&line);
        Ok(Reply::Value(match accepted.returns {
            Some(Kind::Int) => Value::int(0),
            Some(Kind::Number) => Value::float(0.0),
            _ => Value::nil(),
        }))
    }

    fn log<C: ByteCode, const SLOTS: usize>(&mut self, arguments: Arguments<'_, P, C, SLOTS>) {
        let mut line = Vec::new();
        for index in 0..arguments.count() {
            let value = match arguments.item(index) {
                Item::Nil => Printed::Nil,
                Item::String(text) => Printed::Text(self.bytes(&text)),
                Item::Table(size) => Printed::Table(size),
                Item::Function => Printed::Function,
                Item::Int(value) => Printed::Int(value),
                Item::Float(value) => Printed::Float(value),
            };
            value.append_to(&mut line);
        }
        self.output.line(&line);
    }

    fn delay_is_over(&mut self, ms: i32, again: bool) -> bool {
        let Clock::Real { until } = &mut self.clock else { return true };
        let now = Instant::now();
        if !again {
            *until = Some(now + Duration::from_millis(u64::try_from(ms).unwrap_or(0)));
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
}

impl HostRobot<'_> {
    /// The fault for arguments that no list accepts.
    fn refuse<P: Profile, C: ByteCode, const SLOTS: usize>(
        &mut self,
        candidates: &[&Function],
        arguments: &Arguments<'_, P, C, SLOTS>,
    ) -> RobotFault {
        let lists = || candidates.iter().flat_map(|known| &known.accepts);
        self.refusal = Some(accepted_lists(candidates));
        let mismatches = lists().map(|list| first_mismatch(list, arguments));
        let wrong = mismatches.filter_map(|mismatch| match mismatch {
            Mismatch::Argument(index) => Some(index),
            Mismatch::Count | Mismatch::None => None,
        });
        match wrong.max() {
            Some(index) => RobotFault::WrongType(arguments.value(index).type_of()),
            None => RobotFault::Refused(Refusal::ArgumentCount),
        }
    }
}

/// What keeps arguments from fitting a list of parameters.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Mismatch {
    None,
    Count,
    /// The first argument of a wrong type.
    Argument(usize),
}

fn first_mismatch<P: Profile, C: ByteCode, const SLOTS: usize>(
    list: &[Parameter],
    arguments: &Arguments<'_, P, C, SLOTS>,
) -> Mismatch {
    if list.len() != arguments.count() {
        return Mismatch::Count;
    }
    let fits = |index: usize, kind| {
        matches!(
            (kind, arguments.item(index)),
            (Kind::Any, _)
                | (Kind::Int | Kind::Number, Item::Int(_))
                | (Kind::Number, Item::Float(_))
                | (Kind::String, Item::String(_))
                | (Kind::Table, Item::Table(_))
                | (Kind::Function, Item::Function)
        )
    };
    let wrong = list.iter().enumerate().find(|(index, parameter)| !fits(*index, parameter.kind));
    wrong.map_or(Mismatch::None, |(index, _)| Mismatch::Argument(index))
}

/// `goto takes (x: number, y: number) or (x: number, y: number, z: number)`
pub fn accepted_lists(candidates: &[&Function]) -> String {
    let lists = candidates.iter().flat_map(|known| &known.accepts);
    let accepted: Vec<String> = lists.map(|list| signature(list)).collect();
    let name = candidates.first().map_or("the function", |known| known.name.as_str());
    format!("{name} takes {}", accepted.join(" or "))
}

/// `(x: number, y: number)`
fn signature(list: &[Parameter]) -> String {
    let parameters: Vec<String> = list.iter().map(Parameter::to_string).collect();
    format!("({})", parameters.join(", "))
}

/// Writes a string in quotes, as a script would.
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
