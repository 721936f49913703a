//! Collision avoidance between robots that know each other's positions.
//!
//! PLACEHOLDER

mod half_space;
mod peers;
mod segment;

pub use peers::{PeerReport, RefusedReport};

use glam::Vec3;
use half_space::{HalfSpace, nearest_point};
use peers::PeerTable;
use segment::{LineSegment, nearest_points};

/// Parameters of the collision avoidance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AvoidanceSettings {
    /// Horizontal half-axis of the ellipsoid that belongs to one robot, in m. Two robots at the same
    /// height keep twice this distance.
    pub radius_m: f32,
    /// Vertical half-axis of the ellipsoid in m, larger because of the air flow below a robot.
    pub height_m: f32,
    /// Largest speed in m/s.
    pub speed_m_s: f32,
    /// Time in seconds in which a robot may use up the distance to the boundary of its cell.
    pub horizon_s: f32,
    /// Time constant in seconds with which the velocity follows the command.
    pub lag_s: f32,
    /// Age in seconds at which the report of another robot is dropped.
    pub peer_age_s: f32,
    /// Corner of the space with the least coordinates, in m; may be infinite.
    pub lowest_m: Vec3,
    /// Corner of the space with the largest coordinates, in m; may be infinite.
    pub highest_m: Vec3,
}

impl AvoidanceSettings {
    /// The Crazyflie: Bitcraze's ellipsoid, horizon, speed and age (crazyflie-firmware 2a18fc29,
    /// `collision_avoidance.c`), and a space without walls.
    pub const CRAZYFLIE: Self = AvoidanceSettings {
        radius_m: 0.3,
        height_m: 0.9,
        speed_m_s: 0.5,
        horizon_s: 1.0,
        lag_s: 0.3,
        peer_age_s: 5.0,
        lowest_m: Vec3::NEG_INFINITY,
        highest_m: Vec3::INFINITY,
    };

    fn is_valid(&self) -> bool {
        let is_positive = |value: f32| value.is_finite() && value > 0.0;
        is_positive(self.radius_m)
            && is_positive(self.height_m)
            && is_positive(self.speed_m_s)
            && is_positive(self.horizon_s)
            && (self.lag_s == 0.0 || is_positive(self.lag_s))
            && is_positive(self.peer_age_s)
            && self.peer_age_s < 1e6
            && self.lowest_m.cmplt(self.highest_m).all()
    }
}

/// The way in which a safe velocity was found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AvoidanceOutcome {
    /// The wanted velocity is safe.
    Free,
    /// The velocity is the one of the cell nearest to the wanted one.
    Limited,
    /// The way is blocked: the velocity is the one nearest to the wanted one turned to the right.
    SideStep,
    /// No velocity satisfies all neighbors: the robot retreats without approaching any of those that
    /// are too near, or stops.
    Crowded,
    /// The own position or velocity is not finite: the robot stops.
    Lost,
}

/// A velocity that keeps a robot in its own cell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SafeVelocity {
    /// Velocity in the world frame in m/s, at most as fast as the settings allow.
    pub velocity_m_s: Vec3,
    pub outcome: AvoidanceOutcome,
}

/// Speed in m/s below which a robot counts as one that wants to stay.
const STAY_SPEED_M_S: f32 = 0.05;
/// Share of the wanted progress below which the way counts as blocked.
const BLOCKED_PROGRESS: f32 = 0.5;
/// Rate in rad/s at which a blocked robot turns its wanted velocity to the right.
const TURN_RATE_RAD_S: f32 = 1.5;
/// Rate in rad/s at which the turn fades on a free way.
const RETURN_RATE_RAD_S: f32 = 0.75;
/// Largest turn in rad.
const MOST_TURN_RAD: f32 = 2.4;
/// Longest time in ms between two calls that counts for the turn.
const MOST_TICK_MS: u32 = 200;

/// The collision avoidance of one robot that knows at most `N` others.
#[derive(Clone, Debug)]
pub struct Avoidance<const N: usize> {
    own_id: u16,
    settings: AvoidanceSettings,
    peers: PeerTable<N>,
    /// Position at the last call of [`Avoidance::limit`].
    position_m: Vec3,
    limited_at_ms: u32,
    turn_rad: f32,
}

impl<const N: usize> Avoidance<N> {
    /// Returns `None` if a setting is not finite or not positive, or if the space is empty.
    pub fn new(own_id: u16, settings: AvoidanceSettings) -> Option<Self> {
        settings.is_valid().then(|| Avoidance {
            own_id,
            settings,
            peers: PeerTable::new(),
            position_m: Vec3::ZERO,
            limited_at_ms: 0,
            turn_rad: 0.0,
        })
    }

    /// Stores the report of another robot. A full table keeps the robots nearest to the position of
    /// the last call of [`Avoidance::limit`].
    pub fn update_peer(&mut self, report: PeerReport) -> Result<(), RefusedReport> {
        if report.id == self.own_id {
            return Err(RefusedReport::OwnId);
        }
        self.peers.update(report, self.position_m)
    }

    /// Returns the safe velocity for the own motion and a wanted velocity, all in the world frame.
    /// A wanted velocity that is not finite counts as zero.
    pub fn limit(
        &mut self,
        position_m: Vec3,
        velocity_m_s: Vec3,
        wanted_m_s: Vec3,
        now_ms: u32,
    ) -> SafeVelocity {
        self.peers.drop_older_than((self.settings.peer_age_s * 1e3) as u32, now_ms);
        let tick_ms = now_ms.wrapping_sub(self.limited_at_ms).min(MOST_TICK_MS);
        self.limited_at_ms = now_ms;
        if !position_m.is_finite() || !velocity_m_s.is_finite() {
            return SafeVelocity { velocity_m_s: Vec3::ZERO, outcome: AvoidanceOutcome::Lost };
        }
        self.position_m = position_m;
        let speed_m_s = self.settings.speed_m_s;
        let wanted = if wanted_m_s.is_finite() { wanted_m_s } else { Vec3::ZERO };
        let wanted = wanted.clamp_length_max(speed_m_s);
        let own =
            LineSegment { from: position_m, to: position_m + self.settings.lag_s * velocity_m_s };

        let mut peers = [HalfSpace { normal: Vec3::X, bound: f32::INFINITY }; N];
        for (space, peer) in peers.iter_mut().zip(self.peers.iter()) {
            *space = self.peer_half_space(own, peer, now_ms);
        }
        let walls = self.walls(own.to);
        let cell = walls.iter().chain(&peers).copied().filter(|space| space.bound < speed_m_s);

        let Some(straight) = nearest_slow(cell.clone(), wanted, speed_m_s) else {
            return SafeVelocity {
                velocity_m_s: retreat(cell, speed_m_s),
                outcome: AvoidanceOutcome::Crowded,
            };
        };
        self.update_turn(straight, wanted, tick_ms as f32 * 1e-3);
        if self.turn_rad > 0.0
            && let Some(turned) = nearest_slow(cell, turn_right(wanted, self.turn_rad), speed_m_s)
        {
            return SafeVelocity { velocity_m_s: turned, outcome: AvoidanceOutcome::SideStep };
        }
        let is_free = straight == wanted;
        let outcome = if is_free { AvoidanceOutcome::Free } else { AvoidanceOutcome::Limited };
        SafeVelocity { velocity_m_s: straight, outcome }
    }

    fn update_turn(&mut self, straight: Vec3, wanted: Vec3, tick_s: f32) {
        let is_moving = wanted.length() > STAY_SPEED_M_S;
        let is_blocked = straight.dot(wanted) < BLOCKED_PROGRESS * wanted.length_squared();
        let rate = if is_moving && is_blocked { TURN_RATE_RAD_S } else { -RETURN_RATE_RAD_S };
        self.turn_rad = (self.turn_rad + rate * tick_s).max(0.0).min(MOST_TURN_RAD);
    }

    /// Returns the velocities that keep the own stopping point on the own side of the plane halfway
    /// to a peer.
    fn peer_half_space(&self, own: LineSegment, peer: PeerReport, now_ms: u32) -> HalfSpace {
        let settings = &self.settings;
        let scale = Vec3::new(settings.radius_m, settings.radius_m, settings.height_m).recip();
        let scaled = |s: LineSegment| LineSegment { from: s.from * scale, to: s.to * scale };
        let (own, other) = (scaled(own), scaled(peer.stopping_segment(settings.lag_s)));
        let (own_point, other_point) = nearest_points(own, other);
        let apart = own_point - other_point;
        // Segments that touch have no direction. The positions, then the numbers choose one, such
        // that the two robots choose opposite ones.
        let side = if self.own_id < peer.id { Vec3::X } else { Vec3::NEG_X };
        let away = apart
            .try_normalize()
            .or_else(|| (own.from - other.from).try_normalize())
            .unwrap_or(side);
        let middle = (own_point + other_point) / 2.0;
        // The distance from the plane in m is the scaled one divided by the length of `outward`.
        let outward = -away * scale;
        let per_m = outward.length();
        let room_m = (away.dot(own.to - middle) - 1.0) / per_m;
        // The peer may have moved meanwhile, which moves the plane by half of the way. It is a reason
        // to come no nearer, but not to retreat.
        let moved_m = peer.age_ms(now_ms) as f32 * 1e-3 * settings.speed_m_s;
        let room_m = (room_m - moved_m / 2.0).max(room_m.min(0.0));
        HalfSpace { normal: outward / per_m, bound: room_m / settings.horizon_s }
    }

    fn walls(&self, stopping_point_m: Vec3) -> [HalfSpace; 6] {
        let settings = &self.settings;
        let above = (settings.highest_m - stopping_point_m) / settings.horizon_s;
        let below = (stopping_point_m - settings.lowest_m) / settings.horizon_s;
        [
            HalfSpace { normal: Vec3::X, bound: above.x },
            HalfSpace { normal: Vec3::Y, bound: above.y },
            HalfSpace { normal: Vec3::Z, bound: above.z },
            HalfSpace { normal: Vec3::NEG_X, bound: below.x },
            HalfSpace { normal: Vec3::NEG_Y, bound: below.y },
            HalfSpace { normal: Vec3::NEG_Z, bound: below.z },
        ]
    }
}

/// Returns the velocity of the cell nearest to `wanted`, or `None` if no velocity of the cell is slow
/// enough. Only a cell without the origin makes the nearest velocity faster than `wanted`; then the
/// answer lies between it and the slowest velocity of the cell.
fn nearest_slow(
    cell: impl Iterator<Item = HalfSpace> + Clone,
    wanted: Vec3,
    speed_m_s: f32,
) -> Option<Vec3> {
    let nearest = nearest_point(cell.clone(), wanted)?;
    if nearest.length() <= speed_m_s {
        return Some(nearest);
    }
    let slowest = nearest_point(cell, Vec3::ZERO)?;
    let beyond = slowest.length_squared() - speed_m_s * speed_m_s;
    if beyond > 0.0 {
        return None;
    }
    // The share s solves |slowest + s·way| = speed.
    let way = nearest - slowest;
    let (square, half) = (way.length_squared(), slowest.dot(way));
    if square <= 0.0 {
        return Some(slowest);
    }
    let share = (libm::sqrtf((half * half - square * beyond).max(0.0)) - half) / square;
    Some(slowest + share.max(0.0).min(1.0) * way)
}

/// Returns the fallback of a crowded cell: away from all violated boundaries together, without coming
/// nearer to one of them.
fn retreat(cell: impl Iterator<Item = HalfSpace> + Clone, speed_m_s: f32) -> Vec3 {
    let away: Vec3 = cell.clone().map(|space| space.bound.min(0.0) * space.normal).sum();
    let cell = cell.map(HalfSpace::with_origin);
    nearest_point(cell, away.clamp_length_max(speed_m_s)).unwrap_or(Vec3::ZERO)
}

/// Turns a velocity to its right about the vertical axis; a vertical one turns towards x if it rises
/// and away from x if it sinks.
fn turn_right(velocity: Vec3, turn_rad: f32) -> Vec3 {
    let sideways = velocity.cross(Vec3::Z);
    let right = sideways.try_normalize().unwrap_or(Vec3::X * velocity.z.signum());
    let (sine, cosine) = libm::sincosf(turn_rad);
    cosine * velocity + sine * velocity.length() * right
}
