//! The active functions, with their locals by name.

use bittybuzz_compiler::symbols::{LocalPlace, SourceSpan};
use bittybuzz_vm_core::ByteCode;
use bittybuzz_vm_core::inspect::{CallFrame, FramePlace};
use bittybuzz_vm_core::number::Profile;

use crate::reader::{MachineReader, builtin_name};
use crate::value::Named;

/// The offset of the closure in the frame of a function that captures values.
const CLOSURE: i16 = 1;

/// An active function.
#[derive(Debug, Clone, PartialEq)]
pub struct ScriptFrame {
    pub function: FrameFunction,
    /// The variables that the function can use at its current place, outer ones first. Without
    /// symbols, all parameters and slots.
    pub locals: Vec<Named>,
}

/// The function of a frame.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum FrameFunction {
    /// A function of the script.
    Script {
        /// The name, such as `f`, `global code`, `lambda at a.bzz:3` or, without symbols,
        /// `function 2`.
        name: String,
        /// A byte position in the current instruction: the next one in the innermost function, the
        /// call in the others.
        position: u16,
        /// The source of that instruction.
        source: Option<SourcePlace>,
    },
    /// A built-in that calls functions of the script or that waits, such as `foreach` or `delay`.
    Builtin(String),
    /// A robot function that has not finished.
    RobotFunction(String),
    /// The handling of messages before `step()`.
    Messages,
    /// The machine, about to call an entry point.
    Entry,
    /// The copy of a library to a table, for a built-in.
    LibraryCopy,
}

/// A range of the source.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SourcePlace {
    /// The path of the file.
    pub file: String,
    /// The lines and columns.
    pub place: SourceSpan,
}

/// Returns the frames of a machine, innermost first.
pub fn frames<P: Profile, C: ByteCode, const SLOTS: usize>(
    reader: &mut MachineReader<'_, P, C, SLOTS>,
) -> Vec<ScriptFrame> {
    let vm = reader.vm;
    vm.frames()
        .map(|frame| ScriptFrame {
            function: function(reader, &frame),
            locals: locals(reader, &frame),
        })
        .collect()
}

fn function<P: Profile, C: ByteCode, const SLOTS: usize>(
    reader: &MachineReader<'_, P, C, SLOTS>,
    frame: &CallFrame,
) -> FrameFunction {
    match frame.place {
        FramePlace::Script { function, position, .. } => FrameFunction::Script {
            name: reader.function(function),
            position,
            source: reader.symbols.and_then(|symbols| {
                let place = symbols.position(position.into())?;
                Some(SourcePlace { file: symbols.file(place.file)?.to_owned(), place })
            }),
        },
        FramePlace::Builtin(number) => FrameFunction::Builtin(builtin_name(number)),
        FramePlace::Robot(number) => FrameFunction::RobotFunction(reader.import(number)),
        FramePlace::Messages => FrameFunction::Messages,
        FramePlace::Entry => FrameFunction::Entry,
        FramePlace::LibraryCopy => FrameFunction::LibraryCopy,
    }
}

fn locals<P: Profile, C: ByteCode, const SLOTS: usize>(
    reader: &mut MachineReader<'_, P, C, SLOTS>,
    frame: &CallFrame,
) -> Vec<Named> {
    let FramePlace::Script { parameters, position, .. } = frame.place else { return Vec::new() };
    let vm = reader.vm;
    let Some(symbols) = reader.symbols else {
        let parameters = i16::from(parameters);
        let arguments =
            (0..parameters).map(|number| (format!("parameter {number}"), number - parameters));
        let slots = (1..=i16::MAX).map(|offset| (format!("slot {offset}"), offset));
        let all = arguments.chain(slots);
        let there = all.map_while(|(name, offset)| Some((name, vm.local_of(frame, offset)?)));
        return there.map(|(name, value)| Named { name, value: reader.value(value) }).collect();
    };
    let live = symbols.locals(position.into());
    let values = live.into_iter().rev().filter_map(|local| {
        let value = match local.place {
            LocalPlace::Frame(offset) => vm.local_of(frame, offset)?,
            LocalPlace::Capture(number) => vm.captured(vm.local_of(frame, CLOSURE)?, number),
        };
        Some((local.name.clone(), value))
    });
    values.map(|(name, value)| Named { name, value: reader.value(value) }).collect()
}
