//! The air between robots.

use crate::link::Received;
use crate::random::Random;

/// Distance in mm, azimuth and elevation in radians of a sender, as the receiver sees it.
pub type Place = [f32; 3];

/// A sender that is no robot, as every robot sees it.
pub(crate) const OUTSIDE: Place = [50.0, 0.0, 0.0];

/// A frame that a robot sends.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct OnAir {
    /// Steps of the swarm before this one.
    pub step: u32,
    /// Number of the sender in the swarm; `None` for a frame from outside.
    pub from: Option<usize>,
    /// Its bytes.
    pub bytes: Vec<u8>,
}

/// Decides which frames arrive, when, and how many times. By default every frame reaches every
/// other robot once, in order.
pub struct Air {
    /// Returns whether a frame from one robot reaches another, both by number. Asked once for each
    /// frame and receiver.
    pub reaches: Box<dyn FnMut(usize, usize) -> bool>,
    /// Returns where the receiver (second) sees the sender (first).
    pub place: Box<dyn FnMut(usize, usize) -> Option<Place>>,
    /// Receives every frame that is sent, lost or not.
    pub observe: Box<dyn FnMut(&OnAir)>,
    /// Probability that a frame does not arrive at a receiver that it reaches.
    pub loss: f64,
    /// Probability that it arrives twice.
    pub duplication: f64,
    /// Probability that it arrives a step late, after the frames of that step.
    pub delay: f64,
    /// Frames that a robot sends per step at most; the others stay in its link.
    pub frames_per_step: usize,
    random: Random,
    /// Frames for the end of the next delivery, with their receivers.
    late: Vec<(usize, Received)>,
}

impl Default for Air {
    fn default() -> Self {
        Air {
            reaches: Box::new(|_, _| true),
            place: Box::new(in_a_row),
            observe: Box::new(|_| {}),
            loss: 0.0,
            duplication: 0.0,
            delay: 0.0,
            frames_per_step: usize::MAX,
            random: Random::new(0),
            late: Vec::new(),
        }
    }
}

/// Robots in a row that look along it, 10 mm from one to the next.
fn in_a_row(from: usize, to: usize) -> Option<Place> {
    let azimuth = if from > to { 0.0 } else { std::f32::consts::PI };
    Some([10.0 * to.abs_diff(from) as f32, azimuth, 0.0])
}

impl Air {
    /// Starts the random numbers from a seed.
    pub fn seed(&mut self, seed: u64) {
        self.random = Random::new(seed);
    }

    /// Returns what arrives of a frame at one receiver now. A sender that is no robot is 50 mm from
    /// every robot.
    pub(crate) fn carry(&mut self, from: Option<usize>, to: usize, bytes: &[u8]) -> Vec<Received> {
        let is_in_reach = from.is_none_or(|from| from != to && (self.reaches)(from, to));
        if !is_in_reach || self.random.chance(self.loss) {
            return Vec::new();
        }
        let place = match from {
            Some(from) => (self.place)(from, to),
            None => Some(OUTSIDE),
        };
        let frame = Received { place, ..Received::new(bytes) };
        let copies = 1 + usize::from(self.random.chance(self.duplication));
        let mut now = Vec::new();
        for _ in 0..copies {
            if self.random.chance(self.delay) {
                self.late.push((to, frame.clone()));
            } else {
                now.push(frame.clone());
            }
        }
        now
    }

    /// Takes the frames of the last delivery that are late.
    pub(crate) fn take_late(&mut self) -> Vec<(usize, Received)> {
        std::mem::take(&mut self.late)
    }
}
