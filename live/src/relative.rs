//! Paths for clients, relative to the folder of the scenario.

use std::path::{Component, Path, PathBuf};

use bittybuzz_compiler::question::FILE;

/// Returns a path relative to a folder. A file elsewhere has `..` in its path, or only its name if no
/// relative path leads to it.
pub fn relative(folder: &Path, path: &Path) -> String {
    if let Ok(inside) = path.strip_prefix(folder) {
        return inside.display().to_string();
    }
    // The library and questions are in no folder.
    let is_nowhere = path.starts_with("<library>") || path == Path::new(FILE);
    if is_nowhere || (folder.is_absolute() && path.is_relative()) {
        return path.display().to_string();
    }
    let common = folder.components().zip(path.components()).take_while(|(a, b)| a == b).count();
    let up = folder.components().skip(common);
    let has_name = |part: Component<'_>| matches!(part, Component::Normal(_));
    if folder.is_absolute() != path.is_absolute() || !up.clone().all(has_name) {
        let name = path.file_name().unwrap_or(path.as_os_str());
        return name.to_string_lossy().into_owned();
    }
    let up = up.map(|_| Component::ParentDir);
    let found: PathBuf = up.chain(path.components().skip(common)).collect();
    found.display().to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_are_relative_to_the_folder() {
        for (folder, path, expected) in [
            ("/home/ada/class", "/home/ada/class/s.bzz", "s.bzz"),
            ("/home/ada/class", "/home/ada/class/lib/s.bzz", "lib/s.bzz"),
            ("/home/ada/class", "/home/ada/shared/s.bzz", "../shared/s.bzz"),
            ("/home/ada/class", "/opt/s.bzz", "../../../opt/s.bzz"),
            ("/home/ada/class", "<library>/vec2.bzz", "<library>/vec2.bzz"),
            ("/home/ada/class", "<question>", "<question>"),
            ("class", "<question>", "<question>"),
            ("class", "class/s.bzz", "s.bzz"),
            ("class", "lib/s.bzz", "../lib/s.bzz"),
            ("class", "/opt/s.bzz", "s.bzz"),
            ("../class", "lib/s.bzz", "s.bzz"),
            ("", "s.bzz", "s.bzz"),
            ("", "<library>/vec2.bzz", "<library>/vec2.bzz"),
            ("/home/ada/class", "lib/s.bzz", "lib/s.bzz"),
        ] {
            assert_eq!(relative(Path::new(folder), Path::new(path)), expected, "{folder} {path}");
        }
    }
}
