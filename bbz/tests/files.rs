//! Files that are too large or are not regular files; and written files, which never replace an
//! input.

use crate::support;
use std::fs::File;
use std::io::Write;
use std::path::Path;
use std::process::{Command, Stdio};

use crate::support::Folder;

const SCRIPT: &str = "include \"more.txt\"\nfunction step() { led(n % 8) }\n";

const SCENARIO: &str = "[world]\nsize = [500, 500]\nduration = 2\n\
    [[robots]]\nrobot = \"mine.toml\"\nbody = \"kilobot\"\nscript = \"s.bzz\"\n";

/// A folder with a scenario, its robot file, its script and an included file.
fn folder(test: &str) -> Folder {
    let folder = Folder::with(test, "s.bzz", SCRIPT);
    let kilobot =
        include_str!("../../robots/kilobot/robot.toml").replace("\"kilobot\"", "\"mine\"");
    folder.write("mine.toml", kilobot);
    folder.write("more.txt", "n = 0\n");
    folder.write("s.toml", SCENARIO);
    folder
}

/// Without a limit, each file would be read without end, or into memory as a whole.
const READERS: &[&[&str]] = &[
    &["check", "x.bzz"],
    &["run", "x.bzz"],
    &["check", "x.bo"],
    &["disasm", "x.bbi"],
    &["check", "s.bzz", "--robot", "x.toml"],
    &["sim", "x.toml"],
    &["trace", "-", "--script", "x.sym"],
    &["trace", "x.elf", "--robot", "crazyflie"],
    &["flash", "s.bzz", "--robot", "crazyflie", "--firmware", "x.elf", "--dry-run"],
    &["build", "s.bzz", "--robot", "kilobot", "--firmware", "x.elf"],
];

#[cfg(unix)]
#[test]
fn pipes_and_devices_are_no_files() {
    let folder = folder("no_files");
    for extension in ["bzz", "bo", "bbi", "toml", "sym", "elf"] {
        let pipe = folder.path(&format!("x.{extension}"));
        assert!(Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    }
    for arguments in READERS {
        folder.bbz(arguments).fails_with(3, &["x.", "it is a pipe, not a file"]);
    }
    for extension in ["bzz", "bo", "bbi", "toml", "sym", "elf"] {
        let link = folder.path(&format!("x.{extension}"));
        std::fs::remove_file(&link).unwrap();
        std::os::unix::fs::symlink("/dev/zero", &link).unwrap();
    }
    for arguments in READERS {
        folder.bbz(arguments).fails_with(3, &["x.", "it is a device, not a file"]);
    }
}

#[test]
fn files_have_a_limit() {
    let folder = folder("too_large");
    for (extension, limit) in [("bo", 1), ("bbi", 64), ("sym", 64), ("toml", 4), ("elf", 256)] {
        // A sparse file takes no space on disk.
        let file = File::create(folder.path(&format!("x.{extension}"))).unwrap();
        file.set_len((limit << 20) + 1).unwrap();
        let words = format!("it has more than {limit} MiB");
        // probe-rs reads the firmware that is traced.
        for arguments in READERS.iter().filter(|arguments| arguments[..2] != ["trace", "x.elf"]) {
            if arguments.contains(&format!("x.{extension}").as_str()) {
                folder.bbz(arguments).fails_with(3, &["`x.", &words]);
            }
        }
    }
}

#[cfg(unix)]
#[test]
fn standard_input_can_be_named_as_a_file() {
    let folder = folder("stdin");
    let mut command = folder.command(&["sim", "/dev/stdin", "--headless"]);
    let mut child = command.stdin(Stdio::piped()).spawn().unwrap();
    let scenario = SCENARIO
        .replace("\"s.bzz\"", &format!("{:?}", folder.path("s.bzz")))
        .replace("\"mine.toml\"", "\"kilobot\"");
    child.stdin.take().unwrap().write_all(scenario.as_bytes()).unwrap();
    let outcome = support::finish(child);
    assert_eq!((outcome.status, outcome.stderr.as_str()), (Some(0), ""));
}

#[test]
fn a_line_of_a_trace_has_a_limit() {
    let folder = Folder::new("endless_line");
    let mut child = folder.command(&["trace", "-"]).stdin(Stdio::piped()).spawn().unwrap();
    // bbz may end before it has read everything.
    let _ = child.stdin.take().unwrap().write_all(&vec![0; 3 << 20]);
    support::finish(child).fails_with(3, &["a line has more than 1 MiB"]);
}

/// Asserts that the files that the command would replace, and the names in the folder, are
/// unchanged.
#[track_caller]
fn refuses(folder: &Folder, arguments: &[&str], input: &str) {
    let before = (folder.read(input), folder.names());
    let words = format!("`{}` is read by this command", Path::new(input).display());
    folder.bbz(arguments).fails_with(3, &[&words, "name another file"]);
    assert_eq!((folder.read(input), folder.names()), before, "{arguments:?}");
}

#[test]
fn outputs_replace_no_input() {
    let folder = folder("outputs");
    for input in ["s.toml", "s.bzz", "mine.toml", "more.txt"] {
        refuses(&folder, &["sim", "s.toml", "--headless", "--record", input], input);
        refuses(&folder, &["sim", "s.toml", "--headless", "--csv", input], input);
    }
    std::fs::create_dir(folder.path("sub")).unwrap();
    refuses(&folder, &["sim", "s.toml", "--record", "sub/../s.bzz"], "sub/../s.bzz");
    // A picture that a script includes.
    folder.write("sub/trajectories.svg", "n = 0\n");
    folder.write("s.bzz", SCRIPT.replace("more.txt", "sub/trajectories.svg"));
    refuses(&folder, &["sim", "s.toml", "--headless", "--svg", "sub"], "sub/trajectories.svg");
    folder.write("s.bzz", SCRIPT);

    let built = folder.bbz(&["build", "s.bzz", "--robot", "kilobot"]);
    assert_eq!(built.status, Some(0), "{}", built.stderr);
    folder.write("s.toml", SCENARIO.replace("s.bzz", "s.bbi").replace("mine.toml", "kilobot"));
    for input in ["s.bbi", "s.sym"] {
        refuses(&folder, &["sim", "s.toml", "--headless", "--record", input], input);
    }
}

#[test]
fn an_output_that_fails_leaves_the_old_one() {
    let folder = folder("whole_outputs");
    folder.write("run.bbr", "old");
    folder.write("s.bzz", "function step() { log(\"unknown\" + nil) }\nx = )\n");
    assert_eq!(folder.bbz(&["sim", "s.toml", "--record", "run.bbr"]).status, Some(2));
    assert_eq!(folder.read("run.bbr"), b"old");
    folder.write("s.bzz", SCRIPT);
    folder.bbz(&["sim", "s.toml", "--headless", "--record", "run.bbr"]);
    assert!(folder.read("run.bbr").starts_with(b"bbzrec\x04"));
    folder.bbz(&["sim", "s.toml", "--headless", "--csv", "run.csv"]);
    let names = folder.names();
    assert_eq!(names, ["mine.toml", "more.txt", "run.bbr", "run.csv", "s.bzz", "s.toml"]);
}

/// A device is written directly, not replaced.
#[cfg(unix)]
#[test]
fn outputs_can_be_streams() {
    let folder = folder("stream_outputs");
    let outcome = folder.bbz(&["sim", "s.toml", "--headless", "--csv", "/dev/stdout"]);
    assert_eq!(outcome.status, Some(0), "{}", outcome.stderr);
    assert!(outcome.stdout.starts_with("seed,"), "{}", outcome.stdout);
    if Path::new("/dev/full").exists() {
        for option in ["--csv", "--record"] {
            folder
                .bbz(&["sim", "s.toml", "--headless", option, "/dev/full"])
                .reports(&["/dev/full"]);
        }
    }
}
