//! Ticks whose events an observer receives.

use super::super::firmware::FirmwareError;
use super::super::observer::{self, Observer};
use super::Simulation;
use crate::engine::RobotId;
use crate::robot::SeenEvent;

impl Simulation {
    /// Simulates 100 ms as [`tick`](Self::tick) does, and then passes the events that an observer
    /// uses to it.
    /// Observation does not change the run, bit for bit. A tick that fails passes the events up to
    /// the failure.
    pub fn tick_observed(&mut self, observer: &mut dyn Observer) -> Result<(), FirmwareError> {
        let tick = self.world.now();
        let interest = observer.interest();
        if interest.frames {
            self.world.watch();
        }
        self.world.brains_mut().for_each(|robot| robot.watch(interest));
        self.is_watched = true;
        self.interest = Some(interest);
        let outcome = self.tick();
        self.interest = None;
        let frames = self.world.take_frame_log();
        let robots = self.world.brains_mut().zip((0..).map(RobotId));
        let seen =
            robots.flat_map(|(robot, id)| robot.take_seen().into_iter().map(move |one| (id, one)));
        let seen: Vec<(RobotId, SeenEvent)> = seen.collect();
        if seen.is_empty() && frames.arrivals.is_empty() && frames.attempts.is_empty() {
            return outcome;
        }
        let (numbers, count) = (self.event_queue.numbers(), self.robot_count());
        // The other senders are adversaries, whose ids count down from the highest one.
        let number = |id: RobotId| match numbers.get(usize::from(id.0)) {
            Some(number) => *number,
            None => count + usize::from(u16::MAX - id.0),
        };
        let all = count + self.world.intruder_count();
        observer::show(tick, &number, all, frames, seen, observer);
        outcome
    }
}
