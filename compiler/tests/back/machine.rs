//! Compiles and runs scripts.

use std::sync::LazyLock;

use bittybuzz_compiler::compile::{Compiled, Options, compile};
use bittybuzz_compiler::include::{Loader, MemoryFiles};
use bittybuzz_compiler::symbols::Symbols;
use bittybuzz_robots::{Profile as ProfileName, Robot, all_shipped};
use bittybuzz_vm_core::number::{Full, Number, Profile, Tiny};
use bittybuzz_vm_core::{
    Arguments, Axis, ByteCode, Entry, Fault, Host, Image, Item, Outcome, Reply, RobotFault, Value,
    Vm,
};

pub const TINY: ProfileName = ProfileName::Tiny;
pub const FULL: ProfileName = ProfileName::Full;

/// Compiles for every known robot.
pub fn build(script: &str, profile: ProfileName) -> Compiled {
    build_for(script, profile, None)
}

/// Read once: thousands of scripts are compiled here.
static ROBOTS: LazyLock<Vec<Robot>> = LazyLock::new(all_shipped);

/// Compiles for a robot.
pub fn build_for(script: &str, profile: ProfileName, robot: Option<&str>) -> Compiled {
    let named = |name: &str| ROBOTS.iter().find(|known| known.name == name).cloned();
    let robot = robot.map(|name| named(name).expect("a shipped robot"));
    build_with(script, &Options { profile: Some(profile), robot, robots: ROBOTS.clone() })
}

pub fn build_with(script: &str, options: &Options) -> Compiled {
    let files = MemoryFiles::default();
    compile("test.bzz".as_ref(), script.to_owned(), &Loader::new(&files), options)
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
    let compiled = build(script, profile);
    match (compiled.image, compiled.symbols) {
        (Some(image), Some(symbols)) => (image, symbols),
        _ => panic!("{script}\ndoes not compile: {:#?}", compiled.diagnostics),
    }
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
    vm.identify(1, 0);
    vm
}

fn run_image<P: Profile>(image: &[u8], symbols: &Symbols) -> Run {
    let mut vm = machine::<P>();
    if let Err(error) = vm.load(Image::new(image), |_| true) {
        panic!("the verifier refuses the image: {error:?}\n{}", listing(image, symbols));
    }
    let mut console = Console::new(symbols);
    assert!(vm.begin(Entry::Global));
    let mut fault = None;
    let mut ended = false;
    for _ in 0..200 {
        match vm.run(&mut console, 1000) {
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
    Run { output: console.output, fault, ended, globals: globals.collect() }
}

pub fn listing(image: &[u8], symbols: &Symbols) -> String {
    bittybuzz_compiler::disasm::disassemble(image, Some(symbols))
}

pub struct Console<'a> {
    output: String,
    symbols: &'a Symbols,
}

impl<'a> Console<'a> {
    pub fn new(symbols: &'a Symbols) -> Self {
        Console { output: String::new(), symbols }
    }

    fn write<P: Profile, C: ByteCode, const SLOTS: usize>(
        &mut self,
        arguments: &Arguments<'_, P, C, SLOTS>,
        separator: &str,
    ) {
        let texts: Vec<String> = (0..arguments.count())
            .map(|index| match arguments.item(index) {
                Item::Nil => "nil".to_owned(),
                Item::Int(value) => value.to_string(),
                Item::Float(value) => format!("{value:?}"),
                Item::String(text) => match text.number().and_then(|n| self.symbols.string(n)) {
                    Some(text) => text.to_owned(),
                    None => text.bytes().map(char::from).collect(),
                },
                Item::Table(size) => format!("table {size}"),
                Item::Function => "function".to_owned(),
            })
            .collect();
        self.output.push_str(&texts.join(separator));
    }
}

impl<P: Profile> Host<P> for Console<'_> {
    fn call<C: ByteCode, const SLOTS: usize>(
        &mut self,
        function: u16,
        arguments: Arguments<'_, P, C, SLOTS>,
        _again: bool,
    ) -> Result<Reply<P>, RobotFault> {
        let hash = bittybuzz_vm_core::link::name_hash;
        let name = self.symbols.imports.iter().find(|name| hash(name) == function);
        self.output.push_str(name.map_or("?", String::as_str));
        self.output.push('(');
        self.write(&arguments, ", ");
        self.output.push_str(")\n");
        Ok(Reply::Value(Value::nil()))
    }

    fn log<C: ByteCode, const SLOTS: usize>(&mut self, arguments: Arguments<'_, P, C, SLOTS>) {
        self.write(&arguments, "");
        self.output.push('\n');
    }

    fn delay_is_over(&mut self, _ms: i32, again: bool) -> bool {
        again
    }

    fn position(&mut self, axis: Axis) -> Option<f32> {
        Some(if axis == Axis::X { 1.0 } else { 2.0 })
    }
}

/// How many cases a property is tested with; `PROPTEST_CASES` makes it more.
pub fn at_least(cases: u32) -> u32 {
    cases.max(proptest::test_runner::Config::default().cases)
}
