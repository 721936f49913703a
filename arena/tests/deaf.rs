//! A robot that is heard but hears nobody: what it lacks can not be given to it, and must not cost the others their air.

use bittybuzz_arena::engine::Medium;

use crate::script::{folder, run};

/// The frames per second and robot of nine robots in five minutes. Robot 0 is in the middle, puts first, and is heard by
/// all; the others put over it on a circle, and are heard by robot 0 only if their range is longer than its radius.
fn rate(robot: &str, medium: Medium, [radius, range]: [u32; 2], keys: u32) -> f64 {
    let script = format!(
        "s = stigmergy.create(1)
         t = 0
         function step() {{
           t = t + 1
           k = 0
           while(k < {keys}) {{
             if(id == 0 and t == 50) s.put(k, 1)
             if(id == 1 and t == 100) s.put(k, 2)
             k = k + 1
           }}
         }}"
    );
    let folder = folder("deaf", &[("s.bzz", &script)]);
    let group = |place: &str, range: u32| {
        format!(
            "[[robots]]\nrobot = \"{robot}\"\nscript = \"s.bzz\"\n{place}\nlink = {{ range = {range} }}\n"
        )
    };
    let text = format!(
        "[world]\nsize = [2000, 2000]\nduration = 300\n{}{}",
        group("count = 1\npositions = [[0, 0]]", 1200),
        group(&format!("count = 8\nplacement = \"circle\"\nradius = {radius}"), range),
    );
    run(&folder, &text).statistics.link(medium).sent as f64 / 9.0 / 300.0
}

/// Frames per second that a robot sends at most, of which a tenth may be spent on the deaf one: an infrared link of
/// kilolib has two, and the radios of the others one per step.
#[test]
fn a_robot_that_hears_nobody_costs_a_tenth_of_the_air() {
    for (robot, medium, radius, most, keys) in [
        ("kilobot", Medium::Infrared, 100, 2.0, 1),
        ("kilobot", Medium::Infrared, 100, 2.0, 4),
        ("zooids", Medium::Nrf24, 100, 10.0, 1),
        ("zooids", Medium::Nrf24, 100, 10.0, 12),
        ("crazyflie", Medium::P2p, 400, 10.0, 1),
        ("crazyflie", Medium::P2p, 400, 10.0, 40),
    ] {
        let [heard, deaf] =
            [1200, radius - 10].map(|range| rate(robot, medium, [radius, range], keys));
        println!(
            "{robot}, {keys} keys: {heard:.2} frames per second if it hears, {deaf:.2} if not"
        );
        assert!(
            deaf <= heard + most / 10.0,
            "{robot}, {keys} keys: {deaf:.2}, {heard:.2} if it hears"
        );
    }
}
