//! A run has one digest: natively, on several threads, after a restore, and as WebAssembly.

#![allow(clippy::unwrap_used, reason = "what fails here fails the test")]

use std::fs;
use std::path::Path;
use std::process::Command;
use std::time::Duration;

use bittybuzz_arena::run::{Session, Simulation};
use bittybuzz_live::{Live, PageEvent, SharedFiles, Shelf, Source};
use serde_json::Value;

/// The variable with the path of the module. Without it, the test does not compare with
/// WebAssembly. `cargo xtask ci wasm` builds the module and sets the variable.
const MODULE: &str = "BITTYBUZZ_PLAYGROUND";

const WORLDS: [&str; 3] = ["kilobots.toml", "radios.toml", "rovers.toml"];

const TICKS: u64 = 10_000;

/// The tick at which a snapshot replaces its run.
const RESTORED: u64 = 5_000;

fn folder() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/worlds"))
}

fn files() -> SharedFiles {
    let files = SharedFiles::default();
    for entry in fs::read_dir(folder()).unwrap() {
        let path = entry.unwrap().path();
        files.add(path.file_name().unwrap(), fs::read(&path).unwrap());
    }
    files
}

fn open(files: &SharedFiles, world: &str, threads: usize) -> Simulation {
    let opened = Shelf::new(files.clone(), world.into()).open(threads);
    opened.unwrap_or_else(|error| panic!("{error}")).0
}

/// Returns the digest at the end of a run on that many threads.
fn digest(files: &SharedFiles, world: &str, threads: usize, is_restored: bool) -> u64 {
    let mut run = open(files, world, threads);
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

/// Plays the session of `session.json` and returns its events and samples, a line for each request.
fn session(files: &SharedFiles) -> Vec<String> {
    let shelf = Shelf::new(files.clone(), WORLDS[0].into());
    let (run, text) = shelf.open(1).unwrap();
    let mut live = Live::new(Session::new(run, 20), text).with_workshop(shelf);
    let steps: Value = serde_json::from_str(include_str!("session.json")).unwrap();
    let steps = steps.as_array().unwrap().iter().map(|step| {
        let now = Duration::from_millis(step[1].as_u64().unwrap());
        if let Some(text) = step[0].as_str() {
            live.request(text, now);
        }
        let mut ticks = 0..step[2].as_u64().unwrap();
        live.advance(now, &mut || ticks.next().is_some());
        let sample = live.take_sample();
        let sample: String = sample.iter().map(|byte| format!("{byte:02x}")).collect();
        let events: Vec<String> = live.take_events().iter().map(PageEvent::to_json).collect();
        format!("[{}] {sample}", events.join(","))
    });
    steps.collect()
}

#[test]
fn the_session_contains_every_part_to_compare() {
    let printed = session(&files()).join("\n");
    for part in [
        "\"event\":\"begin\"",
        "\"event\":\"inspection\"",
        "\"text\":\"calm for 50\"",
        "\"event\":\"fault\"",
        "cannot read `none.bzz`",
        "\"text\":\"[[event]]\\nat = 32.1\\nfail = 4",
        "makes no sense",
    ] {
        assert!(printed.contains(part), "{part} is missing:\n{printed}");
    }
}

/// Checks that the robots of a world exchanged frames and did not fail, so that the digest covers
/// some activity.
fn check(world: &str, run: &mut Simulation) {
    let summary = run.summary();
    assert_eq!(summary.fault_counts.faults, 0, "{world}: {:?}", summary.faults);
    assert!(summary.statistics.all_links().received > 10_000, "{world}");
}

#[test]
fn scripts_include_the_library() {
    let script = b"include \"vec2.bzz\"\nfunction step() { log(math.vec2.length(math.vec2.new(3.0, 4.0))) }\n";
    let scenario = b"[world]\nsize = [500, 500]\nduration = 1\n\n[[robots]]\nrobot = \"kilobot\"\nscript = \"s.bzz\"\ncount = 1\n";
    let files = SharedFiles::default();
    files.add("s.bzz", script);
    files.add("s.toml", scenario);
    let mut run = open(&files, "s.toml", 1);
    while run.now() < 10 {
        run.tick().unwrap();
    }
    let log = run.take_log();
    assert!(!log.is_empty());
    assert_eq!(run.summary().fault_counts.faults, 0);
}

/// A link may have scripts of 1 MiB each and of 4 MiB together, however many bytes they claim.
#[test]
fn a_long_link_is_refused_early() {
    // The step that sets the variable has Node.js.
    if std::env::var_os(MODULE).is_none() {
        return;
    }
    let test = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/link.mjs");
    let output = Command::new("node").arg(test).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

#[test]
fn a_run_has_one_digest() {
    let files = files();
    let lines: Vec<String> = WORLDS
        .iter()
        .map(|world| {
            let expected = digest(&files, world, 1, false);
            let other = digest(&files, world, 2, true);
            assert_eq!(other, expected, "{world}, on two threads and restored");
            format!("{world} {TICKS} {expected:x}")
        })
        .collect();
    let Some(module) = std::env::var_os(MODULE) else { return };
    let tests = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests");
    let mut node = Command::new("node");
    node.arg(tests.join("run.mjs")).arg(module).arg(folder()).arg(TICKS.to_string());
    node.arg(tests.join("session.json")).args(WORLDS).args(["emulated.toml", "missing.toml"]);
    let output = node.output().unwrap();
    let printed = String::from_utf8(output.stdout).unwrap();
    let printed: Vec<&str> = printed.lines().collect();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let session = session(&files);
    let errors = WORLDS.len()..printed.len() - session.len();
    assert_eq!(printed[..errors.start], lines);
    assert_eq!(printed[errors.end..], session);
    // Errors name the file, the line and the cure.
    let errors = printed[errors].join("\n");
    let missing = "cannot read `missing.toml`: there is no such file";
    for part in ["emulated.toml:10:11: ", "without emulators", "backend = \"vm\"", missing] {
        assert!(errors.contains(part), "{errors}");
    }
}
