//! Builds the programs of a release, for this computer and for others.
//!
//! Programs for Linux need only a version of glibc that all distributions of the last ten years have.
//! The linker of zig takes the oldest version as a part of the target; that of the system would take the
//! system's own. The programs link no other library.

use crate::setup;
use crate::shell::{Invocation, target};
use anyhow::{Context, Result, bail, ensure};
use fs_err as fs;
use object::Endianness;
use object::elf::FileHeader64;
use object::read::elf::FileHeader;
use std::env::consts;
use std::path::{Path, PathBuf};

/// The cargo profile of programs that are downloaded, without debug information.
pub const PROFILE: &str = "dist";

/// Packages of programs that link no libraries but those of the system.
const PACKAGES: [&str; 2] = ["bbz", "bittybuzz-emulate-m0"];

/// The version of glibc that programs for Linux need: that of manylinux2014, of 2012.
const GLIBC: (u32, u32) = (2, 17);

/// The same version as the name of a standard for wheels (PEP 600).
const MANYLINUX: &str = "manylinux_2_17";

/// Wine for 64-bit programs. The script `wine` prints that Wine for 32 bits is not installed.
pub const WINE: &str = "/usr/lib/wine/wine64";

/// A kind of computers for which this computer builds programs.
#[derive(Debug, PartialEq, Eq)]
pub struct Platform {
    /// The compiler's target name.
    pub target: &'static str,
    /// The ending of the names of programs.
    suffix: &'static str,
    /// True for programs that load glibc.
    has_glibc: bool,
    /// The program of this computer that runs those of the platform, with its first arguments.
    runner: &'static [&'static str],
}

/// Linux on x86-64.
pub const LINUX: Platform =
    Platform { target: "x86_64-unknown-linux-gnu", suffix: "", has_glibc: true, runner: &[] };

/// Linux on 64-bit ARM, as on a Raspberry Pi.
pub const LINUX_ARM: Platform = Platform {
    target: "aarch64-unknown-linux-gnu",
    suffix: "",
    has_glibc: true,
    runner: &["qemu-aarch64", "-L", "/usr/aarch64-linux-gnu"],
};

/// Windows on x86-64.
pub const WINDOWS: Platform =
    Platform { target: "x86_64-pc-windows-gnu", suffix: ".exe", has_glibc: false, runner: &[WINE] };

/// All platforms.
pub const PLATFORMS: [&Platform; 3] = [&LINUX, &LINUX_ARM, &WINDOWS];

/// Builds the programs for this computer as it is, and returns their paths.
pub fn build_native() -> Result<Vec<PathBuf>> {
    build(&PACKAGES, None)
}

/// Builds `bbz` for this computer, as it is downloaded where this computer can link it so. Returns its
/// path.
pub fn build_own_bbz() -> Result<PathBuf> {
    let platform = Platform::of_this_computer();
    build(&PACKAGES[..1], platform)?.pop().context("a build has a program")
}

impl Platform {
    /// Returns the platform with a target name.
    pub fn find(target: &str) -> Option<&'static Platform> {
        PLATFORMS.into_iter().find(|platform| platform.target == target)
    }

    /// Returns the platform that this computer has itself; `None` if it is none of them.
    pub fn of_this_computer() -> Option<&'static Platform> {
        let target = format!("{}-unknown-{}-gnu", consts::ARCH, consts::OS);
        Platform::find(&target)
    }

    /// Installs the linker, builds the programs, and returns their paths.
    pub fn build(&'static self) -> Result<Vec<PathBuf>> {
        build(&PACKAGES, Some(self))
    }

    /// Builds `bbz`, and returns its path.
    pub fn build_bbz(&'static self) -> Result<PathBuf> {
        build(&PACKAGES[..1], Some(self))?.pop().context("a build has a program")
    }

    /// Returns the words that run a program of the platform on this computer.
    pub fn command(&self, program: &Path) -> Vec<String> {
        let runner = self.runner.iter().map(|word| (*word).to_owned());
        runner.chain([program.display().to_string()]).collect()
    }

    /// Returns cargo's build for the platform with these arguments.
    fn cargo(&self, arguments: &[&str]) -> Result<Invocation> {
        self.install()?;
        if !self.has_glibc {
            let arguments = [&["build", "--target", self.target], arguments].concat();
            return Ok(Invocation::cargo(&arguments));
        }
        let python = setup::packers()?;
        let target = format!("{}.{}.{}", self.target, GLIBC.0, GLIBC.1);
        let arguments = [&["zigbuild", "--locked", "--target", &target], arguments].concat();
        let zigbuild = python.with_file_name("cargo-zigbuild");
        Ok(self.with_linker(Invocation::named("cargo-zigbuild", &zigbuild, &arguments), &python))
    }

    /// Installs the compiler's library and the linker for the platform, but not that of zig.
    fn install(&self) -> Result<()> {
        setup::rust_target(self.target)?;
        if self.has_glibc { Ok(()) } else { setup::mingw() }
    }

    /// Adds the variable by which cargo-zigbuild and maturin find the zig of a Python.
    pub(crate) fn with_linker(&self, line: Invocation, python: &Path) -> Invocation {
        line.env("CARGO_ZIGBUILD_PYTHON_PATH", &python.display().to_string())
    }

    /// Installs the compiler's library and the linker, and returns the options of maturin for a wheel of
    /// the platform. maturin refuses a wheel for Linux that needs a newer glibc than [`GLIBC`].
    pub(crate) fn wheel_options(&self) -> Result<Vec<&'static str>> {
        self.install()?;
        let glibc: &[&str] =
            if self.has_glibc { &["--zig", "--compatibility", MANYLINUX] } else { &[] };
        Ok([&["--target", self.target], glibc].concat())
    }
}

fn build(packages: &[&str], platform: Option<&Platform>) -> Result<Vec<PathBuf>> {
    let selected: Vec<&str> = packages.iter().flat_map(|package| ["--package", package]).collect();
    let arguments = [&["--profile", PROFILE], &selected[..]].concat();
    let folder = match platform {
        None => {
            Invocation::cargo(&[&["build"], &arguments[..]].concat()).run()?;
            target()?.join(PROFILE)
        }
        Some(platform) => {
            platform.cargo(&arguments)?.run()?;
            target()?.join(platform.target).join(PROFILE)
        }
    };
    let suffix = platform.map_or(consts::EXE_SUFFIX, |platform| platform.suffix);
    let programs: Vec<PathBuf> =
        packages.iter().map(|package| folder.join(program(package) + suffix)).collect();
    if platform.is_some_and(|platform| platform.has_glibc) {
        programs.iter().try_for_each(|program| check_glibc(program))?;
    }
    Ok(programs)
}

/// Returns the name of the program of a package.
fn program(package: &str) -> String {
    package.trim_start_matches("bittybuzz-").replace("emulate", "bbz-emulate")
}

/// Fails if a program needs a newer glibc than [`GLIBC`].
fn check_glibc(program: &Path) -> Result<()> {
    let needed = glibc_needed(&fs::read(program)?)
        .with_context(|| format!("{}: which glibc it needs is unknown", program.display()))?;
    let (major, minor) = needed;
    ensure!(needed <= GLIBC, "{} needs glibc {major}.{minor}", program.display());
    Ok(())
}

/// Returns the newest version of glibc whose symbols a program for Linux uses.
fn glibc_needed(elf: &[u8]) -> Result<(u32, u32)> {
    let header = FileHeader64::<Endianness>::parse(elf)?;
    let endian = header.endian()?;
    let sections = header.sections(endian, elf)?;
    let Some((mut needs, strings)) = sections.gnu_verneed(endian, elf)? else {
        bail!("it loads no library");
    };
    let strings = sections.strings(endian, elf, strings)?;
    let mut newest = None;
    while let Some((_, mut versions)) = needs.next()? {
        while let Some(version) = versions.next()? {
            let name = String::from_utf8_lossy(version.name(endian, strings)?).into_owned();
            newest = newest.max(glibc_version(&name));
        }
    }
    newest.context("it uses no version of glibc")
}

/// Parses a version such as `GLIBC_2.17` and `GLIBC_2.2.5`.
fn glibc_version(name: &str) -> Option<(u32, u32)> {
    let mut numbers = name.strip_prefix("GLIBC_")?.split('.').map(str::parse);
    Some((numbers.next()?.ok()?, numbers.next()?.ok()?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn programs_have_the_names_of_their_packages() {
        assert_eq!(PACKAGES.map(program), ["bbz", "bbz-emulate-m0"]);
    }

    #[test]
    fn wheels_need_the_glibc_of_the_programs() {
        assert_eq!(MANYLINUX, format!("manylinux_{}_{}", GLIBC.0, GLIBC.1));
    }

    #[test]
    fn platforms_have_names_and_runners() {
        assert_eq!(Platform::find("x86_64-pc-windows-gnu"), Some(&WINDOWS));
        assert_eq!(Platform::find("x86_64-apple-darwin"), None);
        assert_eq!(WINDOWS.command(Path::new("bbz.exe")), [WINE, "bbz.exe"]);
        assert_eq!(LINUX.command(Path::new("/a/bbz")), ["/a/bbz"]);
    }

    #[test]
    fn versions_of_glibc_are_compared_by_number() {
        assert_eq!(glibc_version("GLIBC_2.2.5"), Some((2, 2)));
        assert!(glibc_version("GLIBC_2.17") > glibc_version("GLIBC_2.9"));
        assert_eq!(glibc_version("GLIBC_PRIVATE"), None);
        assert_eq!(glibc_version("GCC_3.0"), None);
    }

    /// The running test was linked with the glibc of this computer; `ldd --version` names it.
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    #[test]
    fn a_program_of_this_computer_needs_at_most_its_glibc() {
        let own = fs::read(std::env::current_exe().unwrap()).unwrap();
        let needed = glibc_needed(&own).unwrap();
        let printed = Invocation::new("ldd", &["--version"]).output(0).unwrap().stdout;
        let printed = String::from_utf8(printed).unwrap();
        let installed = printed.lines().next().unwrap().rsplit(' ').next().unwrap();
        assert!(needed > (2, 2), "{needed:?}");
        assert!(Some(needed) <= glibc_version(&format!("GLIBC_{installed}")), "{needed:?}");
    }

    #[test]
    fn files_that_are_no_programs_are_refused() {
        assert!(glibc_needed(b"").is_err());
        assert!(glibc_needed(b"\x7fELF").is_err());
    }
}
