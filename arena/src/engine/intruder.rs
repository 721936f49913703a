//! Intruders: senders without a body that follow none of the robots' rules.
//!
//! An intruder receives the frames that a robot at its place would receive. It sends at its own
//! pace and never waits for a free channel; the link treats its frames like those of robots. To the
//! links, an intruder is a robot with an id that counts down from 65,535. It is never assigned to a
//! group of a partition.

use core::fmt::Debug;
use core::hash::Hash;

use super::TICK_US;
use super::brain::TickFrames;
use super::digest::Digest;
use super::geometry::Pose;
use super::herd::HerdId;
use super::id::RobotId;
use super::link::{
    Attempt, DeliveredFrame, Ether, Late, Listener, Media, Medium, Near, Packet, Transmission,
};
use super::statistics::LinkStatistics;
use super::stream::{Stream, StreamPurpose};

/// The behavior of an intruder. Its `Debug` text contains its complete state, because digests of
/// runs are computed from it.
pub trait Intruder: Debug + Send {
    /// Returns a copy that continues exactly as the original would.
    fn copy(&self) -> Box<dyn Intruder>;

    /// Handles the frames that the intruder received since the last tick.
    fn receive(&mut self, inbox: &TickFrames<'_>);

    /// Writes the next frame, type byte and payload, and returns its length in bytes; 0 sends
    /// nothing. `frame` is as long as the longest frame of the link and filled with zeros; infrared
    /// sends all of it.
    fn next_frame(&mut self, frame: &mut [u8]) -> usize;
}

/// The place, the link and the pace of an intruder.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct IntruderSettings {
    /// Position in mm and heading in radians.
    pub pose: Pose,
    /// The herd whose link it uses.
    pub herd: HerdId,
    /// Range in mm, measured like that of the link; `None` stands for the range of the herd.
    pub range_mm: Option<f32>,
    /// Mean time between the starts of two frames, in µs; `None` sends one frame directly after the
    /// other.
    pub period_us: Option<u64>,
    /// The first tick in which the intruder neither sends nor receives.
    pub until: u64,
}

/// An intruder in a world.
#[derive(Debug)]
pub(crate) struct Station {
    id: RobotId,
    pose: Pose,
    medium: Medium,
    media: Media,
    /// Index of its link.
    link: u16,
    period_us: Option<u64>,
    until: u64,
    /// Random numbers for the times at which it sends.
    stream: Stream,
    /// The start of its next frame, in µs since the world began.
    next_us: u64,
    intruder: Box<dyn Intruder>,
    late: Option<Box<Late>>,
    near: Vec<Near>,
    received: Vec<DeliveredFrame>,
}

impl Clone for Station {
    fn clone(&self) -> Self {
        Station {
            intruder: self.intruder.copy(),
            late: self.late.clone(),
            stream: self.stream.clone(),
            near: Vec::new(),
            received: Vec::new(),
            ..*self
        }
    }
}

/// Returns the index of the intruder with that id.
pub(crate) fn number(id: RobotId) -> usize {
    usize::from(u16::MAX - id.0)
}

impl Station {
    /// Returns an intruder that sends from `begin_us` on, in µs since the world began. `make` gets
    /// random numbers of its own.
    pub(crate) fn new(
        (id, medium, media, link): (RobotId, Medium, Media, u16),
        settings: &IntruderSettings,
        begin_us: u64,
        mut stream: Stream,
        make: impl FnOnce(Stream) -> Box<dyn Intruder>,
    ) -> Self {
        let IntruderSettings { pose, period_us, until, .. } = *settings;
        Station {
            id,
            pose,
            medium,
            media,
            link,
            period_us,
            until,
            next_us: begin_us,
            intruder: make(stream.fork()),
            stream,
            late: None,
            near: Vec::new(),
            received: Vec::new(),
        }
    }

    /// Returns true if the intruder sends and receives in tick `now`.
    pub(crate) fn is_active(&self, now: u64) -> bool {
        now < self.until
    }

    /// Receives the frames that ended in the last tick. `ether` returns the frames of a medium.
    pub(crate) fn overhear<'a>(
        &mut self,
        ether: impl FnOnce(Medium) -> Ether<'a>,
        seed: u64,
        now: u64,
    ) {
        let Station { id, pose, medium, media, intruder, late, near, received, .. } = self;
        let ether = ether(*medium);
        let due = late.take_if(|late| late.due <= now);
        let mut listener = Listener { id: *id, pose, estimate: None, media, late, now };
        let stream = || Stream::new(seed, StreamPurpose::Receive, id.0, now);
        // The statistics count only robots.
        let mut count = LinkStatistics::default();
        ether.receive(&mut listener, stream, near, received, &mut count, |_, _| ());
        let air = ether.air;
        intruder.receive(&TickFrames { received, air, late: due.as_deref() });
    }

    /// Adds the complete state to a digest.
    pub(crate) fn add_to(&self, digest: &mut Digest) {
        let Station { id, link, period_us, until, next_us, intruder, late, stream, pose, .. } =
            self;
        (id, link, period_us, until, next_us).hash(digest);
        digest.pose(pose);
        digest.text_of(&(intruder, late, stream));
    }

    /// Plans the intruder's frames on a medium in tick `now`.
    pub(crate) fn plan(&mut self, medium: Medium, now: u64, planned: &mut Vec<Attempt>) {
        if self.medium != medium || !self.is_active(now) {
            return;
        }
        let begin = now * u64::from(TICK_US);
        while let Some(at) = self.next_us.checked_sub(begin).filter(|at| *at < TICK_US.into()) {
            planned.push(Attempt { at: at as i32, robot: self.id });
            self.next_us += self.interval_us();
        }
    }

    /// Returns the time from the start of a frame to that of the next one, in µs. It is random,
    /// because a constant time could keep pace with the robots' own periods.
    fn interval_us(&mut self) -> u64 {
        let air_time = self.medium.air_time_us().into();
        let part = f64::from(0.5 + self.stream.unit());
        self.period_us.map_or(air_time, |period| air_time.max((period as f64 * part) as u64))
    }

    /// Returns the next frame, which starts at time `at` of the tick.
    pub(crate) fn transmit(&mut self, at: i32) -> Option<(Transmission, Packet)> {
        let packet = Packet::written(self.medium, |frame| self.intruder.next_frame(frame))?;
        let Pose { x, y, z, .. } = self.pose;
        let (from, link) = (self.id, self.link);
        Some((Transmission { start: at, from, link, x, y, z, claim: None }, packet))
    }
}
