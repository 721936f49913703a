//! Scenarios, scripts and robot files in memory, for a page without a server.

use std::fmt;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use bittybuzz_arena::run::{Compiler, Program, Simulation};
use bittybuzz_arena::scenario::{Group, Scenario, ScenarioError};
use bittybuzz_compiler::compile::{Compiled, Options, compile};
use bittybuzz_compiler::include::{Files, IncludeLoader, MemoryFiles, SOURCE_BYTES_MAX};
use bittybuzz_compiler::render::{ColorChoice, Renderer};
use bittybuzz_robot_files::all_shipped;

use crate::set_up::{set_up, text_of};
use crate::workshop::Workshop;

/// The most messages about a script in an error.
const MESSAGES_MAX: usize = 100;

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

    fn read(&self, path: &Path) -> Result<String, String> {
        let shown = path.display();
        let bytes = self.lock().read(path, SOURCE_BYTES_MAX);
        let bytes = bytes.map_err(|error| format!("cannot read `{shown}`: {error}\n"))?;
        String::from_utf8(bytes).map_err(|_| format!("`{shown}` is not UTF-8 text\n"))
    }

    /// Compiles a text for the robots of a group.
    fn compile(&self, script: &Path, text: String, group: &Group) -> Compiled {
        let robot = Some((*group.robot).clone());
        let mut robots = all_shipped();
        let others = group.robots_of_scenario.iter();
        let others: Vec<_> = others.filter(|other| !robots.contains(other)).cloned().collect();
        robots.extend(others);
        let outside = (*group.outside).clone();
        let options = Options { robot, robots, profile: None, outside };
        let files = &*self.lock();
        let files = group.embedded.over(files);
        let folders = group.embedded.include_folder().map(Path::to_owned).into_iter().collect();
        let library = bittybuzz_library::FILES;
        let loader = IncludeLoader { library, folders, ..IncludeLoader::new(&files) };
        compile(script, text, &loader, &options)
    }

    /// Compiles a script for the robots of a group: its draft, or else the file. An error is a text
    /// for users.
    fn program(&self, drafts: &Self, script: &Path, group: &Group) -> Result<Program, String> {
        let draft = drafts.read(script).ok().or_else(|| group.embedded.text(script));
        let text = draft.map_or_else(|| self.read(script), Ok)?;
        let compiled = self.compile(script, text, group);
        let Some(image) = compiled.image else {
            let renderer = Renderer::new(&compiled.sources);
            // Each shows its line, which may be the whole script.
            let texts = compiled.diagnostics.iter().take(MESSAGES_MAX);
            return Err(texts.map(|one| renderer.text(one, ColorChoice::Never)).collect());
        };
        let (symbols, sources) = (compiled.symbols, Arc::new(compiled.sources));
        Ok(Program::new(image, symbols, sources))
    }
}

/// A workshop for a scenario among files in memory. Drafts are stored there, and nothing is written
/// to disk: users download texts to keep them.
#[derive(Debug)]
pub struct Shelf {
    files: SharedFiles,
    drafts: SharedFiles,
    scenario: PathBuf,
}

impl Shelf {
    /// Returns a shelf for the scenario at a path.
    pub fn new(files: SharedFiles, scenario: PathBuf) -> Self {
        Shelf { files, drafts: SharedFiles::default(), scenario }
    }

    /// Opens the scenario and compiles its scripts. Returns the run before its first tick, with the
    /// seed of the scenario, and the text of the scenario. An error is a text for users.
    pub fn open(&self, threads: usize) -> Result<(Simulation, String), String> {
        let text = self.files.read(&self.scenario)?;
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
        let files = &*self.files.lock();
        Scenario::parse_in(files, text, &self.scenario, values, &bittybuzz_robot_models::all())
    }

    fn compiler(&self) -> Compiler {
        let (files, drafts) = (self.files.clone(), self.drafts.clone());
        Arc::new(move |script, group| files.program(&drafts, script, group))
    }

    fn read(&self, script: &Path) -> Result<String, String> {
        self.files.read(script)
    }

    fn compile(&self, script: &Path, text: &str, group: &Group) -> Compiled {
        self.files.compile(script, text.to_owned(), group)
    }

    fn keep(&mut self, script: &Path, text: &str) {
        self.drafts.add(script, text);
    }

    fn may_write(&self, _: &Path) -> bool {
        false
    }

    fn write(&self, script: &Path, _: &str) -> Result<(), String> {
        Err(format!("`{}` is in this page alone: download it", script.display()))
    }
}
