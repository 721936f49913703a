//! Calls probe-rs, the program that communicates with debug probes.

use std::ffi::OsStr;
use std::fmt;
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdout, Command, ExitStatus, Stdio};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use bittybuzz_compiler::fit;
use bittybuzz_robot_spec::{Layout, Robot};

use crate::problem::Problem;
use crate::program::RefusedImage;
use crate::shell;

/// A reason why probe-rs cannot do its work.
#[derive(Debug, thiserror::Error)]
pub enum ProbeRsError {
    /// The robot with this title can neither be flashed nor traced yet.
    #[error("the {0} cannot be flashed or traced by this `bbz` yet")]
    NotYet(String),
    /// The script does not fit into its region of the flash.
    #[error("`{path}` needs {bytes} bytes, the robot has room for {bytes_max}")]
    TooLong {
        /// The file of the script.
        path: PathBuf,
        /// Bytes of its image.
        bytes: usize,
        bytes_max: u32,
    },
    #[error("probe-rs is not installed")]
    NotInstalled,
    /// probe-rs is installed, but does not start.
    #[error("cannot run probe-rs: {0}")]
    Start(io::Error),
    #[error("no debug probe is connected")]
    NoProbe,
    #[error("probe-rs has failed ({0})")]
    Failed(ExitStatus),
}

impl Problem for ProbeRsError {
    fn help(&self) -> Option<String> {
        let help = match self {
            ProbeRsError::NotYet(_) => {
                "its robot file has no [layout]: where firmware and script lie"
            }
            ProbeRsError::TooLong { .. } => "shorten the script",
            ProbeRsError::NotInstalled => {
                "cargo install probe-rs-tools --locked (on Debian it needs the packages \
                 libudev-dev and pkg-config); https://probe.rs tells of other ways"
            }
            ProbeRsError::Start(_) => return None,
            ProbeRsError::NoProbe => {
                "plug in the probe, and power the robot; on Linux, udev rules must let you use it: \
                 https://probe.rs/docs/getting-started/probe-setup"
            }
            ProbeRsError::Failed(_) => "its messages above say why",
        };
        Some(help.to_owned())
    }
}

const PROGRAM: &str = "probe-rs";

/// The message of probe-rs if it finds no probe.
const NO_PROBE: &str = "No connected probes";

/// The time that probe-rs may take to release the robot.
const FAREWELL: Duration = Duration::from_secs(3);

/// The time between two checks that probe-rs has ended.
const PATIENCE: Duration = Duration::from_millis(20);

/// Returns the reason why a robot cannot be reached.
fn not_yet(robot: &Robot) -> ProbeRsError {
    ProbeRsError::NotYet(robot.title.clone())
}

/// Returns the chip of a robot that probe-rs can reach.
pub fn chip(robot: &Robot) -> Result<&str, ProbeRsError> {
    let chip = robot.chip.as_deref().filter(|_| robot.layout.is_some());
    chip.ok_or_else(|| not_yet(robot))
}

/// Returns the places of firmware and script on a robot.
pub fn layout(robot: &Robot) -> Result<Layout, ProbeRsError> {
    robot.layout.ok_or_else(|| not_yet(robot))
}

/// Returns the content of the script's region of the flash for an image from `path`.
pub fn script_section(
    robot: &Robot,
    path: &Path,
    image: &[u8],
) -> Result<Vec<u8>, Box<dyn Problem>> {
    let layout = layout(robot)?;
    let stored = fit::for_flash(image, robot).map_err(|cause| RefusedImage::new(path, cause))?;
    let section = layout.script_section(&stored).ok_or_else(|| ProbeRsError::TooLong {
        path: path.to_owned(),
        bytes: image.len(),
        bytes_max: layout.most_script(),
    })?;
    Ok(section)
}

/// A call of probe-rs.
#[derive(Debug)]
pub struct ProbeRs(Command);

impl ProbeRs {
    /// Creates a call of a command for a chip. probe-rs must not ask for the probe: there may be no
    /// person to answer.
    pub fn new(command: &str, chip: &str) -> Self {
        let mut call = Command::new(PROGRAM);
        call.args([command, "--non-interactive", "--chip", chip]);
        ProbeRs(call)
    }

    /// Adds an argument.
    pub fn arg(mut self, argument: impl AsRef<OsStr>) -> Self {
        self.0.arg(argument);
        self
    }

    /// Adds arguments.
    pub fn args<const N: usize>(mut self, arguments: [&str; N]) -> Self {
        self.0.args(arguments);
        self
    }

    /// Starts probe-rs; its messages go to standard error.
    pub fn spawn(mut self) -> Result<Running, ProbeRsError> {
        set_apart(&mut self.0);
        self.0.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child = self.0.spawn().map_err(|error| match error.kind() {
            io::ErrorKind::NotFound => ProbeRsError::NotInstalled,
            _ => ProbeRsError::Start(error),
        })?;
        let stderr = child.stderr.take().expect("standard error is a pipe");
        Ok(Running { child, messages: thread::spawn(move || pass_on(stderr)) })
    }

    /// Runs probe-rs to its end; its messages and results go to standard error.
    pub fn run(self) -> Result<(), ProbeRsError> {
        let mut running = self.spawn()?;
        let stdout = running.take_stdout();
        pass_on(stdout);
        running.finish()
    }
}

/// Writes the call as a shell command.
impl fmt::Display for ProbeRs {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&shell::line(&self.0))
    }
}

/// A running probe-rs.
pub struct Running {
    child: Child,
    /// Copies the messages, and returns them.
    messages: JoinHandle<String>,
}

impl Running {
    /// Takes the standard output; a second call returns an empty one.
    pub fn take_stdout(&mut self) -> ChildOutput {
        ChildOutput(self.child.stdout.take())
    }

    /// Waits for the end of probe-rs; fails unless it succeeded.
    pub fn finish(mut self) -> Result<(), ProbeRsError> {
        let status = self.child.wait().map_err(ProbeRsError::Start)?;
        let messages = self.messages.join().expect("copying bytes does not panic");
        if status.success() {
            return Ok(());
        }
        Err(match messages.contains(NO_PROBE) {
            true => ProbeRsError::NoProbe,
            false => ProbeRsError::Failed(status),
        })
    }

    /// Asks probe-rs to end, as Ctrl-C would: it then restores its changes on the robot, and
    /// releases it. Kills probe-rs if that takes too long.
    pub fn end(mut self) -> Result<(), ProbeRsError> {
        interrupt(&self.child);
        let deadline = Instant::now() + FAREWELL;
        while self.child.try_wait().map_err(ProbeRsError::Start)?.is_none() {
            if deadline <= Instant::now() {
                return self.child.kill().map_err(ProbeRsError::Start);
            }
            thread::sleep(PATIENCE);
        }
        // The last messages of probe-rs are passed on before `bbz` ends.
        self.messages.join().expect("copying bytes does not panic");
        Ok(())
    }
}

#[cfg(unix)]
fn interrupt(child: &Child) {
    use nix::sys::signal::{Signal, kill};
    use nix::unistd::Pid;

    let id = i32::try_from(child.id()).expect("Unix has process ids of this type");
    // The signal fails if probe-rs has already ended.
    let _ = kill(Pid::from_raw(id), Signal::SIGINT);
}

/// Does nothing: on other systems, Ctrl-C reaches probe-rs directly.
#[cfg(not(unix))]
fn interrupt(_: &Child) {}

/// Separates probe-rs from the terminal's process group, so that Ctrl-C reaches only `bbz`, which
/// then ends probe-rs at the right moment.
#[cfg(unix)]
fn set_apart(call: &mut Command) {
    use std::os::unix::process::CommandExt;

    call.process_group(0);
}

#[cfg(not(unix))]
fn set_apart(_: &mut Command) {}

/// The standard output of a child; empty if it was taken before.
pub struct ChildOutput(Option<ChildStdout>);

impl Read for ChildOutput {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        self.0.as_mut().map_or(Ok(0), |stdout| stdout.read(buffer))
    }
}

/// Copies a pipe to standard error, and returns its text. The pipe is read to its end even if
/// writing fails.
fn pass_on(mut pipe: impl Read) -> String {
    let mut all = Vec::new();
    let mut buffer = [0; 1024];
    while let Ok(count @ 1..) = pipe.read(&mut buffer) {
        let part = &buffer[..count];
        // Without a reader the messages are still kept, because they have the cause of a failure.
        let _ = io::stderr().write_all(part);
        all.extend_from_slice(part);
    }
    String::from_utf8_lossy(&all).into_owned()
}
