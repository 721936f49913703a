//! Messages about unknown names, compared with a search for the definitions in the text.
//!
//! While a script is being written it has syntax errors most of the time. A name whose definition stands in the text
//! must not be called unknown then, wherever the errors are.

use std::collections::BTreeSet;
use std::ops::Range;

use bittybuzz_compiler::compile::Compiled;
use bittybuzz_compiler::source::FileId;

/// Codes of messages about a name that nothing defines.
const UNKNOWN: [&str; 7] = ["E0401", "E0402", "E0409", "E0410", "E0412", "W0201", "W0208"];

/// Codes of errors after which the compiler may not have understood all of the text.
const SYNTAX: [&str; 3] = ["E01", "E02", "E03"];

const KEYWORDS: [&str; 12] = [
    "and", "else", "for", "function", "if", "include", "nil", "not", "or", "return", "var", "while",
];

/// A word, an operator, a bracket or a whole string, and where it stands.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Piece<'t> {
    pub text: &'t str,
    pub range: Range<usize>,
    begins_line: bool,
}

/// Splits a text without its comments. A string may go on over the line, unless that leaves one without an end: then
/// each ends at its line at the latest, and a quote without another one is left out.
pub fn split(text: &str) -> Vec<Piece<'_>> {
    split_with(text, true).or_else(|| split_with(text, false)).unwrap_or_default()
}

fn split_with(text: &str, has_long_strings: bool) -> Option<Vec<Piece<'_>>> {
    let mut pieces = Vec::new();
    let mut begins_line = true;
    let mut at = 0;
    while let Some(first) = text[at..].chars().next() {
        let rest = &text[at..];
        let length = match first {
            '\n' => {
                begins_line = true;
                at += 1;
                continue;
            }
            '#' => {
                at += rest.find('\n').unwrap_or(rest.len());
                continue;
            }
            _ if rest.starts_with("//") => {
                at += rest.find('\n').unwrap_or(rest.len());
                continue;
            }
            '"' | '\'' => match string_length(rest, has_long_strings) {
                Some(length) => length,
                None if has_long_strings => return None,
                None => {
                    at += 1;
                    continue;
                }
            },
            _ if is_word(first) => rest.find(|c| !is_word(c)).unwrap_or(rest.len()),
            _ if first.is_whitespace() || first == ';' => {
                at += first.len_utf8();
                continue;
            }
            _ if ["==", "!=", "<=", ">=", "<<", ">>"].iter().any(|two| rest.starts_with(two)) => 2,
            _ => first.len_utf8(),
        };
        pieces.push(Piece { text: &rest[..length], range: at..at + length, begins_line });
        begins_line = false;
        at += length;
    }
    Some(pieces)
}

fn is_word(c: char) -> bool {
    c.is_alphanumeric() || c == '_'
}

/// The length of the string at the beginning of `rest`, if it ends.
fn string_length(rest: &str, may_hold_newlines: bool) -> Option<usize> {
    let mut characters = rest.char_indices();
    let (_, quote) = characters.next()?;
    while let Some((at, c)) = characters.next() {
        match c {
            '\\' => {
                characters.next();
            }
            '\n' if !may_hold_newlines => return None,
            _ if c == quote => return Some(at + 1),
            _ => {}
        }
    }
    None
}

/// The names that a text defines.
#[derive(Debug, Default)]
struct Definitions<'t> {
    /// The names after `function`.
    functions: BTreeSet<&'t str>,
    /// The names after `var`, and parameters.
    locals: BTreeSet<&'t str>,
    /// The names before `=`.
    assigned: BTreeSet<&'t str>,
    /// Fields before `=`, with all that is before their dot.
    fields: BTreeSet<(String, &'t str)>,
}

impl<'t> Definitions<'t> {
    fn read(pieces: &[Piece<'t>]) -> Self {
        let mut found = Definitions::default();
        let at = |position: Option<usize>| {
            position.and_then(|at| pieces.get(at)).map_or("", |piece| piece.text)
        };
        let mut is_in_parameters = false;
        for (position, piece) in pieces.iter().enumerate() {
            let name = piece.text;
            let before = at(position.checked_sub(1));
            if name == "function" {
                is_in_parameters = true;
            } else if matches!(name, ")" | "{") || piece.begins_line {
                is_in_parameters = false;
            }
            if !name.starts_with(|c: char| c.is_alphabetic() || c == '_')
                || KEYWORDS.contains(&name)
            {
                continue;
            }
            let is_assigned = at(Some(position + 1)) == "=";
            match before {
                "." if is_assigned => {
                    found.fields.insert((object_of(&pieces[..position - 1]), name));
                }
                "." => {}
                "function" => {
                    found.functions.insert(name);
                }
                "var" => {
                    found.locals.insert(name);
                }
                _ if is_in_parameters => {
                    found.locals.insert(name);
                }
                _ if is_assigned => {
                    found.assigned.insert(name);
                }
                _ => {}
            }
        }
        found
    }
}

/// Returns the object at the end of the pieces: a name, or names with dots between them.
fn object_of(pieces: &[Piece]) -> String {
    let mut object = String::new();
    for pair in pieces.rchunks(2) {
        let [.., name] = pair else { break };
        object.insert_str(0, name.text);
        match pair {
            [dot, _] if dot.text == "." => object.insert(0, '.'),
            _ => break,
        }
    }
    object
}

/// Returns true if the compiler found a syntax error, or an include that it could not read.
pub fn has_syntax_error(compiled: &Compiled) -> bool {
    compiled
        .diagnostics
        .iter()
        .any(|found| SYNTAX.iter().any(|kind| found.code.text().starts_with(kind)))
}

/// Messages that call a name of the script `text` unknown although the text defines it, as `CODE name`.
///
/// With a syntax error the name may be defined anywhere in the text, in whatever way: a bracket that is missing may
/// have moved its definition out of sight. A name at the very end may be the beginning of another one. Without a
/// syntax error scopes are as they are written, and only names that are global for certain count: those of named
/// functions, and those that are assigned and are never a local.
pub fn falsely_unknown(text: &str, compiled: &Compiled) -> Vec<String> {
    let unknown: Vec<_> = compiled
        .diagnostics
        .iter()
        .filter(|found| found.span.file == FileId::default())
        .filter(|found| UNKNOWN.contains(&found.code.text()))
        .collect();
    if unknown.is_empty() {
        return Vec::new();
    }
    let pieces = split(text);
    let defined = Definitions::read(&pieces);
    let has_syntax_error = has_syntax_error(compiled);
    let is_false = |range: Range<usize>| {
        let name = &text[range.clone()];
        if has_syntax_error && range.end == text.len() {
            return true;
        }
        let position = pieces.partition_point(|piece| piece.range.start < range.start);
        if let [before @ .., dot] = &pieces[..position]
            && dot.text == "."
        {
            return defined.fields.contains(&(object_of(before), name));
        }
        let is_global = defined.functions.contains(name) || defined.assigned.contains(name);
        match has_syntax_error {
            true => is_global || defined.locals.contains(name),
            false => is_global && !defined.locals.contains(name),
        }
    };
    unknown
        .into_iter()
        .map(|found| (found, found.span.start as usize..found.span.end as usize))
        .filter(|(_, range)| is_false(range.clone()))
        .map(|(found, range)| format!("{} {}", found.code.text(), &text[range]))
        .collect()
}

#[test]
fn a_text_is_split_without_its_comments() {
    let words = |text| split(text).into_iter().map(|piece| piece.text).collect::<Vec<_>>();
    assert_eq!(words("a == b # c\nd=1"), ["a", "==", "b", "d", "=", "1"]);
    assert_eq!(words("x = 'a # \"\\'b' // c"), ["x", "=", "'a # \"\\'b'"]);
    // Over two lines, and without an end.
    assert_eq!(words("x = 'a\nb' y"), ["x", "=", "'a\nb'", "y"]);
    assert_eq!(words("x = 'a\ny = \"b\""), ["x", "=", "a", "y", "=", "\"b\""]);
}

#[test]
fn definitions_are_found_in_broken_text() {
    let found = Definitions::read(&split(
        "var a = = 1\nfunction f(b, c {\nd = (e\n}} t.g = 1 if(h == i <= j) { .k = 2 }\nx = function(l)\na.b.c = 1",
    ));
    assert_eq!(found.functions, BTreeSet::from(["f"]));
    assert_eq!(found.locals, BTreeSet::from(["a", "b", "c", "l"]));
    assert_eq!(found.assigned, BTreeSet::from(["d", "x"]));
    let fields = [("a.b", "c"), ("t", "g"), ("{", "k")];
    assert_eq!(found.fields, fields.map(|(object, name)| (object.to_owned(), name)).into());
}
