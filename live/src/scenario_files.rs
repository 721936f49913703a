//! A scenario and its scripts in files, on disk or in memory: opened, parsed and compiled.
//!
//! The tool `bbz`, the page without a server and the Python module compile scripts by this module, so
//! that one script has the same image and the same messages everywhere.

use std::collections::HashMap;
use std::convert::Infallible;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::ptr;
use std::sync::Arc;

use bittybuzz_arena::run::{Compiler, Program, Setup, SetupError};
use bittybuzz_arena::scenario::{Backend, Group, Scenario, ScenarioError};
use bittybuzz_compiler::bo;
use bittybuzz_compiler::compile::{Compiled, Options, compile};
use bittybuzz_compiler::diagnostic::Severity;
use bittybuzz_compiler::include::{DiskFiles, Files, IncludeLoader, SOURCE_BYTES_MAX};
use bittybuzz_compiler::refusal;
use bittybuzz_compiler::render::Renderer;
use bittybuzz_compiler::symbols::Symbols;
use bittybuzz_robot_files::all_shipped;
use bittybuzz_robot_spec::Robot;
use bittybuzz_vm_core::Image;

use crate::compiler_message::CompilerMessage;

/// The largest scenario, image or object file in bytes.
const FILE_BYTES_MAX: usize = 64 << 20;

/// The environment variable with folders to search for included files.
const INCLUDE_PATH: &str = "BUZZ_INCLUDE_PATH";

/// Files from which scenarios are opened and scripts are compiled.
#[derive(Clone)]
pub struct ScenarioFiles {
    files: Arc<dyn Files + Send + Sync>,
    /// Folders to search for included files, before those of the environment.
    include: Vec<PathBuf>,
    environment: Vec<PathBuf>,
}

impl ScenarioFiles {
    /// Returns files without folders for included files, other than those of the including files and
    /// the library.
    pub fn new(files: impl Files + Send + Sync + 'static) -> Self {
        ScenarioFiles { files: Arc::new(files), include: Vec::new(), environment: Vec::new() }
    }

    /// Returns the files on disk, with the folders of the environment variable `BUZZ_INCLUDE_PATH`.
    pub fn on_disk() -> Self {
        ScenarioFiles::new(DiskFiles).with_folders(Vec::new(), environment_folders())
    }

    /// Sets the folders in which included files are searched: those of the caller, and then those
    /// of the environment.
    #[must_use]
    pub fn with_folders(self, include: Vec<PathBuf>, environment: Vec<PathBuf>) -> Self {
        ScenarioFiles { include, environment, ..self }
    }

    /// Opens a scenario and compiles its scripts. `values` (`medium.ir.loss=0.1`) override those of
    /// the file.
    pub fn open(&self, path: &Path, values: &[String]) -> Result<Setup, Vec<CompilerMessage>> {
        self.set_up(Scenario::open_in(&*self.files, path, values, &bittybuzz_robot_models::all()))
    }

    /// Parses a text as the scenario at a path, and compiles its scripts, as [`open`](Self::open)
    /// does.
    pub fn parse(
        &self,
        text: &str,
        path: &Path,
        values: &[String],
    ) -> Result<Setup, Vec<CompilerMessage>> {
        self.set_up(self.parse_scenario(text, path, values))
    }

    /// Parses a text as the scenario at a path, without its scripts.
    pub fn parse_scenario(
        &self,
        text: &str,
        path: &Path,
        values: &[String],
    ) -> Result<Scenario, Vec<ScenarioError>> {
        Scenario::parse_in(&*self.files, text, path, values, &bittybuzz_robot_models::all())
    }

    /// Compiles the scripts of a scenario that was read. Commands can load scripts from these files.
    fn set_up(
        &self,
        scenario: Result<Scenario, Vec<ScenarioError>>,
    ) -> Result<Setup, Vec<CompilerMessage>> {
        let scenario = scenario.map_err(|errors| messages(&errors))?;
        let setup = setup(scenario, |script, group| self.program(script, group))?;
        Ok(setup.with_compiler(self.compiler()))
    }

    /// Returns a compiler for the scripts that commands load.
    pub fn compiler(&self) -> Compiler {
        let files = self.clone();
        Arc::new(move |script, group| {
            files.program(script, group).map_err(|errors| text_of(&errors))
        })
    }

    /// Compiles a text as the script at a path, for the robots of a group. Files that stand in the
    /// scenario come before others.
    pub fn compile(&self, script: &Path, text: &str, group: &Group) -> Compiled {
        let files = group.embedded.over(&*self.files);
        let mut folders = self.include.clone();
        folders.extend(group.embedded.include_folder().map(Path::to_owned));
        let loader = IncludeLoader {
            folders,
            environment: self.environment.clone(),
            library: bittybuzz_library::FILES,
            ..IncludeLoader::new(&files)
        };
        compile(script, text.to_owned(), &loader, &options_of(group))
    }

    /// Compiles a script for the robots of a group, or reads its image (`.bbi`) or object file
    /// (`.bo`). The errors are those of the compiler, or a single one about the file.
    pub fn program(&self, script: &Path, group: &Group) -> Result<Program, Vec<CompilerMessage>> {
        let alone = |text: String| vec![CompilerMessage::error(text)];
        if let Some(text) = self.text(script, group) {
            return program_of(self.compile(script, &text.map_err(alone)?, group));
        }
        match script.extension().and_then(OsStr::to_str) {
            // The files of a WebAssembly module are texts; the early return keeps the importer out of it.
            Some("bo" | "bbi") if cfg!(target_family = "wasm") => Err(alone(format!(
                "`{}` is not a text: this page runs scripts that end in .bzz",
                script.display()
            ))),
            Some("bo") => {
                let bytes = self.read(script).map_err(alone)?;
                let debug = self.read(&script.with_extension("bdb")).ok();
                let imported = bo::import(script, &bytes, debug.as_deref(), &options_of(group));
                let unusable = |error| alone(format!("`{}`: {error}", script.display()));
                program_of(imported.map_err(unusable)?.compiled)
            }
            Some("bbi") => {
                let image = self.read(script).map_err(alone)?;
                let header = Image::new(image.as_slice()).header();
                let header = header.map_err(|cause| {
                    let shown = script.display();
                    alone(format!("`{shown}` {}", refusal::sentence(&cause)))
                })?;
                let symbols = self.symbols(&script.with_extension("sym"), header.hash());
                Ok(Program::new(image, symbols, Arc::default()))
            }
            _ => Err(alone(format!(
                "the name `{}` does not show what kind of file it is: a script ends in .bzz, a Buzz object file in .bo, an image in .bbi",
                script.display()
            ))),
        }
    }

    /// Returns the text of a script, in the scenario or in its file. Returns `None` for an image or
    /// object file.
    fn text(&self, script: &Path, group: &Group) -> Option<Result<String, String>> {
        if let Some(text) = group.embedded.text(script) {
            return Some(Ok(text));
        }
        let is_script = script.extension().is_some_and(|extension| extension == "bzz");
        is_script.then(|| self.read_text(script))
    }

    /// Reads the text of a script. An error is a text for users.
    pub fn read_text(&self, path: &Path) -> Result<String, String> {
        let shown = path.display();
        let bytes = self.files.read(path, SOURCE_BYTES_MAX);
        let bytes = bytes.map_err(|error| format!("cannot read `{shown}`: {error}"))?;
        String::from_utf8(bytes).map_err(|_| format!("`{shown}` is not UTF-8 text"))
    }

    fn read(&self, path: &Path) -> Result<Vec<u8>, String> {
        let shown = path.display();
        let bytes = self.files.read(path, FILE_BYTES_MAX);
        let bytes = bytes.map_err(|error| format!("cannot read `{shown}`: {error}"))?;
        match bytes.len() > FILE_BYTES_MAX {
            true => Err(format!("`{shown}` is larger than {FILE_BYTES_MAX} bytes")),
            false => Ok(bytes),
        }
    }

    /// Returns the symbols in a file, if they are those of the script with that hash. Other symbols
    /// would name other variables.
    fn symbols(&self, path: &Path, hash: u32) -> Option<Symbols> {
        let text = String::from_utf8(self.read(path).ok()?).ok()?;
        Symbols::from_json(&text).ok().filter(|symbols| symbols.script_hash == hash)
    }
}

/// Returns the folders of the environment in which included files are searched.
pub fn environment_folders() -> Vec<PathBuf> {
    let environment = std::env::var_os(INCLUDE_PATH).unwrap_or_default();
    let is_named = |folder: &PathBuf| !folder.as_os_str().is_empty();
    std::env::split_paths(&environment).filter(is_named).collect()
}

/// Returns the options of the compiler for the robots of a group. The other robots of its scenario
/// are known too, because one script may be for all of them.
fn options_of(group: &Group) -> Options {
    let mut robots = all_shipped();
    let others = group.robots_of_scenario.iter();
    let others: Vec<_> = others.filter(|other| !robots.contains(other)).cloned().collect();
    robots.extend(others);
    let (robot, outside) = (Some((*group.robot).clone()), (*group.outside).clone());
    Options { robot, robots, profile: None, outside }
}

/// Returns the program of a script without mistakes, or else its errors.
pub fn program_of(compiled: Compiled) -> Result<Program, Vec<CompilerMessage>> {
    if let Some(image) = compiled.image {
        return Ok(Program::new(image, compiled.symbols, Arc::new(compiled.sources)));
    }
    let renderer = Renderer::new(&compiled.sources);
    let errors = compiled.diagnostics.iter().filter(|one| one.severity() == Severity::Error);
    Err(errors.map(|one| CompilerMessage::of_diagnostic(&renderer, one)).collect())
}

/// Calls `compile` for each program of a scenario, and once for programs that are alike: groups with
/// one script and one robot, of which there may be thousands, share a program.
pub fn programs<'s, P: Clone, E>(
    scenario: &'s Scenario,
    mut compile: impl FnMut(&'s Group, Option<&'s Path>) -> Result<P, E>,
) -> Result<Vec<P>, E> {
    /// The programs of one script for robots of one name.
    type Alike<'s, P> = Vec<(&'s Robot, P)>;
    let mut known: HashMap<(Option<&Path>, &str), Alike<'s, P>> = HashMap::new();
    let mut programs = Vec::new();
    for (group, script) in scenario.programs() {
        let robot = &*group.robot;
        let alike = known.entry((script, robot.name.as_str())).or_default();
        let same = alike.iter().find(|(other, _)| ptr::eq(*other, robot) || *other == robot);
        let program = match same {
            Some((_, program)) => program.clone(),
            None => {
                let program = compile(group, script)?;
                alike.push((robot, program.clone()));
                program
            }
        };
        programs.push(program);
    }
    Ok(programs)
}

/// Joins a scenario and the programs of its scripts. Mistakes of all scripts are reported, each
/// once. Robots with their own firmware are refused, because emulators are other programs.
pub fn setup(
    scenario: Scenario,
    mut compile: impl FnMut(&Path, &Group) -> Result<Program, Vec<CompilerMessage>>,
) -> Result<Setup, Vec<CompilerMessage>> {
    if let Some(group) = scenario.groups.iter().find(|group| group.backend != Backend::Vm) {
        let robots = &group.robot.name;
        let text = format!("{robots} robots with backend = \"firmware\" run by `bbz sim` alone");
        return Err(vec![CompilerMessage::error(text)]);
    }
    let mut errors: Vec<CompilerMessage> = Vec::new();
    let compiled = programs(&scenario, |group, script| {
        // The robots run in virtual machines, so that each has a script.
        let Some(script) = script else { return Ok::<_, Infallible>(None) };
        let found = match compile(script, group) {
            Ok(program) => return Ok(Some(program)),
            Err(found) => found,
        };
        for one in found {
            if !errors.contains(&one) {
                errors.push(one);
            }
        }
        Ok(None)
    });
    let Ok(compiled) = compiled;
    let compiled: Vec<Program> = compiled.into_iter().flatten().collect();
    if !errors.is_empty() {
        return Err(errors);
    }
    let scenario = Arc::new(scenario);
    Setup::new(scenario.clone(), compiled).map_err(|error| match error {
        SetupError::Scenario(errors) => messages(&errors),
        SetupError::Refused { program, cause } => {
            let script = scenario.programs().nth(program.0).and_then(|(_, script)| script);
            let script =
                script.map_or("a script".to_owned(), |path| format!("`{}`", path.display()));
            vec![CompilerMessage::error(format!("{script} {}", refusal::sentence(&cause)))]
        }
    })
}

/// Returns the mistakes of a scenario as messages.
pub fn messages(errors: &[ScenarioError]) -> Vec<CompilerMessage> {
    errors.iter().map(CompilerMessage::of_scenario).collect()
}

/// Formats messages as text: a line or two for each.
pub fn text_of(errors: &[CompilerMessage]) -> String {
    let texts = errors.iter().map(|error| {
        let place = match (&error.file, error.line, error.column) {
            (Some(file), Some(line), Some(column)) => format!("{file}:{line}:{column}: "),
            _ => String::new(),
        };
        let code = error.code.as_ref().map(|code| format!("{code}: ")).unwrap_or_default();
        let help = error.help.as_ref().map(|help| format!("  help: {help}\n"));
        format!("{place}{code}{}\n{}", error.message, help.unwrap_or_default())
    });
    texts.collect()
}
