//! The texts about a run that stand in the comments of its scenario and scripts.
//!
//! A scenario may propose commands, each as the keys of an `[[event]]` after a label:
//!
//! ```text
//! # try: Carry the source away: move = 1, to = [0, 360]
//! ```
//!
//! All these texts may stand there once more in another language, whose code follows the kind of the
//! line; a paragraph then begins with `text`:
//!
//! ```text
//! # text.fr: Une horloge.
//! # try.fr: Emporter la source : move = 1, to = [0, 360]
//! ```

#[cfg(test)]
mod examples;

use bittybuzz_compiler::comments::{is_request, leds, page_comments, split_language};
use serde::Serialize;

/// The texts about a run.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct AboutDescription {
    /// The paragraphs of the comment with which the scenario begins.
    pub text: Vec<Paragraph>,
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
    pub text: Vec<Paragraph>,
    pub leds: Vec<LedMeaning>,
}

/// The color of an LED and its meaning in a script.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct LedMeaning {
    /// The sum of 1 for red, 2 for green and 4 for blue, as `led()` takes it.
    pub color: u8,
    pub meaning: String,
    /// The code of the language, such as `fr`; `None` is the language of the script.
    pub language: Option<String>,
}

/// A paragraph of a comment.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Paragraph {
    pub text: String,
    /// The code of the language, such as `fr`; `None` is the language of the file.
    pub language: Option<String>,
}

/// A command that the user may try.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Proposal {
    pub label: String,
    /// The command, as the client requests it.
    pub command: String,
    /// The code of the label's language, such as `fr`; `None` is the language of the scenario.
    pub language: Option<String>,
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
        let leds = leds::read(text).into_iter().flatten();
        let leds = leds.map(|leds::LedMeaning { color, meaning, language }| LedMeaning {
            color,
            meaning,
            language,
        });
        ScriptAbout { name, text: head(text), leds: leds.collect() }
    }
}

/// Returns the paragraphs of the comment with which a file begins, without those that address
/// programs: command lines of `bbz` with their output, lists of robots, and requests to the page.
fn head(text: &str) -> Vec<Paragraph> {
    let lines = text.trim_start_matches('\u{feff}').lines();
    let lines: Vec<&str> = lines.map_while(|line| line.trim().strip_prefix('#')).collect();
    let paragraphs = lines.split(|line| line.trim().is_empty());
    let paragraphs = paragraphs.filter_map(|lines| {
        let lines = lines.iter().map(|line| line.trim()).filter(|line| !is_request(line));
        let text = lines.collect::<Vec<_>>().join(" ");
        let is_for_programs = text.starts_with("bbz ") || text.starts_with("Robots:");
        (!text.is_empty() && !is_for_programs).then(|| Paragraph::new(&text))
    });
    paragraphs.collect()
}

impl Paragraph {
    fn new(paragraph: &str) -> Self {
        let translated = paragraph.split_once(':').and_then(|(kind, text)| {
            let (kind, language) = split_language(kind);
            Some((text.trim(), language.filter(|_| kind == "text")?.to_owned()))
        });
        match translated {
            Some((text, language)) => Paragraph { text: text.to_owned(), language: Some(language) },
            None => Paragraph { text: paragraph.to_owned(), language: None },
        }
    }
}

/// Reads the commands that a scenario proposes.
fn proposals(scenario: &str) -> Vec<Proposal> {
    let own = page_comments(scenario).filter(|comment| comment.kind == "try");
    let proposals = own.filter_map(|comment| {
        let (label, command) = label_and_command(comment.text)?;
        let language = comment.language.map(str::to_owned);
        Some(Proposal { label: label.to_owned(), command, language })
    });
    proposals.collect()
}

/// Reads `Robot 15 fails: fail = 15` as a label and a command. A text without a key is none.
pub fn label_and_command(text: &str) -> Option<(&str, String)> {
    let (before, _) = text.split_once('=')?;
    // The label ends with the last colon before the first key.
    let at = before.rfind(':').map_or(0, |colon| colon + 1);
    // French has a space before a colon.
    let (label, keys) = (before[..at].trim_end_matches(':').trim(), text[at..].trim());
    Some((if label.is_empty() { keys } else { label }, lines_of(keys)))
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
        let text = "# Day and night:\n# a start.\n#\n# led: 1 = day\n# led.fr: 1 = jour\n# More of it.\n#\n# Robots: kilobot\n#\n\
            # text.fr: Jour et nuit :\n# un début.\n#\n# bbz run light.bzz\n# prints\n#   led(1)\n\n# Not here.\n";
        let paragraph = |text: &str, language: Option<&str>| Paragraph {
            text: text.to_owned(),
            language: language.map(str::to_owned),
        };
        let expected = [
            paragraph("Day and night: a start.", None),
            paragraph("More of it.", None),
            paragraph("Jour et nuit : un début.", Some("fr")),
        ];
        assert_eq!(head(text), expected);
        assert_eq!(head("[world]\n# Later.\n"), Vec::<Paragraph>::new());
    }

    #[test]
    fn proposals_are_commands_with_labels() {
        let text = "# try: Carry it away: move = 1, to = [0, 360]\n[world]\n# try: fail = 3\n\
            # try: Say: it: call = \"say\", with = [\"a, b\", 'c']\n# try: nothing\n# retry: fail = 1\n\
            # try.fr: En panne : fail = 3\n";
        let proposal = |label: &str, command: &str| Proposal {
            label: label.to_owned(),
            command: command.to_owned(),
            language: None,
        };
        let french =
            Proposal { language: Some("fr".to_owned()), ..proposal("En panne", "fail = 3") };
        let expected = [
            proposal("Carry it away", "move = 1\nto = [0, 360]"),
            proposal("fail = 3", "fail = 3"),
            proposal("Say: it", "call = \"say\"\nwith = [\"a, b\", 'c']"),
            french,
        ];
        assert_eq!(proposals(text), expected);
    }
}
