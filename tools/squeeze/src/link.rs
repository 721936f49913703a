//! A build script that is also a wrapper around GCC's linker.
//!
//! `cargo build` therefore does everything: as a build script, the program makes rustc call
//! `avr-gcc -wrapper <this program>,link`; as a wrapper, it replaces the object of rustc by the
//! squeezed one, and runs the linker. rustc has to write assembly (`--emit=asm`), and a single
//! module: `lto = true`, `codegen-units = 1`; anything else is an error.
//!
//! The report of the proof is written next to the squeezed assembly, to `.proof.txt`.

use std::env;
use std::ffi::{OsStr, OsString};
use std::fmt;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::process::{Command, exit};

use crate::hot::is_hot;
use crate::proof::{SqueezeRefusal, prove};
use crate::squeeze;

/// The first argument that makes the program a wrapper.
const AS_WRAPPER: &str = "link";
/// The environment variable that switches squeezing off if it is `off`.
const SWITCH: &str = "BBZ_SQUEEZE";

/// A reason why linking fails.
#[derive(Debug)]
enum LinkError {
    /// Arguments that GCC passes are missing.
    Arguments,
    /// A file cannot be read or written, or a program cannot be run.
    Io(PathBuf, io::Error),
    /// `BBZ_SQUEEZE` has another value than `off`.
    Switch(OsString),
    /// There is no assembly next to an object from rustc.
    NoAssembly(PathBuf),
    /// The assembly next to an object belongs to another object.
    OtherAssembly(PathBuf),
    /// rustc has made more than one object.
    Modules(PathBuf),
    /// The assembly cannot be squeezed, or the squeezed text behaves differently.
    Refused(PathBuf, Box<SqueezeRefusal>),
    /// The assembler or the linker has failed, and has printed the reason.
    Failed(OsString, Option<i32>),
}

impl fmt::Display for LinkError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            LinkError::Arguments => {
                write!(f, "no linker is named: this program is called by `avr-gcc -wrapper`")
            }
            LinkError::Io(path, error) => write!(f, "`{}`: {error}", path.display()),
            LinkError::Switch(value) => {
                write!(f, "{SWITCH} is `{}`; set it to `off`, or unset it", value.display())
            }
            LinkError::NoAssembly(object) => write!(
                f,
                "there is no assembly of `{}`; build with `--emit=asm`, `lto = true` and `codegen-units = 1`, or with {SWITCH}=off",
                object.display()
            ),
            LinkError::OtherAssembly(assembly) => write!(
                f,
                "`{}` is not of the object that is linked; remove it and build again",
                assembly.display()
            ),
            LinkError::Modules(object) => write!(
                f,
                "`{}` is a second object; build with `lto = true` and `codegen-units = 1`, or with {SWITCH}=off",
                object.display()
            ),
            LinkError::Refused(assembly, refusal) => {
                write!(f, "`{}`: {refusal}", assembly.display())
            }
            LinkError::Failed(program, code) => {
                write!(f, "`{}` has failed ({code:?})", program.display())
            }
        }
    }
}

/// Runs the build script of an AVR program. The functions with the names in `hot` keep their speed.
pub fn build_script(hot: &[&str]) {
    let mut arguments = env::args_os().skip(1);
    if arguments.next().is_some_and(|first| first == AS_WRAPPER) {
        match link(arguments.collect(), hot) {
            Ok(()) => exit(0),
            Err(error) => fail(&error),
        }
    }
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rerun-if-env-changed={SWITCH}");
    match env::var_os(SWITCH) {
        None => {}
        Some(value) if value == "off" => return,
        Some(value) => fail(&LinkError::Switch(value)),
    }
    if let Ok(program) = env::current_exe() {
        println!("cargo::rustc-link-arg=-wrapper");
        println!("cargo::rustc-link-arg={},{AS_WRAPPER}", program.display());
    }
}

fn fail(error: &LinkError) -> ! {
    eprintln!("error: {error}");
    exit(1)
}

fn link(mut arguments: Vec<OsString>, hot: &[&str]) -> Result<(), LinkError> {
    let chip = arguments.iter().find(|argument| is_chip(argument)).cloned();
    let mut squeezed = 0;
    for argument in &mut arguments {
        let object = PathBuf::from(&*argument);
        if let Some(assembly) = assembly_of(&object) {
            squeezed += 1;
            if squeezed > 1 {
                return Err(LinkError::Modules(object));
            }
            *argument = assemble(&object, &assembly, chip.as_deref(), hot)?.into();
        }
    }
    let (linker, arguments) = arguments.split_first().ok_or(LinkError::Arguments)?;
    run(Command::new(linker).args(arguments))
}

/// Returns true for arguments such as `-mavr5`.
fn is_chip(argument: &OsStr) -> bool {
    argument.to_str().is_some_and(|text| text.starts_with("-mavr"))
}

/// Returns the path of the assembly of an object from rustc: next to the object, with its name up
/// to the first full stop.
fn assembly_of(object: &Path) -> Option<PathBuf> {
    let name = object.file_name()?.to_str()?;
    let crate_name = name.strip_suffix(".rcgu.o")?.split('.').next()?;
    Some(object.with_file_name(format!("{crate_name}.s")))
}

/// Returns true if the assembly belongs to the object: the name of the module, with which the
/// assembly begins, is part of the object's name.
fn is_of(text: &str, object: &Path) -> bool {
    let module =
        text.lines().find_map(|line| line.trim().strip_prefix(".file\t\"")?.strip_suffix('"'));
    let name = object.file_name().and_then(OsStr::to_str);
    matches!((module, name), (Some(module), Some(name)) if name.contains(module))
}

/// Squeezes and assembles the assembly of an object. Returns the path of the new object.
fn assemble(
    object: &Path,
    assembly: &Path,
    chip: Option<&OsStr>,
    hot: &[&str],
) -> Result<PathBuf, LinkError> {
    if !assembly.exists() {
        return Err(LinkError::NoAssembly(object.to_owned()));
    }
    let failed = |path: &Path| {
        let path = path.to_owned();
        move |error| LinkError::Io(path, error)
    };
    let text = fs::read_to_string(assembly).map_err(failed(assembly))?;
    if !is_of(&text, object) {
        return Err(LinkError::OtherAssembly(assembly.to_owned()));
    }
    let refused = |refusal| LinkError::Refused(assembly.to_owned(), Box::new(refusal));
    let made = squeeze(&text, |symbol| is_hot(symbol, hot));
    let squeezed = assembly.with_extension("squeezed.s");
    fs::write(&squeezed, &made.text).map_err(failed(&squeezed))?;
    let report = prove(&text, &made.text, &made.contracts).map_err(refused)?;
    let proof = assembly.with_extension("proof.txt");
    fs::write(&proof, report.to_string()).map_err(failed(&proof))?;
    let object = assembly.with_extension("squeezed.o");
    let mut assembler = Command::new("avr-as");
    if let Some(chip) = chip.and_then(OsStr::to_str) {
        assembler.arg(chip.replacen("-m", "-mmcu=", 1));
    }
    // The linker shortens calls and jumps, so it needs relocations for all of them.
    run(assembler.arg("-mlink-relax").arg("-o").arg(&object).arg(&squeezed))?;
    Ok(object)
}

fn run(command: &mut Command) -> Result<(), LinkError> {
    let program = command.get_program().to_owned();
    let status = command.status().map_err(|error| LinkError::Io(PathBuf::from(&program), error))?;
    if status.success() { Ok(()) } else { Err(LinkError::Failed(program, status.code())) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn assembly_belongs_to_the_object_that_has_its_module() {
        let object = Path::new("/t/demo-39e2.demo.d3eb-cgu.0.rcgu.o");
        assert_eq!(assembly_of(object), Some(PathBuf::from("/t/demo-39e2.s")));
        assert_eq!(assembly_of(Path::new("/t/libdemo.rlib")), None);
        assert!(is_of("x = 1\n\t.file\t\"demo.d3eb-cgu.0\"\n", object));
        assert!(!is_of("\t.file\t\"demo.ffff-cgu.0\"\n", object));
        assert!(!is_of("", object));
    }
}
