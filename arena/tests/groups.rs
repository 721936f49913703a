//! Groups of one kind that differ: in how they move, and in what becomes of their frames.

use bittybuzz_arena::run::start_poses;
use bittybuzz_arena::scenario::{Group, Scenario};
use bittybuzz_compiler::include::MemoryFiles;
use bittybuzz_crazyflie_model::CrazyflieModel;
use core::ops::DerefMut;

use crate::common::robots::{RobotKind, Settings, World};
use crate::common::{Probe, close, exact, links, probe, run};
use crate::script::{folder, read, run_with};
use bittybuzz_arena::engine::{AddError, LinkSettings, Loss, Medium};
use bittybuzz_arena::engine::{Pose, RobotId};

/// Two who talk, the second with a link of its own, and listeners at 40 and at 60 mm from rim to rim of each.
#[test]
fn a_link_is_that_of_the_sender() {
    for kind in [RobotKind::Kilobot, RobotKind::Zooid, RobotKind::Crazyflie] {
        let mut settings = Settings { seed: 3, ..exact() };
        for link in links(&mut settings) {
            link.range = Some(150.0);
        }
        let mut world = World::new(settings).unwrap();
        for link in links(&mut settings) {
            *link = LinkSettings {
                range: Some(120.0),
                edge: 0.0,
                loss: Loss::even(0.5),
                duplicate: 1.0,
                reorder: 0.0,
            };
        }
        let weak = world.add_variant(settings).unwrap();
        // From middle to middle; infrared counts from rim to rim.
        let bodies = if kind == RobotKind::Kilobot { 33.0 } else { 0.0 };
        let at = |x: f32, y: f32| Pose::new(x, y, 0.0);
        let strong_one = world.add(kind, at(0.0, 1000.0), Probe::talking()).unwrap();
        let weak_one = world.add_as(weak, kind, at(0.0, -1000.0), Probe::talking()).unwrap();
        let mut listen =
            |x: f32, y: f32| world.add(kind, at(x + bodies, y), Probe::default()).unwrap();
        let [near_strong, far_strong] =
            [listen(110.0, 1000.0), listen(-140.0 - 2.0 * bodies, 1000.0)];
        let [near_weak, far_weak] =
            [listen(110.0, -1000.0), listen(-140.0 - 2.0 * bodies, -1000.0)];
        run(&mut world, 1000);
        let received = |by: RobotId, of| probe(&world, by).received_from(of) as f32;
        let given = |of: RobotId| probe(&world, of).given as f32;
        close(received(near_strong, strong_one), given(strong_one), 3.0);
        close(received(far_strong, strong_one), given(strong_one), 3.0);
        assert_eq!(received(far_weak, weak_one), 0.0, "{kind:?}");
        // Half of the frames twice: 191 or more frames, three deviations of the share are 11 %.
        close(received(near_weak, weak_one) / given(weak_one), 1.0, 0.22);
        // An event changes all.
        for medium in Medium::ALL {
            world.set_loss(medium, Loss::even(1.0));
        }
        run(&mut world, 2);
        let before = world.statistics().all_links().received;
        run(&mut world, 100);
        assert_eq!(world.statistics().all_links().received, before);
    }
}

#[test]
fn a_longer_range_extends_reception_and_carrier_sense() {
    let mut settings = Settings { seed: 3, ..exact() };
    settings.infrared.link.range = Some(20.0);
    let mut world = World::new(settings).unwrap();
    let a = world.add(RobotKind::Kilobot, Pose::default(), Probe::talking()).unwrap();
    run(&mut world, 20);
    // While frames are on the air.
    settings.infrared.link.range = Some(900.0);
    let strong = world.add_variant(settings).unwrap();
    let far = Pose::new(800.0, 0.0, 0.0);
    let b = world.add_as(strong, RobotKind::Kilobot, far, Probe::talking()).unwrap();
    run(&mut world, 200);
    assert!(probe(&world, a).received_from(b) > 30 && probe(&world, b).received.is_empty());
    let last = world.herds.last().unwrap()[2];
    let other = World::<Probe>::new(settings).unwrap().deref_mut().add(last, far, Probe::default());
    assert_eq!(other.unwrap_err(), AddError::UnknownHerd);
    settings.infrared.link.loss.near = -1.0;
    assert_eq!(world.add_variant(settings).unwrap_err().field, "infrared.link.loss.near");
}

const WALK: &str = "r = 0\nfunction init() { neighbors.listen(\"n\", function(t, v, i) { r = r + 1 }) }\n\
                    function step() { forward() neighbors.broadcast(\"n\", id) }\n";

/// The fast ones go twice as far; those with worn motors go astray.
#[test]
fn each_group_has_its_own_model_settings() {
    let folder = folder("models", &[("walk.bzz", WALK)]);
    let group = |name: &str, y: i32, more: &str| {
        format!(
            "[[robots]]\nname = \"{name}\"\nrobot = \"kilobot\"\nscript = \"walk.bzz\"\ncount = 10\n\
             placement = \"line\"\nspacing = 150\nat = [-700, {y}]\nheading = 90\n{more}\n"
        )
    };
    let text = format!(
        "[world]\nsize = [2000, 2000]\nduration = 20\n[body.kilobot]\nspeed_error = 0\nturn_error = 0\nheading_bias = 0\nheading_noise = 0\n{}{}{}",
        group("plain", -900, ""),
        group("fast", -300, "model = { speed = 20 }"),
        group("worn", 300, "model = { heading_bias = 6 }\nlink = { rate = 8 }"),
    );
    let mut ends = Vec::new();
    let summary = run_with(&folder, &text, 1, |simulation| {
        ends = (0..30).filter_map(|robot| simulation.view(robot)).map(|view| view.pose).collect();
    });
    assert!(summary.faults.is_empty());
    let straight = std::f32::consts::FRAC_PI_2;
    for (number, pose) in ends.iter().enumerate() {
        match number / 10 {
            0 => close(pose.y, -900.0 + 200.0, 2.0),
            1 => close(pose.y, -300.0 + 400.0, 4.0),
            _ => assert!(pose.y < 520.0),
        }
        if number < 20 {
            close(pose.heading, straight, 0.001);
        }
    }
    let strays = ends[20..].iter().filter(|pose| (pose.heading - straight).abs() > 0.3).count();
    assert!(strays >= 6, "{strays} of 10");
    // 10 robots of each group for 20 s: 2 frames a second, and 8 where the file says so (kilolib's timer gives 7.6).
    let sent = summary.statistics.all_links().sent;
    assert!((2 * 380 + 1450..=2 * 400 + 1600).contains(&sent), "{sent}");
}

/// `--set` speaks of groups, and a group of defaults is no other than one that says nothing.
#[test]
fn parameters_of_groups_can_be_set() {
    let folder = folder("set_models", &[("walk.bzz", WALK)]);
    let text = "[world]\nsize = [500, 500]\nduration = 1\n\
                [[robots]]\nrobot = \"crazyflie\"\nscript = \"walk.bzz\"\nmodel = {}\n";
    let set = |set: &[&str]| {
        let set: Vec<String> = set.iter().map(|set| (*set).to_owned()).collect();
        bittybuzz_arena::scenario::Scenario::parse(
            text,
            "s.toml",
            &folder,
            &set,
            &bittybuzz_robot_models::all(),
        )
    };
    let scenario = set(&["robots.0.model.lag=0.5", "robots.0.link.loss=0.25"]).unwrap();
    let group = &scenario.groups[0];
    let model = |group: &Group| {
        let model: &dyn std::any::Any = &*group.model;
        *model.downcast_ref::<CrazyflieModel>().unwrap()
    };
    assert_eq!(model(group).lag, 0.5);
    assert_eq!(group.link.loss.map(|loss| (loss.near, loss.far)), Some((0.25, 0.25)));
    assert_eq!(model(&set(&[]).unwrap().groups[0]), CrazyflieModel::STANDARD);
    assert!(set(&["robots.0.link.rate=3"]).is_err(), "only infrared has a rate");
}

/// Rows are 40 mm times the root of 3/4 apart, and every second one is shifted by 20 mm: six neighbors stand at 40 mm.
#[test]
fn hexagonal_rows() {
    let folder = folder("hexagonal", &[("walk.bzz", WALK)]);
    let text = "[world]\nsize = [500, 500]\nduration = 1\n[[robots]]\nrobot = \"kilobot\"\nscript = \"walk.bzz\"\n\
                count = 8\nplacement = \"hexagonal\"\nspacing = 40\ncolumns = 3\nat = [10, 20]\n";
    let (scenario, _) = read(&folder, text);
    let points: Vec<[f64; 2]> = scenario.groups[0].placement.points(8).collect();
    let height = 40.0 * 0.75_f64.sqrt();
    let (low, high) = (20.0 - height, 20.0 + height);
    let expected = [
        [-40.0, low],
        [0.0, low],
        [40.0, low],
        [-20.0, 20.0],
        [20.0, 20.0],
        [60.0, 20.0],
        [-40.0, high],
        [0.0, high],
    ];
    for (point, expected) in points.iter().zip(expected) {
        assert!((point[0] - expected[0]).abs() < 1e-9, "{points:?}");
        assert!((point[1] - expected[1]).abs() < 1e-9, "{points:?}");
    }
    let from = |other: &&[f64; 2]| (other[0] - 20.0).hypot(other[1] - 20.0);
    // The sixth would be the ninth robot.
    assert_eq!(points.iter().filter(|other| (from(other) - 40.0).abs() < 1e-9).count(), 5);
}

/// More robots than numbers of 32 bits are mistakes, of which the first are listed, and no defect.
#[test]
fn groups_with_more_robots_than_there_are_numbers_are_mistakes() {
    let group = "[[robots]]\nrobot = \"zooids\"\nscript = \"s.bzz\"\ncount = 65536\n";
    let text = format!("[world]\nsize = [100, 100]\nduration = 1\n{}", group.repeat(66_000));
    let files = MemoryFiles::default().with("s.toml", text).with("s.bzz", "");
    let models = bittybuzz_robot_models::all();
    let errors = Scenario::open_in(&files, "s.toml".as_ref(), &[], &models).err().unwrap();
    assert!(errors.len() >= 100, "{}", errors.len());
    assert!(errors[0].to_string().contains("id 131071"), "{}", errors[0]);
}

/// The headings at the start, in degrees, of robots at these positions that have the heading of their
/// group.
fn headings(positions: &str, heading: &str) -> Vec<f32> {
    let text = format!(
        "[world]\nsize = [1000, 1000]\nduration = 1\n[[robots]]\nrobot = \"kilobot\"\n\
         script = \"s.bzz\"\npositions = [{positions}]\nheading = {heading}\n"
    );
    let files = MemoryFiles::default().with("s.bzz", "function step() { }");
    let models = bittybuzz_robot_models::all();
    let scenario = Scenario::parse_in(&files, &text, "s.toml".as_ref(), &[], &models).unwrap();
    let poses = start_poses(&scenario, 7).unwrap();
    poses.iter().map(|pose| pose.heading.to_degrees()).collect()
}

#[test]
fn a_listed_robot_has_a_heading_of_its_own() {
    assert_eq!(headings("[0, 0, 90], [100, 0], [200, 0, -90]", "45"), [90.0, 45.0, -90.0]);
    let drawn = headings("[0, 0], [100, 0], [200, 0]", "\"random\"");
    let one = headings("[0, 0], [100, 0, 90], [200, 0]", "\"random\"");
    assert!((drawn[1] - 90.0).abs() > 1.0, "{drawn:?}");
    assert_eq!(one, [drawn[0], 90.0, drawn[2]]);
}

/// A preset gives range, edge and loss; other keys of the medium stay, and a key beside it has the last word.
#[test]
fn a_preset_of_infrared_can_be_changed_by_keys() {
    let group = |more: &str| {
        format!(
            "[[robots]]\nrobot = \"kilobot\"\nscript = \"s.bzz\"\npositions = [[0, 0]]\n{more}\n"
        )
    };
    let link = |medium: &str, of_group: &str| {
        let folder = folder("presets", &[("s.bzz", "function step() { }\n")]);
        let text = format!(
            "[world]\nsize = [900, 900]\nduration = 1\n{}[medium.ir]\nduplication = 0.5\n{medium}\n",
            group(of_group)
        );
        let (scenario, programs) = read(&folder, &text);
        let setup = bittybuzz_arena::run::Setup::new(scenario, programs).unwrap();
        setup.link(&setup.scenario.groups[0])
    };
    let standard = LinkSettings {
        range: Some(117.0),
        edge: 10.0,
        loss: Loss::even(0.042),
        duplicate: 0.5,
        reorder: 0.0,
    };
    assert_eq!(link("", ""), standard);
    let icra = LinkSettings { range: Some(67.0), ..standard };
    assert_eq!(link("preset = \"icra2012\"", ""), icra);
    assert_eq!(link("", "link = { preset = \"icra2012\" }"), icra);
    let changed = LinkSettings { range: Some(80.0), edge: 0.0, ..standard };
    assert_eq!(link("edge = 0\npreset = \"ants2018-long\"\nrange = 80", ""), changed);
}
