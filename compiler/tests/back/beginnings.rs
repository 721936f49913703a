//! Somebody who types a script sees the messages about each of its beginnings.

use bittybuzz_testkit::Program;

use crate::back::machine::FULL;
use crate::back::scripts::{Script, scripts_under};
use crate::back::unknown_names::falsely_unknown;

/// The message and the beginning for each known name that is called unknown.
fn false_messages(script: &Script) -> Vec<String> {
    let options = Program::options(FULL);
    let mut found = Vec::new();
    for (end, _) in script.text.char_indices() {
        let beginning = &script.text[..end];
        for message in falsely_unknown(beginning, &script.compile(beginning, &options)) {
            found.push(format!("{} up to {end}: {message}", script.path.display()));
        }
    }
    found
}

#[test]
fn known_names_are_not_reported_as_unknown() {
    let examples = scripts_under("examples");
    assert!(examples.len() > 30, "{}", examples.len());
    let found: Vec<String> = examples.iter().flat_map(false_messages).collect();
    assert_eq!(found, [""; 0]);
}
