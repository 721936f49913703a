//! Robots that run side by side and hear each other.

use std::time::Duration;

use bittybuzz_chips::{Air, Board, LOOKAHEAD, Sender, Time};

use crate::{Machine, MachineError, Pause};

/// The program's robots, and the air between them.
pub(crate) struct Fleet<'a, M> {
    pub machines: &'a mut [M],
    pub air: Air,
}

impl<M: Machine> Fleet<'_, M> {
    /// Runs all robots until `until`, or until nothing can happen to any of them. They take turns that are too short for
    /// one to hear of another's packet too late: a robot that sleeps can announce none before it wakes, so turns end that
    /// much later, and who sleeps through a turn is left alone.
    pub fn run(&mut self, from: Duration, until: Duration) -> Result<Pause, MachineError> {
        let robots = self.machines.len();
        let mut now = from;
        while now < until {
            let mut quiet = until;
            if robots > 1 {
                for machine in self.machines.iter_mut() {
                    quiet = quiet.min(machine.quiet_until());
                }
            }
            let turn = (quiet.max(now) + duration(LOOKAHEAD)).min(until);
            let machines = &mut *self.machines;
            self.air.carry(time(turn), robots, |robot, heard| machines[robot].board().hear(heard));
            let mut reason = None;
            for (number, machine) in self.machines.iter_mut().enumerate() {
                // At the end everybody stands at the same time.
                if turn < until && machine.quiet_until() > turn {
                    continue;
                }
                let pause = machine.run(turn)?;
                reason = Some(if reason.is_none_or(|other| other == pause) {
                    pause
                } else {
                    Pause::Time
                });
                for transmission in machine.board().take_transmissions() {
                    self.air.add(Sender::Robot(number), transmission);
                }
            }
            now = turn;
            if now == until
                && let Some(reason) = reason
            {
                return Ok(reason);
            }
        }
        Ok(Pause::Time)
    }
}

pub(crate) fn time(duration: Duration) -> Time {
    Time::from_nanos(u64::try_from(duration.as_nanos()).unwrap_or(u64::MAX))
}

fn duration(time: Time) -> Duration {
    Duration::from_nanos(time.nanos())
}
