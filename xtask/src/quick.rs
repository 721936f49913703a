//! The short loop after a change: it formats the sources, then lints and tests the changed crates
//! and the language's conformance. It starts no emulator and no browser.

use anyhow::{Context, Result, ensure};
use bittybuzz_builds::cargo_test::{self, BBZ, EMULATORS, GUIDES, PYTHON, all_tests};
use bittybuzz_builds::shell::{Invocation, cargo, root};
use bittybuzz_builds::test_programs;
use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};

/// The package whose tests compare scripts with results of the reference machine.
const CONFORMANCE: &str = "bittybuzz-tests";

/// Packages whose tests start emulators or take long for another reason, and the steps of CI that
/// run them.
const LEFT_OUT: [(&str, &str); 4] = [
    ("bittybuzz-hil", "tests"),
    (GUIDES, "guides"),
    ("bittybuzz-model", "tests"),
    (PYTHON, "python"),
];

/// The choices of the command line.
#[derive(Debug, clap::Args)]
pub struct QuickArguments {
    /// Changes since this commit count; `origin/main`, or the last tag without it
    #[arg(long, value_name = "REF")]
    base: Option<String>,
    /// Add the crates that use the changed ones directly
    #[arg(long, conflicts_with = "all")]
    users: bool,
    /// All crates, changed or not
    #[arg(long)]
    all: bool,
}

/// A package of the root workspace.
#[derive(Debug)]
struct Package {
    /// The folder from the root.
    folder: String,
    /// Names of the packages that it uses directly, those of its tests included.
    uses: BTreeSet<String>,
}

/// The packages by name.
type Packages = BTreeMap<String, Package>;

/// Checks the changed crates.
pub fn run(arguments: &QuickArguments) -> Result<()> {
    let packages = packages()?;
    let changed = changed_files(&base(arguments.base.as_deref())?)?;
    let (mut chosen, others) = owners(&packages, &changed);
    if arguments.users {
        let users = users(&packages, &chosen);
        chosen.extend(users);
    }
    if arguments.all {
        chosen = packages.keys().cloned().collect();
    }
    let (tested, left_out): (BTreeSet<String>, BTreeSet<String>) =
        chosen.into_iter().partition(|name| step_of(name).is_none());
    cargo(&["fmt", "--all"])?;
    let selected = |names: &BTreeSet<String>| -> Vec<String> {
        names.iter().flat_map(|name| ["--package".to_owned(), name.clone()]).collect()
    };
    let named = selected(&tested);
    let named: Vec<&str> = named.iter().map(String::as_str).collect();
    if tested.is_empty() {
        println!("quick: no crate of the root workspace has changed that it tests");
    } else {
        let lints = ["--all-targets", "--", "-D", "warnings"];
        cargo(&[&["clippy"], &named[..], &lints[..]].concat())?;
    }
    // Compiled with the packages that share a build, as this program is, so that both use the same crates.
    let bbz = cargo_test::bbz()?.display().to_string();
    if !tested.is_empty() {
        test_programs::run(&named, &[], &[(BBZ, bbz.as_str())], || Ok(()), || Ok(Vec::new()))?;
    }
    if !tested.contains(CONFORMANCE) {
        all_tests(&["--test", "tests"], &["conformance::", "language::"]).env(BBZ, &bbz).run()?;
    }
    println!("\nquick: passed for {}", list(&tested));
    for name in &left_out {
        println!(
            "left out: {name}, which `cargo xtask ci {}` tests",
            step_of(name).unwrap_or("tests")
        );
    }
    if !others.is_empty() {
        println!("left out: {}, which `cargo xtask ci` checks", list(&others));
    }
    println!("left out: images, emulators, browser, guides and long tests: `cargo xtask ci`");
    Ok(())
}

fn list(names: &BTreeSet<String>) -> String {
    if names.is_empty() {
        return "the language's conformance alone".to_owned();
    }
    names.iter().map(String::as_str).collect::<Vec<_>>().join(", ")
}

/// Returns the step of CI that tests a package, if `quick` does not.
fn step_of(package: &str) -> Option<&'static str> {
    if EMULATORS.contains(&package) {
        return Some("emulators");
    }
    LEFT_OUT.iter().find(|(name, _)| *name == package).map(|(_, step)| *step)
}

/// Returns the commit since which changes count.
fn base(wanted: Option<&str>) -> Result<String> {
    let git = |arguments: &[&str]| -> Option<String> {
        let output = Invocation::new("git", arguments).unannounced().output_if(|_| true).ok()?;
        let text = String::from_utf8(output.stdout).ok()?;
        output.status.success().then(|| text.trim().to_owned())
    };
    let reference = match wanted {
        Some(reference) => reference.to_owned(),
        None => git(&["rev-parse", "--verify", "--quiet", "origin/main"])
            .or_else(|| git(&["describe", "--tags", "--abbrev=0"]))
            .context("there is no `origin/main` and no tag: name a commit by `--base REF`")?,
    };
    git(&["merge-base", &reference, "HEAD"])
        .with_context(|| format!("`{reference}` is no commit that this branch comes from"))
}

/// Returns the files that differ from a commit, uncommitted and new files included.
fn changed_files(base: &str) -> Result<BTreeSet<String>> {
    let mut files = BTreeSet::new();
    // With `-z` git does not quote names.
    for arguments in [
        &["diff", "-z", "--name-only", base][..],
        &["ls-files", "-z", "--others", "--exclude-standard"],
    ] {
        let output = Invocation::new("git", arguments).unannounced().output(0)?;
        let names = String::from_utf8(output.stdout)?;
        files.extend(names.split_terminator('\0').map(str::to_owned));
    }
    Ok(files)
}

/// Reads the packages of the root workspace.
fn packages() -> Result<Packages> {
    let arguments = ["metadata", "--no-deps", "--format-version", "1"];
    let output = Invocation::cargo(&arguments).unannounced().output(0)?;
    let metadata: Value = serde_json::from_slice(&output.stdout)?;
    let list = metadata["packages"].as_array().context("cargo's metadata has no packages")?;
    let mut packages = Packages::new();
    for package in list {
        let text = |key: &str| package[key].as_str().context("cargo's metadata has another form");
        let manifest = std::path::Path::new(text("manifest_path")?);
        let folder = manifest.parent().and_then(|folder| folder.strip_prefix(root()).ok());
        let folder = folder.context("a package is outside the repository")?.display().to_string();
        let dependencies = package["dependencies"].as_array().into_iter().flatten();
        let uses =
            dependencies.filter_map(|used| used["name"].as_str()).map(str::to_owned).collect();
        packages.insert(text("name")?.to_owned(), Package { folder, uses });
    }
    ensure!(!packages.is_empty(), "cargo's metadata has no packages");
    Ok(packages)
}

/// Returns the packages that own files, and the top folders or names of files that no package owns.
fn owners(packages: &Packages, files: &BTreeSet<String>) -> (BTreeSet<String>, BTreeSet<String>) {
    let (mut owned, mut others) = (BTreeSet::new(), BTreeSet::new());
    for file in files {
        let holds = |package: &Package| {
            file.strip_prefix(&package.folder).is_some_and(|rest| rest.starts_with('/'))
        };
        let holders = packages.iter().filter(|(_, package)| holds(package));
        match holders.max_by_key(|(_, package)| package.folder.len()) {
            Some((name, _)) => owned.insert(name.clone()),
            None => others.insert(file.split('/').next().unwrap_or(file).to_owned()),
        };
    }
    (owned, others)
}

/// Returns the packages that use one of these directly.
fn users(packages: &Packages, used: &BTreeSet<String>) -> BTreeSet<String> {
    let is_user = |(_, package): &(&String, &Package)| !package.uses.is_disjoint(used);
    packages.iter().filter(is_user).map(|(name, _)| name.clone()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample() -> Packages {
        let package = |folder: &str, uses: &[&str]| Package {
            folder: folder.to_owned(),
            uses: uses.iter().map(|name| (*name).to_owned()).collect(),
        };
        Packages::from([
            ("core".to_owned(), package("core", &[])),
            ("tuning".to_owned(), package("core/tuning", &[])),
            ("tool".to_owned(), package("tool", &["core"])),
        ])
    }

    fn set(names: &[&str]) -> BTreeSet<String> {
        names.iter().map(|name| (*name).to_owned()).collect()
    }

    #[test]
    fn a_file_belongs_to_the_innermost_package() {
        let files = set(&[
            "core/src/lib.rs",
            "core/tuning/build.rs",
            "corenot/x",
            "docs/a.md",
            "README.md",
        ]);
        let (owned, others) = owners(&sample(), &files);
        assert_eq!(owned, set(&["core", "tuning"]));
        assert_eq!(others, set(&["README.md", "corenot", "docs"]));
    }

    #[test]
    fn users_are_those_that_use_a_changed_package_directly() {
        assert_eq!(users(&sample(), &set(&["core"])), set(&["tool"]));
        assert_eq!(users(&sample(), &set(&["tuning"])), set(&[]));
    }

    #[test]
    fn packages_that_are_left_out_exist() {
        let packages = packages().unwrap();
        for (name, _) in LEFT_OUT {
            assert!(packages.contains_key(name), "{name}");
        }
        assert!(packages.contains_key(CONFORMANCE));
    }

    #[test]
    fn an_unknown_base_is_named() {
        let error = base(Some("no-such-commit")).unwrap_err().to_string();
        assert!(error.contains("`no-such-commit` is no commit"), "{error}");
    }
}
