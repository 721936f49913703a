//! Scripts.

use bittybuzz_random::Random;

use super::Entry;
use crate::bases::{Bases, SCRIPT};
use crate::case::{Case, Special};
use crate::controls;
use crate::mutation::{any_mutated, any_truncated, below, changed_text, noise, one};

pub const KINDS: &[Entry] = &[
    ("script-truncated", |bases, random, _| {
        let script = any_truncated(random, &bases.scripts);
        call(random, script)
    }),
    ("script-mutated", |bases, random, _| {
        let script = any_mutated(random, &bases.scripts);
        call(random, script)
    }),
    ("script-words", |_, random, _| {
        let script = changed_text(random, SCRIPT, WORDS);
        call(random, script)
    }),
    ("script-noise", |_, random, _| {
        let script = noise(random, 4096);
        call(random, script)
    }),
    ("script-random-words", |_, random, _| {
        let count = below(random, 400);
        let script: String = (0..count).map(|_| one(random, WORDS)).collect();
        call(random, script)
    }),
    ("script-nested", nested),
    ("script-huge", huge),
    ("script-encoding", encoding),
    ("script-controls", with_controls),
    ("script-include", including),
    ("script-fixed", |_, random, _| {
        let script = changed_text(random, SCRIPT, WORDS);
        let case = Case::new(["check", "--fix", "--robot", "kilobot", "s.bzz"]);
        case.with("s.bzz", script).writing("s.bzz")
    }),
    ("script-object", |bases, random, _| {
        let script = any_mutated(random, &bases.scripts);
        let mut case = call(random, script);
        if case.arguments[0] != "disasm" && case.arguments[0] != "stubs" {
            case.arguments.push("--json".into());
        }
        case
    }),
    ("script-stubs", |_, random, _| {
        let script = changed_text(random, SCRIPT, WORDS);
        let arguments: &[&str] =
            one(random, &[&["stubs", "s.bzz"][..], &["stubs", "s.bzz", "-o", "out.toml"]]);
        Case::new(arguments).with("s.bzz", script).writing("out.toml")
    }),
];

const WORDS: &[&str] = &[
    "(",
    ")",
    "{",
    "}",
    "[",
    "]",
    ",",
    ".",
    "=",
    "==",
    "<",
    "+",
    "-",
    "*",
    "/",
    "%",
    "^",
    "&",
    "!",
    " and ",
    " or ",
    " not ",
    " nil ",
    " self ",
    "\nvar ",
    "\nif(",
    " else ",
    "\nwhile(",
    "\nfor(",
    "\nfunction ",
    " function(",
    "\nreturn ",
    "\n",
    ";",
    "#",
    "\"",
    "'",
    "\\",
    "0",
    "-1",
    "40000",
    "2147483648",
    "1e999",
    "x",
    "t",
    "foreach",
    "log",
    "include ",
    "\"vec2.bzz\"",
    "\u{0}",
    "\u{1f916}",
];

/// Returns a call that reads the script `s.bzz`.
fn call(random: &mut Random, script: impl Into<Vec<u8>>) -> Case {
    let arguments: &[&str] = one(
        random,
        &[
            &["check", "s.bzz"][..],
            &["check", "s.bzz", "--robot", "crazyflie", "--deny", "warnings"],
            &["build", "s.bzz", "--robot", "kilobot", "-o", "out"],
            &["build", "s.bzz", "--robot", "zooids", "-o", "out"],
            &["run", "s.bzz", "--steps", "3"],
            &["run", "s.bzz", "--robot", "kilobot", "--steps", "2", "--checks", "--destroy"],
            &["disasm", "s.bzz"],
            &["stubs", "s.bzz"],
            &["sim", "s.bzz", "--robot", "kilobot", "--count", "2", "--headless"],
            &["flash", "s.bzz", "--robot", "crazyflie", "--dry-run"],
        ],
    );
    let mut case = Case::new(arguments).with("s.bzz", script);
    if arguments[0] == "sim" {
        // Without a scenario, a run has no end: this one has it in a file.
        case = Case::new(["sim", "short.toml", "--headless"])
            .with("s.bzz", case.files.remove(0).1)
            .with("short.toml", SHORT);
    }
    case.writing("out.bbi").writing("out.sym")
}

const SHORT: &str = "[world]\nsize = [300, 300]\nduration = 0.5\n[[robots]]\nrobot = \"kilobot\"\nscript = \"s.bzz\"\ncount = 2\n";

fn nested(_: &Bases, random: &mut Random, _: u64) -> Case {
    let depth = 1 << below(random, 16);
    let (open, middle, close) = [
        ("(", "1", ")"),
        ("{ .a = ", "1", " }"),
        ("if(1) { ", "x = 1", " }"),
        ("while(1) { ", "x = 1", " }"),
        ("function() { return ", "1", " }"),
        ("not ", "1", ""),
        ("-", "1", ""),
        ("f(", "1", ")"),
        ("t[", "1", "]"),
        ("1 + (", "1", ")"),
    ][below(random, 10)];
    let closings = if random.chance(0.7) { depth } else { depth / 2 };
    let start = if open.starts_with(['i', 'w']) { "" } else { "x = " };
    call(random, [start, &open.repeat(depth), middle, &close.repeat(closings), "\n"].concat())
}

fn huge(_: &Bases, random: &mut Random, _: u64) -> Case {
    let count = 1 << (8 + below(random, 7));
    let line = |number: usize, random: &mut Random| match random.below(6) {
        0 => format!("x{number} = {number}\n"),
        1 => format!("function f{number}(a, b) {{ return a + b }}\n"),
        2 => format!("x = \"text {number}\"\n"),
        3 => "x = )\n".to_owned(),
        4 => format!("log({number}, unknown{number})\n"),
        _ => format!("t = {{ .k{number} = {number}.5 }}\n"),
    };
    let script: String = match random.below(5) {
        0 => format!("x = 1{}\n", " + 1".repeat(count)),
        1 => format!("log(1{})\n", ", 1".repeat(count)),
        2 => format!("x = \"{}\"\n", "a".repeat(count * 16)),
        3 => format!("{} = 1\n", "name".repeat(count)),
        _ => (0..count).map(|number| line(number, random)).collect(),
    };
    call(random, script)
}

fn encoding(_: &Bases, random: &mut Random, seed: u64) -> Case {
    let utf16 = |convert: fn(u16) -> [u8; 2]| SCRIPT.encode_utf16().flat_map(convert).collect();
    let script: Vec<u8> = match seed % 10 {
        0 => [&b"\xff\xfe"[..], &Vec::from_iter::<Vec<u8>>(utf16(u16::to_le_bytes))].concat(),
        1 => utf16(u16::to_be_bytes),
        2 => [b"\xef\xbb\xbf", SCRIPT.as_bytes()].concat(),
        3 => [SCRIPT.as_bytes(), b"log(\"\xe9\xfc\")\n"].concat(),
        4 => SCRIPT.replace('\n', "\r").into(),
        5 => SCRIPT.replace(' ', "\0").into(),
        6 => [b"x = \"\xed\xa0\x80\"\n", SCRIPT.as_bytes()].concat(),
        7 => b"x = \"\xc0\x80\xf8\x88\x80\x80\x80\"\n".into(),
        8 => format!("\u{feff}\u{feff}{SCRIPT}\u{2028}\u{2029}\u{85}").into(),
        _ => SCRIPT
            .bytes()
            .map(|byte| if random.below(40) == 0 { byte | 0x80 } else { byte })
            .collect(),
    };
    call(random, script)
}

fn with_controls(_: &Bases, random: &mut Random, seed: u64) -> Case {
    let evil = controls::hostile();
    let script = match seed % 8 {
        0 => format!("log(\"{evil}\")\nfunction step() {{ log(\"{evil}\") }}\n"),
        1 => format!("x = \"{evil}\" = {evil}\n"),
        2 => format!("include \"{evil}\"\n"),
        3 => format!("unknown(\"{evil}\")\n# {evil}\nx = )\n"),
        4 => format!("function step() {{ assert(0, \"{evil}\") }}\n"),
        5 => format!("x{evil} = 1\n"),
        6 => format!("t = {{ .a = \"{evil}\" }}\nlog(t, t.a, t.a + 1)\n"),
        _ => {
            changed_text(random, SCRIPT, &["\u{1b}[2J", "\u{9b}31m", "\u{202e}", "\u{7f}", "\u{7}"])
        }
    };
    call(random, script)
}

fn including(_: &Bases, random: &mut Random, seed: u64) -> Case {
    let including = |name: &str| format!("include \"{name}\"\n{SCRIPT}");
    let (script, name, content): (String, &str, Vec<u8>) = match seed % 8 {
        0 => (including("s.bzz"), "x", Vec::new()),
        1 => (including("a.bzz"), "a.bzz", b"include \"b.bzz\"\n".to_vec()),
        2 => (including("a.bzz"), "a.bzz", noise(random, 500)),
        3 => (including("folder"), "folder/x", Vec::new()),
        4 => (including("/dev/zero"), "x", Vec::new()),
        5 => (including("../../../../../../etc/shadow"), "x", Vec::new()),
        6 => (including(&"a/".repeat(4000)), "x", Vec::new()),
        _ => (including("pipe.bzz"), "x", Vec::new()),
    };
    let case = call(random, script).with(name, content).with("b.bzz", "include \"a.bzz\"\n");
    case.with_special("pipe.bzz", Special::Pipe)
}
