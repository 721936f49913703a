//! A build script that is also what GCC wraps its linker in.
//!
//! So `cargo build` does everything: as a build script it has rustc call `avr-gcc -wrapper <this program>,link`; as a wrapper it puts the
//! squeezed program in place of the one that rustc made, and runs the linker. rustc has to write assembly (`--emit=asm`),
//! and one module: `lto = true`, `codegen-units = 1`.

use std::env;
use std::ffi::{OsStr, OsString};
use std::fmt;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::process::{Command, exit};

use crate::hot::is_hot;
use crate::squeeze;

/// The first argument of a wrapper.
const AS_WRAPPER: &str = "link";

/// What went wrong.
#[derive(Debug)]
enum LinkError {
    /// Not all of what GCC passes is there.
    Arguments,
    /// A file cannot be read or written, or a program not be run.
    Io(PathBuf, io::Error),
    /// The assembler or the linker has failed, and said why.
    Failed(OsString, Option<i32>),
}

impl fmt::Display for LinkError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            LinkError::Arguments => {
                write!(f, "no linker is named: this program is called by `avr-gcc -wrapper`")
            }
            LinkError::Io(path, error) => write!(f, "`{}`: {error}", path.display()),
            LinkError::Failed(program, code) => {
                write!(f, "`{}` has failed ({code:?})", program.display())
            }
        }
    }
}

/// What the build script of an AVR program does; the functions of these names keep their speed.
pub fn build_script(hot: &[&str]) {
    let mut arguments = env::args_os().skip(1);
    if arguments.next().is_some_and(|first| first == AS_WRAPPER) {
        match link(arguments.collect(), hot) {
            Ok(()) => exit(0),
            Err(error) => {
                eprintln!("error: {error}");
                exit(1)
            }
        }
    }
    println!("cargo::rerun-if-changed=build.rs");
    if let Ok(program) = env::current_exe() {
        println!("cargo::rustc-link-arg=-wrapper");
        println!("cargo::rustc-link-arg={},{AS_WRAPPER}", program.display());
    }
}

fn link(mut arguments: Vec<OsString>, hot: &[&str]) -> Result<(), LinkError> {
    let chip = arguments.iter().find(|argument| is_chip(argument)).cloned();
    for argument in &mut arguments {
        if let Some(assembly) = assembly_of(Path::new(argument)) {
            *argument = assemble(&assembly, chip.as_deref(), hot)?.into();
        }
    }
    let (linker, arguments) = arguments.split_first().ok_or(LinkError::Arguments)?;
    run(Command::new(linker).args(arguments))
}

/// `-mavr5` and the like.
fn is_chip(argument: &OsStr) -> bool {
    argument.to_str().is_some_and(|text| text.starts_with("-mavr"))
}

/// The assembly of an object that rustc has made: beside it, up to the first full stop of the same name.
fn assembly_of(object: &Path) -> Option<PathBuf> {
    let name = object.file_name()?.to_str()?;
    let crate_name = name.strip_suffix(".rcgu.o")?.split('.').next()?;
    let assembly = object.with_file_name(format!("{crate_name}.s"));
    assembly.exists().then_some(assembly)
}

/// The object of the squeezed assembly.
fn assemble(assembly: &Path, chip: Option<&OsStr>, hot: &[&str]) -> Result<PathBuf, LinkError> {
    let failed = |path: &Path| {
        let path = path.to_owned();
        move |error| LinkError::Io(path, error)
    };
    let text = fs::read_to_string(assembly).map_err(failed(assembly))?;
    let squeezed = assembly.with_extension("squeezed.s");
    fs::write(&squeezed, squeeze(&text, |symbol| is_hot(symbol, hot)))
        .map_err(failed(&squeezed))?;
    let object = assembly.with_extension("squeezed.o");
    let mut assembler = Command::new("avr-as");
    if let Some(chip) = chip.and_then(OsStr::to_str) {
        assembler.arg(chip.replacen("-m", "-mmcu=", 1));
    }
    // The linker makes calls and jumps shorter, so it has to know of all of them.
    run(assembler.arg("-mlink-relax").arg("-o").arg(&object).arg(&squeezed))?;
    Ok(object)
}

fn run(command: &mut Command) -> Result<(), LinkError> {
    let program = command.get_program().to_owned();
    let status = command.status().map_err(|error| LinkError::Io(PathBuf::from(&program), error))?;
    if status.success() { Ok(()) } else { Err(LinkError::Failed(program, status.code())) }
}
