//! Replays the committed corpora, and images made of known scripts, through the bodies of the fuzz targets, and a sample of random inputs.

use std::fs;
use std::path::Path;

use bittybuzz_fuzz_bodies as bodies;

fn replay(target: &str, body: fn(&[u8]) -> bool) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fuzz/corpus").join(target);
    let mut inputs = 0;
    for entry in fs::read_dir(&folder).unwrap_or_else(|error| panic!("{folder:?}: {error}")) {
        let path = entry.expect("the folder can be listed").path();
        // Shown if the body panics.
        println!("{}", path.display());
        body(&fs::read(&path).expect("the input can be read"));
        inputs += 1;
    }
    assert!(inputs >= 10, "only {inputs} inputs in {folder:?}");
}

#[test]
fn image() {
    assert!(bodies::images().iter().all(|image| bodies::image(image)));
}

#[test]
fn image_mutated() {
    replay("image_mutated", bodies::image_mutated);
}

#[test]
fn program() {
    replay("program", bodies::program);
}

#[test]
fn script() {
    replay("script", bodies::script);
}

#[test]
fn script_mutated() {
    replay("script_mutated", bodies::script_mutated);
}

#[test]
fn bo() {
    replay("bo", bodies::bo);
}

#[test]
fn bo_mutated() {
    replay("bo_mutated", bodies::bo_mutated);
}

#[test]
fn message() {
    replay("message", bodies::message);
}

#[test]
fn recording() {
    replay("recording", bodies::recording);
}

#[test]
fn scenario() {
    replay("scenario", bodies::scenario);
}

#[test]
fn robot_file() {
    replay("robot_file", bodies::robot_file);
}

#[test]
fn symbols() {
    replay("symbols", bodies::symbols);
}

#[test]
fn syslink() {
    replay("syslink", bodies::syslink);
}

#[test]
fn nrf24() {
    replay("nrf24", bodies::nrf24);
}

#[test]
fn ir() {
    replay("ir", bodies::ir);
}

#[test]
fn social() {
    replay("social", bodies::social);
}

#[test]
fn time() {
    replay("time", bodies::time);
}

/// What the fuzzer does, without its guidance: so many inputs of random length, of which so many hundredths must get past
/// verifier, compiler or importer. Else most of the work would be in front of that.
fn sample(body: fn(&[u8]) -> bool, count: u32, length: std::ops::Range<u32>, share: u32) {
    let mut state = 0x9e37_79b9u32;
    let mut random = move || {
        state ^= state << 13;
        state ^= state >> 17;
        state ^= state << 5;
        state >> 8
    };
    let mut passed = 0;
    for _ in 0..count {
        let length = length.start + random() % (length.end - length.start);
        let input: Vec<u8> = (0..length).map(|_| random() as u8).collect();
        // Shown if the body panics.
        println!("{input:?}");
        passed += u32::from(body(&input));
    }
    println!("{passed} of {count} pass");
    assert!(passed * 100 >= share * count, "only {passed} of {count} pass");
}

#[test]
fn random_changes_of_images() {
    sample(bodies::image_mutated, 3000, 9..22, 20);
}

#[test]
fn random_programs() {
    sample(bodies::program, 3000, 20..300, 90);
}

#[test]
fn random_changes_of_scripts() {
    sample(bodies::script_mutated, 300, 4..20, 20);
}

#[test]
fn random_changes_of_object_files() {
    sample(bodies::bo_mutated, 1000, 5..20, 20);
}

#[test]
fn random_messages() {
    sample(bodies::message, 500, 20..400, 90);
}

#[test]
fn random_changes_of_scenarios() {
    sample(bodies::scenario, 1000, 4..20, 10);
}

#[test]
fn random_changes_of_robot_files() {
    sample(bodies::robot_file, 1000, 4..20, 10);
}

#[test]
fn random_changes_of_symbols() {
    sample(bodies::symbols, 1000, 4..20, 10);
}

#[test]
fn random_changes_of_recordings() {
    sample(bodies::recording, 3000, 20..200, 30);
}

#[test]
fn random_frames_on_the_serial_link() {
    sample(bodies::syslink, 3000, 20..400, 30);
}

#[test]
fn random_payloads() {
    sample(bodies::nrf24, 3000, 1..40, 40);
}

#[test]
fn random_light() {
    sample(bodies::ir, 3000, 20..200, 50);
}

#[test]
fn random_changes_of_social_input() {
    sample(bodies::social, 400, 8..400, 20);
}

#[test]
fn random_scripts_of_large_structures() {
    sample(bodies::time, 60, 8..60, 50);
}
