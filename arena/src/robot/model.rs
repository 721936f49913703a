//! The interface between the simulator and a robot.

use std::any::Any;
use std::sync::Arc;

use bittybuzz_robot_spec::Function;

use crate::engine::{BodyModel, Media};
use crate::scenario::Section;
use crate::scenario::keys::SectionKeys;

use super::call::{Autopilot, Effect};
use super::emulation::Emulation;

/// A robot that scenarios can have: its body and sensors ([`BodyModel`]), the effects of its functions, the numbers of its link,
/// and its emulator. Its numbers are those of the real robot, until a scenario's section changes them.
pub trait RobotModel: BodyModel + Any {
    /// Returns the word by which scenarios know it: `body = "NAME"`, `[body.NAME]`.
    fn name(&self) -> &'static str;

    /// Returns the names of the robot files whose robots have this body.
    fn robots(&self) -> &'static [&'static str];

    /// Returns its keys in scenarios.
    fn keys(&self) -> &'static ModelKeys;

    /// Returns the robot with the numbers of a section, and its own where the section has none.
    fn read(&self, section: &Section<'_>) -> Arc<dyn RobotModel>;

    /// Changes the numbers of the media of all robots, where those of the robot include them.
    fn set_media(&self, media: &mut Media) {
        let _ = media;
    }

    /// Changes the numbers of the media of one group, where its link is part of the robot.
    fn set_own_media(&self, media: &mut Media) {
        let _ = media;
    }

    /// Returns the number of instructions that it executes in a tick, about. More are not executed in one tick even by a fast
    /// robot, so that a script that never ends does not stop the world.
    fn budget(&self) -> u16 {
        60_000
    }

    /// Returns the effect of a function of its robot file; `None` if it has none here.
    fn effect(&self, function: &Function) -> Option<Effect>;

    /// Returns the part of its firmware that carries functions out between two steps of the script.
    fn autopilot(&self) -> Option<Box<dyn Autopilot>> {
        None
    }

    /// Returns how emulators play it; `None` if none does.
    fn emulation(&self) -> Option<Arc<dyn Emulation>> {
        None
    }
}

/// The robots that scenarios can have.
pub type Models = [Arc<dyn RobotModel>];

/// The keys of a robot in scenarios, and the names that messages give its sections.
#[derive(Debug, Clone, Copy)]
pub struct ModelKeys {
    /// `[body.NAME]`.
    pub body: SectionKeys,
    /// The robots in plural, such as `the Kilobots`.
    pub robots: &'static str,
    /// `model` of a group.
    pub model: &'static str,
    /// Keys of `body` that `model` has not: robots of a kind are of one size.
    pub world_only: &'static [&'static str],
    /// `link` of a group.
    pub link: &'static str,
}

impl ModelKeys {
    /// Returns the names of the keys of a section of the robot; `None` if it is not one of its sections.
    pub(crate) fn of(&self, section: &str) -> Option<Vec<&'static str>> {
        let without = match section {
            _ if section == self.body.name => &[][..],
            _ if section == self.model => self.world_only,
            _ => return None,
        };
        let names = self.body.keys.iter().map(|key| key.name);
        Some(names.filter(|name| !without.contains(name)).collect())
    }
}
