//! Controls that a script requests in comments: sliders, switches and buttons that set its globals.
//!
//! ```text
//! # slider: JOIN 1..50 step 1
//! # switch: ALARM
//! # button: GO
//! ```
//! Numbers with a point are floats. A switch sets 0 or 1, a button 1.

use serde::Serialize;

/// A control. In JSON, the key `kind` has the name of the variant.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Control {
    Slider(Slider),
    Switch(Switch),
    Button(Button),
}

#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Slider {
    /// The name of the global.
    pub name: String,
    pub least: f64,
    pub most: f64,
    pub step: f64,
    /// True if the global gets floats.
    pub is_float: bool,
    /// The number that the script assigns to the global, if it is a literal.
    pub value: Option<f64>,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Switch {
    /// The name of the global.
    pub name: String,
    /// The number that the script assigns to the global, if it is a literal.
    pub value: Option<f64>,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Button {
    /// The name of the global.
    pub name: String,
    /// The number that the script assigns to the global, if it is a literal.
    pub value: Option<f64>,
}

impl Control {
    /// Returns the name of the global.
    pub fn name(&self) -> &str {
        match self {
            Control::Slider(Slider { name, .. })
            | Control::Switch(Switch { name, .. })
            | Control::Button(Button { name, .. }) => name,
        }
    }
}

/// A comment that was meant as a control.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct ControlProblem {
    pub line: u32,
    pub problem: String,
}

const SLIDER: &str = "a slider is written as `# slider: NAME 1..50 step 1`";

/// Reads the controls of a script.
pub fn read(text: &str) -> Vec<Result<Control, ControlProblem>> {
    let lines = text.lines().zip(1_u32..);
    let controls = lines.filter_map(|(line, number)| {
        let comment = line.trim().strip_prefix('#')?.trim();
        let (kind, rest) = comment.split_once(':')?;
        let (kind, rest) = (kind.trim(), rest.trim());
        let name = || {
            let name =
                name_of(rest).ok_or_else(|| format!("a {kind} is written as `# {kind}: NAME`"))?;
            Ok((name.to_owned(), start(text, name)))
        };
        let control = match kind {
            "slider" => slider(text, rest).map(Control::Slider),
            "switch" => name().map(|(name, value)| Control::Switch(Switch { name, value })),
            "button" => name().map(|(name, value)| Control::Button(Button { name, value })),
            _ => return None,
        };
        Some(control.map_err(|problem| ControlProblem { line: number, problem }))
    });
    controls.collect()
}

/// Reads `NAME 1..50 step 1` in a script. The default step is 1, or a hundredth of the range if one
/// of its ends is a float.
fn slider(script: &str, text: &str) -> Result<Slider, String> {
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
            "a slider leads from a smaller to a larger number, by steps that fit between them"
                .to_owned(),
        );
    }
    Ok(Slider { name: name.to_owned(), least, most, step, is_float, value: start(script, name) })
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
        let slider = Slider {
            name: "JOIN".to_owned(),
            least: 1.0,
            most: 50.0,
            step: 1.0,
            is_float: false,
            value: Some(20.0),
        };
        let gain = Slider {
            name: "GAIN".to_owned(),
            least: -1.5,
            most: 2.0,
            step: 0.035,
            is_float: true,
            value: Some(0.5),
        };
        let switch = Switch { name: "ALARM".to_owned(), value: None };
        let button = Button { name: "GO".to_owned(), value: None };
        let controls = [
            Control::Slider(slider),
            Control::Slider(gain),
            Control::Switch(switch),
            Control::Button(button),
        ];
        assert_eq!(read(text), controls.map(Ok));
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
        ] {
            let found = read(&format!("x = 1\n{text}\n"));
            let [Err(ControlProblem { line: 2, problem })] = &found[..] else {
                panic!("{text}: {found:?}");
            };
            assert!(problem.contains(part), "{text}: {problem}");
        }
    }
}
