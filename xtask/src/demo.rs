//! Shows what the project does: runs the examples, lets the tool explain errors, boots a robot's firmware, then that of a whole swarm.

use crate::beside;
use crate::checks::quick;
use crate::failure::Failure;
use crate::setup;
use crate::shell::{Line, root, target};
use crate::unlike;
use std::fs;
use std::path::{Path, PathBuf};

/// Enough steps to see a behaviour start.
const STEPS: &str = "12";

/// Exit status of `bbz` for a script that does not compile.
const COMPILE_ERROR: i32 = 2;

/// The whole demonstration.
pub fn run() -> Result<(), Failure> {
    setup::run()?;
    // The one that the tests use.
    quick(&["build", "--package", "bbz"]).run()?;
    let bbz = target()?.join("debug").join(format!("bbz{}", std::env::consts::EXE_SUFFIX));
    for script in scripts(root(), "examples")? {
        heading(&script)?;
        Line::named("bbz", &bbz, &["run", &script, "--steps", STEPS]).run()?;
    }
    for script in scripts(root(), "examples/errors")? {
        heading(&script)?;
        let output = Line::named("bbz", &bbz, &["check", &script]).output(COMPILE_ERROR)?;
        let diagnostics = String::from_utf8_lossy(&output.stderr);
        print!("{diagnostics}");
        if let Some(code) = error_code(&diagnostics) {
            println!();
            Line::named("bbz", &bbz, &["explain", code]).run()?;
        }
    }
    beside::run(&bbz)?;
    unlike::run(&bbz)
}

/// The scripts of a folder in alphabetical order, each with its path from the root.
fn scripts(root: &Path, folder: &str) -> Result<Vec<String>, Failure> {
    let path = root.join(folder);
    let failed = |reason| Failure::Read { path: path.clone(), reason };
    let mut scripts = Vec::new();
    for entry in fs::read_dir(&path).map_err(failed)? {
        let name = entry.map_err(failed)?.file_name().to_string_lossy().into_owned();
        if name.ends_with(".bzz") {
            scripts.push(format!("{folder}/{name}"));
        }
    }
    scripts.sort();
    match scripts.is_empty() {
        true => Err(Failure::Empty { folder: PathBuf::from(folder) }),
        false => Ok(scripts),
    }
}

/// Prints a script's path and what its first line says about it.
fn heading(script: &str) -> Result<(), Failure> {
    let path = root().join(Path::new(script));
    let text = fs::read_to_string(&path).map_err(|reason| Failure::Read { path, reason })?;
    println!("\n== {script}{}", subject(&text));
    Ok(())
}

fn subject(text: &str) -> String {
    match text.lines().next().and_then(|line| line.strip_prefix('#')) {
        Some(comment) => format!(": {}", comment.trim()),
        None => String::new(),
    }
}

/// The first error code in diagnostics: `error[E0201]: ...`.
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
        let root = std::env::temp_dir().join(format!("xtask-demo-{}", std::process::id()));
        for file in ["some/b.bzz", "some/a.bzz", "some/notes.md", "some/inner/c.bzz", "none/x"] {
            let path = root.join(file);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, "").unwrap();
        }
        assert_eq!(scripts(&root, "some").unwrap(), ["some/a.bzz", "some/b.bzz"]);
        assert!(matches!(scripts(&root, "none"), Err(Failure::Empty { .. })));
        assert!(matches!(scripts(&root, "no/such"), Err(Failure::Read { .. })));
        fs::remove_dir_all(root).unwrap();
    }
}
