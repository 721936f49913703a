//! A hundred robots for 24 hours: `tests/scenarios/day.toml`.

use crate::Verdict;
use crate::simulator::Build;
use anyhow::Result;
use bittybuzz_builds::shell::Invocation;

pub fn items() -> Vec<String> {
    vec!["24 hours".to_owned()]
}

pub fn run(_: &str) -> Result<Verdict> {
    let bbz = Build::Optimized.simulator()?;
    let arguments = ["sim", "tests/scenarios/day.toml", "--headless"];
    let output = Invocation::named("bbz", &bbz, &arguments)
        .output_if(|output| output.status.code().is_some())?;
    print!("{}", String::from_utf8_lossy(&output.stdout));
    Ok(match output.status.code() {
        Some(0) => Verdict::Shown("no script stopped, memory did not run out".to_owned()),
        _ => Verdict::Missing(String::from_utf8_lossy(&output.stderr).into_owned()),
    })
}
