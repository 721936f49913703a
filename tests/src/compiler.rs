//! The compiler in this process.

use std::path::Path;
use std::sync::OnceLock;

use bittybuzz_compiler::codegen::constant::Profile;
use bittybuzz_compiler::compile::{self, Compiled, Options};
use bittybuzz_compiler::include::{Loader, MemoryFiles};
use bittybuzz_robots::Robot;

/// Compiles a script that may call the functions of every robot, and includes nothing but the files given.
pub fn compile(script: String, full: bool, files: &MemoryFiles) -> Compiled {
    static ROBOTS: OnceLock<Vec<Robot>> = OnceLock::new();
    let options = Options {
        profile: Some(if full { Profile::Full } else { Profile::Tiny }),
        robot: None,
        robots: ROBOTS.get_or_init(bittybuzz_robots::all_shipped).clone(),
    };
    compile::compile(Path::new("script.bzz"), script, &Loader::new(files), &options)
}
