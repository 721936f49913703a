//! The loop of an emulator program.

use std::io::{self, BufRead, Write};
use std::time::Duration;

use bittybuzz_chips::{Air, Board, RADIO_MAX, Sender, Width};

use crate::control::{Refusal, probability};
use crate::fleet::{Fleet, time};
use crate::message::{
    Command, Event, Output, Reply, RobotEvent, Statistics, TimedEvent, parse_command,
};
use crate::rtt::Rtt;
use crate::{Control, Image, ImageError, Machine, MachineError, Pause};

/// How often the log is read, in the robot's time.
const POLL: Duration = Duration::from_millis(1);
/// One-time programmable area, system memory and unique id, which the board answers for; reading it has no effect.
const IDENTITY: std::ops::Range<u32> = 0x1fff_7000..0x2000_0000;
/// More than the largest memory there is.
const LONGEST_READ: u32 = 1024 * 1024;

/// Drives `machines`, a robot each, which hear each other. Reads commands from `input`, one JSON object per line, and
/// writes events and replies to `output`, until `quit` or the end of the input. Errors are those of the two streams only.
pub fn serve<M: Machine>(
    machines: &mut [M],
    input: impl BufRead,
    output: impl Write,
) -> io::Result<()> {
    let mut server = Server { fleet: Fleet { machines, air: Air::new() }, output, loaded: None };
    for line in input.split(b'\n') {
        let line = line?;
        if line.trim_ascii().is_empty() {
            continue;
        }
        let reply = match parse_command(&line) {
            Ok((_, Command::Quit)) => {
                server.print(&Output::Reply(Reply::Ok))?;
                return server.output.flush();
            }
            Ok((_, Command::Run { until })) => server.run(until)?,
            Ok((robot, command)) => server.execute(robot, command),
            Err(error) => Err(CommandError::Unknown(error)),
        };
        let reply = reply.unwrap_or_else(|error| Reply::Error { message: error.to_string() });
        server.print(&Output::Reply(reply))?;
        server.output.flush()?;
    }
    Ok(())
}

struct Server<'a, M, W> {
    fleet: Fleet<'a, M>,
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
    #[error("read at most {LONGEST_READ} bytes at once, not {0}")]
    ReadTooLong(u32),
    #[error("a packet has at most {RADIO_MAX} bytes, this one has {0}")]
    PacketTooLong(usize),
    #[error("there is no robot {robot}: this program plays {robots}, counted from 0")]
    NoRobot { robot: usize, robots: usize },
    #[error(transparent)]
    Refused(#[from] Refusal),
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

    fn execute(&mut self, robot: usize, command: Command) -> Result<Reply, CommandError> {
        if let Command::Load { elf } = command {
            let image = Image::open(&elf)?;
            self.loaded = None;
            self.fleet.air = Air::new();
            for machine in self.fleet.machines.iter_mut() {
                machine.load(&image)?;
            }
            let rtt = Rtt::new(&image);
            self.loaded = Some(Loaded { image, rtt, now: Duration::ZERO });
            return Ok(Reply::Ok);
        }
        let loaded = self.loaded.as_ref().ok_or(CommandError::NotLoaded)?;
        let robots = self.fleet.machines.len();
        let machine =
            self.fleet.machines.get_mut(robot).ok_or(CommandError::NoRobot { robot, robots })?;
        match command {
            Command::Write { address, bytes } => machine.write_memory(address, &bytes)?,
            Command::Read { address, length } => {
                if length > LONGEST_READ {
                    return Err(CommandError::ReadTooLong(length));
                }
                let mut bytes = vec![0; length as usize];
                let end = address.saturating_add(length);
                if IDENTITY.contains(&address) && end <= IDENTITY.end {
                    let board = machine.board();
                    for (address, byte) in (address..end).zip(&mut bytes) {
                        *byte = board.read(address, Width::Byte) as u8;
                    }
                } else {
                    machine.read_memory(address, &mut bytes)?;
                }
                return Ok(Reply::Bytes { bytes });
            }
            Command::Skip { symbol } => {
                let address = loaded.image.function(&symbol)?;
                machine.skip(address)?;
            }
            Command::Air { lose, seed } => self.fleet.air.lose(probability(lose)?, seed),
            Command::Radio { at, payload } => {
                if payload.len() > RADIO_MAX {
                    return Err(CommandError::PacketTooLong(payload.len()));
                }
                let begin = time(at.max(loaded.now));
                let packet = machine.board().packet_of(&payload, begin);
                let packet = packet.ok_or(Refusal::OtherRobot(M::Board::NAME))?;
                self.fleet.air.add(Sender::Stranger, packet);
            }
            Command::Statistics => {
                return Ok(Reply::Statistics(Box::new(Statistics {
                    core: machine.statistics(),
                    board: machine.board().counted(),
                    air: self.fleet.air.statistics.into(),
                })));
            }
            Command::Load { .. } | Command::Run { .. } | Command::Quit => {
                unreachable!("handled by the callers")
            }
            command => machine.board().obey(command)?,
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
            match self.fleet.run(loaded.now, slice) {
                Ok(pause) => reason = pause,
                Err(error) => return Ok(Err(error.into())),
            }
            loaded.now = slice;
            let mut is_news = false;
            for robot in 0..self.fleet.machines.len() {
                let machine = &mut self.fleet.machines[robot];
                let mut events = machine.take_events();
                if let Some(rtt) = &loaded.rtt {
                    match rtt.poll(machine) {
                        Ok(bytes) if bytes.is_empty() => {}
                        Ok(bytes) => {
                            events.push(TimedEvent { at: slice, event: Event::Rtt { bytes } });
                        }
                        Err(error) => return Ok(Err(error.into())),
                    }
                }
                is_news |= !events.is_empty();
                for timed in events {
                    self.print(&Output::Event(RobotEvent { robot, timed }))?;
                }
            }
            if is_news {
                // Whoever watches wants to see them now.
                self.output.flush()?;
            }
        }
        Ok(Ok(Reply::Paused { at: loaded.now, reason }))
    }
}
