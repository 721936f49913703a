//! Finding scripts, and working through them on all processors.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;

use crate::bbz;

/// The files under a folder of the repository that end in `.extension`, sorted, as paths from the root.
///
/// Folders named `parts` hold what scripts include, not tests, and are left out.
pub fn with_extension(folder: &str, extension: &str) -> Vec<String> {
    let mut found = Vec::new();
    collect(&bbz::root().join(folder), extension, &mut found);
    let mut paths: Vec<String> = found
        .iter()
        .filter_map(|path| path.strip_prefix(bbz::root()).ok())
        .map(|path| path.to_string_lossy().replace('\\', "/"))
        .collect();
    paths.sort();
    paths
}

fn collect(folder: &Path, extension: &str, found: &mut Vec<PathBuf>) {
    let entries = fs::read_dir(folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display()));
    for entry in entries {
        let path = entry.expect("a folder can be listed").path();
        if path.is_dir() {
            if !path.ends_with("parts") {
                collect(&path, extension, found);
            }
        } else if path.extension().is_some_and(|e| e == extension) {
            found.push(path);
        }
    }
}

/// The text of a file of the repository.
pub fn read(path: &str) -> String {
    fs::read_to_string(bbz::root().join(path)).unwrap_or_else(|e| panic!("{path}: {e}"))
}

/// Applies `work` to every item on all processors; the results keep the order of the items.
pub fn in_parallel<T: Sync, R: Send>(items: &[T], work: impl Fn(&T) -> R + Sync) -> Vec<R> {
    let next = AtomicUsize::new(0);
    let results = Mutex::new(Vec::with_capacity(items.len()));
    let threads = thread::available_parallelism().map_or(1, usize::from);
    thread::scope(|scope| {
        for _ in 0..threads {
            scope.spawn(|| {
                while let Some((index, item)) = {
                    let index = next.fetch_add(1, Ordering::Relaxed);
                    items.get(index).map(|item| (index, item))
                } {
                    let result = work(item);
                    results.lock().expect("no worker panicked").push((index, result));
                }
            });
        }
    });
    let mut results = results.into_inner().expect("no worker panicked");
    results.sort_by_key(|(index, _)| *index);
    results.into_iter().map(|(_, result)| result).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_keep_the_order() {
        let items: Vec<u32> = (0..100).collect();
        let doubled: Vec<u32> = items.iter().map(|n| n * 2).collect();
        assert_eq!(in_parallel(&items, |n| n * 2), doubled);
    }

    #[test]
    fn a_missing_file_is_a_failure_not_an_empty_list() {
        assert!(
            std::panic::catch_unwind(|| with_extension("tests/no such folder", "bzz")).is_err()
        );
    }
}
