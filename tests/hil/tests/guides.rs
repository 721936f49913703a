//! The guides do what they say: each is carried out in a copy of the repository, command by command.
//!
//! The first run builds what the copies need (embassy, for the chip); later ones only what a guide changes.

use std::path::Path;

use bittybuzz_hil::guide::{Copy, Guide};
use bittybuzz_tests::bbz;

fn carry_out(path: &str) {
    let text = std::fs::read_to_string(bbz::root().join(path)).expect("the guide is there");
    let guide = Guide::read(path, &text).unwrap_or_else(|failure| panic!("{failure}"));
    let copy = Copy::new(Path::new(env!("CARGO_TARGET_TMPDIR"))).expect("git is there, and room");
    copy.carry_out(&guide).unwrap_or_else(|failure| panic!("{failure}"));
}

#[test]
fn a_new_robot_function() {
    carry_out("docs/new-robot-function.md");
}

#[test]
fn a_new_robot() {
    carry_out("docs/new-robot.md");
}
