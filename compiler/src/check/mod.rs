//! Checks a whole script: resolves its names, and finds the mistakes that are visible before the
//! script runs.

mod arguments;
mod callbacks;
mod callees;
mod calls;
mod checker;
mod conflicts;
mod entries;
mod forgotten;
mod host;
mod loops;
pub mod missing;
pub mod names;
pub mod outside;
mod overflow;
mod reach;
pub mod resolve;
pub mod robots;
mod shadowing;
mod shapes;
pub mod static_type;
mod stuck;
mod suggest;
mod topics;
pub mod tree;
mod unused;
pub mod values;
mod walk;

use crate::ast::Script;
use crate::codes::DiagnosticCode;
use crate::diagnostic::{Diagnostic, Severity};
use crate::parser::Hidden;
use crate::profile::NumberProfile;
use names::Meanings;
use outside::OutsideUses;
use robots::KnownRobots;
use tree::ResolvedScript;

/// A script whose names are resolved, and the diagnostics about it.
#[derive(Debug, Clone)]
pub struct Checked<'a> {
    pub program: ResolvedScript,
    /// The meanings of the script's names.
    pub meanings: Meanings<'a>,
    /// Errors and warnings.
    pub diagnostics: Vec<Diagnostic>,
}

/// Checks a script. `arithmetic` is the profile for which operations on constants are checked.
/// Names in `hidden` get no diagnostics, because their uses or definitions may be in source with
/// syntax errors. `outside` are the names that something outside of the script uses.
pub fn check<'a>(
    script: &Script,
    robots: KnownRobots<'a>,
    profile: NumberProfile,
    arithmetic: NumberProfile,
    hidden: Hidden,
    outside: &OutsideUses,
) -> Checked<'a> {
    let (mut program, mut diagnostics) = resolve::resolve(script);
    program.hidden = hidden;
    host::furnish(&mut program, robots, profile, outside);
    let meanings = Meanings::new(&program, robots, profile);
    diagnostics.extend(shadowing::check_names(&program, robots, profile, &meanings));
    diagnostics.extend(walk::check_expressions(&program, &meanings, profile));
    diagnostics.extend(entries::check_entries(&program, &meanings));
    let callbacks::Callbacks { diagnostics: of_callbacks, called: called_for_callback } =
        callbacks::check_callbacks(&program, &meanings);
    diagnostics.extend(of_callbacks);
    diagnostics.extend(conflicts::check_conflicts(&program, &meanings));
    diagnostics.extend(forgotten::check_forgotten(&program, &meanings));
    diagnostics.extend(arguments::check_arguments(&program, &meanings));
    diagnostics.extend(overflow::check_overflow(&program, arithmetic));
    diagnostics.extend(stuck::check_stuck(&program, &meanings, arithmetic));
    diagnostics.extend(loops::check_loops(&program, &meanings));
    diagnostics.extend(topics::check_topics(&program, &meanings));
    // Warnings about unused names are given only for a script without errors, because a misspelt
    // name or a syntax error makes another name look unused.
    let is_wrong = |found: &Diagnostic| {
        found.severity() == Severity::Error || found.code == DiagnosticCode::NeverAssigned
    };
    if !program.hidden.is_any() && !diagnostics.iter().any(is_wrong) {
        diagnostics.extend(unused::check_unused(&program, &meanings, &called_for_callback));
    }
    pass_self_on(&mut program, &meanings);
    Checked { program, meanings, diagnostics }
}

/// Checks the functions that were added to a script which was checked before. The result has the
/// diagnostics of the script, too.
pub fn check_added(
    program: &ResolvedScript,
    meanings: &Meanings<'_>,
    profile: NumberProfile,
    arithmetic: NumberProfile,
) -> Vec<Diagnostic> {
    let mut diagnostics = walk::check_expressions(program, meanings, profile);
    diagnostics.extend(arguments::check_arguments(program, meanings));
    diagnostics.extend(overflow::check_overflow(program, arithmetic));
    diagnostics
}

/// Marks the creators of lambdas that use `self`: a lambda takes its self from the function that
/// creates it, which therefore needs its own.
fn pass_self_on(program: &mut ResolvedScript, meanings: &Meanings<'_>) {
    // Lambdas come after their creators in the list, so the reverse order reaches nested lambdas
    // first.
    for number in (0..program.functions.len()).rev() {
        let function = &program.functions[number];
        // A function that defines itself by name has no creator to mark.
        let Some(creator) = function.creator.filter(|_| function.uses_self) else { continue };
        if !meanings.self_is_nil(creator) {
            program.functions[creator.0].uses_self = true;
        }
    }
}
