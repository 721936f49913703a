//! How much of a robot's memory the firmware takes, and how much of that the virtual machine.
//!
//! An image is measured as it is flashed. The machine alone is measured in a probe, a program for the robot's core that
//! does nothing but load and run an image: its size with the machine less its size without. The probe's image is not
//! known to the compiler, so that all of the machine is in it, maths and soft float included.

use crate::board::{self, CRAZYFLIE, target_of};
use crate::elf::{self, Footprint};
use crate::failure::Failure;
use crate::shell::Line;
use bittybuzz_robots::{Profile, Robot};
use serde_json::{Map, Value};

const PROBE: &str = "firmware/probe-cortex-m";

/// Slots of the probe's machine.
const PROBE_SLOTS: u32 = 640;

/// A robot, and what of it can be measured.
struct Measured {
    robot: &'static str,
    firmware: Option<&'static board::Board>,
    /// The target of the probe.
    target: &'static str,
}

/// Features of the probe: everything that the profile `tiny` has. Strings made at run time are for `full` only.
const TINY: &str = "maths";
/// Everything in the profile `full`.
const FULL: &str = "maths,strings,full";

/// Not the Kilobot: its machine does not fit yet, and its toolchain is another.
const ROBOTS: &[Measured] = &[
    Measured { robot: "crazyflie", firmware: Some(&CRAZYFLIE), target: "thumbv7em-none-eabihf" },
    Measured { robot: "zooids", firmware: None, target: "thumbv6m-none-eabi" },
];

/// What is known of a robot; in bytes.
#[derive(Debug, PartialEq, Eq)]
struct Sizes {
    robot: &'static str,
    values: Vec<(&'static str, u64)>,
}

/// `sizes [--json]`
pub fn run(arguments: &[String]) -> Result<(), Failure> {
    let json = match arguments {
        [] => false,
        [option] if option == "--json" => true,
        _ => return Err(Failure::Usage("`sizes` takes no argument but `--json`".to_owned())),
    };
    let sizes = measure(json)?;
    match json {
        true => println!("{}", to_json(&sizes)),
        false => print!("{}", to_text(&sizes)),
    }
    check(&sizes)
}

/// Measures everything. Standard output is for the result alone if it is JSON.
fn measure(quiet: bool) -> Result<Vec<Sizes>, Failure> {
    ROBOTS.iter().map(|measured| measured.sizes(quiet)).collect()
}

impl Measured {
    fn sizes(&self, quiet: bool) -> Result<Sizes, Failure> {
        let mut values = Vec::new();
        if let Some(firmware) = self.firmware {
            let image = elf::footprint(&firmware.build(None, quiet)?)?;
            values.extend([("flash", image.flash), ("ram", image.ram)]);
        }
        let robot = find(self.robot)?;
        if robot.vm.slots != PROBE_SLOTS {
            let (robot, slots) = (robot.name, robot.vm.slots);
            return Err(Failure::Slots { robot, slots, probe: PROBE_SLOTS });
        }
        // The probe's machine is a variable with an initial value, that of a robot is none: code alone counts.
        let code = |probe: Footprint| probe.flash - probe.initial;
        let empty = self.probe("empty", quiet)?;
        let [tiny, full] = [self.probe(TINY, quiet)?, self.probe(FULL, quiet)?];
        let own = if robot.profile == Profile::Full { full } else { tiny };
        values.extend([
            ("vm_flash", code(tiny).saturating_sub(code(empty))),
            ("vm_full_flash", code(full).saturating_sub(code(empty))),
            ("vm_ram", own.ram.saturating_sub(empty.ram)),
        ]);
        Ok(Sizes { robot: self.robot, values })
    }

    fn probe(&self, features: &str, quiet: bool) -> Result<Footprint, Failure> {
        let arguments = ["build", "--release", "--target", self.target, "--features", features];
        let line = Line::new("cargo", &arguments).in_workspace(PROBE);
        if quiet { line.unannounced() } else { line }.run()?;
        elf::footprint(&target_of(PROBE).join(self.target).join("release/probe-cortex-m"))
    }
}

fn find(robot: &str) -> Result<Robot, Failure> {
    bittybuzz_robots::find(robot).map_err(|error| Failure::Robot(error.to_string()))
}

/// Fails if an image needs more than its robot file allows.
fn check(sizes: &[Sizes]) -> Result<(), Failure> {
    let mut excesses = Vec::new();
    for Sizes { robot, values } in sizes {
        let Some(budget) = find(robot)?.budget else { continue };
        for (name, most) in [("flash", budget.flash_bytes), ("ram", budget.ram_bytes)] {
            let value = values.iter().find(|(known, _)| *known == name);
            if let Some((_, value)) = value.filter(|(_, value)| *value > u64::from(most)) {
                excesses.push(format!("{robot} {name} {value} > {most}"));
            }
        }
    }
    if excesses.is_empty() { Ok(()) } else { Err(Failure::OverBudget(excesses)) }
}

fn to_json(sizes: &[Sizes]) -> Value {
    let object = |values: &[(&str, u64)]| {
        let fields = values.iter().map(|(name, value)| ((*name).to_owned(), Value::from(*value)));
        Value::Object(fields.collect())
    };
    let robots = sizes.iter().map(|sizes| (sizes.robot.to_owned(), object(&sizes.values)));
    Value::Object(robots.collect::<Map<_, _>>())
}

fn to_text(sizes: &[Sizes]) -> String {
    let line =
        |robot: &str, (name, value): &(&str, u64)| format!("{robot:<12}{name:<16}{value:>8}\n");
    let lines =
        sizes.iter().flat_map(|sizes| sizes.values.iter().map(|value| line(sizes.robot, value)));
    lines.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn crazyflie(flash: u64, ram: u64) -> Vec<Sizes> {
        vec![Sizes { robot: "crazyflie", values: vec![("flash", flash), ("ram", ram)] }]
    }

    #[test]
    fn the_budget_is_that_of_the_robot_file() {
        assert!(check(&crazyflie(65_536, 24_576)).is_ok());
        let failure = check(&crazyflie(65_537, 24_577)).unwrap_err().to_string();
        assert!(failure.contains("flash 65537 > 65536"), "{failure}");
        assert!(failure.contains("ram 24577 > 24576"), "{failure}");
    }

    #[test]
    fn json_has_an_object_per_robot() {
        assert_eq!(to_json(&crazyflie(7, 8)).to_string(), r#"{"crazyflie":{"flash":7,"ram":8}}"#);
    }

    #[test]
    fn a_misspelt_option_is_told() {
        assert!(matches!(run(&["--jason".to_owned()]), Err(Failure::Usage(_))));
    }
}
