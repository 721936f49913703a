//! The projector above the table, and the light of its Gray code at a photodiode.
//!
//! A frame is 41 patterns of 333 µs: one black, ten bits of x and ten of y, the most significant
//! first, and twenty white (TI DLP LightCrafter 4500 as SwarmUI sets it up; the values were decoded
//! from its bitmaps).

use bittybuzz_chips::{Random, Time};

/// Number of patterns in a frame, and the time for which each is shown.
pub(super) const PATTERNS: u32 = 41;
const PATTERN: Time = Time::from_micros(333);
pub(super) const FRAME: Time = Time::from_micros(333 * PATTERNS as u64);
/// Bits of each coordinate.
const BITS: u32 = 10;
/// The projected columns and rows, in steps of the code.
const COLUMNS: std::ops::RangeInclusive<f64> = 56.0..=967.0;
const ROWS: std::ops::RangeInclusive<f64> = 227.0..=796.0;
/// A step in mm, along x and along y (0.8128 m over 883 steps and 0.508 m over 558, position_control.c of SwarmUI).
pub const STEP_MM: [f64; 2] = [812.8 / 883.0, 508.0 / 558.0];
/// Distance from the middle of the robot to each photodiode, in mm (board layout, version 1.3).
const DIODE_MM: f64 = 9.8;

/// The pose and the velocity of a robot on the table.
///
/// Coordinates are the projector's: x to the right, y down as seen from above, both 0 where the
/// code is 0. Headings grow from x to y.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TablePose {
    /// x in mm.
    pub x_mm: f64,
    /// y in mm.
    pub y_mm: f64,
    /// The direction of the antenna, in degrees.
    pub heading_degrees: f64,
    /// Velocity along x and y, in mm/s.
    pub velocity_mm_s: [f64; 2],
    /// Rate of turn, in degrees per second.
    pub turn_degrees_s: f64,
}

impl TablePose {
    /// Returns the pose of a robot that stands still.
    #[cfg(test)]
    pub const fn at(x_mm: f64, y_mm: f64, heading_degrees: f64) -> Self {
        let (velocity_mm_s, turn_degrees_s) = ([0.0; 2], 0.0);
        TablePose { x_mm, y_mm, heading_degrees, velocity_mm_s, turn_degrees_s }
    }

    /// Returns the pose after a span.
    pub fn after(&self, span: Time) -> Self {
        let seconds = span.picos() as f64 * 1e-12;
        TablePose {
            x_mm: self.x_mm + self.velocity_mm_s[0] * seconds,
            y_mm: self.y_mm + self.velocity_mm_s[1] * seconds,
            heading_degrees: self.heading_degrees + self.turn_degrees_s * seconds,
            ..*self
        }
    }

    /// Returns the vector in mm from the middle of a robot with this heading to photodiode 0, on
    /// its right; photodiode 1 is opposite.
    fn arm(heading_degrees: f64) -> [f64; 2] {
        let (sin, cos) = (heading_degrees + 90.0).to_radians().sin_cos();
        [DIODE_MM * cos, DIODE_MM * sin]
    }

    /// Returns the positions of both photodiodes in mm, for a vector from `arm`.
    fn diodes(&self, [x, y]: [f64; 2]) -> [[f64; 2]; 2] {
        [[self.x_mm + x, self.y_mm + y], [self.x_mm - x, self.y_mm - y]]
    }
}

/// The faults of the projector's light.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LightDisturbance {
    /// Probability that a frame does not reach the robot: both diodes stay dark.
    pub lose: f64,
    /// The largest deviation of an edge in µs, early or late, uniformly distributed: 0 to
    /// [`LightDisturbance::JITTER_US_MAX`].
    pub jitter_us: f64,
    /// Glitches per second at each photodiode, as lamps and the resets of the projector's mirrors
    /// cause them. In a glitch of 1 to [`LightDisturbance::GLITCH_US_MAX`] µs the photodiode sees the
    /// opposite level.
    pub glitches_per_s: f64,
    /// Start of the pseudo-random sequence: equal seeds give equal faults.
    pub seed: u64,
}

impl LightDisturbance {
    /// The highest `jitter_us`: somewhat less than a pattern of 333 µs.
    pub const JITTER_US_MAX: f64 = 300.0;
    /// The longest glitch in µs: about a sixth of a pattern.
    pub const GLITCH_US_MAX: f64 = 50.0;
    /// The highest `glitches_per_s`: about three in each pattern.
    pub const GLITCHES_PER_S_MAX: f64 = 10_000.0;
}

/// Returns true if pattern number `pattern` is lit at `[x, y]` mm; nothing is lit outside the
/// picture.
pub(super) fn pattern(position_mm: [f64; 2], pattern: u32) -> bool {
    let steps = [0, 1].map(|axis| (position_mm[axis] / STEP_MM[axis]).round());
    if !COLUMNS.contains(&steps[0]) || !ROWS.contains(&steps[1]) {
        return false;
    }
    let bit = |step: f64, index: u32| gray(step as u32) >> (BITS - 1 - index) & 1 != 0;
    match pattern {
        0 => false,
        1..=10 => bit(steps[0], pattern - 1),
        11..=20 => bit(steps[1], pattern - 11),
        _ => true,
    }
}

fn gray(n: u32) -> u32 {
    n ^ n >> 1
}

/// The edges that the two photodiodes of a robot see, one after the other.
pub(super) struct Diodes {
    light: LightDisturbance,
    /// Edges of the frame that is shown, in order: time, photodiode and new level.
    edges: Vec<(Time, usize, bool)>,
    next: usize,
    /// The next frame, whose edges are not yet computed.
    frame: u64,
    levels: [bool; 2],
}

impl Diodes {
    /// Creates photodiodes that are dark until the first frame.
    pub fn new() -> Self {
        let light = LightDisturbance::default();
        Diodes { light, edges: Vec::new(), next: 0, frame: 0, levels: [false; 2] }
    }

    pub fn set_light(&mut self, light: LightDisturbance) {
        self.light = light;
    }

    /// Returns the time of the next edge or, after the last edge, of the next frame.
    pub fn next_event(&self) -> Time {
        match self.edges.get(self.next) {
            Some((at, _, _)) => *at,
            None => begin_of(self.frame),
        }
    }

    /// Returns a photodiode that changes at `now`, and its new level. `pose` is a pose of the robot
    /// and its time.
    pub fn advance(&mut self, now: Time, pose: Option<(Time, TablePose)>) -> Option<(usize, bool)> {
        if self.next == self.edges.len() && begin_of(self.frame) <= now {
            self.show(pose);
        }
        let (_, diode, level) = *self.edges.get(self.next).filter(|(at, _, _)| *at <= now)?;
        self.next += 1;
        Some((diode, level))
    }

    /// Computes the edges of the whole frame. The robot moves during the frame, with the velocity
    /// that it has at the beginning.
    fn show(&mut self, pose: Option<(Time, TablePose)>) {
        let begin = begin_of(self.frame);
        let mut random = Random::for_item(self.light.seed, self.frame);
        self.frame += 1;
        self.edges.clear();
        self.next = 0;
        let pose = pose.filter(|_| !random.chance(self.light.lose));
        let (mut last, mut level) = ([begin; 2], self.levels);
        let (mut heading, mut arm) = (f64::NAN, [0.0; 2]);
        for number in 0..PATTERNS {
            let at = begin + Time::from_picos(PATTERN.picos() * u64::from(number));
            let here = pose.map(|(since, pose)| {
                let pose = pose.after(at - since);
                // Most robots drive straight on, so the vector rarely changes.
                if pose.heading_degrees != heading {
                    (heading, arm) = (pose.heading_degrees, TablePose::arm(pose.heading_degrees));
                }
                pose.diodes(arm)
            });
            for (diode, last) in last.iter_mut().enumerate() {
                let level = here.is_some_and(|places| pattern(places[diode], number));
                if level != std::mem::replace(&mut self.levels[diode], level) {
                    let early = Time::from_picos((self.light.jitter_us * 1e6) as u64);
                    let late = early.picos() as f64 * 2.0 * random.unit();
                    // The beginning of the frame and the edge before cannot change any more, so an
                    // edge is never earlier than these.
                    let at = (at + Time::from_picos(late as u64) - early).max(*last);
                    *last = at;
                    self.edges.push((at, diode, level));
                }
            }
        }
        self.add_glitches(begin, &mut random);
        self.edges.sort_by_key(|(at, _, _)| *at);
        // Each edge inverts the level, so a glitch in a white pattern is dark.
        for (_, diode, is_lit) in &mut self.edges {
            level[*diode] = !level[*diode];
            *is_lit = level[*diode];
        }
    }

    /// Adds two edges for each glitch of the frame that begins at `begin`.
    fn add_glitches(&mut self, begin: Time, random: &mut Random) {
        let mean = self.light.glitches_per_s * FRAME.picos() as f64 * 1e-12;
        for diode in 0..2 {
            let count = mean.floor() as u32 + u32::from(random.chance(mean.fract()));
            for _ in 0..count {
                let micros = 1.0 + random.unit() * (LightDisturbance::GLITCH_US_MAX - 1.0);
                let span = Time::from_picos((micros * 1e6) as u64);
                let after = random.unit() * (FRAME - span).picos() as f64;
                let at = begin + Time::from_picos(after as u64);
                self.edges.extend([(at, diode, true), (at + span, diode, false)]);
            }
        }
    }
}

fn begin_of(frame: u64) -> Time {
    Time::from_picos(FRAME.picos().saturating_mul(frame))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the patterns of the code at steps `x`, `y`, bits of each coordinate as text.
    fn code(x: u32, y: u32) -> [String; 2] {
        let at = [f64::from(x) * STEP_MM[0], f64::from(y) * STEP_MM[1]];
        let text = |range: std::ops::Range<u32>| {
            range.map(|number| if pattern(at, number) { '1' } else { '0' }).collect()
        };
        assert!(!pattern(at, 0));
        assert!((21..PATTERNS).all(|number| pattern(at, number)));
        [text(1..11), text(11..21)]
    }

    #[test]
    fn the_code_agrees_with_the_projector_bitmaps() {
        assert_eq!(code(512, 512), ["1100000000", "1100000000"]);
        assert_eq!(code(56, 796), ["0000100100", "1010010010"]);
    }

    #[test]
    fn no_light_falls_outside_the_table() {
        for at in [[0.0, 460.0], [900.0, 460.0], [460.0, 0.0], [460.0, 800.0]] {
            assert!((0..PATTERNS).all(|number| !pattern(at, number)), "{at:?}");
        }
    }

    /// SwarmUI: angle = atan2(y2 - y1, x2 - x1) + 90 (sensors.c).
    #[test]
    fn the_diodes_give_the_heading() {
        for heading in [-170.0, -45.0, 0.0, 30.0, 90.0, 135.0] {
            let pose = TablePose::at(100.0, 200.0, heading);
            let [[x1, y1], [x2, y2]] = pose.diodes(TablePose::arm(heading));
            let angle = (y2 - y1).atan2(x2 - x1).to_degrees() + 90.0;
            let angle = if angle > 180.0 { angle - 360.0 } else { angle };
            assert!((angle - heading).abs() < 1e-9, "{angle}");
            assert!(((x1 + x2) / 2.0 - 100.0).abs() < 1e-9);
            assert!(((x1 - x2).hypot(y1 - y2) - 19.6).abs() < 1e-9, "baseline");
        }
    }

    /// Returns the levels of both photodiodes at the middle of each pattern, for a number of
    /// frames.
    fn seen(diodes: &mut Diodes, pose: TablePose, frames: u64) -> Vec<[bool; 2]> {
        let mut levels = [false; 2];
        let mut seen = Vec::new();
        for number in 0..frames * u64::from(PATTERNS) {
            let now = Time::from_picos(PATTERN.picos() * number + PATTERN.picos() / 2);
            while diodes.next_event() <= now {
                let at = diodes.next_event();
                if let Some((diode, level)) = diodes.advance(at, Some((Time::ZERO, pose))) {
                    levels[diode] = level;
                }
            }
            seen.push(levels);
        }
        seen
    }

    #[test]
    fn edges_follow_the_code() {
        let pose = TablePose::at(500.0, 400.0, 20.0);
        let mut diodes = Diodes::new();
        diodes.set_light(LightDisturbance { jitter_us: 100.0, ..LightDisturbance::default() });
        for (number, levels) in seen(&mut diodes, pose, 3).into_iter().enumerate() {
            let number = number as u32 % PATTERNS;
            let places = pose.diodes(TablePose::arm(pose.heading_degrees));
            let expected = places.map(|place| pattern(place, number));
            assert_eq!(levels, expected, "pattern {number}");
        }
    }

    #[test]
    fn edges_keep_their_order_however_late_they_are() {
        let mut diodes = Diodes::new();
        diodes.set_light(LightDisturbance {
            jitter_us: LightDisturbance::JITTER_US_MAX,
            ..LightDisturbance::default()
        });
        let (mut now, mut levels) = (Time::ZERO, [false; 2]);
        while now < Time::from_millis(1000) {
            assert!(diodes.next_event() >= now);
            now = diodes.next_event();
            let pose = Some((Time::ZERO, TablePose::at(500.0, 400.0, 20.0)));
            if let Some((diode, level)) = diodes.advance(now, pose) {
                assert_ne!(std::mem::replace(&mut levels[diode], level), level);
            }
        }
    }

    #[test]
    fn glitches_have_the_set_rate_and_length() {
        let mut diodes = Diodes::new();
        diodes.set_light(LightDisturbance {
            glitches_per_s: 200.0,
            seed: 5,
            ..LightDisturbance::default()
        });
        let (mut now, mut levels) = (Time::ZERO, [false; 2]);
        let (mut last, mut short) = ([Time::ZERO; 2], 0);
        while now < Time::from_millis(10_000) {
            assert!(diodes.next_event() >= now);
            now = diodes.next_event();
            // The robot is outside the projector's light, so all edges are those of glitches.
            if let Some((diode, level)) = diodes.advance(now, None) {
                assert_ne!(std::mem::replace(&mut levels[diode], level), level);
                short += u32::from((now - last[diode]).nanos() <= 50_000);
                last[diode] = now;
            }
        }
        // There are 2,000 at each photodiode; two in a frame may be next to each other.
        assert!((3_950..4_150).contains(&short), "{short}");
    }

    #[test]
    fn lost_frames_are_dark_and_have_the_set_rate() {
        let pose = TablePose::at(500.0, 400.0, 20.0);
        let mut diodes = Diodes::new();
        diodes.set_light(LightDisturbance { lose: 0.1, seed: 3, ..LightDisturbance::default() });
        let seen = seen(&mut diodes, pose, 2000);
        let dark = seen.chunks(PATTERNS as usize).filter(|frame| !frame[40][0]).count();
        assert!((150..250).contains(&dark), "{dark} of 2000");
    }
}
