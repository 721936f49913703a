//! The texts about a run that stand in the comments of its scenario and scripts.
//!
//! A scenario may propose commands, each as the keys of an `[[event]]` after a label:
//!
//! ```text
//! # try: Carry the source away: move = 1, to = [0, 360]
//! ```

use serde::Serialize;

use crate::leds::{self, LedMeaning};

/// The texts about a run.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct AboutDescription {
    /// The paragraphs of the comment with which the scenario begins.
    pub text: Vec<String>,
    pub scripts: Vec<ScriptAbout>,
    pub proposals: Vec<Proposal>,
}

/// The texts about a script.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct ScriptAbout {
    /// The name of the script.
    pub name: String,
    /// The paragraphs of the comment with which the script begins.
    pub text: Vec<String>,
    pub leds: Vec<LedMeaning>,
}

/// A command that the user may try.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Proposal {
    pub label: String,
    /// The command, as the client requests it.
    pub command: String,
}

impl AboutDescription {
    /// Reads the text of a scenario.
    pub fn new(scenario: &str, scripts: Vec<ScriptAbout>) -> Self {
        AboutDescription { text: head(scenario), scripts, proposals: proposals(scenario) }
    }
}

impl ScriptAbout {
    /// Reads the text of a script.
    pub fn new(name: String, text: &str) -> Self {
        let leds = leds::read(text).into_iter().flatten().collect();
        ScriptAbout { name, text: head(text), leds }
    }
}

/// Returns the paragraphs of the comment with which a file begins, without those that address
/// programs: command lines of `bbz` with their output, lists of robots, and requests to the page.
fn head(text: &str) -> Vec<String> {
    let lines = text.trim_start_matches('\u{feff}').lines();
    let lines: Vec<&str> = lines.map_while(|line| line.trim().strip_prefix('#')).collect();
    let paragraphs = lines.split(|line| line.trim().is_empty());
    let paragraphs = paragraphs.filter_map(|lines| {
        let lines = lines.iter().map(|line| line.trim()).filter(|line| !is_request(line));
        let text = lines.collect::<Vec<_>>().join(" ");
        let is_for_programs = text.starts_with("bbz ") || text.starts_with("Robots:");
        (!text.is_empty() && !is_for_programs).then_some(text)
    });
    paragraphs.collect()
}

/// Returns true for a line that the page reads as a request.
fn is_request(line: &str) -> bool {
    let kind = line.split_once(':').map_or("", |(kind, _)| kind.trim());
    ["led", "try", "slider", "switch", "button"].contains(&kind)
}

/// Reads the commands that a scenario proposes. A line without a key is a remark.
fn proposals(scenario: &str) -> Vec<Proposal> {
    let proposals = scenario.lines().filter_map(|line| {
        let comment = line.trim().strip_prefix('#')?.trim();
        let (kind, rest) = comment.split_once(':')?;
        let (before, _) = rest.split_once('=').filter(|_| kind.trim() == "try")?;
        // The label ends with the last colon before the first key.
        let at = before.rfind(':').map_or(0, |colon| colon + 1);
        let (label, keys) = (before[..at].trim_end_matches(':').trim(), rest[at..].trim());
        let label = if label.is_empty() { keys } else { label };
        Some(Proposal { label: label.to_owned(), command: lines_of(keys) })
    });
    proposals.collect()
}

/// Writes keys that are separated by commas as lines, as an `[[event]]` has them. Commas inside of
/// arrays, tables and strings stay.
fn lines_of(keys: &str) -> String {
    let (mut lines, mut depth, mut quote) = (String::new(), 0_u32, None);
    for letter in keys.chars() {
        match (letter, quote) {
            (_, Some(open)) if letter == open => quote = None,
            (_, Some(_)) => {}
            ('"' | '\'', None) => quote = Some(letter),
            ('[' | '{', None) => depth += 1,
            (']' | '}', None) => depth = depth.saturating_sub(1),
            _ => {}
        }
        match letter {
            ',' if depth == 0 && quote.is_none() => lines.push('\n'),
            ' ' if lines.ends_with('\n') => {}
            _ => lines.push(letter),
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_head_of_a_file_is_its_first_comment_without_lines_for_programs() {
        let text = "# Day and night:\n# a start.\n#\n# led: 1 = day\n# More of it.\n#\n# Robots: kilobot\n#\n\
            # bbz run light.bzz\n# prints\n#   led(1)\n\n# Not here.\n";
        assert_eq!(head(text), ["Day and night: a start.", "More of it."]);
        assert_eq!(head("[world]\n# Later.\n"), Vec::<String>::new());
    }

    #[test]
    fn proposals_are_commands_with_labels() {
        let text = "# try: Carry it away: move = 1, to = [0, 360]\n[world]\n# try: fail = 3\n\
            # try: Say: it: call = \"say\", with = [\"a, b\", 'c']\n# try: nothing\n# retry: fail = 1\n";
        let proposal = |label: &str, command: &str| Proposal {
            label: label.to_owned(),
            command: command.to_owned(),
        };
        let expected = [
            proposal("Carry it away", "move = 1\nto = [0, 360]"),
            proposal("fail = 3", "fail = 3"),
            proposal("Say: it", "call = \"say\"\nwith = [\"a, b\", 'c']"),
        ];
        assert_eq!(proposals(text), expected);
    }
}
