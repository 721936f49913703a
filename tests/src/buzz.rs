//! Buzz for Linux, of which this repository has nothing: whoever records results builds it, and names the folder of its
//! programs in `BUZZ_BIN`.

use std::env;
use std::fs;
use std::os::unix::process::ExitStatusExt;
use std::path::PathBuf;
use std::process::{Command, Output};

use crate::compatibility::End;

/// The programs of Buzz.
pub struct Buzz {
    bin: PathBuf,
    /// The folder of the script that runs.
    folder: PathBuf,
}

impl Buzz {
    /// Uses the programs of the folder `BUZZ_BIN`. Scripts are written into an existing folder that nothing else uses.
    ///
    /// # Panics
    /// If that variable is missing.
    pub fn new(folder: PathBuf) -> Buzz {
        let bin = env::var_os("BUZZ_BIN").expect("BUZZ_BIN names the folder of `bzzc`");
        Buzz { bin: PathBuf::from(bin), folder }
    }

    /// Compiles and runs a script. Returns all that it printed, and its end.
    pub fn run(&self, script: &str) -> (String, End) {
        fs::write(self.folder.join("a.bzz"), script).expect("the folder can be written");
        let compiled = self.start("bzzc", &["-b", "a.bo", "-d", "a.bdb", "a.bzz"]);
        if !compiled.status.success() {
            return (String::new(), End::Refuses(String::new()));
        }
        let ran = self.start("bzzrun", &["a.bo", "a.bdb"]);
        let text = String::from_utf8_lossy(&ran.stdout);
        let output = text.split("a.bo: execution terminated").next().unwrap_or_default();
        let output = output.trim_end().to_string();
        let end = match (ran.status.signal(), ran.status.success()) {
            (Some(_), _) => End::Crashes,
            (None, true) => End::Prints(output.clone()),
            (None, false) => End::Stops(String::new()),
        };
        (output, end)
    }

    fn start(&self, program: &str, arguments: &[&str]) -> Output {
        // `bzzc` starts its stages by name.
        let path = format!("{}:{}", self.bin.display(), env::var("PATH").unwrap_or_default());
        let mut command = Command::new(self.bin.join(program));
        let command = command.args(arguments).current_dir(&self.folder).env("PATH", &path);
        command.output().expect("the programs of Buzz can be started")
    }
}
