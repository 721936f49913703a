//! Images that contain an instruction many times.

use crate::error::BenchError;
use crate::images::CompiledScript;
use bittybuzz_compiler::asm::{FunctionBuilder, FunctionCode, Shape};
use bittybuzz_compiler::image::{EntryPoint, ImageContent};
use bittybuzz_compiler::source::Span;
use bittybuzz_robot_spec::{NumberProfile, name_hash};
use bittybuzz_vm_core::builtin::{Feature, string};
use bittybuzz_vm_core::opcode as op;

/// The global with the result.
const RESULT: i32 = 0;
/// The result of every step that ended as it should.
pub const EXPECTED: i32 = 7;

/// Globals that hold tables and a closure.
const SMALL_GLOBAL: i32 = 1;
const LARGE_GLOBAL: i32 = 2;
const CLOSURE_GLOBAL: i32 = 3;
/// A global that has a short form.
pub const NEAR_GLOBAL: i32 = 4;
/// A global that has no short form.
pub const FAR_GLOBAL: i32 = 20;
const GLOBALS: usize = 21;

/// Locals of `step`: a table of two array elements and one field, one of twelve fields, an integer, a closure.
pub const SMALL: i32 = 1;
pub const LARGE: i32 = 2;
pub const NUMBER: i32 = 3;
pub const CLOSURE: i32 = 4;
/// A local that has no short form.
pub const FAR_LOCAL: i32 = 12;

/// The field of the small table, and the last of the large one.
pub const FIRST_FIELD: i32 = 0;
pub const LAST_FIELD: i32 = string::COUNT as i32 - 1;

/// More values than any case has on the stack.
const ROOM: usize = 80;

/// Functions: one that only returns, one that returns a constant, one with a captured value.
pub const NOTHING: i32 = 2;
pub const CONSTANT: i32 = 3;
pub const CAPTURING: i32 = 4;

/// The imported robot function.
pub const LED: i32 = 0;

/// The place of the measured instructions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CodeRegion {
    /// In `step`, after its locals.
    Step,
    /// In a function with a captured value, which `step` calls.
    Capturing,
}

/// A function that is being written.
pub struct FunctionWriter {
    builder: FunctionBuilder,
    profile: NumberProfile,
}

impl FunctionWriter {
    fn new(shape: Shape, profile: NumberProfile) -> FunctionWriter {
        let word_bytes = if profile == NumberProfile::Full { 4 } else { 2 };
        FunctionWriter { builder: FunctionBuilder::new(shape, word_bytes, SOURCE), profile }
    }

    pub fn plain(&mut self, opcode: u8) {
        self.builder.plain(opcode, SOURCE);
    }

    pub fn operand(&mut self, opcode: u8, operand: i32) {
        self.builder.operand(opcode, operand, SOURCE);
    }

    pub fn int(&mut self, value: i32) {
        self.operand(op::INT, value);
    }

    /// Writes a number as a whole word: an integer, or the float of a half, one, one and a half,
    /// two ...
    pub fn word(&mut self, opcode: u8, value: u32) {
        let bits = match (opcode, self.profile) {
            (op::FLOAT | op::FLOAT_HALF, NumberProfile::Full) => (value as f32 / 2.0).to_bits(),
            // 1 bit of sign, 6 of exponent, 9 of fraction: the upper bits of a binary32 with
            // another bias.
            (op::FLOAT | op::FLOAT_HALF, NumberProfile::Tiny) => {
                ((value as f32 / 2.0).to_bits() >> 14).wrapping_sub((127 - 31) << 9)
            }
            _ => value,
        };
        self.builder.word(opcode, bits, SOURCE);
    }

    pub fn float(&mut self, halves: u32) {
        self.word(op::FLOAT, halves);
    }

    pub fn call_function(&mut self, function: i32) {
        self.builder.call_function(function, 0, SOURCE);
    }

    pub fn call_native(&mut self, opcode: u8, number: i32) {
        self.builder.call_native(opcode, number, 1, false, SOURCE);
    }

    pub fn closure(&mut self) {
        self.builder.closure(CAPTURING, 1, SOURCE);
    }

    pub fn local_add(&mut self, local: i32) {
        self.builder.local_add(local, 1, SOURCE);
    }

    /// Writes a jump to the next instruction.
    pub fn jump(&mut self, opcode: u8) {
        let next = self.builder.label();
        self.builder.jump(opcode, next, SOURCE);
        self.builder.bind(next, SOURCE);
    }

    /// Writes a jump to the next instruction that compares with an integer.
    pub fn jump_int(&mut self, opcode: u8, immediate: i8) {
        let next = self.builder.label();
        self.builder.jump_int(opcode - op::WITH_INT, immediate.into(), next, SOURCE);
        self.builder.bind(next, SOURCE);
    }

    /// Writes a constant, a `JUMP_FALSE` that does not jump, and a `JUMP`. The `JUMP` needs code to
    /// jump over, and `JUMP_FALSE` makes that code reachable.
    pub fn jump_over(&mut self) {
        let [over, end] = [self.builder.label(), self.builder.label()];
        self.int(1);
        self.builder.jump(op::JUMP_FALSE, over, SOURCE);
        self.builder.jump(op::JUMP, end, SOURCE);
        self.builder.bind(over, SOURCE);
        self.plain(op::NIL);
        self.plain(op::POP);
        self.builder.bind(end, SOURCE);
    }

    /// Writes `AND` or `OR`, with a constant that is not reached if the instruction jumps.
    pub fn and_or(&mut self, opcode: u8) {
        let end = self.builder.label();
        self.builder.jump(opcode, end, SOURCE);
        self.int(1);
        self.builder.bind(end, SOURCE);
    }

    /// Uses so large a part of the stack that the frame has the same size with and without the
    /// measured instructions.
    fn reach_high(&mut self) {
        for _ in 0..ROOM {
            self.plain(op::NIL);
        }
        self.builder.pop(ROOM, SOURCE);
    }

    fn finish(self, name: &str) -> Result<FunctionCode, BenchError> {
        let failed =
            |error| BenchError::Costs { name: name.to_owned(), reason: format!("{error:?}") };
        self.builder.finish(SOURCE).map_err(failed)
    }
}

/// A placeholder, because these images have no source.
const SOURCE: Span = Span { file: bittybuzz_compiler::source::FileId(0), start: 0, end: 0 };

/// Returns an image whose step has the instructions `times` times.
pub fn image(
    name: &str,
    profile: NumberProfile,
    place: CodeRegion,
    times: usize,
    write: &dyn Fn(&mut FunctionWriter),
) -> Result<CompiledScript, BenchError> {
    let repeat = |body: &mut FunctionWriter, here: CodeRegion| {
        for _ in 0..if here == place { times } else { 0 } {
            write(body);
        }
    };
    let body = || FunctionWriter::new(Shape::default(), profile);
    let mut step = body();
    step.reach_high();
    locals(&mut step, place);
    repeat(&mut step, CodeRegion::Step);
    step.int(EXPECTED);
    step.operand(op::GLOBAL_SET, RESULT);
    let mut constant = body();
    constant.int(0);
    constant.builder.ret(SOURCE);
    let mut capturing = FunctionWriter::new(Shape { captures: true, ..Shape::default() }, profile);
    if place == CodeRegion::Capturing {
        capturing.reach_high();
    }
    repeat(&mut capturing, CodeRegion::Capturing);
    let functions = [global_code(body()), step, body(), constant, capturing];
    let parts = ImageContent {
        full: profile == NumberProfile::Full,
        features: Feature::Maths as u8,
        entries: [EntryPoint::None, EntryPoint::Function(1), EntryPoint::None, EntryPoint::None]
            .map(EntryPoint::to_count),
        globals: GLOBALS,
        imports: vec![name_hash("led")],
        functions: functions.map(|body| body.finish(name)).into_iter().collect::<Result<_, _>>()?,
        ..ImageContent::default()
    };
    let failed = |error| BenchError::Costs { name: name.to_owned(), reason: format!("{error}") };
    let image = parts.write().map_err(failed)?.bytes;
    Ok(CompiledScript::new(name, image, RESULT as u16))
}

/// The number of discarded tables: enough for a collection to happen before the steps, with room
/// left for the cells of three steps.
const GARBAGE: usize = 5;

/// Makes the tables and the closure, so that no step has to make them.
fn global_code(mut body: FunctionWriter) -> FunctionWriter {
    body.plain(op::TABLE_NEW);
    for key in 0..2 {
        body.int(key);
        body.int(5);
        body.plain(op::INDEX_INIT);
    }
    body.int(5);
    body.operand(op::FIELD_INIT, FIRST_FIELD);
    body.operand(op::GLOBAL_SET, SMALL_GLOBAL);
    body.plain(op::TABLE_NEW);
    for field in FIRST_FIELD..=LAST_FIELD {
        body.int(5);
        body.operand(op::FIELD_INIT, field);
    }
    body.operand(op::GLOBAL_SET, LARGE_GLOBAL);
    body.int(5);
    body.closure();
    body.operand(op::GLOBAL_SET, CLOSURE_GLOBAL);
    for _ in 0..GARBAGE {
        body.plain(op::TABLE_NEW);
        body.plain(op::POP);
    }
    body
}

fn locals(step: &mut FunctionWriter, place: CodeRegion) {
    step.operand(op::GLOBAL_GET, SMALL_GLOBAL);
    step.operand(op::GLOBAL_GET, LARGE_GLOBAL);
    step.int(5);
    step.operand(op::GLOBAL_GET, CLOSURE_GLOBAL);
    while step.builder.depth() < FAR_LOCAL as usize {
        step.int(5);
    }
    if place == CodeRegion::Capturing {
        step.operand(op::LOCAL_GET, CLOSURE);
        step.operand(op::CALL, 0);
    }
}
