//! A fake probe-rs: it records its arguments and keeps the bytes that it would write.

use std::env;
use std::fs;
use std::process::{Command, Stdio};

use crate::support::{self, Folder, Outcome};

/// Records the call; the commands of the test follow. In the script `$file` is the last argument.
const NOTE: &str = "#!/bin/sh\necho \"$@\" >> calls\nfor file; do :; done\n";

/// Writes the fake probe-rs, which then executes `script`, into the folder.
pub fn install(folder: &Folder, script: &str) {
    folder.program("probe-rs", format!("{NOTE}{script}\n").as_bytes());
}

/// Returns a command whose PATH begins with the folder.
pub fn command(folder: &Folder, arguments: &[&str]) -> Command {
    let others = env::var_os("PATH").unwrap();
    let path = [folder.path("")].into_iter().chain(env::split_paths(&others));
    let mut command = folder.command(arguments);
    command.env("PATH", env::join_paths(path).unwrap()).stdin(Stdio::null());
    command
}

pub fn bbz(folder: &Folder, arguments: &[&str]) -> Outcome {
    support::finish(command(folder, arguments).spawn().unwrap())
}

/// Returns the calls so far, one per line.
pub fn calls(folder: &Folder) -> Vec<String> {
    let text = fs::read_to_string(folder.path("calls")).unwrap_or_default();
    text.lines().map(str::to_owned).collect()
}
