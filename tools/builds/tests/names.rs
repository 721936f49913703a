//! All code for a robot is in the robot's own folders. Arena, command line, compiler, machine and
//! links must not name any robot.

use std::fs;
use std::path::Path;

use bittybuzz_builds::shell::root;

/// The folders that must not name robots.
const FOLDERS: [&str; 5] = ["arena", "bbz", "comms", "compiler", "vm-core"];

/// The robots that have firmware or a model of their own. Their lists are spec/files and
/// robots/models.
const ROBOTS: [&str; 3] = ["kilobot", "zooid", "crazyflie"];

/// Reads the files of ARGoS, which has an element of its own for each kind of robot.
const IMPORT: &str = "bbz/src/import/";

fn sources(folder: &Path, found: &mut Vec<(String, String)>) {
    for entry in fs::read_dir(folder).unwrap().flatten() {
        let path = entry.path();
        if path.is_dir() {
            sources(&path, found);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            let name = path.strip_prefix(root()).unwrap().display().to_string();
            found.push((name, fs::read_to_string(&path).unwrap()));
        }
    }
}

/// Returns true for lines that may name a robot: comments, which may contain an example or the
/// source of a number, and the examples in the help of a command, which call `bbz`.
fn is_document(line: &str) -> bool {
    // The explanation of an example is indented by 30 columns or more.
    if line.starts_with(&" ".repeat(30)) {
        return true;
    }
    let line = line.trim_start();
    let is_example = line.starts_with("bbz ") || line.contains("| bbz ") || line.contains("; bbz ");
    line.starts_with("//") || is_example
}

#[test]
fn folders_name_no_robot() {
    let mut found = Vec::new();
    for folder in FOLDERS {
        sources(&root().join(folder).join("src"), &mut found);
    }
    assert!(found.len() > 150, "{} files", found.len());
    let mut wrong = Vec::new();
    for (path, text) in &found {
        // Tests are at the end of a file, or in files whose names end with `tests.rs`.
        let ends = ["#[cfg(test)]\nmod ", "#[cfg(test)]\npub mod "];
        let end = ends.iter().filter_map(|end| text.find(end)).min().unwrap_or(text.len());
        let text = &text[..end];
        for (number, line) in text.lines().enumerate().filter(|(_, line)| !is_document(line)) {
            let small = line.to_lowercase();
            let is_named = ROBOTS.iter().any(|robot| small.contains(robot));
            if is_named && !path.ends_with("tests.rs") && !path.starts_with(IMPORT) {
                wrong.push(format!("{path}:{}: {}", number + 1, line.trim()));
            }
        }
    }
    assert!(wrong.is_empty(), "names of robots:\n{}", wrong.join("\n"));
}
