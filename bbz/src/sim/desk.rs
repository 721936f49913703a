//! Access to the scripts of a scenario for editing and grading: files on disk, and drafts in
//! memory.

use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use bittybuzz_arena::run;
use bittybuzz_arena::scenario::{Group, Scenario, ScenarioError};
use bittybuzz_compiler::compile::{Compiled, compile};
use bittybuzz_compiler::include::{DiskFiles, Files, MemoryFiles, SOURCE_BYTES_MAX};
use bittybuzz_compiler::render::{ColorChoice, Renderer};
use bittybuzz_live::Workshop;
use bittybuzz_toml_reader::file;

use crate::fence::Fence;
use crate::program::{self, LoadedProgram};
use crate::selection::RobotChoice;
use crate::whole_file;

/// The drafts, which the page and the commands of the run share, and the options for scripts.
#[derive(Clone)]
pub struct Desk {
    scenario: PathBuf,
    drafts: Arc<Mutex<MemoryFiles>>,
    include: Vec<PathBuf>,
    /// True if scripts may be written to disk.
    may_write: bool,
    /// The folders from which scripts may include files; `None` for all folders.
    fence: Option<Fence>,
}

impl Desk {
    /// Creates a desk without drafts.
    pub fn new(scenario: &Path, include: &[PathBuf], may_write: bool) -> Self {
        Desk {
            scenario: scenario.to_owned(),
            drafts: Arc::default(),
            include: include.to_vec(),
            may_write,
            fence: None,
        }
    }

    /// Creates a desk for scripts of other people, which may include files only from the scenario's
    /// folder, from `-I` and from the library. Otherwise, `include "/etc/passwd"` would make
    /// messages that quote that file. The scenario was read before.
    pub fn for_scripts_of_others(scenario: &Path, include: &[PathBuf]) -> Self {
        let folder = scenario.parent().expect("a path of a file that was read has a name");
        let folders = include.iter().map(PathBuf::as_path).chain([folder]);
        let fence = Some(Fence::new(folders));
        Desk { fence, ..Desk::new(scenario, include, false) }
    }

    /// Compiles the draft of a script, or else its file. The error contains all diagnostics of the
    /// script.
    fn program(&self, script: &Path, group: &Group) -> Result<run::Program, String> {
        let mut errors = String::new();
        if let Some(text) = self.draft(script) {
            let Compiled { image, symbols, diagnostics, sources, .. } =
                self.compile(script, &text, group);
            let renderer = Renderer::new(&sources);
            diagnostics.iter().for_each(|one| errors += &renderer.text(one, ColorChoice::Never));
            let sources = Arc::new(sources);
            return image.map(|image| run::Program { image, symbols, sources }).ok_or(errors);
        }
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
                Ok(run::Program { image, symbols, sources: sources.unwrap_or_default() })
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
        Scenario::parse_in(&DiskFiles, text, &self.scenario, values, &models)
    }

    fn compiler(&self) -> run::Compiler {
        let desk = self.clone();
        Arc::new(move |script, group| desk.program(script, group))
    }

    fn read(&self, script: &Path) -> Result<String, String> {
        let text = file::read_text(script, SOURCE_BYTES_MAX as u64);
        text.map_err(|error| format!("cannot read `{}`: {error}", script.display()))
    }

    fn compile(&self, script: &Path, text: &str, group: &Group) -> Compiled {
        let options = RobotChoice::of_group(group).options();
        let files: &dyn Files = self.fence.as_ref().map_or(&DiskFiles, |fence| fence);
        compile(script, text.to_owned(), &program::loader(files, &self.include), &options)
    }

    fn keep(&mut self, script: &Path, text: &str) {
        let mut drafts = self.drafts();
        *drafts = std::mem::take(&mut *drafts).with(script, text);
    }

    fn may_write(&self) -> bool {
        self.may_write
    }

    fn write(&self, script: &Path, text: &str) -> Result<(), String> {
        if !self.may_write {
            return Err("scripts are only written if `--edit` was given".to_owned());
        }
        whole_file::write(script, text.as_bytes()).map_err(|problem| problem.to_string())
    }
}
