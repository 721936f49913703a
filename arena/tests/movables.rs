//! Discs that robots push: they move as robots without a drive do, and walls, obstacles and heights count for them.

use crate::common::robots::{RobotKind, Settings, World};
use crate::common::*;
use crate::script::{folder, read, run_with};
use bittybuzz_arena::engine::{Area, MovableDisc, Obstacle, Pose, RobotState, Stream};
use bittybuzz_arena::output::recording::{RecordingReader, RecordingWriter};
use bittybuzz_arena::output::{History, recorder, trajectories};
use core::f32::consts::{FRAC_PI_4, PI, TAU};

/// The radius of a Kilobot in mm.
const KILOBOT_MM: f32 = 16.5;

fn disc(x: f32, y: f32, radius_mm: f32) -> MovableDisc {
    MovableDisc { x, y, radius_mm, height_mm: f32::INFINITY }
}

fn ahead() -> Probe {
    Probe::driving(70, 70)
}

fn place(world: &World<Probe>, number: usize) -> (f32, f32) {
    let disc = world.movables().nth(number).unwrap();
    (disc.x, disc.y)
}

/// The way of a Kilobot in a tick when nothing is in its way, in mm.
fn free_way() -> f32 {
    let mut world = World::new(exact()).unwrap();
    let id = kilobot(&mut world, 0.0, 0.0, 0.0, ahead());
    run(&mut world, 100);
    pose(&world, id).x / 100.0
}

/// The greatest overlap of a disc with a robot or another disc in mm: all pairs are compared.
fn deepest(world: &World<Probe>) -> f32 {
    let robots = world.robots().map(|view| disc(view.pose.x, view.pose.y, view.radius_mm));
    let all: Vec<MovableDisc> = world.movables().chain(robots).collect();
    let discs = world.movables().len();
    let mut deepest: f32 = 0.0;
    for (number, one) in all[..discs].iter().enumerate() {
        for other in &all[number + 1..] {
            let distance = (one.x - other.x).hypot(one.y - other.y);
            deepest = deepest.max(one.radius_mm + other.radius_mm - distance);
        }
    }
    deepest
}

/// The gap of 10 mm closes first. In each tick after that the robot goes on by d, and the robot and the disc move apart by half of
/// it: both go on by d / 2.
#[test]
fn a_robot_pushes_a_disc_along_a_line() {
    let way = free_way();
    let mut world = World::new(exact()).unwrap();
    world.add_movable(disc(KILOBOT_MM + 50.0 + 10.0, 0.0, 50.0));
    let id = kilobot(&mut world, 0.0, 0.0, 0.0, ahead());
    run(&mut world, 50);
    let pushed = (50.0 * way - 10.0) / 2.0;
    close(place(&world, 0).0, 76.5 + pushed, 0.1);
    close(pose(&world, id).x, 10.0 + pushed, 0.1);
    assert_eq!(place(&world, 0).1, 0.0);
    // It stops with the robot.
    world.brain_mut(id).unwrap().motors = (0, 0);
    run(&mut world, 1);
    let stopped = place(&world, 0);
    run(&mut world, 20);
    assert_eq!(place(&world, 0), stopped);
}

/// A disc of the size of a Kilobot moves exactly as a Kilobot with its motors off: a bit to the side, too, because the robot does
/// not meet its middle.
#[test]
fn a_disc_moves_like_a_robot_without_a_drive() {
    let [mut with_disc, mut with_robot] = [0, 1].map(|_| World::new(exact()).unwrap());
    with_disc.add_movable(disc(40.0, 7.0, KILOBOT_MM));
    let pusher = kilobot(&mut with_disc, 0.0, 0.0, 0.0, ahead());
    assert_eq!(kilobot(&mut with_robot, 0.0, 0.0, 0.0, ahead()), pusher);
    let idle = kilobot(&mut with_robot, 40.0, 7.0, 0.0, Probe::default());
    for _ in 0..200 {
        with_disc.tick();
        with_robot.tick();
        let (disc, other) = (place(&with_disc, 0), pose(&with_robot, idle));
        close(disc.0, other.x, 0.001);
        close(disc.1, other.y, 0.001);
        let (one, other) = (pose(&with_disc, pusher), pose(&with_robot, pusher));
        close(one.x, other.x, 0.001);
        close(one.y, other.y, 0.001);
    }
    assert!(place(&with_disc, 0).1 > 10.0);
    assert_eq!(with_disc.statistics().contacts, 0, "a disc is no robot");
    assert_eq!(with_disc.statistics().wall_ticks, with_robot.statistics().contact_ticks / 2);
}

/// The disc touches the wall, the robot the disc. In each tick the robot goes on by d, and each of the four rounds halves the
/// overlap, because the wall pushes the disc back: o = (o + d) / 16 = d / 15.
#[test]
fn a_disc_at_a_wall_stops_the_robot() {
    let way = free_way();
    let mut world = World::new(exact()).unwrap();
    world.add_movable(disc(1950.0, 0.0, 50.0));
    let id = kilobot(&mut world, 1950.0 - 66.5, 0.0, 0.0, ahead());
    run(&mut world, 50);
    let stopped = pose(&world, id);
    close(stopped.x, 1883.5 + way / 15.0, 0.02);
    for _ in 0..100 {
        world.tick();
        close(pose(&world, id).x, stopped.x, 0.001);
        assert_eq!(place(&world, 0), (1950.0, 0.0));
    }
    assert!(world.statistics().wall_ticks >= 149, "{:?}", world.statistics());
}

#[test]
fn robots_that_push_from_both_sides_stop_each_other() {
    let way = free_way();
    let mut world = World::new(exact()).unwrap();
    world.add_movable(disc(0.0, 0.0, 50.0));
    let left = kilobot(&mut world, -66.5, 0.0, 0.0, ahead());
    let right = kilobot(&mut world, 66.5, 0.0, PI, ahead());
    for _ in 0..200 {
        world.tick();
        close(place(&world, 0).0, 0.0, 0.02);
    }
    close(pose(&world, left).x, -66.5 + way / 15.0, 0.05);
    close(pose(&world, right).x, 66.5 - way / 15.0, 0.05);
}

/// The robot pushes at 45 degrees against a disc that touches the wall. With c = cos 45 degrees, the first round moves the disc by
/// d / 2 c along the wall. The wall takes the other component, so a quarter of the overlap stays for the next round: altogether
/// d / 2 c (1 + 1/4 + 1/16 + 1/64).
#[test]
fn a_disc_slides_along_a_wall() {
    let way = free_way();
    let mut world = World::new(exact()).unwrap();
    world.add_movable(disc(0.0, 1950.0, 50.0));
    let back = 66.5 * FRAC_PI_4.cos();
    kilobot(&mut world, -back, 1950.0 - back, FRAC_PI_4, ahead());
    world.tick();
    close(place(&world, 0).0, way / 2.0 * FRAC_PI_4.cos() * 85.0 / 64.0, 0.03);
    let mut last = place(&world, 0);
    for _ in 0..20 {
        world.tick();
        let (x, y) = place(&world, 0);
        assert!(x > last.0 && y <= 1950.0 && y > 1949.9, "({x}, {y}) after {last:?}");
        last = (x, y);
    }
}

/// A flier at 300 mm, above a disc of 200 mm, and one that flies into a disc of 400 mm.
#[test]
fn fliers_pass_over_low_discs_and_crash_on_high_ones() {
    for (height_mm, crashes) in [(200.0, 0), (300.0, 0), (400.0, 1)] {
        let mut world = World::new(exact()).unwrap();
        world.add_movable(MovableDisc { height_mm, ..disc(500.0, 0.0, 100.0) });
        let start = Pose { z: 300.0, ..Pose::new(0.0, 0.0, 0.0) };
        let id = world.add(RobotKind::Crazyflie, start, Probe::flying(500.0, 0.0, 0.0)).unwrap();
        run(&mut world, 25);
        let view = world.robot(id).unwrap();
        assert_eq!(view.crashes, crashes, "{height_mm} mm");
        assert_eq!(view.state == RobotState::Failed, crashes > 0);
        assert_eq!(place(&world, 0) == (500.0, 0.0), crashes == 0);
        assert_eq!(view.pose.x > 700.0, crashes == 0);
    }
}

/// The robot stands on the ground in front of a disc, which another robot pushes towards it.
#[test]
fn range_finders_see_a_disc_where_it_is() {
    let mut world = World::new(exact()).unwrap();
    world.add_movable(disc(0.0, 0.0, 50.0));
    let sees = crazyflie(&mut world, -500.0, 0.0, Probe::default());
    kilobot(&mut world, 66.5, 0.0, PI, ahead());
    run(&mut world, 1);
    assert_eq!(probe(&world, sees).ranges[0], Some(450.0));
    for _ in 0..50 {
        let (x, _) = place(&world, 0);
        world.tick();
        close(probe(&world, sees).ranges[0].unwrap(), x - 50.0 + 500.0, 0.01);
    }
    assert!(place(&world, 0).0 < -40.0 * free_way() / 2.0);
    // A low disc is below the line of sight.
    let mut world = World::new(exact()).unwrap();
    world.add_movable(MovableDisc { height_mm: 100.0, ..disc(0.0, 0.0, 50.0) });
    let start = Pose { z: 300.0, ..Pose::new(-500.0, 0.0, 0.0) };
    let hover = Probe::flying(0.0, 0.0, 0.0);
    let sees = world.add(RobotKind::Crazyflie, start, hover).unwrap();
    run(&mut world, 1);
    assert_eq!(probe(&world, sees).ranges[0], Some(2500.0));
}

/// Kilobots side by side push a disc of ten times their size no faster than one of them drives, and robots
/// all around hold it.
#[test]
fn many_small_robots_do_not_throw_a_large_disc() {
    let way = free_way();
    let radius_mm = 165.0;
    // 181.5 mm from the middle, 35.6 mm from one to the next.
    for (share, count) in [(0.5, 16), (1.0, 32)] {
        let mut world = World::new(exact()).unwrap();
        world.add_movable(disc(0.0, 0.0, radius_mm));
        for number in 0..count {
            let angle = PI + (number as f32 / count as f32 - 0.5) * TAU * share;
            let (sin, cos) = angle.sin_cos();
            let distance = radius_mm + KILOBOT_MM;
            let heading = if share < 1.0 { 0.0 } else { angle + PI };
            kilobot(&mut world, distance * cos, distance * sin, heading, ahead());
        }
        let mut last = (0.0, 0.0);
        for tick in 0..100 {
            world.tick();
            let (x, y) = place(&world, 0);
            let moved = (x - last.0).hypot(y - last.1);
            let most = if share < 1.0 { way } else { 0.2 };
            assert!(moved <= most, "{share}, tick {tick}: {moved} mm");
            assert!(deepest(&world) < 2.0 * way, "{} mm", deepest(&world));
            last = (x, y);
        }
        assert_eq!(last.0 > 25.0 * way, share < 1.0, "{last:?}");
    }
}

/// Discs and robots of several sizes, between obstacles.
fn playroom(seed: u64, threads: usize, discs: usize) -> World<Probe> {
    let area = Area { width: 1500.0, height: 1500.0 };
    let mut world = World::new(Settings { area, seed, threads, ..exact() }).unwrap();
    for obstacle in obstacles() {
        world.add_obstacle(obstacle);
    }
    let mut stream = Stream::for_brain(seed, 3);
    let mut unit = || stream.unit();
    for _ in 0..discs {
        let (x, y) = (1400.0 * (unit() - 0.5), 1400.0 * (unit() - 0.5));
        world.add_movable(disc(x, y, 2.0 + 600.0 * unit() / (discs as f32).sqrt()));
    }
    for number in 0..60 {
        let pose = Pose::new(1400.0 * (unit() - 0.5), 1400.0 * (unit() - 0.5), 6.0 * unit());
        let is_zooid = number % 2 == 0;
        let kind = if is_zooid { RobotKind::Zooid } else { RobotKind::Kilobot };
        let motors = if is_zooid { (30, 29) } else { (75, 70) };
        world.add(kind, pose, Probe::driving(motors.0, motors.1)).unwrap();
    }
    world
}

fn obstacles() -> [Obstacle; 4] {
    [
        Obstacle::Segment { from: (0.0, 700.0), to: (0.0, 300.0) },
        Obstacle::Round { x: 400.0, y: -300.0, radius: 120.0 },
        Obstacle::Box { x: -400.0, y: 300.0, width: 300.0, height: 80.0 },
        Obstacle::TurnedBox { x: 500.0, y: 200.0, width: 400.0, height: 60.0, along: (0.8, 0.6) },
    ]
}

/// The discs never leave the world, and when the robots stop, nothing overlaps and nothing moves any more.
#[test]
fn discs_stay_in_the_world_and_come_to_rest() {
    for (seed, discs) in [(1, 8), (2, 30)] {
        let mut world = playroom(seed, 1, discs);
        for _ in 0..300 {
            world.tick();
            for MovableDisc { x, y, radius_mm, .. } in world.movables() {
                assert!(x.abs() + radius_mm <= 750.01 && y.abs() + radius_mm <= 750.01);
            }
        }
        for id in world.ids() {
            world.brain_mut(id).unwrap().motors = (0, 0);
        }
        run(&mut world, 200);
        assert!(deepest(&world) < 0.2, "{} mm", deepest(&world));
        let rest: Vec<MovableDisc> = world.movables().collect();
        run(&mut world, 20);
        for (before, after) in rest.iter().zip(world.movables()) {
            close(before.x, after.x, 0.05);
            close(before.y, after.y, 0.05);
        }
    }
}

/// More discs than one thread takes at a time.
#[test]
fn threads_do_not_change_the_ways_of_discs() {
    let [mut one, mut four] = [1, 4].map(|threads| playroom(7, threads, 1500));
    for _ in 0..30 {
        one.tick();
        four.tick();
        assert_eq!(one.digest(), four.digest());
    }
    assert!(one.movables().eq(four.movables()));
}

#[test]
fn a_digest_contains_the_places_of_discs() {
    let world = |x: f32, height_mm: f32| {
        let mut world = World::<Probe>::new(exact()).unwrap();
        world.add_movable(MovableDisc { height_mm, ..disc(x, 0.0, 50.0) });
        world.digest()
    };
    assert_eq!(world(100.0, 50.0), world(100.0, 50.0));
    assert_ne!(world(100.0, 50.0), world(100.001, 50.0));
    assert_ne!(world(100.0, 50.0), world(100.0, 51.0));
    let without = World::<Probe>::new(exact()).unwrap().digest();
    assert_ne!(world(100.0, 50.0), without);
}

/// A robot that is moved into a disc stands next to it afterwards, and the disc stays.
#[test]
fn a_robot_placed_in_a_disc_is_pushed_out() {
    let mut world = World::new(exact()).unwrap();
    world.add_movable(disc(0.0, 0.0, 100.0));
    let id = kilobot(&mut world, 0.0, 60.0, 0.0, Probe::default());
    close(pose(&world, id).y, 116.5, 0.01);
    world.move_to(id, Pose::new(0.0, 0.0, 0.0)).unwrap();
    close(pose(&world, id).x.hypot(pose(&world, id).y), 116.5, 0.01);
    run(&mut world, 5);
    assert_eq!(place(&world, 0), (0.0, 0.0));
}

/// Discs with the same middle, on the corner of a box, on a wall of the world, larger than the world, without a size, and with
/// numbers that are none.
#[test]
fn unusual_discs_do_no_harm() {
    let mut world = World::new(exact()).unwrap();
    world.add_obstacle(Obstacle::Box { x: 1000.0, y: 1000.0, width: 200.0, height: 200.0 });
    for number in [f32::NAN, f32::INFINITY, 1e30] {
        world.add_movable(disc(number, 0.0, 10.0));
        world.add_movable(disc(0.0, 0.0, number));
    }
    world.add_movable(MovableDisc { height_mm: f32::NAN, ..disc(0.0, 0.0, 10.0) });
    assert_eq!(world.movables().len(), 0);
    for _ in 0..10 {
        world.add_movable(disc(-500.0, 0.0, 20.0));
        world.add_movable(disc(-500.0, 500.0, 0.0));
    }
    world.add_movable(disc(1100.0, 1100.0, 30.0));
    let corner = place(&world, 20);
    close((corner.0 - 1100.0).hypot(corner.1 - 1100.0), 30.0, 0.01);
    world.add_movable(disc(3000.0, 0.0, 30.0));
    assert_eq!(place(&world, 21), (1970.0, 0.0));
    let id = kilobot(&mut world, -500.0, 0.0, 0.0, ahead());
    run(&mut world, 100);
    assert!(deepest(&world) < 0.2, "{} mm", deepest(&world));
    world.add_movable(disc(1.0, 1.0, 1e6));
    run(&mut world, 20);
    assert!(world.movables().all(|disc| disc.x.is_finite() && disc.y.is_finite()));
    let Pose { x, y, .. } = pose(&world, id);
    assert!(x.is_finite() && y.is_finite());
    assert_eq!(place(&world, 22), (0.0, 0.0));
}

/// A world of a study: a dark nest on the floor, a box that stands askew, a crate that robots can push.
const STUDY: &str = "[world]\nsize = [4000, 3000]\nduration = 10\n\
    ground = [{ at = [-1500, 0], size = [800, 3000], brightness = 0 }]\n\
    obstacles = [\n  { at = [0, 0], size = [600, 200], heading = 35 },\n  { at = [800, 400], radius = 150, movable = true },\n]\n\
    [[robots]]\nrobot = \"kilobot\"\nscript = \"push.bzz\"\npositions = [[633.5, 400]]\nheading = 0\n\
    [[robots]]\nrobot = \"zooids\"\nscript = \"rest.bzz\"\ncount = 3\n";

const STUDY_SCRIPTS: [(&str, &str); 2] =
    [("push.bzz", "function step() { forward() }\n"), ("rest.bzz", "x = 0\n")];

/// The Kilobot touches the crate from the start and pushes it to the right. Scenario, recording and picture have its places.
#[test]
fn a_scenario_shows_and_records_a_pushed_crate() {
    let folder = folder("crate", &STUDY_SCRIPTS);
    let (scenario, _) = read(&folder, STUDY);
    let (mut history, mut places, mut header) = (History::default(), Vec::new(), None);
    let mut samples = Vec::new();
    run_with(&folder, STUDY, 1, |simulation| {
        header.get_or_insert_with(|| recorder::header(simulation));
        history.sample(simulation);
        places.push(simulation.movables().next().unwrap());
        let (robots, movables) = (recorder::robots(simulation), recorder::movables(simulation));
        samples.push((simulation.now(), robots, movables));
    });
    let end = *places.last().unwrap();
    // Half of the way of a Kilobot, which has about 10 mm/s.
    assert!(end.x > 835.0 && end.x < 865.0, "{end:?}");
    assert!((end.radius_mm, end.height_mm) == (150.0, f32::INFINITY));
    let mut writer = RecordingWriter::new(Vec::new(), &header.unwrap()).unwrap();
    for (tick, robots, movables) in &samples {
        writer.write(*tick, robots, movables).unwrap();
    }
    let file = writer.finish().unwrap();
    let reader = RecordingReader::new(&file).unwrap();
    assert_eq!(
        (reader.header().movables[0].at, reader.header().movables[0].radius),
        ([8000, 4000], 1500)
    );
    for (sample, disc) in reader.zip(&places) {
        let [x, y] = sample.unwrap().movables[0].map(|tenths| tenths as f32 / 10.0);
        close(x, disc.x, 0.051);
        close(y, disc.y, 0.051);
    }
    let picture = trajectories(&scenario.world, &history);
    let document = roxmltree::Document::parse(&picture).unwrap();
    let sienna: Vec<_> =
        document.descendants().filter(|node| node.attribute("stroke") == Some("sienna")).collect();
    let widths: Vec<_> =
        sienna.iter().map(|node| node.attribute("stroke-width").unwrap()).collect();
    assert_eq!(widths, ["0.5", "2", "1"]);
    // 4000 mm are 900 wide, and the rim 10: (800 + 2000) 0.225 + 10 = 640.
    assert_eq!(sienna[0].attribute("cx"), Some("640.0"));
    let end_x: f32 = sienna[1].attribute("cx").unwrap().parse().unwrap();
    close(end_x, (end.x + 2000.0) * 0.225 + 10.0, 0.06);
}
