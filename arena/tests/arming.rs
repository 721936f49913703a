//! A script never arms a Crazyflie: a person does, whom `armed = true` plays in a scenario.

use crate::script::{folder, run_with};
use bittybuzz_arena::robot::Piece;

/// The two values of `fidelity`.
const FIDELITIES: [&str; 2] = ["kinematic", "flight"];

/// A flight of one robot: its place and height in mm, and the globals `up` and `there`, after each
/// tick, and the text of its log.
struct Flight {
    places_mm: Vec<[f32; 3]>,
    heights_mm: Vec<f32>,
    up: Vec<Option<f64>>,
    there: Vec<Option<f64>>,
    log: Vec<String>,
}

/// Runs a script on one robot with these keys in `model`; `events` ends the scenario.
fn fly(name: &str, model: &str, script: &str, seconds: u32, events: &str) -> Flight {
    let folder = folder(&format!("arming_{name}"), &[("s.bzz", script)]);
    let text = format!(
        "[world]\nsize = [12000, 6000]\nduration = {seconds}\n\
         [[robots]]\nrobot = \"crazyflie\"\nscript = \"s.bzz\"\npositions = [[0, 0]]\nheading = 0\n\
         model = {{ {model} }}\n{events}[output]\nplot = [\"global.up\", \"global.there\"]\n"
    );
    let mut flight = Flight {
        places_mm: Vec::new(),
        heights_mm: Vec::new(),
        up: Vec::new(),
        there: Vec::new(),
        log: Vec::new(),
    };
    run_with(&folder, &text, 1, |simulation| {
        let view = simulation.view(0).expect("the robot is in the world");
        flight.places_mm.push([view.pose.x, view.pose.y, view.pose.z]);
        flight.heights_mm.push(view.pose.z);
        let read = |plot: usize| simulation.read(&simulation.setup().plots()[plot], 0).number();
        flight.up.push(read(0));
        flight.there.push(read(1));
        for (_, line) in simulation.take_log() {
            let text = line.pieces.iter().map(|piece| match piece {
                Piece::Text(text) => String::from_utf8_lossy(text).into_owned(),
                Piece::Int(number) => number.to_string(),
                other => format!("{other:?}"),
            });
            flight.log.push(text.collect());
        }
    });
    flight
}

fn model(fidelity: &str, is_armed: bool) -> String {
    let armed = if is_armed { ", armed = true" } else { "" };
    format!("fidelity = \"{fidelity}\"{armed}")
}

/// The script gets 0 in its first step, and the log names the key.
#[test]
fn a_script_that_nobody_armed_stays_on_the_ground() {
    let script = "up = -1\nthere = -1\nfunction init() { up = takeoff(500) }\n\
                  function step() { there = goTo(500, 0, 500) }\n";
    for fidelity in FIDELITIES {
        let flight = fly("nobody", &model(fidelity, false), script, 5, "");
        assert_eq!(flight.up[1], Some(0.0), "{fidelity}");
        assert_eq!(flight.there[49], Some(0.0), "{fidelity}");
        assert!(flight.heights_mm.iter().all(|mm| *mm < 5.0), "{fidelity}");
        let logged = flight.log.iter().filter(|line| line.contains("armed = true")).count();
        assert_eq!(logged, 1, "{fidelity}: {:?}", flight.log);
    }
}

/// 3,150 mV are less than the 3,200 mV that a take-off needs.
#[test]
fn a_weak_battery_keeps_an_armed_robot_on_the_ground() {
    let script = "up = -1\nthere = -1\nn = 0\n\
                  function step() { n = n + 1 if(n == 20) { up = takeoff(500) } }\n";
    for fidelity in FIDELITIES {
        let event = "[[event]]\nat = 1\nbattery = 0\nvolts = 3.15\n";
        let flight = fly("weak", &model(fidelity, true), script, 5, event);
        assert_eq!(flight.up[21], Some(0.0), "{fidelity}");
        assert!(flight.heights_mm.iter().all(|mm| *mm < 5.0), "{fidelity}");
        assert!(flight.log.iter().any(|line| line.contains("3150 mV")), "{:?}", flight.log);
    }
}

/// A landing by the script keeps the permission: the second take-off needs no person.
#[test]
fn a_landing_of_the_script_keeps_the_permission() {
    let script = "up = -1\nthere = -1\nn = 0\n\
                  function step() { n = n + 1 up = takeoff(500) if(n < 3) land() }\n";
    for fidelity in FIDELITIES {
        let flight = fly("again", &model(fidelity, true), script, 40, "");
        assert_eq!(flight.up[399], Some(1.0), "{fidelity}");
        let (mut flights, mut was_up) = (0, false);
        for mm in &flight.heights_mm {
            let is_up = if was_up { *mm > 20.0 } else { *mm > 400.0 };
            flights += usize::from(is_up && !was_up);
            was_up = is_up;
        }
        assert_eq!(flights, 3, "{fidelity}");
        assert!(flight.heights_mm[399] > 450.0, "{fidelity}");
    }
}

/// Returns the script that flies so many mm along x, and sets `there` to -2 when the flight begins.
fn flight_along_x(mm: u32) -> String {
    format!(
        "up = -1\nthere = -1\nfunction init() {{ up = takeoff(500) }}\n\
         function step() {{ if(there == -1) {{ there = -2 there = goTo({mm}, 0, 500) }} }}\n"
    )
}

/// The planner's shortest time for a flight at 1 m/s: a polynomial of degree 7 from rest to rest is
/// 35/16 times as fast at its middle as on average.
fn shortest_s(mm: u32) -> f64 {
    f64::from(mm) / 1000.0 * 35.0 / 16.0
}

/// 1 m takes 2.19 s and 3 m take 6.56 s.
#[test]
fn a_flight_to_a_place_takes_the_planners_shortest_time() {
    for fidelity in FIDELITIES {
        for mm in [1000, 3000] {
            let flight = fly("shortest", &model(fidelity, true), &flight_along_x(mm), 16, "");
            let begin = flight.there.iter().position(|there| *there == Some(-2.0)).unwrap();
            let end = flight.there.iter().position(|there| *there == Some(1.0)).unwrap();
            let (took_s, seconds) = ((end - begin) as f64 / 10.0, shortest_s(mm));
            // The function returns in a step of 0.1 s, at most 1 s after the plan's end.
            assert!((seconds..seconds + 0.5).contains(&took_s), "{fidelity}: {mm} mm, {took_s} s");
        }
    }
}

/// The body of a robot that a flight controller flies stays within 30 mm rms of the plan, from its
/// begin until half a second after its end: x = d (35 u⁴ - 84 u⁵ + 70 u⁶ - 20 u⁷) at the share u of
/// the duration.
#[test]
fn a_flight_to_a_place_follows_its_plan() {
    for mm in [1000, 3000, 5000] {
        let flight = fly("plan", &model("flight", true), &flight_along_x(mm), 20, "");
        let begin = flight.there.iter().position(|there| *there == Some(-2.0)).unwrap();
        let duration_s = shortest_s(mm);
        let plan_mm = |seconds: f64| {
            let u = (seconds / duration_s).min(1.0);
            f64::from(mm) * u.powi(4) * (35.0 - 84.0 * u + 70.0 * u.powi(2) - 20.0 * u.powi(3))
        };
        let ticks = ((duration_s + 0.5) * 10.0) as usize;
        // The function is called at the begin of a tick, and the places are those at its end.
        let squares = (0..ticks).map(|tick| {
            let [x, y, z] = flight.places_mm[begin + tick].map(f64::from);
            (x - plan_mm((tick + 1) as f64 / 10.0)).powi(2) + y.powi(2) + (z - 500.0).powi(2)
        });
        let rms_mm = (squares.sum::<f64>() / ticks as f64).sqrt();
        println!("{mm} mm in {duration_s:.2} s: {rms_mm:.1} mm rms");
        assert!(rms_mm < 30.0, "{mm} mm: {rms_mm} mm rms");
    }
}
