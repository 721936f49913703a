//! Painted ground, and the hook by which ground sensors read it: one call in a tick for all robots.

use std::f32::consts::FRAC_PI_2;
use std::sync::{Arc, Mutex};

use crate::common::robots::Settings;
use crate::common::{close, exact};
use crate::script::{folder, run_with};
use bittybuzz_arena::engine::{
    BodyBlock, BodyModel, BodySize, Brain, Environment, Io, Media, Medium, PaintedGround, Patch,
    PatchShape, Pose, SettingsError, World, WorldSettings,
};
use bittybuzz_kilobot_model::KilobotModel;

/// A Kilobot with ground sensors.
#[derive(Debug)]
struct Eyed(KilobotModel, Vec<[f32; 2]>);

impl BodyModel for Eyed {
    fn shape(&self) -> BodySize {
        self.0.shape()
    }

    fn top_speed_mm_s(&self) -> f32 {
        self.0.top_speed_mm_s()
    }

    fn medium(&self) -> Medium {
        self.0.medium()
    }

    fn has_positioning(&self) -> bool {
        false
    }

    fn ground_sensors(&self) -> Vec<[f32; 2]> {
        self.1.clone()
    }

    fn check(&self) -> Result<(), SettingsError> {
        Ok(())
    }

    fn block(&self, substep_s: f32) -> Box<dyn BodyBlock> {
        self.0.block(substep_s)
    }
}

/// Keeps what it reads.
#[derive(Clone, Debug, Default)]
struct Reader(Vec<f32>);

impl Brain for Reader {
    fn tick(&mut self, io: &mut Io<'_>) {
        self.0 = (0..3).map(|sensor| io.sensors.ground(sensor)).collect();
    }
}

/// Writes down what it is asked, and gives the number of the place.
#[derive(Clone, Debug, Default)]
struct Counting(Arc<Mutex<Vec<Vec<[f32; 2]>>>>);

impl Environment for Counting {
    fn copy(&self) -> Box<dyn Environment> {
        Box::new(self.clone())
    }

    fn sense(&mut self, places: &[[f32; 2]], values: &mut [f32]) {
        self.0.lock().unwrap().push(places.to_vec());
        (0..).zip(values).for_each(|(number, value)| *value = number as f32);
    }
}

/// A world with herds that have no sensor, one in the middle, and two.
fn world() -> (World<Reader>, [bittybuzz_arena::engine::HerdId; 3]) {
    let Settings { kilobot, area, .. } = exact();
    let mut world = World::new(WorldSettings { area, ..WorldSettings::default() }).unwrap();
    let herds = [vec![], vec![[0.0, 0.0]], vec![[10.0, 0.0], [0.0, 5.0]]]
        .map(|sensors| world.add_herd(Arc::new(Eyed(kilobot, sensors)), Media::STANDARD).unwrap());
    (world, herds)
}

/// Robots of three herds join in turn, one of them later: places and values are in the order of their ids.
#[test]
fn an_environment_is_asked_once_in_a_tick() {
    let (mut world, [blind, one, two]) = world();
    let environment = Counting::default();
    world.set_ground(environment.clone());
    let add = |world: &mut World<Reader>, herd, x| {
        world.add(herd, Pose::new(x, 100.0, FRAC_PI_2), Reader::default()).unwrap();
    };
    // They look along y: ahead is +y, left is -x.
    for (herd, x) in [(two, 0.0), (two, 100.0), (blind, 200.0), (one, 300.0)] {
        add(&mut world, herd, x);
    }
    for _ in 0..3 {
        world.tick();
    }
    add(&mut world, two, -100.0);
    world.tick();
    let asked = environment.0.lock().unwrap().clone();
    let first = vec![[0.0, 110.0], [-5.0, 100.0], [100.0, 110.0], [95.0, 100.0], [300.0, 100.0]];
    let last = [&first[..], &[[-100.0, 110.0], [-105.0, 100.0]]].concat();
    let expected = [first.clone(), first.clone(), first, last];
    assert_eq!(asked.iter().map(Vec::len).collect::<Vec<_>>(), [5, 5, 5, 7]);
    for (asked, expected) in asked.concat().iter().zip(expected.concat()) {
        close(asked[0], expected[0], 0.001);
        close(asked[1], expected[1], 0.001);
    }
    // A sensor that a robot does not have reads white.
    let read: Vec<Vec<f32>> = world.brains().map(|brain| brain.0.clone()).collect();
    let expected =
        [[0.0, 1.0, 1.0], [2.0, 3.0, 1.0], [1.0, 1.0, 1.0], [4.0, 1.0, 1.0], [5.0, 6.0, 1.0]];
    assert_eq!(read, expected);
}

fn patch(x: f32, y: f32, shape: PatchShape, brightness: f32) -> Patch {
    Patch { x, y, shape, brightness }
}

/// Later patches lie over earlier ones; rims belong to patches.
#[test]
fn the_uppermost_patch_is_read() {
    let straight = PatchShape::Box { width: 40.0, height: 20.0, along: (2.0, 0.0) };
    // Of 200 mm by 20 mm, it rises by 30 degrees.
    let (sin, cos) = 30.0_f32.to_radians().sin_cos();
    let line = PatchShape::Box { width: 200.0, height: 20.0, along: (cos, sin) };
    let nowhere = PatchShape::Box { width: 1e6, height: 1e6, along: (0.0, 0.0) };
    let mut ground = PaintedGround::new([
        patch(0.0, 0.0, PatchShape::Disc(50.0), 0.0),
        patch(10.0, 0.0, straight, 0.5),
        patch(1000.0, 0.0, line, 0.25),
        patch(0.0, 0.0, nowhere, 0.75),
    ]);
    let cases = [
        ([0.0, 50.0], 0.0),
        ([0.0, 50.1], 1.0),
        ([-10.1, 0.0], 0.0),
        ([-10.0, 10.0], 0.5),
        ([30.0, -10.0], 0.5),
        ([30.1, 0.0], 0.0),
        // 99 mm along the line, and 101 mm.
        ([1000.0 + 85.736, 49.5], 0.25),
        ([1000.0 + 87.469, 50.5], 1.0),
        // Along x the line is 10 / sin 30 degrees = 20 mm wide to each side.
        ([1019.9, 0.0], 0.25),
        ([1020.1, 0.0], 1.0),
    ];
    let places = cases.map(|(place, _)| place);
    let mut values = [7.0; 10];
    ground.sense(&places, &mut values);
    assert_eq!(values, cases.map(|(_, brightness)| brightness));
}

#[test]
fn the_digest_depends_on_the_paint() {
    let digest = |patches: Option<Vec<Patch>>| {
        let (mut world, [blind, ..]) = world();
        world.add(blind, Pose::default(), Reader::default()).unwrap();
        patches.into_iter().for_each(|patches| world.set_ground(PaintedGround::new(patches)));
        world.tick();
        (world.digest(), world.clone().digest())
    };
    let black = patch(0.0, 0.0, PatchShape::Disc(50.0), 0.0);
    let gray = Patch { brightness: 0.5, ..black };
    let digests = [None, Some(vec![black]), Some(vec![gray])].map(digest);
    assert!(digests.iter().all(|(own, copy)| own == copy));
    assert_ne!(digests[0], digests[1]);
    assert_ne!(digests[1], digests[2]);
}

/// A robot with three ground sensors, in the middle, 20 mm ahead and 20 mm to the left, looks along y. Ahead of it is a gray disc,
/// left of it a black box that is turned.
#[test]
fn described_robots_read_the_paint_of_the_scenario() {
    let sensor = |name: &str, keys: &str| {
        format!("[[sensor]]\nname = \"{name}\"\nkind = \"ground\"\n{keys}\n\n")
    };
    let function = |name: &str| {
        format!(
            "[[function]]\nname = \"{name}\"\naccepts = [\"\"]\nreturns = \"int\"\nreads = \"{name}\"\nhelp = \"a test\"\n\n"
        )
    };
    let robot = [
        "name = \"mine\"\n\n[body]\nradius_mm = 30\ndrive = \"unicycle\"\nspeed_mm_s = 1\nturn_deg_s = 1\n\n".to_owned(),
        "[[sensor]]\nname = \"eye\"\nkind = \"light\"\n\n".to_owned(),
        sensor("middle", ""),
        sensor("front", "at_mm = [20, 0]"),
        sensor("side", "at_mm = [0, 20]"),
        sensor("noisy", "noise = 100"),
        ["middle", "front", "side", "noisy", "eye"].map(function).concat(),
    ];
    let script = "m = 0 f = 0 s = 0 n = 0 sum = 0 all = 0\n\
                  function step() { m = middle() f = front() s = side() n = noisy()\n\
                  if(n > 1023 or n < 0) all = 1\nsum = sum + n }\n";
    let files = [("s.bzz", script), ("mine.toml", &robot.concat())];
    let folder = folder("painted", &files);
    let world = |ground: &str, expects: &[(&str, f64, f64)]| {
        let expects = expects.iter().map(|(global, value, tolerance)| {
            format!(
                "[[expect]]\nat = 20\nvalue = \"global.{global}\"\nequals = {value}\ntolerance = {tolerance}\n"
            )
        });
        format!(
            "[world]\nsize = [400, 400]\nduration = 20\n{ground}\n[[robots]]\nrobot = \"mine.toml\"\n\
             script = \"s.bzz\"\npositions = [[50, 50]]\nheading = 90\n{}",
            expects.collect::<String>()
        )
    };
    for text in [
        // Half of 1023 rounds up. The mean of 200 values with a deviation of 100 around 307 has one of 7.
        world(
            "ground = [{ at = [50, 50], size = [200, 200], brightness = 0.3 }, { at = [50, 80], radius = 15, brightness = 0.5 },\n\
             { at = [30, 50], size = [100, 10], heading = 90 }]",
            &[
                ("m", 307.0, 0.0),
                ("f", 512.0, 0.0),
                ("s", 0.0, 0.0),
                ("sum", 200.0 * 307.0, 5000.0),
                ("all", 0.0, 0.0),
            ],
        ),
        // White, of which noise is cut off above.
        world(
            "ground = []",
            &[("m", 1023.0, 0.0), ("f", 1023.0, 0.0), ("s", 1023.0, 0.0), ("all", 0.0, 0.0)],
        ),
    ] {
        let summary = run_with(&folder, &text, 1, |_| ());
        assert!(summary.is_success(), "{:?}\n{:?}", summary.convergences, summary.faults);
    }
}
