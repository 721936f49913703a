//! The longest slices of scripts on the robots' images, which tests of `tests/hil` measure in emulation.

use anyhow::Result;
use bittybuzz_builds::board::{CRAZYFLIE, KILOBOT, ZOOIDS};
use bittybuzz_builds::cargo_test::{CHECK, FIGURES, all_tests};
use bittybuzz_builds::shell::Invocation;

/// Executes `bench slices [--update]`: compares the slices with `bench/hil.json`, or records them.
pub fn run(update: bool) -> Result<()> {
    let date = Invocation::new("date", &["+%F"]).unannounced().output(0)?;
    let date = String::from_utf8(date.stdout)?;
    let mut tests = all_tests(&["--test", "hil"], &["slices::", "--nocapture"])
        .env(FIGURES, if update { date.trim() } else { CHECK });
    for (variable, board) in [
        ("BITTYBUZZ_CRAZYFLIE", &CRAZYFLIE),
        ("BITTYBUZZ_ZOOIDS", &ZOOIDS),
        ("BITTYBUZZ_KILOBOT", &KILOBOT),
    ] {
        tests = tests.env(variable, &board.build(None, false)?.display().to_string());
    }
    tests.run()
}
