//! The demonstration of the project: runs a script, explains errors, simulates a swarm, and shows the
//! swarm in a page.
//!
//! It compiles only `bbz`.

use anyhow::{Result, ensure};
use bittybuzz_shell::{Invocation, cargo, root, target};
use fs_err as fs;
use std::io::IsTerminal;
use std::path::{Path, PathBuf};

/// A script that uses the clock and the LED.
const SCRIPT: &str = "examples/blink.bzz";
/// Number of steps, enough to see the behavior start.
const STEPS: &str = "12";
/// A scenario that only a swarm can solve.
const SWARM: &str = "examples/swarm/gradient.toml";
/// The folder of the swarm's pictures, from the root.
const PICTURES: &str = "target/demo";

/// Exit status of `bbz` for a script that does not compile.
const COMPILE_ERROR: i32 = 2;

/// The profile in which `bbz` is compiled soonest.
const PROFILE: &str = "demonstration";

/// Runs the demonstration.
pub fn run(no_browser: bool) -> Result<()> {
    let bbz = without_page()?;
    println!("The same with the firmware of robots, in emulation: cargo xtask demo --robots");
    show(&bbz, no_browser)
}

/// Runs the parts before the page. Returns the path of `bbz`.
pub fn without_page() -> Result<PathBuf> {
    cargo(&["build", "--package", "bbz", "--profile", PROFILE])?;
    let bbz = target()?.join(PROFILE).join(format!("bbz{}", std::env::consts::EXE_SUFFIX));
    heading(SCRIPT)?;
    Invocation::named("bbz", &bbz, &["run", SCRIPT, "--steps", STEPS]).run()?;
    for script in scripts(root(), "examples/errors")? {
        heading(&script)?;
        let output = Invocation::named("bbz", &bbz, &["check", &script]).output(COMPILE_ERROR)?;
        let diagnostics = String::from_utf8_lossy(&output.stderr);
        print!("{diagnostics}");
        if let Some(code) = error_code(&diagnostics) {
            println!();
            Invocation::named("bbz", &bbz, &["explain", code]).run()?;
        }
    }
    println!(
        "\n== {SWARM}: thirty Kilobots count their hops to a source, which is then carried away"
    );
    Invocation::named("bbz", &bbz, &["sim", SWARM, "--headless", "--svg", PICTURES]).run()?;
    println!("\nPictures of the swarm, for a browser:");
    for picture in pictures(&root().join(PICTURES))? {
        println!("  {PICTURES}/{picture}");
    }
    Ok(bbz)
}

/// Shows the swarm in a page until the user closes the page. Without a terminal, Ctrl-C could not
/// end the page, so the command is printed instead.
fn show(bbz: &Path, no_browser: bool) -> Result<()> {
    if !std::io::stdout().is_terminal() {
        println!("The same swarm in a page: bbz sim {SWARM} --view");
        return Ok(());
    }
    println!("\n== {SWARM} in a page: press Play there; close it, or press Ctrl-C, to end");
    let arguments: &[&str] = if no_browser { &["--no-browser"] } else { &[] };
    Invocation::named("bbz", bbz, &[&["sim", SWARM, "--view"], arguments].concat()).run()
}

/// Returns the names of the files in a folder, in alphabetical order.
fn pictures(folder: &Path) -> Result<Vec<String>> {
    let names = fs::read_dir(folder)?.map(|entry| Ok(entry?.file_name().display().to_string()));
    let mut names = names.collect::<Result<Vec<_>>>()?;
    names.sort();
    Ok(names)
}

/// Returns the scripts of a folder in alphabetical order, as paths from the root.
fn scripts(root: &Path, folder: &str) -> Result<Vec<String>> {
    let path = root.join(folder);
    let mut scripts = Vec::new();
    for entry in fs::read_dir(&path)? {
        let name = entry?.file_name().to_string_lossy().into_owned();
        if name.ends_with(".bzz") {
            scripts.push(format!("{folder}/{name}"));
        }
    }
    scripts.sort();
    ensure!(!scripts.is_empty(), "no scripts in {folder}");
    Ok(scripts)
}

/// Prints a script's path and the comment in its first line.
fn heading(script: &str) -> Result<()> {
    let path = root().join(Path::new(script));
    let text = fs::read_to_string(&path)?;
    println!("\n== {script}{}", subject(&text));
    Ok(())
}

fn subject(text: &str) -> String {
    match text.lines().next().and_then(|line| line.strip_prefix('#')) {
        Some(comment) => format!(": {}", comment.trim()),
        None => String::new(),
    }
}

/// Returns the first error code in diagnostics: `error[E0201]: ...`.
fn error_code(diagnostics: &str) -> Option<&str> {
    let (_, rest) = diagnostics.split_once("error[")?;
    rest.split_once(']').map(|(code, _)| code)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_error_is_explained() {
        assert_eq!(error_code("warning[W0102]: x\nerror[E0201]: y\nerror[E1]"), Some("E0201"));
        assert_eq!(error_code("warning[W0102]: x"), None);
        assert_eq!(error_code("error[E02"), None);
    }

    #[test]
    fn the_subject_is_the_first_comment() {
        assert_eq!(subject("# Blinks.\nx = 1"), ": Blinks.");
        assert_eq!(subject("x = 1"), "");
        assert_eq!(subject(""), "");
    }

    #[test]
    fn scripts_of_a_folder() {
        let folder = tempfile::tempdir().unwrap();
        let root = folder.path();
        for file in ["some/b.bzz", "some/a.bzz", "some/notes.md", "some/inner/c.bzz", "none/x"] {
            let path = root.join(file);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, "").unwrap();
        }
        assert_eq!(scripts(root, "some").unwrap(), ["some/a.bzz", "some/b.bzz"]);
        assert_eq!(scripts(root, "none").unwrap_err().to_string(), "no scripts in none");
        assert!(scripts(root, "no/such").is_err());
    }
}
