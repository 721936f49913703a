//! Runs `bbz` on scripts in a folder that belongs to the test.

#[cfg(feature = "view")]
pub mod client;
pub mod elf;
pub mod page;
pub mod probe_rs;
pub mod robot;
pub mod stk500;

use std::fs;
use std::io::Read;
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use tempfile::{Builder, TempDir};

/// The time after which a run counts as hanging, far above the need of any test.
const PATIENCE: Duration = Duration::from_secs(120);

/// An empty folder that belongs to one test.
pub struct Folder(TempDir);

/// The outcome of a run.
#[derive(Debug)]
pub struct Outcome {
    /// The exit status; `None` if a signal ended the run.
    pub status: Option<i32>,
    pub stdout: String,
    pub stderr: String,
}

impl Folder {
    /// Creates the folder of the test with that name. Each call has a folder of its own, because
    /// tests of other modules run at the same time and may use the same name.
    pub fn new(test: &str) -> Self {
        let folder = Builder::new().prefix(test).tempdir_in(env!("CARGO_TARGET_TMPDIR"));
        Folder(folder.unwrap())
    }

    /// Creates the folder with one script in it.
    pub fn with(test: &str, name: &str, text: &str) -> Self {
        let folder = Folder::new(test);
        folder.write(name, text);
        folder
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    pub fn write(&self, name: &str, bytes: impl AsRef<[u8]>) {
        fs::write(self.path(name), bytes).unwrap();
    }

    /// Writes a file that can be executed. A process of its own writes it: a process that another thread
    /// starts meanwhile would inherit the open file for a moment, in which Linux does not execute the file.
    #[cfg(unix)]
    pub fn program(&self, name: &str, bytes: &[u8]) {
        use std::io::Write;

        let mut writer = Command::new("sh");
        writer.args(["-c", "cat > \"$0\" && chmod 755 \"$0\""]).arg(self.path(name));
        let mut writer = writer.stdin(Stdio::piped()).spawn().unwrap();
        writer.stdin.take().unwrap().write_all(bytes).unwrap();
        assert!(writer.wait().unwrap().success());
    }

    pub fn read(&self, name: &str) -> Vec<u8> {
        fs::read(self.path(name)).unwrap()
    }

    /// Returns the sorted names of the folder's files.
    pub fn names(&self) -> Vec<String> {
        let entries = fs::read_dir(&self.0).unwrap();
        let mut names: Vec<String> =
            entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    /// Returns a command that runs `bbz` in this folder, with piped output.
    pub fn command(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_bbz"));
        command
            .args(arguments)
            .current_dir(self.0.path())
            .env_remove("BUZZ_INCLUDE_PATH")
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped());
        command
    }

    /// Runs `bbz` in this folder.
    pub fn bbz(&self, arguments: &[&str]) -> Outcome {
        finish(self.command(arguments).spawn().unwrap())
    }
}

/// Waits for the end of a process and reads what it printed.
pub fn finish(mut child: Child) -> Outcome {
    let stdout = child.stdout.take().map(read_aside);
    let stderr = child.stderr.take().map(read_aside);
    let start = Instant::now();
    let status = loop {
        if let Some(status) = child.try_wait().unwrap() {
            break status;
        }
        if start.elapsed() > PATIENCE {
            child.kill().unwrap();
            child.wait().unwrap();
            panic!("bbz hangs");
        }
        thread::sleep(Duration::from_millis(2));
    };
    let text = |reader: Option<thread::JoinHandle<String>>| {
        reader.map_or(String::new(), |reader| reader.join().unwrap())
    };
    Outcome { status: status.code(), stdout: text(stdout), stderr: text(stderr) }
}

fn read_aside(mut pipe: impl Read + Send + 'static) -> thread::JoinHandle<String> {
    thread::spawn(move || {
        let mut bytes = Vec::new();
        pipe.read_to_end(&mut bytes).unwrap();
        String::from_utf8(bytes).unwrap()
    })
}

impl Outcome {
    /// Asserts status and standard output, and that nothing went to standard error.
    #[track_caller]
    pub fn succeeds_with(&self, stdout: &str) {
        assert_eq!(
            (self.status, self.stdout.as_str(), self.stderr.as_str()),
            (Some(0), stdout, "")
        );
    }

    /// Asserts the status, that standard error contains all these texts, and that standard output
    /// is empty.
    #[track_caller]
    pub fn fails_with(&self, status: i32, parts: &[&str]) {
        assert_eq!((self.status, self.stdout.as_str()), (Some(status), ""), "{}", self.stderr);
        self.reports(parts);
    }

    /// Asserts that standard error contains all these texts.
    #[track_caller]
    pub fn reports(&self, parts: &[&str]) {
        for part in parts {
            assert!(self.stderr.contains(part), "`{part}` is not in:\n{}", self.stderr);
        }
    }
}
