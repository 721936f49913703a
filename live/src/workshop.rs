//! Scripts of a session while they are edited: texts, messages of the compiler, and drafts that
//! robots run.

use std::path::{Path, PathBuf};

use bittybuzz_arena::run::{Compiler, Setup};
use bittybuzz_arena::scenario::{Group, Scenario, ScenarioError};
use bittybuzz_compiler::compile::Compiled;
use bittybuzz_compiler::diagnostic::Severity;
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

    /// Returns true if the client may write scripts.
    fn may_write(&self) -> bool;

    /// Writes a text to the file of a script. An error is a text for users.
    fn write(&self, script: &Path, text: &str) -> Result<(), String>;
}

/// The path and the text of a script.
pub type Text = (PathBuf, String);

/// A version of a script that is not in a file and that robots can run. `path` equals `script` if
/// the session began with this version.
struct Draft {
    script: PathBuf,
    path: PathBuf,
    text: String,
}

/// A workshop and the drafts that were made in it.
pub struct Drafts {
    workshop: Box<dyn Workshop>,
    drafts: Vec<Draft>,
    /// Scripts whose files were overwritten, with the texts that the run began with.
    originals: Vec<Text>,
}

impl Drafts {
    /// Returns a workshop without drafts.
    pub fn new(workshop: Box<dyn Workshop>) -> Self {
        Drafts { workshop, drafts: Vec::new(), originals: Vec::new() }
    }

    /// Returns true if the client may write scripts.
    pub fn may_write(&self) -> bool {
        self.workshop.may_write()
    }

    /// Returns the last draft of a script, or else the text of its file.
    pub fn text(&self, script: &Path) -> Result<String, String> {
        let last = self.drafts.iter().rfind(|draft| draft.script == script);
        last.map_or_else(|| self.workshop.read(script), |draft| Ok(draft.text.clone()))
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
            if robots.contains(&&group.robot) {
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

    /// Returns the text of a script with which the session began.
    pub fn begun(&self, script: &Path) -> Result<String, String> {
        let original = self.originals.iter().find(|(path, _)| path == script);
        let draft = self.drafts.iter().find(|draft| draft.path == script);
        let kept = original.map(|(_, text)| text).or(draft.map(|draft| &draft.text));
        kept.map_or_else(|| self.workshop.read(script), |text| Ok(text.clone()))
    }

    /// Stores a text as a draft of a script and returns its path. The first draft of `walk.bzz` is
    /// `walk.1.bzz`, unless this file exists. The same text gets no second draft.
    pub fn keep(&mut self, script: &Path, text: &str) -> PathBuf {
        let same = |draft: &&Draft| draft.script == script && draft.text == text;
        if let Some(draft) = self.drafts.iter().find(same) {
            return draft.path.clone();
        }
        let stem = script.file_stem().expect("a script ends in `.bzz`").to_string_lossy();
        let mut number = 1;
        let path = loop {
            let path = script.with_file_name(format!("{stem}.{number}.bzz"));
            let is_draft = self.drafts.iter().any(|draft| draft.path == path);
            if !is_draft && self.workshop.read(&path).is_err() {
                break path;
            }
            number += 1;
        };
        self.workshop.keep(&path, text);
        let draft = Draft { script: script.to_owned(), path: path.clone(), text: text.to_owned() };
        self.drafts.push(draft);
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
        for Draft { script, text, .. } in self.drafts.iter().rev() {
            if last.iter().all(|(path, _)| path != script) {
                last.push((script.clone(), text.clone()));
            }
        }
        last
    }

    /// Prepares a new session that begins with these texts of scripts.
    pub fn begin(&mut self, mut texts: Vec<Text>) {
        // A text that is the one of its file needs no draft, unless an earlier draft hides the file.
        texts.retain(|(script, text)| {
            let has_draft = self.drafts.iter().any(|draft| draft.script == *script);
            has_draft || self.workshop.read(script).as_ref() != Ok(text)
        });
        texts.iter().for_each(|(script, text)| self.workshop.keep(script, text));
        let draft = |(script, text): Text| Draft { path: script.clone(), script, text };
        self.drafts = texts.into_iter().map(draft).collect();
        self.originals.clear();
    }

    /// Writes a text to the file of a script, and keeps the text that the run began with.
    pub fn write(&mut self, script: &Path, text: &str) -> Result<(), String> {
        let before = self.workshop.read(script)?;
        self.workshop.write(script, text)?;
        let is_draft = self.drafts.iter().any(|draft| draft.path == script);
        if !is_draft && self.originals.iter().all(|(of, _)| of != script) {
            self.originals.push((script.to_owned(), before));
        }
        Ok(())
    }

    /// Returns the scripts that a saved session needs and that are not in files: the drafts that
    /// were loaded, and the original texts of scripts that were overwritten.
    pub fn needed(&self, setup: &Setup) -> Vec<(&Path, &str)> {
        let is_loaded = |draft: &&Draft| setup.scripts().any(|(_, path)| path == draft.path);
        let drafts = self.drafts.iter().filter(is_loaded);
        let originals = self.originals.iter().map(|(path, text)| (&**path, &**text));
        originals.chain(drafts.map(|draft| (&*draft.path, &*draft.text))).collect()
    }
}

/// Returns the scripts of a scenario, each once, without images and object files.
pub fn scripts(scenario: &Scenario) -> Vec<&Path> {
    let mut scripts: Vec<&Path> = Vec::new();
    for (_, path) in scenario.programs() {
        if path.extension().is_some_and(|extension| extension == "bzz") && !scripts.contains(&path)
        {
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
    scenario.programs().filter(move |(_, of)| *of == script).map(|(group, _)| group)
}
