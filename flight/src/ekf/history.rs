//! The recent past of position and attitude, for measurements that arrive late.

use glam::{Quat, Vec3};

use super::renormalized;

/// Least time between two entries in seconds. A rotation that accelerates by 100 rad/s² deviates by
/// 0.3 mrad from the line between two of them.
const INTERVAL_S: f32 = 0.005;
/// Number of entries: 100 ms.
const ENTRIES: usize = 21;

/// Position and attitude at one moment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Placement {
    /// Position in the world frame, in m.
    pub position_m: Vec3,
    /// Rotation from the body frame to the world frame.
    pub attitude: Quat,
}

#[derive(Clone, Copy, Debug)]
struct PastEntry {
    placement: Placement,
    /// Time from this entry to the next one, in seconds.
    seconds: f32,
}

/// A ring of the last 100 ms.
///
/// A correction of the present also holds for the past, or else a late measurement would count the
/// same error twice. So corrections add up in `correction`, and entries are stored without it.
#[derive(Clone, Copy, Debug)]
pub(super) struct PastPlacements {
    entries: [PastEntry; ENTRIES],
    newest: usize,
    count: usize,
    since_newest_s: f32,
    correction: Placement,
}

const NO_CORRECTION: Placement = Placement { position_m: Vec3::ZERO, attitude: Quat::IDENTITY };

impl PastPlacements {
    /// Starts with the present as the only known moment.
    pub fn new(present: Placement) -> Self {
        PastPlacements {
            entries: [PastEntry { placement: present, seconds: 0.0 }; ENTRIES],
            newest: 0,
            count: 1,
            since_newest_s: 0.0,
            correction: NO_CORRECTION,
        }
    }

    /// Lets `seconds` pass, after which `present` is the placement.
    pub fn advance(&mut self, seconds: f32, present: Placement) {
        self.since_newest_s += seconds;
        if self.since_newest_s < 0.99 * INTERVAL_S {
            return;
        }
        if let Some(entry) = self.entries.get_mut(self.newest) {
            entry.seconds = self.since_newest_s;
        }
        self.newest = (self.newest + 1) % ENTRIES;
        if self.newest == 0 {
            self.apply_correction();
        }
        let placement = Placement {
            position_m: present.position_m - self.correction.position_m,
            attitude: self.correction.attitude.conjugate() * present.attitude,
        };
        if let Some(entry) = self.entries.get_mut(self.newest) {
            *entry = PastEntry { placement, seconds: 0.0 };
        }
        self.count = (self.count + 1).min(ENTRIES);
        self.since_newest_s = 0.0;
    }

    /// Moves the whole past as the present moves from `from` to `to`.
    pub fn correct(&mut self, from: Placement, to: Placement) {
        self.correction.position_m += to.position_m - from.position_m;
        let turn = to.attitude * from.attitude.conjugate();
        self.correction.attitude = renormalized(turn * self.correction.attitude);
    }

    /// Returns the placement `age_s` seconds ago, interpolated, or `None` when the ring does not
    /// reach as far.
    pub fn at(&self, age_s: f32, present: Placement) -> Option<Placement> {
        if age_s <= 0.0 {
            return Some(present);
        }
        // Entries between the present and the one that is `older_age_s` old.
        let mut younger = None;
        let mut younger_age_s = 0.0;
        let mut older_age_s = self.since_newest_s;
        for steps in 0..self.count {
            let index = (self.newest + ENTRIES - steps) % ENTRIES;
            let entry = self.entries.get(index)?;
            if steps > 0 {
                older_age_s += entry.seconds;
            }
            // Ages are sums of rounded intervals, so the comparison leaves one microsecond.
            if age_s <= older_age_s + 1e-6 {
                let span = older_age_s - younger_age_s;
                let older = self.corrected(&entry.placement);
                let younger = younger.map_or(present, |entry| self.corrected(entry));
                let share = if span > 0.0 { (age_s - younger_age_s) / span } else { 0.0 };
                return Some(Placement {
                    position_m: younger.position_m.lerp(older.position_m, share),
                    attitude: younger.attitude.lerp(older.attitude, share),
                });
            }
            younger = Some(&entry.placement);
            younger_age_s = older_age_s;
        }
        None
    }

    /// Returns the age in seconds up to which the ring reaches.
    pub fn reach_s(&self) -> f32 {
        let past = (0..self.count).map(|steps| {
            let index = (self.newest + ENTRIES - steps) % ENTRIES;
            self.entries.get(index).map_or(0.0, |entry| entry.seconds)
        });
        self.since_newest_s + past.skip(1).sum::<f32>()
    }

    fn corrected(&self, placement: &Placement) -> Placement {
        Placement {
            position_m: placement.position_m + self.correction.position_m,
            attitude: self.correction.attitude * placement.attitude,
        }
    }

    /// Applies the correction to all entries, so that it does not grow without bound.
    fn apply_correction(&mut self) {
        let correction = self.correction;
        for entry in &mut self.entries {
            entry.placement.position_m += correction.position_m;
            entry.placement.attitude = correction.attitude * entry.placement.attitude;
        }
        self.correction = NO_CORRECTION;
    }
}
