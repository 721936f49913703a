//! Flights of the image along legs that a script flies, and the path that they follow.

use std::fmt::Write;
use std::time::Duration;

use bittybuzz_flight::Vec3;
use bittybuzz_flight::pilot::PilotSettings;
use bittybuzz_flight::planner::{Destination, Planner, PositionFence};
use bittybuzz_hil::{Command, Core, Deck, EmulatorEvent, Robot, TraceLog, resets};

use crate::flight::{Motion, arm, motions};

/// Height in m of the center of mass above the ground that the robot stands on.
pub const STANDING_M: f64 = PilotSettings::CRAZYFLIE.standing_m as f64;
/// Accelerations in m/s² with which a robot may plan: its limit, and those that a battery leaves.
const ACCELERATIONS_M_S2: [f32; 13] =
    [4.0, 3.8, 3.6, 3.4, 3.2, 3.0, 2.8, 2.6, 2.4, 2.2, 2.0, 1.8, 1.6];
/// Times in ms by which plans may begin before their rows in the log.
const LEADS_MS: [u64; 7] = [0, 2, 4, 6, 8, 10, 12];
/// Time in ms in which a robot takes off and stands still above the origin.
const TAKE_OFF_MS: u64 = 9_000;

/// The legs of a flight.
pub struct Course {
    /// Height above the ground in mm.
    pub height_mm: u32,
    /// Places in mm. The robot flies to the first one again after the last one.
    pub goals_mm: Vec<[f32; 2]>,
}

/// A row of the script's log: the time, the mark, and the numbers after it.
pub struct LogRow {
    pub at: Duration,
    pub mark: u32,
    pub numbers: Vec<f64>,
}

/// Returns the rows of the log of a script.
pub fn rows(log: &TraceLog) -> Vec<LogRow> {
    let row = |(at, values): &(Duration, Vec<String>)| {
        let mut numbers: Vec<f64> = values.iter().map(|value| value.parse().unwrap()).collect();
        let mark = numbers.remove(0) as u32;
        LogRow { at: *at, mark, numbers }
    };
    log.log.iter().map(row).collect()
}

/// Marks of the script: the result of the take-off, the time from which a flight counts, the begin of a leg
/// with the estimated place, and its end with the result.
const UP: u32 = 1;
const READY: u32 = 3;
const BEGIN: u32 = 4;
const END: u32 = 5;

impl Course {
    /// Returns the script that takes off, and then flies the legs until the emulator stops.
    fn script(&self) -> String {
        let height = self.height_mm;
        let mut script = format!(
            "function init() {{ n = 0 k = 0 }}\nfunction step() {{\n n = n + 1\n\
             if(n == 25) log({UP}, takeoff({height}.0))\n\
             if(n == 26) log(2, goTo(0.0, 0.0, {height}.0))\n\
             if(n == 46) log({READY})\n if(n > 46) {{\n\
             log({BEGIN}, k, pos.x, pos.y, pos.z)\n"
        );
        for (number, [x, y]) in self.goals_mm.iter().enumerate() {
            writeln!(script, "if(k == {number}) r = goTo({x:.3}, {y:.3}, {height}.0)").unwrap();
        }
        let legs = self.goals_mm.len();
        writeln!(script, "log({END}, r)\n k = k + 1\n if(k == {legs}) k = 0\n }}\n}}").unwrap();
        script
    }

    /// Returns an armed robot that has taken off and is about to begin the first leg. `prepare` gives it
    /// a body before it starts.
    pub fn take_off(&self, prepare: impl FnOnce(&mut Robot)) -> Flight {
        let mut robot = Robot::crazyflie(Core::Unicorn, &self.script());
        prepare(&mut robot);
        robot.run_ms(2_000);
        arm(&mut robot);
        let mut flight = Flight { robot, since: Duration::ZERO };
        let latest = flight.robot.now() + Duration::from_millis(TAKE_OFF_MS);
        loop {
            let rows = rows(&flight.log());
            if let Some(row) = rows.iter().find(|row| row.mark == READY) {
                flight.since = row.at;
                break;
            }
            let log = flight.log();
            assert!(flight.robot.now() < latest, "no take-off: {:?} {:?}", log.log, log.firmware);
            flight.robot.run_ms(100);
        }
        flight
    }
}

/// Attaches a Flow deck.
pub fn attach_flow_deck(robot: &mut Robot) {
    robot.execute(&Command::Decks { decks: vec![Deck::FlowV2] });
}

/// A flight along a course.
pub struct Flight {
    pub robot: Robot,
    /// The time from which it counts.
    pub since: Duration,
}

/// The errors of a flight.
pub struct PathErrors {
    /// Distances in m from the path, 50 per second.
    pub distances_m: Vec<f64>,
    /// The growth in m of the horizontal error of the estimate, from the first leg to the last one.
    pub drift_m: f64,
}

/// A difference of estimate and truth at a time.
struct Drift {
    at: Duration,
    offset_m: [f64; 3],
}

impl Flight {
    pub fn log(&self) -> TraceLog {
        TraceLog::of_events(&self.robot.events)
    }

    /// Returns the motions since the flight counts.
    pub fn motions(&self) -> Vec<Motion> {
        let mut all = motions(&self.robot.events);
        all.retain(|motion| motion.at >= self.since);
        all
    }

    /// Returns the reason why the flight ended before the emulator stopped, if it did.
    pub fn early_end(&self) -> Option<String> {
        let log = self.log();
        let refusal = log.firmware.iter().find(|line| line.starts_with("goTo: "));
        let mut reset =
            resets(&self.robot.events).into_iter().map(|(at, cause)| format!("{cause} at {at:?}"));
        let low = self
            .motions()
            .into_iter()
            .find(|motion| motion.position_m[2] < 0.3 || motion.has_crashed);
        refusal
            .cloned()
            .or_else(|| reset.next_back())
            .or_else(|| low.map(|motion| format!("at {:?} m, {:?}", motion.position_m, motion.at)))
    }

    /// Returns the errors of the body, in the frame that `seen` makes of true places in m, or in that of
    /// the estimate, whose drift between two legs is taken for even.
    ///
    /// Two numbers that only the robot knows are those with which the path fits best: the begin of its
    /// plans before the rows of the log, since it plans on a copy of the flight controller that is up to
    /// 10 ms old and logs after the slice of its script, and the acceleration that its battery leaves for
    /// plans.
    pub fn errors(
        &self,
        course: &Course,
        seen: Option<&dyn Fn([f64; 3]) -> [f64; 3]>,
    ) -> PathErrors {
        let motions = self.motions();
        let rows = rows(&self.log());
        let legs: Vec<&LogRow> = rows.iter().filter(|row| row.mark == BEGIN).collect();
        let drifts: Vec<Drift> = legs.iter().map(|leg| drift(leg, &motions)).collect();
        // The last leg has no end whose drift is known.
        let (first_at, last_at) = (drifts.first().unwrap().at, drifts.last().unwrap().at);
        let places: Vec<(Duration, [f64; 3])> = match seen {
            Some(seen) => motions.iter().map(|one| (one.at, seen(one.position_m))).collect(),
            None => {
                let known = motions.iter().filter(|one| (first_at..last_at).contains(&one.at));
                known.map(|one| (one.at, drifted(one, &drifts))).collect()
            }
        };
        let plans =
            ACCELERATIONS_M_S2.into_iter().flat_map(|most| LEADS_MS.map(|lead| (most, lead)));
        let fits = plans.map(|(most_m_s2, lead_ms)| {
            course.distances_m(&legs, &places, most_m_s2, Duration::from_millis(lead_ms))
        });
        let distances_m = fits.min_by(|one, other| rms(one).total_cmp(&rms(other))).unwrap();
        let (first, last) = (drifts.first().unwrap().offset_m, drifts.last().unwrap().offset_m);
        let drift_m = (last[0] - first[0]).hypot(last[1] - first[1]);
        PathErrors { distances_m, drift_m }
    }
}

impl Course {
    /// Returns the distances in m of places from the path of plans with this acceleration that begin
    /// by `lead` before their rows in the log.
    fn distances_m(
        &self,
        legs: &[&LogRow],
        places: &[(Duration, [f64; 3])],
        most_m_s2: f32,
        lead: Duration,
    ) -> Vec<f64> {
        let mut planner = planner(self.height_mm);
        planner.limit_acceleration(most_m_s2);
        let mut legs = legs.iter().peekable();
        let distance = |(at, place_m): &(Duration, [f64; 3])| {
            while let Some(leg) = legs.next_if(|leg| leg.at - lead <= *at) {
                let [x_mm, y_mm] = self.goals_mm[leg.numbers[0] as usize];
                let z_m = (f64::from(self.height_mm) / 1000.0 + STANDING_M) as f32;
                let position_m = Vec3::new(x_mm / 1000.0, y_mm / 1000.0, z_m);
                let goal = Destination::Absolute { position_m, yaw_rad: Some(0.0) };
                planner.go_to((leg.at - lead).as_secs_f64(), goal, None).unwrap();
            }
            let reference = planner.reference(at.as_secs_f64()).unwrap();
            distance_m(*place_m, reference.position_m.to_array().map(f64::from))
        };
        places.iter().map(distance).collect()
    }
}

/// Returns the place of a motion in the frame of the estimate.
fn drifted(motion: &Motion, drifts: &[Drift]) -> [f64; 3] {
    let next = drifts.partition_point(|drift| drift.at <= motion.at).clamp(1, drifts.len() - 1);
    let offset_m = between(&drifts[next - 1], &drifts[next], motion.at);
    [0, 1, 2].map(|axis| motion.position_m[axis] + offset_m[axis])
}

/// Returns a planner that hovers above the origin at this height since long ago.
fn planner(height_mm: u32) -> Planner<1> {
    let mut planner = Planner::new(PilotSettings::CRAZYFLIE.limits, PositionFence::WIDE).unwrap();
    let start_m = Vec3::Z * STANDING_M as f32;
    let height_m = height_mm as f32 / 1000.0 + start_m.z;
    planner.take_off(-20.0, start_m, 0.0, height_m, None).unwrap();
    planner.reference(0.0);
    planner
}

/// Returns the difference of the estimate in a row and the true place at its time.
fn drift(leg: &LogRow, motions: &[Motion]) -> Drift {
    let after = motions.partition_point(|motion| motion.at < leg.at).clamp(1, motions.len() - 1);
    let (one, other) = (&motions[after - 1], &motions[after]);
    let share = leg.at.saturating_sub(one.at).as_secs_f64() / (other.at - one.at).as_secs_f64();
    let offset_m = [0, 1, 2].map(|axis| {
        let (from, to) = (one.position_m[axis], other.position_m[axis]);
        let standing_m = if axis == 2 { STANDING_M } else { 0.0 };
        leg.numbers[1 + axis] / 1000.0 + standing_m - (from + (to - from) * share)
    });
    Drift { at: leg.at, offset_m }
}

/// Returns the even drift between two.
fn between(one: &Drift, other: &Drift, at: Duration) -> [f64; 3] {
    let whole_s = (other.at.saturating_sub(one.at)).as_secs_f64().max(1e-3);
    let share = (at.saturating_sub(one.at).as_secs_f64() / whole_s).min(1.0);
    [0, 1, 2].map(|axis| one.offset_m[axis] + (other.offset_m[axis] - one.offset_m[axis]) * share)
}

pub fn distance_m(one: [f64; 3], other: [f64; 3]) -> f64 {
    let squares = one.iter().zip(other).map(|(a, b)| (a - b).powi(2));
    squares.sum::<f64>().sqrt()
}

/// Returns the root of the mean square.
pub fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|value| value * value).sum::<f64>() / values.len() as f64).sqrt()
}

/// Returns the times at which a motor changed, and its number and duty.
pub fn motor_changes(robot: &Robot) -> impl Iterator<Item = (Duration, usize, f64)> {
    robot.events.iter().filter_map(|event| match event.event {
        EmulatorEvent::Motor { number, duty, .. } => {
            Some((event.at, usize::from(number) - 1, duty))
        }
        _ => None,
    })
}
