//! The scripts of the repository.

use std::fs;
use std::path::{Path, PathBuf};

use bittybuzz_compiler::compile::{Compiled, Options, compile};
use bittybuzz_compiler::include::{DiskFiles, IncludeLoader};

/// A script in its folder.
pub struct Script {
    pub path: PathBuf,
    pub text: String,
}

impl Script {
    /// Compiles another text in its place, with the files that it includes.
    pub fn compile(&self, text: &str, options: &Options) -> Compiled {
        let loader =
            IncludeLoader { folders: vec![folder("lib")], ..IncludeLoader::new(&DiskFiles) };
        compile(&self.path, text.to_owned(), &loader, options)
    }
}

/// All scripts of a folder of the repository and of the folders in it, sorted by path.
pub fn scripts_under(name: &str) -> Vec<Script> {
    let mut paths = Vec::new();
    collect(&folder(name), &mut paths);
    paths.sort();
    let read = |path: PathBuf| {
        let text = fs::read_to_string(&path).ok()?;
        Some(Script { path, text })
    };
    paths.into_iter().filter_map(read).collect()
}

fn folder(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(name)
}

fn collect(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            collect(&path, found);
        } else if path.extension().is_some_and(|extension| extension == "bzz") {
            found.push(path);
        }
    }
}
