//! Scripts compiled in this process.

use std::path::Path;
use std::sync::OnceLock;

use bittybuzz_compiler::compile::{Compiled, Options, compile};
use bittybuzz_compiler::include::{IncludeLoader, MemoryFiles};
use bittybuzz_compiler::profile::NumberProfile as ProfileName;
use bittybuzz_compiler::symbols::Symbols;
use bittybuzz_robot_spec::Robot;
use bittybuzz_vm_core::number::Profile;

/// A compiled script.
#[derive(Debug, Clone)]
pub struct Program {
    /// The image.
    pub image: Vec<u8>,
    /// Names of its strings, functions and globals.
    pub symbols: Symbols,
}

impl Program {
    /// Compiles a script that includes nothing and may call the functions of every robot.
    ///
    /// # Panics
    /// If the script has errors.
    pub fn new<P: Profile>(script: &str) -> Self {
        let profile = if P::FULL { ProfileName::Full } else { ProfileName::Tiny };
        let options = Program::options(profile);
        Program::from(Program::compile(script, &options))
    }

    /// Compiles a script that includes nothing.
    pub fn compile(script: &str, options: &Options) -> Compiled {
        let files = MemoryFiles::default();
        compile(Path::new("test.bzz"), script.to_owned(), &IncludeLoader::new(&files), options)
    }

    /// Returns options for scripts that may call the functions of every robot.
    pub fn options(profile: ProfileName) -> Options {
        // Read once: tests compile thousands of scripts.
        static ROBOTS: OnceLock<Vec<Robot>> = OnceLock::new();
        let robots = ROBOTS.get_or_init(bittybuzz_robot_files::all_shipped).clone();
        Options { profile: Some(profile), robots, ..Options::default() }
    }

    /// Keeps the image for ever, so that machines that live as long as the test can run it.
    pub fn leak(self) -> &'static [u8] {
        Vec::leak(self.image)
    }
}

impl From<Compiled> for Program {
    fn from(compiled: Compiled) -> Self {
        match (compiled.image, compiled.symbols) {
            (Some(image), Some(symbols)) => Program { image, symbols },
            _ => panic!("the script does not compile: {:#?}", compiled.diagnostics),
        }
    }
}
