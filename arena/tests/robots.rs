//! The functions of each robot do in the world what the robot files say.

use crate::script;
use crate::script::{folder, run_with};
use bittybuzz_arena::engine::RobotView;

/// Runs a script on one robot in the middle of the world, looking along x; views and the global `r` after each tick.
fn run(robot: &str, script: &str, seconds: u32) -> Vec<(RobotView, Option<f64>)> {
    let name: String = script.chars().filter(char::is_ascii_alphanumeric).take(60).collect();
    let folder = folder(&format!("robots_{robot}_{name}"), &[("s.bzz", script)]);
    let text = format!(
        "[world]\nsize = [4000, 2000]\nduration = {seconds}\nobstacles = [{{ at = [900, 0], size = [20, 400] }}]\n\
         [[robots]]\nrobot = \"{robot}\"\nscript = \"s.bzz\"\npositions = [[0, 0]]\nheading = 0\nclock_skew = 0\n\
         [body.kilobot]\nspeed_error = 0\nturn_error = 0\nheading_bias = 0\nheading_noise = 0\n[body.zooid]\ngain_error = 0\n[body.crazyflie]\narmed = true\n[output]\nplot = [\"global.r\"]\n"
    );
    let mut trace = Vec::new();
    let summary = run_with(&folder, &text, 1, |simulation| {
        let probe = &simulation.setup().plots()[0];
        let view = simulation.view(0);
        trace.extend(view.map(|view| (view, simulation.read(probe, 0).number())));
    });
    assert!(summary.faults.is_empty(), "{:?}", summary.faults);
    trace
}

fn last(trace: &[(RobotView, Option<f64>)]) -> (RobotView, Option<f64>) {
    trace.last().copied().unwrap_or_else(|| panic!("the robot is not there"))
}

#[test]
fn kilobots_move_and_turn_at_calibrated_speeds() {
    // ICRA 2012: 10 mm/s, 45 degrees per second.
    let (view, r) = last(&run("kilobot", "r = 0\nforward()\nled(5)\nr = 1\n", 10));
    assert!((95.0..=100.0).contains(&view.pose.x) && view.pose.y.abs() < 1.0, "{view:?}");
    assert_eq!((view.led, r), (5, Some(1.0)));
    let (view, _) = last(&run("kilobot", "r = 0\nleft()\n", 2));
    assert!((1.4..=1.6).contains(&view.pose.heading), "{view:?}");
    let (view, _) = last(&run("kilobot", "r = 0\nright()\n", 2));
    assert!((-1.6..=-1.4).contains(&view.pose.heading), "{view:?}");
    let (view, _) = last(&run("kilobot", "r = 0\nset_motor(0, 0)\n", 2));
    assert_eq!(view.pose.x, 0.0);
}

#[test]
fn zooids_drive_to_a_goal_and_estimate_their_position() {
    let script = "r = 0\nfunction step() { r = goto(300, -200) }\n";
    let trace = run("zooids", script, 10);
    let (view, r) = last(&trace);
    assert_eq!(r, Some(1.0), "{view:?}");
    assert!((view.pose.x - 300.0).hypot(view.pose.y + 200.0) < 10.0, "{view:?}");
    // It tells of it, and does not wait.
    assert_eq!(trace[5].1, Some(0.0));
    let (_, r) = last(&run("zooids", "r = 0\nfunction step() { r = pos.x + greyCode(5) }\n", 1));
    assert!((r.unwrap_or(0.0) - 7.0).abs() <= 1.0, "{r:?}");
    let (view, _) = last(&run("zooids", "r = 0\nleft()\n", 1));
    assert!(view.pose.heading.abs() > 0.1 && view.pose.x.abs() < 5.0, "{view:?}");
}

#[test]
fn crazyflies_take_off_fly_and_land() {
    let trace = run("crazyflie", "r = 0\nfunction init() { takeoff(500) r = 1 }\n", 6);
    let (view, r) = last(&trace);
    assert!((450.0..=550.0).contains(&view.pose.z), "{view:?}");
    assert_eq!((trace[3].1, r), (Some(0.0), Some(1.0)));

    let script = "r = 0\nfunction init() { takeoff(500) land() r = 1 }\n";
    let (view, r) = last(&run("crazyflie", script, 8));
    assert!(view.pose.z < 20.0, "{view:?}");
    assert_eq!(r, Some(1.0));

    let script =
        "r = 0\nfunction init() { takeoff(500) }\nfunction step() { r = goto(400, 300) }\n";
    let (view, r) = last(&run("crazyflie", script, 10));
    assert!((view.pose.x - 400.0).hypot(view.pose.y - 300.0) < 100.0, "{view:?}");
    assert_eq!(r, Some(1.0));

    // 200 mm/s ahead.
    let script = "r = 0\nfunction init() { takeoff(500) forward() }\n";
    let trace = run("crazyflie", script, 6);
    let speed = trace[40].0.pose.x - trace[30].0.pose.x;
    assert!((180.0..=220.0).contains(&speed), "{speed}");

    // 45 degrees per second to the left.
    let script = "r = 0\nfunction init() { takeoff(500) left() }\n";
    let trace = run("crazyflie", script, 5);
    let turned = (trace[48].0.pose.heading - trace[38].0.pose.heading).to_degrees();
    assert!((40.0..=50.0).contains(&turned), "{turned}");
}

#[test]
fn crazyflies_measure_ranges_and_discharge() {
    // A wall of 20 mm stands at 900 mm.
    let script = "r = 0\nfunction init() { takeoff(500) }\nfunction step() { r = get_front() }\n";
    let (view, r) = last(&run("crazyflie", script, 5));
    let expected = 890.0 - f64::from(view.pose.x);
    assert!((r.unwrap_or(0.0) - expected).abs() < 20.0, "{r:?} {view:?}");
    let (_, r) = last(&run("crazyflie", "r = 0\nfunction step() { r = get_left() }\n", 1));
    assert!(r.is_some_and(|r| r > 900.0), "{r:?}");
    let script = "r = 0\nfunction init() { takeoff(500) }\nfunction step() { r = battery() }\n";
    let (_, r) = last(&run("crazyflie", script, 60));
    // 950 mV in 7 minutes.
    assert!(r.is_some_and(|r| (4150.0 - 950.0 / 7.0 - r).abs() < 20.0), "{r:?}");
}

#[test]
fn an_endless_script_does_not_delay_others() {
    let (_, r) = last(&run("kilobot", "r = 0\nfunction step() { while(1) r = r + 1 }\n", 2));
    assert!(r.is_some_and(|r| r != 0.0), "{r:?}");
}

#[test]
fn delays_last_as_long_as_requested() {
    let trace = run("kilobot", "r = 0\nfunction step() { delay(1000) r = r + 1 }\n", 5);
    // The step of 0.1 s goes on at 1.1 s, in the tick that ends at 1.2 s.
    assert_eq!((trace[10].1, trace[11].1), (Some(0.0), Some(1.0)));
}

#[test]
fn messages_of_another_script_are_counted_and_ignored() {
    let script = |name: &str| {
        format!(
            "r = 0\n{name} = 1\nfunction init() {{ neighbors.listen(\"t\", function(t, v, i) {{ r = r + 1 }}) }}\n\
             function step() {{ neighbors.broadcast(\"t\", {name}) }}\n"
        )
    };
    let folder = folder("foreign", &[("a.bzz", &script("a")), ("b.bzz", &script("b"))]);
    let group = |script: &str, x: i32| {
        format!("[[robots]]\nrobot = \"kilobot\"\nscript = \"{script}\"\npositions = [[{x}, 0]]\n")
    };
    let world = "[world]\nsize = [500, 500]\nduration = 10\n[medium.ir]\nloss = 0\n";
    let run = |second: &str| {
        let text = format!(
            "{world}{}{}[output]\nplot = [\"global.r\"]\n",
            group("a.bzz", -30),
            group(second, 30)
        );
        script::run(&folder, &text)
    };
    let (other, same) = (run("b.bzz"), run("a.bzz"));
    assert!(other.unusable.foreign > 20, "{:?}", other.unusable);
    assert_eq!(other.values[0], Some([0.0; 3]));
    assert_eq!(same.unusable.foreign, 0);
    assert!(same.values[0].is_some_and(|[_, least, _]| least > 10.0), "{:?}", same.values);
}

/// A Kilobot sends every fifth step only, and what it says is of the step before, not of when its link was last free.
#[test]
fn broadcasts_carry_values_of_the_last_step() {
    let script = "t = 0\nr = 0\nfunction init() {\n neighbors.listen(\"t\", function(topic, value, robot) {\n \
                  if(t - value > r) r = t - value\n })\n}\n\
                  function step() { t = t + 1 neighbors.broadcast(\"t\", t) }\n";
    let folder = folder("fresh", &[("a.bzz", script)]);
    let robots = [("kilobot", "ir", 45), ("zooids", "nrf24", 45), ("crazyflie", "p2p", 60)];
    for (robot, medium, x) in robots {
        let text = format!(
            "[world]\nsize = [500, 500]\nduration = 60\n[medium.{medium}]\nloss = 0\n\
             [[robots]]\nrobot = \"{robot}\"\nscript = \"a.bzz\"\nclock_skew = 0\npositions = [[-{x}, 0], [{x}, 0]]\n\
             [output]\nplot = [\"global.r\"]\n"
        );
        let summary = script::run(&folder, &text);
        assert!(summary.statistics.all_links().received >= 200, "{:?}", summary.statistics);
        // One more where a frame lasts across the end of a tick.
        let oldest = summary.values[0].map(|[_, _, most]| most);
        assert!(oldest.is_some_and(|steps| steps <= 1.0), "{robot}: {oldest:?} steps old");
        assert_eq!(summary.dropped, [0, 0]);
    }
}
