//! Experiments of ARGoS, results that are handed in, and traces.

use std::path::Path;

use bittybuzz_live::HandIn;

use super::{CONSTANT, LIMITS, Limits};
use crate::import;
use crate::trace;

#[test]
fn experiments_of_any_shape() {
    let read = |text: &str| import::read_text(text, Path::new("e.argos"));
    // The document has a node of 100 bytes for an element of four bytes.
    let limits = Limits { per_byte: 128, constant: 2 * CONSTANT };
    let check = |shape: &str, size, make: &dyn Fn(usize) -> String| {
        limits.check(shape, size, make, read);
    };
    check("nested elements", 1000, &|n| "<a>".repeat(n) + &"</a>".repeat(n));
    check("elements", 5000, &|n| format!("<a>{}</a>", "<b/>".repeat(n)));
    check("attributes", 500, &|n| {
        format!("<a {}/>", (0..n).map(|i| format!("a{i}=\"\" ")).collect::<String>())
    });
    check("a long text", 50_000, &|n| format!("<a>{}</a>", "x".repeat(n)));
    check("entities", 10_000, &|n| format!("<a>{}</a>", "&lt;".repeat(n)));
    check("an open tag", 50_000, &|n| "<".repeat(n));
    let arena = |inside: String| {
        format!(
            "<argos-configuration><framework><experiment length=\"1\" ticks_per_second=\"10\" \
             random_seed=\"1\"/></framework><controllers><buzz_controller id=\"c\"><params \
             bytecode_file=\"a.bo\"/></buzz_controller></controllers>\
             <arena size=\"100,100,1\" center=\"0,0,0\">{inside}</arena></argos-configuration>"
        )
    };
    check("boxes", 300, &|n| {
        let one = |i: usize| {
            format!(
                "<box id=\"b{i}\" size=\"0.1,0.1,0.1\" movable=\"false\"><body position=\"{},{},0\" \
                 orientation=\"0,0,0\"/></box>",
                i % 40,
                i / 40
            )
        };
        arena((0..n).map(one).collect())
    });
    check("robots", 300, &|n| {
        let one = |i: usize| {
            format!(
                "<foot-bot id=\"fb{i}\"><body position=\"{},{},0\" orientation=\"0,0,0\"/>\
                 <controller config=\"c\"/></foot-bot>",
                i % 40,
                i / 40
            )
        };
        arena((0..n).map(one).collect())
    });
    check("unknown entities", 500, &|n| {
        arena((0..n).map(|i| format!("<thing id=\"t{i}\"/>")).collect())
    });
}

#[test]
fn results_of_any_shape() {
    let read = |text: &str| drop(HandIn::read(text));
    let scripts = |n| {
        let script = "{\"name\":\"a\",\"sha256\":\"\",\"text\":\"\"},".repeat(n);
        format!("{{\"scripts\":[{}]}}", script.trim_end_matches(','))
    };
    LIMITS.check("scripts", 2000, scripts, read);
    LIMITS.check("nested lists", 20_000, |n| "[".repeat(n), read);
    LIMITS.check("nested objects", 10_000, |n| "{\"a\":".repeat(n), read);
    LIMITS.check("a long string", 50_000, |n| format!("{{\"by\":\"{}\"}}", "\\n".repeat(n)), read);
    LIMITS.check("equal keys", 5000, |n| format!("{{{}}}", "\"x\":[1],".repeat(n)), read);
}

#[test]
fn traces_of_any_shape() {
    let read = |text: &str| text.lines().for_each(|line| drop(trace::parse_line(line)));
    LIMITS.check("lines", 5000, |n| "1.0 INFO x\n".repeat(n), read);
    LIMITS.check("a long line", 100_000, |n| "x".repeat(n), read);
    LIMITS.check("escapes", 20_000, |n| "\u{1b}[1m".repeat(n), read);
    LIMITS.check("blanks", 100_000, |n| " ".repeat(n), read);
    LIMITS.check("brackets", 100_000, |n| "[".repeat(n), read);
}
