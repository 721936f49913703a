//! Some bad inputs of each kind; `cargo xtask soak bad_inputs` has the others.
#![cfg(target_os = "linux")]

use std::path::Path;

use bittybuzz_bad_inputs::{Runner, kinds};

/// The first seed of the sample. The full run has lower ones, too.
const SEED: u64 = 0;

#[test]
fn some_bad_inputs_of_each_kind_break_no_rule() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
    let kept = Path::new(env!("CARGO_TARGET_TMPDIR")).join("bad_inputs");
    let runner = Runner::new(Path::new(env!("CARGO_BIN_EXE_bbz")), root, &kept).unwrap();
    let run = |kind| runner.run(kind, SEED).unwrap();
    let broken: Vec<_> = kinds().iter().filter_map(run).collect();
    assert!(broken.is_empty(), "{broken:#?}");
}
