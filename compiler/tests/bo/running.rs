//! What imported programs do.

use bittybuzz_compiler::codes::DiagnosticCode;
use bittybuzz_vm_core::{FaultCode, Image};

use crate::bo::assembler::assemble;
use crate::bo::machine::{Ending, Run, import, parse_script, run};
use crate::bo::{reference, vectors};

fn run_vector(vector: &vectors::Vector) -> Run {
    run(&import(vector.bytes).compiled)
}

fn run_assembly(text: &str) -> Run {
    run(&import(&assemble(text)).compiled)
}

#[test]
fn globals_and_literals() {
    assert_eq!(run_vector(&vectors::GLOBAL).global("x"), "1");
    let run = run_vector(&vectors::LITERALS);
    assert_eq!(run.global("a"), "2.5");
    assert_eq!(run.global("b"), "-3");
    assert_eq!(run.global("c"), "\"hi\"");
    assert_eq!(run.global("d"), "nil");
}

#[test]
fn named_function() {
    assert_eq!(run_vector(&vectors::FUNCTION).global("y"), "3");
}

#[test]
fn if_and_else() {
    // nil is below 3.
    assert_eq!(run_vector(&vectors::IF_ELSE).global("y"), "2");
    let with_x = vectors::IF_ELSE.assembly.replacen("nop\n", "nop\npushs 0\npushi 4\ngstore\n", 1);
    assert_eq!(run_assembly(&with_x).global("y"), "1");
}

#[test]
fn while_loop() {
    assert_eq!(run_vector(&vectors::WHILE).ending, Ending::Fault(FaultCode::WrongType));
    let from_0 = vectors::WHILE.assembly.replacen("nop\n", "nop\npushs 0\npushi 0\ngstore\n", 1);
    assert_eq!(run_assembly(&from_0).global("i"), "3");
}

#[test]
fn for_loop() {
    let run = run_vector(&vectors::FOR);
    assert_eq!(run.lines, ["f(0)", "f(1)", "f(2)"]);
    assert_eq!(run.global("i"), "3");
}

#[test]
fn table_literal_and_elements() {
    let logged = vectors::TABLE.assembly.replacen(
        "@__exitpoint",
        "pushnil\npushs 5\ngload\n\
         pushs 0\ngload\npushs 1\ntget\n\
         pushs 0\ngload\npushs 3\ntget\n\
         pushs 0\ngload\npushs 4\ntget\n\
         pushi 3\ncallc\npop\n@__exitpoint",
        1,
    );
    let logged = logged.replacen("!5\n", "!6\n", 1).replacen("'z\n", "'z\n'log\n", 1);
    assert_eq!(run_assembly(&logged).lines, ["11a"]);
}

/// `h` is nowhere, which is an error of a script, too.
#[test]
fn unknown_function_is_an_error() {
    let compiled = import(vectors::METHODS.bytes).compiled;
    assert!(compiled.image.is_none());
    let errors: Vec<_> = compiled.diagnostics.iter().filter(|d| d.code.text() < "W").collect();
    assert_eq!(errors.len(), 1);
    assert_eq!(errors[0].code, DiagnosticCode::UnknownFunction);
    // It points at the line that names it.
    assert!(compiled.sources.text(errors[0].span).ends_with("pushs 3  # \"h\""));
}

#[test]
fn lambda_with_captured_parameter() {
    assert_eq!(run_vector(&vectors::LAMBDA).global("r"), "7");
}

#[test]
fn logic_and_bits() {
    // `1 << -2` is a fault here; before it `not (nil and nil)` is 1.
    let run = run_vector(&vectors::OPERATORS);
    assert_eq!(run.ending, Ending::Fault(FaultCode::ShiftRange));
    assert_eq!(run.global("a"), "1");
}

#[test]
fn recursion() {
    // function fac(n) { if(n < 2) return 1  return n * fac(n - 1) }  r = fac(10)
    let run = run_assembly(
        "!2 / 'fac / 'r / pushs 0 / pushcn @f / gstore / nop
         pushs 1 / pushnil / pushs 0 / gload / pushi 10 / pushi 1 / callc / gstore / done
         @f / lload 1 / pushi 2 / lt / jumpz @else / pushi 1 / ret1 / @else
         lload 1 / pushnil / pushs 0 / gload / lload 1 / pushi 1 / sub / pushi 1 / callc / mul / ret1 / ret0",
    );
    assert_eq!(run.global("r"), "3628800");
}

#[test]
fn method_call_has_self() {
    // t = {.n = 5, .get = function(d) { return self.n + d }}  r = t.get(2)  s = t["get"](3)
    let run = run_assembly(
        "!5 / 't / 'n / 'get / 'r / 's / nop
         pushs 0 / pusht / dup / pushs 1 / pushi 5 / tput / dup / pushs 2 / pushl @l / tput / gstore
         pushs 3 / pushs 0 / gload / dup / pushs 2 / tget / pushi 2 / pushi 1 / callc / gstore
         pushs 4 / pushs 0 / gload / dup / pushs 2 / tget / pushi 3 / pushi 1 / callc / gstore
         done
         @l / lload 0 / pushs 1 / tget / lload 1 / add / ret1 / ret0",
    );
    assert_eq!(run.global("r"), "7");
    assert_eq!(run.global("s"), "8");
}

#[test]
fn computed_key_of_a_method() {
    // function k() { return 3 }  t = {}  t[3] = function(a) { return a + 1 }  r = t[k()](4)
    let run = run_assembly(
        "!3 / 'k / 't / 'r / pushs 0 / pushcn @k / gstore / nop
         pushs 1 / pusht / gstore
         pushs 1 / gload / pushi 3 / pushl @l / tput
         pushs 2 / pushs 1 / gload / dup / pushnil / pushs 0 / gload / pushi 0 / callc / tget
         pushi 4 / pushi 1 / callc / gstore / done
         @k / pushi 3 / ret1 / ret0
         @l / lload 1 / pushi 1 / add / ret1 / ret0",
    );
    assert_eq!(run.global("r"), "5");
}

#[test]
fn function_called_at_once() {
    // function h() { return f }  function f(x) { return x * 2 }  r = h()(21)
    let run = run_assembly(
        "!3 / 'h / 'f / 'r / pushs 0 / pushcn @h / gstore / pushs 1 / pushcn @f / gstore / nop
         pushs 2 / pushnil / pushnil / pushs 0 / gload / pushi 0 / callc / pushi 21 / pushi 1 / callc
         gstore / done
         @h / pushs 1 / gload / ret1 / ret0
         @f / lload 1 / pushi 2 / mul / ret1 / ret0",
    );
    assert_eq!(run.global("r"), "42");
}

/// Both sides of `land` and `lor` run, whatever the first one is.
#[test]
fn and_or_evaluate_both_sides() {
    let text = |logic: &str, first: &str| {
        format!(
            "!2 / 'record / 'r / nop
             pushs 1 / {first} / pushnil / pushs 0 / gload / pushi 7 / pushi 1 / callc / {logic} / gstore
             done"
        )
    };
    for (logic, first, result) in [
        ("land", "pushi 0", "0"),
        ("land", "pushi 1", "0"),
        ("lor", "pushi 0", "0"),
        ("lor", "pushi 1", "1"),
        ("lor", "pushs 0", "1"),
        ("land", "pushnil", "0"),
    ] {
        let run = run_assembly(&text(logic, first));
        assert_eq!(run.lines, ["record(7)"], "{first} {logic}");
        assert_eq!(run.global("r"), result, "{first} {logic}");
    }
}

#[test]
fn and_or_give_truth_values() {
    // r = a and b, for every kind of value.
    let values = [("pushnil", false), ("pushi 0", false), ("pushi -3", true), ("pushf 0", true)];
    for (left, a) in values {
        for (right, b) in values {
            let text = |logic| {
                format!("!1 / 'r / nop / pushs 0 / {left} / {right} / {logic} / gstore / done")
            };
            let expected = |truth: bool| i32::from(truth).to_string();
            assert_eq!(run_assembly(&text("land")).global("r"), expected(a && b));
            assert_eq!(run_assembly(&text("lor")).global("r"), expected(a || b));
        }
    }
}

/// A fault on the right side comes although the left side would decide.
#[test]
fn and_keeps_the_faults_of_its_right_side() {
    let run = run_assembly(
        "!2 / 'r / 't / nop / pushs 0 / pushi 0 / pushs 1 / gload / pushi 1 / tget / land / gstore / done",
    );
    assert_eq!(run.ending, Ending::Fault(FaultCode::NotATable));
}

#[test]
fn nested_logic_in_conditions() {
    // if((a < 3 and record(1) == nil) or b) r = 1 else r = 2, where a = 5
    let run = run_assembly(
        "!4 / 'a / 'record / 'b / 'r / nop / pushs 0 / pushi 5 / gstore
         pushs 0 / gload / pushi 3 / lt / pushnil / pushs 1 / gload / pushi 1 / pushi 1 / callc
         pushnil / eq / land / pushs 2 / gload / lor / jumpz @else
         pushs 3 / pushi 1 / gstore / jump @end / @else / pushs 3 / pushi 2 / gstore / @end / done",
    );
    assert_eq!(run.lines, ["record(1)"]);
    assert_eq!(run.global("r"), "2");
}

#[test]
fn function_that_is_assigned_later() {
    // function f() { return 1 }  r = f()  f = g  s = f()  function g() { return 2 }
    let run = run_assembly(
        "!4 / 'f / 'r / 's / 'g / pushs 0 / pushcn @f / gstore / pushs 3 / pushcn @g / gstore / nop
         pushs 1 / pushnil / pushs 0 / gload / pushi 0 / callc / gstore
         pushs 0 / pushs 3 / gload / gstore
         pushs 2 / pushnil / pushs 0 / gload / pushi 0 / callc / gstore / done
         @f / pushi 1 / ret1 / ret0
         @g / pushi 2 / ret1 / ret0",
    );
    assert_eq!((run.global("r"), run.global("s")), ("1", "2"));
}

#[test]
fn of_two_functions_with_one_name_the_later_counts() {
    let run = run_assembly(
        "!2 / 'f / 'r / pushs 0 / pushcn @a / gstore / pushs 0 / pushcn @b / gstore / nop
         pushs 1 / pushnil / pushs 0 / gload / pushi 0 / callc / gstore / done
         @a / pushi 1 / ret1 / ret0
         @b / pushi 2 / ret1 / ret0",
    );
    assert_eq!(run.global("r"), "2");
}

#[test]
fn libraries_and_built_ins() {
    // log(math.abs(-4), " ", size({.x = 1}))  m = math  log(m.floor(2.5))
    let run = run_assembly(
        "!8 / 'log / 'math / 'abs /  '  / 'size / 'x / 'm / 'floor / nop
         pushnil / pushs 0 / gload / pushs 1 / gload / dup / pushs 2 / tget / pushi -4 / pushi 1 / callc
         pushs 3 / pushnil / pushs 4 / gload / pusht / dup / pushs 5 / pushi 1 / tput / pushi 1 / callc
         pushi 3 / callc / pop
         pushs 6 / pushs 1 / gload / gstore
         pushnil / pushs 0 / gload / pushs 6 / gload / dup / pushs 7 / tget / pushf 2.5 / pushi 1 / callc
         pushi 1 / callc / pop / done",
    );
    assert_eq!(run.lines, ["4 1", "2"]);
}

#[test]
fn entries_are_called() {
    let run = run_assembly(
        "!3 / 'init / 'step / 'record / pushs 0 / pushcn @i / gstore / pushs 1 / pushcn @s / gstore / nop
         done
         @i / pushnil / pushs 2 / gload / pushi 0 / pushi 1 / callc / pop / ret0
         @s / pushnil / pushs 2 / gload / pushi 1 / pushi 1 / callc / pop / ret0",
    );
    assert_eq!(run.lines, ["record(0)", "record(1)", "record(1)", "record(1)"]);
}

#[test]
fn empty_script() {
    let run = run_assembly("!0 / nop");
    assert_eq!((run.ending, run.lines.len()), (Ending::Done, 0));
}

#[test]
fn missing_and_extra_arguments() {
    // function f(a, b) { return a }  r = f(1, 2, 3)  s = f()
    let run = run_assembly(
        "!3 / 'f / 'r / 's / pushs 0 / pushcn @f / gstore / nop
         pushs 1 / pushnil / pushs 0 / gload / pushi 1 / pushi 2 / pushi 3 / pushi 3 / callc / gstore
         pushs 2 / pushnil / pushs 0 / gload / pushi 0 / callc / gstore / done
         @f / lload 1 / ret1 / ret0",
    );
    assert_eq!(run.global("r"), "1");
    assert_eq!(run.ending, Ending::Fault(FaultCode::MissingArgument));
}

/// `self` at the top level is a global that nothing defines.
#[test]
fn global_called_self_is_nil() {
    let run = run_assembly("!2 / 'self / 'r / nop / pushs 1 / pushs 0 / gload / gstore / done");
    assert_eq!(run.global("r"), "nil");
}

/// The numbers of stigmergies are found as in a script. Functions come before the global code.
#[test]
fn stigmergies_have_a_table() {
    for (script, expected) in [
        ("v = stigmergy.create(101)", Some([101, 1, 2])),
        ("N = 101 v = stigmergy.create(N) s = stigmergy w = s.create(9)", Some([101, 9, 2])),
        (
            "w = stigmergy.create(9) function init() { var n = 7 v = stigmergy.create(n) }",
            Some([7, 9, 2]),
        ),
        ("v = stigmergy.create(2) w = swarm.create(9)", None),
    ] {
        let imported = import(&reference::compile(&parse_script("a.bzz", script)));
        let image = imported.compiled.image.as_ref().expect("no errors");
        let header = Image::new(image.as_slice()).header().expect("an image");
        let word = |at: usize| u16::from_le_bytes([image[at], image[at + 1]]);
        let table =
            header.stigmergies_at().map(|at| [0, 2, 4].map(|row| word(usize::from(at) + row)));
        assert_eq!(table, expected, "{script}");
    }
}
