//! The examples of flights on the robots' own image: what their scenarios expect comes true there as in virtual machines.

use std::path::Path;
use std::sync::Arc;

use bittybuzz_arena::run::{Program, Setup, Simulation};
use bittybuzz_arena::scenario::Scenario;
use bittybuzz_compiler::compile::{Options, compile};
use bittybuzz_compiler::include::{DiskFiles, IncludeLoader};
use bittybuzz_hil::{Core, ScriptFile, crazyflie};
use bittybuzz_tests::{bbz, files};

/// The least distance between the middles of two robots in flight, in mm.
pub const APART_MM: f32 = 300.0;

/// Runs an example with the image and other values of keys, and returns the least distance in mm
/// between two robots in the air. A flight of two minutes takes less than 0.4 of a battery that lasts
/// for seven.
pub fn fly(path: &str, keys: &[String]) -> f32 {
    let image = [
        "robots.0.backend=firmware".to_owned(),
        format!("robots.0.firmware={}", crazyflie().display()),
    ];
    let set = [&image[..], keys].concat();
    let scenario = Scenario::open(&bbz::root().join(path), &set, &bittybuzz_robot_models::all())
        .unwrap_or_else(|errors| panic!("{path}: {errors:#?}"));
    fly_scenario(path, scenario)
}

fn fly_scenario(path: &str, scenario: Scenario) -> f32 {
    let programs: Vec<Program> = scenario.groups.iter().map(program).collect();
    let seed = scenario.world.seed;
    let setup = Setup::new(scenario, programs).unwrap();
    let setup = setup.emulated_by("crazyflie", Core::Unicorn.program().to_owned());
    let mut simulation = Simulation::new(Arc::new(setup), seed, 1).unwrap();
    let mut least_mm = f32::INFINITY;
    while !simulation.is_over() {
        simulation.tick().unwrap_or_else(|error| panic!("{path}: {error}"));
        least_mm = least_mm.min(least_distance_mm(&simulation));
    }
    for number in 0..simulation.robot_count() {
        let battery = simulation.battery(number).unwrap();
        let charge = battery.charge.unwrap();
        assert!((0.6..0.999).contains(&charge), "{path}: {battery:?}");
        assert!((3400..4200).contains(&battery.millivolts), "{path}: {battery:?}");
    }
    let summary = simulation.summary();
    assert!(summary.is_success(), "{path}: {:#?}", summary.convergences);
    least_mm
}

fn program(group: &bittybuzz_arena::scenario::Group) -> Program {
    let options = Options {
        robot: Some((*group.robot).clone()),
        robots: bittybuzz_robot_files::all_shipped(),
        ..Options::default()
    };
    let script = group.script.as_ref().unwrap();
    let text = std::fs::read_to_string(script).unwrap();
    let compiled = compile(script, text, &IncludeLoader::new(&DiskFiles), &options);
    let image = compiled.image.unwrap_or_else(|| panic!("{:#?}", compiled.diagnostics));
    Program::new(image, compiled.symbols, Arc::new(compiled.sources))
}

fn least_distance_mm(simulation: &Simulation) -> f32 {
    let poses = (0..simulation.robot_count()).map(|number| simulation.view(number).unwrap().pose);
    let fliers: Vec<_> = poses.filter(|pose| pose.z > 100.0).collect();
    let pairs = fliers.iter().enumerate().flat_map(|(number, one)| {
        let others = fliers[..number].iter();
        others.map(|other| {
            let [x, y, z] = [one.x - other.x, one.y - other.y, one.z - other.z];
            (x * x + y * y + z * z).sqrt()
        })
    });
    pairs.fold(f32::INFINITY, f32::min)
}

/// A robot that flies from place to place. More robots take too long for every run.
#[test]
fn an_example_flies_on_the_image() {
    fly("examples/flight/square.toml", &[]);
}

/// The settings of a group are written to the flash of its robots.
#[test]
fn an_image_has_the_settings_of_its_scenario() {
    let script = "n = 0\nfunction step() {\n n = n + 1\n if(n == 25) takeoff(1000.0)\n \
                  if(n == 26) goTo(2000.0, -1000.0, 1500.0)\n}\n";
    let script = ScriptFile::new("scenario-settings", script);
    let text = format!(
        "[world]\nsize = [6000, 6000]\nduration = 18\n[body.crazyflie]\narmed = true\n\
         fidelity = \"flight\"\npositioning = \"capture\"\n[[robots]]\nrobot = \"crazyflie\"\n\
         script = '{}'\npositions = [[0, 0]]\nheading = 0\nbackend = \"firmware\"\nfirmware = '{}'\n\
         settings = [\"height_mm=700\", \"fence_front_mm=600\", \"fence_right_mm=100\"]\n\
         [[expect]]\nat = 18\nvalue = \"distance(600, -100)\"\nbelow = 60\n\
         [[expect]]\nat = 18\nvalue = \"z\"\nbetween = [640, 760]\n",
        script.path(),
        crazyflie().display()
    );
    let read = Scenario::parse(&text, "s.toml", Path::new(""), &[], &bittybuzz_robot_models::all());
    fly_scenario("s.toml", read.unwrap_or_else(|errors| panic!("{errors:#?}")));
}

/// `cargo xtask soak examples` runs it.
#[test]
#[ignore = "soak"]
fn all_examples_fly_on_the_image() {
    let paths = files::with_extension("examples/flight", "toml");
    assert!(paths.len() >= 8, "{paths:?}");
    for path in paths {
        let least_mm = fly(&path, &[]);
        println!("{path}: {least_mm:.0} mm");
        assert!(least_mm > APART_MM, "{path}: {least_mm} mm");
    }
}
