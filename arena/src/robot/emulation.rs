//! The interface between the simulator and an emulator's view of a robot.

use std::fmt::Debug;
use std::path::Path;
use std::time::Duration;

use bittybuzz_emulation::message::{Command, Statistics};
use bittybuzz_emulation::{ClientError, Emulator};
use bittybuzz_robot_spec::{Layout, Robot};

use crate::engine::{LinkStatistics, Loss, Media, Pose, View};
use crate::scenario::Cause;

/// The way in which emulators play a robot.
pub trait Emulation: Debug + Send + Sync {
    /// Returns the program that plays it if none is named: the fastest.
    fn program(&self) -> &'static str;

    /// Returns the robot's name for a program that plays all robots of the kind; `None` if each has a program of its own.
    fn shared_as(&self) -> Option<&'static str>;

    /// Returns the most robots that are played.
    fn most(&self) -> u32;

    /// Returns the file that cargo makes of its firmware, from the root of the repository; `None` if a robot with that file
    /// cannot be played.
    fn image(&self, robot: &Robot) -> Option<&'static str>;

    /// Returns the file that cargo makes of the program by which a robot listens for a bridge, from the root of the repository.
    fn listener(&self) -> Option<&'static str> {
        None
    }

    /// Returns the flash of a listener with that program, from address 0 on.
    fn listener_flash(&self, path: &Path) -> Result<Vec<u8>, String> {
        let _ = path;
        Ok(Vec::new())
    }

    /// Returns true if the firmware reports by defmt over RTT.
    fn has_trace(&self) -> bool;

    /// Returns true if it is known when a step of the script is completed.
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

    /// Returns false at a place without the light of a projector that the robot needs.
    fn is_lit(&self, pose: &Pose) -> bool {
        let _ = pose;
        true
    }

    /// Returns the longest time that robots run before a change of their motion reaches the emulator.
    fn look(&self) -> Duration;

    /// Returns the parts of memory that all robots of a group share, as addresses and bytes.
    fn sections(&self, flash: &Flash<'_>) -> Result<Vec<(u32, Vec<u8>)>, Cause> {
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

    /// Returns the command for the air between all robots before they run.
    fn air(&self, media: &Media, seed: u64) -> Option<Command> {
        let _ = (media, seed);
        None
    }

    /// Returns the share of packets that the emulator loses for a loss of the medium.
    fn loss(&self, loss: Loss) -> f64 {
        loss.near.into()
    }

    /// Lets the programs of robots run that have power since a moment ago.
    fn start(&self, emulator: &mut Emulator, now: Duration) -> Result<(), ClientError> {
        let _ = (emulator, now);
        Ok(())
    }

    /// Returns the command by which a robot senses its surroundings; it is sent when it changes. `light` is the reading of the
    /// light sensor.
    fn sense(&self, view: &View, light: u16) -> Option<Command> {
        let _ = (view, light);
        None
    }

    /// Returns the duties of the left and of the right motor in percent, from the duties of the inputs of their drivers, 0 to 1.
    fn duties(&self, inputs: [f64; 4]) -> [f32; 2] {
        let [a, b, c, d] = inputs;
        [b - a, d - c].map(|duty| (100.0 * duty) as f32)
    }

    /// Adds the packets of a robot to those of its medium; returns how many found its radio full.
    fn count(&self, statistics: &Statistics, links: &mut LinkStatistics) -> u64;
}

/// A script that is to be flashed.
#[derive(Debug)]
pub struct Flash<'a> {
    /// The firmware's file.
    pub firmware: &'a Path,
    /// The script's image.
    pub script: &'a [u8],
    /// The robot's file.
    pub robot: &'a Robot,
    /// Numbers of the media.
    pub media: &'a Media,
}

/// Returns a script as the layout of its robot has it: address and bytes; nothing for a robot without a layout.
pub fn layout_section(flash: &Flash<'_>) -> Result<Vec<(u32, Vec<u8>)>, Cause> {
    let Flash { robot, script, .. } = flash;
    let section = |layout: &Layout| match layout.script_section(script) {
        Some(section) => Ok((layout.script.address, section)),
        None => Err(Cause::ScriptTooLong { bytes: script.len(), most: layout.most_script() }),
    };
    robot.layout.iter().map(section).collect()
}
