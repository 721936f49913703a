//! Suggestions for names that nothing defines.

use bittybuzz_vm_core::builtin::{self, Library};

use crate::check::names::Meaning;
use crate::check::robots::KnownRobots;
use crate::check::tree::{FunctionId, ResolvedScript};
use crate::diagnostic::Diagnostic;
use crate::source::Span;
use crate::token::{FixedToken, KEYWORDS};

/// Returns the candidate that is most similar to `name`, if one is similar enough.
pub fn nearest<'a>(name: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let limit = (name.chars().count() / 3).max(1);
    let lower = name.to_ascii_lowercase();
    candidates
        .into_iter()
        .filter(|candidate| *candidate != name)
        // This test is cheap and rules out most candidates.
        .filter(|candidate| candidate.len().abs_diff(name.len()) <= 4 * limit)
        .map(|candidate| {
            let distance = strsim::damerau_levenshtein(&lower, &candidate.to_ascii_lowercase());
            (distance, candidate)
        })
        // Without this limit, a name of one letter would be similar to every other.
        .filter(|(distance, candidate)| *distance <= limit && *distance < candidate.chars().count())
        .min()
        .map(|(_, candidate)| candidate)
}

/// A suggestion for a name that is not defined.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Advice {
    /// The help text of the diagnostic.
    pub help: String,
    /// The replacement of the name, with true if no other replacement is possible.
    pub instead: Option<(String, bool)>,
}

impl Advice {
    pub fn words(help: impl Into<String>) -> Self {
        Advice { help: help.into(), instead: None }
    }

    /// Suggests a replacement that is likely.
    pub fn likely(instead: impl Into<String>) -> Self {
        let instead = instead.into();
        Advice { help: format!("did you mean `{instead}`?"), instead: Some((instead, false)) }
    }

    /// Adds the suggestion to a diagnostic about the name at `span`.
    pub fn give(self, diagnostic: Diagnostic, span: Span) -> Diagnostic {
        let diagnostic = diagnostic.help(self.help);
        match self.instead {
            Some((text, true)) => diagnostic.edit(span, text),
            Some((text, false)) => diagnostic.guess(span, text),
            None => diagnostic,
        }
    }
}

/// Returns a suggestion for a name that nothing defines; `function` is the function that contains
/// the name.
pub fn for_name(
    name: &str,
    program: &ResolvedScript,
    function: FunctionId,
    robots: KnownRobots<'_>,
) -> Option<Advice> {
    if let Some((help, word)) = foreign(name) {
        let constant = constant(name).map(|constant| (constant.to_owned(), true));
        let word = word.map(|word| (word.to_owned(), false));
        return Some(Advice { help: help.to_owned(), instead: constant.or(word) });
    }
    if let Some(operator) = operator(name) {
        return Some(operator);
    }
    let keyword =
        KEYWORDS.into_iter().map(FixedToken::text).find(|word| name.eq_ignore_ascii_case(word));
    if let Some(keyword) = keyword {
        let help = format!("the keyword is written `{keyword}`");
        return Some(Advice { help, instead: Some((keyword.to_owned(), false)) });
    }
    let member = builtin::TABLE.iter().find(|info| info.name == name && path(info).contains('.'));
    if let Some(info) = member {
        return Some(Advice::likely(path(info)));
    }
    if let Some(path) = of_other_version(name) {
        return Some(renamed(path));
    }
    let mut locals = Vec::new();
    let mut at = Some(function);
    while let Some(id) = at {
        let function = program.function(id);
        locals.extend(function.locals.iter().map(|local| local.name.as_str()));
        at = function.creator;
    }
    let globals = program
        .names
        .iter()
        .filter(|known| !known.writes.is_empty() || !known.definitions.is_empty())
        .map(|known| known.text.as_str());
    let builtins = builtin::TABLE.iter().filter(|info| info.library == Library::Global);
    let libraries = Library::ALL.iter().filter_map(|library| library.global_name());
    let candidates = locals
        .into_iter()
        .chain(globals)
        .chain(builtins.map(|info| info.name))
        .chain(libraries)
        .chain(robots.names())
        .chain(["id", "self"]);
    nearest(name, candidates).map(Advice::likely)
}

/// Returns a suggestion for a field that a library does not have. It replaces the library and the
/// field.
pub fn for_member(library: Library, key: &str, robots: KnownRobots<'_>) -> Option<Advice> {
    if library == Library::Math {
        if matches!(key, "random" | "rand") {
            return Some(Advice::words("did you mean `math.rng.uniform(a, b)` or `rand()`?"));
        }
        if let Some(advice) = operator(key).or_else(|| of_other_version(key).map(renamed)) {
            return Some(advice);
        }
    }
    if let Some(help) = for_object(library, key) {
        return Some(Advice::words(help));
    }
    if let Some(likely) = nearest(key, robots.members(library).map(|info| info.name))
        .and_then(|likely| robots.member(library, likely))
    {
        return Some(Advice::likely(path(likely)));
    }
    // The name may belong to another library, as `uniform` in `math.uniform` belongs to `math.rng`.
    let elsewhere = builtin::TABLE.iter().find(|info| info.name == key && info.library != library);
    if let Some(info) = elsewhere.filter(|info| is_reached_by_name(info.library)) {
        return Some(Advice::likely(path(info)));
    }
    let starts = robots
        .members(library)
        .find(|info| key.starts_with(info.name) || is_prefix(key, info.name));
    starts.map(|info| Advice::likely(path(info)))
}

/// Returns the built-in that has this name in BittyBuzz, in the first version of Buzz, or in other
/// languages; the arguments are the same.
fn of_other_version(name: &str) -> Option<&'static str> {
    Some(match name {
        "atan2" => "math.atan",
        "fabs" => "math.abs",
        "roundi" => "math.round",
        "rng" => "math.rng",
        "rng_uniform" => "math.rng.uniform",
        "rng_gaussian" => "math.rng.gaussian",
        "rng_exponential" => "math.rng.exponential",
        "rng_setseed" => "math.rng.setseed",
        _ => return None,
    })
}

fn renamed(path: &str) -> Advice {
    Advice { help: format!("it is `{path}` here"), instead: Some((path.to_owned(), true)) }
}

/// Returns help for a function of other languages that is an operator here.
fn operator(name: &str) -> Option<Advice> {
    let help = match name {
        "pow" | "power" => "a power is written `x ^ y`",
        "mod" | "fmod" | "modulo" => "the remainder of a division is written `x % y`",
        "bitand" | "band" => "the bits of both are written `x & y`",
        "bitor" | "bor" => "the bits of either are written `x | y`",
        _ => return None,
    };
    Some(Advice::words(help))
}

/// Returns help for a function of the objects that the library's `create` returns.
fn for_object(library: Library, key: &str) -> Option<String> {
    let (objects, variable) = match library {
        Library::Swarm => (Library::SwarmObject, "s"),
        Library::Stigmergy => (Library::StigmergyObject, "v"),
        _ => return None,
    };
    let info = builtin::find(objects, key)?;
    let library = library_path(library);
    let form = info.help.split(':').next().unwrap_or(info.help);
    Some(format!("`{variable} = {library}.create(1)` in `init` makes one that has it: `{form}`"))
}

/// Returns a suggestion for a method that an object does not have.
pub fn for_method(object: Library, key: &str) -> Option<Advice> {
    let other = match (object, key) {
        (Library::StigmergyObject, "set" | "write" | "add" | "update" | "store" | "insert") => {
            "put"
        }
        (Library::StigmergyObject, "fetch" | "read" | "load" | "find" | "lookup") => "get",
        (Library::StigmergyObject, "count" | "length" | "len") => "size",
        (Library::StigmergyObject, "remove" | "delete" | "erase") => {
            return Some(Advice::words("an entry is removed by `put(key, nil)`"));
        }
        (Library::SwarmObject, "add" | "enter" | "insert") => "join",
        (Library::SwarmObject, "remove" | "exit" | "quit") => "leave",
        (Library::SwarmObject, "contains" | "isin" | "is_in" | "member" | "has") => "in",
        (Library::SwarmObject, "run" | "do" | "execute" | "call") => "exec",
        _ => {
            let members = builtin::TABLE.iter().filter(|info| info.library == object);
            return nearest(key, members.map(|info| info.name)).map(Advice::likely);
        }
    };
    Some(Advice::likely(other))
}

/// Returns a noun for the objects of a library.
pub fn object_noun(object: Library) -> &'static str {
    match object {
        Library::SwarmObject => "a swarm",
        Library::StigmergyObject => "a stigmergy",
        _ => "this table of neighbors",
    }
}

/// Returns true if the names have equal first two letters and equal last letters, as `squareroot`
/// and `sqrt`.
fn is_prefix(key: &str, name: &str) -> bool {
    key.len() >= 3
        && key.chars().take(2).eq(name.chars().take(2))
        && key.ends_with(|c| name.ends_with(c))
}

fn is_reached_by_name(library: Library) -> bool {
    matches!(library, Library::Global | Library::Rng) || library.global_name().is_some()
}

/// Returns the name of a built-in as scripts write it.
pub fn path(info: &builtin::BuiltinInfo) -> String {
    match (info.library, info.library.global_name()) {
        (Library::Rng, _) => format!("math.rng.{}", info.name),
        (_, Some(library)) => format!("{library}.{}", info.name),
        (_, None) => info.name.to_owned(),
    }
}

/// Returns the name of a library as scripts write it.
pub fn library_path(library: Library) -> &'static str {
    match library {
        Library::Rng => "math.rng",
        _ => library.global_name().unwrap_or("the table"),
    }
}

/// Returns the Buzz value of a constant of other languages.
fn constant(name: &str) -> Option<&'static str> {
    match name.to_ascii_lowercase().as_str() {
        "true" => Some("1"),
        "false" => Some("0"),
        "null" | "none" | "nil" | "undefined" | "nullptr" => Some("nil"),
        _ => None,
    }
}

/// Returns help for words of other languages, and the word of Buzz if it has one that is used in the
/// same way.
fn foreign(name: &str) -> Option<(&'static str, Option<&'static str>)> {
    Some(match name {
        "true" | "True" | "TRUE" => ("Buzz has no `true`: use 1", None),
        "false" | "False" | "FALSE" => ("Buzz has no `false`: use 0", None),
        "null" | "NULL" | "None" | "none" | "Nil" | "NIL" | "undefined" | "nullptr" => {
            ("the empty value is written `nil`", None)
        }
        "println" | "printf" | "puts" | "echo" => ("to print values, call `log(...)`", Some("log")),
        "debug" | "console" => ("to print values, call `log(...)`", None),
        "len" | "length" | "count" => {
            ("the number of entries of a table is `size(t)`", Some("size"))
        }
        "this" => ("the table of a method call is `self`", Some("self")),
        "sleep" | "wait" | "usleep" => ("to wait, call `delay(ms)`", Some("delay")),
        "random" => ("random numbers come from `math.rng.uniform(a, b)` or `rand()`", None),
        "str" | "tostring" => {
            ("a number becomes text by `string.tostring(x)`", Some("string.tostring"))
        }
        "robot_id" | "robotid" | "ID" => ("the number of this robot is `id`", Some("id")),
        _ => return None,
    })
}

/// Returns a description of a meaning, for messages.
pub fn describe(meaning: Meaning) -> &'static str {
    match meaning {
        Meaning::Nil => "nil",
        Meaning::Function(_) | Meaning::Builtin(_) | Meaning::Robot => "a function",
        Meaning::Global => "a variable",
        Meaning::Library(_) => "a table",
        Meaning::RobotId => "a number",
    }
}
