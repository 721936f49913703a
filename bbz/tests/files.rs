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

/// Outputs with the name that each of them gets.
#[cfg(unix)]
const WRITERS: &[&[&str]] = &[
    &["sim", "s.toml", "--headless", "--record", "out"],
    &["sim", "s.toml", "--headless", "--csv", "out"],
    &["stubs", "unknown.bzz", "-o", "out"],
];

/// Opening a pipe without a reader would wait without end.
#[cfg(unix)]
#[test]
fn an_output_without_a_reader_is_refused() {
    let folder = folder("unread_outputs");
    folder.write("unknown.bzz", "log(battery())\n");
    assert!(Command::new("mkfifo").arg(folder.path("out")).status().unwrap().success());
    for arguments in WRITERS {
        folder.bbz(arguments).fails_with(
            3,
            &["`out` is a pipe that no program reads", "start its reader first, or name a file"],
        );
    }
    std::fs::create_dir(folder.path("pictures")).unwrap();
    let picture = folder.path("pictures/trajectories.svg");
    assert!(Command::new("mkfifo").arg(picture).status().unwrap().success());
    let arguments = ["sim", "s.toml", "--headless", "--svg", "pictures"];
    folder.bbz(&arguments).fails_with(3, &["trajectories.svg` is a pipe that no program reads"]);
}

#[cfg(unix)]
#[test]
fn other_special_files_are_no_outputs() {
    let folder = folder("special_outputs");
    folder.write("unknown.bzz", "log(battery())\n");
    let _socket = std::os::unix::net::UnixListener::bind(folder.path("out")).unwrap();
    for arguments in WRITERS {
        folder.bbz(arguments).fails_with(3, &["`out` is a socket, not a file", "name a file"]);
    }
    std::fs::remove_file(folder.path("out")).unwrap();
    std::fs::create_dir(folder.path("out")).unwrap();
    for arguments in WRITERS {
        folder.bbz(arguments).fails_with(3, &["`out`", "is a directory"]);
    }
}

/// A pipe gets all bytes, also more than it holds at a time: the reader waits before it reads.
#[cfg(unix)]
#[test]
fn a_pipe_with_a_reader_is_written() {
    let folder = folder("read_outputs");
    folder.write("s.toml", SCENARIO.replace("duration = 2", "duration = 600") + "count = 60\n");
    folder.write("s.bzz", "function step() { led(1)  forward() }\n");
    folder.bbz(&["sim", "s.toml", "--headless", "--record", "file.bbr"]);
    let expected = folder.read("file.bbr");
    assert!(expected.len() > 1 << 17, "{} bytes, and a pipe holds 64 KiB", expected.len());
    assert!(Command::new("mkfifo").arg(folder.path("out")).status().unwrap().success());
    // Opening waits for the other end.
    let mut reader = Command::new("sh");
    reader.args(["-c", "exec <out; sleep 1; cat >got"]).current_dir(folder.path(""));
    let mut reader = reader.spawn().unwrap();
    let line = || folder.bbz(&["sim", "s.toml", "--headless", "--record", "out"]);
    let mut outcome = line();
    // The reader may be slow to start.
    while outcome.stderr.contains("no program reads") {
        std::thread::sleep(std::time::Duration::from_millis(10));
        outcome = line();
    }
    assert_eq!(outcome.status, Some(0), "{}", outcome.stderr);
    assert!(reader.wait().unwrap().success());
    assert_eq!(folder.read("got").len(), expected.len());
    assert!(folder.read("got") == expected);
}

/// Process substitution, a named file descriptor and a device that discards.
#[cfg(unix)]
#[test]
fn given_streams_are_written() {
    let folder = folder("given_outputs");
    let bbz = env!("CARGO_BIN_EXE_bbz");
    let lines = [
        format!("{bbz} sim s.toml --headless --csv >(cat >got); wait $!"),
        format!("{bbz} sim s.toml --headless --csv /dev/stderr 2>got"),
        format!("{bbz} sim s.toml --headless --csv /dev/stderr 2>&1 >/dev/null | cat >got"),
        format!("{bbz} sim s.toml --headless --csv /dev/fd/3 3>got >/dev/null"),
    ];
    for line in lines {
        let mut shell = Command::new("bash");
        let outcome = shell.args(["-c", &line]).current_dir(folder.path("")).output().unwrap();
        let messages = String::from_utf8(outcome.stderr).unwrap();
        assert!(outcome.status.success(), "{line}: {messages}");
        let got = String::from_utf8(folder.read("got")).unwrap();
        assert!(got.starts_with("seed,"), "{line}: {got:?} {messages}");
        std::fs::remove_file(folder.path("got")).unwrap();
    }
    let outcome = folder.bbz(&["sim", "s.toml", "--headless", "--record", "/dev/null"]);
    assert_eq!((outcome.status, outcome.stderr.as_str()), (Some(0), ""));
}

/// The log of the kernel waits for its next line, and cannot be told from a file by its kind.
#[cfg(target_os = "linux")]
#[test]
fn an_input_never_waits() {
    let log = Path::new("/proc/kmsg");
    if File::open(log).is_err() {
        return; // Only root may read it.
    }
    let folder = folder("waiting_inputs");
    for extension in ["bzz", "bo", "bbi", "toml", "sym", "elf"] {
        let link = folder.path(&format!("x.{extension}"));
        std::os::unix::fs::symlink(log, &link).unwrap();
    }
    // probe-rs reads the firmware that is traced.
    for arguments in READERS.iter().filter(|arguments| arguments[..2] != ["trace", "x.elf"]) {
        let outcome = folder.bbz(arguments);
        outcome.reports(&["x.", "it waits for data, as a pipe does"]);
        assert!(matches!(outcome.status, Some(2 | 3)), "{outcome:?}");
    }
}

/// Beyond the limit of file sizes, a signal would end the process without a sentence.
#[cfg(unix)]
#[test]
fn a_limit_of_file_sizes_is_an_error() {
    let folder = folder("file_limit");
    let line =
        format!("ulimit -f 0; {} sim s.toml --headless --record out", env!("CARGO_BIN_EXE_bbz"));
    let mut shell = Command::new("sh");
    let outcome = shell.args(["-c", &line]).current_dir(folder.path("")).output().unwrap();
    let messages = String::from_utf8(outcome.stderr).unwrap();
    assert_eq!(outcome.status.code(), Some(3), "{messages}");
    assert!(messages.contains("cannot write `out`: File too large"), "{messages}");
    assert!(!folder.names().iter().any(|name| name.starts_with("out")), "{:?}", folder.names());
}

/// The stack of the first thread has a limit of its own, which a script's memory may exceed.
#[cfg(unix)]
#[test]
fn a_small_stack_is_enough() {
    let folder = folder("small_stack");
    let line = format!("ulimit -s 256; {} run s.bzz --steps 3", env!("CARGO_BIN_EXE_bbz"));
    let mut shell = Command::new("sh");
    let outcome = shell.args(["-c", &line]).current_dir(folder.path("")).output().unwrap();
    let messages = String::from_utf8(outcome.stderr).unwrap();
    assert_eq!(outcome.status.code(), Some(0), "{messages}");
}
