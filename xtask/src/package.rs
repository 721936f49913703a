//! Packs the files of a release: the tools and the Python module for this computer or for others, the
//! robots' firmware, and the site.

use crate::{book, site};
use anyhow::{Context, Result, bail};
use bittybuzz_builds::board::BOARDS;
use bittybuzz_builds::copy::files;
use bittybuzz_builds::programs::{self, PLATFORMS, Platform};
use bittybuzz_builds::shell::{Invocation, root, target};
use bittybuzz_builds::{python_module, setup};
use clap::ValueEnum;
use fs_err as fs;
use sha2::{Digest, Sha256};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

/// The folder of the archives in cargo's target folder.
const PACKAGES: &str = "package";

/// The folder of scripts and scenarios that the archive of the tools contains.
const EXAMPLES: &str = "examples/";

/// The folder of the book, to which the README leads.
const DOCS: &str = "docs/";

/// Other files of the repository to which the README leads.
const TEXTS: [&str; 10] = [
    "ARCHITECTURE.md",
    "CHANGELOG.md",
    "CITATION.cff",
    "CODE_OF_CONDUCT.md",
    "COMPATIBILITY.md",
    "CONTRIBUTING.md",
    "LICENSE-APACHE",
    "LICENSE-MIT",
    "README.md",
    "SECURITY.md",
];

/// A part of a release.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum ReleasePart {
    /// `bbz` and the emulator of Zooids, examples, manual pages and completions
    Tools,
    /// The Python module, with `bbz` in it, as a wheel for pip
    Wheel,
    /// The images of all robots, with the scripts of their own folders
    Firmware,
    /// The playground and the book as static files
    Site,
}

/// Returns the targets for which this computer packs tools and wheels.
pub fn targets() -> [&'static str; PLATFORMS.len()] {
    PLATFORMS.map(|platform| platform.target)
}

/// Packs one part, or all of them, and prints the files with their checksums. Tools and wheel are for
/// this computer, or for the target.
pub fn run(part: Option<ReleasePart>, target: Option<&str>) -> Result<()> {
    let has_target = matches!(part, Some(ReleasePart::Tools | ReleasePart::Wheel));
    if target.is_some() && !has_target {
        bail!(
            "`--target` is for `cargo xtask package tools` and `package wheel`: the other parts have no target"
        );
    }
    let platform = target.and_then(Platform::find);
    for part in part.as_ref().map_or(ReleasePart::value_variants(), std::slice::from_ref) {
        let file = match part {
            ReleasePart::Tools => pack(&target_name(platform)?, |folder| tools(folder, platform))?,
            ReleasePart::Wheel => wheel(platform)?,
            ReleasePart::Firmware => pack("firmware", firmware)?,
            ReleasePart::Site => pack("site", site)?,
        };
        let sum = checksum(&file)?;
        let name = file.file_name().context("a file without a name")?.to_string_lossy();
        fs::write(file.with_file_name(format!("{name}.sha256")), format!("{sum}  {name}\n"))?;
        println!("{}\n{sum}", file.display());
    }
    Ok(())
}

/// Builds the wheel, and copies it to the archives. Returns the path of the copy.
fn wheel(platform: Option<&'static Platform>) -> Result<PathBuf> {
    let wheel = python_module::release(platform)?;
    let packages = target()?.join(PACKAGES);
    fs::create_dir_all(&packages)?;
    let copy = packages.join(wheel.file_name().context("a wheel without a name")?);
    fs::copy(wheel, &copy)?;
    Ok(copy)
}

/// Returns the version of all packages.
pub const fn version() -> &'static str {
    env!("CARGO_PKG_VERSION")
}

/// Packs the files that `fill` writes to a folder. Returns the path of the archive.
fn pack(kind: &str, fill: impl FnOnce(&Path) -> Result<()>) -> Result<PathBuf> {
    let name = format!("bittybuzz-{}-{kind}", version());
    let packages = target()?.join(PACKAGES);
    let folder = packages.join(&name);
    if folder.is_dir() {
        fs::remove_dir_all(&folder)?;
    }
    fs::create_dir_all(&folder)?;
    fill(&folder)?;
    // The `tar` of Linux, macOS and Windows supports these options.
    let archive = packages.join(format!("{name}.tar.gz"));
    let [from, to] = [packages.display(), archive.display()].map(|path| path.to_string());
    Invocation::new("tar", &["-czf", &to, "-C", &from, &name]).run()?;
    Ok(archive)
}

/// Returns the target of a platform, or that for which rustc builds by default, such as
/// `x86_64-unknown-linux-gnu`.
fn target_name(platform: Option<&Platform>) -> Result<String> {
    if let Some(platform) = platform {
        return Ok(platform.target.to_owned());
    }
    let output = Invocation::new("rustc", &["--print", "host-tuple"]).unannounced().output(0)?;
    Ok(String::from_utf8(output.stdout)?.trim().to_owned())
}

fn tools(folder: &Path, platform: Option<&'static Platform>) -> Result<()> {
    let built = platform.map_or_else(programs::build_native, Platform::build)?;
    for program in &built {
        fs::copy(program, folder.join(program.file_name().context("a program without a name")?))?;
    }
    copy_files(folder, |file| is_text(file) || file.starts_with(EXAMPLES))?;
    let [man, completions] = ["man", "completions"].map(|name| folder.join(name));
    fs::create_dir_all(&man)?;
    fs::create_dir_all(&completions)?;
    // This computer may not run the packed program; its own one writes the same texts.
    let bbz = programs::build_own_bbz()?;
    Invocation::named("bbz", &bbz, &["manual", &man.display().to_string()]).run()?;
    for shell in ["bash", "fish", "powershell", "zsh"] {
        let output = Invocation::named("bbz", &bbz, &["completions", shell]).output(0)?;
        fs::write(completions.join(format!("bbz.{shell}")), output.stdout)?;
    }
    Ok(())
}

/// Returns true for the README and all that it leads to.
fn is_text(file: &str) -> bool {
    TEXTS.contains(&file) || file.starts_with(DOCS)
}

/// Copies the chosen files of the repository to the same places in a folder.
fn copy_files(folder: &Path, is_chosen: impl Fn(&str) -> bool) -> Result<()> {
    for file in files()?.iter().filter(|file| is_chosen(file)) {
        let copy = folder.join(file);
        fs::create_dir_all(copy.parent().context("the file is in a folder")?)?;
        fs::copy(root().join(file), copy)?;
    }
    Ok(())
}

fn firmware(folder: &Path) -> Result<()> {
    setup::run()?;
    for board in BOARDS {
        let image = board.build(None, false)?;
        let name = image.file_name().context("an image without a name")?;
        fs::copy(&image, folder.join(name))?;
        fs::copy(
            root().join(board.folder).join("README.md"),
            folder.join(format!("{}.md", board.robot)),
        )?;
        let hex = image.with_extension("hex");
        if hex.is_file() {
            fs::copy(&hex, folder.join(hex.file_name().context("an image without a name")?))?;
        }
    }
    copy_files(folder, is_text)
}

fn site(folder: &Path) -> Result<()> {
    let site = site::build()?;
    copy_all(&site, folder)?;
    fs::copy(site.with_file_name(site::ZIP), folder.join(site::ZIP))?;
    book::build(&folder.join("book"))
}

fn copy_all(from: &Path, to: &Path) -> Result<()> {
    for entry in fs::read_dir(from)? {
        let entry = entry?;
        if entry.file_type()?.is_dir() {
            bail!("{}: the site has no folders", entry.path().display());
        }
        fs::copy(entry.path(), to.join(entry.file_name()))?;
    }
    Ok(())
}

/// Returns the SHA-256 of a file in hexadecimal.
fn checksum(file: &Path) -> Result<String> {
    let mut text = String::new();
    for byte in Sha256::digest(fs::read(file)?) {
        write!(text, "{byte:02x}")?;
    }
    Ok(text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_tools_have_a_target() {
        for part in [None, Some(ReleasePart::Firmware), Some(ReleasePart::Site)] {
            let error = run(part, Some("x86_64-pc-windows-gnu")).unwrap_err().to_string();
            assert!(error.starts_with("`--target` is for `cargo xtask package tools`"), "{error}");
        }
        assert!(targets().into_iter().all(|target| Platform::find(target).is_some()));
    }

    #[test]
    fn archives_contain_each_file_to_which_the_readme_leads() {
        let readme = fs::read_to_string(root().join("README.md")).unwrap();
        let links = readme.split("](").skip(1).map(|rest| rest.split(')').next().unwrap());
        let files: Vec<&str> = links.filter(|link| !link.contains("://")).collect();
        assert!(files.contains(&"docs/start.md"));
        for file in files {
            assert!(is_text(file) && root().join(file).is_file(), "{file}");
        }
    }
}
