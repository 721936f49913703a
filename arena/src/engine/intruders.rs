//! Operations on the intruders of a world.

use super::TICK_US;
use super::brain::Brain;
use super::error::AddError;
use super::herd::Herd;
use super::id::RobotId;
use super::intruder::{Intruder, IntruderSettings, Station};
use super::link::{Barriers, Ether, LinkSettings, Medium};
use super::shadow::Shadows;
use super::stream::{Stream, StreamPurpose};
use super::world::World;

impl<B: Brain> World<B> {
    /// Adds an intruder, which sends from now on. `make` gets random numbers of its own.
    pub fn add_intruder(
        &mut self,
        settings: IntruderSettings,
        make: impl FnOnce(Stream) -> Box<dyn Intruder>,
    ) -> Result<(), AddError> {
        let IntruderSettings { pose, herd, range_mm, .. } = settings;
        let Some(Herd { medium, media, link, .. }) = self.herds.get(usize::from(herd.0)) else {
            return Err(AddError::UnknownHerd);
        };
        if !pose.is_finite() || !self.settings.area.contains(pose.x, pose.y) {
            return Err(AddError::Outside);
        }
        if self.brains.len() + self.stations.len() > usize::from(u16::MAX) {
            return Err(AddError::TooMany);
        }
        let id = RobotId(u16::MAX - self.stations.len() as u16);
        let (medium, media) = (*medium, *media);
        let air = &mut self.air[medium as usize];
        if !air.has_room() {
            return Err(AddError::TooMany);
        }
        // The loss may have changed since the herd was added.
        let (of_herd, bodies_mm) = (*air.link(*link), air.bodies_mm(*link));
        let link = LinkSettings { range: range_mm.or(of_herd.range), ..of_herd };
        let link = air.add_link(link, bodies_mm, self.settings.area);
        let stream = Stream::new(self.settings.seed, StreamPurpose::Intruder, id.0, 0);
        let begin_us = self.now * u64::from(TICK_US);
        let sender = (id, medium, media, link);
        self.stations.push(Station::new(sender, &settings, begin_us, stream, make));
        Ok(())
    }

    /// Returns the number of intruders that have been added.
    #[must_use]
    pub fn intruder_count(&self) -> usize {
        self.stations.len()
    }

    /// Lets intruders receive the frames that ended in the last tick.
    pub(crate) fn overhear(&mut self) {
        let World { stations, air, topology, obstacles, crowd, calibration, .. } = self;
        let (seed, now) = (self.settings.seed, self.now);
        let shadows = Shadows { obstacles, movables: &crowd.movables };
        let barriers = Barriers { topology, shadows };
        for station in stations.iter_mut().filter(|station| station.is_active(now)) {
            let ether =
                |medium: Medium| Ether { air: &air[medium as usize], barriers, calibration };
            station.overhear(ether, seed, now);
        }
    }
}
