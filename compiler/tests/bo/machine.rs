//! Runs images and records their calls.

use std::path::Path;

use bittybuzz_compiler::bo::{self, Imported};
use bittybuzz_compiler::compile::{Compiled, Options};
use bittybuzz_compiler::include::{IncludeLoader, MemoryFiles};
use bittybuzz_compiler::parser::{Parsed, parse};
use bittybuzz_compiler::symbols::Symbols;
use bittybuzz_robot_spec::{NumberProfile as ProfileName, Robot};
use bittybuzz_testkit::{Program, Recorder};
use bittybuzz_vm_core::number::{Full, Profile, Tiny};
use bittybuzz_vm_core::{Entry, FaultCode, Image, ImageError, Outcome, Value, Vm};

/// A robot with a function `f(x)` that is recorded.
const ROBOT: &str = r#"
name = "recorder"
title = "Recorder"
profile = "full"
tick_hz = 10
message_bytes = 48

[vm]
memory = 8192
slots = 640
neighbors = 10
in_queue = 10
out_queue = 10
stigmergy_entries = 4
swarms = 8

[[function]]
name = "record"
accepts = ["", "x: any", "x: any, y: any"]
help = "notes its arguments"

[[function]]
name = "f"
accepts = ["x: any"]
help = "notes its argument"
"#;

/// Options for the robot that records.
pub fn recorder(profile: ProfileName) -> Options {
    let robot = Robot::parse(ROBOT, "recorder.toml").expect("a robot");
    Options { profile: Some(profile), robot: Some(robot), ..Options::default() }
}

/// Options for a script that may call what any robot has.
pub fn any_robot(profile: ProfileName) -> Options {
    Program::options(profile)
}

/// Imports with the robot that records.
pub fn import(bytes: &[u8]) -> Imported {
    bo::import(Path::new("test.bo"), bytes, None, &recorder(ProfileName::Full))
        .unwrap_or_else(|error| panic!("{error}"))
}

/// Parses a script that includes nothing.
pub fn parse_script(path: &str, text: &str) -> Parsed {
    parse(Path::new(path), text.to_owned(), &IncludeLoader::new(&MemoryFiles::default()))
}

/// What a run did.
#[derive(Debug, Clone, PartialEq)]
pub struct Run {
    /// What it logged and which robot functions it called, line by line.
    pub lines: Vec<String>,
    /// How it ended; the budget is generous but finite.
    pub ending: Ending,
    /// Globals that hold plain values, by name.
    pub globals: Vec<(String, String)>,
}

/// How a run ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ending {
    /// Global code, `init`, and some steps are done.
    Done,
    /// A run-time error.
    Fault(FaultCode),
    /// It takes longer than a test has time.
    Endless,
}

impl Run {
    /// The value of a global as text.
    pub fn global(&self, name: &str) -> &str {
        let found = self.globals.iter().find(|(known, _)| known == name);
        found.map_or_else(|| panic!("no global `{name}` in {:?}", self.globals), |(_, value)| value)
    }
}

/// Runs what was compiled; it must have an image.
pub fn run(compiled: &Compiled) -> Run {
    let said: Vec<_> = compiled.diagnostics.iter().map(|d| &d.message).collect();
    let image = compiled.image.as_ref().unwrap_or_else(|| panic!("no image: {said:?}"));
    let symbols = compiled.symbols.as_ref().expect("an image has symbols");
    run_image(image, symbols).unwrap_or_else(|error| panic!("refused: {error:?}"))
}

/// Runs an image, unless the verifier refuses it.
pub fn run_image(image: &[u8], symbols: &Symbols) -> Result<Run, ImageError> {
    match symbols.profile.as_str() {
        "tiny" => run_with::<Tiny>(image, symbols),
        _ => run_with::<Full>(image, symbols),
    }
}

/// Whether the verifier accepts an image.
pub fn verify(image: &[u8], symbols: &Symbols) -> Result<(), ImageError> {
    match symbols.profile.as_str() {
        "tiny" => load::<Tiny>(image).map(|_| ()),
        _ => load::<Full>(image).map(|_| ()),
    }
}

type Machine<'a, P> = Box<Vm<P, &'a [u8], 4000>>;

fn load<P: Profile>(image: &[u8]) -> Result<Machine<'_, P>, ImageError> {
    let mut vm: Machine<'_, P> = Box::new(Vm::new());
    vm.set_robot_id(1, 0);
    vm.load(Image::new(image), |_| true)?;
    Ok(vm)
}

fn run_with<P: Profile>(image: &[u8], symbols: &Symbols) -> Result<Run, ImageError> {
    let mut vm = load::<P>(image)?;
    let mut host = Recorder::with_symbols(symbols.clone());
    host.position = [Some(0.0); 4];
    let mut ending = Ending::Done;
    let steps = [Entry::Global, Entry::Init, Entry::Step, Entry::Step, Entry::Step, Entry::Destroy];
    for entry in steps {
        if !vm.begin(entry) {
            continue;
        }
        let mut slices = 0..20;
        ending = loop {
            match vm.run(&mut host, 10_000) {
                Outcome::Done => break Ending::Done,
                Outcome::Fault(fault) => break Ending::Fault(fault.code),
                Outcome::Pending | Outcome::Waiting if slices.next().is_some() => {}
                Outcome::Pending | Outcome::Waiting => break Ending::Endless,
            }
        };
        if ending != Ending::Done {
            break;
        }
    }
    let plain = |value: Value<P>| {
        if let Some(number) = value.as_string() {
            return symbols.string(number).map(|text| format!("{text:?}"));
        }
        match value.as_int() {
            Some(int) => Some(int.to_string()),
            None if value.is_nil() => Some("nil".to_owned()),
            None => value.as_f32().map(|float| format!("{float:?}")),
        }
    };
    let globals = symbols.globals.iter().enumerate().filter_map(|(number, name)| {
        let value = vm.global(number as u16).and_then(plain)?;
        Some((name.clone(), value))
    });
    let globals = globals.collect();
    Ok(Run { lines: host.lines(), ending, globals })
}
