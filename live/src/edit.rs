//! Requests of an editor: to show, check, run and write scripts.

use std::path::{Path, PathBuf};

use bittybuzz_arena::run::{Session, Setup};
use bittybuzz_arena::scenario::{Group, ScenarioError};
use serde_json::{Value, json};

use crate::begin;
use crate::compiler_message::CompilerMessage;
use crate::controls::{self, Control};
use crate::hand_in::TextFile;
use crate::page_event::{
    BeganEvent, DiagnosticsEvent, PageEvent, RanEvent, ScriptEvent, ScriptText, WrittenEvent,
};
use crate::set_up::{set_up, text_of};
use crate::words;
use crate::workshop::{Drafts, groups_with, scripts};

/// A reason why a text cannot be run.
pub enum EditError {
    /// The request is not valid.
    Refused(String),
    /// The compiler found errors.
    Errors(DiagnosticsEvent),
    /// The session rejected the command.
    Command(Vec<ScenarioError>),
}

impl From<String> for EditError {
    fn from(reason: String) -> Self {
        EditError::Refused(reason)
    }
}

/// Returns the names of the scripts that a client may edit.
pub fn names(setup: &Setup) -> Vec<String> {
    scripts(setup).into_iter().map(|script| name_of(setup, script)).collect()
}

/// Returns the controls of all scripts, at most one for each global.
pub fn controls(drafts: &Drafts, setup: &Setup) -> Vec<Control> {
    // A file that cannot be read any more has no controls; the editor shows the error.
    let texts = scripts(setup).into_iter().filter_map(|script| drafts.text(script).ok());
    let mut once: Vec<Control> = Vec::new();
    for control in texts.flat_map(|text| controls::read(&text)).flatten() {
        if once.iter().all(|other| other.name() != control.name()) {
            once.push(control);
        }
    }
    once
}

/// Returns the name of the scenario, in the form of the scripts' names.
pub fn name_of_scenario(drafts: &Drafts, setup: &Setup) -> String {
    name_of(setup, drafts.workshop().scenario())
}

/// Returns true if that is the name of the scenario.
pub fn is_scenario(drafts: &Drafts, setup: &Setup, name: &str) -> bool {
    name == name_of_scenario(drafts, setup)
}

/// Returns the event with a script, or with the scenario.
pub fn show(
    drafts: &Drafts,
    setup: &Setup,
    name: &str,
    scenario: &str,
) -> Result<PageEvent, String> {
    let (path, text, words) = match is_scenario(drafts, setup, name) {
        true => (drafts.workshop().scenario().to_owned(), scenario.to_owned(), Vec::new()),
        false => {
            let script = find(setup, name)?;
            let text = drafts.text(&script)?;
            let words = words::describe(groups_with(setup, &script));
            (script, text, words)
        }
    };
    let (name, file) = (name.to_owned(), path.display().to_string());
    Ok(PageEvent::Script(ScriptEvent { name, file, text, words }))
}

/// Returns the event with the compiler's messages about a text.
pub fn check(drafts: &Drafts, setup: &Setup, name: &str, text: &str) -> Result<PageEvent, String> {
    if is_scenario(drafts, setup, name) {
        let errors = set_up(drafts.workshop(), text, &[], &drafts.last()).err();
        // Without an error there is no message.
        return Ok(PageEvent::Diagnostics(diagnostics(name, "", errors.unwrap_or_default())));
    }
    let script = find(setup, name)?;
    let (messages, _) = drafts.check(groups_with(setup, &script), &script, text);
    Ok(PageEvent::Diagnostics(diagnostics(name, text, messages)))
}

/// Loads a text into robots as a draft of a script. Returns the events about it. Without `ids` it
/// is loaded into all robots with the script.
pub fn run(
    drafts: &mut Drafts,
    session: &mut Session,
    (name, text): (&str, &str),
    ids: Option<&[u16]>,
    keep: bool,
) -> Result<[PageEvent; 2], EditError> {
    let setup = session.run().setup().clone();
    let script = find(&setup, name)?;
    let groups: Vec<&Group> = match ids {
        None => groups_with(&setup, &script).collect(),
        Some(ids) => setup.scenario.groups.iter().filter(|one| contains_any(one, ids)).collect(),
    };
    let robots = match ids {
        Some(ids) => json!(ids),
        None => groups.iter().map(|group| json!(range(group))).collect(),
    };
    let (messages, has_error) = drafts.check(groups.into_iter(), &script, text);
    let diagnostics = diagnostics(name, text, messages);
    if has_error {
        return Err(EditError::Errors(diagnostics));
    }
    let draft = name_of(&setup, &drafts.keep(&script, text));
    // JSON's notation of strings and numbers is valid TOML.
    let keep = if keep { "\nkeep = true" } else { "" };
    let command = format!("load = {robots}\nscript = {}{keep}", Value::from(draft.as_str()));
    session.command(&command).map_err(EditError::Command)?;
    let quantities = begin::quantities(session.run().setup());
    let controls = controls(drafts, &setup);
    let ran = RanEvent { name: name.to_owned(), draft, quantities, controls };
    Ok([PageEvent::Diagnostics(diagnostics), PageEvent::Ran(ran)])
}

/// Prepares a session with a new text of the scenario, in which the last drafts replace the texts
/// of their scripts. Returns the setup and the events for the client.
pub fn begin(
    drafts: &mut Drafts,
    setup: &Setup,
    text: &str,
) -> Result<(Setup, Vec<PageEvent>), EditError> {
    let name = name_of_scenario(drafts, setup);
    let made = set_up(drafts.workshop(), text, &[], &drafts.last());
    let made = made.map_err(|errors| EditError::Errors(diagnostics(&name, "", errors)))?;
    drafts.begin();
    let made = made.with_compiler(drafts.workshop().compiler());
    Ok((made, vec![PageEvent::Began(BeganEvent { name })]))
}

/// Sets up the scenario with the last drafts. `setting` is a key of the scenario, or a global, with
/// its value. An error is a text for users.
pub fn trial(
    drafts: &Drafts,
    scenario: &str,
    setting: Option<(&str, &str)>,
) -> Result<Setup, String> {
    let (mut text, mut values) = (scenario.to_owned(), Vec::new());
    match setting.map(|(key, value)| (key.trim(), value.trim())) {
        None => {}
        Some((key, value)) => match key.strip_prefix("global.") {
            Some(global) => {
                // JSON's notation of strings and numbers is valid TOML.
                let global = Value::from(global);
                let event = format!("at = 0\nset = \"all\"\nglobal = {global}\nnumber = {value}");
                text = format!("{}\n\n[[event]]\n{event}\n", text.trim_end());
            }
            None => values.push(format!("{key}={value}")),
        },
    }
    let made = set_up(drafts.workshop(), &text, &values, &drafts.last());
    made.map_err(|errors| text_of(&errors).trim_end().to_owned())
}

/// Returns all scripts of a scenario for a hand-in.
pub fn handed_in(drafts: &Drafts, setup: &Setup) -> Result<Vec<TextFile>, String> {
    let file = |script: &Path| Ok(TextFile::new(name_of(setup, script), drafts.text(script)?));
    scripts(setup).into_iter().map(file).collect()
}

/// Writes a text to the file of a script. Returns the event about it.
pub fn write(
    drafts: &mut Drafts,
    setup: &Setup,
    name: &str,
    text: &str,
) -> Result<PageEvent, String> {
    let script = find(setup, name)?;
    drafts.write(&script, text)?;
    Ok(PageEvent::Written(WrittenEvent { name: name.to_owned() }))
}

/// Returns the scripts that a saved session needs in addition to the existing files.
pub fn needed(drafts: &Drafts, setup: &Setup) -> Vec<ScriptText> {
    let script = |(path, text): (&Path, &str)| ScriptText {
        name: name_of(setup, path),
        text: text.to_owned(),
    };
    drafts.needed(setup).into_iter().map(script).collect()
}

/// Returns the event with the compiler's messages and the malformed controls in a text.
fn diagnostics(name: &str, text: &str, diagnostics: Vec<CompilerMessage>) -> DiagnosticsEvent {
    let problems = controls::read(text).into_iter().filter_map(Result::err).collect();
    DiagnosticsEvent { name: name.to_owned(), diagnostics, problems }
}

/// Returns the path of a script relative to the folder of the scenario.
fn name_of(setup: &Setup, script: &Path) -> String {
    script.strip_prefix(&setup.scenario.folder).unwrap_or(script).display().to_string()
}

/// Finds the script of that name. A client can read and write no other files.
fn find(setup: &Setup, name: &str) -> Result<PathBuf, String> {
    let found = scripts(setup).into_iter().find(|script| name_of(setup, script) == name);
    found.map(Path::to_owned).ok_or_else(|| format!("no robot has the script `{name}`"))
}

/// Returns true if a robot of the group has one of the ids.
fn contains_any(group: &Group, ids: &[u16]) -> bool {
    let first = u32::from(group.first_id);
    let own = first..first + group.count;
    ids.iter().any(|id| own.contains(&u32::from(*id)))
}

/// Returns the ids of a group as a range of a scenario, such as `0..19`.
fn range(group: &Group) -> String {
    let first = u32::from(group.first_id);
    format!("{first}..{}", first + group.count.saturating_sub(1))
}
