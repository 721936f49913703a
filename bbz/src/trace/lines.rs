//! Reads messages from lines of text, in the formats of programs that decode defmt.

use anstream::adapter::strip_str;

use bittybuzz_comms::infrared::{self, FaultReport};

use super::message::{Level, PrintedMessage, TraceContent};

/// The format that probe-rs is asked for: time, level, text.
pub const FORMAT: &str = "{t} {L} {s}";

/// Parses a line: a message that a listening Kilobot received
/// (`firmware/kilobot-avr/src/bin/ear.rs`), or a text after its time and level, if it has them.
/// Also accepts the default format of probe-rs and defmt-print, `0.002 [INFO ] text (crate
/// file:line)`, and lines of other programs in between. `<time>` and `<lvl>` stand for a missing
/// time or level.
pub fn parse(line: &str) -> PrintedMessage {
    let line = strip_str(line).to_string();
    let line = line.trim_end();
    // A Kilobot that listens reports all messages that it receives, few of which matter to people.
    if let Some(message) = infrared::from_line(line.as_bytes()) {
        let content = match FaultReport::of(&message) {
            Some(report) => TraceContent::Report(report),
            None => TraceContent::Received,
        };
        return PrintedMessage { time: None, content };
    }
    let (time, rest) = match line.trim_start().split_once(' ') {
        Some((first, rest)) if first.parse::<f64>().is_ok() => (first.parse().ok(), rest),
        Some(("<time>", rest)) => (None, rest),
        _ => (None, line),
    };
    let (level, text) = match level(rest) {
        Some((level, text)) => (Some(level), text),
        None => (None, rest.strip_prefix("<lvl>").map_or(rest, str::trim_start)),
    };
    PrintedMessage { time, content: TraceContent::from_text(level, text) }
}

/// Splits a level, perhaps in brackets, from the text after it.
fn level(text: &str) -> Option<(Level, &str)> {
    let text = text.trim_start();
    let (text, bracket) = match text.strip_prefix('[') {
        Some(text) => (text, true),
        None => (text, false),
    };
    let found = |level: &Level| Some((*level, text.strip_prefix(level.name())?));
    let (level, rest) = Level::ALL.iter().find_map(found)?;
    let rest = rest.trim_start_matches(' ');
    let rest = if bracket { rest.strip_prefix(']')? } else { rest };
    Some((level, rest.trim_start()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn firmware(level: Level, text: &str) -> TraceContent {
        TraceContent::Firmware { level: Some(level), text: text.to_owned() }
    }

    #[test]
    fn formats_of_probe_rs() {
        // The format asked for; defmt-decoder pads the level.
        let message = parse("0.000123 INFO  boot");
        assert_eq!(message.time, Some(0.000_123));
        assert_eq!(message.content, firmware(Level::Info, "boot"));
        // The default: level in bold brackets, place dimmed.
        let message = parse(
            "1.5 \x1b[1m[WARN ]\x1b[0m slow \x1b[2m(\x1b[1mcrazyflie\x1b[0m src/main.rs:7)\x1b[0m",
        );
        assert_eq!(message.time, Some(1.5));
        assert_eq!(message.content, firmware(Level::Warn, "slow (crazyflie src/main.rs:7)"));
        // A message without a level; a firmware without a clock.
        let message = parse("2.0 <lvl> hello");
        let text = "hello".to_owned();
        assert_eq!(message.content, TraceContent::Firmware { level: None, text });
        assert_eq!(parse("<time> DEBUG x").content, firmware(Level::Debug, "x"));
        assert_eq!(parse("[ERROR] panic").content, firmware(Level::Error, "panic"));
    }

    #[test]
    fn frames_that_a_listening_kilobot_prints() {
        let fault = FaultReport { robot: 3, script: 0x1234, fault: None, is_contained: false };
        let line = |message: [u8; infrared::MESSAGE]| {
            let digits: String = message.iter().map(|byte| format!("{byte:02x}")).collect();
            format!("ir {digits}\r")
        };
        assert_eq!(parse(&line(fault.message())).content, TraceContent::Report(fault));
        assert_eq!(parse(&line(infrared::sealed(8, &[0; 9]))).content, TraceContent::Received);
        assert!(matches!(parse("ir 12").content, TraceContent::Firmware { .. }));
    }

    #[test]
    fn records_in_every_format() {
        let record = TraceContent::Record(vec![6, 1, 0, 0, 255]);
        for line in [
            "0.1 INFO  bbz [6, 1, 0, 0, 255]",
            "0.1 [INFO ] bbz [6, 1, 0, 0, 255] (crazyflie src/trace.rs:31)",
            "bbz [6,1,0,0,255]\r",
        ] {
            assert_eq!(parse(line).content, record, "{line}");
        }
        assert_eq!(parse("bbz []").content, TraceContent::Record(vec![]));
    }

    #[test]
    fn damaged_records_differ_from_other_text() {
        for line in ["bbz [1, 2", "bbz [1, 256]", "bbz [1, x]", "bbz [-1]"] {
            assert!(matches!(parse(line).content, TraceContent::Damaged(_)), "{line}");
        }
        for line in ["", "bbz", "a bbz [1]", "Finished in 1.2s", "   ", "1.5", "INFO", "["] {
            assert!(matches!(parse(line).content, TraceContent::Firmware { .. }), "{line}");
        }
    }
}
