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
    /// Velocity in the world frame, in m/s. Zero if the robot does not report it; this costs
    /// separation, see [`super::Avoidance`].
    pub velocity_m_s: Vec3,
    /// Time of the measurement by the own clock: the time of reception minus the expected delay.
    pub measured_at_ms: u32,
}

impl PeerReport {
    /// Returns the age of the report, 0 if its time lies ahead.
    pub(super) fn age_ms(&self, now_ms: u32) -> u32 {
        let age_ms = now_ms.wrapping_sub(self.measured_at_ms);
        if age_ms > u32::MAX / 2 { 0 } else { age_ms }
    }

    /// Returns the segment from the position to the point where the robot would come to rest.
    pub(super) fn stopping_segment(&self, lag_s: f32) -> LineSegment {
        LineSegment { from: self.position_m, to: self.position_m + lag_s * self.velocity_m_s }
    }
}

/// A cause why a report is not in the table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RefusedReport {
    /// A number is not finite.
    NotFinite,
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
    peers: [Option<PeerReport>; N],
}

impl<const N: usize> PeerTable<N> {
    pub fn new() -> Self {
        PeerTable { peers: [None; N] }
    }

    pub fn iter(&self) -> impl Iterator<Item = PeerReport> + Clone + '_ {
        self.peers.iter().copied().flatten()
    }

    pub fn drop_older_than(&mut self, age_ms: u32, now_ms: u32) {
        for peer in &mut self.peers {
            if peer.is_some_and(|report| report.age_ms(now_ms) > age_ms) {
                *peer = None;
            }
        }
    }

    /// Stores a report. A full table loses the robot farthest from `own_position_m`.
    pub fn update(&mut self, new: PeerReport, own_position_m: Vec3) -> Result<(), RefusedReport> {
        if !new.position_m.is_finite() || !new.velocity_m_s.is_finite() {
            return Err(RefusedReport::NotFinite);
        }
        let has_id = |peer: &Option<PeerReport>| peer.is_some_and(|old| old.id == new.id);
        if let Some(peer) = self.peers.iter_mut().find(|peer| has_id(peer)) {
            if peer.is_some_and(|old| is_later(old.measured_at_ms, new.measured_at_ms)) {
                return Err(RefusedReport::Outdated);
            }
            *peer = Some(new);
            return Ok(());
        }
        // A free place counts as infinitely far.
        let distance = |peer: &Option<PeerReport>| {
            peer.map_or(f32::INFINITY, |p| p.position_m.distance_squared(own_position_m))
        };
        let farthest = self.peers.iter_mut().max_by(|a, b| distance(a).total_cmp(&distance(b)));
        match farthest {
            Some(place) if distance(&Some(new)) < distance(place) => {
                *place = Some(new);
                Ok(())
            }
            _ => Err(RefusedReport::FartherThanAll),
        }
    }
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
        PeerReport { id, position_m, velocity_m_s: Vec3::ZERO, measured_at_ms }
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
    fn numbers_that_are_not_finite_are_refused() {
        let mut table = PeerTable::<2>::new();
        let refused = Err(RefusedReport::NotFinite);
        assert_eq!(table.update(report(1, f32::NAN, 0), Vec3::ZERO), refused);
        let fast = PeerReport { velocity_m_s: Vec3::INFINITY, ..report(1, 0.0, 0) };
        assert_eq!(table.update(fast, Vec3::ZERO), refused);
    }
}
