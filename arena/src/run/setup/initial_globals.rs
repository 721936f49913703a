//! The check of the numbers with which scripts begin against the scripts.

use bittybuzz_compiler::literals::global_literals;

use super::super::program::LoadedProgram;
use super::{MISTAKES_MAX, check_global};
use crate::robot::ScriptNumber;
use crate::scenario::{Group, InitialGlobal, Scenario, ScenarioCause, ScenarioError, Selection};

/// Checks the numbers with which the script of a group begins.
pub(super) fn check_globals(
    scenario: &Scenario,
    programs: &[LoadedProgram],
    (group, loaded): (&Group, &LoadedProgram),
    errors: &mut Vec<ScenarioError>,
) {
    if group.globals.is_empty() {
        return;
    }
    let robots = Selection::of_group(group);
    let sources = &loaded.program.sources;
    let literals = global_literals(sources);
    for InitialGlobal { name, number, place } in &group.globals {
        let checked = check_global(scenario, programs, &robots, name);
        let literal = literals.get(name).filter(|literal| !literal.is_float);
        let cause = match (checked, number, literal) {
            (Err(cause), ..) => cause,
            (Ok(()), ScriptNumber::Float(value), Some(literal)) => ScenarioCause::FloatForInteger {
                name: name.clone(),
                value: format!("{value:?}"),
                script: sources.path(literal.span.file).display().to_string(),
                line: sources.line_column(literal.span).line,
            },
            (Ok(()), ..) => continue,
        };
        if errors.len() < MISTAKES_MAX {
            errors.push(ScenarioError { cause, place: Some(Box::new(place.clone())) });
        }
    }
}
