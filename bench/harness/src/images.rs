//! Compiles scripts to images.

use crate::error::BenchError;
use anyhow::Result;
use bittybuzz_bench::{ALL_SLOTS, ROOM, header};
use bittybuzz_builds::shell::root;
use bittybuzz_compiler::compile::{Options, compile};
use bittybuzz_compiler::include::{DiskFiles, IncludeLoader};
use bittybuzz_compiler::render::{ColorChoice, Renderer};
use bittybuzz_robot_spec::NumberProfile;
use fs_err as fs;
use std::path::{Path, PathBuf};

/// The robot that scripts are compiled for.
const ROBOT: &str = "bench";
/// The global with the result.
const RESULT: &str = "r";

/// A compiled script.
pub struct CompiledScript {
    pub name: String,
    pub image: Vec<u8>,
    /// Number of the global with the result.
    global: u16,
}

impl CompiledScript {
    /// Wraps an image that does not come from a script.
    pub fn new(name: &str, image: Vec<u8>, global: u16) -> CompiledScript {
        CompiledScript { name: name.to_owned(), image, global }
    }

    /// Compiles a script of bench/scripts.
    pub fn script(name: &str, profile: NumberProfile) -> Result<CompiledScript> {
        let path = PathBuf::from(format!("bench/scripts/{name}.bzz"));
        let text = fs::read_to_string(root().join(&path))?;
        CompiledScript::text(name, &path, text, profile)
    }

    /// Compiles the text of a script; messages name the script by this path.
    pub fn text(
        name: &str,
        path: &Path,
        text: String,
        profile: NumberProfile,
    ) -> Result<CompiledScript> {
        let robot = bittybuzz_robot_files::find(ROBOT)?.clone();
        let options = Options {
            profile: Some(profile),
            robot: Some(robot),
            robots: bittybuzz_robot_files::all_shipped().to_vec(),
            ..Options::default()
        };
        let loader =
            IncludeLoader { folders: vec![root().join("lib")], ..IncludeLoader::new(&DiskFiles) };
        let compiled = compile(path, text, &loader, &options);
        let (Some(image), Some(symbols)) = (compiled.image, compiled.symbols) else {
            let renderer = Renderer::new(&compiled.sources);
            let messages = compiled.diagnostics.iter();
            let messages =
                messages.map(|message| renderer.text(message, ColorChoice::Never)).collect();
            return Err(BenchError::Script { path: path.to_owned(), messages }.into());
        };
        let global = symbols.globals.iter().position(|global| global == RESULT).unwrap_or(0);
        Ok(CompiledScript { name: name.to_owned(), image, global: global as u16 })
    }

    /// Lets the script use all slots of the machine.
    pub fn with_all_slots(self) -> CompiledScript {
        CompiledScript { global: self.global | ALL_SLOTS, ..self }
    }

    /// Returns the bytes that replace the zeros in a program.
    pub fn block(&self) -> Result<Vec<u8>, BenchError> {
        let length = u16::try_from(self.image.len()).unwrap_or(u16::MAX);
        let block = [&header(self.global, length), self.image.as_slice()].concat();
        if block.len() > ROOM {
            return Err(BenchError::TooLong { name: self.name.clone() });
        }
        Ok(block)
    }
}
