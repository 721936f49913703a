//! This computer in the role of a robot, as `bbz run --steps` has it: robot functions and `log`
//! append lines to a text, and delays take no time.

use bittybuzz_arena::robot::{Piece, unknown_string};
use bittybuzz_compiler::symbols::Symbols;
use bittybuzz_robot_spec::{Robot, RobotFunction, accepted_lists, accepting, idle_result};
use bittybuzz_vm_core::number::{Profile, format_float, format_int};
use bittybuzz_vm_core::{
    Argument, Axis, ByteCode, CallArguments, Calls, Fault, Host, Reply, RobotFault, Text,
};

/// The host of a script, which stands for all robots that the script may run on.
pub struct TextHost<'a> {
    functions: Vec<&'a RobotFunction>,
    /// The fields of `pos` that at least one of the robots has.
    position: Vec<&'a str>,
    symbols: &'a Symbols,
    /// Calls and log lines, each with a line feed.
    pub text: Vec<u8>,
    /// The reason why the last robot function refused its arguments.
    pub refusal: Option<String>,
}

impl<'a> TextHost<'a> {
    pub fn new(robots: &'a [Robot], symbols: &'a Symbols) -> Self {
        let tables = robots.iter().filter_map(|robot| robot.table("pos"));
        TextHost {
            position: tables.flat_map(|pos| &pos.fields).map(|field| field.name.as_str()).collect(),
            functions: robots.iter().flat_map(|robot| &robot.functions).collect(),
            symbols,
            text: Vec::new(),
            refusal: None,
        }
    }

    /// Returns the bytes of a string.
    fn bytes<P: Profile, C: ByteCode, const N: usize>(&self, text: &Text<'_, P, C, N>) -> Vec<u8> {
        match text.number() {
            None => text.bytes().collect(),
            Some(number) => match self.symbols.string(number) {
                Some(known) => known.as_bytes().to_vec(),
                None => unknown_string(number),
            },
        }
    }

    /// Appends a call as the script could write it.
    fn add_call<P: Profile, C: ByteCode, const SLOTS: usize>(
        &mut self,
        name: &str,
        arguments: &CallArguments<'_, P, C, SLOTS>,
    ) {
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
        line.extend(b")\n");
        self.text.append(&mut line);
    }
}

impl<P: Profile> Host<P> for TextHost<'_> {
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
            self.add_call(&accepted.name, &arguments);
        }
        Ok(Reply::Value(idle_result(accepted)))
    }

    fn log<C: ByteCode, const SLOTS: usize>(&mut self, arguments: CallArguments<'_, P, C, SLOTS>) {
        for index in 0..arguments.count() {
            let piece = match arguments.item(index) {
                Argument::Nil => Piece::Nil,
                Argument::String(text) => Piece::Text(self.bytes(&text)),
                Argument::Table(size) => Piece::Table(size),
                Argument::Function => Piece::Function,
                Argument::Int(value) => Piece::Int(value),
                Argument::Float(value) => Piece::Float(value),
            };
            piece.append_to(None, &mut self.text);
        }
        self.text.push(b'\n');
    }

    fn delay_is_over(&mut self, _ms: i32, _again: bool) -> bool {
        true
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
