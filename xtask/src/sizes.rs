//! Measures the memory that a robot's firmware takes, and the part of it that the virtual machine
//! takes.
//!
//! An image is measured as it is flashed, but without the data that only a debug probe reads, if
//! they can be left out. The machine alone is measured with a probe program: the size with the
//! machine less the size without it. The image that the probe runs is not known to the compiler, so
//! the probe contains all of the machine, soft float included. A probe that could panic would not link,
//! so these builds also show that the machine cannot panic:
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
use bittybuzz_builds::shell::{Invocation, root};
use bittybuzz_robot_spec::NumberProfile;
use fs_err as fs;
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

/// The recorded sizes, from which the tables of docs/performance.md are made.
const RECORD: &str = "bench/sizes.json";

/// The part of a recorded size, in percent, by which the measured one may differ before the record
/// counts as stale.
const TOLERANCE_PERCENT: u64 = 1;

/// The choices of the command line.
#[derive(Debug, clap::Args)]
pub struct SizesArguments {
    /// Print an object for each robot
    #[arg(long)]
    json: bool,
    /// Record the sizes of today in `bench/sizes.json`
    #[arg(long, conflicts_with = "json")]
    update: bool,
}

/// Prints all sizes, and fails if one is over its budget.
pub fn run(arguments: &SizesArguments) -> Result<()> {
    let sizes = measure(arguments.json)?;
    match arguments.json {
        true => println!("{}", to_json(&sizes)),
        false => print!("{}", to_text(&sizes)),
    }
    if arguments.update {
        let date = Invocation::new("date", &["+%F"]).unannounced().output(0)?;
        let mut record = to_json(&sizes);
        record["date"] = String::from_utf8(date.stdout)?.trim().into();
        fs::write(root().join(RECORD), serde_json::to_string_pretty(&record)? + "\n")?;
    }
    check(&sizes)
}

/// Measures all sizes. Fails if one is over its budget, or if the recorded sizes are stale.
pub fn check_record() -> Result<()> {
    let sizes = measure(false)?;
    print!("{}", to_text(&sizes));
    check(&sizes)?;
    let record = serde_json::from_str(&fs::read_to_string(root().join(RECORD))?)?;
    let stale = stale(&sizes, &record);
    ensure!(
        stale.is_empty(),
        "{RECORD} is stale; `cargo xtask sizes --update` writes it: {}",
        stale.join(", ")
    );
    Ok(())
}

/// Returns the sizes that are not recorded, or differ from the record by more than the tolerance.
fn stale(sizes: &[FirmwareSizes], record: &Value) -> Vec<String> {
    let all = sizes.iter().flat_map(|sizes| sizes.values.iter().map(|value| (sizes.robot, value)));
    all.filter_map(|(robot, (name, size))| {
        let recorded = record[robot][name].as_u64();
        let is_near =
            |recorded: u64| recorded.abs_diff(*size) * 100 <= recorded * TOLERANCE_PERCENT;
        let text = recorded.map_or("nothing".to_owned(), |recorded| recorded.to_string());
        (!recorded.is_some_and(is_near))
            .then(|| format!("{robot} {name} is {size}, recorded is {text}"))
    })
    .collect()
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
        assert!(check(&crazyflie(246_784, 80_896)).is_ok());
        let failure = check(&crazyflie(246_785, 80_897)).unwrap_err().to_string();
        assert!(failure.contains("flash 246785 > 246784"), "{failure}");
        assert!(failure.contains("ram 80897 > 80896"), "{failure}");
    }

    #[test]
    fn a_record_is_stale_when_a_size_differs_by_more_than_the_tolerance() {
        let record = serde_json::json!({ "crazyflie": { "flash": 10_000, "ram": 500 } });
        assert!(stale(&crazyflie(10_100, 495), &record).is_empty());
        assert_eq!(
            stale(&crazyflie(10_101, 494), &record),
            [
                "crazyflie flash is 10101, recorded is 10000",
                "crazyflie ram is 494, recorded is 500"
            ]
        );
        let failure = stale(&crazyflie(1, 1), &Value::Null).join(", ");
        assert!(failure.contains("flash is 1, recorded is nothing"), "{failure}");
    }

    #[test]
    fn json_has_an_object_per_robot() {
        assert_eq!(to_json(&crazyflie(7, 8)).to_string(), r#"{"crazyflie":{"flash":7,"ram":8}}"#);
    }
}
