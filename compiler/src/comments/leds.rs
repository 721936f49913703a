//! The meanings of the LED's colors, which a script states in comments.
//!
//! ```text
//! # led: 1 = waiting
//! # led: 2 = in a group
//! # led.fr: 2 = dans un groupe
//! ```

use std::collections::BTreeSet;

use super::{CommentProblem, language_problem, page_comments};

/// The color of an LED and its meaning in a script.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LedMeaning {
    /// The sum of 1 for red, 2 for green and 4 for blue, as `led()` takes it.
    pub color: u8,
    pub meaning: String,
    /// The code of the language, such as `fr`; `None` is the language of the script.
    pub language: Option<String>,
}

const FORM: &str = "write `# led: 2 = in a group`, with a color from 0 to 7";

/// Reads the meanings in a script. Of two meanings of one color in one language, the
/// later one is an error.
pub fn read(text: &str) -> Vec<Result<LedMeaning, CommentProblem>> {
    let mut known = BTreeSet::new();
    let meanings = page_comments(text).filter(|comment| comment.kind == "led").map(|comment| {
        let (line, language) = (comment.line, comment.language);
        let form = "this is no meaning of an LED color";
        if let Some(help) = language_problem("led", language) {
            return Err(CommentProblem::new(line, form, help));
        }
        let meaning =
            meaning(comment.text, language).ok_or_else(|| CommentProblem::new(line, form, FORM))?;
        match known.insert((language, meaning.color)) {
            true => Ok(meaning),
            false => Err(CommentProblem::new(
                line,
                format!("the color {} has a meaning already", meaning.color),
                "leave one of the two comments out, or correct its color",
            )),
        }
    });
    meanings.collect()
}

/// Reads `2 = in a group`.
fn meaning(text: &str, language: Option<&str>) -> Option<LedMeaning> {
    let (color, meaning) = text.split_once('=')?;
    let color = color.trim().parse().ok().filter(|color| *color <= 7)?;
    let meaning = meaning.trim();
    let language = language.map(str::to_owned);
    (!meaning.is_empty()).then(|| LedMeaning { color, meaning: meaning.to_owned(), language })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn meanings_are_read_from_comments() {
        let text = "# Red = danger.\n# led: 1 = waiting\nled(1)  # led: no\n  #led:7=free = white\n# led.fr: 1 = attend\n";
        let meaning = |color, meaning: &str, language: Option<&str>| {
            let language = language.map(str::to_owned);
            Ok(LedMeaning { color, meaning: meaning.to_owned(), language })
        };
        let expected = [
            meaning(1, "waiting", None),
            meaning(7, "free = white", None),
            meaning(1, "attend", Some("fr")),
        ];
        assert_eq!(read(text), expected);
    }

    #[test]
    fn malformed_meanings_are_reported_with_their_line() {
        for (text, part) in [
            ("# led: red = waiting", "`# led: 2 = in a group`"),
            ("# led: 8 = waiting", "from 0 to 7"),
            ("# led: 1 =", "`# led: 2 = in a group`"),
            ("# led: 1", "`# led: 2 = in a group`"),
            ("# led.fr: deux = dans un groupe", "`# led: 2 = in a group`"),
            ("# led.: 1 = attend", "`# led.fr: …`"),
            ("# led.french: 1 = attend", "`# led.fr: …`"),
            ("# led: 2 = another", "leave one of the two"),
        ] {
            let found = read(&format!("# led: 2 = one\n{text}\n"));
            let [Ok(_), Err(CommentProblem { line: 1, help, .. })] = &found[..] else {
                panic!("{text}: {found:?}");
            };
            assert!(help.contains(part), "{text}: {help}");
        }
    }
}
