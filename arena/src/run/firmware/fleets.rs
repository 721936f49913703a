//! All emulated robots of a run, and the bridge between different media. After each substep of the
//! world the emulators run up to the same time.

use std::time::Duration;

use bittybuzz_emulation::ClientError;

use crate::engine::{LinkStatistics, Loss, Medium, Pose, RobotId, TICK_US, World};
use crate::robot::{BatteryState, SimRobot};
use crate::run::event_queue::EventQueue;
use crate::run::settings::media;
use crate::run::setup::Setup;
use crate::scenario::{ScenarioCause, ScenarioError};

use super::bridge::Bridge;
use super::fleet::{EmulatedFleet, StartError};
use super::{EMULATED, FirmwareError, IN_WORLD, unusable};

/// The longest time that robots run before the bridge forwards their frames. The delay of the
/// bridge itself is longer.
const BRIDGE_EXCHANGE_PERIOD: Duration = Duration::from_micros(2500);

/// All emulated robots: one fleet for each model.
pub struct Fleets {
    fleets: Vec<EmulatedFleet>,
    bridge: Option<Bridge>,
    /// Time since power-on, which is also the time since the world began.
    now: Duration,
    /// The current tick, and the number of its substeps that are over. Robots that join may change
    /// the number of substeps per tick.
    tick: u64,
    substeps: u32,
}

impl Fleets {
    /// Powers on the emulated robots of a scenario; returns `None` if it has none.
    pub fn start(
        setup: &Setup,
        world: &World<SimRobot>,
        event_queue: &EventQueue,
        seed: u32,
    ) -> Result<Option<Self>, ScenarioError> {
        if setup.firmware.is_empty() {
            return Ok(None);
        }
        let join = |number| {
            let id = event_queue.id(number).expect("emulated robots are present at the start");
            (id, setup.id(number))
        };
        let mut fleets = Vec::new();
        for firmware in setup.firmware.iter() {
            let emulation = firmware.model().emulation().expect(EMULATED);
            let is_dark = |pose: &Pose| !emulation.is_lit(pose);
            let stands_in_the_dark = |id| is_dark(&world.robot(id).expect(IN_WORLD).pose);
            let mut robots = firmware.numbers().map(join);
            let in_the_dark = robots.find(|(id, _)| stands_in_the_dark(*id));
            if let Some((_, id)) = in_the_dark {
                return Err(firmware.failed(ScenarioCause::InTheDark { id }));
            }
            let (emulator, media) = (setup.emulator(firmware.model()), media(&setup.scenario));
            let fleet =
                EmulatedFleet::new(emulator, emulation, firmware, join, world, &media, seed.into());
            fleets.push(fleet.map_err(|error| match error {
                StartError::Emulator(error) => firmware.failed(unusable(error)),
                StartError::NoDoor { robot, place, error } => {
                    let cause = ScenarioCause::NoDoor { robot, reason: error.to_string() };
                    ScenarioError { cause, place: Some(Box::new(place)) }
                }
            })?);
        }
        let bridge = setup.scenario.bridge.as_ref().map(|bridge| Bridge::new(bridge.id));
        Ok(Some(Fleets { fleets, bridge, now: Duration::ZERO, tick: 0, substeps: 0 }))
    }

    /// Sets the loss of a medium from now on.
    pub fn lose(&mut self, medium: Medium, loss: Loss) -> Result<(), ClientError> {
        let mut on_it = self.fleets.iter_mut().filter(|fleet| fleet.medium() == medium);
        on_it.try_for_each(|fleet| fleet.lose(loss))
    }

    /// Sets the battery voltage of a robot, if it is emulated.
    pub fn set_battery(&mut self, id: RobotId, millivolts: u16) -> Result<(), ClientError> {
        self.fleets.iter_mut().try_for_each(|fleet| fleet.set_battery(id, millivolts))
    }

    /// Returns the battery of a robot that flies in an emulator.
    pub fn battery(&self, id: RobotId) -> Option<BatteryState> {
        self.fleets.iter().find_map(|fleet| fleet.battery(id))
    }

    /// Cuts a robot's power. [`settle`](Self::settle) restores it if the robot runs in the world.
    pub fn switch_off(&mut self, id: RobotId) -> Result<(), ClientError> {
        self.fleets.iter_mut().try_for_each(|fleet| fleet.switch_off(id))
    }

    /// Copies the state of the world to the emulators: a robot has power if it runs in the world,
    /// and does not receive robots that it is cut off from there.
    pub fn settle(&mut self, world: &World<SimRobot>) -> Result<(), ClientError> {
        self.fleets.iter_mut().try_for_each(|fleet| fleet.settle(world))
    }

    /// Runs all fleets and the bridge for one substep of the world.
    pub fn advance(&mut self, world: &mut World<SimRobot>) -> Result<(), FirmwareError> {
        if self.tick != world.now() {
            (self.tick, self.substeps) = (world.now(), 0);
        }
        // Robots that drive leave the shadow of a wall, and enter it.
        if self.substeps == 0 && world.has_walls() {
            self.settle(world)?;
        }
        self.substeps += 1;
        let tick = Duration::from_micros(TICK_US.into());
        // A run lasts at most four weeks, so the number of ticks fits 32 bits.
        let end = tick * world.now() as u32 + tick * self.substeps / world.substeps();
        while self.now < end {
            let periods = self.fleets.iter().map(EmulatedFleet::exchange_period);
            let period = periods.chain(self.bridge.iter().map(|_| BRIDGE_EXCHANGE_PERIOD)).min();
            let until = period.map_or(end, |period| end.min(self.now + period));
            for fleet in &mut self.fleets {
                fleet.run(world, self.bridge.as_mut(), until)?;
            }
            self.now = until;
            for sending in self.bridge.iter_mut().flat_map(|bridge| bridge.send(until)) {
                let mut on_it =
                    self.fleets.iter_mut().filter(|fleet| fleet.medium() == sending.medium);
                on_it.try_for_each(|fleet| fleet.receive(&sending.command))?;
            }
        }
        Ok(())
    }

    /// Returns the link statistics of each medium, and the number of packets that were lost because
    /// a radio's buffer was full.
    pub fn links(&mut self) -> Result<Vec<(Medium, LinkStatistics, u64)>, ClientError> {
        let of = |fleet: &mut EmulatedFleet| {
            let (links, overflown) = fleet.links()?;
            Ok((fleet.medium(), links, overflown))
        };
        self.fleets.iter_mut().map(of).collect()
    }
}
