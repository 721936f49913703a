//! The order of transmissions: all robots' attempts, sorted by time.
//!
//! A single thread runs this part of a tick, because a robot may send only if no other transmission
//! started before.

use core::cmp::Reverse;
use std::collections::BinaryHeap;

use super::air::Transmissions;
use super::frame_log::{SendAttempt, SentFrame};
use super::packet::{Packet, Transmission};
use super::radio::RobotRadio;
use super::topology::Barriers;
use crate::engine::TICK_US;
use crate::engine::brain::Brain;
use crate::engine::geometry::Pose;
use crate::engine::herd::Herd;
use crate::engine::id::RobotId;
use crate::engine::intruder::{self, Station};
use crate::engine::robot::EngineRobot;
use crate::engine::statistics::LinkStatistics;
use crate::engine::stream::{Stream, StreamPurpose};

/// A planned attempt of a robot to send.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Attempt {
    pub(crate) at: i32,
    pub(crate) robot: RobotId,
}

/// The attempts of a tick. The value is kept to reuse its memory.
#[derive(Clone, Debug, Default)]
pub(crate) struct Schedule {
    pub(crate) planned: Vec<Attempt>,
    again: BinaryHeap<Reverse<Attempt>>,
}

/// The data that all attempts of a tick share.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Window<'a> {
    pub(crate) barriers: Barriers<'a>,
    pub(crate) herds: &'a [Herd],
    pub(crate) poses: &'a [Pose],
    pub(crate) estimates: &'a [Option<Pose>],
    pub(crate) seed: u64,
    pub(crate) now: u64,
}

impl Window<'_> {
    /// Converts a time of the tick to µs since the world began.
    fn since_the_beginning(&self, at: i32) -> u64 {
        self.now * u64::from(TICK_US) + at.max(0) as u64
    }
}

/// All senders: robots with their brains, and intruders.
#[derive(Debug)]
pub(crate) struct Senders<'a, B> {
    pub(crate) robots: &'a mut [EngineRobot],
    pub(crate) brains: &'a mut [B],
    pub(crate) stations: &'a mut [Station],
}

impl Schedule {
    /// Executes the planned attempts and those that follow from them. `seen` records each attempt
    /// if the run is observed.
    pub(crate) fn run<B: Brain>(
        &mut self,
        window: &Window<'_>,
        Senders { robots, brains, stations }: Senders<'_, B>,
        air: &mut Transmissions,
        count: &mut LinkStatistics,
        mut seen: Option<&mut Vec<SendAttempt>>,
    ) {
        for station in stations.iter_mut() {
            station.plan(air.medium, window.now, &mut self.planned);
        }
        self.planned.sort_unstable();
        let mut planned = self.planned.drain(..).peekable();
        loop {
            let again = self.again.peek();
            // Of equal attempts, the one that was planned again comes first.
            let is_first = |planned: &Attempt| again.is_none_or(|Reverse(again)| planned < again);
            let next = planned.next_if(is_first);
            let next = next.or_else(|| self.again.pop().map(|Reverse(again)| again));
            // All robots have sent.
            let Some(attempt) = next else { break };
            let index = usize::from(attempt.robot.0);
            let seen = seen.as_deref_mut();
            let (Some(robot), Some(brain)) = (robots.get_mut(index), brains.get_mut(index)) else {
                let station = &mut stations[intruder::number(attempt.robot)];
                if let Some((transmission, packet)) = station.transmit(attempt.at) {
                    count.sent += 1;
                    send(transmission, packet, window, air, seen);
                }
                continue;
            };
            if let Some(next) = carry_out(attempt, window, robot, brain, air, count, seen) {
                self.again.push(Reverse(next));
            }
        }
    }
}

/// Starts a transmission and records it if the run is observed.
fn send(
    transmission: Transmission,
    packet: Packet,
    window: &Window<'_>,
    air: &mut Transmissions,
    seen: Option<&mut Vec<SendAttempt>>,
) {
    if let Some(seen) = seen {
        let start_us = window.since_the_beginning(transmission.start);
        let sent = SentFrame::new(air.medium, &transmission, packet, start_us);
        seen.push(SendAttempt::Sent(sent));
    }
    air.send(transmission, packet);
}

/// Sends a frame or backs off. Returns the robot's next attempt if it is in this tick.
fn carry_out(
    Attempt { at, robot }: Attempt,
    window: &Window<'_>,
    EngineRobot { herd, radio, .. }: &mut EngineRobot,
    brain: &mut impl Brain,
    air: &mut Transmissions,
    count: &mut LinkStatistics,
    seen: Option<&mut Vec<SendAttempt>>,
) -> Option<Attempt> {
    let medium = air.medium;
    let Herd { media: pacing, link, .. } = &window.herds[usize::from(herd.0)];
    let pose = &window.poses[usize::from(robot.0)];
    let moment_us = window.since_the_beginning(at);
    let mut stream = Stream::new(window.seed, StreamPurpose::BackOff, robot.0, moment_us);
    let busy = RobotRadio::senses(medium, at)
        .map_or(0, |since| air.sensed(robot, pose, at, since, &window.barriers));
    if busy > 0 {
        count.postponed += 1;
        if let Some(seen) = seen {
            seen.push(SendAttempt::Postponed { sender: robot, at_us: moment_us, sensed: busy });
        }
        radio.back_off(medium, busy, pacing, &mut stream);
    } else if !brain.is_within_message()
        && let Some(heard) = air.begun(robot, pose, at, &window.barriers)
        && radio.defer(medium, heard, &mut stream)
    {
        count.postponed += 1;
        if let Some(seen) = seen {
            seen.push(SendAttempt::Postponed { sender: robot, at_us: moment_us, sensed: 1 });
        }
    } else {
        let packet = Packet::written(medium, |frame| brain.next_frame(frame));
        radio.waits = packet.is_some() && brain.has_frame();
        let packet = packet?;
        count.sent += 1;
        let estimate = &window.estimates[usize::from(robot.0)];
        let claim = estimate.as_ref().map(|pose| [pose.x, pose.y, pose.z]);
        let Pose { x, y, z, .. } = *pose;
        let link = *link;
        let transmission = Transmission { start: at, from: robot, link, x, y, z, claim };
        send(transmission, packet, window, air, seen);
        let is_within = brain.is_within_message();
        if is_within {
            air.expect_more();
        }
        radio.sent(medium, pacing, is_within, &mut stream);
        if !radio.waits {
            return None;
        }
    }
    (radio.attempt < TICK_US as i32).then_some(Attempt { at: radio.attempt, robot })
}
