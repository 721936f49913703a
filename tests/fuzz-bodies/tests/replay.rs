//! Replays the committed corpora, and images made of known scripts, through the bodies of the fuzz targets: as they are,
//! changed at random, and a sample of random inputs. This is the sample of `cargo xtask soak fuzz` that CI runs: with the
//! checks of the other tests, without the engine's guidance.

use std::fs;
use std::path::Path;

use bittybuzz_fuzz_bodies as bodies;
use bittybuzz_random::Random;

/// Changed inputs that are tried for each target.
const CHANGED: u32 = 3000;
/// Longest changed input, in bytes, as libFuzzer has it unless it is given another.
const LENGTH_MAX: usize = 4096;

fn replay(target: &str, body: fn(&[u8]) -> bool) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fuzz/corpus").join(target);
    let entries = fs::read_dir(&folder).unwrap_or_else(|error| panic!("{folder:?}: {error}"));
    let mut paths: Vec<_> = entries.map(|entry| entry.expect("an entry").path()).collect();
    // Folders list their files in any order.
    paths.sort();
    assert!(paths.len() >= 10, "only {} inputs in {folder:?}", paths.len());
    let inputs: Vec<_> =
        paths.iter().map(|path| fs::read(path).expect("the input can be read")).collect();
    for (path, input) in paths.iter().zip(&inputs) {
        // Shown if the body panics.
        println!("{}", path.display());
        body(input);
    }
    try_changed(&inputs, body);
}

/// Runs a body with changes of its inputs.
fn try_changed(inputs: &[Vec<u8>], body: fn(&[u8]) -> bool) {
    let mut random = Random::new(1);
    for number in 0..CHANGED {
        let input = changed(inputs, &mut random);
        // Shown if the body panics.
        println!("{number}: {input:?}");
        body(&input);
    }
}

/// Returns one of the inputs with one to four changes of the kinds that libFuzzer makes.
fn changed(inputs: &[Vec<u8>], random: &mut Random) -> Vec<u8> {
    let any = |random: &mut Random| &inputs[random.below(inputs.len() as u32) as usize];
    let place = |random: &mut Random, length: usize| random.below(length as u32 + 1) as usize;
    let mut input = any(random).clone();
    for _ in 0..=random.below(4) {
        let at = place(random, input.len());
        let end = (at + 1 + random.below(8) as usize).min(input.len());
        match random.below(6) {
            0 if at < end => input[at] ^= 1 << random.below(8),
            1 if at < end => input[at] = random.bits() as u8,
            2 => drop(input.drain(at..end)),
            3 => input.insert(at, random.bits() as u8),
            4 => input.extend_from_within(at..end),
            _ => {
                let other = any(random);
                input.truncate(at);
                input.extend(&other[place(random, other.len())..]);
            }
        }
    }
    input.truncate(LENGTH_MAX);
    input
}

#[test]
fn image() {
    let images = bodies::images();
    assert!(images.iter().all(|image| bodies::image(image)));
    try_changed(images, bodies::image);
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

/// Runs a body with so many inputs of random length, of which so many hundredths must get past
/// verifier, compiler or importer. Else most of the work would be in front of that.
fn sample(body: fn(&[u8]) -> bool, count: u32, length: std::ops::Range<u32>, share: u32) {
    let mut random = Random::new(1);
    let mut passed = 0;
    for _ in 0..count {
        let length = length.start + random.below(length.end - length.start);
        let input: Vec<u8> = (0..length).map(|_| random.bits() as u8).collect();
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
