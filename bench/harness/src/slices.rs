//! The longest slices of scripts on the robots' images and other figures, which tests of `tests/hil`
//! measure in emulation.

use anyhow::Result;
use bittybuzz_builds::board::{CRAZYFLIE, KILOBOT, ZOOIDS};
use bittybuzz_builds::cargo_test::{CHECK, FIGURES, image_tests};
use bittybuzz_builds::shell::Invocation;

/// The tests that compare or record figures.
const TESTS: [&str; 8] = [
    "slices::",
    "zooid_costs::",
    "zooids::its_stack_has_room_to_spare",
    "zooids::positions_are_right_while_it_drives",
    "link::a_busy_script_does_not_delay_the_link_on_unicorn",
    "link::noise_harms_nothing",
    "failures::a_dead_task_restarts_the_robot_on_unicorn",
    "link::shutdown_stops_the_motors_and_is_acknowledged",
];

/// Executes `bench slices [--update]`: compares the figures with `bench/hil.json`, or records them.
pub fn run(update: bool) -> Result<()> {
    let date = Invocation::new("date", &["+%F"]).unannounced().output(0)?;
    let date = String::from_utf8(date.stdout)?;
    let filters = [&["--nocapture", "--include-ignored"], &TESTS[..]].concat();
    let mut tests = image_tests(&filters)?.env(FIGURES, if update { date.trim() } else { CHECK });
    for (variable, board) in [
        ("BITTYBUZZ_CRAZYFLIE", &CRAZYFLIE),
        ("BITTYBUZZ_ZOOIDS", &ZOOIDS),
        ("BITTYBUZZ_KILOBOT", &KILOBOT),
    ] {
        tests = tests.env(variable, &board.build(None, false)?.display().to_string());
    }
    tests.run()
}
