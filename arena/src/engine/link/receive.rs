//! The reception of a tick's transmissions by one robot.

use super::air::{Near, Transmissions};
use super::calibration::Calibration;
use super::delivery::{DeliveredFrame, Late};
use super::frame_log::{Arrival, Fate, LossCause, SentFrame};
use super::packet::{Direction, FrameSighting, Transmission, polar};
use super::topology::Barriers;
use super::{LinkSettings, Media, Medium, RangeAndBearing};
use crate::engine::TICK_US;
use crate::engine::geometry::{Pose, wrap};
use crate::engine::id::RobotId;
use crate::engine::statistics::LinkStatistics;
use crate::engine::stream::Stream;

/// The longest time that a frame is held back, in ticks.
const DELAY_TICKS_MAX: u32 = 5;

/// A receiver of frames: a robot or an intruder.
#[derive(Debug)]
pub(crate) struct Listener<'a> {
    pub(crate) id: RobotId,
    pub(crate) pose: &'a Pose,
    pub(crate) estimate: Option<&'a Pose>,
    /// The parameters of its distance and direction measurement.
    pub(crate) media: &'a Media,
    /// A frame that was held back.
    pub(crate) late: &'a mut Option<Box<Late>>,
    pub(crate) now: u64,
}

/// The data that all listeners share.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ether<'a> {
    pub(crate) air: &'a Transmissions,
    pub(crate) barriers: Barriers<'a>,
    pub(crate) calibration: &'a Calibration,
}

impl Ether<'_> {
    /// Fills `received` with the frames that ended in the last tick and arrived. `see` is called with
    /// the fate of each frame; an empty closure costs nothing.
    pub(crate) fn receive(
        &self,
        listener: &mut Listener<'_>,
        stream: impl FnOnce() -> Stream,
        near: &mut Vec<Near>,
        received: &mut Vec<DeliveredFrame>,
        count: &mut LinkStatistics,
        mut see: impl FnMut(&Near, Fate),
    ) {
        received.clear();
        self.air.near(listener.id, listener.pose, &self.barriers, near);
        if near.is_empty() {
            return;
        }
        let mut stream = stream();
        let air_time = self.air.medium.air_time_us() as i32;
        for (place, frame) in near.iter().enumerate() {
            if frame.from == listener.id || !ends_in_tick(frame, air_time) {
                continue;
            }
            match disturbed(near, place, air_time, listener.id) {
                Some(Disturbance::Sending) => {
                    count.deaf += 1;
                    see(frame, Fate::Lost(LossCause::Sending));
                }
                Some(Disturbance::Collision) => {
                    count.collided += 1;
                    see(frame, Fate::Lost(LossCause::Collision));
                }
                None if stream.chance(self.loss(frame)) => {
                    count.lost += 1;
                    see(frame, Fate::Lost(LossCause::Chance));
                }
                None => {
                    count.received += 1;
                    let see = |fate| see(frame, fate);
                    self.deliver(listener, frame, &mut stream, received, count, see);
                }
            }
        }
    }

    /// Adds to `seen` the frames that ended in the last tick within reach of a robot, but that it
    /// could not receive because it is cut off from their senders or does not run. Only called for
    /// observers.
    pub(crate) fn miss(
        &self,
        robot: RobotId,
        pose: &Pose,
        now: u64,
        is_running: bool,
        near: &mut Vec<Near>,
        seen: &mut Vec<Arrival>,
    ) {
        let air_time = self.air.medium.air_time_us() as i32;
        let mut note = |near: &[Near], cause| {
            let others = near.iter().filter(|frame| frame.from != robot);
            for frame in others.filter(|frame| ends_in_tick(frame, air_time)) {
                seen.push(self.arrival(robot, now, frame, Fate::Lost(cause)));
            }
        };
        self.air.cut_off(robot, pose, &self.barriers, near);
        note(near, LossCause::CutOff);
        if !is_running {
            self.air.near(robot, pose, &self.barriers, near);
            note(near, LossCause::Off);
        }
    }

    /// Returns the fate of a frame in reach in the form for observers.
    pub(crate) fn arrival(&self, receiver: RobotId, now: u64, near: &Near, fate: Fate) -> Arrival {
        Arrival { frame: self.sent(now, near), receiver, fate }
    }

    /// Returns a frame in reach in the form for observers.
    fn sent(&self, now: u64, near: &Near) -> SentFrame {
        SentFrame::received_at(now, self.air, near.index)
    }

    /// Puts a frame into the inbox once or twice, or holds it back.
    fn deliver(
        &self,
        listener: &mut Listener<'_>,
        near: &Near,
        stream: &mut Stream,
        received: &mut Vec<DeliveredFrame>,
        count: &mut LinkStatistics,
        see: impl FnOnce(Fate),
    ) {
        let sighting = self.sighting(listener, near, stream);
        let link = self.air.link(near.link);
        let frame = DeliveredFrame { transmission: near.index, sighting };
        let is_duplicated = stream.chance(link.duplicate);
        if is_duplicated {
            count.duplicated += 1;
            received.push(frame);
        }
        if stream.chance(link.reorder) && listener.late.is_none() {
            count.delayed += 1;
            let due = listener.now + 1 + u64::from(stream.below(DELAY_TICKS_MAX));
            let frame = self.sent(listener.now, near);
            *listener.late = Some(Box::new(Late { due, frame, sighting }));
            see(Fate::Received { is_duplicated, held_until: Some(due) });
        } else {
            received.push(frame);
            see(Fate::Received { is_duplicated, held_until: None });
        }
    }

    /// Returns the probability that a frame is lost on its way.
    fn loss(&self, frame: &Near) -> f32 {
        let LinkSettings { range, loss, .. } = self.air.link(frame.link);
        // Without an end of the range, the loss is the same at any distance.
        let Some(range) = range else { return loss.near };
        let part = ((frame.distance_mm - self.air.bodies_mm(frame.link)) / range).clamp(0.0, 1.0);
        loss.near + (loss.far - loss.near) * part * part
    }

    fn sighting(
        &self,
        listener: &Listener<'_>,
        frame: &Near,
        stream: &mut Stream,
    ) -> FrameSighting {
        if self.air.medium == Medium::Infrared {
            let mut gap_mm = frame.distance_mm - self.air.bodies_mm(frame.link);
            let sigma = listener.media.infrared.distance_sigma;
            if sigma > 0.0 {
                gap_mm += sigma * stream.normal();
            }
            return FrameSighting {
                robot: None,
                way: Some(Direction::Polar([self.calibration.measure(gap_mm), 0.0, 0.0])),
            };
        }
        let Transmission { x, y, z, claim, .. } = &self.air.transmissions()[frame.index as usize];
        if self.air.medium == Medium::RangeAndBearing {
            let RangeAndBearing { distance_sigma, bearing_sigma, .. } =
                listener.media.range_and_bearing;
            let [mut distance, mut azimuth, elevation] =
                polar(way_to([*x, *y, *z], listener.pose), listener.pose.heading);
            if distance_sigma > 0.0 {
                distance = (distance + distance_sigma * stream.normal()).max(0.0);
            }
            if bearing_sigma > 0.0 {
                azimuth = wrap(azimuth + bearing_sigma * stream.normal());
            }
            let way = Some(Direction::Polar([distance, azimuth, elevation]));
            return FrameSighting { robot: Some(frame.from), way };
        }
        let claimed = claim.zip(listener.estimate);
        let way = claimed.map(|(claim, own)| Direction::Straight(way_to(claim, own), own.heading));
        FrameSighting { robot: Some(frame.from), way }
    }
}

/// Returns true for a frame that ended in the last tick.
fn ends_in_tick(frame: &Near, air_time: i32) -> bool {
    let end = frame.start + air_time;
    end > 0 && end <= TICK_US as i32
}

/// A reason why a robot cannot receive a frame.
enum Disturbance {
    Sending,
    Collision,
}

/// Returns the disturbance of the frame at index `place` by others in reach; `None` if nothing
/// overlaps with it. `near` is sorted by time, and all frames have the same length.
fn disturbed(near: &[Near], place: usize, air_time: i32, listener: RobotId) -> Option<Disturbance> {
    let start = near[place].start;
    let before = near[..place].iter().rev().take_while(|other| other.start + air_time > start);
    let after = near[place + 1..].iter().take_while(|other| other.start < start + air_time);
    let mut overlapping = before.chain(after).peekable();
    overlapping.peek()?;
    if overlapping.any(|other| other.from == listener) {
        Some(Disturbance::Sending)
    } else {
        Some(Disturbance::Collision)
    }
}

/// Returns the vector from a pose to a place in mm, along the axes of the world.
fn way_to([x, y, z]: [f32; 3], own: &Pose) -> [f32; 3] {
    [x - own.x, y - own.y, z - own.z]
}
