//! The table of other robots.

use super::segment::LineSegment;
use glam::Vec3;

/// The motion of another robot, as it reported.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PeerReport {
    /// Number of the robot in the swarm.
    pub id: u16,
    /// Position in the world frame, in m.
    pub position_m: Vec3,
    /// Velocity in the world frame, in m/s. Without it, the table estimates the velocity from the
    /// reported positions, which costs separation.
    pub velocity_m_s: Option<Vec3>,
    /// Time of the measurement by the own clock: the time of reception minus the expected delay.
    pub measured_at_ms: u32,
}

/// Time constant in seconds of the velocity estimated from positions: a compromise between the
/// noise of two positions (14 cm/s for 1 cm each and 0.1 s between) and the delay of the estimate.
const VELOCITY_FILTER_S: f32 = 0.1;

/// The newest motion of another robot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Peer {
    pub id: u16,
    pub position_m: Vec3,
    pub velocity_m_s: Vec3,
    pub measured_at_ms: u32,
}

impl Peer {
    fn new(report: PeerReport) -> Self {
        Peer {
            id: report.id,
            position_m: report.position_m,
            velocity_m_s: report.velocity_m_s.unwrap_or(Vec3::ZERO),
            measured_at_ms: report.measured_at_ms,
        }
    }

    /// Returns the motion after a further report of the same robot.
    fn updated(self, report: PeerReport) -> Self {
        let later_s = report.measured_at_ms.wrapping_sub(self.measured_at_ms) as f32 * 1e-3;
        let estimate = if later_s > 0.0 {
            let measured = (report.position_m - self.position_m) / later_s;
            self.velocity_m_s.lerp(measured, later_s / (later_s + VELOCITY_FILTER_S))
        } else {
            self.velocity_m_s
        };
        Peer { velocity_m_s: report.velocity_m_s.unwrap_or(estimate), ..Peer::new(report) }
    }

    /// Returns the age in ms, 0 if the time of the measurement lies ahead.
    pub fn age_ms(&self, now_ms: u32) -> u32 {
        if is_later(self.measured_at_ms, now_ms) {
            0
        } else {
            now_ms.wrapping_sub(self.measured_at_ms)
        }
    }

    /// Returns the segment from the position to the point where the robot would come to rest.
    pub fn stopping_segment(&self, lag_s: f32) -> LineSegment {
        LineSegment { from: self.position_m, to: self.position_m + lag_s * self.velocity_m_s }
    }
}

/// A cause why a report is not in the table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RefusedReport {
    /// A number is not finite, or larger than 10 000 m or m/s.
    OutOfRange,
    /// The report has the number of the own robot.
    OwnId,
    /// The table has a newer report of this robot.
    Outdated,
    /// The table is full and all its robots are nearer.
    FartherThanAll,
}

/// The newest report of each of at most `N` robots.
#[derive(Clone, Debug)]
pub(super) struct PeerTable<const N: usize> {
    peers: [Option<Peer>; N],
}

impl<const N: usize> PeerTable<N> {
    pub fn new() -> Self {
        PeerTable { peers: [None; N] }
    }

    pub fn iter(&self) -> impl Iterator<Item = Peer> + Clone + '_ {
        self.peers.iter().copied().flatten()
    }

    pub fn drop_older_than(&mut self, age_ms: u32, now_ms: u32) {
        for peer in &mut self.peers {
            if peer.is_some_and(|known| known.age_ms(now_ms) > age_ms) {
                *peer = None;
            }
        }
    }

    /// Stores a report. A full table loses the robot farthest from `own_position_m`.
    pub fn update(&mut self, new: PeerReport, own_position_m: Vec3) -> Result<(), RefusedReport> {
        if !is_in_range(new.position_m) || !new.velocity_m_s.is_none_or(is_in_range) {
            return Err(RefusedReport::OutOfRange);
        }
        if let Some(known) = self.peers.iter_mut().flatten().find(|known| known.id == new.id) {
            if is_later(known.measured_at_ms, new.measured_at_ms) {
                return Err(RefusedReport::Outdated);
            }
            *known = known.updated(new);
            return Ok(());
        }
        // A free place counts as infinitely far.
        let square = |position_m: Vec3| position_m.distance_squared(own_position_m);
        let place_square =
            |place: &Option<Peer>| place.map_or(f32::INFINITY, |known| square(known.position_m));
        let farthest = self
            .peers
            .iter_mut()
            .max_by(|first, second| place_square(first).total_cmp(&place_square(second)));
        match farthest {
            Some(place) if square(new.position_m) < place_square(place) => {
                *place = Some(Peer::new(new));
                Ok(())
            }
            _ => Err(RefusedReport::FartherThanAll),
        }
    }
}

/// Returns true if f32 represents all coordinates to 1 mm (m) or 1 mm/s (m/s). Not finite ones
/// fail.
pub(super) fn is_in_range(vector: Vec3) -> bool {
    vector.abs().max_element() <= 1e4 && vector.is_finite()
}

/// Returns true if `first_ms` is later than `second_ms` on a clock that wraps around.
fn is_later(first_ms: u32, second_ms: u32) -> bool {
    first_ms != second_ms && first_ms.wrapping_sub(second_ms) <= u32::MAX / 2
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    fn report(id: u16, x_m: f32, measured_at_ms: u32) -> PeerReport {
        let position_m = Vec3::new(x_m, 0.0, 0.0);
        PeerReport { id, position_m, velocity_m_s: None, measured_at_ms }
    }

    fn ids<const N: usize>(table: &PeerTable<N>) -> Vec<u16> {
        let mut ids: Vec<u16> = table.iter().map(|peer| peer.id).collect();
        ids.sort_unstable();
        ids
    }

    #[test]
    fn a_full_table_keeps_the_nearest_robots() {
        let mut table = PeerTable::<2>::new();
        assert_eq!(table.update(report(1, 1.0, 0), Vec3::ZERO), Ok(()));
        assert_eq!(table.update(report(2, 3.0, 0), Vec3::ZERO), Ok(()));
        let far = table.update(report(3, 4.0, 0), Vec3::ZERO);
        assert_eq!(far, Err(RefusedReport::FartherThanAll));
        assert_eq!(table.update(report(4, 2.0, 0), Vec3::ZERO), Ok(()));
        assert_eq!(ids(&table), [1, 4]);
    }

    #[test]
    fn a_late_report_does_not_replace_a_newer_one() {
        let mut table = PeerTable::<2>::new();
        assert_eq!(table.update(report(1, 1.0, 5), Vec3::ZERO), Ok(()));
        let late = table.update(report(1, 2.0, u32::MAX), Vec3::ZERO);
        assert_eq!(late, Err(RefusedReport::Outdated));
        assert_eq!(table.update(report(1, 3.0, 6), Vec3::ZERO), Ok(()));
        assert_eq!(table.iter().map(|peer| peer.position_m.x).collect::<Vec<_>>(), [3.0]);
    }

    #[test]
    fn old_reports_go_also_when_the_clock_wraps() {
        let mut table = PeerTable::<2>::new();
        assert_eq!(table.update(report(1, 1.0, u32::MAX - 99), Vec3::ZERO), Ok(()));
        table.drop_older_than(200, 100);
        assert_eq!(ids(&table), [1]);
        table.drop_older_than(200, 101);
        assert_eq!(ids(&table), []);
    }

    #[test]
    fn the_velocity_follows_from_positions() {
        let mut table = PeerTable::<2>::new();
        for step in 0..20u16 {
            // 0.4 m/s along x from a clock that wraps around.
            let at_ms = (u32::MAX - 500).wrapping_add(100 * u32::from(step));
            let moved = report(1, 0.04 * f32::from(step), at_ms);
            assert_eq!(table.update(moved, Vec3::ZERO), Ok(()));
        }
        let estimate = table.iter().next().unwrap().velocity_m_s;
        assert!(estimate.distance(Vec3::new(0.4, 0.0, 0.0)) < 1e-3, "{estimate}");
        let sent = PeerReport { velocity_m_s: Some(Vec3::Y), ..report(1, 1.0, 5000) };
        assert_eq!(table.update(sent, Vec3::ZERO), Ok(()));
        assert_eq!(table.iter().next().unwrap().velocity_m_s, Vec3::Y);
    }

    #[test]
    fn numbers_out_of_range_are_refused() {
        let mut table = PeerTable::<2>::new();
        let refused = Err(RefusedReport::OutOfRange);
        assert_eq!(table.update(report(1, f32::NAN, 0), Vec3::ZERO), refused);
        let fast = PeerReport { velocity_m_s: Some(Vec3::new(0.0, 1e5, 0.0)), ..report(1, 0.0, 0) };
        assert_eq!(table.update(fast, Vec3::ZERO), refused);
    }
}
