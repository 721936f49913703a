//! Experiments of ARGoS, results that are handed in, and traces.

use std::path::Path;

use bittybuzz_live::{Assignment, HandIn, SharedFiles, Shelf, TextFile};

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

/// Scripts of an assignment that are compiled. Each is a text in the file of the hand-in, in the
/// hand-in, among the files of the assignment and in the messages about it.
#[test]
fn scripts_of_an_assignment() {
    let files = SharedFiles::default();
    let scenario = "[world]\nsize = [1000, 1000]\nduration = 1\n\n[[robots]]\nrobot = \"kilobot\"\n\
                    script = \"a.bzz\"\ncount = 2\n";
    files.add("a.bzz", "function step() { }\n");
    files.add("s.toml", scenario);
    let shelf = Shelf::new(files, "s.toml".into());
    let assignment = Assignment::new(&shelf, scenario).unwrap();
    let hand_in = |scripts: Vec<(String, String)>| {
        let scripts = scripts.into_iter().map(|(name, text)| TextFile::new(name, text)).collect();
        let scenario = TextFile::new("s.toml".to_owned(), scenario.to_owned());
        let (by, title) = ("Ada".to_owned(), "Count".to_owned());
        serde_json::to_string(&HandIn::new(by, title, scenario, scripts)).unwrap()
    };
    let limits = Limits { per_byte: 256, constant: 2 * CONSTANT };
    let check = |shape: &str, size, make: &dyn Fn(usize) -> Vec<(String, String)>| {
        limits.check(
            shape,
            size,
            |n| hand_in(make(n)),
            |text: &str| drop(assignment.prepare(text)),
        );
    };
    let script = |text: String| vec![("a.bzz".to_owned(), text)];
    check("statements", 500, &|n| script("x = 1\n".repeat(n)));
    check("mistakes", 500, &|n| script((0..n).map(|i| format!("u{i}()\n")).collect()));
    check("bytes that are no tokens", 20_000, &|n| script("$".repeat(n)));
    check("includes", 300, &|n| script("include \"b.bzz\"\n".repeat(n)));
    check("scripts", 300, &|n| (0..n).map(|i| (format!("{i}.bzz"), String::new())).collect());
    check("a long name", 20_000, &|n| vec![("x".repeat(n), String::new())]);
    check("a deep name", 10_000, &|n| vec![("x/".repeat(n), String::new())]);
    check("a name with ways back", 10_000, &|n| vec![("../".repeat(n), String::new())]);
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
