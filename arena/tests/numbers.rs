//! The time that a stigmergy needs does not depend on its number.

use crate::script::{folder, run_with};

/// A barrier as published scripts write it: each robot puts its number, and waits until all have put.
fn barrier(number: u16, robots: usize) -> String {
    format!(
        "ROBOTS = {robots}
         BARRIER = {number}
         ticks = 0
         passed = 0
         function init() {{ wall = stigmergy.create(BARRIER) }}
         function step() {{
           ticks = ticks + 1
           if(passed) return
           if(ticks == 20) wall.put(id, 1)
           if(ticks > 20) {{
             wall.get(id)
             if(wall.size() >= ROBOTS) passed = ticks
           }}
         }}"
    )
}

/// Returns the tick after which all robots have passed, at most that of 120 s.
fn time(robot: &str, robots: usize, radius: u16, number: u16) -> usize {
    let name = format!("barrier-{robot}");
    let folder = folder(&name, &[("s.bzz", &barrier(number, robots))]);
    let text = format!(
        "[world]\nsize = [3000, 3000]\nduration = 120\n\
         [[robots]]\nrobot = \"{robot}\"\nscript = \"s.bzz\"\ncount = {robots}\n\
         placement = \"circle\"\nradius = {radius}\n\
         [[expect]]\nwithin = 120\nvalue = \"global.passed\"\nabove = 0\n"
    );
    let mut ticks = 0;
    run_with(&folder, &text, 1, |simulation| {
        ticks += usize::from(simulation.convergences()[0].first.is_none());
    });
    ticks
}

#[test]
fn a_barrier_takes_the_same_time_with_any_number() {
    for (robot, robots, radius) in [("kilobot", 4, 40), ("zooids", 12, 400), ("crazyflie", 12, 400)]
    {
        let expected = time(robot, robots, radius, 0);
        // The robots put after two seconds.
        assert!((20..60).contains(&expected), "{robot}: {expected} ticks");
        for number in [1, 3, 101] {
            let found = time(robot, robots, radius, number);
            assert!(
                10 * found <= 11 * expected,
                "{robot}: {found} ticks with number {number}, {expected} with 0"
            );
        }
    }
}
