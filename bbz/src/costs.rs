//! Costs of instructions on the chips of robots, as they were counted for `bench/costs.json`.

use std::collections::BTreeMap;
use std::sync::Arc;

use bittybuzz_arena::robot::checks::Costs;
use bittybuzz_robot_files::all_shipped;
use bittybuzz_robot_spec::{NumberProfile, Robot};

/// Tables of cycles, or of instructions of one cycle each, by the names of instructions and their cases.
const COSTS: &str = include_str!("../../bench/costs.json");

/// A chip whose instructions were counted.
struct CountedChip {
    /// The beginning of the chip's name in robot files.
    name: &'static str,
    /// The tables of the profiles that were counted.
    tables: &'static [CostTables],
    /// The clock in Hz that the firmware of the shipped robot with this chip sets.
    clock_hz: u64,
}

/// The costs on a chip with one profile.
struct CostTables {
    profile: NumberProfile,
    /// The key of the costs in [`COSTS`]. The longest times of some instructions are not there, but
    /// under the name of the shipped robot with the chip.
    instructions: &'static str,
}

const CHIPS: [CountedChip; 3] = [
    CountedChip {
        name: "ATmega328P",
        tables: &[CostTables { profile: NumberProfile::Tiny, instructions: "avr" }],
        clock_hz: 8_000_000,
    },
    CountedChip {
        name: "STM32F051",
        tables: &[
            CostTables { profile: NumberProfile::Tiny, instructions: "thumbv6m" },
            CostTables { profile: NumberProfile::Full, instructions: "thumbv6m-full" },
        ],
        clock_hz: 48_000_000,
    },
    CountedChip {
        name: "STM32F405",
        tables: &[
            CostTables { profile: NumberProfile::Tiny, instructions: "thumbv7em" },
            CostTables { profile: NumberProfile::Full, instructions: "thumbv7em-full" },
        ],
        clock_hz: 168_000_000,
    },
];

/// Returns the costs of a robot's chip with a profile; `None` if they were not counted.
pub fn of(robot: &Robot, profile: NumberProfile) -> Option<Arc<Costs>> {
    let name = robot.chip.as_ref()?;
    let chip = CHIPS.iter().find(|chip| name.starts_with(chip.name))?;
    let table = chip.tables.iter().find(|table| table.profile == profile)?;
    let all: BTreeMap<String, BTreeMap<String, u32>> =
        serde_json::from_str(COSTS).expect("the file is part of the program, and tests read it");
    let has_chip = |known: &Robot| {
        let name = known.chip.as_ref();
        known.profile == profile && name.is_some_and(|name| name.starts_with(chip.name))
    };
    let longest = all_shipped().into_iter().find(has_chip).and_then(|known| all.get(&known.name));
    let instructions = all.get(table.instructions).expect("a test reads every table");
    let cycles = |case: &str| {
        instructions.get(case).or_else(|| longest.and_then(|longest| longest.get(case))).copied()
    };
    let step_period = chip.clock_hz / u64::from(robot.tick_hz.max(1));
    Costs::new(cycles, step_period).map(Arc::new)
}

#[cfg(test)]
mod tests {
    use bittybuzz_robot_files::find;

    use super::*;

    #[test]
    fn robots_have_the_clock_of_their_firmware() {
        // 8, 48 and 168 MHz, ten steps per second.
        for (name, period) in
            [("kilobot", 800_000), ("zooids", 4_800_000), ("crazyflie", 16_800_000)]
        {
            let robot = find(name).expect("a robot that ships");
            let costs = of(&robot, robot.profile);
            assert_eq!(costs.map(|costs| costs.step_period), Some(period), "{name}");
        }
    }

    #[test]
    fn every_chip_and_profile_has_whole_tables() {
        let mut robot = find("kilobot").expect("a robot that ships");
        for chip in &CHIPS {
            robot.chip = Some(chip.name.to_owned());
            for table in chip.tables {
                assert!(of(&robot, table.profile).is_some(), "{}", table.instructions);
            }
        }
        robot.chip = Some("Z80".to_owned());
        assert!(of(&robot, NumberProfile::Tiny).is_none());
        robot.chip = None;
        assert!(of(&robot, NumberProfile::Tiny).is_none());
    }
}
