//! Scripts with mistakes: words that are missing, doubled, exchanged or too many, missing lines, a missing end.
//!
//! Whatever the mistakes, the compiler ends with errors or with an image that the machine accepts, and no name is
//! called unknown that the text still defines. So the first message about a mistake is about the mistake.

use bittybuzz_compiler::codes::DiagnosticCode;
use bittybuzz_compiler::compile::Compiled;
use bittybuzz_compiler::diagnostic::{Diagnostic, Severity};
use bittybuzz_compiler::render::{ColorChoice, Renderer};
use bittybuzz_robot_spec::NumberProfile;
use bittybuzz_testkit::Program;
use bittybuzz_vm_core::ImageError;
use proptest::prelude::RngExt;
use proptest::test_runner::{RngAlgorithm, TestRng};

use crate::back::machine::{FULL, TINY, at_least, verify};
use crate::back::scripts::{Script, scripts_under};
use crate::back::unknown_names::{falsely_unknown, has_syntax_error, split};

/// Words that one slips in.
const WORDS: [&str; 28] = [
    "(", ")", "{", "}", "[", "]", ",", ".", "=", "==", "+", "-", "*", "\"", "'", "#", ";", "\n",
    "1", "2.5", "not", "and", "if(", "else", "function", "var", "return", "@",
];

/// The scripts that are changed.
fn scripts() -> Vec<Script> {
    ["examples", "lib", "tests/conformance", "tests/bzz"]
        .map(scripts_under)
        .into_iter()
        .flatten()
        .collect()
}

/// Makes one mistake.
fn change(text: &mut String, random: &mut TestRng) {
    let pieces = split(text);
    let Some(last) = pieces.len().checked_sub(1) else { return };
    let mut any = || pieces[random.random_range(0..=last)].clone();
    let (piece, other) = (any(), any());
    let string = pieces.iter().find(|string| {
        string.range.start >= piece.range.start && string.text.starts_with(['"', '\''])
    });
    let closing_quote = string.map(|string| string.range.end - 1);
    let [this, that] = [&piece, &other].map(|piece| piece.text.to_owned());
    let (from, to) = (piece.range, other.range);
    let word = WORDS[random.random_range(0..WORDS.len())];
    match random.random_range(0..9) {
        0 => text.replace_range(from, ""),
        1 => text.insert_str(from.end, &format!(" {this}")),
        2 => text.insert_str(from.start, &format!("{that} ")),
        3 => text.insert_str(from.start, &format!("{word} ")),
        4 => text.replace_range(from, word),
        5 if from.end <= to.start => {
            text.replace_range(to, &this);
            text.replace_range(from, &that);
        }
        5 => text.replace_range(from, &that),
        6 => {
            let start = text[..from.start].rfind('\n').map_or(0, |at| at + 1);
            let end = text[from.end..].find('\n').map_or(text.len(), |at| from.end + at + 1);
            text.replace_range(start..end, "");
        }
        7 => text.truncate(from.end),
        _ => {
            if let Some(at) = closing_quote {
                text.remove(at);
            }
        }
    }
}

/// The script that a seed changes, and the changed text.
fn mutant(scripts: &[Script], seed: u32) -> (&Script, String) {
    let mut bytes = [0; 32];
    bytes[..4].copy_from_slice(&seed.to_le_bytes());
    let mut random = TestRng::from_seed(RngAlgorithm::ChaCha, &bytes);
    let script = &scripts[random.random_range(0..scripts.len())];
    let mut text = script.text.clone();
    for _ in 0..random.random_range(1..=4) {
        change(&mut text, &mut random);
    }
    (script, text)
}

/// Reasons why the result of compiling `text` in the place of a script is wrong.
fn problems(text: &str, compiled: &Compiled, profile: NumberProfile) -> Vec<String> {
    let mut problems = falsely_unknown(text, compiled);
    let is_error = |found: &Diagnostic| found.severity() == Severity::Error;
    if compiled.diagnostics.iter().any(is_error) == compiled.image.is_some() {
        problems.push("an image in spite of errors, or neither".to_owned());
    }
    if compiled.diagnostics.iter().any(|found| found.code == DiagnosticCode::Internal) {
        problems.push("a mistake in the compiler".to_owned());
    }
    let renderer = Renderer::new(&compiled.sources);
    for found in &compiled.diagnostics {
        if !renderer.text(found, ColorChoice::Never).contains(found.code.text()) {
            problems.push(format!("{} is not printed", found.code.text()));
        }
    }
    match compiled.image.as_ref().map(|image| verify(image, profile)) {
        // The machine of these tests is small, and has no neighbors.
        None
        | Some(
            Ok(())
            | Err(
                ImageError::Features(_)
                | ImageError::TooManyGlobals(_)
                | ImageError::TooManyJumps(_),
            ),
        ) => {}
        Some(Err(error)) => problems.push(format!("the machine refuses the image: {error:?}")),
    }
    problems
}

#[test]
fn mistakes_have_messages_and_hide_no_names() {
    let scripts = scripts();
    let options = [TINY, FULL].map(|profile| (profile, Program::options(profile)));
    let count = at_least(3000);
    let (mut broken, mut built) = (0, 0);
    let mut found = Vec::new();
    for seed in 0..count {
        let (script, text) = mutant(&scripts, seed);
        for (profile, options) in &options {
            let compiled = script.compile(&text, options);
            broken += u32::from(has_syntax_error(&compiled));
            built += u32::from(compiled.image.is_some());
            for problem in problems(&text, &compiled, *profile) {
                let path = script.path.display();
                found.push(format!("{problem}: seed {seed}, {profile:?}, {path}:\n{text}\n"));
            }
        }
    }
    assert!(found.is_empty(), "{} problems, first:\n{}", found.len(), found[0]);
    // Some mistakes leave a script that means something else.
    assert!(broken > count && built > count / 10, "{broken} broken, {built} built of {count}");
}
