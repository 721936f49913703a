//! Compiles and runs scripts.

use bittybuzz_compiler::compile::{Compiled, Options};
use bittybuzz_compiler::symbols::Symbols;
use bittybuzz_robot_files::all_shipped;
use bittybuzz_robot_spec::{NumberProfile as ProfileName, Robot};
use bittybuzz_testkit::{Program, Recorder};
use bittybuzz_vm_core::number::{Full, Number, Profile, Tiny};
use bittybuzz_vm_core::{Entry, Fault, Image, Outcome, Vm};

pub const TINY: ProfileName = ProfileName::Tiny;
pub const FULL: ProfileName = ProfileName::Full;

/// Compiles for every known robot.
pub fn build(script: &str, profile: ProfileName) -> Compiled {
    build_for(script, profile, None)
}

/// Compiles for a robot.
pub fn build_for(script: &str, profile: ProfileName, robot: Option<&str>) -> Compiled {
    let mut options = Program::options(profile);
    let named = |name: &str| options.robots.iter().find(|known| known.name == name).cloned();
    options.robot = robot.map(|name| named(name).expect("a shipped robot"));
    build_with(script, &options)
}

pub fn build_with(script: &str, options: &Options) -> Compiled {
    Program::compile(script, options)
}

/// A robot like the Kilobot, with changes.
pub fn robot(change: impl FnOnce(&mut Robot)) -> Robot {
    let mut robot =
        all_shipped().into_iter().find(|known| known.name == "kilobot").expect("shipped");
    change(&mut robot);
    robot
}

/// Image and symbols of a script without errors.
pub fn image(script: &str, profile: ProfileName) -> (Vec<u8>, Symbols) {
    let Program { image, symbols } = build(script, profile).into();
    (image, symbols)
}

/// What a script did.
#[derive(Debug, Clone, PartialEq)]
pub struct Run {
    pub output: String,
    pub fault: Option<Fault>,
    /// It ended, by itself or by a fault, before it was stopped.
    pub ended: bool,
    /// Numbers that globals hold in the end, by name: floats as bits, so that NaN and -0.0 can be compared.
    pub globals: Vec<(String, Option<Result<i32, u32>>)>,
}

impl Run {
    pub fn global(&self, name: &str) -> Option<Result<i32, u32>> {
        self.globals.iter().find(|(known, _)| known == name).and_then(|(_, value)| *value)
    }
}

/// Runs the global code of a script.
pub fn run(script: &str, profile: ProfileName) -> Run {
    let (image, symbols) = image(script, profile);
    match profile {
        ProfileName::Tiny => run_image::<Tiny>(&image, &symbols),
        ProfileName::Full => run_image::<Full>(&image, &symbols),
    }
}

/// What a script prints in both profiles, which must be the same.
pub fn output(script: &str) -> String {
    let [tiny, full] = [TINY, FULL].map(|profile| {
        let run = run(script, profile);
        assert_eq!((run.fault, run.ended), (None, true), "{script}");
        run.output
    });
    assert_eq!(tiny, full, "{script}");
    tiny
}

/// Whether the verifier of that profile takes the image.
pub fn verify(image: &[u8], profile: ProfileName) -> Result<(), bittybuzz_vm_core::ImageError> {
    match profile {
        ProfileName::Tiny => machine::<Tiny>().load(Image::new(image), |_| true),
        ProfileName::Full => machine::<Full>().load(Image::new(image), |_| true),
    }
}

fn machine<'a, P: Profile>() -> Box<Vm<P, &'a [u8], 4000>> {
    let mut vm = Box::new(Vm::new());
    vm.set_robot_id(1, 0);
    vm
}

fn run_image<P: Profile>(image: &[u8], symbols: &Symbols) -> Run {
    let mut vm = machine::<P>();
    if let Err(error) = vm.load(Image::new(image), |_| true) {
        panic!("the verifier refuses the image: {error:?}\n{}", listing(image, symbols));
    }
    let mut host = recorder(symbols);
    assert!(vm.begin(Entry::Global));
    let mut fault = None;
    let mut ended = false;
    for _ in 0..200 {
        match vm.run(&mut host, 1000) {
            Outcome::Done => ended = true,
            Outcome::Fault(found) => {
                fault = Some(found);
                ended = true;
            }
            Outcome::Pending | Outcome::Waiting => {}
        }
        if ended {
            break;
        }
    }
    let globals = symbols.globals.iter().enumerate().map(|(number, name)| {
        let value = vm.global(number as u16).and_then(|value| value.as_number());
        let value = value.map(|number| match number {
            Number::Int(value) => Ok(value),
            Number::Float(value) => Err(value.to_bits()),
        });
        (name.clone(), value)
    });
    let output = host.lines().iter().map(|line| format!("{line}\n")).collect();
    Run { output, fault, ended, globals: globals.collect() }
}

pub fn listing(image: &[u8], symbols: &Symbols) -> String {
    bittybuzz_compiler::disasm::disassemble(image, Some(symbols))
}

/// A robot that knows where it is.
fn recorder(symbols: &Symbols) -> Recorder {
    let mut recorder = Recorder::with_symbols(symbols.clone());
    recorder.position = [Some(1.0), Some(2.0), Some(2.0), Some(2.0)];
    recorder
}

/// How many cases a property is tested with; `PROPTEST_CASES` makes it more.
pub fn at_least(cases: u32) -> u32 {
    cases.max(proptest::test_runner::Config::default().cases)
}
