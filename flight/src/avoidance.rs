//! Collision avoidance between robots that know each other's positions.
//!
//! The robots fly in cells that do not overlap: the buffered Voronoi cells of Zhou, Wang,
//! Bandyopadhyay and Schwager 2017, "Fast, On-line Collision Avoidance for Dynamic Vehicles Using
//! Buffered Voronoi Cells" (RA-L 2(2)). A filter between the planner and the controller replaces
//! the wanted velocity by the nearest one that keeps the robot in its own cell. No robot needs to
//! know the goals of others.
//!
//! # Cells
//! An ellipsoid belongs to each robot, taller than wide because of the air flow below it. In
//! coordinates divided by its half-axes, two ellipsoids are apart if their centers have a distance
//! of 2 or more. The plane halfway between two robots separates them, and each stays 1 away from
//! it.
//!
//! A robot cannot stop at once. Its velocity v follows the command u as v' = (u − v)/τ, so it would
//! come to rest at the stopping point s = x + τv. The derivatives are s' = v + τv' = u and x' = (s
//! − x)/τ: the command moves the stopping point directly, and the position follows it. A convex
//! cell that contains both, and then the stopping point, contains the position too. So the plane
//! stands halfway on the shortest connection of the two segments from position to stopping point,
//! and the command must satisfy n·(s + uT) ≤ b for each plane and the horizon T.
//!
//! # Guarantee
//! Suppose that all robots run this filter with the same settings, that they choose their commands
//! at the same moments and at intervals of at most the horizon, that each then knows the position
//! and velocity of all others within reach, and that the model of the velocity holds. If the
//! segments of all pairs are 2 apart once, then always: the old planes separate the new segments by
//! 2, so the next cells are not empty and even contain the stopping points. Tests check this
//! property.
//!
//! Radio and sensors break these assumptions. A report of age a is off by a times the speed at
//! most, so the plane moves by half of this towards the own robot. The moved plane only stops a
//! robot; it does not push it away. Two robots that choose at different times, or see with noise,
//! still place their planes differently. **This part has no proof but a simulation**: with noise of
//! 1 cm, a delay of 0.1 s and a loss of 20 % at 10 reports per second, Crazyflies keep 0.5 m of
//! their 0.6 m (`tests/avoidance`). The ellipsoid must therefore be larger than the robot. Robots
//! that start before they received each other's reports have no guarantee at all.
//!
//! The filter knows nothing of robots that do not report. A silent robot is forgotten when its last report
//! reaches the largest age.
//!
//! # Walls and obstacles
//! Walls bound the space, and columns stand in it ([`Obstacle`]): a robot's position keeps the horizontal
//! half-axis from each column, above it too. A column does not move away, so its plane stands at its
//! surface and the robot keeps the whole distance; the guarantee then holds as between robots. A robot
//! that hovers does not move away either: the halves of both still keep two half-axes between them.
//!
//! # Deadlock
//! Robots with opposite ways block each other for ever in cells alone. A right-hand rule breaks the
//! symmetry, as in the paper: while the nearest velocity of the cell has less than half of the
//! wanted progress, the wanted velocity turns more and more to its own right; the turn fades when
//! the way is free. All robots that meet so circle in the same sense, and pass columns and hovering robots
//! on the right. Where walls or columns close this way, the robot tries the other side after some seconds.
//! The rule is no guarantee: robots that hover at their goals do not give way, and may enclose the goal
//! of another one; and a robot that enters a bay finds no way back.
//!
//! # Cost
//! Instructions of one call of [`Avoidance::limit`] with ten peers, measured with QEMU 7.2 and
//! `-icount` on a Cortex-M4F at `opt-level = "s"` over 100 random arrangements each: 5 300 if all
//! are far away, 9 400 (at most 17 000) if all touch, 11 000 (at most 20 000) if all overlap. A
//! report takes 520 at most, and each column 3 000 more. An `Avoidance<10>` has 740 bytes. Code takes
//! 8 KB without columns.

mod cell;
mod half_space;
mod obstacle;
mod peers;
mod segment;
mod settings;

pub use obstacle::{OBSTACLES_MAX, Obstacle};
pub use peers::{PeerReport, RefusedReport};
pub use settings::AvoidanceSettings;

use cell::VelocityCell;
use glam::Vec3;
use half_space::HalfSpace;
use peers::{Peer, PeerTable, is_in_range};
use segment::{LineSegment, nearest_points};

/// The way in which a safe velocity was found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AvoidanceOutcome {
    /// The wanted velocity is safe.
    Free,
    /// The velocity is the one of the cell nearest to the wanted one.
    Limited,
    /// The way is blocked: the velocity is the one nearest to the wanted one turned to the side.
    SideStep,
    /// No velocity satisfies all neighbors: the robot retreats without approaching any of those
    /// that are too near, or stops.
    Crowded,
    /// The own position or velocity is not finite or above 10 000 m or m/s: the robot stops.
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
/// Rate in rad/s at which a blocked robot turns its wanted velocity to the side.
const TURN_RATE_RAD_S: f32 = 3.0;
/// Rate in rad/s at which the turn fades on a free way.
const RETURN_RATE_RAD_S: f32 = 0.4;
/// Largest turn in rad.
const TURN_RAD_MAX: f32 = 2.4;
/// Longest time in ms between two calls that counts for the turn.
const TICK_MS_MAX: u32 = 200;
/// Time in seconds in which a robot that turns aside leaves a place. In a corner it does not, and tries
/// the other side.
const HELD_S_MAX: f32 = 4.0;
/// Distance in half-axes from a place that a robot has left.
const LEFT_HALF_AXES: f32 = 2.0;

/// The collision avoidance of one robot that knows at most `N` others.
#[derive(Clone, Debug)]
pub struct Avoidance<const N: usize> {
    own_id: u16,
    settings: AvoidanceSettings,
    peers: PeerTable<N>,
    /// Position at the last call of [`Avoidance::limit`].
    position_m: Vec3,
    limited_at_ms: u32,
    obstacles: [Option<Obstacle>; OBSTACLES_MAX],
    turn_rad: f32,
    /// 1 turns to the right, -1 to the left.
    side: f32,
    /// The place near which the robot has turned aside for this time in seconds, and met a wall.
    held_at_m: Vec3,
    held_s: f32,
    has_met_wall: bool,
}

impl<const N: usize> Avoidance<N> {
    /// Returns `None` if a setting is not finite or not positive, or if the space is empty. Numbers
    /// of robots differ; the own one decides the direction of two robots at the same point.
    pub fn new(own_id: u16, settings: AvoidanceSettings) -> Option<Self> {
        settings.is_valid().then(|| Avoidance {
            own_id,
            settings,
            peers: PeerTable::new(),
            position_m: Vec3::ZERO,
            limited_at_ms: 0,
            obstacles: [None; OBSTACLES_MAX],
            turn_rad: 0.0,
            side: 1.0,
            held_at_m: Vec3::ZERO,
            held_s: 0.0,
            has_met_wall: false,
        })
    }

    /// Replaces the obstacles by those of these that are nearest to the position of the last call of
    /// [`Avoidance::limit`]. An obstacle with a wrong number does not count.
    pub fn set_obstacles(&mut self, obstacles: impl IntoIterator<Item = Obstacle>) {
        self.obstacles = [None; OBSTACLES_MAX];
        let square = |known: &Option<Obstacle>| {
            known.map_or(f32::INFINITY, |known| known.distance_squared(self.position_m))
        };
        for new in obstacles.into_iter().filter(Obstacle::is_valid) {
            let new = Some(new);
            let farthest = self
                .obstacles
                .iter_mut()
                .max_by(|first, second| square(first).total_cmp(&square(second)));
            if let Some(place) = farthest.filter(|place| square(&new) < square(place)) {
                *place = new;
            }
        }
    }

    /// Stores the report of another robot. A full table keeps the robots nearest to the position of
    /// the last call of [`Avoidance::limit`].
    pub fn update_peer(&mut self, report: PeerReport) -> Result<(), RefusedReport> {
        if report.id == self.own_id {
            return Err(RefusedReport::OwnId);
        }
        self.peers.update(report, self.position_m)
    }

    /// Returns the velocity to command until the next call, for the own motion and the wanted
    /// velocity, all in the world frame.
    ///
    /// A wanted velocity above the largest speed is shortened first; one that is not finite counts
    /// as zero. A robot with a period of 100 ms calls this once per period.
    pub fn limit(
        &mut self,
        position_m: Vec3,
        velocity_m_s: Vec3,
        wanted_m_s: Vec3,
        now_ms: u32,
    ) -> SafeVelocity {
        self.peers.drop_older_than(self.settings.peer_age_ms(), now_ms);
        let tick_ms = now_ms.wrapping_sub(self.limited_at_ms).min(TICK_MS_MAX);
        self.limited_at_ms = now_ms;
        if !is_in_range(position_m) || !is_in_range(velocity_m_s) {
            return SafeVelocity { velocity_m_s: Vec3::ZERO, outcome: AvoidanceOutcome::Lost };
        }
        self.position_m = position_m;
        let speed_m_s = self.settings.speed_m_s;
        let wanted = if wanted_m_s.is_finite() { wanted_m_s } else { Vec3::ZERO };
        let wanted = wanted.clamp_length_max(speed_m_s);
        let own =
            LineSegment { from: position_m, to: position_m + self.settings.lag_s * velocity_m_s };

        let mut cell = VelocityCell::<N>::new(self.walls(own.to));
        let AvoidanceSettings { radius_m, horizon_s, .. } = self.settings;
        for (space, obstacle) in cell.obstacles.iter_mut().zip(self.obstacles.iter().flatten()) {
            *space = obstacle.half_space(own, radius_m, horizon_s);
        }
        for (space, peer) in cell.peers.iter_mut().zip(self.peers.iter()) {
            *space = self.peer_half_space(own, peer, now_ms);
        }
        let Some(straight) = cell.nearest_slow(wanted, speed_m_s) else {
            let velocity_m_s = cell.retreat(speed_m_s);
            return SafeVelocity { velocity_m_s, outcome: AvoidanceOutcome::Crowded };
        };
        let tick_s = tick_ms as f32 * 1e-3;
        self.update_turn(straight, wanted, tick_s);
        if self.turn_rad > 0.0 {
            let turned = turn_right(wanted, self.side * self.turn_rad);
            self.change_side(cell.is_walled(turned) || cell.is_walled(wanted), tick_s);
            if let Some(velocity_m_s) = cell.nearest_slow(turned, speed_m_s) {
                return SafeVelocity { velocity_m_s, outcome: AvoidanceOutcome::SideStep };
            }
        }
        let is_free = straight == wanted;
        let outcome = if is_free { AvoidanceOutcome::Free } else { AvoidanceOutcome::Limited };
        SafeVelocity { velocity_m_s: straight, outcome }
    }

    fn update_turn(&mut self, straight: Vec3, wanted: Vec3, tick_s: f32) {
        let is_moving = wanted.length() > STAY_SPEED_M_S;
        let is_blocked = straight.dot(wanted) < BLOCKED_PROGRESS * wanted.length_squared();
        let rate = if is_moving && is_blocked { TURN_RATE_RAD_S } else { -RETURN_RATE_RAD_S };
        self.turn_rad = (self.turn_rad + rate * tick_s).clamp(0.0, TURN_RAD_MAX);
    }

    /// Tries the other side if the robot turns aside at a wall without leaving the place.
    fn change_side(&mut self, is_walled: bool, tick_s: f32) {
        let left_m = LEFT_HALF_AXES * self.settings.radius_m;
        if self.position_m.distance(self.held_at_m) > left_m {
            self.held_at_m = self.position_m;
            self.held_s = 0.0;
            self.has_met_wall = false;
        }
        self.held_s += tick_s;
        self.has_met_wall |= is_walled;
        if self.held_s > HELD_S_MAX && self.has_met_wall {
            self.side = -self.side;
            self.held_s = 0.0;
        }
    }

    /// Returns the velocities that keep the own stopping point on the own side of the plane halfway
    /// to a peer.
    fn peer_half_space(&self, own: LineSegment, peer: Peer, now_ms: u32) -> HalfSpace {
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
        // The peer may have moved meanwhile, which moves the plane by half of the way. It is a
        // reason to come no nearer, but not to retreat.
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

/// Turns a velocity to its right about the vertical axis; a vertical one turns towards x if it
/// rises and away from x if it sinks.
fn turn_right(velocity: Vec3, turn_rad: f32) -> Vec3 {
    let sideways = velocity.cross(Vec3::Z);
    let right = sideways.try_normalize().unwrap_or(Vec3::X * velocity.z.signum());
    let (sine, cosine) = libm::sincosf(turn_rad);
    cosine * velocity + sine * velocity.length() * right
}
