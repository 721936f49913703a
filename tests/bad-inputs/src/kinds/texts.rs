//! Traces, results that are handed in, experiments, and the command line itself.

use std::ffi::OsString;

use bittybuzz_random::Random;
use serde_json::Value;

use super::Entry;
use crate::bases::{Bases, EXPERIMENT, SCENARIO, SCRIPT, hand_in};
use crate::case::{Case, Special};
use crate::controls;
use crate::mutation::{below, changed_text, mutated, noise, one, truncated};

pub const KINDS: &[Entry] = &[
    ("trace-lines", trace),
    ("hand-in-mutated", |bases, random, _| {
        let text = mutated(random, bases.hand_in.as_bytes());
        grade(random, text)
    }),
    ("hand-in-truncated", |bases, random, _| {
        let text = truncated(random, bases.hand_in.as_bytes());
        grade(random, text)
    }),
    ("hand-in-values", |bases, random, _| {
        let mut result: Value = serde_json::from_str(&bases.hand_in).unwrap_or_default();
        let keys =
            ["bittybuzz", "by", "assignment", "scenario", "scripts", "seed", "seconds", "digest"];
        let value = serde_json::from_str(one(random, JSON)).unwrap_or_default();
        result[one(random, &keys)] = value;
        grade(random, result.to_string())
    }),
    ("hand-in-hostile", hostile_hand_in),
    ("experiment-mutated", |_, random, _| {
        let text = mutated(random, EXPERIMENT.as_bytes());
        import(random, text)
    }),
    ("experiment-words", |_, random, _| {
        let words = [
            "<", ">", "/>", "\"", "&", "&#0;", "&x;", "<!--", "]]>", "nan", "-1", "1e309", "\u{9b}",
        ];
        let text = changed_text(random, EXPERIMENT, &words);
        import(random, text)
    }),
    ("experiment-nested", |_, random, seed| {
        let depth = 1 << (1 + below(random, 14));
        let text = match seed % 3 {
            0 => "<a>".repeat(depth) + &"</a>".repeat(depth),
            1 => EXPERIMENT.replace("<arena", &format!("<arena {}", "x=\"1\" ".repeat(depth))),
            _ => {
                let entities = "<!ENTITY a \"aaaaaaaaaa\"><!ENTITY b \"&a;&a;&a;&a;&a;&a;&a;&a;\">";
                format!(
                    "<!DOCTYPE x [{entities}]><argos-configuration>{}</argos-configuration>",
                    "&b;".repeat(depth)
                )
            }
        };
        import(random, text)
    }),
    ("arguments-odd", arguments),
    ("paths-odd", paths),
    ("names-new", |_, random, _| {
        let name = odd_name(random);
        // A name that leads out of the folder is given on purpose, but would change other files.
        let leads_out =
            name.to_string_lossy().contains("..") || name.to_string_lossy().starts_with('/');
        let name = if leads_out { OsString::from("x") } else { name };
        let arguments = ["new", "--robot", "kilobot"].map(OsString::from);
        Case::new(arguments.into_iter().chain([name.clone()])).writing(name)
    }),
];

const JSON: &[&str] = &[
    "null",
    "true",
    "-1",
    "1e308",
    "4294967296",
    "\"\"",
    "[]",
    "{}",
    "[[[[]]]]",
    "\"\\u001b[2J\\u202e\"",
    "{\"name\": \"../../x.bzz\", \"text\": \"\"}",
    "[{\"name\": \"/etc/passwd\", \"text\": \"x = 1\"}]",
    "[{\"name\": \"s.bzz\", \"text\": \"\"}, {\"name\": \"./s.bzz\", \"text\": \"x = 1\"}]",
    "\"=cmd()\"",
];

fn trace(bases: &Bases, random: &mut Random, _: u64) -> Case {
    let arguments: &[&str] = one(
        random,
        &[
            &["trace", "-", "--robot", "kilobot", "--script", "i.sym"][..],
            &["trace", "-", "--robot", "kilobot", "--script", "s.bzz"],
            &["trace", "-"],
            &["trace", "-", "--json"],
            &["trace", "-", "--plain"],
        ],
    );
    let mut case = Case::new(arguments).with("i.sym", bases.symbols.clone()).with("s.bzz", SCRIPT);
    let evil = controls::hostile();
    for _ in 0..below(random, 60) {
        let line: Vec<u8> = match random.below(7) {
            0 => noise(random, 200),
            1 => format!("1.0 INFO {evil}").into(),
            2 => format!("{evil} WARN bbz trace {evil}").into(),
            3 => {
                let bytes = noise(random, 13);
                let digits: String = bytes.iter().map(|byte| format!("{byte:02x}")).collect();
                format!("ir {digits}").into()
            }
            4 => b"ir 080100abcd060708090afeff".to_vec(),
            5 => b"0.000000 INFO bittybuzz: [1, 2, 255, 0, 7]".to_vec(),
            _ => {
                mutated(random, b"12.345678 ERROR bittybuzz: record [3, 0, 0, 0, 0, 1, 2, 3, 0, 0]")
            }
        };
        case.stdin.extend(line);
        case.stdin.push(b'\n');
    }
    case
}

/// Returns a call that reads the result `a.json`.
fn grade(random: &mut Random, text: impl Into<Vec<u8>>) -> Case {
    let arguments: &[&str] = one(
        random,
        &[&["grade", "."][..], &["grade", ".", "--json"], &["grade", ".", "--csv", "marks.csv"]],
    );
    let case = Case::new(arguments).with("s.toml", SCENARIO).with("s.bzz", SCRIPT);
    case.with("a.json", text).writing("marks.csv")
}

fn hostile_hand_in(_: &Bases, random: &mut Random, seed: u64) -> Case {
    let evil = controls::hostile();
    let script = match seed % 10 {
        0 => "while(1) { }\n".to_owned(),
        1 => "function step() { while(1) { log(\"flood\") } }\n".to_owned(),
        2 => "function step() { i = 0 while(i < 1000) { log(\"flood \", i) i = i + 1 } }\n"
            .to_owned(),
        3 => "include \"/etc/passwd\"\n".to_owned(),
        4 => "include \"../../../../etc/passwd\"\n".to_owned(),
        5 => "function f(n) { return f(n + 1) }\nf(0)\n".to_owned(),
        6 => "t = {}\nfunction step() { i = 0 while(1) { t[i] = { .x = t } i = i + 1 } }\n"
            .to_owned(),
        7 => format!("log(\"{evil}\")\nx = \"{evil}\" = 1\n"),
        8 => "x = 1\n".repeat(1 << below(random, 16)),
        _ => "include \"pipe.bzz\"\n".to_owned(),
    };
    grade(random, hand_in(&script)).with_special("pipe.bzz", Special::Pipe)
}

/// Returns a call that reads the experiment `e.argos`.
fn import(random: &mut Random, text: impl Into<Vec<u8>>) -> Case {
    let arguments: &[&str] =
        one(random, &[&["import", "e.argos"][..], &["import", "e.argos", "-o", "out.toml"]]);
    Case::new(arguments).with("e.argos", text).writing("out.toml")
}

fn arguments(_: &Bases, random: &mut Random, _: u64) -> Case {
    let words = [
        "check",
        "build",
        "run",
        "sim",
        "view",
        "grade",
        "flash",
        "trace",
        "disasm",
        "robots",
        "stubs",
        "import",
        "explain",
        "guide",
        "completions",
        "--robot",
        "--steps",
        "--seed",
        "--count",
        "--set",
        "--runs",
        "--json",
        "--headless",
        "--deny",
        "--profile",
        "--id",
        "--neighbor",
        "--dry-run",
        "-I",
        "-",
        "--",
        "--help",
        "--version",
        "-o",
        "--csv",
        "--record",
        "s.bzz",
        "s.toml",
        "kilobot",
        "E0201",
    ];
    let mut case = Case::new::<&str>([]).with("s.toml", SCENARIO).with("s.bzz", SCRIPT);
    for place in 0..=random.below(6) {
        let word = match random.below(4) {
            0 if place > 0 => odd_name(random),
            1 if place > 0 => {
                one(random, &["-1", "0", "1e9", "18446744073709551616", "", "=", "a=b"]).into()
            }
            _ => one(random, &words).into(),
        };
        // The name of an output may be any of them.
        case.outputs.push(word.clone());
        for suffix in [".bbi", ".sym"] {
            let mut output = word.clone();
            output.push(suffix);
            case.outputs.push(output);
        }
        case.arguments.push(word);
    }
    // A run in real time has no end.
    if case.arguments[0] == "run" {
        case.arguments.splice(1..1, ["--steps".into(), "2".into()]);
    }
    // Only files of the folder are compared, so the outputs stay in it.
    let leads_out = |word: &OsString| {
        let text = word.to_string_lossy();
        text.contains("..") || text.starts_with('/') || text.contains("=/")
    };
    case.arguments.retain(|word| !leads_out(word));
    let outputs = ["s.bbi", "s.sym"].map(OsString::from);
    case.outputs.extend(outputs);
    case
}

fn paths(_: &Bases, random: &mut Random, _: u64) -> Case {
    let name = odd_name(random);
    let exists = !name.is_empty()
        && name.len() < 200
        && !name.to_string_lossy().contains(['/', '\0'])
        && random.chance(0.6);
    let options: &[&str] = one(
        random,
        &[
            &["check"][..],
            &["run", "--steps", "2"],
            &["disasm"],
            &["stubs"],
            &["sim", "--headless"],
            &["grade"],
            &["robots"],
            &["import"],
            &["trace"],
            &["view", "--no-browser"],
            &["flash", "--robot", "kilobot", "--dry-run"],
            &["flash", "--dry-run", "s.bzz", "--robot"],
            &["build", "--robot", "kilobot"],
            &["check", "s.bzz", "-I"],
            &["sim", "--set", "world.duration=1", "--record", "out.bbr"],
        ],
    );
    let words = options.iter().map(OsString::from).chain([name.clone()]);
    let mut case = Case::new(words).with("s.bzz", SCRIPT).writing("out.bbr");
    for ending in ["bbi", "sym"] {
        let stem = std::path::Path::new(&name).with_extension(ending);
        case.outputs.push(stem.into_os_string());
    }
    let content = if random.chance(0.5) { SCRIPT } else { SCENARIO };
    if exists { case.with(name, content) } else { case }
}

/// Returns a name with controls, bytes that are no text, or a shape that few programs expect. It has no
/// NUL, which no system call takes.
fn odd_name(random: &mut Random) -> OsString {
    let evil = controls::hostile();
    let ending =
        one(random, &[".bzz", ".toml", ".bbi", ".bo", ".sym", ".bbr", ".argos", ".elf", ""]);
    let mut name: Vec<u8> = match random.below(12) {
        0 => evil.replace('/', "").into(),
        1 => b"\xff\xfe\x80".to_vec(),
        2 => b"\xed\xa0\x80".to_vec(),
        3 => "x".repeat(300).into(),
        4 => "a/".repeat(2500).into(),
        5 => b"-".to_vec(),
        6 => b"--".to_vec(),
        7 => "\u{202e}txt.\u{2066}".into(),
        8 => b" ".to_vec(),
        9 => b"a\nb\tc\rd".to_vec(),
        10 => "\u{1f916}\u{301}\u{200d}".into(),
        _ => noise(random, 40).into_iter().filter(|byte| ![0, b'/'].contains(byte)).collect(),
    };
    name.extend(ending.bytes());
    os_string(name)
}

#[cfg(unix)]
fn os_string(bytes: Vec<u8>) -> OsString {
    std::os::unix::ffi::OsStringExt::from_vec(bytes)
}

#[cfg(not(unix))]
fn os_string(bytes: Vec<u8>) -> OsString {
    String::from_utf8_lossy(&bytes).into_owned().into()
}
