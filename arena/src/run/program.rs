//! The programs that robots run.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use bittybuzz_compiler::compile::{Options, compile};
use bittybuzz_compiler::include::{IncludeLoader, MemoryFiles};
use bittybuzz_compiler::source::SourceMap;
use bittybuzz_compiler::symbols::Symbols;

use crate::robot::GroupContext;
use crate::scenario::{Group, GroupId};

/// A function that compiles a script for the robots of a group. Its error is a report of all
/// mistakes, for users.
pub type Compiler = Arc<dyn Fn(&Path, &Group) -> Result<Program, String> + Send + Sync>;

/// An image, and the symbols of its source. Clones share them, as many groups may run one script.
#[derive(Debug, Clone)]
pub struct Program {
    /// The image.
    pub image: Arc<[u8]>,
    /// Names and texts of the script. Without them globals have no names.
    pub symbols: Option<Arc<Symbols>>,
    /// The texts that it was compiled from; empty if they are not known.
    pub sources: Arc<SourceMap>,
}

/// A program in the setup of a run.
#[derive(Clone)]
pub struct LoadedProgram {
    pub program: Program,
    /// The group whose robots can run it.
    pub group: GroupId,
    /// The script, image or object file; `None` for robots without a script.
    pub script: Option<PathBuf>,
    /// The data that its robots share.
    pub context: Arc<GroupContext>,
}

impl Program {
    /// Returns a program.
    pub fn new(image: Vec<u8>, symbols: Option<Symbols>, sources: Arc<SourceMap>) -> Self {
        Program { image: image.into(), symbols: symbols.map(Arc::new), sources }
    }

    /// Returns the program of robots that run a foreign image: it does nothing.
    pub fn empty(group: &Group) -> Self {
        let profile = Some(group.robot.profile);
        let options = Options { profile, ..Options::default() };
        let files = MemoryFiles::default();
        let compiled = compile(Path::new(""), String::new(), &IncludeLoader::new(&files), &options);
        let image = compiled.image.expect("a script without text has no mistakes");
        let (symbols, sources) = (compiled.symbols, Arc::new(compiled.sources));
        Program::new(image, symbols, sources)
    }

    /// Returns the number of a global.
    pub fn global(&self, name: &str) -> Option<u16> {
        let globals = &self.symbols.as_ref()?.globals;
        let number = globals.iter().position(|global| global == name)?;
        // Symbols may come from a file, so that their number has no limit. A machine has no such
        // global.
        u16::try_from(number).ok()
    }

    /// Returns the names of the globals.
    pub fn globals(&self) -> &[String] {
        self.symbols.as_ref().map_or(&[], |symbols| &symbols.globals)
    }

    /// Returns the text of a string.
    pub fn string(&self, number: u16) -> Option<&str> {
        self.symbols.as_ref()?.string(number)
    }
}
