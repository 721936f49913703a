//! Each dependency has one version. Members of the root workspace inherit it. The other workspaces
//! cannot inherit it, so they must name the same version.

use bittybuzz_builds::shell::root;
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use toml::{Table, Value};

const SECTIONS: [&str; 3] = ["dependencies", "dev-dependencies", "build-dependencies"];

#[test]
fn members_of_the_root_name_no_versions() {
    let members = members(&manifest(root()));
    let named: Vec<_> = members
        .iter()
        .map(|member| (member.display(), versions(&manifest(member))))
        .filter(|(_, versions)| !versions.is_empty())
        .collect();
    assert!(named.is_empty(), "these belong into the root's Cargo.toml: {named:?}");
}

#[test]
fn other_workspaces_name_the_same_versions() {
    let own = manifest(root());
    let mut known: BTreeMap<String, String> = own["workspace"]["dependencies"]
        .as_table()
        .unwrap()
        .iter()
        .filter_map(|(name, value)| Some((name.clone(), version(value)?)))
        .collect();
    let mut compared = 0;
    for folder in own["workspace"]["exclude"].as_array().unwrap() {
        let folder = root().join(folder.as_str().unwrap());
        let table = manifest(&folder);
        let shared = table.get("workspace").and_then(|workspace| workspace.get("dependencies"));
        let shared = shared.and_then(Value::as_table).into_iter().flatten();
        let shared = shared.filter_map(|(name, value)| Some((name.clone(), version(value)?)));
        for (name, version) in versions(&table).into_iter().chain(shared) {
            let first = known.entry(name.clone()).or_insert_with(|| version.clone());
            assert_eq!(*first, version, "{}: {name}", folder.display());
            compared += 1;
        }
    }
    assert!(compared > 20, "{compared} dependencies were compared");
}

fn manifest(folder: &Path) -> Table {
    let path = folder.join("Cargo.toml");
    fs::read_to_string(path).unwrap().parse().unwrap()
}

fn members(root_manifest: &Table) -> Vec<PathBuf> {
    let members = root_manifest["workspace"]["members"].as_array().unwrap();
    members.iter().map(|member| root().join(member.as_str().unwrap())).collect()
}

/// Returns the dependencies of a manifest that name a version, including those of single platforms.
fn versions(manifest: &Table) -> Vec<(String, String)> {
    let platforms = manifest.get("target").and_then(Value::as_table).into_iter().flatten();
    let platforms = platforms.filter_map(|(_, platform)| platform.as_table());
    let mut versions = Vec::new();
    for table in [manifest].into_iter().chain(platforms) {
        for section in SECTIONS {
            let dependencies = table.get(section).and_then(Value::as_table).into_iter().flatten();
            let named =
                dependencies.filter_map(|(name, value)| Some((name.clone(), version(value)?)));
            versions.extend(named);
        }
    }
    versions
}

fn version(dependency: &Value) -> Option<String> {
    let version = dependency.as_str().or_else(|| dependency.get("version")?.as_str());
    version.map(str::to_owned)
}

/// The packages of a release have its version and a description. No package of any workspace can be
/// published to a registry by mistake.
#[test]
fn packages_describe_themselves() {
    let own = manifest(root());
    let package = |folder: &Path| manifest(folder).get("package").cloned();
    let is_kept = |package: &Value| package.get("publish") == Some(&Value::Boolean(false));
    for folder in members(&own) {
        let package = package(&folder).unwrap();
        let name = folder.display();
        assert!(is_kept(&package), "{name}");
        assert!(package["version"].is_table(), "{name}: version.workspace = true");
        assert!(package.get("description").is_some_and(Value::is_str), "{name}");
    }
    for folder in own["workspace"]["exclude"].as_array().unwrap() {
        // A workspace of several programs has no root package.
        let package = package(&root().join(folder.as_str().unwrap()));
        assert!(package.as_ref().is_none_or(is_kept), "{folder:?}");
    }
}

/// All tests run with the oldest toolchain that the packages support.
#[test]
fn the_minimum_version_of_rust_is_the_one_that_tests_use() {
    let own = manifest(root());
    let least = own["workspace"]["package"]["rust-version"].as_str().unwrap();
    for folder in ["", "firmware"] {
        let text = fs::read_to_string(root().join(folder).join("rust-toolchain.toml")).unwrap();
        let table: Table = text.parse().unwrap();
        let channel = table["toolchain"]["channel"].as_str().unwrap();
        assert_eq!(channel, format!("{least}.0"), "{folder}/rust-toolchain.toml");
    }
}
