//! Robots whose bodies move in their emulator.

use std::sync::Arc;

use bittybuzz_robot_spec::RobotFunction;

use crate::engine::{
    Bodies, Body, BodyBlock, BodyModel, BodySize, Media, Medium, Pose, SettingsError, Stream,
};
use crate::scenario::Section;

use super::call::Effect;
use super::emulation::Emulation;
use super::model::{Glyph, ModelKeys, RobotModel, SurroundingsKey};

/// A model of robots that the emulator places: their bodies do not move by themselves, and neither
/// walls nor contacts are felt there. Script functions, positions and surroundings have no part in
/// it.
#[derive(Debug)]
pub struct HeldRobot {
    of: Arc<dyn RobotModel>,
    crash_speed_mm_s: Option<f32>,
}

impl HeldRobot {
    /// Returns such robots with the shape and the medium of another model. A contact in the world is
    /// no crash, because their emulator does not know of it.
    pub fn new(of: Arc<dyn RobotModel>) -> Self {
        HeldRobot { of, crash_speed_mm_s: None }
    }

    /// Returns such robots that crash in the world as those of the other model.
    pub fn that_crash(of: Arc<dyn RobotModel>) -> Self {
        let crash_speed_mm_s = of.crash_speed_mm_s();
        HeldRobot { of, crash_speed_mm_s }
    }
}

impl BodyModel for HeldRobot {
    fn shape(&self) -> BodySize {
        self.of.shape()
    }

    fn top_speed_mm_s(&self) -> f32 {
        self.of.top_speed_mm_s()
    }

    fn medium(&self) -> Medium {
        self.of.medium()
    }

    fn has_positioning(&self) -> bool {
        false
    }

    fn crash_speed_mm_s(&self) -> Option<f32> {
        self.crash_speed_mm_s
    }

    fn check(&self) -> Result<(), SettingsError> {
        self.of.check()
    }

    fn block(&self, substep_s: f32) -> Box<dyn BodyBlock> {
        Box::new(Bodies::<HeldBody>::new((), substep_s))
    }
}

impl RobotModel for HeldRobot {
    fn name(&self) -> &'static str {
        self.of.name()
    }

    fn robots(&self) -> &'static [&'static str] {
        self.of.robots()
    }

    fn keys(&self) -> &'static ModelKeys {
        self.of.keys()
    }

    fn read(&self, section: &Section<'_>) -> Arc<dyn RobotModel> {
        let of = self.of.read(section);
        let crash_speed_mm_s = self.crash_speed_mm_s.and(of.crash_speed_mm_s());
        Arc::new(HeldRobot { of, crash_speed_mm_s })
    }

    fn set_media(&self, media: &mut Media) {
        self.of.set_media(media);
    }

    fn set_own_media(&self, media: &mut Media) {
        self.of.set_own_media(media);
    }

    fn effect(&self, function: &RobotFunction) -> Option<Effect> {
        self.of.effect(function)
    }

    fn glyph(&self) -> Glyph {
        self.of.glyph()
    }

    fn unusual_surroundings(&self) -> Vec<SurroundingsKey> {
        self.of.unusual_surroundings()
    }

    fn fence_mm(&self) -> Option<[[f32; 3]; 2]> {
        self.of.fence_mm()
    }

    fn emulation(&self) -> Option<Arc<dyn Emulation>> {
        self.of.emulation()
    }
}

/// A body that stays where the emulator places it.
#[derive(Clone, Debug, Default)]
struct HeldBody {
    /// There is nothing to command.
    controls: (),
}

impl Body for HeldBody {
    type Numbers = ();
    type Step = ();
    type Controls = ();

    fn new(_: &(), _: &Pose, _: &mut Stream) -> Self {
        HeldBody::default()
    }

    fn prepare(_: &(), _: f32) {}

    fn controls(&mut self) -> &mut () {
        &mut self.controls
    }

    fn halt(&mut self) {}

    fn step(&mut self, _: &mut Pose, (): &()) {}
}
