//! The setup of a scenario and its scripts, from texts that may not be in a file.

use bittybuzz_arena::run::{Program, Setup, SetupError};
use bittybuzz_arena::scenario::{Backend, Group, ScenarioError};
use bittybuzz_compiler::diagnostic::Severity;
use bittybuzz_compiler::refusal;
use bittybuzz_compiler::render::Renderer;
use serde_json::{Value, json};
use std::path::Path;

use crate::workshop::{Text, Workshop};

/// Compiles a scenario and its scripts for runs. `values` override values of the scenario, and
/// `scripts` replace files. An error is a list of messages, each an object in the format of
/// `bbz check --json`.
pub fn set_up(
    workshop: &dyn Workshop,
    text: &str,
    values: &[String],
    scripts: &[Text],
) -> Result<Setup, Vec<Value>> {
    let scenario = workshop.parse(text, values).map_err(|errors| messages(&errors))?;
    if let Some(group) = scenario.groups.iter().find(|group| group.backend != Backend::Vm) {
        let robots = &group.robot.name;
        let text = format!("{robots} robots with backend = \"firmware\" run by `bbz sim` alone");
        return Err(vec![message(&text)]);
    }
    let (mut programs, mut errors) = (Vec::new(), Vec::new());
    for (group, script) in scenario.programs() {
        let own = scripts.iter().find(|(path, _)| path == script);
        match program(workshop, script, own.map(|(_, text)| &**text), group) {
            Ok(program) => programs.push(program),
            Err(found) => errors
                .extend(found.into_iter().filter(|one| !errors.contains(one)).collect::<Vec<_>>()),
        }
    }
    if !errors.is_empty() {
        return Err(errors);
    }
    Setup::new(scenario, programs).map_err(|error| match error {
        SetupError::Scenario(errors) => messages(&errors),
        SetupError::Refused { cause, .. } => {
            vec![message(&format!("a script {}", refusal::sentence(&cause)))]
        }
    })
}

/// Compiles a script from `text`, or else from its file.
fn program(
    workshop: &dyn Workshop,
    script: &Path,
    text: Option<&str>,
    group: &Group,
) -> Result<Program, Vec<Value>> {
    let Some(text) = text else {
        return workshop.compiler()(script, group)
            .map_err(|report| vec![message(report.trim_end())]);
    };
    let compiled = workshop.compile(script, text, group);
    if let Some(image) = compiled.image {
        return Ok(Program { image, symbols: compiled.symbols });
    }
    let renderer = Renderer::new(&compiled.sources);
    let errors = compiled.diagnostics.iter().filter(|one| one.severity() == Severity::Error);
    Err(errors.map(|one| renderer.json(one)).collect())
}

/// Returns the mistakes of a scenario as messages.
fn messages(errors: &[ScenarioError]) -> Vec<Value> {
    let of = |error: &ScenarioError| {
        let mut object = message(&error.to_string());
        object["help"] = json!(error.help());
        if let Some(place) = &error.place {
            object["file"] = json!(place.path);
            object["line"] = json!(place.line);
            object["column"] = json!(place.column);
            object["end_line"] = json!(place.line);
            object["end_column"] = json!(place.column + place.width);
        }
        object
    };
    errors.iter().map(of).collect()
}

/// Formats the messages of [`set_up`] as text: a line or two for each.
pub fn text_of(errors: &[Value]) -> String {
    let texts = errors.iter().map(|error| {
        let word = |key: &str| error[key].as_str().unwrap_or_default();
        let place = match word("file") {
            "" => String::new(),
            file => format!("{file}:{}:{}: ", error["line"], error["column"]),
        };
        let help = match word("help") {
            "" => String::new(),
            help => format!("  help: {help}\n"),
        };
        format!("{place}{}\n{help}", word("message"))
    });
    texts.collect()
}

fn message(text: &str) -> Value {
    json!({ "severity": "error", "message": text, "edits": [] })
}
