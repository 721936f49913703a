//! The assembler: forms of operands, jumps, dead code, and what it refuses.

use bittybuzz_compiler::asm::{AsmErrorKind, FunctionBuilder, Shape};
use bittybuzz_compiler::image::{BYTES_MAX, ImageContent};
use bittybuzz_compiler::include::SOURCE_BYTES_MAX;
use bittybuzz_compiler::limits::{ARGUMENTS_MAX, CAPTURES_MAX, DEPTH_MAX, PARAMETERS_MAX};
use bittybuzz_compiler::parser::NESTING_MAX;
use bittybuzz_compiler::source::{FileId, Span};
use bittybuzz_compiler::strings::StringTable;
use bittybuzz_vm_core::opcode::*;

use crate::back::machine::{FULL, TINY, verify};

fn span() -> Span {
    Span { file: FileId(0), start: 0, end: 1 }
}

fn builder(parameters: usize) -> FunctionBuilder {
    FunctionBuilder::new(Shape { parameters, ..Shape::default() }, 4, span())
}

/// The bytes of the instructions.
fn code(builder: FunctionBuilder) -> Vec<u8> {
    builder.finish(span()).expect("can be assembled").bytes[2..].to_vec()
}

fn error(builder: FunctionBuilder) -> AsmErrorKind {
    builder.finish(span()).expect_err("cannot be assembled").kind
}

/// Has the verifier look at a function, which is called from the global code.
fn accepted(builder: FunctionBuilder, parameters: usize) {
    let mut global = FunctionBuilder::new(Shape::default(), 4, span());
    for _ in 0..parameters {
        global.plain(NIL, span());
    }
    global.call_function(1, parameters, span());
    global.pop(1, span());
    let functions = [global, builder].map(|b| b.finish(span()).expect("can be assembled")).to_vec();
    let strings = StringTable::new(["a"]);
    let parts =
        ImageContent { full: true, globals: 200, strings, functions, ..ImageContent::default() };
    let image = parts.write().expect("fits an image");
    assert_eq!(verify(&image.bytes, FULL), Ok(()), "{:x?}", image.bytes);
}

#[test]
fn the_shortest_form_at_every_boundary() {
    let one = |opcode: u8, operand: i32| {
        let mut b = builder(10);
        // Locals and operands to name.
        (0..12).for_each(|_| b.plain(NIL, span()));
        b.operand(opcode, operand, span());
        let bytes = code(b);
        bytes[12..bytes.len() - 2].to_vec()
    };
    assert_eq!(one(LOCAL_GET, -4), [0x80]);
    assert_eq!(one(LOCAL_GET, -5), [LOCAL_GET, 0xfb]);
    assert_eq!(one(LOCAL_GET, 11), [0x8f]);
    assert_eq!(one(LOCAL_GET, 12), [LOCAL_GET, 12]);
    assert_eq!(one(INT, -2), [INT, 0xfe]);
    assert_eq!(one(INT, -1), [0x90]);
    assert_eq!(one(INT, 14), [0x9f]);
    assert_eq!(one(INT, 15), [INT, 15]);
    assert_eq!(one(INT, 127), [INT, 127]);
    assert_eq!(one(INT, 128), [INT | WIDE, 128, 0]);
    assert_eq!(one(INT, -128), [INT, 0x80]);
    assert_eq!(one(INT, -129), [INT | WIDE, 0x7f, 0xff]);
    assert_eq!(one(INT, 32767), [INT | WIDE, 0xff, 0x7f]);
    assert_eq!(one(GLOBAL_GET, 15), [0xaf]);
    assert_eq!(one(GLOBAL_GET, 16), [GLOBAL_GET, 16]);
    assert_eq!(one(GLOBAL_SET, 7), [0xb7]);
    assert_eq!(one(GLOBAL_SET, 8), [GLOBAL_SET, 8]);
}

#[test]
fn returns_name_the_parameters() {
    for (parameters, expected) in [(0, vec![0xbc]), (3, vec![0xbf]), (4, vec![RETURN_NIL, 4])] {
        assert_eq!(code(builder(parameters)), expected);
        let mut b = builder(parameters);
        b.plain(NIL, span());
        b.ret(span());
        let expected =
            if parameters < 4 { vec![NIL, 0xb8 + parameters as u8] } else { vec![NIL, RETURN, 4] };
        assert_eq!(code(b), expected);
    }
}

#[test]
fn integers_beyond_16_bits_are_words() {
    let mut b = builder(0);
    b.int(32768, span());
    b.pop(1, span());
    assert_eq!(code(b), [INT_WORD, 0, 0x80, 0, 0, POP, 0xbc]);
}

/// A forward jump over so many bytes, at least 3.
fn jump_over(bytes: usize) -> FunctionBuilder {
    let mut b = builder(0);
    let end = b.label();
    b.operand(GLOBAL_GET, 0, span());
    b.jump(JUMP_FALSE, end, span());
    let mut left = bytes;
    if left % 2 == 1 {
        b.plain(NIL, span());
        b.operand(GLOBAL_SET, 9, span());
        left -= 3;
    }
    (0..left / 2).for_each(|_| {
        b.plain(NIL, span());
        b.plain(POP, span());
    });
    b.bind(end, span());
    b.plain(NIL, span());
    b.plain(POP, span());
    b
}

#[test]
fn forward_jumps_grow_when_they_must() {
    assert_eq!(code(jump_over(127))[1..3], [JUMP_FALSE, 127]);
    assert_eq!(code(jump_over(128))[1..4], [JUMP_FALSE | WIDE, 128, 0]);
    accepted(jump_over(127), 0);
    accepted(jump_over(128), 0);
    accepted(jump_over(1000), 0);
}

/// A loop with so many bytes between its head and the end of its last jump.
fn loop_of(pairs: usize) -> FunctionBuilder {
    let mut b = builder(0);
    let entry = b.label();
    let head = b.loop_head(Some(entry), span());
    (0..pairs).for_each(|_| {
        b.plain(NIL, span());
        b.plain(POP, span());
    });
    b.bind(entry, span());
    b.operand(GLOBAL_GET, 0, span());
    b.jump(JUMP_TRUE, head, span());
    b
}

#[test]
fn backward_jumps_grow_when_they_must() {
    // Body, GLOBAL_GET and the jump itself.
    let near = code(loop_of(62));
    assert_eq!(near[near.len() - 3..], [JUMP_TRUE, (-(124_i32 + 1 + 2)) as u8, 0xbc]);
    let far = code(loop_of(63));
    let distance = (-(126_i16 + 1 + 3)).to_le_bytes();
    assert_eq!(far[far.len() - 4..], [JUMP_TRUE | WIDE, distance[0], distance[1], 0xbc]);
    accepted(loop_of(62), 0);
    accepted(loop_of(63), 0);
    accepted(loop_of(5000), 0);
}

#[test]
fn one_jump_that_grows_makes_another_grow() {
    // The inner jump stands in the last bytes that the outer one can pass narrowly.
    let mut b = builder(0);
    let (outer, inner) = (b.label(), b.label());
    b.operand(GLOBAL_GET, 0, span());
    b.jump(JUMP_FALSE, outer, span());
    b.operand(GLOBAL_GET, 0, span());
    b.jump(JUMP_FALSE, inner, span());
    (0..62).for_each(|_| {
        b.plain(NIL, span());
        b.plain(POP, span());
    });
    b.bind(outer, span());
    (0..2).for_each(|_| {
        b.plain(NIL, span());
        b.plain(POP, span());
    });
    b.bind(inner, span());
    let bytes = code(b);
    // Narrow the outer jump would pass 1 + 2 + 124 = 127 bytes; with the inner one wide it is 128.
    assert_eq!(bytes[1], JUMP_FALSE | WIDE);
    assert_eq!(bytes[5], JUMP_FALSE | WIDE);
}

#[test]
fn too_far_is_an_error_not_a_wrong_jump() {
    assert_eq!(error(jump_over(32768)), AsmErrorKind::JumpTooFar);
    accepted(jump_over(32767), 0);
}

#[test]
fn code_that_nothing_reaches_is_dropped() {
    let mut b = builder(0);
    b.ret_nil(span());
    b.plain(NIL, span());
    b.plain(POP, span());
    let label = b.label();
    b.jump(JUMP, label, span());
    b.plain(ADD, span());
    // Nothing reachable jumps here.
    b.bind(label, span());
    b.plain(ADD, span());
    assert_eq!(code(b), [0xbc]);
}

#[test]
fn jumps_to_the_end_return_at_once() {
    let mut b = builder(0);
    let (other, end) = (b.label(), b.label());
    b.operand(GLOBAL_GET, 0, span());
    b.jump(JUMP_FALSE, other, span());
    b.jump(JUMP, end, span());
    b.bind(other, span());
    b.operand(GLOBAL_GET, 1, span());
    b.plain(POP, span());
    b.bind(end, span());
    let bytes = code(b);
    assert_eq!(bytes, [0xa0, JUMP_FALSE, 1, 0xbc, 0xa1, POP, 0xbc]);
}

#[test]
fn a_return_that_lost_its_jumps_is_dropped() {
    let mut b = builder(0);
    let (other, end) = (b.label(), b.label());
    b.operand(GLOBAL_GET, 0, span());
    b.jump(JUMP_FALSE, other, span());
    b.jump(JUMP, end, span());
    b.bind(other, span());
    b.operand(GLOBAL_GET, 1, span());
    b.ret(span());
    b.bind(end, span());
    assert_eq!(code(b), [0xa0, JUMP_FALSE, 1, 0xbc, 0xa1, 0xb8]);
}

#[test]
fn a_jump_to_the_next_instruction_is_dropped_unless_a_loop_needs_it() {
    let mut b = builder(0);
    let next = b.label();
    b.jump(JUMP, next, span());
    b.bind(next, span());
    assert_eq!(code(b), [0xbc]);

    let mut b = builder(0);
    let head = b.loop_head(None, span());
    b.operand(GLOBAL_GET, 0, span());
    b.plain(POP, span());
    b.jump(JUMP, head, span());
    assert_eq!(code(b), [JUMP, 0, 0xa0, POP, JUMP, 0xfc]);

    // A loop that is left before it repeats is none.
    let mut b = builder(0);
    b.loop_head(None, span());
    b.ret_nil(span());
    assert_eq!(code(b), [0xbc]);
}

#[test]
fn and_or_keep_a_value_where_they_jump() {
    let mut b = builder(0);
    let end = b.label();
    b.operand(GLOBAL_GET, 0, span());
    b.jump(AND, end, span());
    b.operand(GLOBAL_GET, 1, span());
    b.plain(TRUTH, span());
    b.bind(end, span());
    assert_eq!(b.depth(), 1);
    b.ret(span());
    accepted(b, 0);
}

#[test]
fn mistakes_of_the_caller_are_errors() {
    let mut b = builder(0);
    b.plain(POP, span());
    assert_eq!(error(b), AsmErrorKind::Underflow);

    // The hidden slots are no operands.
    let shape = Shape { captures: true, uses_self: true, parameters: 0 };
    let mut b = FunctionBuilder::new(shape, 4, span());
    assert_eq!(b.depth(), 2);
    b.plain(POP, span());
    assert_eq!(error(b), AsmErrorKind::Underflow);

    let mut b = builder(0);
    let label = b.label();
    b.operand(GLOBAL_GET, 0, span());
    b.jump(JUMP_FALSE, label, span());
    b.plain(NIL, span());
    b.bind(label, span());
    assert_eq!(error(b), AsmErrorKind::DepthMismatch);

    let mut b = builder(0);
    let label = b.label();
    b.jump(JUMP, label, span());
    assert_eq!(error(b), AsmErrorKind::BadLabel);

    // Backwards to a place that no JUMP stands before.
    let mut b = builder(0);
    let label = b.label();
    b.bind(label, span());
    b.operand(GLOBAL_GET, 0, span());
    b.jump(JUMP_TRUE, label, span());
    assert_eq!(error(b), AsmErrorKind::BadLabel);

    let mut b = builder(0);
    b.plain(JUMP, span());
    assert_eq!(error(b), AsmErrorKind::BadOpcode);

    let mut b = builder(0);
    b.plain(0x07, span());
    assert_eq!(error(b), AsmErrorKind::BadOpcode);
}

#[test]
fn limits() {
    let deep = |slots: usize| {
        let mut b = builder(0);
        (0..slots).for_each(|_| b.plain(NIL, span()));
        b
    };
    assert_eq!(deep(200).finish(span()).unwrap().bytes[1], 200);
    accepted(deep(200), 0);
    assert_eq!(error(deep(201)), AsmErrorKind::TooDeep);
    accepted(builder(31), 31);
    assert_eq!(error(builder(32)), AsmErrorKind::TooManyParameters);
    let global = |number| {
        let mut b = builder(0);
        b.operand(GLOBAL_GET, number, span());
        b.finish(span()).map_err(|error| error.kind)
    };
    assert!(global(32767).is_ok());
    assert_eq!(global(32768), Err(AsmErrorKind::OperandRange));
    let call = |arguments| {
        let mut b = deep(130);
        b.call_native(CALL_BUILTIN, 16, arguments, false, span());
        b.finish(span()).map_err(|error| error.kind)
    };
    assert!(call(127).is_ok());
    assert_eq!(call(128), Err(AsmErrorKind::TooManyArguments));
    let closure = |captures| {
        let mut b = deep(200);
        b.closure(1, captures, span());
        b.finish(span()).map_err(|error| error.kind)
    };
    assert!(closure(199).is_ok());
    assert_eq!(closure(200), Err(AsmErrorKind::TooManyArguments));
}

#[test]
fn words_have_the_size_of_the_profile() {
    let mut b = FunctionBuilder::new(Shape::default(), 2, span());
    b.word(FLOAT, 0x3e00, span());
    b.ret(span());
    let function = b.finish(span()).unwrap();
    assert_eq!(function.bytes, [0, 1, FLOAT, 0x00, 0x3e, 0xb8]);
    let parts = ImageContent { functions: vec![function], ..ImageContent::default() };
    assert_eq!(verify(&parts.write().unwrap().bytes, TINY), Ok(()));
}

#[test]
fn lines_start_where_the_source_changes() {
    let at = |start| Span { start, ..span() };
    let mut b = builder(0);
    b.plain(NIL, at(1));
    b.plain(POP, at(1));
    b.int(300, at(2));
    b.plain(POP, at(1));
    let function = b.finish(at(3)).unwrap();
    assert_eq!(function.lines, [(2, at(1)), (4, at(2)), (7, at(1)), (8, at(3))]);
}

#[test]
fn compatibility_states_the_limits() {
    let page = include_str!("../../../COMPATIBILITY.md");
    let rows: Vec<&str> = page.lines().filter(|line| line.starts_with("| ")).collect();
    for (what, value) in [
        ("levels of brackets", NESTING_MAX as usize),
        ("parameters of a function", PARAMETERS_MAX),
        ("arguments of a call", ARGUMENTS_MAX),
        ("captured variables", CAPTURES_MAX),
        ("values of a function", DEPTH_MAX),
        ("names, strings and functions", i16::MAX as usize),
        ("bytes of a script", SOURCE_BYTES_MAX),
        ("bytes of an image", BYTES_MAX),
    ] {
        let row = rows.iter().find(|row| row.contains(what)).expect(what);
        assert!(row.contains(&format!("| {value}")), "{row}: {value}");
    }
}
