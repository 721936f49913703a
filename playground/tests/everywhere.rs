//! A run has one digest: natively, on several threads, after a restore, and as WebAssembly.

#![allow(clippy::unwrap_used, reason = "what fails here fails the test")]

use std::fs;
use std::path::Path;
use std::process::Command;

use bittybuzz_arena::run::Simulation;
use bittybuzz_compiler::include::MemoryFiles;
use bittybuzz_playground::open;

/// Path of the module; without it nothing is compared with WebAssembly. `cargo xtask ci wasm` builds and names it.
const MODULE: &str = "BITTYBUZZ_PLAYGROUND";

const WORLDS: [&str; 3] = ["kilobots.toml", "radios.toml", "rovers.toml"];

const TICKS: u64 = 10_000;

/// The tick at which a snapshot goes on in place of its run.
const RESTORED: u64 = 5_000;

fn folder() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/worlds"))
}

fn files() -> MemoryFiles {
    fs::read_dir(folder()).unwrap().fold(MemoryFiles::default(), |files, entry| {
        let path = entry.unwrap().path();
        files.with(path.file_name().unwrap(), fs::read(&path).unwrap())
    })
}

/// Returns the digest at the end of a run on that many threads.
fn digest(files: &MemoryFiles, world: &str, threads: usize, is_restored: bool) -> u64 {
    let mut run = open(files, world, threads).unwrap_or_else(|error| panic!("{error}"));
    while run.now() < TICKS {
        if is_restored && run.now() == RESTORED {
            run = run.snapshot().unwrap();
        }
        run.tick().unwrap();
        run.take_log();
    }
    check(world, &mut run);
    run.digest()
}

/// The robots of a world have moved, talked, and not failed: its digest is about something.
fn check(world: &str, run: &mut Simulation) {
    let summary = run.summary();
    assert_eq!(summary.fault_counts.faults, 0, "{world}: {:?}", summary.faults);
    assert!(summary.statistics.all_links().received > 10_000, "{world}");
}

#[test]
fn a_run_has_one_digest() {
    let files = files();
    let lines: Vec<String> = WORLDS
        .iter()
        .map(|world| {
            let expected = digest(&files, world, 1, false);
            assert_eq!(digest(&files, world, 1, true), expected, "{world}, restored");
            assert_eq!(digest(&files, world, 2, false), expected, "{world}, on two threads");
            format!("{world} {TICKS} {expected:x}")
        })
        .collect();
    let Some(module) = std::env::var_os(MODULE) else { return };
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/run.mjs");
    let mut node = Command::new("node");
    node.arg(script).arg(module).arg(folder()).arg(TICKS.to_string());
    let output = node.args(WORLDS).args(["emulated.toml", "missing.toml"]).output().unwrap();
    let told = String::from_utf8(output.stdout).unwrap();
    let told: Vec<&str> = told.lines().collect();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    assert_eq!(told[..WORLDS.len()], lines);
    // Errors name the file, the line and the cure.
    let errors = told[WORLDS.len()..].join("\n");
    let missing = "cannot read `missing.toml`: there is no such file";
    for part in ["emulated.toml:10:11: ", "without emulators", "backend = \"vm\"", missing] {
        assert!(errors.contains(part), "{errors}");
    }
}
