//! Access to the scripts of a scenario for editing and grading: files on disk, and drafts in
//! memory.

use std::collections::BTreeMap;
use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use bittybuzz_arena::run;
use bittybuzz_arena::scenario::{Group, Scenario, ScenarioError};
use bittybuzz_compiler::compile::Compiled;
use bittybuzz_compiler::include::{Files, MemoryFiles, SOURCE_BYTES_MAX};
use bittybuzz_compiler::render::{ColorChoice, Renderer};
use bittybuzz_live::{ScenarioFiles, Workshop, environment_folders, program_of, text_of};
use bittybuzz_toml_reader::file;

use crate::fence::Fence;
use crate::program::LoadedProgram;
use crate::selection::RobotChoice;
use crate::whole_file;

#[cfg(feature = "view")]
use super::open::Opened;

/// The drafts, which the page and the commands of the run share, and the options for scripts.
#[derive(Clone)]
pub struct Desk {
    scenario: PathBuf,
    drafts: Arc<Mutex<MemoryFiles>>,
    include: Vec<PathBuf>,
    /// The files that can be read.
    fence: Fence,
    /// The scripts that can be written, by the paths in the scenario, with their canonical paths when
    /// the session began. A link that is made later leads to no other file.
    writable: BTreeMap<PathBuf, PathBuf>,
}

impl Desk {
    /// Creates a desk for scripts of other people, which may include files only from the scenario's
    /// folder, from `-I` and from the library. Otherwise, `include "/etc/passwd"` would make
    /// messages that quote that file. The scenario was read before.
    pub fn for_scripts_of_others(scenario: &Path, include: &[PathBuf]) -> Self {
        let folder = scenario.parent().expect("a path of a file that was read has a name");
        let folders = include.iter().map(PathBuf::as_path).chain([folder]);
        Desk {
            scenario: scenario.to_owned(),
            drafts: Arc::default(),
            include: include.to_vec(),
            fence: Fence::new(folders),
            writable: BTreeMap::new(),
        }
    }

    /// Creates a desk for a page. It reads files as [`Desk::for_scripts_of_others`] does, those that
    /// the scenario has read when it was opened, and those of the folders in the environment.
    /// It writes the scripts of the scenario unless `is_read_only`. A scenario that is edited in the
    /// page does not change these sets.
    #[cfg(feature = "view")]
    pub fn for_page(opened: &Opened, include: &[PathBuf], is_read_only: bool) -> Self {
        let mut desk = Desk::for_scripts_of_others(&opened.path, include);
        let environment = environment_folders();
        let inputs = opened.inputs();
        desk.fence = desk
            .fence
            .with_folders(environment.iter().map(PathBuf::as_path))
            .with_files(inputs.paths());
        let scripts = opened.scenario.scripts().map(|(_, script)| script);
        let scripts = scripts.filter(|script| script.extension().is_some_and(|end| end == "bzz"));
        // A script that stands in the scenario has no file.
        let writable = scripts.filter_map(|script| Some((script, fs::canonicalize(script).ok()?)));
        if !is_read_only {
            desk.writable = writable.map(|(script, place)| (script.to_owned(), place)).collect();
        }
        desk
    }

    /// Compiles the draft of a script, or else its file. The error contains all diagnostics of the
    /// script.
    fn program(&self, script: &Path, group: &Group) -> Result<run::Program, String> {
        let text = self.draft(script).or_else(|| group.embedded.text(script));
        let is_script = script.extension().is_some_and(|end| end == "bzz");
        if text.is_some() || is_script {
            let text = text.map_or_else(|| self.read(script), Ok)?;
            let program = program_of(self.compile(script, &text, group));
            return program.map_err(|errors| text_of(&errors));
        }
        let mut errors = String::new();
        self.fence.check(script).map_err(|error| unreadable(script, &error))?;
        let selection = RobotChoice::of_group(group);
        let opened =
            LoadedProgram::open_reporting(script, &self.include, &selection, |sources, found| {
                let renderer = Renderer::new(sources);
                found.iter().for_each(|one| errors += &renderer.text(one, ColorChoice::Never));
                Ok(())
            });
        match opened {
            Err(problem) => Err(problem.to_string()),
            Ok(None) => Err(errors),
            Ok(Some(LoadedProgram { image, symbols, sources, .. })) => {
                Ok(run::Program::new(image, symbols, sources.unwrap_or_default()))
            }
        }
    }

    fn draft(&self, script: &Path) -> Option<String> {
        // A script without a draft is read from disk.
        let bytes = self.drafts().read(script, SOURCE_BYTES_MAX).ok()?;
        Some(String::from_utf8(bytes).expect("`keep` takes a text"))
    }

    /// Locks the drafts. They are valid even after a panic of another thread.
    fn drafts(&self) -> MutexGuard<'_, MemoryFiles> {
        self.drafts.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Workshop for Desk {
    fn scenario(&self) -> &Path {
        &self.scenario
    }

    fn parse(&self, text: &str, values: &[String]) -> Result<Scenario, Vec<ScenarioError>> {
        let models = bittybuzz_robot_models::all();
        Scenario::parse_in(&self.fence, text, &self.scenario, values, &models)
    }

    fn compiler(&self) -> run::Compiler {
        let desk = self.clone();
        Arc::new(move |script, group| desk.program(script, group))
    }

    fn read(&self, script: &Path) -> Result<String, String> {
        self.fence.check(script).map_err(|error| unreadable(script, &error))?;
        let text = file::read_text(script, SOURCE_BYTES_MAX as u64);
        text.map_err(|error| unreadable(script, &error))
    }

    fn compile(&self, script: &Path, text: &str, group: &Group) -> Compiled {
        let files = ScenarioFiles::new(self.fence.clone());
        let files = files.with_folders(self.include.clone(), environment_folders());
        files.compile(script, text, group)
    }

    fn keep(&mut self, script: &Path, text: &str) {
        let mut drafts = self.drafts();
        *drafts = std::mem::take(&mut *drafts).with(script, text);
    }

    fn may_write(&self, script: &Path) -> bool {
        self.writable.contains_key(script)
    }

    fn write(&self, script: &Path, text: &str) -> Result<(), String> {
        let shown = script.display();
        if self.writable.is_empty() {
            return Err(format!("`{shown}` is not written: the session is read-only"));
        }
        let Some(place) = self.writable.get(script) else {
            return Err(format!(
                "`{shown}` is not written: it was no script of the scenario when the session began"
            ));
        };
        match fs::canonicalize(script) {
            // The file was removed meanwhile.
            Err(error) if error.kind() == ErrorKind::NotFound => {}
            Ok(now) if now == *place => {}
            _ => {
                return Err(format!(
                    "`{shown}` is not written: its path leads to another file now"
                ));
            }
        }
        whole_file::write(place, text.as_bytes()).map_err(|problem| problem.to_string())
    }

    fn include_folders(&self) -> Vec<PathBuf> {
        let mut folders = self.include.clone();
        folders.extend(environment_folders());
        folders
    }
}

fn unreadable(path: &Path, error: &dyn std::fmt::Display) -> String {
    format!("cannot read `{}`: {error}", path.display())
}
