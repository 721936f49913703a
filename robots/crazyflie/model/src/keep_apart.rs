//! Collision avoidance of a simulated Crazyflie: the filter of [`bittybuzz_flight::avoidance`], which
//! receives the positions of neighbors from the frames of their messages.

use bittybuzz_arena::engine::{Io, TICK_S, TICK_US};
use bittybuzz_flight::Vec3;
use bittybuzz_flight::avoidance::{Avoidance, AvoidanceSettings, PeerReport};

use crate::Velocity;

/// The largest number of neighbors that the filter knows.
const PEERS: usize = 10;

/// Age in ms that the filter assumes of a position. In the simulator a frame carries the position at
/// the end of a tick and arrives at the beginning of the next one; the robot acts for a tick on it.
const FRAME_AGE_MS: u32 = TICK_US / 1000;

/// The collision avoidance of one robot.
#[derive(Clone, Debug)]
pub struct KeepApart {
    settings: AvoidanceSettings,
    /// The filter; it needs the robot's id, which is known from the first tick on.
    filter: Option<Avoidance<PEERS>>,
    /// Velocity in the world frame in m/s, as the body follows the commands.
    velocity_m_s: Vec3,
}

impl KeepApart {
    /// Returns the avoidance for robots that keep twice `radius_mm` between their middles, fly
    /// at most `speed_mm_s` fast, and follow a velocity with a lag.
    pub fn new(radius_mm: f32, speed_mm_s: f32, lag_s: f32) -> Self {
        let standard = AvoidanceSettings::CRAZYFLIE;
        let radius_m = radius_mm / 1000.0;
        let settings = AvoidanceSettings {
            radius_m,
            height_m: standard.height_m / standard.radius_m * radius_m,
            speed_m_s: standard.speed_m_s.min(speed_mm_s / 1000.0),
            lag_s,
            ..standard
        };
        KeepApart { settings, filter: None, velocity_m_s: Vec3::ZERO }
    }

    /// Returns the velocity nearest to the wanted one that keeps the robot away from the neighbors
    /// whose frames it received. Without a position estimate it returns the wanted one.
    pub fn limit(&mut self, io: &Io<'_>, wanted: Velocity) -> Velocity {
        let Some(here) = io.sensors.estimate() else { return wanted };
        let settings = self.settings;
        if self.filter.is_none() {
            self.filter = Avoidance::new(io.id.0, settings);
        }
        // Only a robot with a speed of 0 has no filter, and it does not move.
        let Some(filter) = &mut self.filter else { return wanted };
        let now_ms = io.milliseconds() as u32;
        let position_m = Vec3::new(here.x, here.y, here.z) / 1000.0;
        for frame in io.inbox.iter() {
            let (Some(robot), Some([distance, azimuth, elevation])) =
                (frame.sighting.robot, frame.sighting.place())
            else {
                continue;
            };
            let (sine, cosine) = libm::sincosf(azimuth + here.heading);
            let (rise, flat) = libm::sincosf(elevation);
            let way = Vec3::new(flat * cosine, flat * sine, rise) * (distance / 1000.0);
            // The filter refuses frames of the robot's own id and positions that are not finite.
            let _ = filter.update_peer(PeerReport {
                id: robot.0,
                position_m: position_m + way,
                velocity_m_s: None,
                measured_at_ms: now_ms.wrapping_sub(FRAME_AGE_MS),
            });
        }
        let (sine, cosine) = libm::sincosf(here.heading);
        let wanted_m_s = Vec3::new(
            wanted.forward * cosine - wanted.left * sine,
            wanted.forward * sine + wanted.left * cosine,
            wanted.up,
        ) / 1000.0;
        let safe = filter.limit(position_m, self.velocity_m_s, wanted_m_s, now_ms).velocity_m_s;
        let share =
            if settings.lag_s > 0.0 { 1.0 - libm::expf(-TICK_S / settings.lag_s) } else { 1.0 };
        self.velocity_m_s += (safe - self.velocity_m_s) * share;
        let safe = safe * 1000.0;
        Velocity {
            forward: safe.x * cosine + safe.y * sine,
            left: safe.y * cosine - safe.x * sine,
            up: safe.z,
            turn: wanted.turn,
        }
    }

    /// Forgets the velocity of a robot that stands on the ground.
    pub fn stand(&mut self) {
        self.velocity_m_s = Vec3::ZERO;
    }
}
