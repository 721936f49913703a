//! The velocities that keep a robot in its cell.

use super::half_space::{HalfSpace, nearest_point};
use super::obstacle::OBSTACLES_MAX;
use glam::Vec3;

/// A half-space that contains all velocities.
const EVERYTHING: HalfSpace = HalfSpace { normal: Vec3::X, bound: f32::INFINITY };

/// The intersection of the half-spaces of the walls, of obstacles and of at most `N` peers, in m/s.
pub(super) struct VelocityCell<const N: usize> {
    walls: [HalfSpace; 6],
    pub obstacles: [HalfSpace; OBSTACLES_MAX],
    pub peers: [HalfSpace; N],
}

impl<const N: usize> VelocityCell<N> {
    /// Returns a cell without obstacles and peers.
    pub fn new(walls: [HalfSpace; 6]) -> Self {
        VelocityCell { walls, obstacles: [EVERYTHING; OBSTACLES_MAX], peers: [EVERYTHING; N] }
    }

    fn iter(&self) -> impl Iterator<Item = HalfSpace> + Clone + '_ {
        let all = self.walls.iter().chain(&self.obstacles).chain(&self.peers);
        all.copied().filter(|space| space.bound.is_finite())
    }

    /// Returns true if a wall or an obstacle forbids a velocity.
    pub fn is_walled(&self, velocity_m_s: Vec3) -> bool {
        self.walls.iter().chain(&self.obstacles).any(|space| space.excess(velocity_m_s) > 0.0)
    }

    /// Returns the velocity of the cell nearest to `wanted`, or `None` if no velocity of the cell
    /// is slow enough.
    ///
    /// Only a cell without the origin makes the nearest velocity faster than `wanted`. The answer
    /// then lies between the nearest and the slowest velocity of the cell.
    pub fn nearest_slow(&self, wanted: Vec3, speed_m_s: f32) -> Option<Vec3> {
        let nearest = self.nearest(wanted)?;
        if nearest.length() <= speed_m_s {
            return Some(nearest);
        }
        let slowest = self.nearest(Vec3::ZERO)?;
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
        Some(slowest + share.clamp(0.0, 1.0) * way)
    }

    /// Returns the fallback of a crowded cell: away from all violated boundaries together, without
    /// coming nearer to one of them.
    pub fn retreat(mut self, speed_m_s: f32) -> Vec3 {
        let away: Vec3 = self.iter().map(|space| space.bound.min(0.0) * space.normal).sum();
        for space in self.walls.iter_mut().chain(&mut self.obstacles).chain(&mut self.peers) {
            // The half-space now contains the origin, so the intersection is not empty.
            space.bound = space.bound.max(0.0);
        }
        self.nearest(away.clamp_length_max(speed_m_s)).unwrap_or(Vec3::ZERO)
    }

    fn nearest(&self, wanted: Vec3) -> Option<Vec3> {
        nearest_point(self.iter(), wanted)
    }
}
