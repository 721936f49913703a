//! Robots that run their firmware: programs emulate them, and they move as their motors' signals say.

mod bridge;
mod fleet;
mod fleets;
mod p2p;
mod room;
mod table;
mod told;
mod trailing;

use std::fmt;
use std::path::PathBuf;
use std::time::Duration;

use bittybuzz_compiler::refusal;
use bittybuzz_emulation::message::PowerDetector;
use bittybuzz_emulation::{AVR_FLASH_SIZE, ClientError, Image};
use bittybuzz_kilobot::calibration;
use bittybuzz_robot_spec::{Layout, Robot};
use bittybuzz_toml_reader::{Place, file};
use bittybuzz_trace_reader::Table;
use bittybuzz_vm_core::ImageError;

use crate::scenario::{Backend, Body, Cause, Scenario, ScenarioError};

use super::program::Program;
use super::settings::Numbers;
pub use bridge::Bridge;
pub use fleet::Fleet;
pub use fleets::Fleets;
pub use p2p::{P2pAir, TURN};
pub use table::is_lit;

/// What is flashed in a scenario to the robots of a kind: their firmware, and the script and the id of each.
pub struct Firmware {
    body: Body,
    path: PathBuf,
    /// Where the scenario asks for it first.
    place: Place,
    /// The texts of its messages; none if it tells nothing.
    messages: Option<Table>,
    robots: Vec<Flashed>,
    /// One more, of Kilobots.
    ear: Option<Ear>,
}

/// The Kilobot of a bridge.
struct Ear {
    /// What is in its flash, from address 0 on.
    program: Vec<u8>,
    /// Where it lies, in mm.
    at: [f64; 2],
}

/// What is written to one robot beside the firmware.
struct Flashed {
    /// Number of the robot.
    number: usize,
    /// Addresses and bytes.
    sections: Vec<(u32, Vec<u8>)>,
    light: Light,
    power_detector: PowerDetector,
}

/// How bad the projector's light is for a robot.
#[derive(Debug, Clone, Copy)]
struct Light {
    /// Share of frames that it does not see.
    lose: f64,
    /// Edges come up to so many µs too early or too late.
    jitter_us: f64,
    /// Glitches per second at each photodiode.
    glitches_per_s: f64,
}

impl Firmware {
    /// That of the scenario, for each kind of robots that run any.
    pub fn of(scenario: &Scenario, programs: &[Program]) -> Result<Vec<Self>, ScenarioError> {
        let mut all: Vec<Firmware> = Vec::new();
        let mut number = 0;
        for (group, program) in scenario.groups.iter().zip(programs) {
            let first = number;
            number += group.count as usize;
            let Backend::Firmware { image, place } = &group.backend else { continue };
            let failed = |cause| ScenarioError { cause, place: Some(Box::new(place.clone())) };
            let script = match &group.robot.layout {
                None => trailing::section(image, &program.image, &group.robot).map_err(failed)?,
                Some(layout) => {
                    let section = layout.script_section(&program.image).ok_or_else(|| {
                        failed(Cause::ScriptTooLong {
                            bytes: program.image.len(),
                            most: layout.most_script(),
                        })
                    })?;
                    (layout.script.address, section)
                }
            };
            let known = match all.iter().position(|known| known.body == group.body) {
                Some(known) => known,
                None => {
                    let (path, robots) = (image.clone(), Vec::new());
                    let unusable = |reason| {
                        failed(Cause::NoFirmware { path: path.display().to_string(), reason })
                    };
                    let elf = file::read(&path, file::MOST_PROGRAM);
                    let elf = elf.map_err(|error| unusable(error.to_string()))?;
                    let messages = match group.body {
                        Body::Kilobot => None,
                        _ => Table::parse(&elf).map_err(|error| unusable(error.to_string()))?,
                    };
                    let ear = ear(scenario, group.body)?;
                    let (body, place) = (group.body, place.clone());
                    all.push(Firmware { body, path, place, messages, robots, ear });
                    all.len() - 1
                }
            };
            let Some(known) = all.get_mut(known) else { continue };
            let shared = match group.body {
                Body::Kilobot => duties(scenario),
                Body::Zooid => range(scenario, &group.robot).map_err(failed)?.into_iter().collect(),
                Body::Crazyflie => Vec::new(),
            };
            let (own, all) = (group.model.zooid, scenario.bodies.zooid);
            let light = Light {
                lose: own.frame_loss.or(all.frame_loss).unwrap_or(0.0),
                jitter_us: own.edge_jitter.or(all.edge_jitter).unwrap_or(0.0),
                glitches_per_s: own.glitches.or(all.glitches).unwrap_or(0.0),
            };
            let power_detector = own.power_detector.or(all.power_detector);
            let power_detector = power_detector.unwrap_or(PowerDetector::Latched);
            for within in 0..group.count as u16 {
                let mut sections = vec![script.clone()];
                sections.extend(shared.clone());
                sections.extend(id_section(group.body, &group.robot, group.first_id + within));
                let number = first + usize::from(within);
                known.robots.push(Flashed { number, sections, light, power_detector });
            }
        }
        Ok(all)
    }

    /// What runs it.
    pub fn body(&self) -> Body {
        self.body
    }

    /// The numbers of the robots that run it.
    pub fn numbers(&self) -> impl Iterator<Item = usize> {
        self.robots.iter().map(|robot| robot.number)
    }

    /// What is wrong with robots that shall run it.
    pub fn failed(&self, cause: Cause) -> ScenarioError {
        ScenarioError { cause, place: Some(Box::new(self.place.clone())) }
    }
}

/// What is flashed to the Kilobot of the scenario's bridge.
fn ear(scenario: &Scenario, body: Body) -> Result<Option<Ear>, ScenarioError> {
    let Some(bridge) = scenario.bridge.as_ref().filter(|_| body == Body::Kilobot) else {
        return Ok(None);
    };
    let Some(path) = &bridge.image else { return Ok(None) };
    let program = Image::open_avr(path, AVR_FLASH_SIZE).map_err(|error| {
        let cause =
            Cause::NoFirmware { path: path.display().to_string(), reason: error.to_string() };
        ScenarioError { cause, place: Some(Box::new(bridge.place.clone())) }
    })?;
    Ok(Some(Ear { program: trailing::flash(&program), at: bridge.at }))
}

/// Why an emulator cannot be had.
pub fn unusable(error: ClientError) -> Cause {
    match error {
        ClientError::NoProgram { program, source } => {
            Cause::NoEmulatorProgram { program, reason: source.to_string() }
        }
        error => Cause::Emulator { message: error.to_string() },
    }
}

/// Where a Kilobot's EEPROM begins for its emulator.
const EEPROM: u32 = 0x81_0000;

/// Where a robot's id is: address and bytes.
fn id_section(body: Body, robot: &Robot, id: u16) -> Option<(u32, Vec<u8>)> {
    if body == Body::Kilobot {
        return Some((EEPROM + u32::from(calibration::ID), id.to_le_bytes().to_vec()));
    }
    let region = robot.layout.as_ref()?.id?;
    Some((region.address, Layout::id_section(id).to_vec()))
}

/// The duties that calibration has found for all Kilobots of a scenario: addresses and bytes.
fn duties(scenario: &Scenario) -> Vec<(u32, Vec<u8>)> {
    let model = Numbers::new(scenario).kilobot;
    let duties = [model.turn_duty, model.turn_duty, model.straight_duty, model.straight_duty];
    let cells = calibration::DUTIES.into_iter().zip(duties);
    cells.map(|(cell, duty)| (EEPROM + u32::from(cell), vec![duty])).collect()
}

/// What the scenario says that Zooids have in flash as a setting: address and bytes.
fn range(scenario: &Scenario, robot: &Robot) -> Result<Option<(u32, Vec<u8>)>, Cause> {
    let Some(range) = scenario.media.nrf24.range else { return Ok(None) };
    let setting = robot.settings.iter().position(|setting| setting.name == "range_mm");
    let region = robot.layout.as_ref().and_then(|layout| layout.settings);
    let (Some(place), Some(region)) = (setting, region) else {
        return Err(Cause::NotEmulated { key: "range" });
    };
    let mut values = vec![None; robot.settings.len()];
    // Farther than the setting goes is everybody.
    let range = Some(range.round()).filter(|range| *range <= f64::from(robot.settings[place].most));
    values[place] = range.map(|range| range as u16);
    Ok(Some((region.address, Layout::settings_section(&values))))
}

/// Why a run with emulated robots cannot go on.
#[derive(Debug)]
pub enum FirmwareError {
    /// The emulator is gone, or does not do what it is told to.
    Emulator(ClientError),
    /// A robot's firmware has failed.
    Failed {
        /// Id of the robot.
        robot: u16,
        /// Since power-on.
        at: Duration,
        /// How.
        failure: Failure,
    },
}

/// How firmware fails.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Failure {
    /// It was reset.
    Reset {
        /// By what.
        cause: String,
    },
    /// It does what the chip does not allow.
    Hardware {
        /// What.
        text: String,
    },
    /// A fault while it handled a fault.
    Lockup {
        /// Where.
        pc: u32,
    },
    /// It refuses the script.
    Refused(ImageError),
    /// A Kilobot refuses the script, which others have verified for it.
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

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Failure::Reset { cause } => write!(f, "the chip was reset ({cause})"),
            Failure::Hardware { text } => f.write_str(text),
            Failure::Lockup { pc } => {
                write!(f, "the core is locked up at {pc:#010x}: a fault while it handled a fault")
            }
            Failure::Unsuitable => write!(f, "the script was made for another robot or program"),
            Failure::Refused(cause) => write!(f, "the script {}", refusal::sentence(cause)),
        }
    }
}

impl std::error::Error for FirmwareError {}

impl From<ClientError> for FirmwareError {
    fn from(error: ClientError) -> Self {
        FirmwareError::Emulator(error)
    }
}
