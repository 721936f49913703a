//! Files that are no Buzz programs: each is refused with its cause and place.

use std::path::Path;

use bittybuzz_compiler::bo::error::{BoCause, BoError};
use bittybuzz_compiler::bo::import;
use bittybuzz_robot_spec::NumberProfile;

use crate::bo::assembler::assemble;
use crate::bo::machine::recorder;
use crate::bo::vectors;

fn error(bytes: &[u8]) -> BoError {
    match import(Path::new("test.bo"), bytes, None, &recorder(NumberProfile::Full)) {
        Ok(_) => panic!("it was imported"),
        Err(error) => error,
    }
}

/// Cause and offset for global code after `nop`, which is at offset 4; string 0 is "x".
fn in_global_code(code: &str) -> (BoCause, usize) {
    let BoError { cause, offset } = error(&assemble(&format!("!1 / 'x / nop / {code} / done")));
    (cause, offset)
}

#[test]
fn cut_files() {
    assert_eq!(error(&[]), BoError { offset: 0, cause: BoCause::NoStringCount });
    assert_eq!(error(&[1]), BoError { offset: 0, cause: BoCause::NoStringCount });
    assert_eq!(error(&[1, 0]), BoError { offset: 2, cause: BoCause::StringCut(0) });
    assert_eq!(error(&[2, 0, b'a', 0, b'b']), BoError { offset: 4, cause: BoCause::StringCut(1) });
    assert_eq!(error(&[0, 0]), BoError { offset: 2, cause: BoCause::NoRegistrationEnd });
    assert_eq!(
        error(&[0, 0, 0, 0x24, 1, 0]),
        BoError { offset: 3, cause: BoCause::ArgumentCut("pushi") }
    );
}

/// A shorter version of a program is refused, never imported in part.
#[test]
fn every_cut_of_every_vector() {
    // One is a program: `return` is its last statement, and what was `var a` may be a parameter.
    let behind_return = vectors::LOCALS.bytes.len() - 6;
    for vector in vectors::ALL {
        for length in 0..vector.bytes.len() {
            if vector.bytes != vectors::LOCALS.bytes || length != behind_return {
                error(&vector.bytes[..length]);
            }
        }
    }
}

#[test]
fn wrong_numbers() {
    assert_eq!(error(&[0, 0, 0, 47]), BoError { offset: 3, cause: BoCause::UnknownOpcode(47) });
    assert_eq!(error(&[0, 0, 0, 255]), BoError { offset: 3, cause: BoCause::UnknownOpcode(255) });
    assert_eq!(error(&[1, 0, 0xff, 0, 0]), BoError { offset: 2, cause: BoCause::StringNotUtf8(0) });
    assert_eq!(in_global_code("pushs 1 / pushi 1 / gstore"), (BoCause::UnknownString(1), 5));
    assert_eq!(in_global_code("pushs -1 / pushi 1 / gstore"), (BoCause::UnknownString(-1), 5));
    // Before the code, inside an instruction, after the end, negative.
    for to in [0, 7, 11, 1_000_000, -1] {
        assert_eq!(in_global_code(&format!("jump {to}")), (BoCause::UnknownAddress(to), 5));
    }
    let locals = assemble(
        "!1 / 'f / pushs 0 / pushcn @f / gstore / nop / done / @f / lload -1 / ret1 / ret0",
    );
    assert_eq!(error(&locals), BoError { offset: 17, cause: BoCause::NegativeLocal(-1) });
}

#[test]
fn wrong_parts() {
    let cause = |text: &str| error(&assemble(text)).cause;
    assert_eq!(cause("!1 / 'x / pushs 0 / pushi 1 / gstore / done"), BoCause::NoRegistrationEnd);
    assert_eq!(
        cause("!1 / 'x / pushs 0 / pushcn @f / nop / done / @f / ret0"),
        BoCause::NoRegistrationEnd
    );
    assert_eq!(cause("!0 / nop / pushnil"), BoCause::MisplacedDone);
    assert_eq!(cause("!0 / nop / done / done"), BoCause::MisplacedDone);
    let function = |rest: &str| format!("!1 / 'f / pushs 0 / pushcn @f / gstore / nop / {rest}");
    assert_eq!(cause(&function("@f / done")), BoCause::SharedFunction);
    assert_eq!(cause(&function("done / @f / pushnil / ret1")), BoCause::NoReturn);
    assert_eq!(cause(&function("done / @f / done / ret0")), BoCause::MisplacedDone);
    assert_eq!(cause(&function("pushnil / @f / done")), BoCause::MisplacedDone);
    assert_eq!(
        cause(&function("pushs 0 / pushcn @f / gstore / done / @f / ret0")),
        BoCause::MisplacedFunction
    );
    assert_eq!(
        cause(&function("pushs 0 / pushl @f / gstore / done / @f / ret0")),
        BoCause::SharedFunction
    );
    assert_eq!(
        cause("!1 / 'f / @f / pushs 0 / pushcn @f / gstore / nop / done"),
        BoCause::FunctionInGlobalCode
    );
    assert_eq!(
        cause(
            "!1 / 'x / nop / pushs 0 / pushl @l / gstore / pushs 0 / pushl @l / gstore / done / @l / ret0"
        ),
        BoCause::SharedFunction
    );
    // A lambda that creates itself, and two that create each other.
    assert_eq!(
        cause("!0 / nop / done / @l / pushl @l / ret1 / ret0"),
        BoCause::LambdaBeforeCreator
    );
    assert_eq!(
        cause("!0 / nop / done / @a / pushl @b / ret1 / ret0 / @b / pushl @a / ret1 / ret0"),
        BoCause::LambdaBeforeCreator
    );
    assert_eq!(
        cause("!1 / 'self / pushs 0 / pushcn @f / gstore / nop / done / @f / ret0"),
        BoCause::SelfAssigned
    );
    assert_eq!(
        cause("!1 / 'a b / pushs 0 / pushcn @f / gstore / nop / done / @f / ret0"),
        BoCause::NotAnIdentifier
    );
}

#[test]
fn wrong_stack() {
    let cases = [
        ("pop", BoCause::StackEmpty, 5),
        ("add", BoCause::StackEmpty, 5),
        ("pushi 1 / add", BoCause::StackEmpty, 10),
        ("dup", BoCause::StackEmpty, 5),
        ("gload / pop", BoCause::StackEmpty, 5),
        ("pushnil", BoCause::StackNotEmpty, 5),
        ("pushnil / pushs 0 / pushi 1 / gstore", BoCause::StackNotEmpty, 16),
        ("pushi 1 / dup / add / pop", BoCause::StrayCopy, 11),
        ("pushi 1 / dup / dup / pop", BoCause::StrayCopy, 11),
        ("pushi 1 / dup / pushs 0 / pushi 1 / tput", BoCause::StrayCopy, 21),
        ("pusht / dup / pusht / pushi 1 / tput / pop", BoCause::ComputedField, 13),
        ("pushi 1 / gload / pop", BoCause::ComputedName, 10),
        ("pushi 1 / pushi 2 / gstore", BoCause::ComputedName, 15),
        ("pushi 1 / pop", BoCause::DroppedValue, 10),
        ("pushnil / pushs 0 / gload / pushs 0 / callc / pop", BoCause::ComputedArgumentCount, 17),
        ("pushnil / pushs 0 / gload / pushi -1 / callc / pop", BoCause::ComputedArgumentCount, 17),
        ("pushnil / pushs 0 / gload / pushi 9 / callc / pop", BoCause::StackEmpty, 17),
        ("pushs 0 / gload / dup / pushi 1 / tget / pop", BoCause::MethodWithoutTable, 18),
        // A plain call with a table as self, or of a field.
        ("pusht / pushs 0 / gload / pushi 0 / callc / pop", BoCause::SelfOfPlainCall, 17),
        (
            "pushnil / pushs 0 / gload / pushi 1 / tget / pushi 0 / callc / pop",
            BoCause::SelfOfPlainCall,
            23,
        ),
        ("pushcc 0 / pop", BoCause::NativeFunction, 5),
        ("calls", BoCause::SwarmCall, 5),
        ("pushnil / lstore 0", BoCause::LocalInGlobalCode, 6),
        ("lload 1 / ret1", BoCause::LocalInGlobalCode, 5),
        ("lremove 1", BoCause::LocalInGlobalCode, 5),
    ];
    for (code, cause, offset) in cases {
        assert_eq!(in_global_code(code), (cause, offset), "{code}");
    }
    let spaced = assemble("!1 / 'a b / nop / pushs 0 / pushi 1 / gstore / done");
    assert_eq!(error(&spaced), BoError { offset: 17, cause: BoCause::NotAnIdentifier });
}

#[test]
fn wrong_jumps() {
    let cases = [
        // An endless loop, a jump over code, into the middle of an expression.
        ("@a / jump @a", 5),
        ("jump @a / pushs 0 / pushi 1 / gstore / @a", 5),
        ("pushs 0 / jump @a / @a / pushi 1 / gstore", 10),
        // Backwards without a loop.
        ("@a / pushs 0 / pushi 1 / gstore / pushi 1 / jumpz @a", 21),
        ("@a / pushi 1 / jumpnz @a", 10),
        // Out of the block that it is in.
        ("pushi 1 / jumpz @a / pushi 1 / jumpz @b / @a / pushs 0 / pushi 1 / gstore / @b", 20),
        ("pushi 1 / jumpz @a / pushi 1 / jumpz @b / pushs 0 / pushi 1 / gstore / jump @c / @b / @a
          pushs 0 / pushi 1 / gstore / @c", 20),
        // `for` without one of its jumps.
        ("@c / pushi 1 / jumpnz @b / @u / jump @c / @b / jump @u", 10),
        ("@c / pushi 1 / jumpnz @b / jump @e / @u / jump @e / @b / jump @u / @e", 20),
        ("@c / pushi 1 / jumpnz @b / jump @e / @u / jump @c / @b / jump @c / @e", 25),
    ];
    for (code, offset) in cases {
        assert_eq!(in_global_code(code), (BoCause::StrayJump, offset), "{code}");
    }
    // With a value on the stack.
    assert_eq!(
        in_global_code("pushi 1 / pushi 1 / jumpz @a / @a / pop"),
        (BoCause::StackNotEmpty, 15)
    );
    // To another function.
    let other = assemble(
        "!1 / 'f / pushs 0 / pushcn @f / gstore / nop / pushi 1 / jumpz @f / done / @f / pushnil / ret1 / ret0",
    );
    assert_eq!(error(&other), BoError { offset: 21, cause: BoCause::StrayJump });
}

#[test]
fn nesting_is_bounded() {
    let deep = |code: String| in_global_code(&code).0;
    let nots = "lnot / ".repeat(100_000);
    assert_eq!(deep(format!("pushs 0 / pushi 1 / {nots} gstore")), BoCause::TooDeep);
    let powers = format!("{}{}", "pushi 1 / ".repeat(1000), "pow / ".repeat(999));
    assert_eq!(deep(format!("pushs 0 / {powers} gstore")), BoCause::TooDeep);
    let tables = "pusht / dup / pushi 1 / ".repeat(1000);
    let puts = "tput / ".repeat(1000);
    assert_eq!(deep(format!("pushs 0 / {tables} pushi 1 / {puts} gstore")), BoCause::TooDeep);
    let opened: String = (0..1000).map(|n| format!("pushi 1 / jumpz @e{n} / ")).collect();
    let closed: String = (0..1000).rev().map(|n| format!("@e{n} / ")).collect();
    assert_eq!(
        deep(format!("{opened} pushs 0 / pushi 1 / gstore / {closed} nop")),
        BoCause::TooDeep
    );
    let lambdas: String =
        (1..1000).map(|n| format!("@l{n} / pushl @l{} / ret1 / ret0 / ", n + 1)).collect();
    let text =
        format!("!1 / 'x / nop / pushs 0 / pushl @l1 / gstore / done / {lambdas} @l1000 / ret0");
    assert_eq!(error(&assemble(&text)).cause, BoCause::TooDeep);
}

/// Operators in a row make no deep tree.
#[test]
fn rows_of_operators_are_not_bounded() {
    let sums = "pushi 1 / add / ".repeat(50_000);
    let ands = "pushnil / pushs 0 / gload / pushi 0 / callc / land / ".repeat(2000);
    for row in [format!("pushs 0 / gload / {sums}"), format!("pushi 1 / {ands}")] {
        let code = assemble(&format!("!1 / 'x / nop / pushs 0 / {row} gstore / done"));
        let imported = import(Path::new("test.bo"), &code, None, &recorder(NumberProfile::Full));
        assert!(imported.is_ok(), "{:?}", imported.err());
    }
}

#[test]
fn size_is_bounded() {
    let mut bytes = vec![0, 0];
    bytes.resize(1 << 20, 0);
    bytes.push(1);
    assert_eq!(error(&bytes), BoError { offset: 1 << 20, cause: BoCause::TooLarge });
    bytes.remove(2);
    assert!(import(Path::new("test.bo"), &bytes, None, &recorder(NumberProfile::Full)).is_ok());
}

#[test]
fn messages_are_sentences_with_the_offset() {
    assert_eq!(error(&[0, 0, 0, 47]).to_string(), "no instruction has the opcode 47 (offset 3)");
    let (cause, offset) = in_global_code("pushi 1 / pop");
    assert_eq!(
        BoError { offset, cause }.to_string(),
        "not produced by the Buzz compiler: a value that comes from no call is dropped (offset 10)"
    );
}
