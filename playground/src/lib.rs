//! Compiler, machine and arena as one WebAssembly module: a scenario runs in a web page as it runs on a desk.
//!
//! # Principles
//! 1. **The same run, bit for bit**: after any number of ticks the digest is that of a native run. CI compares them.
//! 2. **No imports**: `WebAssembly.instantiate(bytes, {})` is enough, so that the module also runs in a worker or in node.
//! 3. **No pointers of the page's**: text goes through one buffer of the module, and the page reads and writes nothing else.
//!
//! # Use
//! A page writes each file with [`input`] and [`add_file`], starts a scenario with [`start`], calls [`tick`], and reads [`digest`].
//! An error is text, which [`output`] and [`output_length`] locate. `tests/run.mjs` does all of this.
//!
//! # Cost
//! The code of a release build takes 3.6 MB, 1 MB compressed, without names and lines for debuggers.
//!
//! # What it will not do
//! Draw, run robots in emulators, use several threads, or know the libraries that `bbz` brings along: a page adds those that a script
//! includes as files.

use std::cell::RefCell;
use std::path::Path;
use std::sync::Arc;

use bittybuzz_arena::run::{Program, Setup, SetupError, Simulation};
use bittybuzz_arena::scenario::{Group, Scenario, ScenarioError};
use bittybuzz_compiler::compile::{Options, compile};
use bittybuzz_compiler::include::{Files, Loader, MAX_SOURCE_BYTES, MemoryFiles};
use bittybuzz_compiler::refusal;
use bittybuzz_compiler::render::{Color, Renderer};
use bittybuzz_robot_files::all_shipped;

/// The state of the module.
#[derive(Default)]
struct Playground {
    files: MemoryFiles,
    run: Option<Simulation>,
    /// Bytes that the page writes.
    input: Vec<u8>,
    /// Text that the page reads.
    output: String,
}

thread_local! {
    static PLAYGROUND: RefCell<Playground> = RefCell::default();
}

/// Opens a scenario and the files that it names, compiles the scripts, and returns the run before its first tick. Its seed is that
/// of the scenario. An error is text for people.
pub fn open(files: &MemoryFiles, path: &str, threads: usize) -> Result<Simulation, String> {
    let scenario = Scenario::open_in(files, path.as_ref(), &[], &bittybuzz_robot_models::all());
    let scenario = scenario.map_err(|errors| text_of(&errors))?;
    let programs = scenario.programs().map(|(group, script)| program(files, script, group));
    let programs: Result<Vec<Program>, String> = programs.collect();
    let seed = scenario.world.seed;
    let setup = Setup::new(scenario, programs?).map_err(|error| match error {
        SetupError::Scenario(errors) => text_of(&errors),
        SetupError::Refused { cause, .. } => format!("a script {}\n", refusal::sentence(&cause)),
    })?;
    Simulation::new(Arc::new(setup), seed, threads).map_err(|error| text_of(&[error]))
}

/// Compiles a script for the robots of a group. An error is text for people.
fn program(files: &MemoryFiles, script: &Path, group: &Group) -> Result<Program, String> {
    let robot = Some(group.robot.clone());
    let options = Options { robot, robots: all_shipped(), profile: None };
    let shown = script.display();
    let bytes = files.read(script, MAX_SOURCE_BYTES);
    let bytes = bytes.map_err(|error| format!("cannot read `{shown}`: {error}\n"))?;
    let text = String::from_utf8(bytes).map_err(|_| format!("`{shown}` is not UTF-8 text\n"))?;
    let compiled = compile(script, text, &Loader::new(files), &options);
    let Some(image) = compiled.image else {
        let renderer = Renderer::new(&compiled.sources);
        let texts = compiled.diagnostics.iter();
        return Err(texts.map(|one| renderer.text(one, Color::Never)).collect());
    };
    Ok(Program { image, symbols: compiled.symbols })
}

/// Returns the errors of a scenario with their places, a line or two for each.
fn text_of(errors: &[ScenarioError]) -> String {
    let texts = errors.iter().map(|error| {
        let place = error.place.iter();
        let place: String = place
            .map(|place| format!("{}:{}:{}: ", place.path, place.line, place.column))
            .collect();
        let help: String = error.help().iter().map(|help| format!("  help: {help}\n")).collect();
        format!("{place}{error}\n{help}")
    });
    texts.collect()
}

impl Playground {
    /// Keeps the input as a file: its name, and its text from byte `name_length` on.
    fn add_file(&mut self, name_length: usize) {
        let (name, text) = self.input.split_at(name_length.min(self.input.len()));
        let name = String::from_utf8_lossy(name).into_owned();
        self.files = std::mem::take(&mut self.files).with(name, text);
    }

    /// Starts the scenario whose path is the input.
    fn start(&mut self) -> bool {
        let path = String::from_utf8_lossy(&self.input).into_owned();
        match open(&self.files, &path, 1) {
            Ok(run) => {
                self.run = Some(run);
                self.output.clear();
            }
            Err(error) => {
                self.run = None;
                self.output = error;
            }
        }
        self.run.is_some()
    }

    /// Simulates at most `count` ticks and returns how many have passed since the start.
    fn tick(&mut self, count: u32) -> u32 {
        let Some(run) = &mut self.run else { return 0 };
        for _ in 0..count {
            if run.is_over() {
                break;
            }
            if let Err(error) = run.tick() {
                self.output = error.to_string();
                break;
            }
            run.take_log();
        }
        // At most four weeks are simulated.
        run.now() as u32
    }
}

/// Does something with the state of the module. Nothing in the module calls one of its exported functions, so the state is free.
fn with<T>(act: impl FnOnce(&mut Playground) -> T) -> T {
    PLAYGROUND.with_borrow_mut(act)
}

// SAFETY: of all exported functions, here and below: no other function of the module has these names.

/// Makes room for `length` bytes of input and returns their address, until the next call. The page writes them there.
#[unsafe(no_mangle)]
pub extern "C" fn input(length: usize) -> *mut u8 {
    with(|playground| {
        playground.input = vec![0; length];
        playground.input.as_mut_ptr()
    })
}

/// Adds a file, or replaces it: the first `name_length` bytes of the input are its path, the others its text.
#[unsafe(no_mangle)]
pub extern "C" fn add_file(name_length: usize) {
    with(|playground| playground.add_file(name_length));
}

/// Starts the scenario whose path is the input. Returns 1, or 0 and leaves a text that says why not.
#[unsafe(no_mangle)]
pub extern "C" fn start() -> u32 {
    with(|playground| playground.start().into())
}

/// Simulates at most `count` ticks of 100 ms, up to the end of the scenario. Returns how many have passed since the start.
#[unsafe(no_mangle)]
pub extern "C" fn tick(count: u32) -> u32 {
    with(|playground| playground.tick(count))
}

/// Returns the digest of the run; 0 without one.
#[unsafe(no_mangle)]
pub extern "C" fn digest() -> u64 {
    with(|playground| playground.run.as_ref().map_or(0, Simulation::digest))
}

/// Returns the address of the text that the last call left, in UTF-8, until the next call.
#[unsafe(no_mangle)]
pub extern "C" fn output() -> *const u8 {
    with(|playground| playground.output.as_ptr())
}

/// Returns the length of that text in bytes.
#[unsafe(no_mangle)]
pub extern "C" fn output_length() -> usize {
    with(|playground| playground.output.len())
}
