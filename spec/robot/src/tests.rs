//! Every cause of an error, with its line and column.

mod simulated;
mod values;

use super::*;
use std::collections::HashMap;

/// A correct file, in which each case below spoils one place.
const GOOD: &str = r#"name = "toy"
title = "Toy robot"
chip = "STM32F051C8"
profile = "tiny"
tick_hz = 10
message_bytes = 9

[vm]
memory = 2027
slots = 200
neighbors = 15
in_queue = 10
out_queue = 10
stigmergy_entries = 4
swarms = 8

[budget]
flash_bytes = 65536
ram_bytes = 8192

[layout]
application = { address = 0x0800_0000, size = 0xc000 }
script = { address = 0x0800_c000, size = 0x4000 }
ram = { address = 0x2000_0000, size = 0x2000 }
stack = { address = 0x1000_0000, size = 0x200 }

[[table]]
name = "pos"
fields = "x: number, y: number"
help = "where it is, in mm"

[[function]]
name = "led"
accepts = ["color: int", "color: int, on: int"]
help = "lights up"

[[function]]
name = "goto"
accepts = ["x: number, y: number"]
returns = "int"
waits = true
help = "drives there"
"#;

/// Name of the cause (as `Debug` prints it), line, column, and a part of the whole message.
struct Expected(&'static str, usize, usize, &'static str);

/// Spoils a correct file in one place: the first occurrence of `from` becomes `to`.
fn spoiled(right: &str, from: &str, to: &str) -> String {
    assert!(right.contains(from), "{from}");
    right.replacen(from, to, 1)
}

/// Spoils a correct file by each case, and compares the error.
fn expect_errors(right: &str, cases: &[(&str, &str, Expected)]) {
    for (from, to, Expected(cause, line, column, part)) in cases {
        let error = error_of(&spoiled(right, from, to));
        let kind = format!("{:?}", error.cause);
        let kind = kind.strip_prefix("Toml(").unwrap_or(&kind);
        let message = RobotErrors(vec![error]).to_string();
        assert!(kind.starts_with(cause), "{to}: {kind}\n{message}");
        assert!(message.starts_with(&format!("toy.toml:{line}:{column}: ")), "{to}:\n{message}");
        assert!(message.contains(part), "{to}: wanted {part}\n{message}");
    }
}

/// The lines of mistakes, in the order of the report.
fn lines_of(errors: &RobotErrors) -> Vec<usize> {
    errors.0.iter().filter_map(|error| Some(error.place.as_ref()?.line)).collect()
}

fn errors_of(text: &str) -> RobotErrors {
    match Robot::parse(text, "toy.toml") {
        Ok(_) => panic!("accepted:\n{text}"),
        Err(errors) => errors,
    }
}

/// The error of a file with one mistake.
fn error_of(text: &str) -> RobotError {
    let errors = errors_of(text);
    match errors.0.as_slice() {
        [only] => only.clone(),
        _ => panic!("{errors}\nin\n{text}"),
    }
}

#[test]
fn a_correct_file_is_read_completely() {
    let toy = Robot::parse(GOOD, "toy.toml").unwrap();
    assert_eq!((toy.name.as_str(), toy.title.as_str()), ("toy", "Toy robot"));
    assert_eq!(toy.chip.as_deref(), Some("STM32F051C8"));
    assert_eq!((toy.profile, toy.tick_hz, toy.message_bytes), (NumberProfile::Tiny, 10, 9));
    assert_eq!(toy.on_fault, OnFault::Restart);
    let vm = VmSizes {
        memory: 2027,
        slots: 200,
        neighbors: 15,
        bearings: true,
        in_queue: 10,
        out_queue: 10,
        in_long: 1,
        out_long: 1,
        stigmergy_entries: 4,
        swarms: 8,
        beacon_steps: 10,
        forget_steps: 30,
        advertise_steps: 20,
        maths: true,
    };
    assert_eq!(toy.vm, vm);
    assert_eq!(toy.budget, Some(Budget { flash_bytes: 65536, ram_bytes: 8192 }));
    let layout = Layout {
        application: Region { address: 0x0800_0000, size: 0xc000 },
        script: Region { address: 0x0800_c000, size: 0x4000 },
        script_log: false,
        script_sealed: false,
        ram: Region { address: 0x2000_0000, size: 0x2000 },
        stack: Some(Region { address: 0x1000_0000, size: 0x200 }),
        id: None,
        settings: None,
    };
    assert_eq!(toy.layout, Some(layout));
    let led = toy.function("led").unwrap();
    assert_eq!((led.returns, led.waits), (None, false));
    assert_eq!(led.accepts.len(), 2);
    let counts = [0, 1, 2].map(|count| led.accepts.iter().any(|list| takes_count(list, count)));
    assert_eq!(counts, [false, true, true]);
    assert_eq!(
        led.accepts[1][1],
        Parameter {
            name: "on".to_owned(),
            kind: SignatureType::Int,
            range: None,
            is_repeated: false
        }
    );
    let goto = toy.function("goto").unwrap();
    assert_eq!((goto.returns, goto.waits), (Some(SignatureType::Int), true));
    assert_eq!(goto.accepts[0][0].kind, SignatureType::Number);
    assert_eq!(toy.table("pos").unwrap().fields[1].to_string(), "y: number");
    assert!(toy.function("Led").is_none() && toy.table("led").is_none());
}

#[test]
fn optional_keys_have_defaults() {
    for (from, to) in [
        ("chip = \"STM32F051C8\"\n", ""),
        ("[budget]\nflash_bytes = 65536\nram_bytes = 8192\n", ""),
        ("stack = { address = 0x1000_0000, size = 0x200 }\n", ""),
        ("neighbors = 15", "neighbors = 0"),
        ("stigmergy_entries = 4", "stigmergy_entries = 0"),
        ("swarms = 8", "swarms = 0"),
        ("slots = 200", "slots = 0xc8"),
        ("slots = 200", "slots = 32"),
        ("swarms = 8", "swarms = 8\nmaths = false"),
        ("slots = 200", "slots = 204"),
        ("size = 0x4000 }", "size = 0x4000 }\nscript_sealed = true"),
    ] {
        assert!(GOOD.contains(from));
        assert!(Robot::parse(&GOOD.replacen(from, to, 1), "toy.toml").is_ok(), "{to}");
    }
    let (bare, _) = GOOD.split_once("[[table]]").unwrap();
    let bare = Robot::parse(bare, "toy.toml").unwrap();
    assert!(bare.functions.is_empty() && bare.tables.is_empty());
}

/// A robot without a chip has the memory of a computer. Its file may state some sizes, and all of
/// them with `memory`.
#[test]
fn a_robot_without_a_chip_has_the_memory_of_a_computer() {
    let vm = |text: &str| Robot::parse(&format!("name = \"toy\"\n{text}"), "toy.toml").unwrap().vm;
    let all = vm("");
    let sizes = [all.slots, all.neighbors, all.in_queue, all.out_queue, all.in_long, all.out_long];
    assert_eq!(sizes, [10_000, 255, 64, 64, 16, 16]);
    assert_eq!((all.stigmergy_entries, all.swarms), (4000, 8));
    let some = vm("[vm]\nslots = 65520\nneighbors = 3\nbearings = false");
    assert_eq!((some.slots, some.neighbors, some.bearings), (65_520, 3, false));
    assert_eq!((some.in_queue, some.stigmergy_entries), (64, 4000));
    for (text, column, range) in [
        ("[vm]\nslots = 65521", 9, "from 32 to 65520"),
        ("[vm]\nin_queue = 65", 12, "from 1 to 64"),
        ("[vm]\nstigmergy_entries = 9361", 21, "from 0 to 9360"),
    ] {
        let error = error_of(&format!("name = \"toy\"\n{text}"));
        let help = error.help().unwrap_or_default();
        assert!(format!("{error} {help}").contains(range), "{error} {help}");
        let place = error.place.unwrap();
        assert_eq!((place.line, place.column), (3, column), "{text}");
    }
    // With a chip, every size is stated, and there are fewer entries.
    let text = GOOD.replacen("stigmergy_entries = 4", "stigmergy_entries = 256", 1);
    let error = error_of(&text);
    let help = error.help().unwrap_or_default();
    assert!(format!("{error} {help}").contains("from 0 to 255"), "{error} {help}");
}

#[test]
fn on_fault_is_read() {
    for (name, on_fault) in [("restart", OnFault::Restart), ("stop", OnFault::Stop)] {
        let text = GOOD.replacen("[vm]", &format!("on_fault = {name:?}\n[vm]"), 1);
        assert_eq!(Robot::parse(&text, "toy.toml").unwrap().on_fault, on_fault);
    }
}

#[test]
fn every_error_has_its_place() {
    // The replaced text (its first occurrence), the new text, and the error.
    let cases = [
        ("tick_hz = 10", "tick_hz = ", Expected("Syntax", 5, 11, "not TOML")),
        ("tick_hz", "name = \"x\"\ntick_hz", Expected("Syntax", 5, 1, "duplicate key")),
        ("slots", "slotz", Expected("UnknownKey", 10, 1, "did you mean `slots`?")),
        ("ram_bytes", "rom_bytes", Expected("UnknownKey", 19, 1, "did you mean `ram_bytes`?")),
        ("fields", "field", Expected("UnknownKey", 29, 1, "did you mean `fields`?")),
        ("waits", "wait", Expected("UnknownKey", 41, 1, "did you mean `waits`?")),
        ("title = \"Toy robot\"\n", "", Expected("MissingKey", 1, 1, "the file has no `title`")),
        ("slots = 200\n", "", Expected("MissingKey", 8, 1, "[vm] has no `slots`")),
        ("flash_bytes = 65536\n", "", Expected("MissingKey", 17, 1, "[budget] has no")),
        ("help = \"lights up\"\n", "", Expected("MissingKey", 32, 1, "[[function]] has no `help`")),
        ("fields = \"x: number, y: number\"", "", Expected("MissingKey", 27, 1, "no `fields`")),
        ("profile = \"tiny\"", "profile = 16", Expected("WrongType", 4, 11, "must be a string")),
        ("slots = 200", "slots = 2e2", Expected("WrongType", 10, 9, "an integer, not a float")),
        ("slots = 200", "slots = \"200\"", Expected("WrongType", 10, 9, "not a string")),
        ("waits = true", "waits = 1", Expected("WrongType", 41, 9, "must be true or false")),
        (
            "[budget]\nflash_bytes = 65536\nram_bytes = 8192\n",
            "[[budget]]\n",
            Expected("WrongType", 17, 1, "must be a table, not a list"),
        ),
        ("[\"x: number, y: number\"]", "\"\"", Expected("WrongType", 39, 11, "must be a list")),
        ("[\"x: number, y: number\"]", "[1]", Expected("WrongType", 39, 12, "must be a string")),
        (
            "slots = 200",
            "slots = 0",
            Expected("OutOfRange", 10, 9, "a whole number from 32 to 65520"),
        ),
        ("slots = 200", "slots = 31", Expected("OutOfRange", 10, 9, "cannot be 31")),
        ("slots = 200", "slots = -1", Expected("OutOfRange", 10, 9, "cannot be -1")),
        ("slots = 200", "slots = 99999999999999999999", Expected("OutOfRange", 10, 9, "9999")),
        ("memory = 2027", "memory = 0", Expected("OutOfRange", 9, 10, "from 256")),
        ("neighbors = 15", "neighbors = 256", Expected("OutOfRange", 11, 13, "from 0 to 255")),
        ("in_queue = 10", "in_queue = 0", Expected("OutOfRange", 12, 12, "from 1 to 255")),
        ("out_queue = 10", "out_queue = 0", Expected("OutOfRange", 13, 13, "from 1 to 255")),
        ("swarms = 8", "swarms = 9", Expected("OutOfRange", 15, 10, "from 0 to 8")),
        ("tick_hz = 10", "tick_hz = 0", Expected("OutOfRange", 5, 11, "from 1 to 100")),
        ("message_bytes = 9", "message_bytes = 8", Expected("OutOfRange", 6, 17, "from 9 to")),
        ("flash_bytes = 65536", "flash_bytes = 0", Expected("OutOfRange", 18, 15, "cannot be 0")),
        ("ram_bytes = 8192", "ram_bytes = 0", Expected("OutOfRange", 19, 13, "cannot be 0")),
        ("stack =", "stakc =", Expected("UnknownKey", 25, 1, "did you mean `stack`?")),
        ("ram = {", "# {", Expected("MissingKey", 21, 1, "[layout] has no `ram`")),
        ("application = {", "application = 1 # {", Expected("WrongType", 22, 15, "a table")),
        (", size = 0x200 }", " }", Expected("MissingKey", 25, 9, "the region has no `size`")),
        (
            "size = 0x200 }",
            "size = 512, length = 512 }",
            Expected("UnknownKey", 25, 46, "one of address, size"),
        ),
        (
            "stack = {",
            "id = { address = 0x2000_0000, size = 512 } # {",
            Expected("Overlap", 25, 6, "`id` and `ram` overlap"),
        ),
        (
            "stack = { address = 0x1000_0000, size = 0x200 }\n\n",
            "settings = { address = 0x1000_0000, size = 0x200 }\n\n[[setting]]\nname = \"x\"\nleast = 2\n\
             most = 1\nhelp = \"y\"\n",
            Expected("OutOfRange", 30, 8, "from 2 to 65535"),
        ),
        (
            "[[table]]",
            "[[setting]]\nname = \"x\"\nleast = 2\nmost = 3\nhelp = \"y\"\n[[table]]",
            Expected("MissingKey", 21, 1, "[layout] has no `settings`"),
        ),
        (
            "[[table]]",
            "[[indicator]]\nshows = \"red\"\n[[table]]",
            Expected("MissingKey", 27, 1, "this [[indicator]] has no `means`"),
        ),
        ("size = 0x200 }", "size = 0 }", Expected("OutOfRange", 25, 41, "from 512")),
        ("0x1000_0000", "0x1_0000_0000", Expected("OutOfRange", 25, 21, "cannot be")),
        ("size = 0x200 }", "size = 0xf000_0000 }", Expected("OutOfRange", 25, 41, "to 4026531839")),
        ("0x0800_c000", "0x0800_c100", Expected("Unaligned", 23, 22, "no multiple of 512")),
        (
            "size = 0x4000 }",
            "size = 0x5000 }\nscript_log = true",
            Expected("BadLog", 24, 14, "20480 bytes: no multiple of 8192"),
        ),
        ("0xc000", "0xc200", Expected("Overlap", 23, 10, "`script` and `application` overlap")),
        (
            "slots = 200",
            "slots = 209",
            Expected("TooManySlots", 10, 9, "room for 204 `slots`; or set `memory` to 2"),
        ),
        ("\"tiny\"", "\"full\"", Expected("OutOfRange", 6, 17, "from 48 to 255")),
        ("\"tiny\"", "\"tinny\"", Expected("UnknownWord", 4, 11, "did you mean `tiny`?")),
        ("\"tiny\"", "\"Cortex\"", Expected("UnknownWord", 4, 11, "one of tiny, full")),
        (
            "[vm]",
            "on_fault = \"stopp\"\n[vm]",
            Expected("UnknownWord", 8, 12, "did you mean `stop`?"),
        ),
        ("[vm]", "on_fault = true\n[vm]", Expected("WrongType", 8, 12, "must be a string")),
        ("\"toy\"", "\"Toy\"", Expected("BadRobotName", 1, 8, "lower-case")),
        ("\"toy\"", "\"\"", Expected("NotOneLine", 1, 8, "`name` must be one line")),
        ("\"toy\"", "\"../toy\"", Expected("BadRobotName", 1, 8, "lower-case")),
        ("\"lights up\"", "\" \"", Expected("NotOneLine", 35, 8, "`help` must be one line")),
        ("\"lights up\"", "\"a\\nb\"", Expected("NotOneLine", 35, 8, "one line")),
        ("\"led\"", "\"set motor\"", Expected("BadIdentifier", 33, 8, "cannot be a name")),
        ("\"led\"", "\"2led\"", Expected("BadIdentifier", 33, 8, "no digit first")),
        ("\"led\"", "\"\"", Expected("BadIdentifier", 33, 8, "letters, digits")),
        ("\"led\"", "\"while\"", Expected("Reserved", 33, 8, "`while` is a name of the Buzz")),
        ("\"led\"", "\"delay\"", Expected("Reserved", 33, 8, "choose another name")),
        ("\"led\"", "\"neighbors\"", Expected("Reserved", 33, 8, "`neighbors`")),
        ("\"pos\"", "\"math\"", Expected("Reserved", 28, 8, "`math`")),
        ("\"goto\"", "\"led\"", Expected("DuplicateName", 38, 8, "first defined in line 33")),
        ("\"goto\"", "\"Led\"", Expected("ConstantCollision", 38, 8, "the constant `LED`")),
        ("\"pos\"", "\"led\"", Expected("DuplicateName", 33, 8, "first defined in line 28")),
        (
            "[\"x: number, y: number\"]",
            "[]",
            Expected("AcceptsNothing", 39, 11, "accepts = [\"\"]"),
        ),
        ("color: int, on: int", "c: int", Expected("RepeatedList", 34, 26, "listed twice")),
        ("y: number\"]", "y\"]", Expected("BadParameter", 39, 24, "write `name: type`")),
        ("y: number\"]", "y: real\"]", Expected("UnknownType", 39, 27, "one of int, number")),
        ("y: number\"]", "y: nuber\"]", Expected("UnknownType", 39, 27, "did you mean `number`?")),
        ("y: number\"]", "x: int\"]", Expected("RepeatedParameter", 39, 24, "`x` stands twice")),
        ("y: number\"]", "\\u0079\"]", Expected("BadParameter", 39, 12, "`y` is not")),
        ("returns = \"int\"", "returns = \"itn\"", Expected("UnknownType", 40, 11, "mean `int`?")),
        ("\"x: number, y: number\"\n", "\"\"\n", Expected("NoFields", 29, 10, "no fields")),
        ("\"x: number, y: number\"\n", "\"x\"\n", Expected("BadParameter", 29, 11, "`x`")),
        (
            "y: number\"]",
            "y: number..., z: int\"]",
            Expected("AfterRepeated", 39, 38, "write it last"),
        ),
        (
            "y: number\"\n",
            "y: number...\"\n",
            Expected("RepeatedField", 29, 10, "`y: number...` is no field"),
        ),
        (
            "y: number\"\n",
            "y: number 0..9\"\n",
            Expected("RangeOfField", 29, 10, "`y: number 0..9` is no field"),
        ),
        ("y: number\"]", "y: number 9\"]", Expected("BadRange", 39, 34, "`duty: int 0..255`")),
        (
            "x: number, y: number\"]",
            "a: int, b: int, c: int, d: int, e: int, f: int, g: int, h: int\"]",
            Expected("TooManyParameters", 39, 69, "more than 7"),
        ),
    ];
    expect_errors(GOOD, &cases);
}

/// The reserved names, which are refused: the globals of the language manual.
#[test]
fn names_of_the_language_are_reserved() {
    let names = "size foreach map reduce filter type isnil isint isfloat isstring istable isclosure isuserdata \
                 int float clone log assert id delay rand math string neighbors swarm stigmergy pos \
                 var if else function return for while and or not nil include";
    for name in names.split_whitespace() {
        let error = error_of(&GOOD.replacen("\"led\"", &format!("{name:?}"), 1));
        assert_eq!(error.cause, RobotFileCause::Reserved { name: name.to_owned() });
    }
}

#[test]
fn a_dissimilar_key_is_not_suggested_for_a_missing_one() {
    let errors = errors_of(&GOOD.replacen("title", "colour", 1));
    let places = errors.0.iter().map(|error| (error.place.clone().unwrap().line, error.help()));
    let help = "one of name, title, chip, profile, tick_hz, message_bytes, link, on_fault, vm, \
                budget, layout, function, table, setting, indicator, value, body, sensor";
    assert_eq!(places.collect::<Vec<_>>(), [(1, None), (2, Some(help.to_owned()))], "{errors}");
}

#[test]
fn colliding_hashes_are_refused() {
    // These names were found by a search. Two names with one hash are rare, but a robot must not
    // have both.
    let mut seen = HashMap::new();
    let (one, other) = (0..)
        .map(|i| format!("f{i}"))
        .find_map(|name| seen.insert(name_hash(&name), name.clone()).map(|old| (old, name)))
        .unwrap();
    let text = GOOD.replacen("\"led\"", &format!("{one:?}"), 1);
    let error = error_of(&text.replacen("\"goto\"", &format!("{other:?}"), 1));
    assert_eq!(error.cause, RobotFileCause::HashCollision { name: other, other: one });
    assert_eq!(error.place.map(|place| (place.line, place.column)), Some((38, 8)));
}

#[test]
fn the_message_shows_the_line() {
    let text = GOOD.replacen("Toy robot\"", "Toy r\u{f6}bot\" # \u{fc}", 1);
    let error = error_of(&text.replacen("slots = 200", "slots =   1_000", 1));
    let expected = "toy.toml:10:11: 1000 slots of 4 bytes do not fit in 2027 bytes of `memory`, with neighbors \
                    and messages\n\
                    10 | slots =   1_000\n   |           ^^^^^\n\
                    help: there is room for 204 `slots`; or set `memory` to 5208 or more: earlier versions needed less";
    assert_eq!(RobotErrors(vec![error]).to_string(), expected);
}

#[test]
fn all_mistakes_are_reported_in_order() {
    let mut text = GOOD.to_owned();
    for (from, to) in [
        ("\"toy\"", "\"Toy\""),
        ("tick_hz = 10", "tick_hz = 1000"),
        ("in_queue = 10", "in_queue = \"10\""),
        ("0x0800_c000", "0x0800_c100"),
        ("x: number, y: number", "x: nmuber, y: number"),
        ("\"led\"", "\"while\""),
        ("waits = true", "wait = true"),
    ] {
        text = spoiled(&text, from, to);
    }
    let errors = errors_of(&text);
    assert_eq!(lines_of(&errors), [1, 5, 12, 23, 29, 33, 41], "{errors}");
    let message = errors.to_string();
    let starts = |place: &str| message.lines().any(|line| line.starts_with(place));
    assert!(starts("toy.toml:1:8: ") && starts("toy.toml:41:1: "), "{message}");
}

#[test]
fn columns_count_characters() {
    let text = GOOD.replacen("x: number, y: number\"]", "\u{fc}: int, y: int\"]", 1);
    let place = error_of(&text).place.unwrap();
    assert_eq!((place.line, place.column, place.width), (39, 13, 6));
}

#[test]
fn odd_files_are_refused_without_panic() {
    for text in ["", "\u{feff}", "[", "\0", "name", "= 1", "[vm]\n[vm]", "name = '''\n", "\r\n"] {
        assert!(Robot::parse(text, "odd.toml").is_err(), "{text:?}");
    }
    // Each prefix of a correct file ends at another place.
    let whole = GOOD.trim_end();
    for end in 0..whole.len() {
        if let Err(error) = Robot::parse(&whole[..end], "toy.toml") {
            assert!(error.to_string().starts_with("toy.toml:"), "{error}");
        }
    }
}
