//! The Buzz scripts of an experiment, which names only the bytecode that was made of them.

use std::fs;
use std::io;
use std::path::{Component, Path, PathBuf};

/// The number of folders above that of the experiment in which scripts are searched. ARGoS looks for
/// bytecode in the folder where it is started, which is often the root of a project.
const PARENTS: usize = 3;

/// The folders of the experiment and of its scenario.
pub struct ScriptFolders {
    experiment: PathBuf,
    scenario: PathBuf,
}

/// A script in a scenario.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ScriptPath {
    /// The path from the folder of the scenario.
    pub text: String,
    pub exists: bool,
}

impl ScriptFolders {
    pub fn new(experiment: &Path, scenario: &Path) -> io::Result<Self> {
        let whole = |folder: &Path| match folder.as_os_str().is_empty() {
            true => fs::canonicalize("."),
            false => fs::canonicalize(folder),
        };
        Ok(ScriptFolders { experiment: whole(experiment)?, scenario: whole(scenario)? })
    }

    /// Returns the script of which the bytecode was made: it has the same name. Without one, the
    /// bytecode itself if it exists, else the place next to the experiment.
    pub fn script_of(&self, bytecode: &str) -> ScriptPath {
        let script = Path::new(bytecode).with_extension("bzz");
        [&script, Path::new(bytecode)]
            .into_iter()
            .find_map(|path| self.find(path))
            .unwrap_or_else(|| self.missing(file_name(&script)))
    }

    /// Returns the place of a script that has to be written.
    pub fn missing(&self, name: &str) -> ScriptPath {
        let path = self.experiment.join(name);
        ScriptPath { text: relative(&self.scenario, &path), exists: path.is_file() }
    }

    fn find(&self, path: &Path) -> Option<ScriptPath> {
        let folders = self.experiment.ancestors().take(PARENTS + 1);
        // `join` drops the folder before an absolute path.
        let mut places =
            folders.flat_map(|folder| [folder.join(path), folder.join(file_name(path))]);
        let found = places.find(|place| place.is_file())?;
        let found = fs::canonicalize(&found).unwrap_or(found);
        Some(ScriptPath { text: relative(&self.scenario, &found), exists: true })
    }
}

fn file_name(path: &Path) -> &str {
    path.file_name().and_then(|name| name.to_str()).unwrap_or("script.bzz")
}

/// Returns the path of a file from a folder, with `/` between names as in all scenarios. Both paths
/// are absolute.
fn relative(folder: &Path, file: &Path) -> String {
    let (from, to): (Vec<_>, Vec<_>) = (folder.components().collect(), file.components().collect());
    let shared = from.iter().zip(&to).take_while(|(one, other)| one == other).count();
    // Two drives of Windows have no path between them.
    let is_apart = !to[..shared].iter().any(|part| matches!(part, Component::RootDir));
    if is_apart {
        return file.to_string_lossy().into_owned();
    }
    let up = from[shared..].iter().map(|_| "..".into());
    let down = to[shared..].iter().map(|part| part.as_os_str().to_string_lossy());
    up.chain(down).collect::<Vec<_>>().join("/")
}

/// Returns the name of the script for a controller that has none.
pub fn name_for(controller: &str) -> String {
    let name = controller.replace(|c: char| !c.is_ascii_alphanumeric() && c != '_', "-");
    format!("{}.bzz", if name.is_empty() { "script" } else { &name })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    #[cfg(unix)]
    fn paths_lead_from_one_folder_to_a_file() {
        for (folder, file, path) in [
            ("/a", "/a/s.bzz", "s.bzz"),
            ("/a", "/a/b/s.bzz", "b/s.bzz"),
            ("/a/b", "/a/s.bzz", "../s.bzz"),
            ("/a/b/c", "/a/d/s.bzz", "../../d/s.bzz"),
        ] {
            assert_eq!(relative(Path::new(folder), Path::new(file)), path);
        }
    }

    #[test]
    fn scripts_are_searched_next_to_the_experiment_and_above() {
        let folder = tempfile::tempdir().unwrap();
        let at = |path: &str| folder.path().join(path);
        fs::create_dir_all(at("launch/deep")).unwrap();
        fs::create_dir(at("scripts")).unwrap();
        for file in ["scripts/far.bzz", "launch/near.bzz", "launch/only.bo"] {
            fs::write(at(file), "").unwrap();
        }
        let folders = ScriptFolders::new(&at("launch"), &at("launch/deep")).unwrap();
        for (bytecode, script, exists) in [
            ("scripts/far.bo", "../../scripts/far.bzz", true),
            // The folders of the author's computer do not exist here.
            ("/home/ada/build/near.bo", "../near.bzz", true),
            ("../../build/near.bo", "../near.bzz", true),
            ("build/only.bo", "../only.bo", true),
            ("build/none.bo", "../none.bzz", false),
        ] {
            let text = script.to_owned();
            assert_eq!(folders.script_of(bytecode), ScriptPath { text, exists }, "{bytecode}");
        }
        assert_eq!(name_for("a/../b c"), "a----b-c.bzz");
    }
}
