//! Requests of an editor: to show, check, run, load and write scripts.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use bittybuzz_arena::run::{Session, Setup, Simulation};
use bittybuzz_arena::scenario::{
    Group, Scenario, ScenarioError, WorldChange, file_sections, without_files,
};
use bittybuzz_compiler::comments::controls;
use serde_json::{Value, json};

use crate::about::ScriptAbout;
use crate::begin;
use crate::compiler_message::CompilerMessage;
use crate::controls::Control;
use crate::hand_in::{TextFile, seconds, sha256};
use crate::page_event::{
    ChangedEvent, DiagnosticsEvent, PageEvent, RanEvent, ScenarioEvent, ScriptEvent, WrittenEvent,
};
use crate::request::Texts;
use crate::scenario_comments::scenario_warnings;
use crate::scenario_files::{messages, text_of};
use crate::set_up::set_up;
use crate::words;
use crate::workshop::{Drafts, Text, groups_with, scripts};

/// A reason why a text cannot be run.
pub enum EditError {
    /// The request is not valid.
    Refused(String),
    /// The compiler found errors in the texts of these names.
    Errors(Vec<String>, Vec<DiagnosticsEvent>),
    /// The scenario asks for something that its scripts do not have.
    Misfit(DiagnosticsEvent),
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

/// Returns the texts with which the run began: those of its scripts, and `scenario`, that of the
/// scenario. A script that could not be read then is missing.
pub fn begun(drafts: &Drafts, setup: &Setup, scenario: &str) -> Texts {
    let own = scripts(&setup.scenario).into_iter();
    let own = own.filter_map(|script| {
        Some((name_of(&setup.scenario, script), drafts.begun(script)?.into()))
    });
    own.chain([(name_of_scenario(drafts, setup), scenario.to_owned())]).collect()
}

/// Returns the names of the scripts that the client may write to their files.
pub fn writable(drafts: &Drafts, setup: &Setup) -> Vec<String> {
    let scenario = &setup.scenario;
    let own = scripts(scenario).into_iter().filter(|script| drafts.may_write(setup, script));
    own.map(|script| name_of(scenario, script)).collect()
}

/// Returns the controls of all scripts, at most one for each global.
pub fn controls(drafts: &Drafts, setup: &Setup) -> Vec<Control> {
    // A file that cannot be read any more has no controls; the editor shows the error.
    let texts = scripts(&setup.scenario).into_iter();
    let texts = texts.filter_map(|script| drafts.text(setup, script).ok());
    let mut once: Vec<Control> = Vec::new();
    for control in texts.flat_map(|text| controls::read(&text)).flatten().map(Control::from) {
        if once.iter().all(|other| other.name() != control.name()) {
            once.push(control);
        }
    }
    once
}

/// Returns the texts about the scripts in their comments.
pub fn about_scripts(drafts: &Drafts, setup: &Setup) -> Vec<ScriptAbout> {
    let own = scripts(&setup.scenario).into_iter();
    let own = own.filter_map(|script| {
        let text = drafts.text(setup, script).ok()?;
        Some(ScriptAbout::new(name_of(&setup.scenario, script), &text))
    });
    own.collect()
}

/// Returns the name of the scenario, in the form of the scripts' names.
pub fn name_of_scenario(drafts: &Drafts, setup: &Setup) -> String {
    name_of(&setup.scenario, drafts.workshop().scenario())
}

/// Returns true if that is the name of the scenario.
pub fn is_scenario(drafts: &Drafts, setup: &Setup, name: &str) -> bool {
    name == name_of_scenario(drafts, setup)
}

/// Returns the path of a script, or of the scenario.
pub fn path_of(drafts: &Drafts, setup: &Setup, name: &str) -> Result<PathBuf, String> {
    match is_scenario(drafts, setup, name) {
        true => Ok(drafts.workshop().scenario().to_owned()),
        false => find(setup, name),
    }
}

/// Returns the path of a script and the text of its file, if it can be read. For the scenario it is
/// `opened`, the text with which the session was opened.
pub fn saved(
    drafts: &Drafts,
    setup: &Setup,
    name: &str,
    opened: &str,
) -> Result<(PathBuf, Option<String>), String> {
    let path = path_of(drafts, setup, name)?;
    let saved = match is_scenario(drafts, setup, name) {
        true => Some(opened.to_owned()),
        false => drafts.saved(setup, &path).ok(),
    };
    Ok((path, saved))
}

/// Returns the event with a script, or with the scenario. `scenario` is the text of the scenario, and
/// `opened` the one with which the session was opened.
pub fn show(
    drafts: &Drafts,
    setup: &Setup,
    name: &str,
    [scenario, opened]: [&str; 2],
) -> Result<PageEvent, String> {
    let (path, saved) = saved(drafts, setup, name, opened)?;
    let (text, words) = match is_scenario(drafts, setup, name) {
        true => (scenario.to_owned(), Vec::new()),
        false => {
            let words = words::describe(groups_with(&setup.scenario, &path));
            (drafts.text(setup, &path)?, words)
        }
    };
    let (name, file) = (name.to_owned(), path.display().to_string());
    let sha256 = saved.as_deref().map(sha256).unwrap_or_default();
    let saved = saved.unwrap_or_default();
    Ok(PageEvent::Script(ScriptEvent { name, file, text, saved, sha256, words }))
}

/// Returns the event with the compiler's messages about a text.
pub fn check(drafts: &Drafts, setup: &Setup, name: &str, text: &str) -> Result<PageEvent, String> {
    if is_scenario(drafts, setup, name) {
        let messages = match set_up(drafts.workshop(), text, &[], &drafts.last()) {
            Ok(made) => {
                let path = drafts.workshop().scenario().to_string_lossy();
                let warnings = scenario_warnings(text, &path, &made.scenario);
                warnings.iter().map(CompilerMessage::of_scenario_comment).collect()
            }
            Err(errors) => errors,
        };
        return Ok(PageEvent::Diagnostics(diagnostics(name, messages)));
    }
    let script = find(setup, name)?;
    let (messages, _) = drafts.check(groups_with(&setup.scenario, &script), &script, text);
    Ok(PageEvent::Diagnostics(diagnostics(name, messages)))
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
    let diagnostics = diagnostics(name, messages);
    if has_error {
        return Err(EditError::Errors(vec![name.to_owned()], vec![diagnostics]));
    }
    let count = drafts.count();
    let path = drafts.keep(&setup, &script, text);
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
    let about = about_scripts(drafts, &setup);
    let ran = RanEvent { name: name.to_owned(), draft, quantities, controls, about };
    Ok([PageEvent::Diagnostics(diagnostics), PageEvent::Ran(ran)])
}

/// Returns the files that the commands of a run load, in their order.
pub fn loaded(run: &Simulation) -> Vec<PathBuf> {
    let changes = run.command_list().map(|(_, text)| run.setup().scenario.command(text));
    let scripts = changes.filter_map(|change| match change {
        Ok(WorldChange::Load { script, .. }) => Some(script),
        _ => None,
    });
    scripts.collect()
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
        |errors| EditError::Errors(vec![name.clone()], vec![diagnostics(&name, errors)]);
    let parsed = drafts.workshop().parse(text, &[]);
    let parsed = parsed.map_err(|errors| of_scenario(messages(&errors)))?;
    let (mut own, mut found, mut wrong) = (drafts.last(), Vec::new(), Vec::new());
    for script in scripts(&parsed) {
        let name = name_of(&parsed, script);
        let Some(text) = texts.get(&name) else { continue };
        let (messages, has_error) = drafts.check(groups_with(&parsed, script), script, text);
        found.push(diagnostics(&name, messages));
        if has_error {
            wrong.push(name);
        }
        own.retain(|(path, _)| path != script);
        own.push((script.to_owned(), text.clone()));
    }
    if !wrong.is_empty() {
        return Err(EditError::Errors(wrong, found));
    }
    let made = set_up(drafts.workshop(), text, &[], &own);
    let made = made.map_err(|errors| EditError::Misfit(diagnostics(&name, errors)))?;
    let seed = made.scenario.world.seed;
    let made = made.with_compiler(drafts.workshop().compiler());
    let run = Simulation::new(Arc::new(made), seed, 0);
    let mut run = run.map_err(|error| EditError::Command(vec![error]))?;
    if keep_changes {
        repeat(&mut run, earlier)?;
    }
    drafts.begin(run.setup(), own);
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
/// its value. An error is a text for users, without a place in a text that they do not see: that of
/// the setting.
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
    let lines = scenario.lines().count();
    let set_up = set_up(drafts.workshop(), &text, &values, own);
    set_up.map_err(|mut errors| {
        let of_scenario = drafts.workshop().scenario().display().to_string();
        for error in &mut errors {
            let is_of_scenario = error.file.as_ref() == Some(&of_scenario);
            let is_added = is_of_scenario && error.line.is_some_and(|line| line > lines);
            // The values have a source of their own, which is no file.
            let is_value = error.file.as_ref().is_some_and(|file| file.starts_with("--set "));
            if is_added || is_value {
                error.file = None;
            }
        }
        text_of(&errors).trim_end().to_owned()
    })
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
    let text = |script: &Path| match drafts.begun(script) {
        Some(text) => Ok((script.to_owned(), text.to_owned())),
        None => Err(format!(
            "`{}` could not be read when the run began: press Run, then hand in what has run",
            name_of(&run.setup().scenario, script)
        )),
    };
    scripts(&run.setup().scenario).into_iter().map(text).collect()
}

/// Returns the texts of scripts as parts of a hand-in.
pub fn files(setup: &Setup, texts: Vec<Text>) -> Vec<TextFile> {
    let name = |script: &Path| name_of(&setup.scenario, script);
    texts.into_iter().map(|(script, text)| TextFile::new(name(&script), text)).collect()
}

/// Writes a text to the file of a script. Returns the event about it. With `over`, nothing is written
/// if the file has a text with another SHA-256.
pub fn write(
    drafts: &mut Drafts,
    setup: &Setup,
    (name, text): (&str, &str),
    over: Option<&str>,
) -> Result<PageEvent, String> {
    let script = find(setup, name)?;
    let name = name.to_owned();
    // A file that may not be written is refused below, whatever its text is.
    if let Some(over) = over.filter(|_| drafts.may_write(setup, &script)) {
        let saved = drafts.saved(setup, &script).ok();
        let now = saved.as_deref().map(sha256).unwrap_or_default();
        if now != over {
            return Ok(PageEvent::Changed(ChangedEvent { name, saved, sha256: now }));
        }
    }
    if setup.scenario.embedded.contains(&script) {
        return Err(format!("`{name}` stands in the scenario: download it, or save the scenario"));
    }
    drafts.write(&script, text)?;
    Ok(PageEvent::Written(WrittenEvent { name, sha256: sha256(text) }))
}

/// Returns the session as a scenario that runs from any folder: it has all commands, and the texts
/// that the run needs.
pub fn scenario(drafts: &Drafts, setup: &Setup, text: &str, commands: &str) -> ScenarioEvent {
    let mut files: BTreeMap<String, String> = BTreeMap::new();
    for (path, text) in drafts.texts(setup) {
        for name in embedded_names(drafts, setup, &path) {
            files.insert(name, text.clone());
        }
    }
    let images = setup.scenario.groups.iter().filter_map(|group| group.backend.firmware());
    let others = setup.scripts().map(|(_, script)| script).chain(images);
    let others: BTreeSet<String> = others.map(|path| name_of(&setup.scenario, path)).collect();
    let missing = others.into_iter().filter(|name| !files.contains_key(name)).collect();
    let files = files.iter().map(|(name, text)| (name.as_str(), text.as_str()));
    let (text, files) = (without_files(text), file_sections(files));
    let parts = [&text, commands, &files].map(str::trim).into_iter();
    let parts: Vec<&str> = parts.filter(|part| !part.is_empty()).collect();
    ScenarioEvent { text: parts.join("\n\n") + "\n", missing }
}

/// Returns the names under which a file is found in a scenario with `[[file]]`: the path from its
/// folder, and for an included file also the path from the folder where the search found it.
fn embedded_names(drafts: &Drafts, setup: &Setup, path: &Path) -> BTreeSet<String> {
    let folder = setup.scenario.folder.as_path();
    let included = drafts.workshop().include_folders();
    let below = |folder: &Path| match folder.as_os_str().is_empty() && path.is_absolute() {
        true => None,
        false => path.strip_prefix(folder).ok().map(Path::to_owned),
    };
    let mut names: BTreeSet<PathBuf> = included.iter().filter_map(|folder| below(folder)).collect();
    names.extend(below(folder));
    if names.is_empty() {
        names.insert(path.to_owned());
    }
    names.iter().map(|name| with_slashes(name)).collect()
}

/// Returns a path with `/` between its parts, which every system reads.
fn with_slashes(path: &Path) -> String {
    if path.is_absolute() {
        return path.display().to_string();
    }
    let parts: Vec<String> =
        path.components().map(|part| part.as_os_str().to_string_lossy().into_owned()).collect();
    parts.join("/")
}

/// Returns the event with the messages about a text.
fn diagnostics(name: &str, diagnostics: Vec<CompilerMessage>) -> DiagnosticsEvent {
    DiagnosticsEvent { name: name.to_owned(), diagnostics }
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
