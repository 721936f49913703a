//! One flight with both backends: the flight controller of the simulator, and the image.

use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use bittybuzz_arena::robot::Piece;
use bittybuzz_arena::run::{Setup, Simulation};
use bittybuzz_arena::scenario::Scenario;
use bittybuzz_hil::{Robot, ScriptFile, TraceLog, standing};

use super::course::{STANDING_M, distance_m, rms, rows};
use crate::backends::program;
use crate::flight::{arm, firmware_log, motions};

/// Flies a square at two heights. The log has 0 after the take-off, and 9 after the square. Its functions
/// return at once: a step that waits ends with the next tick in the simulator, and up to 0.1 s earlier on the
/// robot.
const SCRIPT: &str = "\
function init() { n = 0 }
function step() {
  n = n + 1
  if(n == 30) takeoff(500.0)
  if(n == 40) log(0)
  if(n >= 40 and n < 65) goto(600.0, 0.0, 500.0)
  if(n >= 65 and n < 90) goto(600.0, 600.0, 700.0)
  if(n >= 90 and n < 115) goto(0.0, 600.0, 700.0)
  if(n >= 115 and n < 140) goto(0.0, 0.0, 500.0)
  if(n == 140) log(9)
}
";
/// Time in s of the simulation. The flight takes 17 s.
const SECONDS: u32 = 25;
/// Time in ms of a tick of the simulation.
const TICK_MS: u64 = 100;
/// Largest difference of both backends in m rms.
const DIFFERENCE_M_MAX: f64 = 0.05;

/// Places in m at times since the begin of the square, until the end of the square.
type Places = Vec<(Duration, [f64; 3])>;

/// Flies in a virtual machine of this process.
fn simulated() -> Places {
    let script = ScriptFile::new("square", SCRIPT);
    let text = format!(
        "[world]\nsize = [4000, 4000]\nduration = {SECONDS}\n[[robots]]\nrobot = \"crazyflie\"\n\
         script = '{}'\npositions = [[0, 0]]\nheading = 0\n\
         model = {{ fidelity = \"flight\", armed = true, positioning = \"capture\" }}\n",
        script.path()
    );
    let read =
        Scenario::parse(&text, "test.toml", Path::new(""), &[], &bittybuzz_robot_models::all());
    let scenario = read.unwrap_or_else(|errors| panic!("{errors:#?}\n{text}"));
    let group = &scenario.groups[0];
    let programs = vec![program(group.script.as_ref().unwrap(), &group.robot)];
    let setup = Setup::new(scenario, programs).unwrap();
    let mut simulation = Simulation::new(Arc::new(setup), 1, 1).unwrap();
    let (mut places, mut start) = (Places::new(), None);
    while !simulation.is_over() {
        let now = Duration::from_millis(simulation.now() * TICK_MS);
        simulation.tick().unwrap_or_else(|error| panic!("{error}"));
        let marks: Vec<Piece> = simulation
            .take_log()
            .into_iter()
            .filter_map(|(_, mut line)| line.pieces.pop())
            .collect();
        if marks.iter().any(|mark| matches!(mark, Piece::Int(0))) {
            start = Some(now);
        }
        if marks.iter().any(|mark| matches!(mark, Piece::Int(9))) {
            break;
        }
        if let Some(start) = start {
            let pose = simulation.view(0).unwrap().pose;
            let [x, y, z] = [pose.x, pose.y, pose.z].map(|mm| f64::from(mm) / 1000.0);
            let at = now + Duration::from_millis(TICK_MS) - start;
            places.push((at, [x, y, z + STANDING_M]));
        }
    }
    places
}

/// Flies with the image.
fn emulated() -> Places {
    let mut robot = standing(SCRIPT, 1);
    arm(&mut robot);
    let find = |robot: &Robot, mark: u32| {
        let rows = rows(&TraceLog::of_events(&robot.events));
        rows.iter().find(|row| row.mark == mark).map(|row| row.at)
    };
    let end = loop {
        if let Some(end) = find(&robot, 9) {
            break end;
        }
        let latest = Duration::from_secs(SECONDS.into());
        assert!(robot.now() < latest, "{:?}", firmware_log(&robot));
        robot.run_ms(500);
    };
    let start = find(&robot, 0).unwrap();
    let in_flight = motions(&robot.events).into_iter();
    let in_flight = in_flight.filter(|motion| (start..end).contains(&motion.at));
    in_flight.map(|motion| (motion.at - start, motion.position_m)).collect()
}

/// Returns the place at a time.
fn place_m(places: &Places, at: Duration) -> Option<[f64; 3]> {
    let after = places.partition_point(|(time, _)| *time < at);
    let ((from, one), (to, other)) = (places.get(after.checked_sub(1)?)?, places.get(after)?);
    let share = (at - *from).as_secs_f64() / (*to - *from).as_secs_f64();
    Some([0, 1, 2].map(|axis| one[axis] + (other[axis] - one[axis]) * share))
}

#[test]
fn both_backends_fly_the_same_square() {
    let (simulated, emulated) = (simulated(), emulated());
    let pairs = simulated.iter().filter_map(|(at, place)| Some((place, place_m(&emulated, *at)?)));
    let differences: Vec<f64> = pairs.map(|(one, other)| distance_m(*one, other)).collect();
    let difference_m = rms(&differences);
    println!("{:.1} mm rms in {} ticks", 1e3 * difference_m, differences.len());
    assert!(differences.len() > 95, "{}", differences.len());
    assert!(difference_m <= DIFFERENCE_M_MAX, "{difference_m} m rms");
}
