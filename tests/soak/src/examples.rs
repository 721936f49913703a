//! The examples of flights on the Crazyflie's image: each robot takes about half of a core.

use crate::Verdict;
use anyhow::Result;
use bittybuzz_builds::board::CRAZYFLIE;
use bittybuzz_builds::cargo_test::image_tests;

/// The only item.
const FLIGHTS: &str = "flights";

pub fn items() -> Vec<String> {
    vec![FLIGHTS.to_owned()]
}

pub fn run(_: &str) -> Result<Verdict> {
    let firmware = CRAZYFLIE.build(None, false)?;
    let line = image_tests(&["flight_examples::", "--ignored", "--nocapture"])?;
    let line = line.env("BITTYBUZZ_CRAZYFLIE", &firmware.display().to_string());
    let output = line.output_if(|output| output.status.code().is_some())?;
    let printed = String::from_utf8_lossy(&output.stdout);
    // A line for each example.
    let count = printed.lines().filter(|line| line.starts_with("examples/flight/")).count();
    Ok(match output.status.success() {
        true => Verdict::Shown(format!("{count} examples fly on the image")),
        false => Verdict::Missing(printed.into_owned()),
    })
}
