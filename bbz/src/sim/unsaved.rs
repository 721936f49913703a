//! Texts that were typed in the page and not saved, in private files of the user.
//!
//! Each file has one text of one client. A client writes only its own file, so that a text stays
//! until a user restores or discards it.

use std::collections::{BTreeMap, BTreeSet};
use std::env;
use std::ffi::OsString;
use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::time::{SystemTime, UNIX_EPOCH};

use bittybuzz_live::{KeptText, UnsavedStore, sha256};
use bittybuzz_toml_reader::file;
use serde_json::{Value, json};
use tempfile::Builder;

/// The most bytes of a file: a request of the page, with room for escapes.
const BYTES_MAX: u64 = 16 << 20;

/// The ending of the files.
const ENDING: &str = ".json";

/// The unsaved texts of the user.
#[derive(Default)]
pub struct UnsavedFiles {
    /// `None` if the environment names no folder of the user.
    folder: Option<PathBuf>,
    /// The file of this client's text, by the file that was changed.
    own: BTreeMap<PathBuf, PathBuf>,
    /// The names of the files that were offered to this client.
    offered: BTreeSet<String>,
}

impl UnsavedFiles {
    /// Returns the store of this user, without reading or writing anything.
    pub fn new() -> Self {
        UnsavedFiles { folder: folder(|name| env::var_os(name)), ..UnsavedFiles::default() }
    }

    /// Returns the files with texts of a file, without that of this client.
    fn others(&self, file: &Path) -> Vec<PathBuf> {
        let prefix = prefix(file);
        let entries = self.folder.as_ref().and_then(|folder| fs::read_dir(folder).ok());
        let names = entries.into_iter().flatten().flatten().map(|entry| entry.path());
        let mut names: Vec<PathBuf> = names
            .filter(|path| {
                let name = path.file_name().unwrap_or_default().to_string_lossy();
                name.starts_with(&prefix) && name.ends_with(ENDING)
            })
            .filter(|path| self.own.get(file) != Some(path))
            .collect();
        names.sort();
        names
    }

    /// Writes the text of this client, whole or not at all.
    fn write(&mut self, file: &Path, over: &str, text: &str) -> io::Result<()> {
        let folder = self.folder.as_ref().ok_or_else(|| {
            io::Error::new(io::ErrorKind::NotFound, "no variable of the environment names a folder")
        })?;
        create_private(folder)?;
        let seconds = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default().as_secs();
        let path = canonical(file).display().to_string();
        let content = json!({ "path": path, "seconds": seconds, "over": over, "text": text });
        // Only the user can read a temporary file, from its creation on. Its name begins with a dot
        // until it is complete.
        let prefix = format!(".{}", prefix(file));
        let mut aside = Builder::new().prefix(&prefix).suffix(ENDING).tempfile_in(folder)?;
        aside.write_all(content.to_string().as_bytes())?;
        let name = aside.path().file_name().expect("a temporary file has a name").to_string_lossy();
        let new = folder.join(name.trim_start_matches('.'));
        let place = self.own.get(file).cloned().unwrap_or(new);
        // A crash of the computer may lose the last seconds; the end of this process does not.
        aside.persist(&place)?;
        self.own.insert(file.to_owned(), place);
        Ok(())
    }
}

impl UnsavedStore for UnsavedFiles {
    fn begin(&mut self) {
        self.own.clear();
        self.offered.clear();
    }

    fn offers(&mut self, file: &Path, saved: &str) -> Vec<KeptText> {
        let mut kept = Vec::new();
        for path in self.others(file) {
            // A file that cannot be read, or that another program wrote, is left alone.
            let Some(text) = read(&path) else { continue };
            if text.text == saved {
                // If it stays, it is offered and compared again.
                let _ = fs::remove_file(&path);
                continue;
            }
            self.offered.insert(text.id.clone());
            kept.push(text);
        }
        kept.sort_by_key(|text| text.seconds);
        kept
    }

    fn keep(&mut self, file: &Path, over: &str, text: Option<&str>) -> Result<(), String> {
        let Some(text) = text else {
            if let Some(path) = self.own.remove(file) {
                // If it stays, it is offered again.
                let _ = fs::remove_file(path);
            }
            return Ok(());
        };
        self.write(file, over, text)
            .map_err(|error| format!("a text that is not saved cannot be kept: {error}"))?;
        for path in self.others(file) {
            if read(&path).is_some_and(|other| other.text == text) {
                let _ = fs::remove_file(path);
            }
        }
        Ok(())
    }

    fn discard(&mut self, id: &str) {
        // Only names that were offered: a name of the page's own could lead to any file.
        if let (true, Some(folder)) = (self.offered.remove(id), &self.folder) {
            let _ = fs::remove_file(folder.join(id));
        }
    }
}

/// Reads a text.
fn read(path: &Path) -> Option<KeptText> {
    let content = file::read_text(path, BYTES_MAX).ok()?;
    let content: Value = serde_json::from_str(&content).ok()?;
    Some(KeptText {
        id: path.file_name()?.to_str()?.to_owned(),
        seconds: content["seconds"].as_u64()?,
        over: content["over"].as_str()?.to_owned(),
        text: content["text"].as_str()?.to_owned(),
    })
}

/// Returns the beginning of the names of files with texts of a file.
fn prefix(file: &Path) -> String {
    // 64 bits are enough: only this user writes into the folder.
    let hash = sha256(&*canonical(file).to_string_lossy());
    format!("{}-", &hash[..16])
}

/// Returns the same path for a file from any working folder. The scenario of a script is no file,
/// but stands in a folder.
fn canonical(file: &Path) -> PathBuf {
    let in_folder = || {
        let folder = file.parent().filter(|folder| !folder.as_os_str().is_empty());
        let folder = fs::canonicalize(folder.unwrap_or(Path::new("."))).ok()?;
        Some(folder.join(file.file_name()?))
    };
    fs::canonicalize(file).ok().or_else(in_folder).unwrap_or_else(|| file.to_owned())
}

/// Creates a folder that only the user can read.
fn create_private(folder: &Path) -> io::Result<()> {
    let mut builder = fs::DirBuilder::new();
    builder.recursive(true);
    #[cfg(unix)]
    std::os::unix::fs::DirBuilderExt::mode(&mut builder, 0o700);
    builder.create(folder)
}

/// Returns the folder for unsaved texts: below that for the state of programs, by the conventions of
/// the system.
fn folder(variable: impl Fn(&str) -> Option<OsString>) -> Option<PathBuf> {
    let named = |name: &str| variable(name).map(PathBuf::from).filter(|path| path.is_absolute());
    let state = if cfg!(windows) {
        named("LOCALAPPDATA")
    } else if cfg!(target_os = "macos") {
        named("HOME").map(|home| home.join("Library/Application Support"))
    } else {
        // The XDG Base Directory Specification ignores relative paths.
        named("XDG_STATE_HOME").or_else(|| named("HOME").map(|home| home.join(".local/state")))
    };
    state.map(|state| state.join("bbz").join("unsaved"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn store(folder: &Path) -> UnsavedFiles {
        UnsavedFiles { folder: Some(folder.join("state/unsaved")), ..UnsavedFiles::default() }
    }

    fn texts(store: &mut UnsavedFiles, file: &Path, saved: &str) -> Vec<String> {
        store.offers(file, saved).into_iter().map(|kept| kept.text).collect()
    }

    #[test]
    fn a_text_stays_until_it_is_restored_or_discarded() {
        let folder = tempfile::tempdir().unwrap();
        let [one, other] = ["a.bzz", "b.bzz"].map(|name| folder.path().join(name));
        fs::write(&one, "old\n").unwrap();
        let mut first = store(folder.path());
        for text in ["new\n", "newer\n"] {
            first.keep(&one, &sha256("old\n"), Some(text)).unwrap();
        }
        assert_eq!(texts(&mut first, &one, "old\n"), [""; 0], "its own text");
        // Another client, as after a crash, types before it looks.
        let mut second = store(folder.path());
        second.keep(&one, &sha256("old\n"), Some("mine\n")).unwrap();
        assert_eq!(texts(&mut second, &one, "old\n"), ["newer\n"]);
        assert_eq!(texts(&mut second, &other, ""), [""; 0]);
        // It restores the text, which is then its own.
        second.keep(&one, &sha256("old\n"), Some("newer\n")).unwrap();
        assert_eq!(texts(&mut second, &one, "old\n"), [""; 0]);
        second.begin();
        let offers = second.offers(&one, "old\n");
        assert_eq!((offers.len(), &*offers[0].over), (1, &*sha256("old\n")));
        // Names that were not offered are no files of the store.
        let outside = folder.path().join("state/x.json");
        fs::write(&outside, "").unwrap();
        second.discard("../x.json");
        assert!(outside.exists());
        second.discard(&offers[0].id);
        assert_eq!(texts(&mut second, &one, "old\n"), [""; 0]);
        // A text that the file has is none.
        second.keep(&one, &sha256("old\n"), Some("saved\n")).unwrap();
        second.begin();
        assert_eq!(texts(&mut second, &one, "saved\n"), [""; 0]);
        assert_eq!(fs::read_dir(folder.path().join("state/unsaved")).unwrap().count(), 0);
    }

    #[test]
    fn a_text_that_was_saved_is_forgotten() {
        let folder = tempfile::tempdir().unwrap();
        let one = folder.path().join("a.bzz");
        let mut first = store(folder.path());
        first.keep(&one, "", Some("new\n")).unwrap();
        first.keep(&one, "", None).unwrap();
        first.begin();
        assert_eq!(texts(&mut first, &one, ""), [""; 0]);
    }

    #[cfg(unix)]
    #[test]
    fn only_the_user_can_read_the_texts() {
        use std::os::unix::fs::PermissionsExt;

        let folder = tempfile::tempdir().unwrap();
        let mut first = store(folder.path());
        first.keep(&folder.path().join("a.bzz"), "", Some("new\n")).unwrap();
        let state = folder.path().join("state/unsaved");
        let entry = fs::read_dir(&state).unwrap().next().unwrap().unwrap();
        let mode = |path: &Path| fs::metadata(path).unwrap().permissions().mode() & 0o777;
        assert_eq!((mode(&state), mode(&entry.path())), (0o700, 0o600));
    }

    #[cfg(all(unix, not(target_os = "macos")))]
    #[test]
    fn the_folder_is_that_for_the_state_of_programs() {
        let of = |state: &str, home: &str| {
            let found = folder(|name| match name {
                "XDG_STATE_HOME" => Some(state.into()),
                "HOME" => Some(home.into()),
                _ => None,
            });
            found.map(|path| path.display().to_string()).unwrap_or_default()
        };
        assert_eq!(of("/s", "/h"), "/s/bbz/unsaved");
        assert_eq!(of("", "/h"), "/h/.local/state/bbz/unsaved");
        assert_eq!(of("relative", "/h"), "/h/.local/state/bbz/unsaved");
        assert_eq!(of("", ""), "");
    }

    #[test]
    fn a_folder_that_cannot_be_made_is_an_error() {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("state"), "").unwrap();
        let mut first = store(folder.path());
        let error = first.keep(&folder.path().join("a.bzz"), "", Some("new\n")).unwrap_err();
        assert!(error.starts_with("a text that is not saved cannot be kept: "), "{error}");
        assert!(UnsavedFiles::default().keep("a.bzz".as_ref(), "", Some("")).is_err());
    }
}
