//! Robots that fly crash when they touch something in the air, and land when their batteries are empty.

use crate::common::robots::{RobotKind, World};
use crate::common::*;
use crate::script::{folder, run_with};
use bittybuzz_arena::engine::{Obstacle, Pose, RobotId, RobotState, RobotView};
use bittybuzz_arena::run::Summary;

fn crazyflie(world: &mut World<Probe>, x: f32, y: f32, z: f32, brain: Probe) -> RobotId {
    world.add(RobotKind::Crazyflie, Pose { z, ..Pose::new(x, y, 0.0) }, brain).unwrap()
}

fn view(world: &World<Probe>, id: RobotId) -> RobotView {
    world.robot(id).unwrap()
}

/// Two that meet head on at 300 mm/s each, 940 mm from each other, with radii of 60 mm: they touch after 820 / 600 = 1.4 s, and
/// 1.5 s more with the lag. From 500 mm a body falls in 0.3 s.
#[test]
fn robots_that_collide_in_the_air_crash_and_fall() {
    let mut world = World::new(exact()).unwrap();
    let one = crazyflie(&mut world, -470.0, 0.0, 500.0, Probe::flying(300.0, 0.0, 0.0));
    let other = crazyflie(&mut world, 470.0, 0.0, 500.0, Probe::flying(-300.0, 0.0, 0.0));
    run(&mut world, 12);
    assert_eq!(world.statistics().crashes, 0);
    run(&mut world, 20);
    for id in [one, other] {
        let view = view(&world, id);
        assert_eq!((view.state, view.crashes), (RobotState::Failed, 1));
        assert_eq!(view.pose.z, 0.0);
    }
    let statistics = *world.statistics();
    assert_eq!(statistics.crashes, 2);
    let (tick, robot) = statistics.first_crash.unwrap();
    assert!((13..=18).contains(&tick) && robot == one, "{tick} {robot:?}");
    // They lie there; a restart lets them fly again, and nothing is counted twice.
    run(&mut world, 50);
    assert_eq!(world.statistics().crashes, 2);
    world.restart(one, Probe::flying(0.0, 0.0, 200.0)).unwrap();
    run(&mut world, 10);
    assert!(pose(&world, one).z > 50.0);
    assert_eq!(view(&world, one).state, RobotState::Running);
}

/// One flies into the wall of the world, another into a box, a third over a box of 300 mm. A fourth stands on the ground beside
/// a wall, and a Kilobot drives against one.
#[test]
fn walls_and_obstacles_end_flights_below_their_height() {
    let mut world = World::new(exact()).unwrap();
    let size = 200.0;
    for y in [0.0, 1000.0] {
        let block = Obstacle::Box { x: 1000.0, y, width: size, height: size };
        if y > 0.0 {
            world.add_obstacle_of_height(block, 300.0);
        } else {
            world.add_obstacle(block);
        }
    }
    let ahead = || Probe::flying(500.0, 0.0, 0.0);
    let wall = crazyflie(&mut world, 1500.0, -1000.0, 400.0, ahead());
    let block = crazyflie(&mut world, 0.0, 0.0, 400.0, ahead());
    let over = crazyflie(&mut world, 0.0, 1000.0, 400.0, ahead());
    let stands = crazyflie(&mut world, 1939.0, 1500.0, 0.0, Probe::default());
    let drives = kilobot(&mut world, 1982.0, -1500.0, 0.0, Probe::driving(70, 70));
    run(&mut world, 30);
    let crashes = [wall, block, over, stands, drives].map(|id| view(&world, id).crashes);
    assert_eq!(crashes, [1, 1, 0, 0, 0]);
    let over = pose(&world, over);
    assert!(over.x > 1150.0 && over.z > 390.0, "{over:?}");
    assert_eq!(pose(&world, block).z, 0.0);
}

/// 100 mm/s are no crash where 200 mm/s are allowed; 400 mm/s are.
#[test]
fn contacts_below_the_crash_speed_do_no_harm() {
    for (speed, crashes) in [(100.0, 0), (400.0, 1)] {
        let mut settings = exact();
        settings.crazyflie.crash_speed = 200.0;
        let mut world = World::new(settings).unwrap();
        let id = crazyflie(&mut world, 1700.0, 0.0, 400.0, Probe::flying(speed, 0.0, 0.0));
        run(&mut world, 40);
        assert_eq!(view(&world, id).crashes, crashes, "{speed} mm/s");
        assert!(world.statistics().wall_ticks > 0);
    }
}

/// A robot that is put into another one's way has no speed by that.
#[test]
fn moving_a_robot_by_a_command_is_no_crash() {
    let mut settings = exact();
    settings.crazyflie.crash_speed = 200.0;
    let mut world = World::new(settings).unwrap();
    let one = crazyflie(&mut world, 0.0, 0.0, 400.0, Probe::flying(0.0, 0.0, 0.0));
    let other = crazyflie(&mut world, 1000.0, 0.0, 400.0, Probe::flying(0.0, 0.0, 0.0));
    run(&mut world, 2);
    world.move_to(other, Pose { z: 400.0, ..Pose::new(100.0, 0.0, 0.0) }).unwrap();
    run(&mut world, 5);
    assert_eq!([one, other].map(|id| view(&world, id).crashes), [0, 0]);
    assert!(world.statistics().contacts > 0);
}

const MEET: &str = "function init() { takeoff(800) }\nfunction step() { goto(0, 0) }\n";

/// Runs Crazyflies that all go to one place; `more` ends the scenario.
fn meet(name: &str, duration: u32, more: &str) -> Summary {
    let folder = folder(name, &[("meet.bzz", MEET)]);
    let text = format!(
        "[world]\nsize = [3000, 3000]\nduration = {duration}\n\
         [[robots]]\nrobot = \"crazyflie\"\nscript = \"meet.bzz\"\ncount = 10\nplacement = \"circle\"\nradius = 1000\n{more}[body.crazyflie]\narmed = true\n"
    );
    run_with(&folder, &text, 1, |_| ())
}

/// Ten robots that are told to meet at one place lie on the ground, and the scenario can say so.
#[test]
fn robots_that_meet_at_one_place_crash() {
    let expect =
        |value: &str, of: &str| format!("[[expect]]\nat = 30\nvalue = \"{value}\"\n{of}\n");
    let more = expect("crashes", "of = \"sum\"\nabove = 8")
        + &expect("running", "of = \"sum\"\nbelow = 2");
    let summary = meet("meet", 30, &more);
    assert!(summary.is_success(), "{:?}", summary.convergences);
    let (tick, robot) = summary.first_crash.unwrap();
    // They fly a meter at 500 mm/s after they have risen to 800 mm.
    assert!((30..=80).contains(&tick) && robot < 10, "{tick} {robot}");
    assert_eq!(summary.statistics.crashes, summary.statistics.crashes.clamp(9, 10));
}

/// 3,200 mV, which is low, after 7 minutes of flight; at the same rate 3,100 mV are reached 44 s later, and 5 s later
/// the robot lands within 2 s. On the ground nothing is drawn, and a restart does not charge.
#[test]
fn a_crazyflie_lands_when_its_battery_is_empty() {
    let folder = folder(
        "empty",
        &[(
            "hover.bzz",
            "mv = 0\nfunction init() { takeoff(500) }\nfunction step() { mv = battery() }\n",
        )],
    );
    let text = "[world]\nsize = [2000, 2000]\nduration = 520\n\
                [[robots]]\nrobot = \"crazyflie\"\nscript = \"hover.bzz\"\nmodel = { armed = true }\n\
                [[event]]\nat = 490\nrestart = 0\n\
                [[expect]]\nalways = [10, 465]\nvalue = \"z\"\nabove = 400\n\
                [[expect]]\nat = 418\nvalue = \"global.mv\"\nabove = 3200\n\
                [[expect]]\nat = 424\nvalue = \"global.mv\"\nbelow = 3200\n\
                [[expect]]\nalways = [475, 490]\nvalue = \"z\"\nequals = 0\n\
                [[expect]]\nalways = [475, 490]\nvalue = \"running\"\nequals = 1\n\
                [[expect]]\nalways = [505, 520]\nvalue = \"z\"\nequals = 0\n";
    let summary = run_with(&folder, text, 1, |_| ());
    assert!(summary.is_success(), "{:?}", summary.convergences);
    assert_eq!(summary.statistics.crashes, 0);
}

/// An event empties the battery of one of two robots: it lands 5 s later, at 500 mm/s.
#[test]
fn an_event_can_empty_a_battery() {
    let folder = folder(
        "emptied",
        &[("hover.bzz", "function init() { takeoff(500) }\nfunction step() { }\n")],
    );
    let text = "[world]\nsize = [2000, 2000]\nduration = 30\n\
                [[robots]]\nrobot = \"crazyflie\"\nscript = \"hover.bzz\"\npositions = [[0, 0], [500, 0]]\nmodel = { armed = true }\n\
                [[event]]\nat = 10\nbattery = 0\nvolts = 3.0\n\
                [[expect]]\nat = 14.5\nrobots = 0\nvalue = \"z\"\nabove = 400\n\
                [[expect]]\nalways = [18, 30]\nrobots = 0\nvalue = \"z\"\nequals = 0\n\
                [[expect]]\nalways = [16, 30]\nrobots = 1\nvalue = \"z\"\nabove = 400\n";
    let summary = run_with(&folder, text, 1, |_| ());
    assert!(summary.is_success(), "{:?}", summary.convergences);
}
