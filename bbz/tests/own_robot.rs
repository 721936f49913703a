//! Follows docs/own-robot.md: writes its files, runs its commands, and compares their output.

use crate::support::{Folder, page};

const GUIDE: &str = include_str!("../../docs/own-robot.md");

#[test]
fn the_guide_can_be_carried_out() {
    let commands = page::carry_out(&Folder::new("own_robot"), GUIDE);
    assert!(commands >= 3, "{commands} blocks of commands");
}
