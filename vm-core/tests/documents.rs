//! docs/instruction-set.md is written from the tables of the crate, and from bench/costs.json. `UPDATE_DOCS=1 cargo test`
//! writes it again.

use std::collections::BTreeMap;
use std::fmt::Write;

use bittybuzz_vm_core::builtin::{self, BuiltinKind, Library};
use bittybuzz_vm_core::opcode::{Operand, SHORTS, TABLE, Trailer};
use bittybuzz_vm_core::{class, image};

const INTRODUCTION: &str = "\
# The instruction set

Written from `vm-core/src/opcode.rs`, `vm-core/src/builtin.rs` and `bench/costs.json`; do not edit. How instructions stand in an image:
[image-format.md](image-format.md).

An instruction is one byte, then its operand, then its trailer. Bytes `0x00` to `0x3f` have no operand. `0x40` to `0x7f` have an operand of one
signed byte; with bit 7 set, `0xc0` to `0xff`, one of two bytes, little-endian. `0x80` to `0xbf` are short forms that hold their
operand. A jump counts from the end of the instruction. `a b -- c`: b is on top, c takes their place.
";

#[test]
fn instruction_set_is_up_to_date() {
    let mut text = String::from(INTRODUCTION);
    text.push_str(
        "\n| Byte | Instruction | Operand | Trailer | Stack and meaning |\n|---|---|---|---|---|\n",
    );
    for info in TABLE {
        let operand = match info.operand {
            Operand::None => "",
            Operand::Int => "integer",
            Operand::String => "string",
            Operand::Function => "function",
            Operand::Builtin => "built-in",
            Operand::Robot => "robot function",
            Operand::Library => "library",
            Operand::Local => "local",
            Operand::Global => "global",
            Operand::Capture => "captured value",
            Operand::Count => "count",
            Operand::Parameters => "parameters of this function",
            Operand::Jump => "distance",
        };
        let trailer = match info.trailer {
            Trailer::None => "",
            Trailer::Arguments => "arguments; bit 7: drop the result",
            Trailer::Captures => "captured values",
            Trailer::Immediate => "signed byte",
            Trailer::LocalImmediate => {
                "relation in the high half, local + 4 in the low half; signed 16 bits"
            }
            Trailer::Word => "2 bytes (`tiny`) or 4 (`full`)",
            Trailer::Half => "2 bytes",
        };
        let meaning = info.meaning.replace('|', "\\|");
        let (byte, name) = (info.byte, info.name);
        writeln!(text, "| `{byte:#04x}` | `{name}` | {operand} | {trailer} | {meaning} |").unwrap();
    }
    text.push_str("\n## Short forms\n| Bytes | Stand for |\n|---|---|\n");
    for form in SHORTS {
        let name = TABLE.iter().find(|info| info.byte == form.opcode).unwrap().name;
        let last = form.first + form.count - 1;
        let high = form.low + i16::from(form.count) - 1;
        writeln!(
            text,
            "| `{:#04x}` to `{last:#04x}` | `{name}` {} to {high} |",
            form.first, form.low
        )
        .unwrap();
    }
    text.push_str("\n## Libraries\n| Number | Name |\n|---|---|\n");
    for library in Library::ALL {
        let name = match library {
            Library::Global => "(no library)",
            Library::Rng => "`math.rng`",
            Library::SwarmObject => "what `swarm.create` returns",
            Library::StigmergyObject => "what `stigmergy.create` returns",
            Library::Snapshot => "what `neighbors.map` and its relatives return",
            other => &format!("`{}`", other.global_name().unwrap()),
        };
        writeln!(text, "| {} | {name} |", library as u8).unwrap();
    }
    text.push_str("\n## Built-ins\n| Number | Arguments | Kind | Meaning |\n|---|---|---|---|\n");
    for info in builtin::TABLE {
        let arguments = match (info.kind, info.min, info.max) {
            (BuiltinKind::Value, ..) => String::new(),
            (_, min, 255) => format!("{min} or more"),
            (_, min, max) if min == max => min.to_string(),
            (_, min, max) => format!("{min} to {max}"),
        };
        let kind = match info.kind {
            BuiltinKind::Plain => "at once",
            BuiltinKind::Calls => "calls or waits",
            BuiltinKind::Value => "value",
        };
        writeln!(text, "| {} | {arguments} | {kind} | `{}` |", info.number, info.help).unwrap();
    }
    write_costs(&mut text);
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/instruction-set.md");
    if std::env::var_os("UPDATE_DOCS").is_some() {
        std::fs::write(path, &text).unwrap();
    }
    let written = std::fs::read_to_string(path).unwrap_or_default();
    assert!(written == text, "{path} is out of date: run UPDATE_DOCS=1 cargo test");
}

/// docs/image-format.md is written by hand: its numbers are those of the crate, and it names no instruction that does not exist.
#[test]
fn image_format_document_matches_the_crate() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/image-format.md");
    let text = std::fs::read_to_string(path).unwrap();
    let bit = |mask: u8| mask.trailing_zeros();
    let facts = [
        format!("| magic | 1 | `{:#04x}` |", image::MAGIC),
        format!("bits 0-2 version ({})", image::VERSION),
        format!("bit {} class table present", bit(image::FORM_CLASSES)),
        format!("bit {} for nil", bit(class::NIL)),
        format!(
            "bit {} for integers, bit {} for floats",
            bit(class::NUMBER),
            bit(class::NUMBER) + 1
        ),
        format!("bit {} for strings, bit {} for tables", bit(class::STRING), bit(class::TABLE)),
        format!("bit {} for functions", bit(class::FUNCTION)),
        format!("bit {} for strings made at run time", bit(class::TEXT)),
        format!("bit {} library table present", bit(image::FORM_LIBRARIES)),
        format!("bit {} text present", bit(image::FORM_TEXT)),
        format!("bit {} order table present", bit(image::FORM_ORDER)),
        format!("bit {} profile (0 `tiny`, 1 `full`)", bit(image::FORM_FULL)),
        format!("(0 to {})", image::COUNT_MAX),
        format!("bits 0-{} number of parameters", image::PARAMETERS.trailing_ones() - 1),
        format!("bit {}: has captured values", bit(image::CAPTURES)),
        format!("bit {}: uses `self`", bit(image::USES_SELF)),
    ];
    for fact in facts {
        assert!(text.contains(&fact), "{path} does not say: {fact}");
    }
    let instructions = text.split('`').skip(1).step_by(2).filter_map(|code| {
        let name = code.split(' ').next()?;
        name.bytes().all(|byte| byte.is_ascii_uppercase() || byte == b'_').then_some(name)
    });
    let instructions: Vec<&str> = instructions.collect();
    assert!(instructions.len() > 10, "{instructions:?}");
    for name in instructions {
        assert!(TABLE.iter().any(|info| info.name == name), "{path} names {name}");
    }
}

const COSTS: &str = "
## Cost
Cycles of the ATmega328P, and instructions executed by the ARM cores, of one instruction with everything that belongs to it: fetching
and decoding, the budget, all checks. Counted by emulators (`cargo xtask bench costs`, see [bench](../bench)). Unless it says
something else, values are integers, and an operand takes a byte of its own.

Rows marked *longest* give the longest time that an instruction takes on a robot, without a collection: on the Kilobot, the Zooid and the
Crazyflie, when their whole heap is filled by the table that the instruction works on. `INDEX_METHOD` and the instructions with
`FIELD` or `INIT` in their names search tables as `INDEX_GET` and `INDEX_SET` do.

| Instruction | Case | ATmega328P | Cortex-M0 | Cortex-M4F | Cortex-M0, `full` | Cortex-M4F, `full` |
|---|---|---|---|---|---|---|
";

/// The columns after the case.
const TARGETS: [&str; 5] = ["avr", "thumbv6m", "thumbv7em", "thumbv6m-full", "thumbv7em-full"];

/// A robot whose longest instructions are in the table.
struct Robot {
    name: &'static str,
    title: &'static str,
    /// The column of its chip.
    target: &'static str,
    mhz: u64,
    /// The longest time that an instruction may take, in µs.
    limit_us: u64,
}

const ROBOTS: [Robot; 3] = [
    Robot { name: "kilobot", title: "Kilobot", target: "avr", mhz: 8, limit_us: 2000 },
    Robot { name: "zooids", title: "Zooid", target: "thumbv6m", mhz: 48, limit_us: 500 },
    Robot {
        name: "crazyflie",
        title: "Crazyflie",
        target: "thumbv7em-full",
        mhz: 168,
        limit_us: 450,
    },
];

type Costs = BTreeMap<String, BTreeMap<String, u64>>;

/// The longest time of an instruction on each robot: a case above the limit is an error.
fn write_longest(text: &mut String, costs: &Costs) {
    text.push_str(LONGEST);
    for robot in ROBOTS {
        let limit = robot.limit_us;
        for is_message in [false, true] {
            let cases = costs[robot.name].iter();
            let cases = cases.filter(|(name, _)| name.ends_with("of numbers") == is_message);
            let (name, cost) = cases.max_by_key(|(_, cost)| **cost).expect("there are cases");
            let time = *cost as f64 / robot.mhz as f64;
            assert!(
                time <= limit as f64,
                "{name} takes {time:.0} µs on the {}, more than {limit}",
                robot.title
            );
            let (instruction, case) = name.split_once(", ").unwrap_or((name, ""));
            writeln!(
                text,
                "| {} | `{instruction}`: {case} | {cost} | {time:.0} µs | {limit} µs |",
                robot.title
            )
            .expect("writing to a string cannot fail");
        }
    }
}

const LONGEST: &str = "
## Longest instructions
For each robot the longest instruction, and the longest of those that write a message of up to eight frames, with the limit for both. A
collection is not counted, and neither is the search for the entries that are left in an array most of which was removed: a message of
such an array takes up to 2.7 ms on the Kilobot. The time is that of the Kilobot at 8 MHz; on the Zooid at 48 MHz and the Crazyflie at
168 MHz it is the time of so many instructions of one cycle each. In `full`, what is done with text takes more, and counts as two
instructions for each byte.

| Robot | Instruction | Cycles or instructions | Time | Limit |
|---|---|---|---|---|
";

/// A table of what is known of every instruction: an instruction without a cost on one of the chips is an error.
fn write_costs(text: &mut String) {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../bench/costs.json");
    let json = std::fs::read(path).expect("bench/costs.json is there");
    let costs: Costs = serde_json::from_slice(&json).expect("bench/costs.json holds counts");
    text.push_str(COSTS);
    for info in TABLE {
        let mut cases = 0;
        for name in costs[TARGETS[0]].keys() {
            let (instruction, case) = name.split_once(", ").unwrap_or((name, ""));
            if instruction != info.name {
                continue;
            }
            cases += 1;
            let name_once = if cases == 1 { format!("`{instruction}`") } else { String::new() };
            text.push_str(&format!("| {name_once} | {case} |"));
            for target in TARGETS {
                let cost = costs[target].get(name);
                let cost = cost.unwrap_or_else(|| panic!("{name} is not counted on {target}"));
                text.push_str(&format!(" {cost} |"));
            }
            text.push('\n');
        }
        for name in costs[ROBOTS[0].name].keys() {
            let (instruction, case) = name.split_once(", ").unwrap_or((name, ""));
            if instruction != info.name {
                continue;
            }
            text.push_str(&format!("|  | longest: {case} |"));
            for target in TARGETS {
                match ROBOTS.iter().find(|robot| robot.target == target) {
                    Some(robot) => text.push_str(&format!(" {} |", costs[robot.name][name])),
                    None => text.push_str("  |"),
                }
            }
            text.push('\n');
        }
        assert!(cases > 0, "{} has no cost: cargo xtask bench costs --update", info.name);
    }
    write_longest(text, &costs);
}
