//! The folder of a sweep, with messages for people.

use std::fs;
use std::path::Path;

use annotate_snippets::{Group, Level};
use bittybuzz_chunks::{Aside, FileKind, StoreError, file_kind};

use crate::file_error::FileError;
use crate::problem::Problem;
use crate::report;

/// A reason why a folder of a sweep cannot be used.
#[derive(Debug, thiserror::Error)]
#[error(transparent)]
pub struct StoreProblem(pub StoreError);

impl Problem for StoreProblem {
    fn help(&self) -> Option<String> {
        let help = match &self.0 {
            StoreError::Read(..) | StoreError::Write(..) => return None,
            StoreError::NoPlan { .. } => {
                "remove it and plan the sweep again with the same options: finished runs are kept"
            }
            StoreError::Foreign(_)
            | StoreError::MixedPrograms { .. }
            | StoreError::OtherProgram { .. } => {
                "use that version of bbz, or another folder: results of different versions are not mixed"
            }
            StoreError::OtherExperiment { .. } => {
                "give the options and files that it was started with; to start again, remove the folder"
            }
            StoreError::Contradiction { .. } => {
                "one of two computers or files is wrong: remove the files of one of them, and run again"
            }
        };
        Some(help.to_owned())
    }
}

/// The names in a folder.
#[derive(Debug, Default)]
pub struct Names {
    /// True if there are rows.
    pub has_rows: bool,
    /// Files that a process is writing, or that a killed process has left.
    pub unfinished: Vec<String>,
    /// Files that are no sweep's.
    pub others: Vec<String>,
}

impl Names {
    /// Returns the names in a folder.
    pub fn of(folder: &Path) -> Result<Self, FileError> {
        let unreadable = |error| FileError::reading(folder, error);
        let mut names = Names::default();
        for entry in fs::read_dir(folder).map_err(unreadable)? {
            // A name that is not UTF-8 has replacement characters, so it is none of a sweep's.
            let name = entry.map_err(unreadable)?.file_name().to_string_lossy().into_owned();
            match file_kind(&name) {
                Some(FileKind::Rows) => names.has_rows = true,
                Some(FileKind::Unfinished) => names.unfinished.push(name),
                Some(FileKind::Plan | FileKind::Damaged) => {}
                None => names.others.push(name),
            }
        }
        Ok(names)
    }
}

/// Prints which files were damaged.
pub fn print_aside(aside: &[Aside]) {
    for Aside { path, now } in aside {
        let [path, now] = [path, now].map(|path| printable(path));
        let title = format!(
            "`{path}` is damaged: it was renamed to `{now}`, and its runs are simulated again"
        );
        report::print(Group::with_title(Level::WARNING.primary_title(title)));
    }
}

fn printable(path: &Path) -> String {
    report::printable(&path.display().to_string())
}
