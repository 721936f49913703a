//! Replays the committed corpora through the bodies of the fuzz targets.

use std::fs;
use std::path::Path;

use bittybuzz_fuzz_bodies as bodies;

fn replay(target: &str, body: fn(&[u8])) {
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
    replay("image", bodies::image);
}

#[test]
fn image_mutated() {
    replay("image_mutated", |data| {
        bodies::image_mutated(data);
    });
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

/// A sample of what the fuzzer does, without its guidance.
#[test]
fn random_changes() {
    let mut state = 0x9e37_79b9u32;
    let mut random = move || {
        state ^= state << 13;
        state ^= state >> 17;
        state ^= state << 5;
        state as u8
    };
    let mut verified = 0;
    for _ in 0..3000 {
        let length = 3 + 4 * (usize::from(random() % 4) + 1);
        let input: Vec<u8> = (0..length).map(|_| random()).collect();
        verified += u32::from(bodies::image_mutated(&input));
    }
    // Else most of the work would be the verifier's.
    println!("{verified} of 3000 changed images verify");
    assert!(verified > 600, "only {verified} of 3000 changed images verify");
    for _ in 0..300 {
        let length = usize::from(random() % 30) + 1;
        let input: Vec<u8> = (0..length).map(|_| random()).collect();
        bodies::script_mutated(&input);
    }
}
