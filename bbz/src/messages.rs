//! The costs of the messages of a script, as `bbz build` and `bbz sim` state them.

use bittybuzz_arena::scenario::{Group, MediaSettings};
use bittybuzz_compiler::messages::{Rate, SentMessage, link_seconds, seconds_text};
use bittybuzz_compiler::source::SourceMap;
use bittybuzz_robot_spec::{Medium, Robot};
use serde_json::{Value, json};

use crate::report::{counted, printable};

/// Returns a line per message: its place, its frames, and the time that the robot's link takes for
/// them.
pub fn lines(messages: &[SentMessage], sources: &SourceMap, robot: &Robot) -> Vec<String> {
    messages.iter().map(|message| line(message, sources, robot)).collect()
}

fn line(message: &SentMessage, sources: &SourceMap, robot: &Robot) -> String {
    let mut line = format!("  {}: ", name(message, sources));
    let Some(frames) = message.frames else {
        return line + "too long for a message, so this call stops the script";
    };
    line += &frames.text();
    if let Some(medium) = robot.link {
        let [least, most] =
            [frames.least, frames.most].map(|frames| seconds_text(link_seconds(medium, frames)));
        line += &match frames.least == frames.most {
            true => format!(", {most} of the {}'s air", robot.title),
            false => format!(", {least} to {most} of the {}'s air", robot.title),
        };
    }
    line + &message.rate.map_or(String::new(), |rate| format!(", {}", rate_text(rate)))
}

fn rate_text(Rate { period, is_certain }: Rate) -> String {
    let most = if is_certain { "" } else { "at most " };
    match period {
        1 => format!("{most}in every step"),
        _ => format!("{most}every {period} steps"),
    }
}

/// Returns place, kind and name of a message.
fn name(message: &SentMessage, sources: &SourceMap) -> String {
    let line = sources.line_column(message.span).line;
    let file = sources.path(message.span.file).display();
    let kind = if message.is_entry { "entry" } else { "broadcast" };
    let name = message.name.as_deref().unwrap_or("under a computed name");
    printable(&format!("{file}:{line} {kind} {name}"))
}

/// Returns the messages as JSON.
pub fn json(messages: &[SentMessage], sources: &SourceMap, robot: &Robot) -> Value {
    let object = |message: &SentMessage| {
        let frames = message.frames.map(|frames| [frames.least, frames.most]);
        let seconds = frames.zip(robot.link);
        json!({
            "file": sources.path(message.span.file).display().to_string(),
            "line": sources.line_column(message.span).line,
            "kind": if message.is_entry { "entry" } else { "broadcast" },
            "name": message.name,
            "frames": frames,
            "air_seconds": seconds.map(|(frames, medium)| {
                frames.map(|frames| link_seconds(medium, frames))
            }),
            "period_steps": message.rate.map(|rate| rate.period),
            "is_certain": message.rate.map(|rate| rate.is_certain),
        })
    };
    messages.iter().map(object).collect()
}

/// Returns a line per message of several frames that the robots of a group send, with the largest
/// share of the air that they take together if each of them receives all others.
pub fn of_group<'a>(
    messages: &'a [SentMessage],
    sources: &'a SourceMap,
    group: &'a Group,
    media: &'a MediaSettings,
) -> impl Iterator<Item = String> + 'a {
    let long = messages.iter().filter_map(|message| Some((message, message.frames?)));
    long.filter(|(_, frames)| frames.most > 1).map(|(message, frames)| {
        let medium = group.medium();
        let share = 100.0 * air_share(message.rate, frames.most, group, medium, media);
        format!(
            "message {}: {}; {} take at most {share:.0} % of the air",
            name(message, sources),
            frames.text(),
            counted(group.count, "robot")
        )
    })
}

fn air_share(
    rate: Option<Rate>,
    frames: u32,
    group: &Group,
    medium: Medium,
    media: &MediaSettings,
) -> f64 {
    // The link bounds the frames of a robot, whatever its script sends.
    let link = group.link.rate.or(media.settings(medium).rate);
    let link = link.unwrap_or(1e6 / f64::from(medium.frame_period_us()));
    let asked = rate.map_or(f64::INFINITY, |rate| {
        f64::from(frames) * f64::from(group.robot.tick_hz) / f64::from(rate.period)
    });
    f64::from(group.count) * asked.min(link) * f64::from(medium.air_time_us()) / 1e6
}
