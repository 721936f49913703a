//! The setup of a scenario and its scripts, from texts that may not be in a file.

use bittybuzz_arena::run::{Program, Setup, SetupError};
use bittybuzz_arena::scenario::{Backend, Group, ScenarioError};
use bittybuzz_compiler::diagnostic::Severity;
use bittybuzz_compiler::refusal;
use bittybuzz_compiler::render::Renderer;
use bittybuzz_robot_spec::Robot;
use std::collections::HashMap;
use std::path::Path;
use std::sync::Arc;

use crate::compiler_message::CompilerMessage;
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
    if let Some(group) = scenario.groups.iter().find(|group| group.backend != Backend::Vm) {
        let robots = &group.robot.name;
        let text = format!("{robots} robots with backend = \"firmware\" run by `bbz sim` alone");
        return Err(vec![CompilerMessage::error(text)]);
    }
    let (mut programs, mut errors) = (Vec::new(), Vec::new());
    // Groups with one script and one robot, of which there may be thousands, share a program.
    let mut compiled: HashMap<(&Path, *const Robot), Option<Program>> = HashMap::new();
    // The robots run in virtual machines, so that each has a script.
    for (group, script) in scenario.scripts() {
        let known = compiled.entry((script, Arc::as_ptr(&group.robot)));
        let made = known.or_insert_with(|| {
            let own = scripts.iter().find(|(path, _)| path == script);
            match program(workshop, script, own.map(|(_, text)| &**text), group) {
                Ok(program) => Some(program),
                Err(found) => {
                    for one in found {
                        if !errors.contains(&one) {
                            errors.push(one);
                        }
                    }
                    None
                }
            }
        });
        programs.extend(made.clone());
    }
    drop(compiled);
    if !errors.is_empty() {
        return Err(errors);
    }
    Setup::new(scenario, programs).map_err(|error| match error {
        SetupError::Scenario(errors) => messages(&errors),
        SetupError::Refused { cause, .. } => {
            vec![CompilerMessage::error(format!("a script {}", refusal::sentence(&cause)))]
        }
    })
}

/// Compiles a script from `text`, or else from its file.
fn program(
    workshop: &dyn Workshop,
    script: &Path,
    text: Option<&str>,
    group: &Group,
) -> Result<Program, Vec<CompilerMessage>> {
    let Some(text) = text else {
        return workshop.compiler()(script, group)
            .map_err(|report| vec![CompilerMessage::error(report.trim_end())]);
    };
    let compiled = workshop.compile(script, text, group);
    if let Some(image) = compiled.image {
        let (symbols, sources) = (compiled.symbols, Arc::new(compiled.sources));
        return Ok(Program::new(image, symbols, sources));
    }
    let renderer = Renderer::new(&compiled.sources);
    let errors = compiled.diagnostics.iter().filter(|one| one.severity() == Severity::Error);
    Err(errors.map(|one| CompilerMessage::of_diagnostic(&renderer, one)).collect())
}

/// Returns the mistakes of a scenario as messages.
pub fn messages(errors: &[ScenarioError]) -> Vec<CompilerMessage> {
    errors.iter().map(CompilerMessage::of_scenario).collect()
}

/// Formats the messages of [`set_up`] as text: a line or two for each.
pub fn text_of(errors: &[CompilerMessage]) -> String {
    let texts = errors.iter().map(|error| {
        let place = match (&error.file, error.line, error.column) {
            (Some(file), Some(line), Some(column)) => format!("{file}:{line}:{column}: "),
            _ => String::new(),
        };
        let help = error.help.as_ref().map(|help| format!("  help: {help}\n"));
        format!("{place}{}\n{}", error.message, help.unwrap_or_default())
    });
    texts.collect()
}
