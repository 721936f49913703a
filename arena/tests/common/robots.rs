//! A world of the robots that ship, whose numbers tests vary.

use core::ops::{Deref, DerefMut};
use std::sync::Arc;

use bittybuzz_arena::engine::{
    self, AddError, Area, Brain, HerdId, Infrared, Media, Medium, Nrf24Medium, P2p, Pose, RobotId,
    SettingsError,
};
use bittybuzz_crazyflie_model::CrazyflieModel;
use bittybuzz_kilobot_model::{KilobotModel, Preset};
use bittybuzz_zooids_model::ZooidModel;

/// A robot that ships.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RobotKind {
    Kilobot,
    Zooid,
    Crazyflie,
}

impl RobotKind {
    pub fn medium(self) -> Medium {
        match self {
            RobotKind::Kilobot => Medium::Infrared,
            RobotKind::Zooid => Medium::Nrf24,
            RobotKind::Crazyflie => Medium::P2p,
        }
    }
}

/// Numbers of a world, and of the robots and the links in it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    pub seed: u64,
    pub threads: usize,
    pub area: Area,
    pub kilobot: KilobotModel,
    pub zooid: ZooidModel,
    pub crazyflie: CrazyflieModel,
    pub infrared: Infrared,
    pub nrf24: Nrf24Medium,
    pub p2p: P2p,
    pub ambient_light: f32,
}

impl Default for Settings {
    fn default() -> Self {
        let engine::WorldSettings { seed, threads, area, ambient_light } =
            engine::WorldSettings::default();
        let Media { infrared, nrf24, p2p, .. } = Media::STANDARD;
        Settings {
            seed,
            threads,
            area,
            kilobot: KilobotModel::STANDARD,
            zooid: ZooidModel::STANDARD,
            crazyflie: CrazyflieModel::STANDARD,
            infrared,
            nrf24,
            p2p,
            ambient_light,
        }
    }
}

impl Settings {
    pub fn preset(&mut self, preset: Preset) {
        (self.kilobot, self.infrared) = (preset.model(), preset.infrared());
    }
}

/// Numbers that were added to a world.
#[derive(Clone, Copy, Debug)]
pub struct Variant(usize);

impl Variant {
    pub const STANDARD: Variant = Variant(0);
}

/// A world with a herd of every kind.
#[derive(Debug)]
pub struct World<B> {
    world: engine::World<B>,
    /// Of each variant, in the order of [`RobotKind`].
    pub herds: Vec<[HerdId; 3]>,
}

impl<B: Brain> World<B> {
    pub fn new(settings: Settings) -> Result<Self, SettingsError> {
        let Settings { seed, threads, area, ambient_light, .. } = settings;
        let world =
            engine::World::new(engine::WorldSettings { seed, threads, area, ambient_light })?;
        let mut world = World { world, herds: Vec::new() };
        world.add_variant(settings)?;
        Ok(world)
    }

    pub fn add_variant(&mut self, settings: Settings) -> Result<Variant, SettingsError> {
        let Settings { kilobot, zooid, crazyflie, infrared, nrf24, p2p, .. } = settings;
        let media = Media { infrared, nrf24, p2p, ..Media::STANDARD };
        let herds = [
            self.world.add_herd(Arc::new(kilobot), media)?,
            self.world.add_herd(Arc::new(zooid), media)?,
            self.world.add_herd(Arc::new(crazyflie), media)?,
        ];
        self.herds.push(herds);
        Ok(Variant(self.herds.len() - 1))
    }

    pub fn add(&mut self, kind: RobotKind, pose: Pose, brain: B) -> Result<RobotId, AddError> {
        self.add_as(Variant::STANDARD, kind, pose, brain)
    }

    pub fn add_as(
        &mut self,
        Variant(variant): Variant,
        kind: RobotKind,
        pose: Pose,
        brain: B,
    ) -> Result<RobotId, AddError> {
        self.world.add(self.herds[variant][kind as usize], pose, brain)
    }
}

impl<B> Deref for World<B> {
    type Target = engine::World<B>;

    fn deref(&self) -> &engine::World<B> {
        &self.world
    }
}

impl<B> DerefMut for World<B> {
    fn deref_mut(&mut self) -> &mut engine::World<B> {
        &mut self.world
    }
}
