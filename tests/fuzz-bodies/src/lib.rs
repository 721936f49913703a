//! What the fuzz targets do with their input. A body returns, whatever the input; a panic is a defect of the project.
//!
//! | target | input | must hold |
//! |---|---|---|
//! | `image` | bytes as an image | loader, verifier and disassembler survive; what passes runs as below |
//! | `image_mutated` | changes to the image of a known script | the same; most of these inputs get past the header |
//! | `program` | decisions that make a program of instructions | the verifier accepts it, and it runs as below |
//! | `script` | bytes as a script | compiler survives; what it compiles is accepted by the verifier |
//! | `script_mutated` | changes to the words of a known script | the same; most of these inputs get past the lexer |
//! | `bo` | bytes as an object file of the reference compiler | the same for the importer |
//! | `bo_mutated` | changes to the instructions of a known object file, and a debug file | the same; many of these inputs are programs |
//! | `message` | decisions that make frames | what can be read can be written and read again; a robot that receives it continues as before |
//! | `recording` | bytes as a recording, or changes to one | what can be read is written as it was read, and played forward and back, with memory and work in proportion to the bytes |
//! | `scenario` | text of a scenario, or changes to the words of a known one | it is read or refused with reasons |
//! | `robot_file` | the same for robot files | the same |
//! | `symbols` | the same for symbols | the same; what is read can be kept, and looked up |
//! | `syslink` | noise and frames on a Crazyflie's serial link | what is read can be written; a good frame then gets through |
//! | `nrf24` | a Zooid's payload | what is read is written as it was read |
//! | `ir` | light that a Kilobot receives | messages are whole or damaged; a message after silence gets through |
//! | `social` | changes to images of scripts that talk, and to what is on the air, for two to four robots | memory is as it must be, robots start again after faults, the frames of a step are bounded |
//! | `time` | decisions that make a script of large structures | no instruction takes more work than the sizes of memory and image allow |
//!
//! A run keeps to its budget, and ends the same in slices, with a collection at every allocation, and after an allocation
//! that failed; the machine's memory is as it must be. Each body returns true if its input got that far: past verifier,
//! compiler or importer, or to a message that the robot understood.
//!
//! Empty without the feature `torture`, which must not get into what a plain build makes of the workspace.
#![cfg(feature = "torture")]

mod bo_mutation;
mod choices;
mod files;
mod links;
mod machine;
mod messages;
mod mutation;
mod program;
mod seeds;
mod social;
mod time;
mod words;

use std::path::Path;
use std::sync::OnceLock;

use bittybuzz_compiler::bo::{self as object, import};
use bittybuzz_compiler::compile::{Compiled, Options, compile};
use bittybuzz_compiler::diagnostic::Severity;
use bittybuzz_compiler::disasm::disassemble;
use bittybuzz_compiler::include::{IncludeLoader, MemoryFiles};
use bittybuzz_compiler::render::{ColorChoice, Renderer};
use bittybuzz_compiler::symbols::Symbols;
use bittybuzz_robot_spec::NumberProfile;
use bittybuzz_vm_core::ImageError;
use choices::Choices;
pub use files::{recording, robot_file, scenario, symbols};
pub use links::{ir, nrf24, syslink};
pub use seeds::images;

/// Bytes as an image.
pub fn image(data: &[u8]) -> bool {
    // Of some inputs, as it takes more time than running.
    if data.len().is_multiple_of(8) {
        let _ = disassemble(data, None);
    }
    machine::run_both(data).is_ok()
}

/// The first byte chooses an image, the next four decide how it is run, every four that follow change it.
pub fn image_mutated(data: &[u8]) -> bool {
    let Some((choice, rest)) = data.split_first() else { return false };
    let Some((settings, changes)) = rest.split_first_chunk::<4>() else { return false };
    let images = seeds::images();
    let mut image = images[usize::from(*choice) % images.len()].clone();
    image[3..7].copy_from_slice(settings);
    for change in changes.chunks_exact(4).take(16) {
        let [kind, low, high, value] = *change else { return false };
        mutation::change(&mut image, kind, u16::from_le_bytes([low, high]), value);
    }
    machine::run_both(&image).is_ok()
}

/// Decisions that make a program.
pub fn program(data: &[u8]) -> bool {
    let image = program::image(&mut Choices::new(data));
    match machine::run_both(&image) {
        Ok(()) => true,
        // A machine may be too small for it.
        Err(ImageError::TooManyGlobals(_) | ImageError::TooManyJumps(_)) => false,
        Err(error) => panic!("the verifier refuses a program that keeps its rules: {error:?}"),
    }
}

/// Bytes as a script, for one of the profiles.
pub fn script(data: &[u8]) -> bool {
    std::str::from_utf8(data).is_ok_and(|text| check(&compile_text(text, profile(data)), data))
}

/// The first byte chooses a piece of a script, every three that follow change one of its words.
pub fn script_mutated(data: &[u8]) -> bool {
    let Some((choice, changes)) = data.split_first() else { return false };
    let texts = seeds::pieces();
    let mut changed = words::split(&texts[usize::from(*choice) % texts.len()]);
    for change in changes.chunks_exact(3).take(12) {
        let [kind, at, value] = *change else { return false };
        words::change(&mut changed, words::SCRIPTS, kind, at, value);
    }
    check(&compile_text(&changed.concat(), profile(data)), data)
}

/// Bytes as an object file.
pub fn bo(data: &[u8]) -> bool {
    object(data, None, data)
}

/// The first byte chooses an object file, the next another to take from, every three that follow change it; after a
/// byte of 255 they are the debug file.
pub fn bo_mutated(data: &[u8]) -> bool {
    let [choice, other, changes @ ..] = data else { return false };
    let programs = seeds::objects();
    let mut program = programs[usize::from(*choice) % programs.len()].clone();
    let other = &programs[usize::from(*other) % programs.len()];
    let mut changes = changes;
    while let Some((change, rest)) = changes.split_first_chunk::<3>() {
        if change[0] == 255 {
            return object(&program.bytes(), changes.get(1..), data);
        }
        program.change(other, *change);
        changes = rest;
    }
    object(&program.bytes(), None, data)
}

/// The first byte chooses the profile, the others make frames.
pub fn message(data: &[u8]) -> bool {
    messages::run(data)
}

/// The first bytes choose an image and change it, the others decide about robots and frames.
pub fn social(data: &[u8]) -> bool {
    social::run(data)
}

/// The first byte chooses the profile, the others make a script.
pub fn time(data: &[u8]) -> bool {
    time::run(data)
}

fn object(bytes: &[u8], debug: Option<&[u8]>, data: &[u8]) -> bool {
    if data.len().is_multiple_of(8) {
        let _ = object::disassemble(bytes);
    }
    import(Path::new("fuzz.bo"), bytes, debug, options(profile(data)))
        .is_ok_and(|imported| check(&imported.compiled, data))
}

/// An input says nothing of the profile, and should be tried in one only: half of them in each.
fn profile(data: &[u8]) -> NumberProfile {
    if data.len().is_multiple_of(2) { NumberProfile::Tiny } else { NumberProfile::Full }
}

fn options(profile: NumberProfile) -> &'static Options {
    static OPTIONS: OnceLock<[Options; 2]> = OnceLock::new();
    let [tiny, full] = OPTIONS.get_or_init(|| {
        [NumberProfile::Tiny, NumberProfile::Full].map(|profile| Options {
            profile: Some(profile),
            robots: bittybuzz_robot_files::all_shipped(),
            ..Options::default()
        })
    });
    if profile == NumberProfile::Tiny { tiny } else { full }
}

fn compile_text(text: &str, profile: NumberProfile) -> Compiled {
    let files = MemoryFiles::default();
    compile(Path::new("fuzz.bzz"), text.into(), &IncludeLoader::new(&files), options(profile))
}

/// Messages can be shown; an image is accepted; its symbols can be kept. Whether there is one.
fn check(compiled: &Compiled, data: &[u8]) -> bool {
    let errors = compiled.diagnostics.iter().filter(|found| found.severity() == Severity::Error);
    assert_eq!(errors.count() > 0, compiled.image.is_none(), "an error and an image, or neither");
    // Of some inputs, as it takes more time than compiling.
    let shown = data.last().is_some_and(|last| last.is_multiple_of(4));
    if shown && let Some(chosen) = data.len().checked_rem(compiled.diagnostics.len()) {
        let renderer = Renderer::new(&compiled.sources);
        renderer.text(&compiled.diagnostics[chosen], ColorChoice::Never);
        renderer.json(&compiled.diagnostics[chosen]);
    }
    let Some(image) = &compiled.image else { return false };
    if shown && let Some(symbols) = &compiled.symbols {
        let kept = Symbols::from_json(&symbols.to_json());
        assert_eq!(kept.as_ref().ok(), Some(symbols), "symbols change when they are kept");
        let _ = disassemble(image, Some(symbols));
    }
    match machine::verify(image) {
        // Not every script fits every machine, and messages between robots come later.
        Ok(())
        | Err(
            ImageError::Features(_) | ImageError::TooManyGlobals(_) | ImageError::TooManyJumps(_),
        ) => true,
        Err(error) => panic!("the verifier refuses what the compiler makes: {error:?}"),
    }
}
