//! Places, the limit of mistakes, and likely names.

use std::fmt;

use super::*;

#[derive(Debug, Clone, PartialEq, Eq)]
struct Mistake(TomlError);

impl From<TomlError> for Mistake {
    fn from(error: TomlError) -> Self {
        Mistake(error)
    }
}

impl fmt::Display for Mistake {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

impl Cause for Mistake {
    fn help(&self) -> Option<String> {
        self.0.help()
    }
}

fn keys(_: &'static str) -> Vec<&'static str> {
    vec!["size", "speed", "item"]
}

/// Reads two required numbers and a list of tables.
fn errors(text: &str) -> Vec<FileError<Mistake>> {
    let read = read(&SourceText::new("a.toml", text), &[], ("the file", &keys), |root| {
        let size = root.required("size").and_then(|entry| entry.integer(1..=9));
        let speed = root.required("speed").and_then(|entry| entry.number(0.0..=f64::MAX));
        root.sections("item", "this [[item]]");
        Some((size?, speed?))
    });
    read.err().unwrap_or_default()
}

fn shown(text: &str) -> Vec<String> {
    let place = |error: &FileError<Mistake>| {
        error
            .place
            .as_ref()
            .map_or(String::new(), |place| format!("{}:{}", place.line, place.column))
    };
    let help = |error: &FileError<Mistake>| error.help().unwrap_or_default();
    errors(text).iter().map(|e| format!("{} {e} | {}", place(e), help(e))).collect()
}

#[test]
fn all_mistakes_are_reported_in_the_order_of_the_file() {
    let found = shown("speed = -1\nsize = 12\n[[item]]\ncolor = 3\n");
    assert_eq!(
        found,
        [
            "1:9 `speed` cannot be -1 | a number from 0 on",
            "2:8 `size` cannot be 12 | a whole number from 1 to 9",
            "4:1 unknown key `color` in this [[item]] | one of size, speed, item",
        ]
    );
}

#[test]
fn a_misspelled_key_is_one_mistake() {
    assert_eq!(
        shown("spede = 1\nsize = 3\n"),
        ["1:1 unknown key `spede` in the file | did you mean `speed`?"]
    );
    assert_eq!(shown("size = 3\n"), ["1:1 the file has no `speed` | "]);
}

#[test]
fn every_syntax_error_is_reported() {
    let found = shown("size = \nspeed = 1\nitem = [\n");
    assert!(found.len() >= 2, "{found:#?}");
    assert!(found.iter().all(|message| message.contains("this is not TOML")), "{found:#?}");
}

/// Only the mistakes that are kept have a place, and a place reads no more than its line.
#[test]
fn mistakes_beyond_the_limit_are_counted() {
    let text: String = (0..200_000).map(|number| format!("key{number} = 1\n")).collect();
    let found = errors(&text);
    assert_eq!(found.len(), MISTAKES_MAX + 1);
    let last = found.last().unwrap();
    // Two keys are missing, too.
    assert_eq!(last.to_string(), format!("{} more mistakes are not shown", 200_002 - MISTAKES_MAX));
    assert_eq!(last.place, None);
    let read = place::BYTES_READ.get();
    assert!((1..MISTAKES_MAX * 40).contains(&read), "{read} bytes for lines of up to 14");
}

#[test]
fn a_place_shows_its_line() {
    let source = SourceText::new("a.toml", "one\r\ntw\u{f6} = 3\n");
    let place = source.place(7..11);
    assert_eq!((place.line, place.column, place.width), (2, 3, 3));
    assert_eq!((place.source.as_str(), place.source_column), ("tw\u{f6} = 3", 1));
    assert_eq!(source.place(0..3).source, "one");
    // A mistake may be at the very end, and a range may end in another line.
    assert_eq!((source.place(14..14).line, source.place(99..120).line), (3, 3));
    assert_eq!(source.place(0..9).width, 3);
    let empty = SourceText::new("a.toml", "").place(0..0);
    assert_eq!((empty.line, empty.column, empty.width), (1, 1, 1));
}

#[test]
fn a_place_in_a_long_line_shows_a_part_of_it() {
    let text = format!("{}!{}", "\u{f6}".repeat(100_000), "x".repeat(100_000));
    let place = SourceText::new("a.toml", &text).place(200_000..200_001);
    assert_eq!((place.line, place.column, place.width), (1, 100_001, 1));
    assert!(place.source.len() <= 400, "{}", place.source.len());
    let shown = place.source.chars().nth(place.column - place.source_column);
    assert_eq!(shown, Some('!'));
}

#[test]
fn likely_names_are_near() {
    assert_eq!(one_of("spede", &["size", "speed"]), "did you mean `speed`?");
    assert_eq!(one_of("color", &["size", "speed"]), "one of size, speed");
    assert_eq!(one_of("size", &["seize", "size_mm"]), "did you mean `seize`?");
    assert_eq!(one_of("range", &["orange_juice", "range_mm"]), "did you mean `range_mm`?");
    assert_eq!(one_of("distnce", &["distance(X, Y)"]), "did you mean `distance(X, Y)`?");
    // A third of the letters may differ: two of six, but not three. One letter always may.
    assert_eq!(one_of("radium", &["medium"]), "did you mean `medium`?");
    assert_eq!(one_of("radiem", &["medium"]), "one of medium");
    assert_eq!(one_of("od", &["id"]), "did you mean `id`?");
    assert_eq!(one_of("od", &["at"]), "one of at");
    let many: Vec<String> = (0..30).map(|number| format!("{number}")).collect();
    assert!(one_of("color", &many).ends_with("22, 23 and 6 more"));
}

#[test]
fn numbers_in_messages_are_short() {
    assert_eq!(number_text(-12.5), "-12.5");
    assert_eq!(number_text(0.0), "0");
    assert_eq!(number_text(1e300), "1e300");
    assert_eq!(number_text(f64::NAN), "NaN");
}

/// The lines after an unclosed bracket are its content and are not reported as mistakes.
#[test]
fn an_unclosed_bracket_is_one_mistake() {
    for (text, place, open, close) in [
        ("[world]\nsize = [1000, 800\nspeed = 60\n\n[[item]]\nsize = 5\n", "2:8", '[', ']'),
        ("[world\nsize = 1\nspeed = 60\n", "1:1", '[', ']'),
        ("[[item]\nsize = 1\nspeed = 5\n", "1:1", '[', ']'),
        ("size = [[1, 2], [3, 4]\nspeed = 5\n[item]\nsize = 1\n", "1:8", '[', ']'),
        ("size = { b = 1, c = 2\nspeed = 3\n[item]\nsize = 1\n", "1:8", '{', '}'),
        ("item = [{ size = 1, { speed = 2 }]\nsize = 3\n", "1:9", '{', '}'),
        ("speed = \"[\" # [\nsize = [1, '\\', \"\\\"[\",\n\"\"\"\n[\"\"\"\n", "2:8", '[', ']'),
        ("size = [\u{f6}", "1:8", '[', ']'),
    ] {
        assert_eq!(
            shown(text),
            [format!(
                "{place} this is not TOML: this `{open}` is never closed | write the `{close}` that ends it"
            )],
            "{text}"
        );
    }
    // A string ends with its line even if its quote is missing, so the bracket in the next line
    // counts. In a literal string the backslash is a character, so the quote after it ends the
    // string.
    for (text, place) in [
        ("speed = \"[\nsize = [1\n", "2:8"),
        ("speed = '[\nsize = [1\n", "2:8"),
        ("speed = ['\\', 1\nitem = '2'\n", "1:9"),
        ("speed = '''[\\'''\nsize = [1\n", "2:8"),
    ] {
        let found = shown(text);
        let last = format!("{place} this is not TOML: this `[` is never closed");
        assert!(found.last().unwrap().starts_with(&last), "{text}\n{found:#?}");
    }
    // Mistakes before the bracket are reported too, and so are those that no bracket explains.
    let found = shown("size = \nspeed = [1\nsize = 3\n");
    assert_eq!(found.len(), 2, "{found:#?}");
    assert!(found[0].starts_with("1:8 this is not TOML: string values must"), "{found:#?}");
    assert!(found[1].starts_with("2:9 this is not TOML: this `[` is never"), "{found:#?}");
    let found = shown("size = 3]\nspeed = 1\n");
    assert!(found[0].starts_with("1:9 this is not TOML: "), "{found:#?}");
}
