//! A top folder may depend only on top folders above it, as ARCHITECTURE.md states. The test compares
//! this with the dependencies of the crates.

use bittybuzz_builds::copy::files;
use bittybuzz_builds::shell::{Invocation, root};
use serde_json::Value;
use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

/// More rows would not be a map any more.
const FLOORS_MAX: usize = 24;

/// Returns the folder of each row of the table of floors.
fn floors() -> Vec<String> {
    let map = fs::read_to_string(root().join("ARCHITECTURE.md")).unwrap();
    let (_, table) = map.split_once("\n## Floors\n").unwrap();
    let (table, _) = table.split_once("\n## ").unwrap();
    let folders =
        table.lines().filter_map(|line| Some(line.strip_prefix("| [")?.split_once(']')?.0));
    folders.map(str::to_owned).collect()
}

/// Returns the packages of a workspace.
fn packages(workspace: &str) -> Vec<Value> {
    let arguments = ["metadata", "--no-deps", "--format-version", "1"];
    let output = Invocation::cargo(&arguments).in_workspace(workspace).output(0).unwrap();
    let metadata: Value = serde_json::from_slice(&output.stdout).unwrap();
    metadata["packages"].as_array().unwrap().clone()
}

/// Returns the top folder that contains a path.
fn top(path: &str) -> String {
    let inside = Path::new(path).strip_prefix(root()).unwrap();
    inside.iter().next().unwrap().to_str().unwrap().to_owned()
}

#[test]
fn the_table_names_each_top_folder_once() {
    let floors = floors();
    assert!(floors.len() <= FLOORS_MAX, "{} rows", floors.len());
    let names: BTreeSet<&str> = floors.iter().map(String::as_str).collect();
    assert_eq!(names.len(), floors.len(), "a folder has two rows");
    let tracked = files().unwrap();
    let folders = tracked.iter().filter_map(|file| Some(file.split_once('/')?.0));
    let visible: BTreeSet<&str> = folders.filter(|folder| !folder.starts_with('.')).collect();
    assert_eq!(names, visible);
}

#[test]
fn a_folder_depends_only_on_folders_above_it() {
    let floors = floors();
    let floor = |folder: &str| floors.iter().position(|name| name == folder).unwrap();
    let manifest: toml::Table =
        fs::read_to_string(root().join("Cargo.toml")).unwrap().parse().unwrap();
    let others = manifest["workspace"]["exclude"].as_array().unwrap();
    let workspaces = others.iter().map(|folder| folder.as_str().unwrap());
    let mut wrong = Vec::new();
    let mut compared = 0;
    for package in [""].into_iter().chain(workspaces).flat_map(packages) {
        let own = package["manifest_path"].as_str().unwrap();
        for dependency in package["dependencies"].as_array().unwrap() {
            let Some(path) = dependency["path"].as_str() else { continue };
            if dependency["kind"] == "dev" {
                continue;
            }
            compared += 1;
            if floor(&top(path)) > floor(&top(own)) {
                wrong.push(format!("{own} depends on {path}"));
            }
        }
    }
    assert!(compared > 50, "{compared} dependencies were compared");
    assert!(wrong.is_empty(), "against ARCHITECTURE.md: {}", wrong.join("; "));
}
