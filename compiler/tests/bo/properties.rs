//! Whatever the bytes are: no panic, and either an error or an image that the verifier accepts.

use std::path::Path;

use bittybuzz_compiler::bo::import;
use bittybuzz_compiler::bo::instruction::{OperandForm, TABLE};
use bittybuzz_compiler::bo::read::Bo;
use bittybuzz_compiler::codes::DiagnosticCode;
use bittybuzz_robot_spec::NumberProfile;
use bittybuzz_vm_core::{FaultCode, ImageError};
use proptest::collection::vec;
use proptest::prelude::*;
use proptest::sample::{Index, select};

use crate::bo::assembler::assemble;
use crate::bo::interpreter;
use crate::bo::machine::{Ending, any_robot, parse_script, recorder, run_image};
use crate::bo::reference;
use crate::bo::vectors::ALL;

/// Every construct, nested in each other.
const RICH: &str = r#"
function make(a, b) {
  var sum = a + b * 2.5
  if(a > b and not isnil(sum)) { var c = sum  sum = c - 1 } else if(a == nil) return
  for(i = 0, i < 3, i = i + 1) { while(sum > 10) { sum = sum - 1  var d = function(x) { return x + sum } } }
  return {.a = a, .f = function(x) { self.a = x  return self.a + sum }, .2 = "two"}
}
t = make(1, 2)
u = t.f(3) + t["f"](4)
v = make(1, 2).f(-5 % 3)
function step() { foreach(t, function(k, value) { log(k, " ", value) })  math.rng.setseed(u) }
w = (1 < 2 or 3 >= 4) r = !5 & 6 | 7 << 1 ^ 2
m = math  neighbors.listen("k", function(topic, value, robot) { w = value })
"#;

/// What the interpreter of these tests can run.
const COMPARABLE: &str = r#"
function make(a, b) {
  var sum = a + b
  if(a < b and not isnil(sum)) { var c = sum * 2  sum = c - 1 } else record(a)
  for(i = 0, i < 3, i = i + 1) { var d = function(x) { return x + sum + i }  record(d(i)) }
  while(sum > 3) { sum = sum - 2  if(sum < 6) var odd = sum  record(sum) }
  return function(x) { return a * 100 + x }
}
function nil_of(x) { return nil }
t = {.a = 1, .f = function(x) { self.a = x  return function(y) { return self.a + x + y } }}
g = make(1, 2)
record(g(3), t.f(4)(5))
foreach(t, function(k, v) { var inner = function() { record(k) }  inner() })
r = (1 < 2 or record("both"))
"#;

fn rich() -> Vec<u8> {
    reference::compile(&parse_script("rich.bzz", RICH))
}

/// Checks one file, for a certain robot and for any, in both profiles.
fn check(bytes: &[u8]) -> Result<(), TestCaseError> {
    for profile in [NumberProfile::Full, NumberProfile::Tiny] {
        for options in [recorder(profile), any_robot(profile)] {
            let Ok(imported) = import(Path::new("test.bo"), bytes, Some(bytes), &options) else {
                return Ok(());
            };
            let internal =
                imported.compiled.diagnostics.iter().find(|d| d.code == DiagnosticCode::Internal);
            prop_assert!(internal.is_none(), "{internal:?}");
            if let (Some(image), Some(symbols)) =
                (imported.compiled.image, imported.compiled.symbols)
            {
                match run_image(&image, &symbols) {
                    // Running ends in some way; a machine may lack what the program needs.
                    Ok(_) | Err(ImageError::Features(_)) => {}
                    Err(error) => prop_assert!(false, "refused: {error:?}"),
                }
            }
        }
    }
    Ok(())
}

/// Where the file does something in its own machine, it does the same when it is imported.
fn compare(bytes: &[u8]) -> Result<(), TestCaseError> {
    let options = recorder(NumberProfile::Full);
    let Ok(imported) = import(Path::new("test.bo"), bytes, None, &options) else { return Ok(()) };
    let (Some(image), Some(symbols)) = (imported.compiled.image, imported.compiled.symbols) else {
        return Ok(());
    };
    let trace = interpreter::run(bytes);
    let found = run_image(&image, &symbols).expect("the verifier accepts it");
    // Here a missing argument stays missing, there it is nil once a local after it is assigned.
    let allowed = [FaultCode::StackOverflow, FaultCode::MissingArgument].map(Ending::Fault);
    if trace.stop.is_some() || allowed.contains(&found.ending) {
        return Ok(());
    }
    prop_assert_eq!(found.ending, Ending::Done);
    prop_assert_eq!(&found.lines, &trace.lines);
    for (name, value) in &found.globals {
        let expected = trace.globals.iter().find(|(known, _)| known == name);
        prop_assert_eq!(expected.map_or("nil", |(_, value)| value.as_str()), value);
    }
    Ok(())
}

/// A change of a file.
#[derive(Debug, Clone)]
enum Change {
    /// A byte becomes another one.
    Byte(Index, u8),
    /// Some bytes disappear.
    Remove(Index, usize),
    /// Some bytes are repeated elsewhere.
    Copy(Index, Index, usize),
    /// The argument of an instruction becomes a small number.
    Argument(Index, i32),
    /// A jump or function leads to another instruction.
    Target(Index, Index),
    /// An instruction without argument becomes another one.
    Opcode(Index, u8),
}

fn change() -> impl Strategy<Value = Change> {
    prop_oneof![
        (any::<Index>(), any::<u8>()).prop_map(|(at, byte)| Change::Byte(at, byte)),
        (any::<Index>(), 1..12usize).prop_map(|(at, length)| Change::Remove(at, length)),
        (any::<Index>(), any::<Index>(), 1..20usize).prop_map(|(a, b, n)| Change::Copy(a, b, n)),
        (any::<Index>(), -1..8i32).prop_map(|(at, number)| Change::Argument(at, number)),
        (any::<Index>(), any::<Index>()).prop_map(|(at, to)| Change::Target(at, to)),
        (any::<Index>(), 0..35u8).prop_map(|(at, opcode)| Change::Opcode(at, opcode)),
    ]
}

impl Change {
    fn apply(&self, bytes: &mut Vec<u8>) {
        if bytes.is_empty() {
            return;
        }
        // The form of an instruction by its mnemonic.
        let form =
            |name: &str| TABLE.iter().find(|(known, _)| *known == name).map(|(_, form)| *form);
        let instructions = |wanted: fn(&OperandForm) -> bool| -> Vec<usize> {
            let code = Bo::read(bytes).map(|bo| bo.code).unwrap_or_default();
            let found = code.iter().filter(|i| form(i.mnemonic).is_some_and(|form| wanted(&form)));
            found.map(|instruction| instruction.offset).collect()
        };
        match self {
            Change::Byte(at, byte) => *at.get_mut(bytes) = *byte,
            Change::Remove(at, length) => {
                let start = at.index(bytes.len());
                bytes.drain(start..(start + length).min(bytes.len()));
            }
            Change::Copy(from, to, length) => {
                let start = from.index(bytes.len());
                let copied = bytes[start..(start + length).min(bytes.len())].to_vec();
                let to = to.index(bytes.len());
                bytes.splice(to..to, copied);
            }
            Change::Argument(at, number) => {
                let places = instructions(|form| {
                    matches!(
                        form,
                        OperandForm::Int(_) | OperandForm::String(_) | OperandForm::Locals(_)
                    )
                });
                if !places.is_empty() {
                    let place = at.get(&places) + 1;
                    bytes[place..place + 4].copy_from_slice(&number.to_le_bytes());
                }
            }
            Change::Target(at, to) => {
                let places = instructions(|form| matches!(form, OperandForm::Address(_)));
                let targets = instructions(|_| true);
                if !places.is_empty() {
                    let (place, target) = (at.get(&places) + 1, *to.get(&targets) as i32);
                    bytes[place..place + 4].copy_from_slice(&target.to_le_bytes());
                }
            }
            Change::Opcode(at, opcode) => {
                let places = instructions(|form| matches!(form, OperandForm::Plain(_)));
                if !places.is_empty() {
                    bytes[*at.get(&places)] = *opcode;
                }
            }
        }
    }
}

/// Statements of assembly text, made of parts that fit together more often than not.
fn statement(depth: u32) -> BoxedStrategy<String> {
    let value = select(vec![
        "pushi 1",
        "pushnil",
        "pushf 1.5",
        "pushs 1",
        "lload 0",
        "lload 1",
        "lload 2",
        "lload 3",
        "pushs 0\ngload",
        "pushs 2\ngload",
        "pusht\ndup\npushs 1\npushi 2\ntput",
        "pushnil\npushs 2\ngload\nlload 1\npushi 1\ncallc",
        "pushs 0\ngload\ndup\npushs 1\ntget\npushi 0\ncallc",
        "lload 1\npushi 1\nadd",
        "lload 1\nlload 2\nland",
        "pushl @L",
    ]);
    let simple = (value.clone(), select(vec!["lstore 1", "lstore 2", "lstore 3", "ret1"]))
        .prop_map(|(value, end)| format!("{value}\n{end}\n"));
    let global = value.clone().prop_map(|value| format!("pushs 0\n{value}\ngstore\n"));
    let declare = (1..5u32).prop_map(|local| format!("pushnil\nlstore {local}\n"));
    let remove = (1..3u32).prop_map(|count| format!("lremove {count}\n"));
    let leaf = prop_oneof![simple, global, declare, remove, Just("ret0\n".to_owned())];
    if depth == 0 {
        return leaf.boxed();
    }
    let block = move || vec(statement(depth - 1), 0..4).prop_map(|parts| parts.concat());
    let labels = any::<u32>();
    let branch = (value.clone(), block(), block(), labels).prop_map(|(value, then, other, n)| {
        format!("{value}\njumpz @a{n}\n{then}jump @b{n}\n@a{n}\n{other}@b{n}\n")
    });
    let single = (value.clone(), block(), labels)
        .prop_map(|(value, then, n)| format!("{value}\njumpz @a{n}\n{then}@a{n}\n"));
    let repeat = (value.clone(), block(), labels).prop_map(|(value, body, n)| {
        format!("@s{n}\n{value}\njumpz @e{n}\n{body}jump @s{n}\n@e{n}\n")
    });
    let counted = (value, statement(0), block(), labels).prop_map(|(value, update, body, n)| {
        format!(
            "@c{n}\n{value}\njumpnz @b{n}\njump @e{n}\n@u{n}\n{update}jump @c{n}\n@b{n}\n{body}jump @u{n}\n@e{n}\n"
        )
    });
    prop_oneof![4 => leaf, 1 => branch, 1 => single, 1 => repeat, 1 => counted].boxed()
}

/// A function with lambdas: every `pushl` gets a chunk of its own.
fn program() -> impl Strategy<Value = String> {
    let body = || vec(statement(2), 0..6).prop_map(|parts| parts.concat());
    let removed = prop_oneof![2 => Just(0), 1 => 1..4u32];
    (vec(body(), 1..5), vec(removed, 1..12)).prop_map(|(bodies, removed)| {
        let mut text =
            "!3\n'x\n'y\n'f\npushs 2\npushcn @F\ngstore\nnop\npushnil\npushs 2\ngload\npushi 1\npushi 1\ncallc\npop\ndone\n@F\n".to_owned();
        let mut waiting = vec!["F".to_owned()];
        let mut lambdas = 0;
        let mut number = 0;
        while number < waiting.len() {
            if number > 0 {
                text.push_str(&format!("@{}\n", waiting[number]));
            }
            // Deeper lambdas create no more of them.
            let mut body = if number < 6 { bodies[number % bodies.len()].clone() } else { String::new() };
            body = relabel(&body, number);
            while body.contains("pushl @L\n") {
                lambdas += 1;
                body = body.replacen("pushl @L\n", &format!("pushl @lambda{lambdas}\n"), 1);
                waiting.push(format!("lambda{lambdas}"));
            }
            text.push_str(&body);
            match removed[number % removed.len()] {
                0 => {}
                count => text.push_str(&format!("lremove {count}\n")),
            }
            text.push_str("ret0\n");
            number += 1;
        }
        text
    })
}

/// Labels of each copy of a body are its own.
fn relabel(body: &str, number: usize) -> String {
    let rename = |line: &str| match line.split_once('@') {
        Some((before, label)) if label != "L" => format!("{before}@{label}_{number}\n"),
        _ => format!("{line}\n"),
    };
    body.lines().map(rename).collect()
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn any_bytes(bytes in vec(any::<u8>(), 0..200)) {
        check(&bytes)?;
    }

    /// The strings are right, and opcodes exist.
    #[test]
    fn any_instructions(code in vec((0..47u8, -2..60i32), 0..60)) {
        let mut bytes = vec![2, 0, b'x', 0, b'f', 0, 0];
        for (opcode, argument) in code {
            bytes.push(opcode);
            if !matches!(TABLE[usize::from(opcode)].1, OperandForm::Plain(_)) {
                bytes.extend(argument.to_le_bytes());
            }
        }
        bytes.push(1);
        check(&bytes)?;
    }

    #[test]
    fn changed_vectors(vector in select(ALL.to_vec()), changes in vec(change(), 1..4)) {
        let mut bytes = vector.bytes.to_vec();
        changes.iter().for_each(|change| change.apply(&mut bytes));
        check(&bytes)?;
    }

    #[test]
    fn changed_program(changes in vec(change(), 1..3)) {
        let mut bytes = rich();
        changes.iter().for_each(|change| change.apply(&mut bytes));
        check(&bytes)?;
    }

    #[test]
    fn programs_of_fitting_parts(text in program()) {
        let bytes = assemble(&text);
        check(&bytes)?;
        compare(&bytes)?;
    }

    #[test]
    fn changed_program_keeps_its_meaning(change in change()) {
        let parsed = parse_script("comparable.bzz", COMPARABLE);
        let mut bytes = reference::compile(&parsed);
        change.apply(&mut bytes);
        compare(&bytes)?;
    }
}

/// Most generated programs must be programs, or the last property says little.
#[test]
fn fitting_parts_often_make_programs() {
    use proptest::strategy::ValueTree;
    use proptest::test_runner::TestRunner;
    let mut runner = TestRunner::deterministic();
    let mut causes = std::collections::BTreeMap::new();
    for _ in 0..500 {
        let text = program().new_tree(&mut runner).expect("a program").current();
        let result = import(Path::new("t"), &assemble(&text), None, &recorder(NumberProfile::Full));
        let ending = match result {
            Ok(imported) if imported.compiled.image.is_some() => "image".to_owned(),
            Ok(_) => "diagnostics".to_owned(),
            Err(error) => format!("{:?}", error.cause),
        };
        *causes.entry(ending).or_insert(0) += 1;
    }
    assert!(causes.get("image").is_some_and(|count| *count > 50), "{causes:?}");
}

#[test]
fn comparable_program_is_compared() {
    let bytes = reference::compile(&parse_script("comparable.bzz", COMPARABLE));
    let trace = interpreter::run(&bytes);
    assert_eq!((trace.stop, trace.lines.len()), (None, 8), "{trace:?}");
    compare(&bytes).expect("the same");
}

#[test]
fn rich_program_is_imported() {
    let imported =
        import(Path::new("t"), &rich(), None, &any_robot(NumberProfile::Full)).expect("a program");
    assert!(imported.compiled.image.is_some(), "{:?}", imported.compiled.diagnostics);
}
