//! Runs one swarm of three types of robots, each with its own image in its own emulator.

use anyhow::Result;
use bittybuzz_builds::board::{CRAZYFLIE, KILOBOT, ZOOIDS};
use bittybuzz_builds::shell::{Invocation, cargo, root, target};
use std::env;
use std::path::{Path, PathBuf};

const SCENARIO: &str = "examples/unlike/consensus.toml";
const SCRIPT: &str = "examples/swarm/consensus.bzz";

/// The packages of the emulators.
const EMULATORS: [&str; 3] =
    ["bittybuzz-emulate-avr", "bittybuzz-emulate-m0", "bittybuzz-emulate-stm32"];

/// Builds the images and the emulators, and runs the scenario, which fails if the robots do not
/// agree.
pub fn run(bbz: &Path) -> Result<()> {
    println!("\n== {SCENARIO}: Kilobots, Zooids and Crazyflies agree, each with its own image");
    KILOBOT.build(Some(&root().join(SCRIPT)), false)?;
    ZOOIDS.build(None, false)?;
    CRAZYFLIE.build_tiny(None)?;
    let packages = EMULATORS.map(|package| ["--package", package]).concat();
    cargo(&[&["build", "--release"], &packages[..]].concat())?;
    let others = env::var_os("PATH").unwrap_or_default();
    let path: Vec<PathBuf> =
        [target()?.join("release")].into_iter().chain(env::split_paths(&others)).collect();
    let path = env::join_paths(path).unwrap_or(others);
    Invocation::named("bbz", bbz, &["sim", SCENARIO, "--headless"])
        .env("PATH", &path.to_string_lossy())
        .run()?;
    println!(
        "Between light and radios stands a bridge that could be built. Not tried on hardware."
    );
    Ok(())
}
