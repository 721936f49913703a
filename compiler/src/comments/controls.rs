//! Controls that a script requests in comments: sliders, switches and buttons that set its globals.
//!
//! ```text
//! # slider: JOIN 1..50 step 1
//! # switch: ALARM
//! # button: GO
//! ```
//! Numbers with a point are floats. A switch sets 0 or 1, a button 1.

use super::{CommentProblem, page_comments};

/// A control.
#[derive(Debug, Clone, PartialEq)]
pub struct Control {
    /// The name of the global.
    pub name: String,
    pub form: ControlForm,
    /// The number that the script assigns to the global, if it is a literal.
    pub value: Option<f64>,
}

/// The numbers that a control sets.
#[derive(Debug, Clone, PartialEq)]
pub enum ControlForm {
    /// Sets a number of a range.
    Slider {
        least: f64,
        most: f64,
        step: f64,
        /// True if the global gets floats.
        is_float: bool,
    },
    /// Sets 0 or 1.
    Switch,
    /// Sets 1.
    Button,
}

const SLIDER: &str = "write `# slider: NAME 1..50 step 1`";

/// Reads the controls of a script.
pub fn read(text: &str) -> Vec<Result<Control, CommentProblem>> {
    let controls = page_comments(text).filter_map(|comment| {
        // A global has no language.
        let (kind, rest) = (comment.kind, comment.text);
        let (kind, rest) = comment.language.map_or((kind, rest), |_| (kind, ""));
        let control = match kind {
            "slider" => slider(rest),
            "switch" => named(kind, rest, ControlForm::Switch),
            "button" => named(kind, rest, ControlForm::Button),
            _ => return None,
        };
        let problem = |help| {
            CommentProblem::new(comment.line, format!("this is no {kind} of the page"), help)
        };
        let control = control.map(|(name, form)| {
            let value = start(text, name);
            Control { name: name.to_owned(), form, value }
        });
        Some(control.map_err(problem))
    });
    controls.collect()
}

/// Reads `NAME` of a switch or a button.
fn named<'a>(
    kind: &str,
    text: &'a str,
    form: ControlForm,
) -> Result<(&'a str, ControlForm), String> {
    let name = name_of(text).ok_or_else(|| format!("write `# {kind}: NAME`"))?;
    Ok((name, form))
}

/// Reads `NAME 1..50 step 1`. The default step is 1, or a hundredth of the range if one
/// of its ends is a float.
fn slider(text: &str) -> Result<(&str, ControlForm), String> {
    let words: Vec<&str> = text.split_whitespace().collect();
    let (name, range, step) = match words[..] {
        [name, range] => (name, range, None),
        [name, range, "step", step] => (name, range, Some(step)),
        _ => return Err(SLIDER.to_owned()),
    };
    let name = name_of(name).ok_or(SLIDER)?;
    let (least, most) = range.split_once("..").ok_or(SLIDER)?;
    let is_float =
        [Some(least), Some(most), step].into_iter().flatten().any(|one| one.contains('.'));
    let number = |text: &str| text.parse().ok().filter(|number: &f64| number.is_finite());
    let (Some(least), Some(most)) = (number(least), number(most)) else {
        return Err(SLIDER.to_owned());
    };
    let step = match step {
        Some(step) => number(step).ok_or(SLIDER)?,
        None if is_float => (most - least) / 100.0,
        None => 1.0,
    };
    if least >= most || step <= 0.0 || step > most - least {
        return Err(
            "write a slider from a smaller to a larger number, by steps that fit between them"
                .to_owned(),
        );
    }
    Ok((name, ControlForm::Slider { least, most, step, is_float }))
}

fn name_of(text: &str) -> Option<&str> {
    let is_letter = |letter: char| letter == '_' || letter.is_ascii_alphanumeric();
    let is_name =
        text.starts_with(|first: char| !first.is_ascii_digit()) && text.chars().all(is_letter);
    is_name.then_some(text)
}

/// Returns the number of the first line `NAME = number`.
fn start(text: &str, name: &str) -> Option<f64> {
    text.lines().find_map(|line| {
        let line = line.split('#').next()?;
        let (before, number) = line.split_once('=')?;
        let before = before.trim();
        let before = before.strip_prefix("var ").unwrap_or(before).trim();
        (before == name).then(|| number.trim().trim_end_matches(';').parse().ok())?
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn controls_are_read_from_comments() {
        let text = "# slider: JOIN 1..50 step 1\nJOIN = 20 # the threshold\n  #slider:GAIN -1.5..2 \nGAIN = 0.5;\n\
            # switch: ALARM\n# button: GO\n# Notes: no control.\nfunction step() { JOIN = 3 }\n";
        let control = |name: &str, form, value| Ok(Control { name: name.to_owned(), form, value });
        let slider =
            |least, most, step, is_float| ControlForm::Slider { least, most, step, is_float };
        let controls = [
            control("JOIN", slider(1.0, 50.0, 1.0, false), Some(20.0)),
            control("GAIN", slider(-1.5, 2.0, 0.035, true), Some(0.5)),
            control("ALARM", ControlForm::Switch, None),
            control("GO", ControlForm::Button, None),
        ];
        assert_eq!(read(text), controls);
    }

    #[test]
    fn malformed_controls_are_reported_with_their_line() {
        for (text, part) in [
            ("# slider: JOIN", "`# slider: NAME 1..50 step 1`"),
            ("# slider: JOIN 1-50", "`# slider: NAME 1..50 step 1`"),
            ("# slider: 2JOIN 1..50", "`# slider: NAME 1..50 step 1`"),
            ("# slider: JOIN 1..50 steps 1", "`# slider: NAME 1..50 step 1`"),
            ("# slider: JOIN 1..x", "`# slider: NAME 1..50 step 1`"),
            ("# slider: JOIN 1..inf", "`# slider: NAME 1..50 step 1`"),
            ("# slider: JOIN 50..1", "from a smaller to a larger"),
            ("# slider: JOIN 1..2 step 0", "by steps that fit"),
            ("# slider: JOIN 1..2 step 5", "by steps that fit"),
            ("# switch: two words", "`# switch: NAME`"),
            ("# button:", "`# button: NAME`"),
            ("# button.fr: GO", "`# button: NAME`"),
        ] {
            let found = read(&format!("x = 1\n{text}\n"));
            let [Err(CommentProblem { line: 1, help, .. })] = &found[..] else {
                panic!("{text}: {found:?}");
            };
            assert!(help.contains(part), "{text}: {help}");
        }
    }
}
