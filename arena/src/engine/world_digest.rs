//! The digest of a world.

use core::hash::{Hash, Hasher};

use super::brain::Brain;
use super::digest::Digest;
use super::herd::Cohort;
use super::robot::EngineRobot;
use super::world::World;

impl<B: Brain> World<B> {
    /// Returns a digest of the whole state except the brains. Worlds with the same history have the
    /// same digest.
    #[must_use]
    pub fn digest(&self) -> u64 {
        let mut digest = Digest::new();
        self.add_to(&mut digest);
        digest.finish()
    }

    /// Adds the state that determines how the world continues, except the brains. Scratch memory of
    /// a tick is left out.
    pub(crate) fn add_to(&self, digest: &mut Digest) {
        (self.now, self.settings.seed, self.substeps).hash(digest);
        self.statistics.hash(digest);
        digest.float(self.settings.ambient_light);
        for ((pose, estimate), robot) in self.poses.iter().zip(&self.estimates).zip(&self.robots) {
            let EngineRobot { herd, cohort, radio, state, led, crashes } = robot;
            digest.pose(pose);
            estimate.is_some().hash(digest);
            estimate.iter().for_each(|estimate| digest.pose(estimate));
            (herd.0, cohort, state, led, crashes).hash(digest);
            radio.add_to(digest);
        }
        for Cohort { herd, first, count, block, .. } in &self.cohorts {
            (herd.0, first, count).hash(digest);
            digest.text_of(block);
        }
        self.stations.iter().for_each(|station| station.add_to(digest));
        digest.text_of(&self.obstacles.all());
        self.ground.iter().for_each(|ground| digest.text_of(&ground.environment));
        digest.text_of(&self.lights);
        self.crowd.add_to(digest);
        self.air.iter().for_each(|air| air.add_to(digest));
        digest.text_of(&self.topology);
    }
}
