//! Gives the copy of the repository the crates of others that the repository has compiled already.
//!
//! A first build in the copy would mostly compile these crates. The repository's own crates are left
//! out: cargo identifies a crate by its place in its workspace, so it would use one of the repository
//! instead of the changed one at the same place in the copy.

use anyhow::Result;
use fs_err as fs;
use std::collections::HashSet;
use std::io;
use std::path::Path;

/// Cargo's folder with a hash for each compiled package. Its entries are named `PACKAGE-HASH`.
const FINGERPRINTS: &str = ".fingerprint";

/// Copies the compiled crates that are not among `own` from one build folder of cargo into another
/// one. Does nothing if there is no such folder yet.
pub fn seed(from: &Path, to: &Path, own: &HashSet<String>) -> Result<()> {
    // A profile's folder lies in the build folder, or in that of the processor for which it is.
    for folder in folders(from)? {
        if from.join(&folder).join(FINGERPRINTS).is_dir() {
            seed_profile(&from.join(&folder), &to.join(&folder), own)?;
            continue;
        }
        for inner in folders(&from.join(&folder))? {
            let profile = Path::new(&folder).join(inner);
            if from.join(&profile).join(FINGERPRINTS).is_dir() {
                seed_profile(&from.join(&profile), &to.join(&profile), own)?;
            }
        }
    }
    Ok(())
}

fn seed_profile(from: &Path, to: &Path, own: &HashSet<String>) -> Result<()> {
    let mut hashes = HashSet::new();
    for entry in folders(&from.join(FINGERPRINTS))? {
        if let Some((package, hash)) = entry.rsplit_once('-')
            && !own.contains(package)
        {
            hashes.insert(hash.to_owned());
        }
    }
    // The fingerprints come last: without its fingerprint, cargo compiles a package that an
    // interrupted copy left incomplete.
    for part in ["deps", "build", FINGERPRINTS] {
        for name in names(&from.join(part))? {
            let stem = name.split_once('.').map_or(name.as_str(), |(stem, _)| stem);
            if stem.rsplit_once('-').is_some_and(|(_, hash)| hashes.contains(hash)) {
                copy(&from.join(part).join(&name), &to.join(part).join(&name))?;
            }
        }
    }
    Ok(())
}

/// Copies a file or folder with its times, because cargo compiles anew if they differ.
fn copy(from: &Path, to: &Path) -> Result<()> {
    if from.is_dir() {
        for name in names(from)? {
            copy(&from.join(&name), &to.join(&name))?;
        }
        return Ok(());
    }
    if let Some(folder) = to.parent() {
        fs::create_dir_all(folder)?;
    }
    fs::copy(from, to)?;
    fs::File::options().write(true).open(to)?.set_modified(fs::metadata(from)?.modified()?)?;
    Ok(())
}

/// Returns the names of the folders in a folder.
fn folders(folder: &Path) -> Result<Vec<String>> {
    let all = names(folder)?;
    Ok(all.into_iter().filter(|name| folder.join(name).is_dir()).collect())
}

/// Returns the names of all entries of a folder, and none if there is no such folder.
fn names(folder: &Path) -> Result<Vec<String>> {
    let entries = match fs::read_dir(folder) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(Vec::new()),
        entries => entries?,
    };
    entries.map(|entry| Ok(entry?.file_name().to_string_lossy().into_owned())).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::SystemTime;

    #[test]
    fn crates_of_others_are_copied_with_their_times() {
        let folder = tempfile::tempdir().unwrap();
        let (from, to) = (folder.path().join("from"), folder.path().join("to"));
        let put = |path: &str| {
            let path = from.join(path);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(&path, path.to_string_lossy().as_bytes()).unwrap();
        };
        let others = [
            "debug/.fingerprint/serde-01/lib-serde",
            "debug/build/serde-01/output",
            "debug/deps/libserde-01.rlib",
            "avr-none/release/.fingerprint/half-try-02/lib-half_try",
            "avr-none/release/deps/half_try-02.d",
        ];
        let own = [
            "debug/.fingerprint/own-crate-03/lib-own_crate",
            "debug/deps/libown_crate-03.rlib",
            "debug/deps/own-03",
            "debug/incremental/serde-01/file",
            "soak/notes/file",
        ];
        others.iter().chain(&own).for_each(|path| put(path));
        let long_ago = SystemTime::UNIX_EPOCH;
        let file = fs::File::options().write(true).open(from.join(others[2])).unwrap();
        file.set_modified(long_ago).unwrap();
        seed(&from, &to, &HashSet::from(["own-crate".to_owned()])).unwrap();
        for path in others {
            assert_eq!(fs::read(to.join(path)).unwrap(), fs::read(from.join(path)).unwrap());
        }
        assert_eq!(fs::metadata(to.join(others[2])).unwrap().modified().unwrap(), long_ago);
        for path in own {
            assert!(!to.join(path).exists(), "{path}");
        }
        seed(&folder.path().join("missing"), &to, &HashSet::new()).unwrap();
    }
}
