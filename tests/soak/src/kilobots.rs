//! Kilobots on their firmware run each of their examples for 100,000 ticks: none may report a fault,
//! and each has to complete as many steps. The results of the longer examples are compared with
//! those of virtual machines.

use crate::Verdict;
use crate::simulator::{self, Build};
use crate::sources::write;
use anyhow::{Result, bail, ensure};
use bittybuzz_builds::board::KILOBOT;
use bittybuzz_builds::cargo_test::image_tests;
use bittybuzz_builds::shell::{Invocation, root, target};
use fs_err as fs;
use std::path::{Path, PathBuf};

/// The folders with examples for Kilobots.
const FOLDERS: [&str; 3] = ["examples", "examples/kilobot", "examples/swarm"];

/// The number of robots, all in range of each other.
const ROBOTS: u32 = 3;

/// Ten ticks each.
const SECONDS: u32 = 10_000;
const SECONDS_OF_SAMPLE: u32 = 100;
const TICKS_PER_SECOND: u32 = 10;

/// Percent of its ticks that a robot has to use. Its oscillator is up to 1.5 % slow.
const PACE_MIN_PERCENT: u32 = 98;

/// The example that CI plays, one of the largest images. CI also runs the images of all behaviors, in `tests/hil`.
const SAMPLE: &str = "examples/swarm/barrier.bzz";

/// A script with which one of three robots stops after a while, without a fault.
const STANDSTILL: &str = "\
n = 0
function step() {
  n = n + 1
  while(id == 1 and n > 30) {}
}
";
const SECONDS_OF_STANDSTILL: u32 = 20;

/// The item that compares images with virtual machines.
const MEDIANS: &str = "medians";

pub fn items() -> Vec<String> {
    examples().into_iter().chain([MEDIANS.to_owned()]).collect()
}

/// The examples whose header names Kilobots.
pub fn examples() -> Vec<String> {
    let mut examples: Vec<String> = FOLDERS.iter().flat_map(|folder| of_kilobots(folder)).collect();
    examples.sort();
    examples
}

fn of_kilobots(folder: &str) -> Vec<String> {
    let entries = fs::read_dir(root().join(folder)).into_iter().flatten().flatten();
    let scripts = entries.map(|entry| entry.path()).filter(|path| {
        path.extension().is_some_and(|extension| extension == "bzz")
            && fs::read_to_string(path).is_ok_and(|text| is_for_kilobots(&text))
    });
    let name = |path: PathBuf| Some(format!("{folder}/{}", path.file_name()?.to_str()?));
    scripts.filter_map(name).collect()
}

/// Returns true if a script completes a step in each tick: it has one, and never waits in it.
pub fn keeps_pace(text: &str) -> bool {
    let code: Vec<&str> = text.lines().filter_map(|line| line.split('#').next()).collect();
    let calls = |name: &str| code.iter().any(|line| line.contains(name));
    calls("function step(") && !calls("delay(")
}

/// Returns true if the header of a script names the Kilobot.
fn is_for_kilobots(text: &str) -> bool {
    let header = text.lines().take_while(|line| line.starts_with('#'));
    header
        .filter_map(|line| line.strip_prefix("# Robots: "))
        .any(|robots| robots.split(',').any(|robot| robot.trim() == "kilobot"))
}

pub fn run(item: &str) -> Result<Verdict> {
    if item == MEDIANS { medians() } else { play(Build::Optimized, item, SECONDS) }
}

fn medians() -> Result<Verdict> {
    let behaviors = KILOBOT.build_behaviors(true)?;
    let line = image_tests(&["behaviors::", "--ignored", "--nocapture"])?;
    let line = line.env("BITTYBUZZ_BEHAVIORS", &behaviors.display().to_string());
    let output = line.output_if(|output| output.status.code().is_some())?;
    let printed = String::from_utf8_lossy(&output.stdout);
    // The lines that the tests print themselves.
    let evidence: Vec<&str> =
        printed.lines().filter(|line| line.contains("virtual machines")).collect();
    Ok(if output.status.success() {
        Verdict::Shown(evidence.join("; "))
    } else {
        Verdict::Missing(printed.into_owned())
    })
}

/// A thousand ticks of an example, for CI; and a script that stands still is found.
pub fn sample() -> Result<()> {
    let standstill = target()?.join("soak/standstill.bzz");
    write(&standstill, STANDSTILL.as_bytes())?;
    let found =
        match play(Build::Checked, &standstill.display().to_string(), SECONDS_OF_STANDSTILL)? {
            Verdict::Missing(reason) => {
                reason.contains("all: steps above") && reason.contains("robot 1 had 3")
            }
            Verdict::Shown(_) => false,
        };
    ensure!(found, "not shown: kilobots: a script that stands still");
    match play(Build::Checked, SAMPLE, SECONDS_OF_SAMPLE)? {
        Verdict::Shown(evidence) => println!("kilobots {SAMPLE}: {evidence}"),
        Verdict::Missing(reason) => bail!("not shown: kilobots {SAMPLE} ({reason})"),
    }
    Ok(())
}

fn play(build: Build, script: &str, seconds: u32) -> Result<Verdict> {
    verdict(simulation(&build.simulator()?, script, seconds)?, seconds)
}

/// Builds the firmware with a script, and returns the command that runs it. The image is copied to
/// a file of its own, because the next build overwrites it.
fn simulation(bbz: &Path, script: &str, seconds: u32) -> Result<Invocation> {
    let built = KILOBOT.build(Some(&root().join(script)), true)?;
    let scenario =
        target()?.join("soak/kilobots").join(script.replace('/', "-")).with_extension("toml");
    let image = scenario.with_extension("elf");
    let paced = keeps_pace(&fs::read_to_string(root().join(script))?);
    write(&scenario, text(script, &image, seconds, paced).as_bytes())?;
    fs::copy(&built, &image)?;
    let emulator = simulator::avr()?.display().to_string();
    let scenario = scenario.display().to_string();
    let arguments = ["sim", &scenario, "--headless", "--emulator", &emulator];
    // So few robots are slower on two threads, which wait for each other 2,000 times a second.
    Ok(Invocation::named("bbz", bbz, &arguments).env("RAYON_NUM_THREADS", "1"))
}

fn verdict(simulation: Invocation, seconds: u32) -> Result<Verdict> {
    // The status is 1 if a script has stopped; the output has the reason.
    let output = simulation.output_if(|output| output.status.code().is_some())?;
    let printed = String::from_utf8_lossy(&output.stdout);
    Ok(if output.status.success() {
        let steps = printed.lines().find(|line| line.starts_with("steps")).unwrap_or_default();
        Verdict::Shown(format!("{ROBOTS} robots, {seconds} s without a fault; {steps}"))
    } else {
        Verdict::Missing(format!("{printed}{}", String::from_utf8_lossy(&output.stderr)))
    })
}

fn text(script: &str, image: &Path, seconds: u32, paced: bool) -> String {
    let steps_min = seconds * TICKS_PER_SECOND * PACE_MIN_PERCENT / 100;
    let steps = format!("\n[[expect]]\nat = {seconds}\nvalue = \"steps\"\nabove = {steps_min}\n");
    format!(
        "[world]\nsize = [1000, 1000]\nduration = {seconds}\n\n\
         [[robots]]\nrobot = \"kilobot\"\nscript = '{}'\nbackend = \"firmware\"\nfirmware = '{}'\n\
         count = {ROBOTS}\nplacement = \"grid\"\nspacing = 60\n\n\
         [output]\nplot = [\"steps\"]\n\n\
         [[expect]]\nat = {seconds}\nvalue = \"running\"\nequals = 1\n{}",
        root().join(script).display(),
        image.display(),
        if paced { &steps } else { "" }
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scripts_without_steps_or_with_pauses_have_a_pace_of_their_own() {
        assert!(keeps_pace(STANDSTILL));
        assert!(keeps_pace("# No delay() here.\nfunction step() { led(1) }\n"));
        assert!(!keeps_pace("function step() {\n  led(1) delay(500)\n}\n"));
        assert!(!keeps_pace("# function step() {}\nlog(1)\n"));
        let read = |item: &String| fs::read_to_string(root().join(item)).unwrap();
        let others = examples().into_iter().filter(|item| !keeps_pace(&read(item)));
        assert_eq!(others.collect::<Vec<_>>(), ["examples/dice.bzz"]);
    }

    #[test]
    fn examples_name_their_robots() {
        assert!(is_for_kilobots("# Blinks.\n#\n# Robots: kilobot, zooids\nx = 1\n"));
        assert!(!is_for_kilobots("# Flies.\n#\n# Robots: crazyflie\n"));
        assert!(!is_for_kilobots("# Blinks.\nx = 1\n# Robots: kilobot\n"));
        let items = examples();
        assert!(items.iter().any(|known| known == SAMPLE), "{items:?}");
        assert!(!items.iter().any(|known| known == "examples/swarm/flocking.bzz"), "{items:?}");
    }
}
