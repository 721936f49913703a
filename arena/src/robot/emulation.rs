//! The interface between the simulator and the emulators of a robot.

use std::fmt::Debug;
use std::path::Path;
use std::time::Duration;

use bittybuzz_compiler::{fit, refusal};
use bittybuzz_emulation::message::{Command, EmulatorEvent, RobotStatistics};
use bittybuzz_emulation::{ClientError, Emulator, MemoryMap};
use bittybuzz_robot_spec::{Layout, Robot};

use crate::engine::{LinkStatistics, Loss, Media, Pose, RobotView};
use crate::scenario::ScenarioCause;

/// The parameters and conversions with which emulators run a robot.
pub trait Emulation: Debug + Send + Sync {
    /// Returns the emulator program that is used if none is named: the fastest one.
    fn program(&self) -> &'static str;

    /// Returns the robot's name for an emulator program that runs all robots of the kind together;
    /// `None` if each robot has a program of its own.
    fn shared_program_robot(&self) -> Option<&'static str>;

    /// Returns the largest number of robots that can be emulated.
    fn robots_max(&self) -> u32;

    /// Returns the path of the firmware file that cargo builds, relative to the root of the
    /// repository; `None` if a robot with that robot file cannot be emulated.
    fn image(&self, robot: &Robot) -> Option<&'static str>;

    /// Returns the path of the program with which a robot listens for a bridge, as cargo builds it,
    /// relative to the root of the repository.
    fn listener(&self) -> Option<&'static str> {
        None
    }

    /// Returns the content of the flash, from address 0 on, for a listener with the program at
    /// `path`.
    fn listener_flash(&self, path: &Path) -> Result<Vec<u8>, String> {
        let _ = path;
        Ok(Vec::new())
    }

    /// Returns true if the firmware reports with defmt over RTT.
    fn has_trace(&self) -> bool;

    /// Returns true if the completion of each step of the script is observable.
    fn counts_steps(&self) -> bool {
        false
    }

    /// Returns true if the emulator can switch robots off and on.
    fn has_switch(&self) -> bool {
        true
    }

    /// Returns the place of the world's middle in the emulator's frame, in mm.
    fn origin(&self) -> [f64; 2] {
        [0.0; 2]
    }

    /// Returns false if the robot needs the light of a projector and there is none at this pose.
    fn is_lit(&self, pose: &Pose) -> bool {
        let _ = pose;
        true
    }

    /// Returns the longest time that robots run at once before the emulator and the world exchange
    /// positions and motions.
    fn exchange_period(&self) -> Duration;

    /// Returns the parts of memory that all robots of a group share, as addresses and bytes.
    fn sections(&self, flash: &FlashJob<'_>) -> Result<Vec<(u32, Vec<u8>)>, ScenarioCause> {
        layout_section(flash)
    }

    /// Returns the part of memory that holds a robot's id, as address and bytes.
    fn id_section(&self, robot: &Robot, id: u16) -> Option<(u32, Vec<u8>)> {
        let region = robot.layout.as_ref()?.id?;
        Some((region.address, Layout::id_section(id).to_vec()))
    }

    /// Returns the commands for a robot before it runs; `number` counts the robots of its kind.
    fn set_up(&self, number: usize, seed: u64, media: &Media) -> Vec<Command> {
        let _ = (number, seed, media);
        Vec::new()
    }

    /// Returns the command that sets up the radio channel between all robots before they run.
    fn air(&self, media: &Media, seed: u64) -> Option<Command> {
        let _ = (media, seed);
        None
    }

    /// Returns the share of packets that the emulator must lose to reproduce a loss of the medium.
    fn loss(&self, loss: Loss) -> f64 {
        loss.near.into()
    }

    /// Returns the memory of the chip, if the emulator gives robots a body, so that they can run
    /// any image for that chip; `None` if only the project's firmware runs.
    fn image_memory(&self) -> Option<MemoryMap> {
        None
    }

    /// Returns true if the robots fly in the emulator with the project's firmware: [`Self::body`] gives
    /// them a body there.
    fn flies(&self) -> bool {
        false
    }

    /// Returns the height in mm of the point that the emulator reports as the robot's position, above
    /// the ground on which the robot stands.
    fn standing_mm(&self) -> f32 {
        0.0
    }

    /// Returns the keys of the model that robots which fly in the emulator do not support.
    fn unsupported_in_flight(&self) -> Vec<&'static str> {
        Vec::new()
    }

    /// Returns the command that gives a robot that flies the range finders of [`Self::ranges`].
    fn range_finders(&self) -> Option<Command> {
        None
    }

    /// Returns the command by which a person permits a robot to fly, which is repeated until the
    /// robot answers; `None` if no person does.
    fn permission(&self) -> Option<Command> {
        None
    }

    /// Returns true if the event is the answer of a robot that accepts the permission.
    fn is_permitted(&self, event: &EmulatorEvent) -> bool {
        let _ = event;
        false
    }

    /// Returns the command with the distances in mm to the front, left, back and right that a flying
    /// robot measures; `None` for nothing in reach. It is sent whenever it changes.
    fn ranges(&self, distances_mm: [Option<f32>; 4]) -> Option<Command> {
        let _ = distances_mm;
        None
    }

    /// Returns the commands that give a robot its equipment and a body that stands at this pose.
    fn body(&self, pose: &Pose, seed: u64) -> Vec<Command> {
        let _ = (pose, seed);
        Vec::new()
    }

    /// Starts the programs of robots that were just switched on.
    fn start(&self, emulator: &mut Emulator, now: Duration) -> Result<(), ClientError> {
        let _ = (emulator, now);
        Ok(())
    }

    /// Returns the command that updates the sensors of the robot in the emulator. It is sent
    /// whenever it changes. `light` is the reading of the light sensor.
    fn sense(&self, view: &RobotView, light: u16) -> Option<Command> {
        let _ = (view, light);
        None
    }

    /// Returns the duties of the left and the right motor in percent. `inputs` are the duties, 0 to
    /// 1, of the inputs of the motor drivers.
    fn duties(&self, inputs: [f64; 4]) -> [f32; 2] {
        let [a, b, c, d] = inputs;
        [b - a, d - c].map(|duty| (100.0 * duty) as f32)
    }

    /// Adds the packet counts of a robot to those of its medium. Returns the number of packets for
    /// which its radio had no room.
    fn count(&self, statistics: &RobotStatistics, links: &mut LinkStatistics) -> u64;
}

/// A script that is to be flashed.
#[derive(Debug)]
pub struct FlashJob<'a> {
    /// The firmware's file.
    pub firmware: &'a Path,
    /// The script's image.
    pub script: &'a [u8],
    /// The robot's file.
    pub robot: &'a Robot,
    /// Parameters of the media.
    pub media: &'a Media,
}

/// Returns the section of the script, address and bytes, as the layout of its robot defines it. A
/// robot without a layout has no section.
pub fn layout_section(flash: &FlashJob<'_>) -> Result<Vec<(u32, Vec<u8>)>, ScenarioCause> {
    let FlashJob { robot, script, .. } = flash;
    let script = fit::for_flash(script, robot)
        .map_err(|cause| ScenarioCause::ScriptRefused { reason: refusal::sentence(&cause) })?;
    let section = |layout: &Layout| match layout.script_section(&script) {
        Some(section) => Ok((layout.script.address, section)),
        None => {
            Err(ScenarioCause::ScriptTooLong { bytes: script.len(), most: layout.most_script() })
        }
    };
    robot.layout.iter().map(section).collect()
}
