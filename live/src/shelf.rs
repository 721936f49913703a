//! Scenarios, scripts and robot files in memory, for a page without a server.

use std::fmt;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use bittybuzz_arena::run::{Compiler, Simulation};
use bittybuzz_arena::scenario::{Group, Scenario, ScenarioError};
use bittybuzz_compiler::compile::Compiled;
use bittybuzz_compiler::include::{FileKind, Files, MemoryFiles, SOURCE_BYTES_MAX};

use crate::scenario_files::{ScenarioFiles, program_of, text_of};
use crate::set_up::set_up;
use crate::workshop::Workshop;

/// Files in memory, which the page and the commands of a run share.
#[derive(Clone, Default)]
pub struct SharedFiles(Arc<Mutex<MemoryFiles>>);

impl fmt::Debug for SharedFiles {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("SharedFiles")
    }
}

impl SharedFiles {
    /// Adds a file, or replaces it.
    pub fn add(&self, path: impl AsRef<Path>, text: impl Into<Vec<u8>>) {
        let mut files = self.lock();
        *files = std::mem::take(&mut *files).with(path, text);
    }

    /// Locks the files. A panic of another user leaves them complete, so a poisoned lock is
    /// ignored.
    fn lock(&self) -> MutexGuard<'_, MemoryFiles> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn text(&self, path: &Path) -> Result<String, String> {
        let shown = path.display();
        let bytes = self.lock().read(path, SOURCE_BYTES_MAX);
        let bytes = bytes.map_err(|error| format!("cannot read `{shown}`: {error}\n"))?;
        String::from_utf8(bytes).map_err(|_| format!("`{shown}` is not UTF-8 text\n"))
    }
}

impl Files for SharedFiles {
    fn read(&self, path: &Path, most: usize) -> io::Result<Vec<u8>> {
        self.lock().read(path, most)
    }

    fn kind(&self, path: &Path) -> io::Result<FileKind> {
        self.lock().kind(path)
    }

    fn canonical(&self, path: &Path) -> Option<PathBuf> {
        self.lock().canonical(path)
    }

    fn names(&self, folder: &Path) -> Vec<String> {
        self.lock().names(folder)
    }
}

impl From<SharedFiles> for ScenarioFiles {
    fn from(files: SharedFiles) -> Self {
        ScenarioFiles::new(files)
    }
}

/// A workshop for a scenario among files, on disk or in memory. Drafts are stored in memory, and
/// nothing is written to disk: users download texts to keep them.
pub struct Shelf {
    files: ScenarioFiles,
    drafts: SharedFiles,
    scenario: PathBuf,
}

impl Shelf {
    /// Returns a shelf for the scenario at a path.
    pub fn new(files: impl Into<ScenarioFiles>, scenario: PathBuf) -> Self {
        let files = files.into();
        Shelf { files, drafts: SharedFiles::default(), scenario }
    }

    /// Opens the scenario and compiles its scripts. Returns the run before its first tick, with the
    /// seed of the scenario, and the text of the scenario. An error is a text for users.
    pub fn open(&self, threads: usize) -> Result<(Simulation, String), String> {
        let text = self.files.read_text(&self.scenario)?;
        let setup = set_up(self, &text, &[], &[]).map_err(|errors| text_of(&errors))?;
        let seed = setup.scenario.world.seed;
        let setup = setup.with_compiler(self.compiler());
        let run = Simulation::new(Arc::new(setup), seed, threads);
        Ok((run.map_err(|error| error.to_string())?, text))
    }
}

impl Workshop for Shelf {
    fn scenario(&self) -> &Path {
        &self.scenario
    }

    fn parse(&self, text: &str, values: &[String]) -> Result<Scenario, Vec<ScenarioError>> {
        self.files.parse_scenario(text, &self.scenario, values)
    }

    fn compiler(&self) -> Compiler {
        let (files, drafts) = (self.files.clone(), self.drafts.clone());
        let saved = files.compiler();
        Arc::new(move |script, group| match drafts.text(script) {
            Ok(draft) => {
                let program = program_of(files.compile(script, &draft, group));
                program.map_err(|errors| text_of(&errors))
            }
            Err(_) => saved(script, group),
        })
    }

    fn read(&self, script: &Path) -> Result<String, String> {
        self.files.read_text(script)
    }

    fn compile(&self, script: &Path, text: &str, group: &Group) -> Compiled {
        self.files.compile(script, text, group)
    }

    fn keep(&mut self, script: &Path, text: &str) {
        self.drafts.add(script, text);
    }

    fn may_write(&self, _: &Path) -> bool {
        false
    }

    fn write(&self, script: &Path, _: &str) -> Result<(), String> {
        Err(format!("`{}` is not written: download it", script.display()))
    }
}
