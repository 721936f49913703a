//! A robot that another program emulates.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

use bittybuzz_arena::robot::RobotModel;
use bittybuzz_comms::infrared::FaultReport;
use bittybuzz_emulation::message::EmulatorEvent;
use bittybuzz_emulation::{ClientError, Emulator, Pause};
use bittybuzz_isp::memories;
use bittybuzz_robot_spec::Robot;
use bittybuzz_toml_reader::file;
use bittybuzz_trace_reader::{Table, TraceMessage, TraceReader};

use crate::emulator;
use crate::file_error::FileError;
use crate::hex;
use crate::interrupt::Interrupt;
use crate::probe_rs;
use crate::problem::Problem;
use crate::program::LoadedProgram;

use super::message::{Level, PrintedMessage, TraceContent};
use super::printer::TracePrinter;

/// A reason why a robot cannot be emulated.
#[derive(Debug, thiserror::Error)]
enum EmulationError {
    /// Symbols where an image is needed.
    #[error("`{0}` describes a script, but is not one")]
    NoImage(PathBuf),
    /// The firmware has no table of messages.
    #[error("`{0}` has no defmt messages")]
    NoMessages(PathBuf),
    /// The firmware's table of messages has a mistake.
    #[error("the defmt messages of `{path}` cannot be used: {reason}")]
    DamagedMessages { path: PathBuf, reason: String },
    /// The emulator cannot do the requested work.
    #[error("{0}")]
    Emulator(#[from] ClientError),
}

impl Problem for EmulationError {
    fn help(&self) -> Option<String> {
        match self {
            EmulationError::NoImage(_) => {
                Some("name the script (.bzz), or its image (.bbi) next to the symbols".to_owned())
            }
            EmulationError::NoMessages(_) | EmulationError::DamagedMessages { .. } => {
                Some("name the ELF file that cargo built, with its symbols".to_owned())
            }
            EmulationError::Emulator(_) => None,
        }
    }
}

/// Simulated time between two checks for Ctrl-C.
const SLICE: Duration = Duration::from_millis(20);

/// The longest time from the end of the emulator by Ctrl-C until this process handles Ctrl-C.
const PATIENCE: Duration = Duration::from_millis(200);

/// An emulated robot, and the options of its run.
pub struct TracedEmulation<'a> {
    /// The emulator, if it is not the usual one of the robot.
    pub program: Option<&'a Path>,
    /// The firmware that would be flashed.
    pub firmware: &'a Path,
    pub robot: &'a Robot,
    /// The script that replaces the firmware's own, and its path.
    pub script: Option<(&'a Path, &'a LoadedProgram)>,
    /// The simulated time to run at full speed; `None` for an endless run in real time.
    pub duration: Option<Duration>,
    /// True to print LEDs and motors.
    pub outputs: bool,
}

impl TracedEmulation<'_> {
    /// Runs the robot, and prints its messages.
    pub fn run(
        &self,
        printer: &mut TracePrinter<'_>,
        interrupt: &mut Interrupt,
    ) -> Result<(), Box<dyn Problem>> {
        // A robot that the user defined runs on the board of the shipped robot with the same chip.
        let mut boards = bittybuzz_robot_files::all_shipped().into_iter();
        let board = boards.find(|board| board.chip == self.robot.chip);
        let models = bittybuzz_robot_models::all();
        let is_board = |model: &&Arc<dyn RobotModel>| {
            board.as_ref().is_some_and(|board| model.robots().contains(&board.name.as_str()))
        };
        let played = models.iter().find(is_board).and_then(|model| model.emulation());
        // A robot without defmt only reports faults, through its link.
        let has_trace = played.as_ref().is_none_or(|played| played.has_trace());
        let script = self.script_bytes()?;
        let table = if has_trace { Some(self.table()?) } else { None };
        let arguments = match played.as_ref().and_then(|played| played.shared_program_robot()) {
            Some(name) => vec!["--robot", name],
            None => vec![],
        };
        let own = played.as_ref().filter(|_| !has_trace).map(|played| played.program());
        let usual = own.unwrap_or(emulator::STM32);
        let program = emulator::program(self.program, usual);
        let mut emulator =
            Emulator::spawn_with(&program, &arguments).map_err(EmulationError::Emulator)?;
        emulator.load(self.firmware).map_err(EmulationError::Emulator)?;
        if let Some((address, bytes)) = script {
            emulator.write(address, &bytes).map_err(EmulationError::Emulator)?;
        }
        if let Some(played) = played {
            played.start(&mut emulator, Duration::ZERO).map_err(EmulationError::Emulator)?;
        }
        let mut reader = ReportReader { defmt: table.map(Arc::new).map(TraceReader::new) };
        let start = Instant::now();
        let mut now = Duration::ZERO;
        while self.duration.is_none_or(|end| now < end) {
            if printer.is_over() || interrupt.is_raised() {
                break;
            }
            let until = self.duration.map_or(now + SLICE, |end| end.min(now + SLICE));
            let run = emulator.run_with(until, |event| {
                for content in reader.contents(event.event, self.outputs) {
                    // Messages after the requested end are not printed.
                    if !printer.is_over() {
                        printer
                            .print(&PrintedMessage { time: Some(event.at.as_secs_f64()), content });
                    }
                }
            });
            let (at, pause) = match run {
                Ok(paused) => paused,
                // The terminal sends Ctrl-C to both programs, and the emulator may end first.
                Err(_) if interrupt.is_raised_within(PATIENCE) => break,
                Err(error) => return Err(EmulationError::Emulator(error).into()),
            };
            match pause {
                Pause::Time => now = at.max(until),
                Pause::Lockup | Pause::PowerOff => break,
            }
            if self.duration.is_none() {
                printer.flush();
                interrupt.wait(now.saturating_sub(start.elapsed()));
            }
        }
        Ok(())
    }

    /// Returns the bytes that replace the firmware's own script, and their address. If the script
    /// has no fixed place, they are the whole program of the robot.
    fn script_bytes(&self) -> Result<Option<PlacedBytes>, Box<dyn Problem>> {
        let Some((path, program)) = self.script else { return Ok(None) };
        if program.image.is_empty() {
            return Err(EmulationError::NoImage(path.to_owned()).into());
        }
        if memories::is_programmed_by_isp(self.robot) {
            let script = (path, program.symbols.as_ref());
            let firmware = hex::read(self.firmware)?;
            let whole =
                hex::exchanged(self.firmware, &firmware, script, &program.image, self.robot)?;
            return Ok(Some((0, whole)));
        }
        let layout = probe_rs::layout(self.robot)?;
        let section = probe_rs::script_section(self.robot, path, &program.image)?;
        Ok(Some((layout.script.address, section)))
    }

    /// Reads the texts of the firmware's messages.
    fn table(&self) -> Result<Table, Box<dyn Problem>> {
        let bytes = file::read(self.firmware, file::PROGRAM_BYTES_MAX)
            .map_err(|error| FileError::reading(self.firmware, error))?;
        match Table::parse(&bytes) {
            Ok(Some(table)) => Ok(table),
            Ok(None) => Err(EmulationError::NoMessages(self.firmware.to_owned()).into()),
            Err(error) => Err(EmulationError::DamagedMessages {
                path: self.firmware.to_owned(),
                reason: error.to_string(),
            }
            .into()),
        }
    }
}

/// Bytes for a robot's program memory, after their address.
type PlacedBytes = (u32, Vec<u8>);

/// Reads the firmware's output.
struct ReportReader {
    /// The decoder of messages; `None` for a Kilobot, which sends none.
    defmt: Option<TraceReader>,
}

impl ReportReader {
    fn contents(&mut self, event: EmulatorEvent, outputs: bool) -> Vec<TraceContent> {
        let output = |name: String, state: String| match outputs {
            true => vec![TraceContent::Output { name, state }],
            false => vec![],
        };
        match event {
            EmulatorEvent::Rtt { bytes } => self.decode(&bytes),
            EmulatorEvent::Led { name, on } => {
                output(format!("led {name}"), if on { "on" } else { "off" }.to_owned())
            }
            EmulatorEvent::Motor { number, duty, frequency_hz } => output(
                format!("motor {number}"),
                format!("{:.1} % at {:.1} kHz", duty * 100.0, frequency_hz / 1000.0),
            ),
            EmulatorEvent::Color { red, green, blue } => {
                output("led".to_owned(), format!("red {red}, green {green}, blue {blue} of 3"))
            }
            EmulatorEvent::Motion { .. }
            | EmulatorEvent::Syslink { .. }
            | EmulatorEvent::P2p { .. }
            | EmulatorEvent::Radio { .. }
            | EmulatorEvent::Serial { .. } => vec![],
            EmulatorEvent::Step => vec![TraceContent::Step],
            EmulatorEvent::Infrared { payload, .. } => {
                // A frame of another length is not a report.
                let message = payload.as_slice().try_into().ok();
                message.and_then(FaultReport::of).map(TraceContent::Report).into_iter().collect()
            }
            EmulatorEvent::Reset { cause } => {
                // The firmware may restart in the middle of a message.
                if let Some(defmt) = &mut self.defmt {
                    defmt.restart();
                }
                vec![TraceContent::Reset { cause }]
            }
            EmulatorEvent::PowerOff { acknowledged: true } => {
                vec![TraceContent::Reset { cause: "the power is off".to_owned() }]
            }
            EmulatorEvent::PowerOff { acknowledged: false } => {
                vec![TraceContent::Failure(
                    "the power was cut: the firmware has not acknowledged the request".to_owned(),
                )]
            }
            EmulatorEvent::Loader { name } => vec![TraceContent::Failure(format!(
                "the bootloader has started its loader `{name}` instead of the firmware"
            ))],
            EmulatorEvent::HardwareError { text } => vec![TraceContent::Failure(text)],
            EmulatorEvent::Lockup { pc } => vec![TraceContent::Failure(format!(
                "the core is locked up at {pc:#010x}: a fault came while it handled a fault"
            ))],
        }
    }

    fn decode(&mut self, bytes: &[u8]) -> Vec<TraceContent> {
        // Firmware without a table of messages, as the Kilobot's, writes none.
        let messages = self.defmt.as_mut().map_or(Vec::new(), |defmt| defmt.read(bytes));
        let content = |message: TraceMessage| {
            let level = message.level.and_then(Level::from_name);
            TraceContent::from_firmware(level, message.content)
        };
        messages.into_iter().map(content).collect()
    }
}
