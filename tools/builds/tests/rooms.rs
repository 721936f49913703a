//! A room may depend only on rooms above it, as ARCHITECTURE.md states. The test compares this with
//! the dependencies of the crates.

use bittybuzz_builds::shell::{Invocation, root};
use serde_json::Value;
use std::fs;
use std::path::Path;

/// Returns the folders of each row of the table of rooms, from the root.
fn rooms() -> Vec<Vec<String>> {
    let map = fs::read_to_string(root().join("ARCHITECTURE.md")).unwrap();
    let (_, table) = map.split_once("\n## Rooms\n").unwrap();
    let (table, _) = table.split_once("\n## ").unwrap();
    let rows = table.lines().filter_map(|line| line.strip_prefix("| [")?.split(" | ").next());
    // `crate](crate), [other](other)`
    let folders = |row: &str| {
        let links = row.split("](").skip(1);
        links.filter_map(|link| Some(link.split_once(')')?.0.to_owned())).collect()
    };
    rows.map(folders).collect()
}

/// Returns the row of the room that contains a folder. If several do, the one with the longest path
/// counts.
fn row(rooms: &[Vec<String>], folder: &str) -> usize {
    let of_row = |(row, folders): (usize, &Vec<String>)| {
        let holds = |room: &&String| Path::new(folder).starts_with(room);
        folders.iter().filter(holds).map(String::len).max().map(|length| (length, row))
    };
    let found = rooms.iter().enumerate().filter_map(of_row).max();
    found.unwrap_or_else(|| panic!("{folder} is in no room of ARCHITECTURE.md")).1
}

/// Returns the packages of a workspace.
fn packages(workspace: &str) -> Vec<Value> {
    let arguments = ["metadata", "--no-deps", "--format-version", "1"];
    let output = Invocation::cargo(&arguments).in_workspace(workspace).output(0).unwrap();
    let metadata: Value = serde_json::from_slice(&output.stdout).unwrap();
    metadata["packages"].as_array().unwrap().clone()
}

fn from_root(path: &str) -> String {
    Path::new(path).strip_prefix(root()).unwrap().display().to_string()
}

#[test]
fn a_room_depends_only_on_rooms_above_it() {
    let rooms = rooms();
    let manifest: toml::Table =
        fs::read_to_string(root().join("Cargo.toml")).unwrap().parse().unwrap();
    let others = manifest["workspace"]["exclude"].as_array().unwrap();
    let workspaces = others.iter().map(|folder| folder.as_str().unwrap());
    let mut wrong = Vec::new();
    let mut compared = 0;
    for package in [""].into_iter().chain(workspaces).flat_map(packages) {
        let folder = from_root(package["manifest_path"].as_str().unwrap());
        let folder = folder.strip_suffix("Cargo.toml").unwrap().trim_end_matches('/');
        for dependency in package["dependencies"].as_array().unwrap() {
            let Some(path) = dependency["path"].as_str() else { continue };
            if dependency["kind"] == "dev" {
                continue;
            }
            let needed = from_root(path);
            compared += 1;
            if row(&rooms, &needed) > row(&rooms, folder) {
                wrong.push(format!("{folder} depends on {needed}"));
            }
        }
    }
    assert!(compared > 50, "{compared} dependencies were compared");
    assert!(wrong.is_empty(), "against ARCHITECTURE.md: {}", wrong.join("; "));
}
