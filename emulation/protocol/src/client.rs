//! The client: starts an emulator program and exchanges messages with it.

use std::io::{self, BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Child, ChildStdin, ChildStdout, Stdio};
use std::time::Duration;

use crate::Pause;
use crate::message::{self, Command, OutputLine, Reply, RobotEvent, RobotStatistics, TimedEvent};

/// kilolib's message RUN, which starts the program of a Kilobot, without its checksum
/// (`message.h`).
const RUN: [u8; 10] = [0, 0, 0, 0, 0, 0, 0, 0, 0, 0x88];

/// The times, after the call, at which the controller sends its message.
const RUN_AFTER_MS: [u64; 3] = [20, 30, 40];

/// An emulator program that runs as a child process. Dropping this value ends it.
pub struct Emulator {
    child: Child,
    input: ChildStdin,
    output: BufReader<ChildStdout>,
}

/// The result of a run.
#[derive(Clone, Debug, PartialEq)]
pub struct RunResult {
    /// The events, in order.
    pub events: Vec<TimedEvent>,
    /// The simulated time that was reached.
    pub at: Duration,
    /// The reason why the run ended.
    pub reason: Pause,
}

impl Emulator {
    /// Starts `program` with no image loaded. It inherits the caller's standard error.
    pub fn spawn(program: &Path) -> Result<Self, ClientError> {
        Self::spawn_with(program, &[])
    }

    /// Starts `program` with arguments, which select the robots that it emulates.
    pub fn spawn_with(program: &Path, arguments: &[&str]) -> Result<Self, ClientError> {
        let mut child = std::process::Command::new(program)
            .args(arguments)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .map_err(|source| ClientError::NoProgram {
                program: program.display().to_string(),
                source,
            })?;
        match (child.stdin.take(), child.stdout.take()) {
            (Some(input), Some(output)) => {
                Ok(Emulator { child, input, output: BufReader::new(output) })
            }
            _ => Err(ClientError::Ended),
        }
    }

    /// Loads the ELF file at `elf` and turns the robot on.
    pub fn load(&mut self, elf: &Path) -> Result<(), ClientError> {
        self.execute(&Command::Load { elf: elf.into() })
    }

    /// Writes to flash or RAM.
    pub fn write(&mut self, address: u32, bytes: &[u8]) -> Result<(), ClientError> {
        self.execute(&Command::Write { address, bytes: bytes.into() })
    }

    /// Reads flash, RAM, or the unique id and the bytes that were programmed once.
    pub fn read(&mut self, address: u32, length: u32) -> Result<Vec<u8>, ClientError> {
        self.read_of(0, address, length)
    }

    /// Reads flash, RAM or the unique id of one of several robots.
    pub fn read_of(
        &mut self,
        robot: usize,
        address: u32,
        length: u32,
    ) -> Result<Vec<u8>, ClientError> {
        match self.request(robot, &Command::Read { address, length }, |_| ())? {
            Reply::Bytes { bytes } => Ok(bytes),
            reply => Err(ClientError::unexpected(&reply)),
        }
    }

    /// Runs until `until`, a time since power-on.
    pub fn run(&mut self, until: Duration) -> Result<RunResult, ClientError> {
        let mut events = Vec::new();
        let (at, reason) = self.run_with(until, |event| events.push(event))?;
        Ok(RunResult { events, at, reason })
    }

    /// Runs until `until`, a time since power-on, and passes each event to `on_event` as it
    /// arrives.
    pub fn run_with(
        &mut self,
        until: Duration,
        mut on_event: impl FnMut(TimedEvent),
    ) -> Result<(Duration, Pause), ClientError> {
        self.run_all(until, |event| on_event(event.timed))
    }

    /// Runs all robots until `until`, a time since power-on, and passes each event to `on_event` as
    /// it arrives.
    pub fn run_all(
        &mut self,
        until: Duration,
        on_event: impl FnMut(RobotEvent),
    ) -> Result<(Duration, Pause), ClientError> {
        match self.request(0, &Command::Run { until }, on_event)? {
            Reply::Paused { at, reason, .. } => Ok((at, reason)),
            reply => Err(ClientError::unexpected(&reply)),
        }
    }

    /// Sends commands that are answered by `ok`, then runs all robots until `until`. Everything
    /// goes in one exchange, because each exchange costs two process switches. `commands` may have
    /// at most some hundred entries, so that all fit into the pipes' buffers.
    pub fn run_all_after(
        &mut self,
        commands: &[(usize, Command)],
        until: Duration,
        on_event: impl FnMut(RobotEvent),
    ) -> Result<(), ClientError> {
        self.begin_run(commands, until)?;
        self.finish_run(commands.len(), on_event)?;
        Ok(())
    }

    /// Sends commands and the command to run, as [`run_all_after`](Self::run_all_after) does, and
    /// does not wait: several programs run at the same time until the caller has called
    /// [`finish_run`](Self::finish_run) for each.
    pub fn begin_run(
        &mut self,
        commands: &[(usize, Command)],
        until: Duration,
    ) -> Result<(), ClientError> {
        let mut lines = String::new();
        for (robot, command) in commands {
            lines += &line_of(*robot, command)?;
        }
        lines += &line_of(0, &Command::Run { until })?;
        self.write_lines(&lines)
    }

    /// Waits for the end of a run that began after `commands` commands. Returns the time before
    /// which no robot decides to transmit to robots of other programs, unless a command or a packet
    /// wakes it before.
    pub fn finish_run(
        &mut self,
        commands: usize,
        mut on_event: impl FnMut(RobotEvent),
    ) -> Result<Duration, ClientError> {
        for _ in 0..commands {
            match self.reply(&mut on_event)? {
                Reply::Ok => {}
                reply => return Err(ClientError::unexpected(&reply)),
            }
        }
        match self.reply(on_event)? {
            Reply::Paused { silent_until, .. } => Ok(silent_until),
            reply => Err(ClientError::unexpected(&reply)),
        }
    }

    /// Returns the counters since power-on.
    pub fn statistics(&mut self) -> Result<RobotStatistics, ClientError> {
        self.statistics_of(0)
    }

    /// Returns the counters of one of several robots.
    pub fn statistics_of(&mut self, robot: usize) -> Result<RobotStatistics, ClientError> {
        match self.request(robot, &Command::Statistics, |_| ())? {
            Reply::Statistics(statistics) => Ok(*statistics),
            reply => Err(ClientError::unexpected(&reply)),
        }
    }

    /// Sends a command that is answered by `ok`, for commands without a method of their own.
    pub fn execute(&mut self, command: &Command) -> Result<(), ClientError> {
        self.execute_on(0, command)
    }

    /// Sends a command for one of several robots that is answered by `ok`.
    pub fn execute_on(&mut self, robot: usize, command: &Command) -> Result<(), ClientError> {
        match self.request(robot, command, |_| ())? {
            Reply::Ok => Ok(()),
            reply => Err(ClientError::unexpected(&reply)),
        }
    }

    /// Starts the programs of all Kilobots: the overhead controller sends its message three times,
    /// so that every robot receives it.
    pub fn start_kilobots(&mut self, now: Duration) -> Result<(), ClientError> {
        for after in RUN_AFTER_MS {
            let at = now + Duration::from_millis(after);
            self.execute(&Command::Radio { at, payload: RUN.to_vec() })?;
        }
        Ok(())
    }

    fn request(
        &mut self,
        robot: usize,
        command: &Command,
        on_event: impl FnMut(RobotEvent),
    ) -> Result<Reply, ClientError> {
        // WebAssembly cannot start programs; the early return keeps the parser of messages out of
        // the downloaded module.
        if cfg!(target_family = "wasm") {
            return Err(ClientError::Ended);
        }
        self.write_lines(&line_of(robot, command)?)?;
        self.reply(on_event)
    }

    fn write_lines(&mut self, lines: &str) -> Result<(), ClientError> {
        self.input.write_all(lines.as_bytes())?;
        Ok(self.input.flush()?)
    }

    /// Reads up to the next reply.
    fn reply(&mut self, mut on_event: impl FnMut(RobotEvent)) -> Result<Reply, ClientError> {
        loop {
            let mut line = String::new();
            if self.output.read_line(&mut line)? == 0 {
                return Err(ClientError::Ended);
            }
            match message::parse(line.as_bytes()) {
                Ok(OutputLine::Event(event)) => on_event(event),
                Ok(OutputLine::Reply(Reply::Error { message })) => {
                    return Err(ClientError::Refused(message));
                }
                Ok(OutputLine::Reply(reply)) => return Ok(reply),
                Err(error) => return Err(ClientError::Protocol(format!("{error}: {line}"))),
            }
        }
    }
}

/// Returns the line that is sent for a command.
fn line_of(robot: usize, command: &Command) -> Result<String, ClientError> {
    let line = message::line_of(robot, command);
    Ok(line.map_err(|error| ClientError::Protocol(error.to_string()))? + "\n")
}

impl Drop for Emulator {
    fn drop(&mut self) {
        // The program may have ended by itself; in any case it must not outlive this value.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// A reason why the emulator did not execute a command.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ClientError {
    /// The program could not be started.
    #[error(
        "cannot start {program}: {source}; build it with `cargo build --locked --release -p {}`",
        package(program)
    )]
    NoProgram {
        /// The program that was to be started.
        program: String,
        /// The operating system's error.
        source: io::Error,
    },
    /// The emulator refused the command; the message is its reason.
    #[error("{0}")]
    Refused(String),
    /// The program has ended.
    #[error("the emulator ended; what it wrote to standard error says why")]
    Ended,
    /// A pipe to or from the program failed.
    #[error("no connection to the emulator: {0}")]
    Pipe(#[from] io::Error),
    /// A line could not be parsed: the two programs are of different versions.
    #[error("this program does not understand the emulator's output, build both again: {0}")]
    Protocol(String),
}

/// Returns the name of the package that builds a program.
fn package(program: &str) -> String {
    let stem = Path::new(program).file_stem().unwrap_or_default().to_string_lossy();
    format!("bittybuzz-{}", stem.strip_prefix("bbz-").unwrap_or(&stem))
}

impl ClientError {
    fn unexpected(reply: &Reply) -> Self {
        ClientError::Protocol(format!("{reply:?}"))
    }
}
