//! Measures the memory that a robot's firmware takes, and the part of it that the virtual machine
//! takes.
//!
//! An image is measured as it is flashed, but without the data that only a debug probe reads, if
//! they can be left out. The machine alone is measured with a probe program: the size with the
//! machine less the size without it. The image that the probe runs is not known to the compiler, so
//! the probe contains all of the machine, soft float included:
//!
//! | name | the machine with |
//! |---|---|
//! | `vm_min_flash` | nothing that can be left out |
//! | `vm_flash` | everything in the profile `tiny` |
//! | `vm_full_flash` | everything in the profile `full` |
//! | `vm_ram` | the robot's sizes and profile |

use anyhow::{Result, bail, ensure};
use bittybuzz_builds::board::{CRAZYFLIE, FirmwareBuild, KILOBOT, ZOOIDS};
use bittybuzz_builds::elf;
use bittybuzz_builds::probe::{ATMEGA328P, CORTEX_M0, CORTEX_M4F, Extent, PanicProbe};
use bittybuzz_robot_spec::NumberProfile;
use serde_json::{Map, Value};

/// A robot whose memory is measured.
struct Measured {
    firmware: &'static FirmwareBuild,
    probe: &'static PanicProbe,
}

const ROBOTS: &[Measured] = &[
    Measured { firmware: &CRAZYFLIE, probe: &CORTEX_M4F },
    Measured { firmware: &ZOOIDS, probe: &CORTEX_M0 },
    Measured { firmware: &KILOBOT, probe: &ATMEGA328P },
];

/// The sizes of a robot's firmware, in bytes.
#[derive(Debug, PartialEq, Eq)]
struct FirmwareSizes {
    robot: &'static str,
    values: Vec<(&'static str, u64)>,
}

/// Prints all sizes, and fails if one is over its budget.
pub fn run(json: bool) -> Result<()> {
    let sizes = measure(json)?;
    match json {
        true => println!("{}", to_json(&sizes)),
        false => print!("{}", to_text(&sizes)),
    }
    check(&sizes)
}

/// Measures all robots. With `quiet`, standard output is left to the result, which is JSON.
fn measure(quiet: bool) -> Result<Vec<FirmwareSizes>> {
    ROBOTS.iter().map(|measured| measured.sizes(quiet)).collect()
}

impl Measured {
    fn sizes(&self, quiet: bool) -> Result<FirmwareSizes> {
        let image = elf::footprint(&self.firmware.build_measured(quiet)?)?;
        let mut values = vec![("flash", image.flash), ("ram", image.ram)];
        let robot = bittybuzz_robot_files::find(self.probe.robot)?;
        let probed = |extent| elf::footprint(&self.probe.build(extent, quiet)?);
        let empty = probed(Extent::Empty)?;
        for extent in self.probe.extents() {
            let size = probed(*extent)?;
            if size.initial > empty.initial {
                bail!(
                    "{}: the machine is not all zeros before an image is loaded",
                    self.probe.robot
                );
            }
            let name = match extent {
                Extent::Full => "vm_full_flash",
                Extent::Tiny => "vm_flash",
                _ => "vm_min_flash",
            };
            values.push((name, size.flash - empty.flash));
            let own =
                if robot.profile == NumberProfile::Full { Extent::Full } else { Extent::Tiny };
            if *extent == own {
                values.push(("vm_ram", size.ram - empty.ram));
            }
        }
        Ok(FirmwareSizes { robot: self.probe.robot, values })
    }
}

/// Fails if an image or the machine needs more memory than its robot file allows.
fn check(sizes: &[FirmwareSizes]) -> Result<()> {
    let mut excesses = Vec::new();
    for FirmwareSizes { robot, values } in sizes {
        let file = bittybuzz_robot_files::find(robot)?;
        let machine = file.vm.memory - file.queue_memory();
        let budget = file
            .budget
            .iter()
            .flat_map(|budget| [("flash", budget.flash_bytes), ("ram", budget.ram_bytes)]);
        for (name, most) in budget.chain([("vm_ram", machine)]) {
            let value = values.iter().find(|(known, _)| *known == name);
            if let Some((_, value)) = value.filter(|(_, value)| *value > u64::from(most)) {
                excesses.push(format!("{robot} {name} {value} > {most}"));
            }
        }
    }
    ensure!(excesses.is_empty(), "over what the robot file allows: {}", excesses.join(", "));
    Ok(())
}

fn to_json(sizes: &[FirmwareSizes]) -> Value {
    let object = |values: &[(&str, u64)]| {
        let fields = values.iter().map(|(name, value)| ((*name).to_owned(), Value::from(*value)));
        Value::Object(fields.collect())
    };
    let robots = sizes.iter().map(|sizes| (sizes.robot.to_owned(), object(&sizes.values)));
    Value::Object(robots.collect::<Map<_, _>>())
}

fn to_text(sizes: &[FirmwareSizes]) -> String {
    let line =
        |robot: &str, (name, value): &(&str, u64)| format!("{robot:<12}{name:<16}{value:>8}\n");
    let lines =
        sizes.iter().flat_map(|sizes| sizes.values.iter().map(|value| line(sizes.robot, value)));
    lines.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn crazyflie(flash: u64, ram: u64) -> Vec<FirmwareSizes> {
        vec![FirmwareSizes { robot: "crazyflie", values: vec![("flash", flash), ("ram", ram)] }]
    }

    #[test]
    fn the_budget_is_that_of_the_robot_file() {
        assert!(check(&crazyflie(80_000, 24_576)).is_ok());
        let failure = check(&crazyflie(80_001, 24_577)).unwrap_err().to_string();
        assert!(failure.contains("flash 80001 > 80000"), "{failure}");
        assert!(failure.contains("ram 24577 > 24576"), "{failure}");
    }

    #[test]
    fn json_has_an_object_per_robot() {
        assert_eq!(to_json(&crazyflie(7, 8)).to_string(), r#"{"crazyflie":{"flash":7,"ram":8}}"#);
    }
}
