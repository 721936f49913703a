//! The interface between the simulator and a robot.

use std::any::Any;
use std::sync::Arc;

use bittybuzz_robot_spec::RobotFunction;

use crate::engine::{BodyModel, Media};
use crate::scenario::Section;
use crate::scenario::keys::SectionKeys;

use super::call::{Autopilot, Effect};
use super::emulation::Emulation;

/// A key of a scenario that describes the surroundings of robots.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurroundingsKey {
    /// The name in the scenario.
    pub name: &'static str,
    /// The number in the scenario.
    pub value: f32,
    /// The unit, if the number has one.
    pub unit: &'static str,
}

/// The form in which pictures show the body of a robot.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Glyph {
    /// A disc with a notch ahead, for robots of which only the size is known.
    #[default]
    Disc,
    /// A disc on three legs, of which one is ahead.
    Legs,
    /// A disc between two wheels.
    Wheels,
    /// A frame with a rotor at the end of each of its four arms. Such robots fly.
    Rotors,
}

/// A robot that scenarios can use: its body and sensors ([`BodyModel`]), the effects of its
/// functions, the parameters of its link, and its emulator. The parameters are those of the real
/// robot unless a section of the scenario changes them.
pub trait RobotModel: BodyModel + Any {
    /// Returns the name of the model in scenarios: `body = "NAME"`, `[body.NAME]`.
    fn name(&self) -> &'static str;

    /// Returns the names of the robot files that use this model.
    fn robots(&self) -> &'static [&'static str];

    /// Returns the keys of the model in scenarios.
    fn keys(&self) -> &'static ModelKeys;

    /// Returns the model with the parameters of a section. Where the section has none, the
    /// parameters stay the same.
    fn read(&self, section: &Section<'_>) -> Arc<dyn RobotModel>;

    /// Changes the media parameters of all robots that this model defines, if there are any.
    fn set_media(&self, media: &mut Media) {
        let _ = media;
    }

    /// Changes the media parameters of one group, if the link is part of the robot.
    fn set_own_media(&self, media: &mut Media) {
        let _ = media;
    }

    /// Returns the approximate number of instructions that the robot executes in a tick. Even a
    /// fast robot does not execute more in one tick, so that a script that never ends does not stop
    /// the world.
    fn budget(&self) -> u16 {
        60_000
    }

    /// Returns the effect of a function of the robot file; `None` if it has no effect in the
    /// simulator.
    fn effect(&self, function: &RobotFunction) -> Option<Effect>;

    /// Returns the form in which pictures show the robots.
    fn glyph(&self) -> Glyph {
        Glyph::Disc
    }

    /// Returns the mean velocity along x and y in mm/s of the air that the robots feel; `None` if they feel
    /// none, or only calm air.
    fn wind_mm_s(&self) -> Option<[f32; 2]> {
        None
    }

    /// Returns the keys of a scenario by which the surroundings of these robots differ from usual ones.
    fn unusual_surroundings(&self) -> Vec<SurroundingsKey> {
        Vec::new()
    }

    /// Returns the model of robots with these settings in their flash, by name; `None` if it knows
    /// nothing of settings, which then have an effect in the firmware only.
    fn with_settings(&self, settings: &[(&str, u16)]) -> Option<Arc<dyn RobotModel>> {
        let _ = settings;
        None
    }

    /// Returns the lower and the upper corner in mm of the box that the robots do not leave in flight;
    /// coordinates without a limit are infinite. `None` if there is no such box.
    fn fence_mm(&self) -> Option<[[f32; 3]; 2]> {
        None
    }

    /// Returns true if the robots get poses from a source outside of them, which can be wrong.
    fn has_outside_poses(&self) -> bool {
        false
    }

    /// Returns the part of the firmware that executes functions between two steps of the script.
    fn autopilot(&self) -> Option<Box<dyn Autopilot>> {
        None
    }

    /// Returns the interface to the emulators of the robot; `None` if there are none.
    fn emulation(&self) -> Option<Arc<dyn Emulation>> {
        None
    }
}

/// The robots that scenarios can have.
pub type Models = [Arc<dyn RobotModel>];

/// The keys of a robot in scenarios, and the names that messages give its sections.
#[derive(Debug, Clone, Copy)]
pub struct ModelKeys {
    /// Keys of the section `[body.NAME]`.
    pub body: SectionKeys,
    /// The robots in plural, such as `the Kilobots`.
    pub robots: &'static str,
    /// Name of the `model` section of a group.
    pub model: &'static str,
    /// Keys of `body` that `model` does not have, because all robots of a kind have the same size.
    pub world_only: &'static [&'static str],
    /// Name of the `link` section of a group.
    pub link: &'static str,
}

impl ModelKeys {
    /// Returns the names of the keys of a section of the robot; `None` if it is not one of its sections.
    pub(crate) fn names_in(&self, section: &str) -> Option<Vec<&'static str>> {
        let without = match section {
            _ if section == self.body.name => &[][..],
            _ if section == self.model => self.world_only,
            _ => return None,
        };
        let names = self.body.keys.iter().map(|key| key.name);
        Some(names.filter(|name| !without.contains(name)).collect())
    }
}
