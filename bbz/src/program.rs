//! The input of the commands: an image with the facts about its source, from a script or from a
//! file.

use std::borrow::Cow;
use std::fs;
use std::io::{self, ErrorKind, Read};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use bittybuzz_arena::run;
use bittybuzz_arena::scenario::Group;
use bittybuzz_compiler::bo;
use bittybuzz_compiler::bo::error::BoError;
use bittybuzz_compiler::compile::{self, Compiled, Options};
use bittybuzz_compiler::diagnostic::Diagnostic;
use bittybuzz_compiler::include::{DiskFiles, FileKind, Files, IncludeLoader, SOURCE_BYTES_MAX};
use bittybuzz_compiler::messages::SentMessage;
use bittybuzz_compiler::parser::{self, Parsed};
use bittybuzz_compiler::refusal;
use bittybuzz_compiler::source::SourceMap;
use bittybuzz_compiler::symbols::{Symbols, SymbolsError};
use bittybuzz_fault::{KnownProgram, SourceTexts};
use bittybuzz_live::environment_folders;
use bittybuzz_robot_spec::NumberProfile;
use bittybuzz_toml_reader::file::{self, ReadError};
use bittybuzz_vm_core::{Image, ImageError};

use crate::file_error::FileError;
use crate::problem::Problem;
use crate::report;
use crate::selection::RobotChoice;
use crate::whole_file::Inputs;

/// A reason why a file cannot be the input of a command.
#[derive(Debug, thiserror::Error)]
pub enum InputError {
    /// The name of the file has no known extension.
    #[error("the name `{0}` does not show what kind of file it is")]
    UnknownKind(PathBuf),
    /// An image where a script is needed.
    #[error("`{0}` is an image already")]
    NotAScript(PathBuf),
    /// An object file that is damaged, or that no Buzz compiler has made.
    #[error("`{path}` cannot be used: {error}")]
    Object { path: PathBuf, error: BoError },
    /// `--profile` asks for another profile than the image has.
    #[error("`{path}` was built for the {} profile, which --profile cannot change", .image.name())]
    Profile {
        path: PathBuf,
        /// The profile of the image.
        image: NumberProfile,
    },
    /// Symbols that cannot be used.
    #[error("`{path}` is {error}")]
    Symbols { path: PathBuf, error: SymbolsError },
}

impl Problem for InputError {
    fn help(&self) -> Option<String> {
        Some(match self {
            InputError::UnknownKind(_) => {
                "a script ends in .bzz, a Buzz object file in .bo, an image in .bbi".to_owned()
            }
            InputError::NotAScript(_) => "name the .bzz script that it was built from".to_owned(),
            InputError::Object { .. } => "compile its script instead".to_owned(),
            InputError::Profile { image, .. } => format!(
                "leave out --profile, or build the script again with --profile {}",
                match image {
                    NumberProfile::Tiny => NumberProfile::Full.name(),
                    NumberProfile::Full => NumberProfile::Tiny.name(),
                }
            ),
            InputError::Symbols { .. } => "`bbz build` writes it again".to_owned(),
        })
    }
}

/// The virtual machine refuses an image.
#[derive(Debug, thiserror::Error)]
#[error("`{path}` {}", refusal::sentence(cause))]
pub struct RefusedImage {
    path: PathBuf,
    cause: ImageError,
}

impl RefusedImage {
    /// Returns the error of the image, or of the script, at `path`.
    pub fn new(path: &Path, cause: ImageError) -> Self {
        RefusedImage { path: path.to_owned(), cause }
    }
}

impl Problem for RefusedImage {
    fn help(&self) -> Option<String> {
        refusal::help(&self.cause)
    }
}

/// The beginning of the paths of the shipped library.
const LIBRARY_FOLDER: &str = "<library>/";

/// The content of a file, by its extension.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum InputKind {
    /// `.bzz`
    Script,
    /// `.bo`, the object file of the reference implementation's compiler
    Object,
    /// `.bbi`
    Image,
}

impl InputKind {
    /// Returns the kind of the file at `path`; fails if there is no readable file.
    pub fn of(path: &Path) -> Result<InputKind, Box<dyn Problem>> {
        if is_standard_input(path) {
            return Ok(InputKind::Script);
        }
        let kind = match path.extension().and_then(|extension| extension.to_str()) {
            Some("bzz") => Some(InputKind::Script),
            Some("bo") => Some(InputKind::Object),
            Some("bbi") => Some(InputKind::Image),
            _ => None,
        };
        match fs::metadata(path) {
            Err(error) => Err(FileError::reading(path, error).into()),
            Ok(metadata) if metadata.is_dir() => Err(FileError::Folder(path.to_owned()).into()),
            Ok(_) => {
                let kind = kind.ok_or_else(|| InputError::UnknownKind(path.to_owned()))?;
                file::open(path).map_err(|error| FileError::reading(path, error))?;
                Ok(kind)
            }
        }
    }
}

/// An image, perhaps with its symbols and source.
#[derive(Clone)]
pub struct LoadedProgram {
    pub image: Vec<u8>,
    /// The number profile of the image.
    pub profile: NumberProfile,
    /// Names, texts and places.
    pub symbols: Option<Symbols>,
    /// The source texts, if the program was compiled just now.
    pub sources: Option<Arc<SourceMap>>,
    /// The messages that the script sends, if the program was compiled just now.
    pub messages: Vec<SentMessage>,
}

impl LoadedProgram {
    /// Reads an image, or compiles any other file. Compiling prints errors and warnings, and
    /// returns `None` if there are errors.
    pub fn open(
        path: &Path,
        include: &[PathBuf],
        selection: &RobotChoice,
    ) -> Result<Option<LoadedProgram>, Box<dyn Problem>> {
        LoadedProgram::open_reporting(path, include, selection, |sources, diagnostics| {
            report::diagnostics(sources, diagnostics);
            Ok(())
        })
    }

    /// Returns the program of robots that run a foreign image.
    pub fn empty(group: &Group) -> LoadedProgram {
        let run::Program { image, symbols, .. } = run::Program::empty(group);
        let (profile, messages) = (group.robot.profile, Vec::new());
        let symbols = symbols.map(Arc::unwrap_or_clone);
        LoadedProgram { image: image.to_vec(), profile, symbols, sources: None, messages }
    }

    /// Opens a program as [`LoadedProgram::open`] does, and hands the compiler's messages to `report`.
    pub fn open_reporting(
        path: &Path,
        include: &[PathBuf],
        selection: &RobotChoice,
        report: impl FnOnce(&SourceMap, &[Diagnostic]) -> Result<(), Box<dyn Problem>>,
    ) -> Result<Option<LoadedProgram>, Box<dyn Problem>> {
        let kind = match selection.embedded.contains(path) {
            true => InputKind::Script,
            false => InputKind::of(path)?,
        };
        if kind == InputKind::Image {
            return LoadedProgram::load(path, selection).map(Some);
        }
        let Compiled { image, symbols, messages, diagnostics, sources } =
            compiled(path, kind, include, selection)?;
        report(&sources, &diagnostics)?;
        let profile = selection.effective_profile();
        let sources = Some(Arc::new(sources));
        Ok(image.map(|image| LoadedProgram { image, profile, symbols, sources, messages }))
    }

    /// Opens a program as [`LoadedProgram::open`] does. Also accepts symbols (`.sym`), with the image
    /// next to them if there is one that belongs to them.
    pub fn open_with_symbols(
        path: &Path,
        include: &[PathBuf],
        selection: &RobotChoice,
    ) -> Result<Option<LoadedProgram>, Box<dyn Problem>> {
        if path.extension().is_none_or(|extension| extension != "sym") {
            return LoadedProgram::open(path, include, selection);
        }
        let text = file::read_text(path, file::COMPILED_BYTES_MAX)
            .map_err(|error| FileError::reading(path, error))?;
        let symbols = Symbols::from_json(&text)
            .map_err(|error| InputError::Symbols { path: path.to_owned(), error })?;
        let mut program = LoadedProgram::unknown();
        if let Ok(image) = file::read(&path.with_extension("bbi"), file::COMPILED_BYTES_MAX)
            && Image::new(image.as_slice()).header().is_ok_and(|h| h.hash() == symbols.script_hash)
        {
            program.image = image;
        }
        if symbols.profile == NumberProfile::Tiny.name() {
            program.profile = NumberProfile::Tiny;
        }
        program.symbols = Some(symbols);
        Ok(Some(program))
    }

    /// Adds the file of the program, those next to it, and those that it includes.
    pub fn add_inputs(&self, path: &Path, inputs: &mut Inputs) {
        add_inputs(path, self.sources.as_deref(), inputs);
    }

    /// Returns a program of which nothing is known.
    pub fn unknown() -> LoadedProgram {
        LoadedProgram {
            image: Vec::new(),
            profile: NumberProfile::Full,
            symbols: None,
            sources: None,
            messages: Vec::new(),
        }
    }

    /// Returns the hash of the script; `None` for a program of which nothing is known.
    pub fn script_hash(&self) -> Option<u32> {
        match &self.symbols {
            Some(symbols) => Some(symbols.script_hash),
            None => Image::new(self.image.as_slice()).header().ok().map(|header| header.hash()),
        }
    }

    /// Reads an image, and the symbols next to it if they belong to it.
    fn load(path: &Path, selection: &RobotChoice) -> Result<LoadedProgram, Box<dyn Problem>> {
        let image = read(path)?;
        let header = Image::new(image.as_slice()).header();
        let header = header.map_err(|cause| RefusedImage::new(path, cause))?;
        let profile = if header.is_full() { NumberProfile::Full } else { NumberProfile::Tiny };
        if selection.profile.is_some_and(|asked| asked != profile) {
            return Err(InputError::Profile { path: path.to_owned(), image: profile }.into());
        }
        let symbols = symbols_beside(path, header.hash());
        Ok(LoadedProgram { image, profile, symbols, sources: None, messages: Vec::new() })
    }

    /// Returns the program for reports about its faults.
    pub fn known(&self) -> KnownProgram<'_> {
        let LoadedProgram { image, profile, symbols, .. } = self;
        KnownProgram { image, profile: *profile, symbols: symbols.as_ref(), sources: self }
    }

    /// Returns true if the image itself has the text of its strings.
    pub fn has_text(&self) -> bool {
        let header = Image::new(self.image.as_slice()).header();
        header.is_ok_and(|header| header.has_text())
    }
}

impl SourceTexts for LoadedProgram {
    /// Returns the text of a source file by its number in the symbols. A file that was not compiled
    /// just now is read from disk, and may have changed since.
    fn source(&self, file: u32) -> Option<Cow<'_, str>> {
        if let Some(text) = self.sources.as_ref().and_then(|sources| sources.source(file)) {
            return Some(text);
        }
        let path = self.symbols.as_ref()?.file(file)?;
        let library_name = path.strip_prefix(LIBRARY_FOLDER);
        let mut library = bittybuzz_library::FILES.iter();
        if let Some((_, text)) = library.find(|(name, _)| library_name == Some(name)) {
            return Some(Cow::Borrowed(text));
        }
        file::read_text(Path::new(path), SOURCE_BYTES_MAX as u64).ok().map(Cow::Owned)
    }
}

/// Adds the file at `path`, those next to it, and those that it includes.
pub fn add_inputs(path: &Path, sources: Option<&SourceMap>, inputs: &mut Inputs) {
    inputs.add(path);
    match path.extension().and_then(|extension| extension.to_str()) {
        Some("bo") => inputs.add(&path.with_extension("bdb")),
        Some("bbi") => inputs.add(&path.with_extension("sym")),
        _ => {}
    }
    for (_, source) in sources.iter().flat_map(|sources| sources.files()) {
        inputs.add(&source.path);
    }
}

/// Compiles a script or an object file; an image is an error. Prints warnings about an object file.
pub fn compiled(
    path: &Path,
    kind: InputKind,
    include: &[PathBuf],
    selection: &RobotChoice,
) -> Result<Compiled, Box<dyn Problem>> {
    let options = selection.options();
    match kind {
        InputKind::Script if selection.embedded.include_folder().is_some() => {
            let files = selection.embedded.over(&DiskFiles);
            let parsed = parser::parse_file(path, &loader_of(selection, &files, include));
            Ok(compile::compile_parsed(parsed, &options))
        }
        InputKind::Script => Ok(compile::compile_parsed(parsed(path, include), &options)),
        InputKind::Object => object(path, &options),
        InputKind::Image => Err(InputError::NotAScript(path.to_owned()).into()),
    }
}

/// Compiles the script on standard input as if it were the text of the file at `name`, which need not
/// exist: messages name it, and its folder is searched for included files.
pub fn compiled_from_input(name: &Path, include: &[PathBuf], selection: &RobotChoice) -> Compiled {
    compile::compile_parsed(parsed_from_input(name, include), &selection.options())
}

/// Parses a script with all its includes.
pub fn parsed(path: &Path, include: &[PathBuf]) -> Parsed {
    match is_standard_input(path) {
        true => parsed_from_input(Path::new(STANDARD_INPUT), include),
        false => parser::parse_file(path, &loader(&DiskFiles, include)),
    }
}

fn parsed_from_input(name: &Path, include: &[PathBuf]) -> Parsed {
    parser::parse_file(name, &loader(&StandardInput { name }, include))
}

/// Returns a loader that searches included files in the folders of `-I`, those of the environment,
/// and the library.
pub fn loader<'a>(files: &'a dyn Files, include: &[PathBuf]) -> IncludeLoader<'a> {
    IncludeLoader {
        folders: include.to_vec(),
        environment: environment_folders(),
        library: bittybuzz_library::FILES,
        ..IncludeLoader::new(files)
    }
}

/// Returns a loader as [`loader`] does, which also searches the files of the scenario.
pub fn loader_of<'a>(
    selection: &RobotChoice,
    files: &'a dyn Files,
    include: &[PathBuf],
) -> IncludeLoader<'a> {
    let mut loader = loader(files, include);
    loader.folders.extend(selection.embedded.include_folder().map(Path::to_owned));
    loader
}

/// The name of the script on standard input, for messages.
const STANDARD_INPUT: &str = "<standard input>";

/// Returns true for `-`, the script on standard input.
pub fn is_standard_input(path: &Path) -> bool {
    path.as_os_str() == "-"
}

/// The script on standard input, which includes files from disk.
struct StandardInput<'a> {
    /// The path of the script.
    name: &'a Path,
}

impl Files for StandardInput<'_> {
    fn read(&self, path: &Path, most: usize) -> io::Result<Vec<u8>> {
        if path != self.name {
            return DiskFiles.read(path, most);
        }
        let mut bytes = Vec::new();
        io::stdin().lock().take(most as u64 + 1).read_to_end(&mut bytes)?;
        Ok(bytes)
    }

    fn kind(&self, path: &Path) -> io::Result<FileKind> {
        match path == self.name {
            true => Ok(FileKind::Stream),
            false => DiskFiles.kind(path),
        }
    }

    fn canonical(&self, path: &Path) -> Option<PathBuf> {
        DiskFiles.canonical(path)
    }

    fn names(&self, folder: &Path) -> Vec<String> {
        DiskFiles.names(folder)
    }
}

/// Compiles an object file; the `.bdb` file next to it has the places in the script.
fn object(path: &Path, options: &Options) -> Result<Compiled, Box<dyn Problem>> {
    let debug = debug_beside(path);
    let imported = bo::import(path, &read(path)?, debug.as_deref(), options)
        .map_err(|error| InputError::Object { path: path.to_owned(), error })?;
    for warning in &imported.warnings {
        report::warning(&format!("`{}`: {warning}", path.display()), None);
    }
    Ok(imported.compiled)
}

/// Reads the bytes of an image or an object file.
pub fn read(path: &Path) -> Result<Vec<u8>, FileError> {
    let is_object = path.extension().is_some_and(|extension| extension == "bo");
    let limit = if is_object { file::OBJECT_BYTES_MAX } else { file::COMPILED_BYTES_MAX };
    file::read(path, limit).map_err(|error| FileError::reading(path, error))
}

/// Reads the `.bdb` file next to an object file. Warns if the file exists and cannot be read.
fn debug_beside(object: &Path) -> Option<Vec<u8>> {
    let path = object.with_extension("bdb");
    match file::read(&path, file::COMPILED_BYTES_MAX) {
        Ok(bytes) => Some(bytes),
        Err(ReadError::Io(error)) if error.kind() == ErrorKind::NotFound => None,
        Err(error) => {
            let message = format!("cannot read `{}`: {error}", path.display());
            report::warning(&message, Some("it is ignored: places in the script are not known"));
            None
        }
    }
}

/// Reads the symbols in the `.sym` file next to an image. Warns if the file exists and cannot be
/// used.
fn symbols_beside(image: &Path, hash: u32) -> Option<Symbols> {
    let path = image.with_extension("sym");
    let text = match file::read_text(&path, file::COMPILED_BYTES_MAX) {
        Ok(text) => text,
        Err(ReadError::Io(error)) if error.kind() == ErrorKind::NotFound => return None,
        Err(error) => {
            report::warning(&format!("cannot read `{}`: {error}", path.display()), Some(IGNORED));
            return None;
        }
    };
    match Symbols::from_json(&text) {
        Ok(symbols) if symbols.script_hash == hash => Some(symbols),
        Ok(symbols) => {
            let message = format!(
                "`{}` belongs to script {:08x}, the image to script {hash:08x}",
                path.display(),
                symbols.script_hash
            );
            report::warning(&message, Some(IGNORED));
            None
        }
        Err(error) => {
            report::warning(&format!("`{}` is {error}", path.display()), Some(IGNORED));
            None
        }
    }
}

const IGNORED: &str =
    "it is ignored: places are shown as numbers; `bbz build` writes both files again";
