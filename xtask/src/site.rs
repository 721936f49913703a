//! Builds the playground as static files: the page, the module, and the examples as one file.
//!
//! A zip next to the folder has the same as a single page, which a browser opens without a server.

use crate::vendor;
use anyhow::{Result, ensure};
use bittybuzz_builds::setup;
use bittybuzz_builds::shell::{Invocation, root, target};
use bittybuzz_builds::zip::zip;
use fs_err as fs;
use lzma_rust2::{CheckType, XzOptions, XzWriter};
use serde_json::{Map, Value, json};
use std::io::Write;
use std::path::{Path, PathBuf};

const MODULE: &str = "bittybuzz-playground";
const PLAYGROUND: &str = "playground";
/// The program that makes the module compress better.
const TIGHTEN: &str = "bittybuzz-tighten";
const TARGET: &str = "wasm32-unknown-unknown";

/// Flags to build the standard library with the module.
const LIBRARY: [&str; 2] =
    ["-Zbuild-std=std,panic_abort", "-Zbuild-std-features=optimize_for_size"];

/// Flags for a small module. A panic traps without a text, because no page would show one, and
/// relocations are compressed so that the numbers of functions take as few bytes as possible. Code
/// that only other targets use would be a warning here alone.
const SMALL: [&str; 5] = [
    "-Dwarnings",
    "-Zunstable-options",
    "-Cpanic=immediate-abort",
    "-Zlocation-detail=none",
    "-Clink-arg=--compress-relocations",
];

/// The cargo profile of the module.
const PROFILE: &str = "module";

/// The folder of the site in cargo's target folder.
const SITE: &str = "site";

/// The zip with the site as a single page, in cargo's target folder.
pub const ZIP: &str = "bittybuzz-playground.zip";

/// The folder in the zip.
const FOLDER: &str = "bittybuzz-playground";

/// The script that writes the single page.
const OFFLINE: &str = "playground/offline.mjs";

/// The licenses, which belong to every copy.
const LICENSES: [&str; 2] = ["LICENSE-APACHE", "LICENSE-MIT"];

/// Folders with the files of the page, then those of the playground, which replace files with equal
/// names.
const PAGES: [&str; 2] = ["bbz/page/web", "playground/web"];

const EXAMPLES: &str = "examples";

/// Builds the site and its zip, and prints their paths.
pub fn run() -> Result<()> {
    let folder = build()?;
    println!("{}\n{}", folder.display(), folder.with_file_name(ZIP).display());
    Ok(())
}

/// Builds the site and its zip, and returns the path of the site.
pub fn build() -> Result<PathBuf> {
    let module = module()?;
    let site = target()?.join(SITE);
    if site.is_dir() {
        fs::remove_dir_all(&site)?;
    }
    fs::create_dir_all(&site)?;
    for page in PAGES {
        for entry in fs::read_dir(root().join(page))? {
            let path = entry?.path();
            fs::copy(&path, site.join(path.file_name().unwrap_or_default()))?;
        }
    }
    vendor::minify(&site)?;
    fs::write(site.join("playground.wasm.xz"), packed(&fs::read(module)?)?)?;
    fs::write(site.join("examples.json"), examples(root())?.to_string())?;
    fs::write(site.with_file_name(ZIP), zipped(&site)?)?;
    Ok(site)
}

/// Packs the module for the page, which unpacks it (bbz/page/editor/unpack.ts). Every browser unpacks gzip by itself, but that
/// takes 29 % more bytes. The options save half a percent: instructions of WebAssembly have no alignment, so that no bits of the
/// position are of use, and four bits of the byte before are of more use than three.
fn packed(module: &[u8]) -> Result<Vec<u8>> {
    let mut options = XzOptions::with_preset(9);
    (options.lzma_options.lc, options.lzma_options.pb) = (4, 0);
    options.set_check_sum_type(CheckType::Crc32);
    let mut writer = XzWriter::new(Vec::new(), options)?;
    writer.write_all(module)?;
    Ok(writer.finish()?)
}

/// Returns a zip with the site as a single page.
fn zipped(site: &Path) -> Result<Vec<u8>> {
    setup::node()?;
    let page = Invocation::new("node", &[OFFLINE, &site.display().to_string()]).output(0)?.stdout;
    let mut files = vec![(format!("{FOLDER}/index.html"), page)];
    for license in LICENSES {
        files.push((format!("{FOLDER}/{license}"), fs::read(root().join(license))?));
    }
    let files: Vec<_> = files.iter().map(|(name, content)| (&**name, &**content)).collect();
    Ok(zip(&files))
}

/// Builds the WebAssembly module with the flags for a small size, orders its functions so that it
/// compresses better, and returns its path.
pub fn module() -> Result<PathBuf> {
    Invocation::new("rustup", &["toolchain", "install"]).in_workspace(PLAYGROUND).run()?;
    let cargo =
        ["build", "--locked", "--profile", PROFILE, "--target", TARGET, "--package", MODULE];
    Invocation::new("cargo", &[&cargo, &LIBRARY[..]].concat())
        .in_workspace(PLAYGROUND)
        .env("RUSTFLAGS", &SMALL.join(" "))
        .run()?;
    let folder = target()?.join(TARGET).join(PROFILE);
    let [built, tight] =
        ["bittybuzz_playground.wasm", "playground.wasm"].map(|name| folder.join(name));
    let paths = [&built, &tight].map(|path| path.display().to_string());
    let tighten = ["run", "--locked", "--quiet", "--package", TIGHTEN, "--", &paths[0], &paths[1]];
    Invocation::new("cargo", &tighten).run()?;
    Ok(tight)
}

/// Returns the version of the module, the scripts, robot files and scenarios among the examples by
/// their paths, and the titles of the scenarios that need no emulator.
fn examples(root: &Path) -> Result<Value> {
    let mut files = Map::new();
    add(root, Path::new(EXAMPLES), &mut files)?;
    let of_vm = files.iter().filter_map(|(path, text)| Some((path, text.as_str()?))).filter(
        |(path, text)| {
            path.ends_with(".toml")
                && text.contains("[[robots]]")
                && !text.contains("backend = \"firmware\"")
        },
    );
    let paths: Vec<&str> = of_vm.map(|(path, _)| &**path).collect();
    ensure!(!paths.is_empty(), "no scenarios in {EXAMPLES}");
    let files = needed(&paths, &files);
    let named = |path: &&str| json!({ "path": path, "title": title(path) });
    let scenarios: Vec<Value> = paths.iter().map(named).collect();
    Ok(json!({ "version": env!("CARGO_PKG_VERSION"), "scenarios": scenarios, "files": files }))
}

/// Returns the scenarios and the files that one of them names, directly or by others. The rest, among
/// them the solutions of the lessons, would only be downloaded.
fn needed(scenarios: &[&str], files: &Map<String, Value>) -> Map<String, Value> {
    let mut needed: Map<String, Value> = Map::new();
    let mut waiting: Vec<&str> = scenarios.to_vec();
    while let Some(path) = waiting.pop() {
        let text = &files[path];
        if needed.insert(path.to_owned(), text.clone()).is_none() {
            let folder = path.rsplit_once('/').map_or("", |(folder, _)| folder);
            let text = text.as_str().expect("each file is a text");
            let is_named =
                |other: &&String| text.contains(&format!("\"{}\"", relative(folder, other)));
            waiting.extend(files.keys().filter(is_named).map(String::as_str));
        }
    }
    needed
}

/// Returns the path of a file as a file in `folder` names it.
fn relative(folder: &str, path: &str) -> String {
    let (mut from, mut to) = (folder.split('/').peekable(), path.split('/').peekable());
    while from.peek().is_some() && from.peek() == to.peek() {
        from.next();
        to.next();
    }
    from.map(|_| "..").chain(to).collect::<Vec<_>>().join("/")
}

/// Adds all files in a folder and its subfolders to which scenarios may refer.
fn add(root: &Path, folder: &Path, files: &mut Map<String, Value>) -> Result<()> {
    for entry in fs::read_dir(root.join(folder))? {
        let entry = entry?;
        let path = folder.join(entry.file_name());
        let ending = path.extension().and_then(|ending| ending.to_str());
        if entry.file_type()?.is_dir() {
            add(root, &path, files)?;
        } else if matches!(ending, Some("bzz" | "toml")) {
            let text = fs::read_to_string(root.join(&path))?;
            files.insert(path.display().to_string(), text.into());
        }
    }
    Ok(())
}

/// Returns the name of a scenario, with its folder.
fn title(path: &str) -> String {
    let path = path.strip_prefix("examples/").unwrap_or(path);
    path.strip_suffix(".toml").unwrap_or(path).replace('_', " ")
}
