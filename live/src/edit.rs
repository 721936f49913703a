//! Requests of an editor: to show, check, run, load and write scripts.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use bittybuzz_arena::run::{Session, Setup, Simulation};
use bittybuzz_arena::scenario::{Group, Scenario, ScenarioError, WorldChange};
use serde_json::{Value, json};

use crate::begin;
use crate::compiler_message::CompilerMessage;
use crate::controls::{self, Control};
use crate::hand_in::{TextFile, seconds};
use crate::page_event::{
    DiagnosticsEvent, PageEvent, RanEvent, ScriptEvent, ScriptText, WrittenEvent,
};
use crate::request::Texts;
use crate::set_up::{messages, set_up, text_of};
use crate::words;
use crate::workshop::{Drafts, Text, groups_with, scripts};

/// A reason why a text cannot be run.
pub enum EditError {
    /// The request is not valid.
    Refused(String),
    /// The compiler found errors in the texts of these names.
    Errors(Vec<String>, Vec<DiagnosticsEvent>),
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
    let scenario = &setup.scenario;
    scripts(scenario).into_iter().map(|script| name_of(scenario, script)).collect()
}

/// Returns the texts with which the session began, without those that cannot be read any more.
pub fn begun(drafts: &Drafts, setup: &Setup, scenario: &str) -> Texts {
    let own = scripts(&setup.scenario).into_iter();
    let own = own
        .filter_map(|script| Some((name_of(&setup.scenario, script), drafts.begun(script).ok()?)));
    own.chain([(name_of_scenario(drafts, setup), scenario.to_owned())]).collect()
}

/// Returns the controls of all scripts, at most one for each global.
pub fn controls(drafts: &Drafts, setup: &Setup) -> Vec<Control> {
    // A file that cannot be read any more has no controls; the editor shows the error.
    let texts = scripts(&setup.scenario).into_iter().filter_map(|script| drafts.text(script).ok());
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
    name_of(&setup.scenario, drafts.workshop().scenario())
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
            let words = words::describe(groups_with(&setup.scenario, &script));
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
    let (messages, _) = drafts.check(groups_with(&setup.scenario, &script), &script, text);
    Ok(PageEvent::Diagnostics(diagnostics(name, text, messages)))
}

/// Loads a text into robots as a draft of a script. Returns the events about it. Without `ids` it
/// is loaded into all robots with the script.
pub fn load(
    drafts: &mut Drafts,
    session: &mut Session,
    (name, text): (&str, &str),
    ids: Option<&[u16]>,
    keep: bool,
) -> Result<[PageEvent; 2], EditError> {
    let setup = session.run().setup().clone();
    let script = find(&setup, name)?;
    let groups: Vec<&Group> = match ids {
        None => groups_with(&setup.scenario, &script).collect(),
        Some(ids) => setup.scenario.groups.iter().filter(|one| contains_any(one, ids)).collect(),
    };
    let robots = match ids {
        Some(ids) => json!(ids),
        None => groups.iter().map(|group| json!(range(group))).collect(),
    };
    let (messages, has_error) = drafts.check(groups.into_iter(), &script, text);
    let diagnostics = diagnostics(name, text, messages);
    if has_error {
        return Err(EditError::Errors(vec![name.to_owned()], vec![diagnostics]));
    }
    let count = drafts.count();
    let path = drafts.keep(&script, text);
    let draft = name_of(&setup.scenario, &path);
    // JSON's notation of strings and numbers is valid TOML.
    let keep = if keep { "\nkeep = true" } else { "" };
    let command = format!("load = {robots}\nscript = {}{keep}", Value::from(draft.as_str()));
    if let Err(errors) = session.command(&command) {
        // A text that robots never got is no draft.
        drafts.truncate(count);
        return Err(EditError::Command(errors));
    }
    drafts.loaded(&path);
    let quantities = begin::quantities(session.run().setup());
    let controls = controls(drafts, &setup);
    let ran = RanEvent { name: name.to_owned(), draft, quantities, controls };
    Ok([PageEvent::Diagnostics(diagnostics), PageEvent::Ran(ran)])
}

/// A run that starts again from the beginning.
pub struct NewRun {
    pub run: Simulation,
    /// The text of the scenario.
    pub scenario: String,
    /// The events for the client, after the description of the world.
    pub events: Vec<PageEvent>,
}

/// Starts a run of the scenario from the beginning with new texts. `scenario` is the text of the
/// scenario if `texts` has no other. Other scripts get their last drafts. If `keep_changes` is true,
/// the commands of the earlier run act again at their times.
pub fn begin(
    drafts: &mut Drafts,
    earlier: &Simulation,
    scenario: &str,
    texts: &Texts,
    keep_changes: bool,
) -> Result<NewRun, EditError> {
    let name = name_of_scenario(drafts, earlier.setup());
    let text = texts.get(&name).map_or(scenario, String::as_str);
    let of_scenario =
        |errors| EditError::Errors(vec![name.clone()], vec![diagnostics(&name, "", errors)]);
    let parsed = drafts.workshop().parse(text, &[]);
    let parsed = parsed.map_err(|errors| of_scenario(messages(&errors)))?;
    let (mut own, mut found, mut wrong) = (drafts.last(), Vec::new(), Vec::new());
    for script in scripts(&parsed) {
        let name = name_of(&parsed, script);
        let Some(text) = texts.get(&name) else { continue };
        let (messages, has_error) = drafts.check(groups_with(&parsed, script), script, text);
        found.push(diagnostics(&name, text, messages));
        if has_error {
            wrong.push(name);
        }
        own.retain(|(path, _)| path != script);
        own.push((script.to_owned(), text.clone()));
    }
    if !wrong.is_empty() {
        return Err(EditError::Errors(wrong, found));
    }
    let made = set_up(drafts.workshop(), text, &[], &own).map_err(of_scenario)?;
    let seed = made.scenario.world.seed;
    let made = made.with_compiler(drafts.workshop().compiler());
    let run = Simulation::new(Arc::new(made), seed, 0);
    let mut run = run.map_err(|error| EditError::Command(vec![error]))?;
    if keep_changes {
        repeat(&mut run, earlier)?;
    }
    drafts.begin(own);
    let mut events: Vec<PageEvent> = found.into_iter().map(PageEvent::Diagnostics).collect();
    events.push(PageEvent::Began);
    Ok(NewRun { run, scenario: text.to_owned(), events })
}

/// Queues the commands of an earlier run again. Scripts that were loaded during that run are left
/// out, because the new run has the texts of the client from its start.
fn repeat(run: &mut Simulation, earlier: &Simulation) -> Result<(), EditError> {
    for (tick, text) in earlier.command_list() {
        if is_load(earlier, text) {
            continue;
        }
        if let Err(errors) = run.command_at(tick, text) {
            let reasons: Vec<String> = errors.iter().map(ToString::to_string).collect();
            return Err(EditError::Refused(format!(
                "your change `{}` at {} s does not fit: {}; run without your changes",
                text.replace('\n', ", "),
                seconds(tick),
                reasons.join("; "),
            )));
        }
    }
    Ok(())
}

/// Returns true if a command of a run loads a script.
fn is_load(run: &Simulation, command: &str) -> bool {
    let change = run.setup().scenario.command(command);
    matches!(change, Ok(WorldChange::Load { .. }))
}

/// Sets up the scenario with texts of scripts. `setting` is a key of the scenario, or a global, with
/// its value. An error is a text for users.
pub fn trial(
    drafts: &Drafts,
    scenario: &str,
    setting: Option<(&str, &str)>,
    own: &[Text],
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
    let made = set_up(drafts.workshop(), &text, &values, own);
    made.map_err(|errors| text_of(&errors).trim_end().to_owned())
}

/// Returns the texts of all scripts with which the session began, for a hand-in. Fails with advice
/// for the user if the run is not one of the texts that the client shows.
pub fn handed_in(
    drafts: &Drafts,
    run: &Simulation,
    scenario: &str,
    shown: &Texts,
) -> Result<Vec<Text>, String> {
    let begun = begun(drafts, run.setup(), scenario);
    let is_other =
        |(name, text): &(&String, &String)| begun.get(*name).is_some_and(|ran| ran != *text);
    if let Some((name, _)) = shown.iter().find(is_other) {
        return Err(format!(
            "`{name}` has not run as it is shown: press Run, then hand in what has run"
        ));
    }
    if let Some((tick, _)) = run.command_list().find(|(_, text)| is_load(run, text)) {
        let at = seconds(tick);
        return Err(format!(
            "a script was loaded during the run, at {at} s: press Run, which starts from the \
             beginning, then hand in what has run"
        ));
    }
    let text = |script: &Path| Ok((script.to_owned(), drafts.begun(script)?));
    scripts(&run.setup().scenario).into_iter().map(text).collect()
}

/// Returns the texts of scripts as parts of a hand-in.
pub fn files(setup: &Setup, texts: Vec<Text>) -> Vec<TextFile> {
    let name = |script: &Path| name_of(&setup.scenario, script);
    texts.into_iter().map(|(script, text)| TextFile::new(name(&script), text)).collect()
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
        name: name_of(&setup.scenario, path),
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
fn name_of(scenario: &Scenario, script: &Path) -> String {
    script.strip_prefix(&scenario.folder).unwrap_or(script).display().to_string()
}

/// Returns the name of the script to which a source file belongs, as itself or as a draft; `None` for
/// files that a client cannot edit.
pub fn name_of_source(drafts: &Drafts, setup: &Setup, file: &Path) -> Option<String> {
    let script = drafts.script_of(file);
    let scenario = &setup.scenario;
    scripts(scenario).contains(&script).then(|| name_of(scenario, script))
}

/// Finds the script of that name. A client can read and write no other files.
fn find(setup: &Setup, name: &str) -> Result<PathBuf, String> {
    let mut known = scripts(&setup.scenario).into_iter();
    let found = known.find(|script| name_of(&setup.scenario, script) == name);
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
