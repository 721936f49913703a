//! The loop of an emulator program.

use std::io::{self, BufRead, Write};
use std::time::Duration;

use bittybuzz_chips::{Battery, Frame, Link, MAX_PAYLOAD, P2P_MAX, P2pFrame, Pose, Time, Width};

use crate::message::{self, Command, Event, Output, Reply, Statistics, TimedEvent};
use crate::rtt::Rtt;
use crate::{Image, ImageError, Machine, MachineError, Pause};

/// How often the log is read, in the robot's time.
const POLL: Duration = Duration::from_millis(1);
/// One-time programmable area and unique id, which the board answers for; reading it has no effect.
const IDENTITY: std::ops::Range<u32> = 0x1fff_7000..0x1fff_8000;
/// More than the largest memory there is.
const LONGEST_READ: u32 = 1024 * 1024;

/// Reads commands from `input`, one JSON object per line, and writes events and replies to `output`, until
/// `quit` or the end of the input. Errors are those of the two streams only.
pub fn serve(
    machine: &mut impl Machine,
    input: impl BufRead,
    output: impl Write,
) -> io::Result<()> {
    let mut server = Server { machine, output, loaded: None };
    for line in input.split(b'\n') {
        let line = line?;
        if line.trim_ascii().is_empty() {
            continue;
        }
        let reply = match message::parse(&line) {
            Ok(Command::Quit) => {
                server.print(&Output::Reply(Reply::Ok))?;
                return server.output.flush();
            }
            Ok(Command::Run { until }) => server.run(until)?,
            Ok(command) => server.execute(command),
            Err(error) => Err(CommandError::Unknown(error)),
        };
        let reply = reply.unwrap_or_else(|error| Reply::Error { message: error.to_string() });
        server.print(&Output::Reply(reply))?;
        server.output.flush()?;
    }
    Ok(())
}

struct Server<'a, M, W> {
    machine: &'a mut M,
    output: W,
    loaded: Option<Loaded>,
}

struct Loaded {
    image: Image,
    rtt: Option<Rtt>,
    now: Duration,
}

/// Why a command was not done.
#[derive(Debug, thiserror::Error)]
enum CommandError {
    #[error("not a command: {0}; docs/emulation.md lists them")]
    Unknown(serde_json::Error),
    #[error("nothing is loaded: send {{\"command\":\"load\",\"elf\":PATH}} first")]
    NotLoaded,
    #[error("a frame's payload has at most {MAX_PAYLOAD} bytes, this one has {0}")]
    FrameTooLong(usize),
    #[error("a P2P frame has at most {P2P_MAX} bytes, this one has {0}")]
    P2pTooLong(usize),
    #[error("read at most {LONGEST_READ} bytes at once, not {0}")]
    ReadTooLong(u32),
    #[error("a probability is between 0 and 1, not {0}")]
    NotAProbability(f64),
    #[error(transparent)]
    Image(#[from] ImageError),
    #[error(transparent)]
    Machine(#[from] MachineError),
}

impl<M: Machine, W: Write> Server<'_, M, W> {
    fn print(&mut self, output: &Output) -> io::Result<()> {
        serde_json::to_writer(&mut self.output, output)?;
        self.output.write_all(b"\n")
    }

    fn execute(&mut self, command: Command) -> Result<Reply, CommandError> {
        if let Command::Load { elf } = command {
            let image = Image::open(&elf)?;
            self.loaded = None;
            self.machine.load(&image)?;
            let rtt = Rtt::new(&image);
            self.loaded = Some(Loaded { image, rtt, now: Duration::ZERO });
            return Ok(Reply::Ok);
        }
        let loaded = self.loaded.as_ref().ok_or(CommandError::NotLoaded)?;
        match command {
            Command::Write { address, bytes } => self.machine.write_memory(address, &bytes)?,
            Command::Read { address, length } => {
                if length > LONGEST_READ {
                    return Err(CommandError::ReadTooLong(length));
                }
                let mut bytes = vec![0; length as usize];
                let end = address.saturating_add(length);
                if IDENTITY.contains(&address) && end <= IDENTITY.end {
                    let board = self.machine.board();
                    for (address, byte) in (address..end).zip(&mut bytes) {
                        *byte = board.read(address, Width::Byte) as u8;
                    }
                } else {
                    self.machine.read_memory(address, &mut bytes)?;
                }
                return Ok(Reply::Bytes { bytes });
            }
            Command::Send { kind, payload } => {
                let length = payload.len();
                let frame = Frame::new(kind, payload).ok_or(CommandError::FrameTooLong(length))?;
                self.machine.board().send(&frame);
            }
            Command::P2p { at, port, rssi, payload } => {
                let length = payload.len();
                let frame = P2pFrame::new(port, rssi, payload);
                let frame = frame.ok_or(CommandError::P2pTooLong(length))?;
                let end = Time::from_nanos(u64::try_from(at.as_nanos()).unwrap_or(u64::MAX));
                self.machine.board().hear(&frame, end);
            }
            Command::Pose { x_mm, y_mm, z_mm, yaw_degrees } => {
                let pose = Pose { position_mm: [x_mm, y_mm, z_mm], yaw_degrees };
                self.machine.board().tell_pose(pose);
            }
            Command::Bytes { bytes } => self.machine.board().send_bytes(&bytes),
            Command::Link { lose, corrupt, seed } => {
                for probability in [lose, corrupt] {
                    if !(0.0..=1.0).contains(&probability) {
                        return Err(CommandError::NotAProbability(probability));
                    }
                }
                self.machine.board().set_link(Link { lose, corrupt, seed });
            }
            Command::FlowControl { full } => self.machine.board().set_flow_control(full),
            Command::Battery { volts, charging, usb_powered } => {
                self.machine.board().set_battery(Battery { volts, charging, usb_powered });
            }
            Command::Shutdown => self.machine.board().request_shutdown(),
            Command::Skip { symbol } => {
                let address = loaded.image.function(&symbol)?;
                self.machine.skip(address)?;
            }
            Command::Statistics => {
                return Ok(Reply::Statistics(Box::new(Statistics {
                    core: self.machine.statistics(),
                    board: self.machine.board().statistics().into(),
                })));
            }
            Command::Load { .. } | Command::Run { .. } | Command::Quit => {
                unreachable!("handled by the callers")
            }
        }
        Ok(Reply::Ok)
    }

    /// Runs in slices, so that the log is read often enough; events are printed as they come.
    fn run(&mut self, until: Duration) -> io::Result<Result<Reply, CommandError>> {
        let Some(mut loaded) = self.loaded.take() else {
            return Ok(Err(CommandError::NotLoaded));
        };
        let result = self.run_loaded(&mut loaded, until);
        self.loaded = Some(loaded);
        result
    }

    fn run_loaded(
        &mut self,
        loaded: &mut Loaded,
        until: Duration,
    ) -> io::Result<Result<Reply, CommandError>> {
        let mut reason = Pause::Time;
        while loaded.now < until && reason == Pause::Time {
            let slice = (loaded.now + POLL).min(until);
            match self.machine.run(slice) {
                Ok(pause) => reason = pause,
                Err(error) => return Ok(Err(error.into())),
            }
            loaded.now = slice;
            let mut events = self.machine.take_events();
            if let Some(rtt) = &loaded.rtt {
                match rtt.poll(self.machine) {
                    Ok(bytes) if bytes.is_empty() => {}
                    Ok(bytes) => events.push(TimedEvent { at: slice, event: Event::Rtt { bytes } }),
                    Err(error) => return Ok(Err(error.into())),
                }
            }
            if !events.is_empty() {
                for event in events {
                    self.print(&Output::Event(event))?;
                }
                // Whoever watches wants to see them now.
                self.output.flush()?;
            }
        }
        Ok(Ok(Reply::Paused { at: loaded.now, reason }))
    }
}
