//! Checks the functions that the robot calls: `init`, `step`, `reset` and `destroy`.

use std::collections::BTreeMap;

use crate::check::calls::counted;
use crate::check::names::{Meaning, Meanings};
use crate::check::static_type::{StaticType, kind_of};
use crate::check::tree::{
    CheckedExpr, CheckedFunction, FreeName, NameId, ResolvedScript, assigned_values,
};
use crate::codes::DiagnosticCode;
use crate::diagnostic::Diagnostic;
use crate::image::ENTRIES;

/// Checks entry points, and functions with the misspelt name of one.
pub fn check_entries(program: &ResolvedScript, meanings: &Meanings<'_>) -> Vec<Diagnostic> {
    let mut diagnostics = Vec::new();
    for entry in ENTRIES {
        if let Some(id) = program.find_name(entry).filter(|_| !program.hidden.is_lost(entry)) {
            diagnostics.extend(parameters(program, id, meanings));
            diagnostics.extend(not_function(program, id, meanings));
        }
    }
    diagnostics.extend(program.names.iter().filter_map(|name| misspelt(program, name)));
    diagnostics
}

/// Returns the entry point that a function was probably meant to be. Nothing uses the function, and
/// the script has no such entry point.
pub fn meant_entry(program: &ResolvedScript, name: &FreeName) -> Option<&'static str> {
    let is_used = !name.reads.is_empty() || !name.calls.is_empty() || !name.writes.is_empty();
    let is_known = !is_used && !program.hidden.is_lost(&name.text);
    if !is_known || name.definitions.is_empty() || ENTRIES.contains(&name.text.as_str()) {
        return None;
    }
    let lower = name.text.to_ascii_lowercase();
    ENTRIES.into_iter().find(|entry| {
        let is_alike = match *entry {
            _ if lower == *entry => true,
            // `rest`, `resets` and the words below are similar to an entry point, but not misspelt.
            "reset" => false,
            _ if matches!(lower.as_str(), "stop" | "steps" | "unit") => false,
            _ => strsim::damerau_levenshtein(&lower, entry) == 1,
        };
        is_alike && !is_assigned(program, entry) && !program.hidden.may_define(entry)
    })
}

fn is_assigned(program: &ResolvedScript, text: &str) -> bool {
    let name = program.find_name(text).map(|id| program.name(id));
    name.is_some_and(|name| !name.definitions.is_empty() || !name.writes.is_empty())
}

fn misspelt(program: &ResolvedScript, name: &FreeName) -> Option<Diagnostic> {
    let entry = meant_entry(program, name)?;
    let (_, span) = name.definitions.last()?;
    Some(
        Diagnostic::new(
            DiagnosticCode::EntryMisspelt,
            *span,
            format!("nothing calls `{}`: the robot calls `{entry}`", name.text),
        )
        .label("never runs")
        .help(format!("did you mean `function {entry}()`?"))
        .guess(*span, entry),
    )
}

fn parameters(program: &ResolvedScript, id: NameId, meanings: &Meanings<'_>) -> Option<Diagnostic> {
    let Meaning::Function(function) = meanings.of(id) else { return None };
    let name = program.name(id);
    // A script that also calls the entry point itself may pass arguments.
    if !name.calls.is_empty() || !name.reads.is_empty() {
        return None;
    }
    let function: &CheckedFunction = program.function(function);
    let first = function.locals.first().filter(|_| function.parameters > 0)?;
    Some(
        Diagnostic::new(
            DiagnosticCode::EntryParameters,
            first.span,
            format!(
                "`{}` has {}, but the robot passes none",
                name.text,
                counted(function.parameters, "parameter")
            ),
        )
        .label("reading it stops the script")
        .help(format!("write `function {}()`", name.text)),
    )
}

fn not_function(
    program: &ResolvedScript,
    id: NameId,
    meanings: &Meanings<'_>,
) -> Option<Diagnostic> {
    let mut assigned = BTreeMap::new();
    for function in &program.functions {
        assigned_values(&function.body, &mut assigned);
    }
    let values = assigned.remove(&id)?;
    // No warning is due if one of the values may be a function, or is unknown.
    let kind = |value: &CheckedExpr| kind_of(value, meanings);
    let is_value = |value: &&CheckedExpr| {
        !matches!(kind(value), None | Some(StaticType::Function | StaticType::Nil))
    };
    if values.is_empty() || !values.iter().all(is_value) {
        return None;
    }
    let first = values.first()?;
    let text = &program.name(id).text;
    Some(
        Diagnostic::new(
            DiagnosticCode::EntryNotFunction,
            first.span,
            format!("the robot calls `{text}`, but this is {}", kind(first)?.name()),
        )
        .label("the call stops the script")
        .help(format!(
            "choose another name for the variable, or write `function {text}() {{ ... }}`"
        )),
    )
}
