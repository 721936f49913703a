//! What the fuzz targets do with their input. A body returns, whatever the input; a panic is a defect of the project.
//!
//! | target | input | must hold |
//! |---|---|---|
//! | `image` | bytes as an image | verifier and machine survive; a run keeps to its budget |
//! | `image_mutated` | changes to the image of a known script | the same; most of these inputs get past the header |
//! | `script` | bytes as a script | compiler survives; what it compiles is accepted by the verifier and runs |
//! | `script_mutated` | changes to the words of a known script | the same; most of these inputs get past the lexer |
//! | `bo` | bytes as an object file of the reference compiler | the same for the importer |

mod machine;
mod mutation;
mod seeds;

use std::path::Path;
use std::sync::OnceLock;

use bittybuzz_compiler::bo;
use bittybuzz_compiler::compile::{Compiled, Options, compile};
use bittybuzz_compiler::diagnostic::Severity;
use bittybuzz_compiler::disasm::disassemble;
use bittybuzz_compiler::include::{Loader, MemoryFiles};
use bittybuzz_compiler::render::{Color, Renderer};
use bittybuzz_compiler::symbols::Symbols;
use bittybuzz_robots::Profile;
use bittybuzz_vm_core::ImageError;
use machine::run_both;

/// Bytes as an image.
pub fn image(data: &[u8]) {
    let _ = run_both(data);
    let _ = disassemble(data, None);
}

/// The first byte chooses an image, the next two decide how it is run, every four that follow change it. Whether the
/// verifier lets the result pass.
pub fn image_mutated(data: &[u8]) -> bool {
    let [choice, slots, torture, changes @ ..] = data else { return false };
    let images = seeds::images();
    let mut image = images[usize::from(*choice) % images.len()].clone();
    image[3] = *slots;
    image[4] = *torture;
    for change in changes.chunks_exact(4).take(16) {
        let [kind, low, high, value] = *change else { return false };
        mutation::change(&mut image, kind, u16::from_le_bytes([low, high]), value);
    }
    run_both(&image).is_ok()
}

/// Bytes as a script.
pub fn script(data: &[u8]) {
    let Ok(text) = std::str::from_utf8(data) else { return };
    for profile in [Profile::Tiny, Profile::Full] {
        let compiled = compile_text(text, profile);
        check(&compiled);
    }
}

/// The first byte chooses a script, every three that follow change one of its words.
pub fn script_mutated(data: &[u8]) {
    let Some((choice, changes)) = data.split_first() else { return };
    let texts = seeds::SCRIPTS;
    let mut words = seeds::words(texts[usize::from(*choice) % texts.len()]);
    for change in changes.chunks_exact(3).take(12) {
        let [kind, at, value] = *change else { return };
        if words.is_empty() {
            return;
        }
        // A byte reaches all of a short script and every few words of a long one.
        let at = usize::from(at) * words.len() / 256;
        let other = usize::from(value) * words.len() / 256;
        match kind % 5 {
            0 => words[at] = words[other],
            1 => words.swap(at, other),
            2 => words.insert(at, words[other]),
            3 => words[at] = seeds::WORDS[usize::from(value) % seeds::WORDS.len()],
            _ => {
                words.remove(at);
            }
        }
    }
    let text = words.concat();
    check(&compile_text(
        &text,
        if data.len().is_multiple_of(2) { Profile::Tiny } else { Profile::Full },
    ));
}

/// Bytes as an object file.
pub fn bo(data: &[u8]) {
    let _ = bo::disassemble(data);
    let options = options(Profile::Full);
    if let Ok(imported) = bo::import(Path::new("fuzz.bo"), data, None, &options) {
        check(&imported.compiled);
    }
}

fn options(profile: Profile) -> Options {
    static ROBOTS: OnceLock<Vec<bittybuzz_robots::Robot>> = OnceLock::new();
    let robots = ROBOTS.get_or_init(bittybuzz_robots::all_shipped).clone();
    Options { profile: Some(profile), robot: None, robots }
}

fn compile_text(text: &str, profile: Profile) -> Compiled {
    let files = MemoryFiles::default();
    compile(Path::new("fuzz.bzz"), text.into(), &Loader::new(&files), &options(profile))
}

/// Messages can be shown; an image is accepted and can be run; symbols can be kept.
fn check(compiled: &Compiled) {
    let renderer = Renderer::new(&compiled.sources);
    for diagnostic in compiled.diagnostics.iter().take(3) {
        renderer.text(diagnostic, Color::Never);
        renderer.json(diagnostic);
    }
    let is_wrong = compiled.diagnostics.iter().any(|found| found.severity() == Severity::Error);
    assert_eq!(is_wrong, compiled.image.is_none(), "an error and an image, or neither");
    let Some(image) = &compiled.image else { return };
    if let Some(symbols) = &compiled.symbols {
        let kept = Symbols::from_json(&symbols.to_json());
        assert_eq!(kept.as_ref().ok(), Some(symbols), "symbols change when they are kept");
        let _ = disassemble(image, Some(symbols));
    }
    match run_both(image) {
        // Not every script fits every machine, and messages between robots come later.
        Ok(())
        | Err(
            ImageError::Features(_) | ImageError::TooManyGlobals(_) | ImageError::TooManyJumps(_),
        ) => {}
        Err(error) => panic!("the verifier refuses what the compiler makes: {error:?}"),
    }
}
