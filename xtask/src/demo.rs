//! The demonstration with robots: after the common parts, it runs the firmware of one robot and then
//! that of a whole swarm in emulation.

use crate::mixed_swarm;
use crate::side_by_side;
use anyhow::Result;
use bittybuzz_builds::setup;

/// Runs the demonstration, with the emulated robots in place of the page if `robots` is set.
pub fn run(robots: bool, no_browser: bool) -> Result<()> {
    if !robots {
        return bittybuzz_demo::run(no_browser);
    }
    setup::run()?;
    let bbz = bittybuzz_demo::without_page()?;
    side_by_side::run(&bbz)?;
    mixed_swarm::run(&bbz)
}
