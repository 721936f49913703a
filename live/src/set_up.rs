//! The setup of a scenario and its scripts, from texts that may not be in a file.

use std::path::Path;

use bittybuzz_arena::run::{Program, Setup};
use bittybuzz_arena::scenario::Group;

use crate::compiler_message::CompilerMessage;
use crate::scenario_files::{messages, program_of, setup};
use crate::workshop::{Text, Workshop};

/// Compiles a scenario and its scripts for runs. `values` override values of the scenario, and
/// `scripts` replace files.
pub fn set_up(
    workshop: &dyn Workshop,
    text: &str,
    values: &[String],
    scripts: &[Text],
) -> Result<Setup, Vec<CompilerMessage>> {
    let scenario = workshop.parse(text, values).map_err(|errors| messages(&errors))?;
    setup(scenario, |script, group| {
        let own = scripts.iter().find(|(path, _)| path == script);
        program(workshop, script, own.map(|(_, text)| &**text), group)
    })
}

/// Compiles a script from `text`, or else from its file.
fn program(
    workshop: &dyn Workshop,
    script: &Path,
    text: Option<&str>,
    group: &Group,
) -> Result<Program, Vec<CompilerMessage>> {
    match text {
        Some(text) => program_of(workshop.compile(script, text, group)),
        None => workshop.compiler()(script, group)
            .map_err(|report| vec![CompilerMessage::error(report.trim_end())]),
    }
}
