//! A simulated projector and a robot under it, in floating point. They are built from the
//! documented facts, not from the code under test.

use bittybuzz_motion::Angle;
use bittybuzz_motion::projector::{Decoder, READABLE_US};
use bittybuzz_motion::track::{TrackedPose, Tracker};
use bittybuzz_random::Random;

/// The length of a pattern and of a frame, in seconds.
pub const PATTERN: f64 = 333e-6;
pub const FRAME: f64 = 41.0 * PATTERN;

/// x and y in mm, heading in radians, anticlockwise from x.
#[derive(Clone, Copy, Debug, Default)]
pub struct Truth {
    pub x: f64,
    pub y: f64,
    pub heading: f64,
}

/// Returns true if the projector's pattern `k` is white at a pixel (the makers' bitmaps).
pub fn pattern(k: usize, column: u32, row: u32) -> bool {
    let gray = |n: u32| n ^ (n / 2);
    match k {
        0 => false,
        1..=10 => gray(column) & (1 << (10 - k)) != 0,
        11..=20 => gray(row) & (1 << (20 - k)) != 0,
        _ => true,
    }
}

/// Returns the pixel at a place in mm: 883 columns are 812.8 mm, 558 rows 508 mm, and the middle of
/// columns 56 to 967 and of rows 227 to 796 is the origin.
pub fn pixel([x, y]: [f64; 2]) -> (u32, u32) {
    let (column, row) = (511.5 + x * 883.0 / 812.8, 511.5 - y * 558.0 / 508.0);
    (column.round() as u32, row.round() as u32)
}

/// Returns the places of the photodiodes: 1 on the right, 2 on the left, 19.6 mm apart.
pub fn diodes(truth: Truth) -> [[f64; 2]; 2] {
    let (sin, cos) = truth.heading.sin_cos();
    [9.8, -9.8].map(|aside| [truth.x + aside * sin, truth.y - aside * cos])
}

/// Generates the edges that the photodiodes see while the robot moves: time in µs, diode, and true
/// if there is light now.
pub struct Light {
    levels: [bool; 2],
    /// The share of frames that are not shown. They are evenly spread, so that no two of a small
    /// share follow each other.
    lost: f64,
    /// The sum of the shares since the last lost frame; a frame is lost when it reaches 1.
    loss: f64,
    /// The time in µs by which an edge is early on average. The actual value is random, from 0 to
    /// twice as much.
    jitter: f64,
    noise: Random,
    is_lost: bool,
    next: f64,
}

impl Light {
    pub fn new(lost: f64, jitter: f64, seed: u64) -> Self {
        let noise = Random::new(seed);
        Light { levels: [false; 2], lost, loss: 0.0, jitter, noise, is_lost: false, next: 0.0 }
    }

    /// Returns the edges of one step of 9 µs.
    pub fn step(&mut self, time: f64, truth: Truth) -> Vec<(u32, usize, bool)> {
        if time >= self.next {
            self.loss += self.lost;
            self.is_lost = self.loss >= 1.0;
            self.loss = self.loss.fract();
            self.next += FRAME;
        }
        let k = ((time.rem_euclid(FRAME)) / PATTERN) as usize;
        let mut edges = Vec::new();
        for (diode, place) in diodes(truth).into_iter().enumerate() {
            let (column, row) = pixel(place);
            let level = !self.is_lost && pattern(k.min(40), column, row);
            if level != self.levels[diode] {
                self.levels[diode] = level;
                let early = 2.0 * self.noise.unit() * self.jitter;
                edges.push(((time * 1e6 - early + 100.0) as u32, diode, level));
            }
        }
        edges
    }
}

/// The firmware's part: decodes the edges and tracks the pose.
pub struct Robot {
    pub decoders: [Decoder; 2],
    pub tracker: Tracker,
    levels: [bool; 2],
}

impl Robot {
    pub fn new() -> Self {
        let decoders = [Decoder::new(); 2];
        Robot { decoders, tracker: Tracker::new(), levels: [false; 2] }
    }

    pub fn edge(&mut self, (at, diode, is_lit): (u32, usize, bool)) {
        self.decoders[diode].edge(at as u16);
        self.levels[diode] = is_lit;
    }

    /// Returns the beginning of the frame that was read just now, if there is one.
    pub fn task(&mut self, now: u32) -> Option<u32> {
        let age = u32::from((now as u16).wrapping_sub(self.decoders[0].begun()?));
        if age < READABLE_US {
            return None;
        }
        let start = now.wrapping_sub(age);
        let [right, left] = [0, 1].map(|diode| self.decoders[diode].pixel(self.levels[diode]));
        self.tracker.see(start, right?, left?);
        Some(start)
    }
}

/// Returns the error of a pose in mm and radians.
pub fn error(pose: &TrackedPose, truth: Truth) -> (f64, f64) {
    let (x, y) = (f64::from(pose.x) / 16.0 - truth.x, f64::from(pose.y) / 16.0 - truth.y);
    let turn = radians(pose.heading) - truth.heading;
    (x.hypot(y), turn.sin().atan2(turn.cos()))
}

pub fn radians(angle: Angle) -> f64 {
    f64::from(angle.0) * std::f64::consts::PI / 32768.0
}
