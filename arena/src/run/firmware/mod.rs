//! Robots that run their firmware in emulator processes. The signals of their motors move them in
//! the world.

mod bridge;
mod emulated;
mod emulator_pool;
mod fleet;
mod fleets;
mod p2p;
mod pace;
mod radio_turns;
mod table;
mod trace_events;

use std::fmt;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use bittybuzz_compiler::refusal;
use bittybuzz_emulation::{ClientError, FirmwareImage, FirmwareImageError};
use bittybuzz_toml_reader::{Place, file};
use bittybuzz_trace_reader::Table;
use bittybuzz_vm_core::ImageError;

use crate::robot::{Emulation, FlashJob, RobotModel};
use crate::scenario::{Backend, Scenario, ScenarioCause, ScenarioError};

use super::program::LoadedProgram;
use super::settings::media;
pub use fleets::Fleets;
pub use p2p::P2pAir;
pub use radio_turns::{RadioTurns, TurnLength};

/// The reason why a model with firmware has emulators.
const EMULATED: &str = "the reader of scenarios rejects firmware without an emulator";

/// The reason why the world has an emulated robot.
const IN_WORLD: &str = "emulated robots are in the world from the start";

/// The data that a scenario flashes to the robots of one model: their firmware, and the script and
/// the id of each robot, unless they run a foreign image.
pub struct Firmware {
    model: Arc<dyn RobotModel>,
    path: PathBuf,
    /// The place in the scenario that first names the firmware.
    place: Place,
    /// The table of the trace's messages; `None` if the firmware has no trace.
    messages: Option<Arc<Table>>,
    /// True if the robots run a foreign image.
    is_image: bool,
    robots: Vec<Flashed>,
    /// One more robot, which listens for a bridge.
    listener: Option<ListeningRobot>,
}

/// The robot that listens for a bridge.
struct ListeningRobot {
    /// The content of its flash, from address 0 on.
    program: Vec<u8>,
    /// The position of the robot in mm.
    at: [f64; 2],
}

/// The data that one robot has in addition to the firmware.
struct Flashed {
    /// The number of the robot in the scenario.
    number: usize,
    /// Address and content of each section of memory.
    sections: Vec<(u32, Vec<u8>)>,
    /// The model of the robot's group, which may have settings of its own.
    model: Arc<dyn RobotModel>,
    /// The UDP port of its door for ground stations, and the place of that key.
    door: Option<(u16, Place)>,
}

impl Firmware {
    /// Returns the firmware for each model of the scenario with robots that run any.
    pub fn for_scenario(
        scenario: &Scenario,
        programs: &[LoadedProgram],
    ) -> Result<Vec<Self>, ScenarioError> {
        let mut all: Vec<Firmware> = Vec::new();
        let (media, mut number) = (media(scenario), 0);
        // The first programs are those of the groups.
        for (group, loaded) in scenario.groups.iter().zip(programs) {
            let first = number;
            number += group.count as usize;
            let (image, place) = match &group.backend {
                Backend::Vm => continue,
                Backend::Firmware { image, place } => (image, place),
                Backend::Image(section) => (&section.path, &section.place),
            };
            let foreign = group.backend.image();
            let failed = |cause| ScenarioError { cause, place: Some(Box::new(place.clone())) };
            let emulation = group.model.emulation().expect(EMULATED);
            let (robot, script) = (&group.robot, &*loaded.program.image);
            let flash = FlashJob { firmware: image, script, robot, media: &media };
            let shared = match foreign {
                Some(_) => Vec::new(),
                None => {
                    let mut sections = emulation.sections(&flash).map_err(failed)?;
                    if let Some((address, bytes)) = robot.settings_part(&group.settings) {
                        // A setting of the scenario outranks the one that follows from a medium.
                        sections.retain(|(other, _)| *other != address);
                        sections.push((address, bytes));
                    }
                    sections
                }
            };
            let known = match all.iter().position(|known| known.model.name() == group.model.name())
            {
                Some(known) => known,
                None => {
                    let (path, robots) = (image.clone(), Vec::new());
                    let unusable = |reason| {
                        let (robots, path) = (group.model.robots(), path.display().to_string());
                        failed(match foreign {
                            Some(_) => ScenarioCause::NoImage { path, reason },
                            None => ScenarioCause::NoFirmware { robots, path, reason },
                        })
                    };
                    let elf = file::read(&path, file::PROGRAM_BYTES_MAX);
                    let elf = elf.map_err(|error| unusable(error.to_string()))?;
                    if foreign.is_some() {
                        check_image(&elf, &*emulation)
                            .map_err(|error| unusable(error.to_string()))?;
                    }
                    let messages = match foreign.is_none() && emulation.has_trace() {
                        false => None,
                        true => Table::parse(&elf)
                            .map_err(|error| unusable(error.to_string()))?
                            .map(Arc::new),
                    };
                    let listener = listening_robot(scenario, &*group.model, &*emulation)?;
                    let (model, place) = (group.model.clone(), place.clone());
                    let is_image = foreign.is_some();
                    all.push(Firmware { model, path, place, messages, is_image, robots, listener });
                    all.len() - 1
                }
            };
            let known = &mut all[known];
            for within in 0..group.count as u16 {
                let mut sections = shared.clone();
                if foreign.is_none() {
                    sections.extend(emulation.id_section(robot, group.first_id + within));
                }
                let number = first + usize::from(within);
                let door = foreign.and_then(|section| section.door.as_ref());
                let door = door.map(|door| (door.port(within), door.place.clone()));
                known.robots.push(Flashed { number, sections, model: group.model.clone(), door });
            }
        }
        Ok(all)
    }

    /// Returns the model of the robots that run it.
    pub fn model(&self) -> &dyn RobotModel {
        &*self.model
    }

    /// Returns the scenario's numbers of the robots that run the firmware.
    pub fn numbers(&self) -> impl Iterator<Item = usize> {
        self.robots.iter().map(|robot| robot.number)
    }

    /// Returns an error at the place that names the firmware.
    pub fn failed(&self, cause: ScenarioCause) -> ScenarioError {
        ScenarioError { cause, place: Some(Box::new(self.place.clone())) }
    }
}

/// Checks that a foreign image can start on the chip of these robots.
fn check_image(elf: &[u8], emulation: &dyn Emulation) -> Result<(), FirmwareImageError> {
    let memory = emulation.image_memory().expect(EMULATED);
    FirmwareImage::parse(elf)?.check(&memory)
}

/// Returns the robot that listens for the scenario's bridge; `None` if there is no bridge, or if
/// robots of this model do not listen for one.
fn listening_robot(
    scenario: &Scenario,
    model: &dyn RobotModel,
    emulation: &dyn Emulation,
) -> Result<Option<ListeningRobot>, ScenarioError> {
    let Some(bridge) = scenario.bridge.as_ref().filter(|_| emulation.listener().is_some()) else {
        return Ok(None);
    };
    // No robot of the scenario sends by infrared.
    let Some(path) = &bridge.image else { return Ok(None) };
    let program = emulation.listener_flash(path).map_err(|reason| {
        let (robots, path) = (model.robots(), path.display().to_string());
        let cause = ScenarioCause::NoFirmware { robots, path, reason };
        ScenarioError { cause, place: Some(Box::new(bridge.place.clone())) }
    })?;
    Ok(Some(ListeningRobot { program, at: bridge.at }))
}

/// Returns the reason why an emulator cannot be used.
pub fn unusable(error: ClientError) -> ScenarioCause {
    match error {
        ClientError::NoProgram { program, source } => {
            ScenarioCause::NoEmulatorProgram { program, reason: source.to_string() }
        }
        error => ScenarioCause::Emulator { message: error.to_string() },
    }
}

/// A reason why a run with emulated robots cannot go on.
#[derive(Debug)]
pub enum FirmwareError {
    /// The emulator process has ended, or rejects a command.
    Emulator(ClientError),
    /// A robot's firmware has failed.
    Failed {
        /// Id of the robot.
        robot: u16,
        /// Time since power-on.
        at: Duration,
        failure: FirmwareFailure,
    },
}

/// A failure of firmware.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum FirmwareFailure {
    /// The chip was reset.
    Reset {
        /// The cause.
        cause: String,
    },
    /// The firmware did something that the chip does not allow.
    Hardware {
        /// The emulator's description.
        text: String,
    },
    /// A fault occurred in the fault handler of the processor.
    Lockup {
        /// The program counter.
        pc: u32,
    },
    /// The firmware rejects the script.
    Refused(ImageError),
    /// A robot whose memory is too small for the verifier rejects the script, because the script
    /// was made for another robot or program.
    Unsuitable,
}

impl fmt::Display for FirmwareError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            FirmwareError::Emulator(error) => error.fmt(f),
            FirmwareError::Failed { robot, at, failure } => {
                write!(
                    f,
                    "the firmware of robot {robot} has failed at {:.6} s: ",
                    at.as_secs_f64()
                )?;
                failure.fmt(f)
            }
        }
    }
}

impl fmt::Display for FirmwareFailure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            FirmwareFailure::Reset { cause } => write!(f, "the chip was reset ({cause})"),
            FirmwareFailure::Hardware { text } => f.write_str(text),
            FirmwareFailure::Lockup { pc } => {
                write!(f, "the core is locked up at {pc:#010x}: a fault while it handled a fault")
            }
            FirmwareFailure::Unsuitable => {
                write!(f, "the script was made for another robot or program")
            }
            FirmwareFailure::Refused(cause) => write!(f, "the script {}", refusal::sentence(cause)),
        }
    }
}

impl std::error::Error for FirmwareError {}

impl From<ClientError> for FirmwareError {
    fn from(error: ClientError) -> Self {
        FirmwareError::Emulator(error)
    }
}
