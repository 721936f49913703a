//! The meanings of the LED's colors, which a script states in comments.
//!
//! ```text
//! # led: 1 = waiting
//! # led: 2 = in a group
//! ```

use serde::Serialize;

use crate::controls::ControlProblem;

/// The color of an LED and its meaning in a script.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct LedMeaning {
    /// The sum of 1 for red, 2 for green and 4 for blue, as `led()` takes it.
    pub color: u8,
    pub meaning: String,
}

const FORM: &str =
    "the meaning of a color is written as `# led: 2 = in a group`, with a color from 0 to 7";

/// Reads the meanings in a script. Of two meanings of one color, the later one is an error.
pub fn read(text: &str) -> Vec<Result<LedMeaning, ControlProblem>> {
    let mut known = [false; 8];
    let lines = text.lines().zip(1_u32..);
    let meanings = lines.filter_map(|(line, number)| {
        let comment = line.trim().strip_prefix('#')?.trim();
        let (kind, rest) = comment.split_once(':')?;
        (kind.trim() == "led").then(|| {
            let meaning = meaning(rest).ok_or_else(|| FORM.to_owned());
            let meaning = meaning.and_then(|one| {
                match std::mem::replace(&mut known[usize::from(one.color)], true) {
                    true => Err(format!("the color {} has a meaning already", one.color)),
                    false => Ok(one),
                }
            });
            meaning.map_err(|problem| ControlProblem { line: number, problem })
        })
    });
    meanings.collect()
}

/// Reads `2 = in a group`.
fn meaning(text: &str) -> Option<LedMeaning> {
    let (color, meaning) = text.split_once('=')?;
    let color = color.trim().parse().ok().filter(|color| *color <= 7)?;
    let meaning = meaning.trim();
    (!meaning.is_empty()).then(|| LedMeaning { color, meaning: meaning.to_owned() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn meanings_are_read_from_comments() {
        let text =
            "# Red = danger.\n# led: 1 = waiting\nled(1)  # led: no\n  #led:7=free = white\n";
        let meaning = |color, meaning: &str| Ok(LedMeaning { color, meaning: meaning.to_owned() });
        assert_eq!(read(text), [meaning(1, "waiting"), meaning(7, "free = white")]);
    }

    #[test]
    fn malformed_meanings_are_reported_with_their_line() {
        for (text, part) in [
            ("# led: red = waiting", "`# led: 2 = in a group`"),
            ("# led: 8 = waiting", "from 0 to 7"),
            ("# led: 1 =", "`# led: 2 = in a group`"),
            ("# led: 1", "`# led: 2 = in a group`"),
            ("# led: 2 = another", "the color 2 has a meaning already"),
        ] {
            let found = read(&format!("# led: 2 = one\n{text}\n"));
            let [Ok(_), Err(ControlProblem { line: 2, problem })] = &found[..] else {
                panic!("{text}: {found:?}");
            };
            assert!(problem.contains(part), "{text}: {problem}");
        }
    }
}
