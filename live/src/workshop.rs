//! Scripts of a session while they are edited: texts, messages of the compiler, and drafts that
//! robots run.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use bittybuzz_arena::run::{Compiler, Setup};
use bittybuzz_arena::scenario::{Group, Scenario, ScenarioError};
use bittybuzz_compiler::compile::Compiled;
use bittybuzz_compiler::diagnostic::Severity;
use bittybuzz_compiler::include::LIBRARY_FOLDER;
use bittybuzz_compiler::render::Renderer;
use bittybuzz_robot_spec::Robot;

use crate::compiler_message::CompilerMessage;

/// The files of a session, its compiler, and the permission to write.
pub trait Workshop {
    /// Returns the path of the scenario.
    fn scenario(&self) -> &Path;

    /// Parses a text as the scenario at that path. `values` (`medium.ir.loss=0.1`) override its
    /// own.
    fn parse(&self, text: &str, values: &[String]) -> Result<Scenario, Vec<ScenarioError>>;

    /// Returns a compiler that finds scripts by their paths. Kept texts replace files.
    fn compiler(&self) -> Compiler;

    /// Returns the text of a script. An error is a text for users.
    fn read(&self, script: &Path) -> Result<String, String>;

    /// Compiles a text as the script at a path, for the robots of a group.
    fn compile(&self, script: &Path, text: &str, group: &Group) -> Compiled;

    /// Stores a text as the script at a path, without writing a file. Commands load this text from
    /// now on.
    fn keep(&mut self, script: &Path, text: &str);

    /// Returns true if the client may write the file of a script.
    fn may_write(&self, script: &Path) -> bool;

    /// Writes a text to the file of a script. An error is a text for users.
    fn write(&self, script: &Path, text: &str) -> Result<(), String>;

    /// Returns the folders in which included files are searched, next to that of the including file.
    fn include_folders(&self) -> Vec<PathBuf> {
        Vec::new()
    }
}

/// The path and the text of a script.
pub type Text = (PathBuf, String);

/// A version of a script that is not in a file and that robots can run. `path` equals `script` if
/// the run began with this version.
struct Draft {
    script: PathBuf,
    path: PathBuf,
    text: String,
    /// False if no command loads it any more, because it was undone.
    is_loaded: bool,
}

/// A workshop and the drafts that were made in it.
pub struct Drafts {
    workshop: Box<dyn Workshop>,
    drafts: Vec<Draft>,
    /// The texts with which the run began, by their paths: scripts, included files and robot
    /// files. The files may change later.
    begun: BTreeMap<PathBuf, String>,
}

impl Drafts {
    /// Returns a workshop without drafts, for a session with that setup.
    pub fn new(workshop: Box<dyn Workshop>, setup: &Setup) -> Self {
        let mut drafts = Drafts { workshop, drafts: Vec::new(), begun: BTreeMap::new() };
        drafts.begun = drafts.texts(setup);
        drafts
    }

    /// Returns true if the client may write the file of a script.
    pub fn may_write(&self, setup: &Setup, script: &Path) -> bool {
        !setup.scenario.embedded.contains(script) && self.workshop.may_write(script)
    }

    /// Returns the last draft of a script, or else the text of its file.
    pub fn text(&self, setup: &Setup, script: &Path) -> Result<String, String> {
        let last = self.drafts.iter().rfind(|draft| draft.is_loaded && draft.script == script);
        last.map_or_else(|| self.saved(setup, script), |draft| Ok(draft.text.clone()))
    }

    /// Returns the text of a file.
    pub fn saved(&self, setup: &Setup, file: &Path) -> Result<String, String> {
        let embedded = setup.scenario.embedded.text(file);
        embedded.map_or_else(|| self.workshop.read(file), Ok)
    }

    /// Returns the texts that a run with that setup needs, by their paths: scripts with their
    /// drafts, included files and robot files. Images and object files are no texts.
    pub fn texts(&self, setup: &Setup) -> BTreeMap<PathBuf, String> {
        let mut texts = BTreeMap::new();
        for (group, script) in setup.scripts().filter(|(_, script)| is_script(script)) {
            let draft = self.drafts.iter().find(|draft| draft.path == script);
            let text = match (draft, self.begun.get(script)) {
                (Some(draft), _) => Ok(draft.text.clone()),
                (None, Some(text)) => Ok(text.clone()),
                (None, None) => self.saved(setup, script),
            };
            // A file that cannot be read any more is missing in the saved scenario, too.
            let Ok(text) = text else { continue };
            let sources = self.workshop.compile(script, &text, group).sources;
            for (_, source) in sources.files() {
                if !source.path.starts_with(LIBRARY_FOLDER) {
                    let text = self.begun.get(&source.path).unwrap_or(&source.text);
                    texts.insert(source.path.clone(), text.clone());
                }
            }
            texts.insert(script.to_owned(), text);
        }
        for file in setup.scenario.groups.iter().filter_map(|group| group.robot_file.as_ref()) {
            let text = self.begun.get(file).cloned().map_or_else(|| self.saved(setup, file), Ok);
            if let Ok(text) = text {
                texts.insert(file.clone(), text);
            }
        }
        texts
    }

    /// Compiles a text as a script for the robots of some groups, once for each different robot.
    /// Returns each message once, and true if one of them is an error.
    pub fn check<'a>(
        &self,
        groups: impl Iterator<Item = &'a Group>,
        script: &Path,
        text: &str,
    ) -> (Vec<CompilerMessage>, bool) {
        let mut robots: Vec<&Robot> = Vec::new();
        let (mut messages, mut has_error) = (Vec::new(), false);
        for group in groups {
            if robots.contains(&&*group.robot) {
                continue;
            }
            robots.push(&group.robot);
            let compiled = self.workshop.compile(script, text, group);
            let renderer = Renderer::new(&compiled.sources);
            for one in &compiled.diagnostics {
                has_error |= one.severity() == Severity::Error;
                let message = CompilerMessage::of_diagnostic(&renderer, one);
                if !messages.contains(&message) {
                    messages.push(message);
                }
            }
        }
        (messages, has_error)
    }

    /// Returns the texts with which the run began, by their paths.
    pub fn all_begun(&self) -> &BTreeMap<PathBuf, String> {
        &self.begun
    }

    /// Returns the text of a script with which the run began.
    pub fn begun(&self, script: &Path) -> Option<&str> {
        self.begun.get(script).map(String::as_str)
    }

    /// Stores a text as a draft of a script and returns its path. The first draft of `walk.bzz` is
    /// `walk.1.bzz`, unless this file exists. The same text gets no second draft.
    pub fn keep(&mut self, setup: &Setup, script: &Path, text: &str) -> PathBuf {
        let same = |draft: &&Draft| draft.script == script && draft.text == text;
        if let Some(draft) = self.drafts.iter().find(same) {
            return draft.path.clone();
        }
        let stem = script.file_stem().expect("a script ends in `.bzz`").to_string_lossy();
        let mut number = 1;
        let path = loop {
            let path = script.with_file_name(format!("{stem}.{number}.bzz"));
            let is_draft = self.drafts.iter().any(|draft| draft.path == path);
            if !is_draft && self.saved(setup, &path).is_err() {
                break path;
            }
            number += 1;
        };
        self.workshop.keep(&path, text);
        let (script, text) = (script.to_owned(), text.to_owned());
        self.drafts.push(Draft { script, path: path.clone(), text, is_loaded: true });
        path
    }

    /// Returns the number of drafts.
    pub fn count(&self) -> usize {
        self.drafts.len()
    }

    /// Removes the drafts after the first `count` ones, which no robot runs.
    pub fn truncate(&mut self, count: usize) {
        self.drafts.truncate(count);
    }

    /// Makes the draft at a path the last one, because robots have loaded it.
    pub fn loaded(&mut self, path: &Path) {
        self.drafts.sort_by_key(|draft| draft.path == path);
        self.drafts.iter_mut().filter(|draft| draft.path == path).for_each(|draft| {
            draft.is_loaded = true;
        });
    }

    /// Makes the drafts at some paths, in this order, the last ones. Others that robots have loaded
    /// before count no more.
    pub fn set_loaded(&mut self, paths: Vec<PathBuf>) {
        for draft in &mut self.drafts {
            draft.is_loaded = draft.path == draft.script;
        }
        paths.iter().for_each(|path| self.loaded(path));
    }

    /// Returns the script of which a file is a draft, or else the file.
    pub fn script_of<'a>(&'a self, file: &'a Path) -> &'a Path {
        let draft = self.drafts.iter().find(|draft| draft.path == file);
        draft.map_or(file, |draft| &draft.script)
    }

    /// Returns the workshop.
    pub fn workshop(&self) -> &dyn Workshop {
        &*self.workshop
    }

    /// Returns the last draft of each script that has one.
    pub fn last(&self) -> Vec<Text> {
        let mut last: Vec<Text> = Vec::new();
        for Draft { script, text, .. } in self.drafts.iter().rev().filter(|one| one.is_loaded) {
            if last.iter().all(|(path, _)| path != script) {
                last.push((script.clone(), text.clone()));
            }
        }
        last
    }

    /// Prepares a run with another setup, which begins with these texts of scripts.
    pub fn begin(&mut self, setup: &Setup, mut texts: Vec<Text>) {
        // A text that is the one of its file needs no draft, unless an earlier draft hides the file.
        texts.retain(|(script, text)| {
            let has_draft = self.drafts.iter().any(|draft| draft.script == *script);
            has_draft || self.saved(setup, script).as_ref() != Ok(text)
        });
        texts.iter().for_each(|(script, text)| self.workshop.keep(script, text));
        let draft = |(script, text): Text| {
            let path = script.clone();
            Draft { script, path, text, is_loaded: true }
        };
        self.drafts = texts.into_iter().map(draft).collect();
        self.begun.clear();
        self.begun = self.texts(setup);
    }

    /// Writes a text to the file of a script.
    pub fn write(&mut self, script: &Path, text: &str) -> Result<(), String> {
        self.workshop.write(script, text)
    }
}

/// Returns true for the path of a script, and false for that of an image or object file.
fn is_script(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension == "bzz")
}

/// Returns the scripts of a scenario, each once, without images and object files.
pub fn scripts(scenario: &Scenario) -> Vec<&Path> {
    let mut scripts: Vec<&Path> = Vec::new();
    for (_, path) in scenario.scripts() {
        if is_script(path) && !scripts.contains(&path) {
            scripts.push(path);
        }
    }
    scripts
}

/// Returns the groups that run a script, from the start or after an event.
pub fn groups_with<'a>(
    scenario: &'a Scenario,
    script: &'a Path,
) -> impl Iterator<Item = &'a Group> {
    scenario.scripts().filter(move |(_, of)| *of == script).map(|(group, _)| group)
}
