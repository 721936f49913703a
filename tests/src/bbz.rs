//! Running the command line tool as a user would.

use std::io::Read;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::OnceLock;
use std::thread;
use std::time::{Duration, Instant};

/// How long one run may take before it is killed: far above any test's need, so that a script that
/// never ends fails instead of blocking the others.
const PATIENCE: Duration = Duration::from_secs(60);

/// What a run did.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Outcome {
    /// Exit status; `None` when a signal ended the run or it was killed for taking too long.
    pub status: Option<i32>,
    /// Standard output, bytes that are not UTF-8 replaced.
    pub stdout: String,
    /// Standard error, likewise.
    pub stderr: String,
}

/// The root of the repository: the working folder of every run.
pub fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("the crate lies in the repository")
}

/// The `bbz` that belongs to this build, built on the first call.
///
/// Cargo passes tests only the binaries of their own package, so this builds the other one: same
/// target folder, same profile. `BITTYBUZZ_BBZ` names one that is built already: a build of `bbz`
/// alone compiles the shared crates once more, with fewer features.
pub fn path() -> &'static Path {
    static PATH: OnceLock<PathBuf> = OnceLock::new();
    PATH.get_or_init(|| {
        if let Some(path) = std::env::var_os("BITTYBUZZ_BBZ") {
            return PathBuf::from(path);
        }
        let test = std::env::current_exe().expect("the running test has a path");
        // TARGET/PROFILE/deps/TEST
        let folder = test.ancestors().nth(2).expect("cargo runs tests from its target folder");
        let target = folder.parent().expect("cargo runs tests from its target folder");
        let mut cargo = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
        cargo.args(["build", "--quiet", "--package", "bbz", "--target-dir"]).arg(target);
        if folder.ends_with("release") {
            cargo.arg("--release");
        }
        let status = cargo.current_dir(root()).status().expect("cargo starts");
        assert!(status.success(), "bbz does not build");
        folder.join(format!("bbz{}", std::env::consts::EXE_SUFFIX))
    })
}

/// Runs `bbz` with these arguments and environment variables from the root of the repository.
pub fn run<S: AsRef<str>>(arguments: &[S], environment: &[(String, String)]) -> Outcome {
    run_patiently(arguments, environment, PATIENCE)
}

/// Like [`run`], for something that may take longer.
pub fn run_patiently<S: AsRef<str>>(
    arguments: &[S],
    environment: &[(String, String)],
    patience: Duration,
) -> Outcome {
    let mut command = Command::new(path());
    command
        .args(arguments.iter().map(AsRef::as_ref))
        .current_dir(root())
        .env_remove("BUZZ_INCLUDE_PATH")
        .envs(environment.iter().map(|(name, value)| (name, value)))
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    let mut child = command.spawn().expect("bbz starts");
    let stdout = read_aside(child.stdout.take());
    let stderr = read_aside(child.stderr.take());
    let status = wait(&mut child, patience);
    Outcome {
        status,
        stdout: stdout.join().unwrap_or_default(),
        stderr: stderr.join().unwrap_or_default(),
    }
}

/// Reads a pipe on a thread of its own: a run that fills one pipe while the other is read would hang.
fn read_aside<R: Read + Send + 'static>(pipe: Option<R>) -> thread::JoinHandle<String> {
    thread::spawn(move || {
        let mut bytes = Vec::new();
        if let Some(mut pipe) = pipe {
            // A pipe that breaks ends the text; the exit status has the reason.
            let _ = pipe.read_to_end(&mut bytes);
        }
        String::from_utf8_lossy(&bytes).into_owned()
    })
}

fn wait(child: &mut Child, patience: Duration) -> Option<i32> {
    let start = Instant::now();
    loop {
        match child.try_wait() {
            Ok(Some(status)) => return status.code(),
            Ok(None) if start.elapsed() < patience => thread::sleep(Duration::from_millis(1)),
            _ => {
                let _ = child.kill();
                let _ = child.wait();
                return None;
            }
        }
    }
}
