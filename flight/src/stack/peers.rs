//! The places of other robots, as far as they show whose poses a robot receives.

use glam::Vec3;

/// Number of robots that are remembered; the one heard longest ago is forgotten first.
const PEERS: usize = 8;
/// Time in ms for which a robot counts as being where it was heard.
const HEARD_MS: u64 = 1000;
/// Distance in m below which two places may be of one robot: its size and the way of 0.2 s at 0.5 m/s.
const NEAR_M: f32 = 0.2;

/// The places of other robots, with the time in ms at which each was heard.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct HeardPeers {
    heard: [Option<(Vec3, u64)>; PEERS],
    next: usize,
}

impl HeardPeers {
    /// Takes the place of another robot.
    pub fn hear(&mut self, position_m: Vec3, now_ms: u64) {
        if let Some(heard) = self.heard.get_mut(self.next) {
            *heard = Some((position_m, now_ms));
        }
        self.next = (self.next + 1) % PEERS;
    }

    /// Returns true if another robot was heard near this place lately.
    pub fn has_near(&self, position_m: Vec3, now_ms: u64) -> bool {
        let is_near = |(heard_m, heard_ms): &(Vec3, u64)| {
            now_ms.saturating_sub(*heard_ms) < HEARD_MS
                && heard_m.distance_squared(position_m) < NEAR_M * NEAR_M
        };
        self.heard.iter().flatten().any(is_near)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn robots_are_remembered_for_a_second() {
        let mut peers = HeardPeers::default();
        peers.hear(Vec3::X, 1000);
        assert!(peers.has_near(Vec3::X * 1.1, 1999));
        assert!(!peers.has_near(Vec3::X * 1.3, 1999) && !peers.has_near(Vec3::X, 2000));
        (0..PEERS).for_each(|_| peers.hear(Vec3::Y, 1001));
        assert!(!peers.has_near(Vec3::X, 1002) && peers.has_near(Vec3::Y, 1002));
    }
}
