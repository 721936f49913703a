//! A robot without a body and without others, for runs of a script outside of a world.
//!
//! It stands for all robots that the script may run on. A robot function completes at once, even if
//! it takes time on the robot, and gives a line such as `led(3)`. Its arguments are checked as on
//! the robot. It returns 0 if the robot file declares an integer, 0.0 for a number, else nil.
//! Positions that the robot knows are 0.0.

use bittybuzz_compiler::symbols::Symbols;
use bittybuzz_robot_spec::{Robot, RobotFunction, accepted_lists, accepting, idle_result};
use bittybuzz_vm_core::number::{Profile, format_float, format_int};
use bittybuzz_vm_core::{
    Argument, Axis, ByteCode, CallArguments, Reply, RobotFault, Text, builtin,
};

use super::log::{Piece, unknown_string};

/// A robot without a body. A host of a script asks it for lines and results.
pub struct LoneRobot<'a> {
    functions: Vec<&'a RobotFunction>,
    /// The fields of `pos` that at least one of the robots has.
    position: Vec<&'a str>,
    symbols: Option<&'a Symbols>,
    /// True if the image itself has the text of its strings.
    has_text: bool,
}

/// A robot function that has completed.
pub struct LoneCall<P: Profile> {
    /// The call as the script could write it; `None` for a function that only reads a value, which no
    /// script calls by name.
    pub line: Option<Vec<u8>>,
    pub reply: Reply<P>,
}

/// A robot function that refused its arguments.
pub struct LoneRefusal {
    /// The arguments that it accepts.
    pub accepted: String,
    pub fault: RobotFault,
}

impl<'a> LoneRobot<'a> {
    /// Returns a robot with the functions of all `robots`. Without symbols, only the built-in strings
    /// are known.
    pub fn new(
        robots: impl Iterator<Item = &'a Robot> + Clone,
        symbols: Option<&'a Symbols>,
        has_text: bool,
    ) -> Self {
        let tables = robots.clone().filter_map(|robot| robot.table("pos"));
        LoneRobot {
            position: tables.flat_map(|pos| &pos.fields).map(|field| field.name.as_str()).collect(),
            functions: robots.flat_map(|robot| &robot.functions).collect(),
            symbols,
            has_text,
        }
    }

    /// Completes a call of a robot function.
    pub fn call<P: Profile, C: ByteCode, const SLOTS: usize>(
        &self,
        function: u16,
        arguments: &CallArguments<'_, P, C, SLOTS>,
    ) -> Result<LoneCall<P>, LoneRefusal> {
        let candidates: Vec<&RobotFunction> =
            self.functions.iter().filter(|known| known.hash() == function).copied().collect();
        let (accepted, _) = accepting(&candidates, arguments)
            .map_err(|fault| LoneRefusal { accepted: accepted_lists(&candidates), fault })?;
        let line = (!accepted.is_reader()).then(|| self.call_text(&accepted.name, arguments));
        Ok(LoneCall { line, reply: Reply::Value(idle_result(accepted)) })
    }

    /// Returns the line that the arguments of `log` make.
    pub fn log_line<P: Profile, C: ByteCode, const SLOTS: usize>(
        &self,
        arguments: &CallArguments<'_, P, C, SLOTS>,
    ) -> Vec<u8> {
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
        line
    }

    /// Returns a coordinate of the robot, if it knows any.
    pub fn position(&self, axis: Axis) -> Option<f32> {
        let name = match axis {
            Axis::X => "x",
            Axis::Y => "y",
            Axis::Z => "z",
            Axis::Orientation => "orientation",
        };
        self.position.contains(&name).then_some(0.0)
    }

    /// Returns the bytes of a string, or a placeholder for a constant whose text is neither in the
    /// image nor in the symbols.
    fn bytes<P: Profile, C: ByteCode, const N: usize>(&self, text: &Text<'_, P, C, N>) -> Vec<u8> {
        if let Some(known) = text.number().and_then(|number| self.string(number)) {
            return known.as_bytes().to_vec();
        }
        match text.number() {
            Some(number) if !self.has_text => unknown_string(number),
            _ => text.bytes().collect(),
        }
    }

    fn string(&self, number: u16) -> Option<&str> {
        match self.symbols {
            Some(symbols) => symbols.string(number),
            None => builtin::STRINGS.get(usize::from(number)).copied(),
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

/// Appends a string in quotes, as in a script.
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
