//! Searches for included files.

use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use super::loader::{IncludeLoader, LIBRARY_FOLDER};
use crate::codes::DiagnosticCode;
use crate::diagnostic::Diagnostic;
use crate::source::Span;

/// The result of a search for an included file.
pub(super) enum IncludeResult<'a> {
    OnDisk { path: PathBuf, identity: PathBuf },
    InWorkingFolder { path: PathBuf, identity: PathBuf },
    InLibrary { name: &'a str, text: &'a str },
}

/// An included file that was not found.
pub(super) struct NotFound {
    searched: Vec<String>,
    suggestion: Option<String>,
    /// The reason why the file next to the including one may not be read, if it may not.
    refusal: Option<String>,
}

/// Searches for the file that `including` calls `name`.
pub(super) fn find<'a>(
    loader: &'a IncludeLoader,
    including: &Path,
    name: &Path,
) -> Result<IncludeResult<'a>, NotFound> {
    let library = || {
        // Installations of Buzz have the library in a folder named `include`.
        let file = name.strip_prefix("include").unwrap_or(name);
        let entry = loader.library.iter().find(|(known, _)| Path::new(known) == file);
        entry.map(|(name, text)| IncludeResult::InLibrary { name, text })
    };
    // Files of the library include each other, even if the user's folders contain files with the
    // same names.
    if including.starts_with(LIBRARY_FOLDER)
        && let Some(found) = library()
    {
        return Ok(found);
    }
    let here = including.parent().unwrap_or(Path::new(""));
    let on_disk = |folder: &Path| {
        let path = folder.join(name);
        loader.files.canonical(&path).map(|identity| (path, identity))
    };
    if let Some((path, identity)) = on_disk(here) {
        return Ok(IncludeResult::OnDisk { path, identity });
    }
    if let Some((path, identity)) = on_disk(&loader.working_folder) {
        return Ok(IncludeResult::InWorkingFolder { path, identity });
    }
    let configured = || loader.folders.iter().chain(&loader.environment).map(PathBuf::as_path);
    if let Some((path, identity)) = configured().find_map(on_disk) {
        return Ok(IncludeResult::OnDisk { path, identity });
    }
    library().ok_or_else(|| {
        let mut folders = vec![here, &loader.working_folder];
        folders.extend(configured());
        folders.dedup();
        let refusal = match loader.files.kind(&here.join(name)) {
            Err(error) if error.kind() == ErrorKind::PermissionDenied => Some(error.to_string()),
            _ => None,
        };
        NotFound { refusal, ..NotFound::new(loader, &folders, name) }
    })
}

impl NotFound {
    fn new(loader: &IncludeLoader, folders: &[&Path], name: &Path) -> Self {
        let mut searched: Vec<String> = folders.iter().map(|folder| shown(folder)).collect();
        if !loader.library.is_empty() {
            searched.push(LIBRARY_FOLDER.to_owned());
        }
        // Only the last part of a path such as `sub/file.bzz` is assumed to be misspelt.
        let parent = name.parent().unwrap_or(Path::new(""));
        let nearby = folders.iter().flat_map(|folder| loader.files.names(&folder.join(parent)));
        let nearby = nearby.map(|file| parent.join(file).display().to_string());
        let shipped = loader.library.iter().map(|(file, _)| (*file).to_owned());
        let suggestion = most_similar(&name.display().to_string(), nearby.chain(shipped));
        NotFound { searched, suggestion, refusal: None }
    }

    pub(super) fn diagnostic(&self, name: &Path, span: Span) -> Diagnostic {
        let name = name.display();
        let searched = self.searched.join(", ");
        let diagnostic = Diagnostic::new(
            DiagnosticCode::IncludeNotFound,
            span,
            format!("there is no file `{name}` to include"),
        )
        .label("not found");
        if let Some(refusal) = &self.refusal {
            return diagnostic.help(format!("`{name}` cannot be read: {refusal}"));
        }
        match &self.suggestion {
            Some(suggestion) => diagnostic
                .help(format!("did you mean `{suggestion}`? Searched in: {searched}"))
                .guess(span, format!("include \"{suggestion}\"")),
            None => diagnostic.help(format!("searched in: {searched}")),
        }
    }
}

/// Returns the candidate that is most similar to `name`, if one is similar enough.
fn most_similar(name: &str, candidates: impl Iterator<Item = String>) -> Option<String> {
    let stem = |file: &str| file.trim_end_matches(".bzz").to_ascii_lowercase();
    let wanted = stem(name);
    let scored = candidates.filter(|file| file.ends_with(".bzz")).map(|file| {
        let likeness = strsim::normalized_damerau_levenshtein(&wanted, &stem(&file));
        (likeness, file)
    });
    let best = scored.max_by(|a, b| a.0.total_cmp(&b.0))?;
    (best.0 > 0.6).then_some(best.1)
}

fn shown(folder: &Path) -> String {
    match folder.as_os_str().is_empty() {
        true => "the working folder".to_owned(),
        false => format!("`{}`", folder.display()),
    }
}

/// Returns the warning for a file that was found in the working folder, where the reference
/// implementation searches, but not at the path in the script.
pub(super) fn working_folder_warning(path: &Path, including: &Path, span: Span) -> Diagnostic {
    let path = path.display();
    Diagnostic::new(
        DiagnosticCode::IncludeFromWorkingFolder,
        span,
        format!("`{path}` is not next to the file that includes it"),
    )
    .label("found in the working folder")
    .help(format!(
        "write the path from the folder of `{}`, or name the folder with `-I`: \
         else the script compiles in this working folder only",
        including.display()
    ))
}
