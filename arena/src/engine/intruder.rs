//! Intruders: senders without a body that follow none of the robots' rules.
//!
//! An intruder receives the frames that a robot at its place would receive. It sends at its own
//! pace and never waits for a free channel; the link treats its frames like those of robots. To the
//! links, an intruder is a robot with an id that counts down from 65,535. It is never assigned to a
//! group of a partition.

use core::fmt::Debug;
use core::hash::Hash;

use super::TICK_US;
use super::brain::{Brain, TickFrames};
use super::digest::Digest;
use super::error::AddError;
use super::geometry::Pose;
use super::herd::{Herd, HerdId};
use super::id::RobotId;
use super::link::{
    Attempt, DeliveredFrame, Ether, Late, LinkSettings, Listener, Media, Medium, Near, Packet,
    Transmission,
};
use super::statistics::LinkStatistics;
use super::stream::{Stream, StreamPurpose};
use super::world::World;

/// The behaviour of an intruder. Its `Debug` text contains its complete state, because digests of
/// runs are computed from it.
pub trait Intruder: Debug + Send {
    /// Returns a copy that continues exactly as the original would.
    fn copy(&self) -> Box<dyn Intruder>;

    /// Handles the frames that the intruder received since the last tick.
    fn hear(&mut self, inbox: &TickFrames<'_>);

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
    pub range: Option<f32>,
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
    heard: Vec<DeliveredFrame>,
}

impl Clone for Station {
    fn clone(&self) -> Self {
        Station {
            intruder: self.intruder.copy(),
            late: self.late.clone(),
            stream: self.stream.clone(),
            near: Vec::new(),
            heard: Vec::new(),
            ..*self
        }
    }
}

/// Returns the index of the intruder with that id.
pub(crate) fn number(id: RobotId) -> usize {
    usize::from(u16::MAX - id.0)
}

impl<B: Brain> World<B> {
    /// Adds an intruder, which sends from now on. `make` gets random numbers of its own.
    pub fn add_intruder(
        &mut self,
        settings: IntruderSettings,
        make: impl FnOnce(Stream) -> Box<dyn Intruder>,
    ) -> Result<(), AddError> {
        let IntruderSettings { pose, herd, range, period_us, until } = settings;
        let Some(Herd { medium, media, link, .. }) = self.herds.get(usize::from(herd.0)) else {
            return Err(AddError::UnknownHerd);
        };
        if !pose.is_finite() || !self.settings.area.contains(pose.x, pose.y) {
            return Err(AddError::Outside);
        }
        let free = usize::from(u16::MAX).checked_sub(self.brains.len() + self.stations.len());
        let id = free.and_then(|_| u16::try_from(self.stations.len()).ok());
        let id = RobotId(u16::MAX - id.ok_or(AddError::TooMany)?);
        let mut stream = Stream::new(self.settings.seed, StreamPurpose::Intruder, id.0, 0);
        let (medium, media) = (*medium, *media);
        let air = &mut self.air[medium as usize];
        // The loss may have changed since the herd was added.
        let (of_herd, bodies) = (*air.link(*link), air.bodies(*link));
        let link = LinkSettings { range: range.or(of_herd.range), ..of_herd };
        self.stations.push(Station {
            id,
            pose,
            medium,
            media,
            link: air.add_link(link, bodies, self.settings.area),
            period_us,
            until,
            next_us: self.now * u64::from(TICK_US),
            intruder: make(stream.fork()),
            stream,
            late: None,
            near: Vec::new(),
            heard: Vec::new(),
        });
        Ok(())
    }

    /// Returns the number of intruders that have been added.
    #[must_use]
    pub fn intruder_count(&self) -> usize {
        self.stations.len()
    }

    /// Lets intruders receive the frames that ended in the last tick.
    pub(crate) fn overhear(&mut self) {
        let World { stations, air, topology, calibration, settings, now, .. } = self;
        let now = *now;
        for station in stations.iter_mut().filter(|station| now < station.until) {
            let Station { id, pose, medium, media, intruder, late, near, heard, .. } = station;
            let ether = Ether { air: &air[*medium as usize], topology, calibration };
            let due = late.take_if(|late| late.due <= now);
            let mut listener = Listener { id: *id, pose, estimate: None, media, late, now };
            let stream = || Stream::new(settings.seed, StreamPurpose::Hear, id.0, now);
            // The statistics count only robots.
            let mut count = LinkStatistics::default();
            ether.hear(&mut listener, stream, near, heard, &mut count, |_, _| ());
            let air = ether.air.transmissions();
            intruder.hear(&TickFrames { heard, air, late: due.as_deref(), medium: *medium });
        }
    }
}

impl Station {
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
        if self.medium != medium || now >= self.until {
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
    pub(crate) fn transmit(&mut self, at: i32) -> Option<Transmission> {
        let packet = Packet::of(self.medium, |frame| self.intruder.next_frame(frame))?;
        let Pose { x, y, z, .. } = self.pose;
        Some(Transmission {
            start: at,
            from: self.id,
            link: self.link,
            x,
            y,
            z,
            claim: None,
            packet,
        })
    }
}
