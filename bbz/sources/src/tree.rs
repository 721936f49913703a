//! The files of the repository that decide a run.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use sha2::{Digest, Sha256};
use toml::{Table, Value};

/// The crate whose dependencies count.
const PROGRAM: &str = "bbz";

/// Crates of the repository on which the program depends and that decide no run: this one, the page,
/// tables, the store of finished runs, and readers and writers of real robots.
const OTHERS: [&str; 6] = [
    "bittybuzz-chunks",
    "bittybuzz-isp",
    "bittybuzz-page",
    "bittybuzz-sources",
    "bittybuzz-tables",
    "bittybuzz-trace-reader",
];

/// Folders whose files with these extensions are compiled in from outside of `src`.
const DATA: [(&str, &str); 2] = [("lib", "bzz"), ("robots", "toml")];

/// A reason why the files that decide a run cannot be found.
#[derive(Debug, thiserror::Error)]
pub enum TreeError {
    #[error("cannot read `{0}`: {1}")]
    Read(PathBuf, io::Error),
    /// A manifest or the lock file is not valid TOML.
    #[error("`{0}`: {1}")]
    Syntax(PathBuf, toml::de::Error),
    #[error("`{0}` is not in Cargo.lock")]
    NotLocked(String),
    /// A crate of the repository that does not inherit its folder.
    #[error("`{0}` is not in the dependencies of the root's Cargo.toml")]
    NoFolder(String),
}

/// A package of the lock file.
struct Locked {
    version: String,
    /// Absent for crates of the repository.
    source: Option<String>,
    checksum: String,
    /// `name`, or `name version` if the lock file has several.
    dependencies: Vec<String>,
}

/// The crates that decide a run.
pub struct Tree {
    root: PathBuf,
    /// Folders of crates, from the root, with `/`.
    crates: BTreeSet<String>,
    /// A line for each dependency from a registry, and for each entry of the root's manifest.
    lines: BTreeSet<String>,
}

impl Tree {
    /// Finds the crates of a repository that decide a run.
    pub fn read(root: &Path) -> Result<Tree, TreeError> {
        let manifest = table(&root.join("Cargo.toml"))?;
        let shared = manifest.get("workspace").and_then(|workspace| workspace.get("dependencies"));
        let locked = locked(&table(&root.join("Cargo.lock"))?);
        let mut tree =
            Tree { root: root.to_owned(), crates: BTreeSet::new(), lines: BTreeSet::new() };
        tree.add(PROGRAM, PROGRAM, shared, &locked)?;
        Ok(tree)
    }

    /// Adds a crate of the repository in a folder, and the crates on which it depends.
    fn add(
        &mut self,
        name: &str,
        folder: &str,
        shared: Option<&Value>,
        locked: &BTreeMap<String, Vec<Locked>>,
    ) -> Result<(), TreeError> {
        if !self.crates.insert(folder.to_owned()) {
            return Ok(());
        }
        let names = dependencies(&table(&self.root.join(folder).join("Cargo.toml"))?);
        let package = find(name, locked)?;
        for dependency in &package.dependencies {
            let own = dependency.split(' ').next().unwrap_or(dependency);
            // The lock file also names packages of tests.
            if !names.contains(own) || OTHERS.contains(&own) {
                continue;
            }
            let entry = shared.and_then(|shared| shared.get(own));
            match entry.and_then(|entry| entry.get("path")?.as_str()) {
                Some(path) => self.add(own, path, shared, locked)?,
                None if find(dependency, locked)?.source.is_none() => {
                    return Err(TreeError::NoFolder(own.to_owned()));
                }
                // Commands, signals and the like of the program itself decide no run.
                None if name == PROGRAM => {}
                None => {
                    if let Some(entry) = entry {
                        self.lines.insert(format!("{own} = {entry:?}"));
                    }
                    self.add_locked(dependency, locked)?;
                }
            }
        }
        Ok(())
    }

    /// Adds a package from a registry, and those on which it depends.
    fn add_locked(
        &mut self,
        name: &str,
        locked: &BTreeMap<String, Vec<Locked>>,
    ) -> Result<(), TreeError> {
        let package = find(name, locked)?;
        let source = package.source.as_deref().unwrap_or_default();
        let own = name.split(' ').next().unwrap_or(name);
        let line = format!("{own} {} {source} {}", package.version, package.checksum);
        if self.lines.insert(line) {
            for dependency in &package.dependencies {
                self.add_locked(dependency, locked)?;
            }
        }
        Ok(())
    }

    /// Returns the files and folders, from the root, of which a change may be another hash. A new file
    /// among the data is named by a source.
    pub fn watched(&self) -> Result<BTreeSet<String>, TreeError> {
        let mut paths = self.data()?;
        paths.extend(["Cargo.toml", "Cargo.lock"].map(str::to_owned));
        for folder in &self.crates {
            let parts = ["Cargo.toml", "build.rs", "src"].map(|part| format!("{folder}/{part}"));
            paths.extend(parts.into_iter().filter(|path| self.root.join(path).exists()));
        }
        Ok(paths)
    }

    /// Returns the hash: the first 16 hexadecimal digits of a SHA-256.
    pub fn hash(&self) -> Result<String, TreeError> {
        let mut files = self.data()?;
        for folder in &self.crates {
            let parts = ["Cargo.toml", "build.rs"].map(|part| format!("{folder}/{part}"));
            files.extend(parts.into_iter().filter(|path| self.root.join(path).exists()));
            self.list(&format!("{folder}/src"), &|name| !name.ends_with(".md"), &mut files)?;
        }
        let mut hasher = Sha256::new();
        for line in &self.lines {
            hasher.update(format!("{line}\n"));
        }
        for file in &files {
            let path = self.root.join(file);
            let content = fs::read(&path).map_err(|error| TreeError::Read(path, error))?;
            // Git may check text out with other line ends on Windows.
            let content: Vec<u8> = content.into_iter().filter(|byte| *byte != b'\r').collect();
            hasher.update(format!("{file}\0{}\0", content.len()));
            hasher.update(content);
        }
        let mut text = String::new();
        for byte in &hasher.finalize()[..8] {
            write!(text, "{byte:02x}").expect("a text takes any line");
        }
        Ok(text)
    }

    /// Returns the files that are compiled in from outside of `src`.
    fn data(&self) -> Result<BTreeSet<String>, TreeError> {
        let mut files = BTreeSet::new();
        for (folder, extension) in DATA {
            let ending = format!(".{extension}");
            let is_data = |name: &str| name.ends_with(&ending) && name != "Cargo.toml";
            self.list(folder, &is_data, &mut files)?;
        }
        Ok(files)
    }

    /// Lists the files of a folder and of the folders in it, but tests and hidden files.
    fn list(
        &self,
        folder: &str,
        is_chosen: &dyn Fn(&str) -> bool,
        files: &mut BTreeSet<String>,
    ) -> Result<(), TreeError> {
        let path = self.root.join(folder);
        let unreadable = |error| TreeError::Read(path.clone(), error);
        for entry in fs::read_dir(&path).map_err(unreadable)? {
            let entry = entry.map_err(unreadable)?;
            let name = entry.file_name().to_string_lossy().into_owned();
            let inside = format!("{folder}/{name}");
            if name.starts_with('.') || name == "target" || name == "tests" {
                continue;
            }
            if entry.path().is_dir() {
                self.list(&inside, is_chosen, files)?;
            } else if is_chosen(&name) {
                files.insert(inside);
            }
        }
        Ok(())
    }
}

fn table(path: &Path) -> Result<Table, TreeError> {
    let text = fs::read_to_string(path).map_err(|error| TreeError::Read(path.to_owned(), error))?;
    text.parse().map_err(|error| TreeError::Syntax(path.to_owned(), error))
}

/// Returns the packages of a lock file by name.
fn locked(lock: &Table) -> BTreeMap<String, Vec<Locked>> {
    let mut packages: BTreeMap<String, Vec<Locked>> = BTreeMap::new();
    for package in lock.get("package").and_then(Value::as_array).into_iter().flatten() {
        let text = |key: &str| package.get(key).and_then(Value::as_str).map(str::to_owned);
        let listed = package.get("dependencies").and_then(Value::as_array).into_iter().flatten();
        packages.entry(text("name").unwrap_or_default()).or_default().push(Locked {
            version: text("version").unwrap_or_default(),
            source: text("source"),
            checksum: text("checksum").unwrap_or_default(),
            dependencies: listed.filter_map(Value::as_str).map(str::to_owned).collect(),
        });
    }
    packages
}

/// Finds the package that the lock file calls `name`, or `name version`.
fn find<'a>(
    name: &str,
    locked: &'a BTreeMap<String, Vec<Locked>>,
) -> Result<&'a Locked, TreeError> {
    let mut words = name.split(' ');
    let (own, version) = (words.next().unwrap_or(name), words.next());
    let mut packages = locked.get(own).into_iter().flatten();
    let package = packages.find(|package| version.is_none_or(|version| package.version == version));
    package.ok_or_else(|| TreeError::NotLocked(name.to_owned()))
}

/// Returns the names of the packages that a crate's library and build script need.
fn dependencies(manifest: &Table) -> BTreeSet<String> {
    let platforms = manifest.get("target").and_then(Value::as_table).into_iter().flatten();
    let platforms = platforms.filter_map(|(_, platform)| platform.as_table());
    let mut names = BTreeSet::new();
    for table in [manifest].into_iter().chain(platforms) {
        for section in ["dependencies", "build-dependencies"] {
            for (key, value) in table.get(section).and_then(Value::as_table).into_iter().flatten() {
                let package = value.get("package").and_then(Value::as_str);
                names.insert(package.unwrap_or(key).to_owned());
            }
        }
    }
    names
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A repository with the program, a crate that decides runs, one that does not, and packages.
    const FILES: [(&str, &str); 14] = [
        (
            "Cargo.toml",
            "[workspace.dependencies]\nbittybuzz-arena = { path = \"arena\" }\n\
             bittybuzz-page = { path = \"bbz/page\" }\nlibm = \"0.2\"\nclap = \"4\"\nproptest = \"1\"\n",
        ),
        (
            "Cargo.lock",
            "[[package]]\nname = \"bbz\"\nversion = \"0.1.0\"\n\
             dependencies = [\"bittybuzz-arena\", \"bittybuzz-page\", \"clap\"]\n\
             [[package]]\nname = \"bittybuzz-arena\"\nversion = \"0.1.0\"\n\
             dependencies = [\"libm 0.2.1\", \"proptest\"]\n\
             [[package]]\nname = \"clap\"\nversion = \"4.1.0\"\nsource = \"registry\"\nchecksum = \"c1\"\n\
             [[package]]\nname = \"cfg\"\nversion = \"1.0.0\"\nsource = \"registry\"\nchecksum = \"f1\"\n\
             [[package]]\nname = \"libm\"\nversion = \"0.1.4\"\nsource = \"registry\"\nchecksum = \"m0\"\n\
             [[package]]\nname = \"libm\"\nversion = \"0.2.1\"\nsource = \"registry\"\nchecksum = \"m1\"\n\
             dependencies = [\"cfg\"]\n\
             [[package]]\nname = \"proptest\"\nversion = \"1.2.0\"\nsource = \"registry\"\nchecksum = \"p1\"\n",
        ),
        (
            "bbz/Cargo.toml",
            "[dependencies]\nbittybuzz-arena.workspace = true\nbittybuzz-page.workspace = true\n\
             clap.workspace = true\n",
        ),
        ("bbz/src/lib.rs", "mod sim;\n"),
        ("bbz/tests/sim.rs", "// A test.\n"),
        ("bbz/page/src/lib.rs", "// The page.\n"),
        (
            "arena/Cargo.toml",
            "[dependencies]\nlibm.workspace = true\n[dev-dependencies]\nproptest.workspace = true\n",
        ),
        ("arena/build.rs", "fn main() {}\n"),
        ("arena/src/lib.rs", "mod engine;\n"),
        ("arena/src/engine/mod.rs", "// The engine.\n"),
        ("arena/src/engine/README.md", "The engine.\n"),
        ("arena/tests/main.rs", "// Tests.\n"),
        ("lib/queue.bzz", "# A queue.\n"),
        ("robots/lamp/robot.toml", "name = \"lamp\"\n"),
    ];

    fn write(root: &Path, file: &str, text: &str) {
        let path = root.join(file);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, text).unwrap();
    }

    /// Returns the hash of the repository after some of its files were replaced.
    fn hash(changes: &[(&str, &str)]) -> Result<String, TreeError> {
        let folder = tempfile::tempdir().unwrap();
        for (file, text) in FILES.iter().chain(changes) {
            write(folder.path(), file, text);
        }
        Tree::read(folder.path())?.hash()
    }

    /// Returns the hash after one piece of a file was replaced.
    fn hash_with(file: &str, old: &str, new: &str) -> String {
        let (_, text) = FILES.iter().find(|(name, _)| *name == file).unwrap();
        assert!(text.contains(old), "{file} has no `{old}`");
        hash(&[(file, &text.replace(old, new))]).unwrap()
    }

    #[test]
    fn changed_sources_are_another_hash() {
        let mut hashes = BTreeSet::from([hash(&[]).unwrap()]);
        let changes = [
            hash(&[("arena/src/engine/mod.rs", "// Another engine.\n")]),
            hash(&[("arena/src/new.rs", "")]),
            hash(&[("arena/build.rs", "fn main() { }\n")]),
            hash(&[("bbz/src/lib.rs", "mod simulation;\n")]),
            hash(&[("lib/queue.bzz", "# Another queue.\n")]),
            hash(&[("robots/lamp/robot.toml", "name = \"bulb\"\n")]),
            Ok(hash_with(
                "arena/Cargo.toml",
                "libm.workspace = true",
                "libm = { workspace = true }",
            )),
            Ok(hash_with("Cargo.toml", "libm = \"0.2\"", "libm = { version = \"0.2\" }")),
            Ok(hash_with("Cargo.lock", "m1", "m2")),
            // A dependency of a dependency.
            Ok(hash_with("Cargo.lock", "f1", "f2")),
        ];
        let count = changes.len();
        hashes.extend(changes.map(Result::unwrap));
        assert_eq!(hashes.len(), 1 + count);
    }

    #[test]
    fn a_file_that_moves_is_another_hash() {
        let one = [("arena/src/a.rs", "x"), ("arena/src/b.rs", "")];
        let other = [("arena/src/a.rs", ""), ("arena/src/b.rs", "x")];
        assert_ne!(hash(&one).unwrap(), hash(&other).unwrap());
    }

    #[test]
    fn documents_tests_and_other_crates_are_the_same_hash() {
        let same = hash(&[]).unwrap();
        for change in [
            ("README.md", "A document.\n"),
            ("docs/cli.md", "A document.\n"),
            ("arena/src/engine/README.md", "Another engine.\n"),
            ("arena/tests/main.rs", "// Other tests.\n"),
            ("bbz/tests/sim.rs", "// Another test.\n"),
            ("bbz/page/src/lib.rs", "// Another page.\n"),
            ("robots/lamp/README.md", "A lamp.\n"),
            ("arena/src/.lib.rs.swp", "x"),
        ] {
            assert_eq!(hash(&[change]).unwrap(), same, "{change:?}");
        }
        // The versions of packages for tests, for the command line, and without a user.
        for (old, new) in [("p1", "p2"), ("c1", "c2"), ("m0", "m9")] {
            assert_eq!(hash_with("Cargo.lock", old, new), same, "{old}");
        }
    }

    #[test]
    fn line_ends_of_windows_are_the_same_hash() {
        let crlf = FILES.map(|(file, text)| (file, text.replace('\n', "\r\n")));
        let crlf = crlf.each_ref().map(|(file, text)| (*file, text.as_str()));
        assert_eq!(hash(&crlf).unwrap(), hash(&[]).unwrap());
    }

    #[test]
    fn mistakes_name_the_file() {
        let error = |changes: &[(&str, &str)]| hash(changes).unwrap_err().to_string();
        assert!(error(&[("Cargo.lock", "")]).contains("`bbz` is not in"));
        let syntax = error(&[("arena/Cargo.toml", "[dependencies\n")]);
        assert!(syntax.contains("Cargo.toml`: TOML parse error at line 1"), "{syntax}");
        let folder = tempfile::tempdir().unwrap();
        let missing = Tree::read(folder.path()).err().unwrap().to_string();
        assert!(
            missing.starts_with("cannot read `") && missing.contains("Cargo.toml"),
            "{missing}"
        );
        let nowhere = "`bittybuzz-arena` is not in the dependencies of the root's Cargo.toml";
        assert_eq!(error(&[("Cargo.toml", "")]), nowhere);
    }

    /// The crates of this repository: those that a run is made of, and none of the others.
    #[test]
    fn the_crates_of_this_repository_are_found() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().nth(2).unwrap();
        let tree = Tree::read(root).unwrap();
        for folder in [
            "arena",
            "bbz",
            "comms",
            "compiler",
            "flight",
            "lib",
            "robots/models",
            "spec/robot",
            "spec/files",
            "spec/toml",
            "vm-core",
            "robots/crazyflie/physics",
            "live",
        ] {
            assert!(tree.crates.contains(folder), "{folder}");
        }
        for folder in ["bbz/page", "bbz/sources", "tests", "tests/bad-inputs", "xtask"] {
            assert!(!tree.crates.contains(folder), "{folder}");
        }
        let watched = tree.watched().unwrap();
        for path in ["Cargo.lock", "arena/src", "arena/build.rs", "robots/kilobot/robot.toml"] {
            assert!(watched.contains(path), "{path}");
        }
        let has = |name: &str| tree.lines.iter().any(|line| line.starts_with(&format!("{name} ")));
        assert!(has("libm") && !has("proptest") && !has("clap"));
        // Cargo has run the build script after the last change of the sources.
        assert_eq!(tree.hash().unwrap(), crate::SOURCES);
    }
}
