//! The packages of the page's editor, and the tool that makes scripts small.
//!
//! The packages are bundled into one file. The file is committed, so that a build of `bbz` needs no npm.

use anyhow::{Result, ensure};
use bittybuzz_builds::setup;
use bittybuzz_builds::shell::{Invocation, root, target};
use fs_err as fs;
use std::path::Path;

/// The folder with the versions of the packages and the program that bundles them.
const EDITOR: &str = "bbz/page/editor";

/// The bundle, from the root.
const BUNDLE: &str = "bbz/page/web/vendor.js";

/// Writes the bundle.
pub fn run() -> Result<()> {
    build(&root().join(BUNDLE))
}

/// Fails if the committed bundle differs from a new one.
pub fn check() -> Result<()> {
    let again = target()?.join("vendor.js");
    build(&again)?;
    let is_same = fs::read(&again)? == fs::read(root().join(BUNDLE))?;
    ensure!(is_same, "{BUNDLE} is not what {EDITOR} makes: `cargo xtask vendor` writes it");
    Ok(())
}

fn build(bundle: &Path) -> Result<()> {
    run_with_packages("build.js", bundle)
}

/// Writes the scripts of a folder again as one, and its style, without comments and with short names.
pub fn minify(folder: &Path) -> Result<()> {
    run_with_packages("minify.js", folder)
}

/// Installs the packages and runs a program that uses them, with a path as its argument.
fn run_with_packages(program: &str, path: &Path) -> Result<()> {
    setup::node()?;
    // npm installs the packages of the lock file and checks their hashes. No package may run a
    // program of its own.
    Invocation::new("npm", &["ci", "--ignore-scripts", "--no-audit", "--no-fund"])
        .in_workspace(EDITOR)
        .run()?;
    Invocation::new("node", &[program, &path.display().to_string()]).in_workspace(EDITOR).run()
}
