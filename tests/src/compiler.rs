//! The compiler in this process.

use std::path::Path;
use std::sync::OnceLock;

use bittybuzz_compiler::compile::{self, Compiled, Options};
use bittybuzz_compiler::include::{DiskFiles, IncludeLoader, MemoryFiles};
use bittybuzz_compiler::profile::NumberProfile;
use bittybuzz_robot_spec::Robot;

use crate::{bbz, files};

/// Compiles a script that may call the functions of every robot, and includes nothing but the files given.
pub fn compile(script: String, full: bool, files: &MemoryFiles) -> Compiled {
    compile_with(Path::new("script.bzz"), script, full, &IncludeLoader::new(files))
}

/// Compiles a script of the repository, which may include what those of the tests and the library do.
pub fn compile_file(path: &str, full: bool) -> Compiled {
    const FOLDERS: [&str; 3] =
        ["lib", "tests/bzz/includes/parts", "tests/bzz/includes/parts/deeper"];
    let mut loader = IncludeLoader::new(&DiskFiles);
    loader.folders = FOLDERS.map(|folder| bbz::root().join(folder)).to_vec();
    compile_with(&bbz::root().join(path), files::read(path), full, &loader)
}

fn compile_with(path: &Path, script: String, full: bool, loader: &IncludeLoader<'_>) -> Compiled {
    static ROBOTS: OnceLock<Vec<Robot>> = OnceLock::new();
    let options = Options {
        profile: Some(if full { NumberProfile::Full } else { NumberProfile::Tiny }),
        robot: None,
        robots: ROBOTS.get_or_init(bittybuzz_robot_files::all_shipped).clone(),
        ..Options::default()
    };
    compile::compile(path, script, loader, &options)
}
