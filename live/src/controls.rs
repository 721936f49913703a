//! Controls that a script requests in comments: sliders, switches and buttons that set its globals.
//!
//! ```text
//! # slider: JOIN 1..50 step 1
//! # switch: ALARM
//! # button: GO
//! ```
//! Numbers with a point are floats. A switch sets 0 or 1, a button 1.

use serde_json::{Value, json};

/// The kinds of controls, as written before the colon.
const KINDS: [&str; 3] = ["slider", "switch", "button"];

const SLIDER: &str = "a slider is written as `# slider: NAME 1..50 step 1`";

/// Describes the controls of a script. Each is an object with `kind` and `name`, for a slider also
/// with `least`, `most`, `step` and `is_float`. `value` is the number that the script assigns to
/// the global, if it is a literal. A malformed control has `line` and `problem` instead.
pub fn describe(text: &str) -> Vec<Value> {
    let lines = text.lines().zip(1_u32..);
    let described = lines.filter_map(|(line, number)| {
        let comment = line.trim().strip_prefix('#')?.trim();
        let (kind, rest) = comment.split_once(':')?;
        let kind = KINDS.into_iter().find(|known| *known == kind.trim())?;
        let described = match kind {
            "slider" => slider(rest.trim()),
            _ => name_of(rest.trim())
                .map(|name| json!({ "kind": kind, "name": name }))
                .ok_or_else(|| format!("a {kind} is written as `# {kind}: NAME`")),
        };
        Some(match described {
            Ok(mut control) => {
                control["value"] =
                    json!(control["name"].as_str().and_then(|name| start(text, name)));
                control
            }
            Err(problem) => json!({ "line": number, "problem": problem }),
        })
    });
    described.collect()
}

/// Reads `NAME 1..50 step 1`. The default step is 1, or a hundredth of the range if one of its ends
/// is a float.
fn slider(text: &str) -> Result<Value, String> {
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
    Ok(json!({
        "kind": "slider", "name": name, "least": least, "most": most, "step": step, "is_float": is_float,
    }))
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
        let slider = json!({
            "kind": "slider", "name": "JOIN", "least": 1.0, "most": 50.0, "step": 1.0, "is_float": false, "value": 20.0,
        });
        let gain = json!({
            "kind": "slider", "name": "GAIN", "least": -1.5, "most": 2.0, "step": 0.035, "is_float": true, "value": 0.5,
        });
        let switch = json!({ "kind": "switch", "name": "ALARM", "value": null });
        let button = json!({ "kind": "button", "name": "GO", "value": null });
        assert_eq!(describe(text), [slider, gain, switch, button]);
    }

    #[test]
    fn comments_that_are_meant_as_controls_are_problems() {
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
            let found = describe(&format!("x = 1\n{text}\n"));
            assert_eq!(found.len(), 1, "{text}");
            assert_eq!(found[0]["line"], 2, "{text}");
            assert!(
                found[0]["problem"].as_str().unwrap_or_default().contains(part),
                "{text}: {found:?}"
            );
        }
    }
}
