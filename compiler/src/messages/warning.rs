//! The warning about messages of several frames in steps.

use bittybuzz_robot_spec::{Medium, Robot};

use crate::codes::DiagnosticCode;
use crate::diagnostic::Diagnostic;
use crate::messages::{Rate, SentMessage, link_seconds, seconds_text};

/// Returns the share of a robot's air and the warning for a message of several frames that steps
/// send at a fixed rate. A message that is sent now and then gets a warning only if the link cannot
/// carry it.
pub fn long_in_step(
    message: &SentMessage,
    robot: &Robot,
    medium: Medium,
) -> Option<(f64, Diagnostic)> {
    let frames = message.frames.filter(|frames| frames.least > 1)?;
    let Rate { period, .. } = message.rate.filter(|rate| rate.is_certain)?;
    let seconds = link_seconds(medium, frames.least);
    let share = seconds * f64::from(robot.tick_hz) / f64::from(period);
    if period > 1 && share <= 1.0 {
        return None;
    }
    let steps = match period {
        1 => "every step sends".to_owned(),
        _ => format!("a message every {period} steps:"),
    };
    let least = if frames.least == frames.most { "" } else { "at least " };
    let time = seconds_text(seconds);
    let text = match period {
        1 => format!(
            "{steps} a message of {}: {least}{time} of the {}'s air",
            frames.text(),
            robot.title
        ),
        _ => format!("{steps} {} take {least}{time} of the {}'s air", frames.text(), robot.title),
    };
    // The fewest steps from one message to the next for which the link has time.
    let slow = (seconds * f64::from(robot.tick_hz)).ceil().max(f64::from(robot.tick_hz));
    let unit = if message.is_entry { "key" } else { "topic" };
    let diagnostic = Diagnostic::new(DiagnosticCode::LongInStep, message.span, text)
        .label(frames.text())
        .help(format!(
            "send it more seldom, such as every {slow} steps: `if(ticks % {slow} == 0)`; or send \
             numbers, each under a {unit} of its own: a number takes one frame"
        ));
    Some((share, diagnostic))
}
