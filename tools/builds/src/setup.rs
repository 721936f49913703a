//! Installs the toolchains and packages that the other commands need, by the ordinary clients:
//! rustup, apt-get, and pip in a folder of its own.

use crate::board::KILOBOT;
use crate::chip;
use crate::programs::{Platform, WINE};
use crate::python_module;
use crate::shell::{Invocation, at_once, is_installed, root, target};
use anyhow::{Context, Result, bail};
use fs_err as fs;
use serde::Deserialize;
use std::path::{Path, PathBuf};

/// The evidence that a package is installed.
#[derive(Clone, Copy)]
enum Sign {
    /// A program in the search path.
    Program(&'static str),
    /// libclang in a place where the crate `bindgen` searches for it.
    Libclang,
    /// A file at a place where other programs search for it.
    File(&'static str),
    /// A header of a library in Debian's folder for headers.
    Header(&'static str),
    /// A Python module.
    Module(&'static str),
}

/// Debian packages that the commands need.
const PACKAGES: &[(Sign, &str)] = &[
    (Sign::Program("cc"), "gcc"),
    // For libFuzzer.
    (Sign::Program("c++"), "g++"),
    (Sign::Program("git"), "git"),
    // For Unicorn, the processor of the emulated robots.
    (Sign::Program("cmake"), "cmake"),
    (Sign::Program("make"), "make"),
    (Sign::Libclang, "libclang-dev"),
    // For the emulators of the other processors.
    (Sign::Program("qemu-system-arm"), "qemu-system-arm"),
    (Sign::Program("qemu-system-avr"), "qemu-system-misc"),
    // For the AVR's linker, C library and emulator.
    (Sign::Program("avr-gcc"), "gcc-avr"),
    (Sign::File("/usr/lib/avr/lib/libc.a"), "avr-libc"),
    (Sign::Program("simavr"), "simavr"),
    (Sign::Header("simavr/sim_avr.h"), "libsimavr-dev"),
    // For writing programs to AVRs.
    (Sign::Program("avrdude"), "avrdude"),
    // For counting the instructions of programs on this computer.
    (Sign::Program("valgrind"), "valgrind"),
    // For running WebAssembly.
    (Sign::Program("node"), "nodejs"),
];

/// Debian packages for bundling packages of npm.
const NODE_PACKAGES: &[(Sign, &str)] =
    &[(Sign::Program("node"), "nodejs"), (Sign::Program("npm"), "npm")];

/// Debian packages for tests of web pages.
const BROWSER_PACKAGES: &[(Sign, &str)] = &[
    (Sign::Program("chromium-headless-shell"), "chromium-headless-shell"),
    (Sign::Program("firefox-esr"), "firefox-esr"),
    // Firefox has WebGL only on a display.
    (Sign::Program("Xvfb"), "xvfb"),
];

/// Debian packages for a Python with packages of its own.
const PYTHON_PACKAGES: &[(Sign, &str)] =
    &[(Sign::Program("python3"), "python3"), (Sign::Module("ensurepip"), "python3-venv")];

/// Debian packages for linking programs for Windows.
const MINGW_PACKAGES: &[(Sign, &str)] =
    &[(Sign::Program("x86_64-w64-mingw32-gcc"), "gcc-mingw-w64-x86-64-win32")];

/// Debian packages for running programs for Windows.
const WINE_PACKAGES: &[(Sign, &str)] = &[(Sign::File(WINE), "wine64")];

/// Debian packages for running programs for 64-bit ARM, and the libraries that these load.
const ARM_PACKAGES: &[(Sign, &str)] = &[
    (Sign::Program("qemu-aarch64"), "qemu-user"),
    (Sign::File("/usr/aarch64-linux-gnu/lib/libc.so.6"), "libc6-arm64-cross"),
    (Sign::File("/usr/aarch64-linux-gnu/lib/libgcc_s.so.1"), "libgcc-s1-arm64-cross"),
];

/// Debian packages for a cluster that schedules jobs.
const SLURM_PACKAGES: &[(Sign, &str)] = &[(Sign::File("/usr/sbin/slurmctld"), "slurm-wlm")];

/// The list of Python packages that link programs for older systems, and pack wheels.
const PACKER_REQUIREMENTS: &str = "tools/builds/requirements.txt";

/// The list of Python packages for tests of web pages.
const BROWSER_REQUIREMENTS: &str = "tests/page/requirements.txt";

/// The list of Python packages that flash Crazyflies by radio.
const CFLIB_REQUIREMENTS: &str = "tests/hil/cflib/requirements.txt";

/// The list of Python packages that build the Python module and test it.
const MODULE_REQUIREMENTS: &str = "python/requirements.txt";

/// The list of Python packages of the notebooks, and of a browser that opens one.
const NOTEBOOK_REQUIREMENTS: &str = "tests/notebooks/requirements.txt";

/// The list of Python packages that carry out sweeps on several computers.
const EXECUTOR_REQUIREMENTS: &str = "tests/executors/requirements.txt";

/// The list of Python packages for the checks of sources.
const CHECK_REQUIREMENTS: &str = "xtask/requirements.txt";

/// The folder whose `rust-toolchain.toml` adds components and targets for chips to the root's toolchain.
const ADDITIONS: &str = "firmware";

/// Folders whose `rust-toolchain.toml` names another toolchain than the root's.
const TOOLCHAINS: [&str; 3] = [KILOBOT.folder, chip::AVR, "playground"];

/// Installs the Rust toolchains and the Debian packages. Both are listed before they are installed.
pub fn run() -> Result<()> {
    let missing = missing(PACKAGES, is_there);
    println!(
        "Needed: the toolchains of rust-toolchain.toml in {ADDITIONS}, {}; they take 1 GB.",
        TOOLCHAINS.join(", ")
    );
    match missing.as_slice() {
        [] => println!("All Debian packages are there."),
        missing => println!("Needed and missing: the Debian packages {}.", missing.join(", ")),
    }
    // The one waits for the network while the other unpacks.
    at_once(rust, || install(&missing))?;
    Ok(())
}

/// Installs the toolchains, components and targets of each `rust-toolchain.toml`. No network is
/// needed if they are installed already.
pub fn rust() -> Result<()> {
    // `rustup toolchain install` may replace the compiler that other chores run at the same time.
    let additions = Additions::read()?;
    let add = |kind: &str, names: &[String]| {
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        let arguments = [&[kind, "add"], &names[..]].concat();
        Invocation::new("rustup", &arguments).in_workspace(ADDITIONS).run()
    };
    add("component", &additions.components)?;
    add("target", &additions.targets)?;
    for folder in TOOLCHAINS {
        Invocation::new("rustup", &["toolchain", "install"]).in_workspace(folder).run()?;
    }
    Ok(())
}

/// Components and targets that a `rust-toolchain.toml` names.
#[derive(Deserialize)]
struct Additions {
    components: Vec<String>,
    targets: Vec<String>,
}

impl Additions {
    fn read() -> Result<Additions> {
        #[derive(Deserialize)]
        struct ToolchainFile {
            toolchain: Additions,
        }
        let path = root().join(ADDITIONS).join("rust-toolchain.toml");
        let text = fs::read_to_string(&path)?;
        let file: ToolchainFile =
            toml::from_str(&text).with_context(|| path.display().to_string())?;
        Ok(file.toolchain)
    }
}

/// Installs node with npm.
pub fn node() -> Result<()> {
    install(&missing(NODE_PACKAGES, is_there))
}

/// Installs a browser, and a Python in a folder of its own with the packages that control the
/// browser. Returns the path of that Python.
pub fn browser() -> Result<PathBuf> {
    install(&missing(BROWSER_PACKAGES, is_there))?;
    python("page-tests", BROWSER_REQUIREMENTS, &[])
}

/// Installs the standard library for a target of the compiler.
pub fn rust_target(target: &str) -> Result<()> {
    Invocation::new("rustup", &["target", "add", target]).run()
}

/// Installs the linker of programs for Windows.
pub fn mingw() -> Result<()> {
    install(&missing(MINGW_PACKAGES, is_there))
}

/// Installs the programs that run programs for Windows.
pub fn wine() -> Result<()> {
    install(&missing(WINE_PACKAGES, is_there))
}

/// Installs the program that runs programs for Linux on 64-bit ARM.
pub fn qemu_user() -> Result<()> {
    install(&missing(ARM_PACKAGES, is_there))
}

/// Installs a Python in a folder of its own with cargo-zigbuild, zig and maturin. Returns the path of
/// that Python.
pub fn packers() -> Result<PathBuf> {
    python("packers", PACKER_REQUIREMENTS, &[])
}

/// Installs a Python in a folder of its own with cflib, Bitcraze's library for ground stations. Returns the path of that Python.
pub fn cflib() -> Result<PathBuf> {
    // scipy, which the tests do not use, is larger than all others together.
    python("cflib", CFLIB_REQUIREMENTS, &["--no-deps"])
}

/// Installs a Python in a folder of its own with the packages that build the Python module and test
/// it. Returns the path of that Python.
pub fn module_tests() -> Result<PathBuf> {
    python("python-module", MODULE_REQUIREMENTS, &[])
}

/// Installs a Python in a folder of its own with the Python module, the packages of the notebooks and
/// JupyterLab, and the browser that opens it. Returns the path of that Python.
pub fn notebooks() -> Result<PathBuf> {
    browser()?;
    with_module("notebooks", NOTEBOOK_REQUIREMENTS)
}

/// Installs a Python in a folder of its own with the Python module and the executors of sweeps, and Slurm.
/// Returns the path of that Python.
pub fn executors() -> Result<PathBuf> {
    install(&missing(SLURM_PACKAGES, is_there))?;
    with_module("executors", EXECUTOR_REQUIREMENTS)
}

/// Installs a Python with these packages and the Python module. Returns its path.
fn with_module(folder: &str, requirements: &str) -> Result<PathBuf> {
    let python = python(folder, requirements, &[])?;
    // As it is downloaded, where this computer can link it so.
    let wheel = python_module::release(Platform::of_this_computer())?;
    python_module::install(&python, &wheel)?;
    Ok(python)
}

/// Installs the spelling checker. Returns its path.
pub fn typos() -> Result<PathBuf> {
    let python = python("checks", CHECK_REQUIREMENTS, &[])?;
    Ok(python.with_file_name("typos"))
}

/// Installs a Python with these packages in a folder of its own in cargo's target folder. `options` are
/// for pip. Returns the path of that Python.
fn python(folder: &str, requirements: &str, options: &[&str]) -> Result<PathBuf> {
    install(&missing(PYTHON_PACKAGES, is_there))?;
    let folder = target()?.join(folder);
    let python = folder.join("bin/python3");
    if !python.is_file() {
        Invocation::new("python3", &["-m", "venv", &folder.display().to_string()]).run()?;
    }
    // This needs no network if the packages are installed already.
    let install = ["-m", "pip", "install", "--quiet", "--requirement", requirements];
    Invocation::named("pip", &python, &[&install, options].concat()).run()?;
    Ok(python)
}

fn is_there(sign: Sign) -> bool {
    match sign {
        Sign::Program(program) => is_installed(program),
        Sign::Libclang => has_libclang(),
        Sign::File(path) => Path::new(path).is_file(),
        Sign::Header(header) => Path::new("/usr/include").join(header).is_file(),
        Sign::Module(module) => {
            let import = format!("import {module}");
            Invocation::new("python3", &["-c", &import]).unannounced().output(0).is_ok()
        }
    }
}

fn install(missing: &[&str]) -> Result<()> {
    if missing.is_empty() {
        return Ok(());
    }
    let install = [&["install", "--yes", "--no-install-recommends"], missing].concat();
    if !is_root()? {
        bail!("packages are missing; please run: sudo apt-get {}", install.join(" "));
    }
    Invocation::new("apt-get", &["update"]).run()?;
    Invocation::new("apt-get", &install).env("DEBIAN_FRONTEND", "noninteractive").run()
}

fn missing(
    packages: &[(Sign, &'static str)],
    is_there: impl Fn(Sign) -> bool,
) -> Vec<&'static str> {
    let absent = packages.iter().filter(|(sign, _)| !is_there(*sign));
    absent.map(|(_, package)| *package).collect()
}

/// Searches for libclang in the most usual of the places that the crate `clang-sys` searches for
/// bindgen.
fn has_libclang() -> bool {
    if std::env::var_os("LIBCLANG_PATH").is_some() {
        return true;
    }
    let libraries = ["/usr/lib", "/usr/lib64", "/usr/local/lib"].map(PathBuf::from);
    // /usr/lib/llvm-14/lib, /usr/lib/x86_64-linux-gnu
    let below = children(Path::new("/usr/lib")).flat_map(|folder| [folder.join("lib"), folder]);
    libraries.into_iter().chain(below).any(|folder| {
        children(&folder)
            .any(|file| file.file_name().is_some_and(|n| is_libclang(&n.to_string_lossy())))
    })
}

/// Returns the entries of a folder, or none if the folder cannot be read.
fn children(folder: &Path) -> impl Iterator<Item = PathBuf> + use<> {
    fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path())
}

/// Returns true for `libclang.so`, `libclang-14.so` and `libclang-14.so.1`, but not for
/// `libclang-cpp.so`.
fn is_libclang(file: &str) -> bool {
    let Some((name, _)) = file.split_once(".so") else { return false };
    match name.strip_prefix("libclang") {
        Some("") => true,
        Some(version) => version.strip_prefix('-').is_some_and(|number| {
            !number.is_empty() && number.chars().all(|c| c.is_ascii_digit() || c == '.')
        }),
        None => false,
    }
}

fn is_root() -> Result<bool> {
    Ok(Invocation::new("id", &["-u"]).output(0)?.stdout.trim_ascii() == b"0")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_is_missing_is_installed() {
        assert!(missing(PACKAGES, |_| true).is_empty());
        let without_cc = |sign| !matches!(sign, Sign::Program("cc"));
        assert_eq!(missing(PACKAGES, without_cc), ["gcc"]);
        assert_eq!(missing(PACKAGES, |sign| !matches!(sign, Sign::Libclang)), ["libclang-dev"]);
    }

    #[test]
    fn toolchains_of_the_host_and_of_chips_are_the_same() {
        let channel = |folder: &str| {
            let file = root().join(folder).join("rust-toolchain.toml");
            let text = fs::read_to_string(file).unwrap();
            text.lines().find(|line| line.starts_with("channel")).unwrap().to_owned()
        };
        assert_eq!(channel(""), channel(ADDITIONS));
        // Each builds a library of its own, which stable cargo does not do.
        assert_eq!(channel("firmware/kilobot-avr"), channel("targets/avr"));
        assert_eq!(channel("firmware/kilobot-avr"), channel("playground"));
    }

    #[test]
    fn libclang_is_known_by_its_file_names() {
        for file in ["libclang.so", "libclang.so.1", "libclang-14.so.1", "libclang-14.0.6.so"] {
            assert!(is_libclang(file), "{file}");
        }
        for file in ["libclang-cpp.so.14", "libclangAST.a", "libclang.a", "libc.so.6"] {
            assert!(!is_libclang(file), "{file}");
        }
    }
}
