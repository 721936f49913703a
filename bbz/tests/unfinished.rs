//! Files that a killed `bbz` leaves, and the commands that write the same file again.

use std::fs;
use std::process::Stdio;
use std::thread;
use std::time::Duration;

use crate::support::Folder;

/// The start of the names of temporary files.
const MARK: &str = "run.bbr.unfinished-bbz-";

const RECORD: &[&str] = &["sim", "long.toml", "--headless", "--record", "run.bbr"];
const RECORD_AGAIN: &[&str] = &["sim", "short.toml", "--headless", "--record", "run.bbr"];

/// A folder with a run that takes longer than any test, and a short one.
fn folder(test: &str) -> Folder {
    let folder = Folder::with(test, "s.bzz", "function step() { forward() }\n");
    let scenario = |duration: u64| {
        format!(
            "[world]\nsize = [500, 500]\nduration = {duration}\n\
             [[robots]]\nrobot = \"kilobot\"\nscript = \"s.bzz\"\ncount = 9\n"
        )
    };
    folder.write("long.toml", scenario(2_000_000));
    folder.write("short.toml", scenario(1));
    folder
}

/// Returns the temporary files.
fn temporary(folder: &Folder) -> Vec<String> {
    folder.names().into_iter().filter(|name| name.starts_with(MARK)).collect()
}

/// Records until the file has `bytes`, and does `during` before it kills the process.
fn kill_after(folder: &Folder, bytes: u64, during: impl FnOnce()) {
    let mut command = folder.command(RECORD);
    let mut child = command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
    let is_long = |name: &String| fs::metadata(folder.path(name)).unwrap().len() >= bytes;
    while !temporary(folder).iter().any(is_long) {
        assert!(child.try_wait().unwrap().is_none(), "the run ended");
        thread::sleep(Duration::from_millis(5));
    }
    during();
    child.kill().unwrap();
    child.wait().unwrap();
}

#[test]
fn a_recording_of_a_killed_process_is_named() {
    let folder = folder("killed_recording");
    kill_after(&folder, 1, || {
        // The file of a process that writes is neither named nor removed.
        let outcome = folder.bbz(RECORD_AGAIN);
        assert_eq!((outcome.status, outcome.stderr.as_str()), (Some(0), ""));
        assert_eq!(temporary(&folder).len(), 1);
    });
    let left = temporary(&folder);
    let [name] = &left[..] else { panic!("{left:?}") };
    let outcome = folder.bbz(RECORD_AGAIN);
    assert_eq!(outcome.status, Some(0));
    outcome.reports(&[
        &format!("note: `{name}` is what a `bbz` that was killed recorded for `run.bbr`"),
        &format!("`bbz view {name}` shows it up to its end; delete it if you do not need it"),
    ]);
    assert_eq!(temporary(&folder), left);
    // Another destination does not concern it.
    let outcome = folder.bbz(&["sim", "short.toml", "--headless", "--record", "other.bbr"]);
    assert_eq!(outcome.stderr, "");
}

#[test]
fn an_unfinished_file_without_use_is_removed() {
    let folder = folder("killed_empty");
    kill_after(&folder, 0, || {});
    // A busy computer may have written samples before the end, which are of use.
    let left = temporary(&folder);
    let [name] = &left[..] else { panic!("{left:?}") };
    folder.write(name, "bbzrec");
    // A table that was cut off, and a recording without a sample.
    folder.write(&format!("{MARK}a1B2c3D4"), "seed,time\n1,2");
    folder.write(&format!("{MARK}a1B2c3D5"), "bbzrec\u{4}");
    let outcome = folder.bbz(RECORD_AGAIN);
    assert_eq!((outcome.status, outcome.stderr.as_str()), (Some(0), ""));
    assert_eq!(temporary(&folder), Vec::<String>::new());
    assert!(folder.read("run.bbr").starts_with(b"bbzrec"));
}
