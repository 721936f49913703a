//! What the commands work on: an image with what is known of its source, from a script or from a file.

use std::borrow::Cow;
use std::env;
use std::fs;
use std::path::{Path, PathBuf};

use bittybuzz_compiler::compile::{self, Compiled, Options};
use bittybuzz_compiler::include::{DiskFiles, Loader};
use bittybuzz_compiler::parser;
use bittybuzz_compiler::source::{FileId, SourceMap};
use bittybuzz_compiler::symbols::Symbols;
use bittybuzz_robots::Profile;
use bittybuzz_vm_core::{Image, builtin};

use crate::library;
use crate::problem::Problem;
use crate::report;
use crate::selection::Selection;

/// The environment variable with folders to search for included files.
const INCLUDE_PATH: &str = "BUZZ_INCLUDE_PATH";

/// What a file holds, by its extension.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// `.bzz`
    Script,
    /// `.bbi`
    Image,
}

impl Kind {
    /// What the file at `path` holds, once it is sure that there is a file.
    pub fn of(path: &Path) -> Result<Kind, Problem> {
        let kind = match path.extension().and_then(|extension| extension.to_str()) {
            Some("bzz") => Some(Kind::Script),
            Some("bbi") => Some(Kind::Image),
            _ => None,
        };
        match fs::metadata(path) {
            Err(error) => Err(Problem::unreadable(path, error)),
            Ok(metadata) if metadata.is_dir() => Err(Problem::Folder(path.to_owned())),
            Ok(_) => kind.ok_or_else(|| Problem::UnknownKind(path.to_owned())),
        }
    }
}

/// An image, perhaps with its symbols and source.
pub struct Program {
    /// The image.
    pub image: Vec<u8>,
    /// Its number profile.
    pub profile: Profile,
    /// Names, texts and places.
    pub symbols: Option<Symbols>,
    /// What it was compiled from just now.
    sources: Option<SourceMap>,
}

impl Program {
    /// Compiles a script. Prints errors and warnings; `None` if there are errors.
    pub fn compile(
        path: &Path,
        include: &[PathBuf],
        selection: &Selection,
    ) -> Result<Option<Program>, Problem> {
        let Compiled { image, symbols, diagnostics, sources } = compiled(path, include, selection)?;
        report::diagnostics(&sources, &diagnostics);
        let Some(image) = image else { return Ok(None) };
        let profile = selection.effective_profile();
        Ok(Some(Program { image, profile, symbols, sources: Some(sources) }))
    }

    /// Reads an image, and the symbols beside it if they belong to it.
    pub fn load(path: &Path, selection: &Selection) -> Result<Program, Problem> {
        let image = fs::read(path).map_err(|error| Problem::unreadable(path, error))?;
        let header = Image::new(image.as_slice()).header();
        let header = header.map_err(|cause| Problem::refused(path, cause))?;
        let profile = if header.is_full() { Profile::Full } else { Profile::Tiny };
        if selection.profile.is_some_and(|asked| asked != profile) {
            return Err(Problem::Profile { path: path.to_owned(), image: profile });
        }
        let symbols = symbols_beside(path, header.hash);
        Ok(Program { image, profile, symbols, sources: None })
    }

    /// The text of a constant string, if it is known.
    pub fn string(&self, number: u16) -> Option<&str> {
        match &self.symbols {
            Some(symbols) => symbols.string(number),
            None => builtin::STRINGS.get(usize::from(number)).copied(),
        }
    }

    /// The text of a source file by its number in the symbols. For an image the file is read now, and may have
    /// changed since.
    pub fn source(&self, file: u32) -> Option<Cow<'_, str>> {
        if let Some(sources) = &self.sources {
            return Some(Cow::Borrowed(&sources.file(FileId(file)).text));
        }
        let path = self.symbols.as_ref()?.file(file)?;
        if let Some((_, text)) =
            library::FILES.iter().find(|(name, _)| path.strip_prefix("<library>/") == Some(name))
        {
            return Some(Cow::Borrowed(text));
        }
        fs::read_to_string(path).ok().map(Cow::Owned)
    }
}

/// Compiles a script.
pub fn compiled(
    path: &Path,
    include: &[PathBuf],
    selection: &Selection,
) -> Result<Compiled, Problem> {
    // What the file holds is the compiler's concern, that it can be opened is the command line's.
    fs::File::open(path).map_err(|error| Problem::unreadable(path, error))?;
    let environment = env::var_os(INCLUDE_PATH).unwrap_or_default();
    let is_named = |folder: &PathBuf| !folder.as_os_str().is_empty();
    let loader = Loader {
        folders: include.to_vec(),
        environment: env::split_paths(&environment).filter(is_named).collect(),
        library: library::FILES,
        ..Loader::new(&DiskFiles)
    };
    let options = Options {
        profile: Some(selection.effective_profile()),
        robot: selection.robot.clone(),
        robots: selection.known.clone(),
    };
    Ok(compile::compile_parsed(parser::parse_file(path, &loader), &options))
}

/// The symbols in the `.sym` file beside an image; a warning if there are some that cannot be used.
fn symbols_beside(image: &Path, hash: u32) -> Option<Symbols> {
    let path = image.with_extension("sym");
    let text = match fs::read_to_string(&path) {
        Ok(text) => text,
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return None,
        Err(error) => {
            report::warning(&format!("cannot read `{}`: {error}", path.display()), IGNORED);
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
            report::warning(&message, IGNORED);
            None
        }
        Err(error) => {
            report::warning(&format!("`{}` is {error}", path.display()), IGNORED);
            None
        }
    }
}

const IGNORED: &str =
    "it is ignored: places are shown as numbers; `bbz build` writes both files anew";
