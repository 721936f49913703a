//! The common part of the boards' build scripts. The script becomes an image, and the robot file
//! becomes configuration, function numbers and memory layout, so that each of these facts is
//! written only once.
//!
//! The build scripts write these files to cargo's `OUT_DIR`:
//! * `robot.rs`: constants, see [`bittybuzz_robot_spec::generate_rust`], the sizes and periods of the
//!   virtual machine, `is_function` for the name hashes of the robot's functions, and the type
//!   `Numbers` of the number profile (`BBZ_PROFILE`, else the robot's);
//! * `script.bin`: the contents of the script section, which are length, image and, if the robot
//!   file asks for it, seal. With a log of scripts, `script_mark.bin` is the end of the script's place;
//! * `memory.x`: the linker's regions.
//!
//! A build script that fails prints the error to standard error, which cargo shows, and ends.

use std::env;
use std::fs;
use std::path::{Path, PathBuf};

use bittybuzz_compiler::compile::{Compiled, Options, compile};
use bittybuzz_compiler::fit;
use bittybuzz_compiler::include::{DiskFiles, IncludeLoader};
use bittybuzz_compiler::refusal;
use bittybuzz_compiler::render::{ColorChoice, Renderer};
use bittybuzz_robot_spec::{Layout, NumberProfile, Robot, script_section};
use bittybuzz_vm_core::{ImageError, Part, Parts};

/// The environment variable that names the script.
const SCRIPT: &str = "BBZ_SCRIPT";

/// The environment variable that selects the parts of the virtual machine.
const PARTS: &str = "BBZ_PARTS";

/// The environment variable that names the number profile, for swarms that include smaller robots.
/// The default is that of the robot file.
const PROFILE: &str = "BBZ_PROFILE";

/// The file with cargo's command to flash the robot.
const CARGO_CONFIG: &str = ".cargo/config.toml";

/// The address at which the application begins.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Start {
    /// The address in the robot file, after the bootloader if the robot has one.
    AsInRobotFile,
    /// This address at the beginning of flash, in place of a bootloader. Only a debug probe can
    /// load such an image.
    BeginningOfFlash(u32),
}

/// A reason why a build script failed.
#[derive(Debug)]
pub enum BuildError {
    /// The robot file cannot be used.
    Robot(String),
    /// The name is not one of a number profile.
    Profile(String),
    /// The robot file does not describe the chip's memory.
    NoLayout,
    /// `cargo run` would flash another chip.
    Runner(String),
    /// The script cannot be read.
    Script(PathBuf, std::io::Error),
    /// The script has errors; they have been printed.
    Errors(PathBuf),
    /// The virtual machine would refuse the image.
    Refused(PathBuf, String),
    /// The image is longer than the script section.
    TooLong(PathBuf),
    /// A file cannot be written.
    Output(PathBuf, std::io::Error),
}

impl std::fmt::Display for BuildError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            BuildError::Robot(message) => f.write_str(message),
            BuildError::Profile(name) => {
                write!(
                    f,
                    "{PROFILE} names no number profile: `{name}`; there are `tiny` and `full`"
                )
            }
            BuildError::NoLayout => f.write_str("the robot file has no [layout]"),
            BuildError::Runner(chip) => write!(
                f,
                "the runner in {CARGO_CONFIG} does not say `--chip {chip}`, which the robot file names"
            ),
            BuildError::Script(path, error) => {
                write!(f, "cannot read `{}`: {error}; {SCRIPT} names the script", path.display())
            }
            BuildError::Errors(path) => {
                write!(f, "`{}` has errors, see above; {SCRIPT} names the script", path.display())
            }
            BuildError::Refused(path, why) => {
                write!(f, "`{}` {why}; {SCRIPT} names the script", path.display())
            }
            BuildError::TooLong(path) => {
                write!(f, "the image of `{}` does not fit into its flash section", path.display())
            }
            BuildError::Output(path, error) => {
                write!(f, "cannot write `{}`: {error}", path.display())
            }
        }
    }
}

/// Builds the files for the robot of this name, or of this robot file. Paths are relative to the
/// board's folder. A relative path in `BBZ_SCRIPT` is first tried in the folder from which cargo
/// was called.
pub fn board(robot: &str, default_script: &str, start: Start) -> Result<(), BuildError> {
    rerun(robot);
    println!("cargo:rerun-if-env-changed={PROFILE}");
    let mut robot = find(robot)?;
    if let Some(name) = env::var_os(PROFILE) {
        let name = name.to_string_lossy();
        let profile = NumberProfile::from_name(&name);
        robot.profile = profile.ok_or_else(|| BuildError::Profile(name.into_owned()))?;
    }
    if let Some(chip) = &robot.chip {
        check_runner(chip)?;
    }
    let mut layout = robot.layout.ok_or(BuildError::NoLayout)?;
    if let Start::BeginningOfFlash(address) = start {
        layout.application.size += layout.application.address - address;
        layout.application.address = address;
    }
    let script = script_path(default_script);
    let image = compiled(&script, &robot)?;
    let image = fit::for_flash(&image, &robot).map_err(|cause| refused(&script, &cause))?;
    let mut section = layout.script_section(&image).ok_or(BuildError::TooLong(script))?;
    if layout.script_log {
        let mark = Layout::script_mark(&image);
        // The bytes between image and mark stay erased and need not be flashed.
        section.truncate(size_of::<u32>() + image.len());
        write_out("script_mark.bin", &mark)?;
    }
    let numbers = match robot.profile {
        NumberProfile::Tiny => "Tiny",
        NumberProfile::Full => "Full",
    };
    let numbers = format!(
        "/// Numbers of scripts.\npub type Numbers = bittybuzz_vm_core::number::{numbers};\n"
    );
    write_out("robot.rs", (constants(&robot) + &numbers).as_bytes())?;
    write_out("script.bin", &section)?;
    write_out("memory.x", layout.memory_x().as_bytes())?;
    println!("cargo:rustc-link-search={}", out().display());
    Ok(())
}

/// Prints the conditions under which cargo rebuilds.
fn rerun(robot: &str) {
    println!("cargo:rerun-if-env-changed={SCRIPT}");
    println!("cargo:rerun-if-changed=build.rs");
    // The files of shipped robots are part of the build script itself.
    if Path::new(robot).is_file() {
        println!("cargo:rerun-if-changed={robot}");
    }
}

fn find(robot: &str) -> Result<Robot, BuildError> {
    bittybuzz_robot_files::find(robot).map_err(|error| BuildError::Robot(error.to_string()))
}

/// Builds the files for a chip whose script follows the program directly, without a section of its
/// own. There is no `memory.x`. `script.bin` begins with a mark of `SCRIPT_HEADER` bytes, and the
/// sealed image follows.
///
/// The virtual machine includes only the [parts](Parts) that the script uses and those of the
/// language. `BBZ_PARTS` changes this: `used` leaves out unused parts of the language as well, the
/// name of a part leaves out that part in addition, to measure it, and `all` includes everything.
pub fn behind_program(robot: &str, default_script: &str) -> Result<(), BuildError> {
    rerun(robot);
    println!("cargo:rerun-if-env-changed={PARTS}");
    let robot = find(robot)?;
    let script = script_path(default_script);
    let image = compiled(&script, &robot)?;
    let used = fit::parts(&image);
    let parts = match env::var(PARTS) {
        Err(_) => used.and(Parts::LANGUAGE),
        Ok(which) if which == "all" => Parts::ALL,
        Ok(left_out) => {
            let is_left_out = |part: &&Part| part.name() == left_out;
            match Part::ALL.iter().find(is_left_out) {
                Some(part) => used.without(Parts::of(&[*part])),
                None => used,
            }
        }
    };
    let robot = robot.limited_to(parts);
    let image = fit::sealed(&image, &robot).map_err(|cause| refused(&script, &cause))?;
    let section = script_section(parts, &image).ok_or(BuildError::TooLong(script))?;
    let header = section.len() - image.len();
    let section_constants = format!(
        "/// Bytes before the image.\npub const SCRIPT_HEADER: usize = {header};\n\
         /// The parts of the machine, as bits.\npub const PARTS: u16 = {:#06x};\n",
        parts.bits()
    );
    write_out("robot.rs", (constants(&robot) + &section_constants).as_bytes())?;
    write_out("script.bin", &section)
}

/// Returns Rust source of the robot's constants and of what follows from them.
fn constants(robot: &Robot) -> String {
    let sizes = robot.sizes();
    // Reading the robot file limits each period to a byte.
    let vm = robot.vm;
    let (beacon, forget, advertise) = (vm.beacon_steps, vm.forget_steps, vm.advertise_steps);
    let code = format!(
        "/// The sizes of the virtual machine's memory for other robots.\n\
         pub const SIZES: bittybuzz_vm_core::Sizes = bittybuzz_vm_core::{sizes:?};\n\
         /// The periods of the messages that the virtual machine sends on its own.\n\
         pub const PERIODS: bittybuzz_vm_core::Periods = bittybuzz_vm_core::Periods {{\n    \
         beacon: {beacon},\n    forget: {forget},\n    advertise: {advertise},\n}};\n\
         /// Returns true if there is a function of this name hash.\n\
         pub fn is_function(hash: u16) -> bool {{\n    \
         FUNCTIONS.contains(&hash)\n}}\n"
    );
    bittybuzz_robot_spec::generate_rust(robot) + &code
}

/// Checks the chip's name in cargo's configuration. That file cannot be generated, so it repeats
/// the name.
fn check_runner(chip: &str) -> Result<(), BuildError> {
    println!("cargo:rerun-if-changed={CARGO_CONFIG}");
    let config = fs::read_to_string(CARGO_CONFIG).unwrap_or_default();
    let flag = format!("--chip {chip}\"");
    if config.contains(&flag) { Ok(()) } else { Err(BuildError::Runner(chip.to_owned())) }
}

fn script_path(default: &str) -> PathBuf {
    match env::var_os(SCRIPT) {
        None => PathBuf::from(default),
        Some(path) => {
            let path = PathBuf::from(path);
            // Build scripts run in the board's folder, but cargo may be called from another one.
            let called_from = env::var_os("PWD").map(PathBuf::from);
            match called_from.map(|folder| folder.join(&path)) {
                Some(from_there) if from_there.exists() => from_there,
                _ => path,
            }
        }
    }
}

/// Compiles and verifies the script, and returns its image.
fn compiled(script: &Path, robot: &Robot) -> Result<Vec<u8>, BuildError> {
    println!("cargo:rerun-if-changed={}", script.display());
    let unreadable = |error| BuildError::Script(script.to_owned(), error);
    let text = fs::read_to_string(script).map_err(unreadable)?;
    let library = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../lib");
    let loader = IncludeLoader { folders: vec![library], ..IncludeLoader::new(&DiskFiles) };
    let options = Options {
        robot: Some(robot.clone()),
        robots: bittybuzz_robot_files::all_shipped(),
        ..Options::default()
    };
    let compiled = compile(script, text, &loader, &options);
    let image = image(&compiled).ok_or_else(|| BuildError::Errors(script.to_owned()))?;
    fit::verify(image, robot.profile, robot).map_err(|cause| refused(script, &cause))?;
    Ok(image.to_owned())
}

fn refused(script: &Path, cause: &ImageError) -> BuildError {
    BuildError::Refused(script.to_owned(), refusal::sentence(cause))
}

/// Prints the compiler's diagnostics, and returns the image unless there were errors.
fn image(compiled: &Compiled) -> Option<&[u8]> {
    for (_, source) in compiled.sources.files() {
        println!("cargo:rerun-if-changed={}", source.path.display());
    }
    let renderer = Renderer::new(&compiled.sources);
    for diagnostic in &compiled.diagnostics {
        eprintln!("{}", renderer.text(diagnostic, ColorChoice::Never));
    }
    compiled.image.as_deref()
}

fn out() -> PathBuf {
    PathBuf::from(env::var_os("OUT_DIR").unwrap_or_default())
}

fn write_out(name: &str, bytes: &[u8]) -> Result<(), BuildError> {
    let path = out().join(name);
    fs::write(&path, bytes).map_err(|error| BuildError::Output(path, error))
}
