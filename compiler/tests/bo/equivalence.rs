//! Every script of this repository's tests, libraries and examples does the same from source and from the `.bo` file
//! that the reference compiler makes of it.

use std::fs;
use std::path::{Path, PathBuf};

use bittybuzz_compiler::bo::error::BoCause;
use bittybuzz_compiler::bo::{disassemble, import};
use bittybuzz_compiler::compile::compile_parsed;
use bittybuzz_compiler::include::{DiskFiles, IncludeLoader};
use bittybuzz_compiler::parser::{Parsed, parse_file};
use bittybuzz_robot_spec::NumberProfile;
use bittybuzz_vm_core::ImageError;

use crate::bo::interpreter::{self, Stop};
use crate::bo::machine::{any_robot, run, verify};
use crate::bo::reference;

/// Where the script hash ends, the only part of the header that must differ.
const AFTER_HASH: usize = 7;

fn scripts_in(folder: &Path, found: &mut Vec<PathBuf>) {
    let mut paths: Vec<PathBuf> = fs::read_dir(folder)
        .unwrap_or_else(|error| panic!("{}: {error}", folder.display()))
        .map(|entry| entry.expect("a folder that can be read").path())
        .collect();
    paths.sort();
    for path in paths {
        if path.is_dir() {
            scripts_in(&path, found);
        } else if path.extension().is_some_and(|extension| extension == "bzz") {
            found.push(path);
        }
    }
}

/// How many scripts ended how.
#[derive(Debug, Default)]
struct Tally {
    identical: usize,
    same: usize,
    different: usize,
    refused: usize,
}

/// Compares one script; those that are no programs are not counted.
fn compare(path: &Path, parsed: &Parsed, profile: NumberProfile, tally: &mut Tally) {
    let options = any_robot(profile);
    let name = path.display();
    let source = compile_parsed(parsed.clone(), &options);
    let (Some(image), Some(symbols)) = (&source.image, &source.symbols) else { return };
    let bytes = reference::compile(parsed);
    let imported = match import(path, &bytes, None, &options) {
        Ok(imported) => imported,
        Err(error) => {
            assert_eq!(error.cause, BoCause::LocalInGlobalCode, "{name}: {error}");
            tally.refused += 1;
            return;
        }
    };
    let errors: Vec<_> = imported.compiled.diagnostics.iter().map(|d| &d.message).collect();
    let Some(other) = &imported.compiled.image else { panic!("{name}: {errors:?}") };
    if image[AFTER_HASH..] == other[AFTER_HASH..] {
        tally.identical += 1;
        return;
    }
    // A machine without swarms cannot run it; what it holds was compared.
    if matches!(verify(image, symbols), Err(ImageError::Features(_))) {
        return;
    }
    let (expected, found) = (run(&source), run(&imported.compiled));
    if (&expected.lines, expected.ending) == (&found.lines, found.ending) {
        tally.same += 1;
        return;
    }
    tally.different += 1;
    // The file itself means something else then: both sides of `and` and `or` are evaluated, and lambdas of top-level
    // blocks have wrong parameters. Where its own machine stops, this one may go on.
    let trace = interpreter::run(&bytes);
    let explained = match trace.stop {
        None | Some(Stop::Fault) => found.lines.starts_with(&trace.lines),
        Some(Stop::Limit | Stop::Unsupported) => {
            let listing = disassemble(&bytes).expect("a program");
            listing.contains(": land\n") || listing.contains(": lor\n")
        }
    };
    assert!(explained, "{name}: {expected:#?}\n{found:#?}\n{trace:#?}");
}

#[test]
fn scripts_mean_the_same_from_source_and_from_bo() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let mut scripts = Vec::new();
    for folder in ["tests/conformance", "tests/bzz", "lib", "examples"] {
        scripts_in(&root.join(folder), &mut scripts);
    }
    let mut loader = IncludeLoader::new(&DiskFiles);
    loader.folders = vec![root.join("lib")];
    let mut tally = Tally::default();
    for path in &scripts {
        let parsed = parse_file(path, &loader);
        if !parsed.has_errors() {
            compare(path, &parsed, NumberProfile::Full, &mut tally);
            compare(path, &parsed, NumberProfile::Tiny, &mut tally);
        }
    }
    println!("{tally:?}");
    // Mostly not even the bytes differ; where they do it is in the order of functions and globals, in parameters that
    // nothing uses, and in `and` and `or`.
    assert!(tally.identical > 1000, "{tally:?}");
}
