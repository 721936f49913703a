//! Compares the tables of docs/performance.md with the recorded counts of `bench/`. `UPDATE_DOCS=1
//! cargo test --locked -p bittybuzz-book` writes the tables again.

use crate::generated::{check, path};
use fs_err as fs;
use serde_json::Value;
use toml::Table;

fn table(name: &str) -> Table {
    fs::read_to_string(path(name)).unwrap().parse().unwrap()
}

fn entries<'a>(table: &'a Table, key: &str) -> Vec<&'a Table> {
    table[key].as_array().unwrap().iter().map(|entry| entry.as_table().unwrap()).collect()
}

#[test]
fn tables_are_those_of_the_recorded_counts() {
    let parts = [
        ("means", means()),
        ("peers", peers()),
        ("flight", flight()),
        ("sizes", sizes()),
        ("machine", machine()),
        ("slices", slices()),
        ("crazyflie", figures("crazyflie", &CRAZYFLIE)),
        ("zooid", figures("zooids", &ZOOID)),
    ];
    check("docs/performance.md", "performance.rs", &parts);
    check("README.md", "performance.rs", &[("worth", worth())]);
}

/// Returns the counts of BittyBuzz in Rust on a target.
fn baseline(target: &str) -> Value {
    let text = fs::read_to_string(path("bench/baseline.json")).unwrap();
    serde_json::from_str::<Value>(&text).unwrap()[target].take()
}

fn count(counts: &Value, script: &str) -> Option<f64> {
    counts[script]["count"].as_f64()
}

fn geometric_mean(ratios: &[f64]) -> f64 {
    (ratios.iter().map(|ratio| ratio.ln()).sum::<f64>() / ratios.len() as f64).exp()
}

/// Formats a number with commas between thousands.
pub fn number(value: f64) -> String {
    let digits = format!("{value:.0}");
    let mut text = String::new();
    for (index, digit) in digits.chars().enumerate() {
        if index > 0 && (digits.len() - index).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

/// Scripts that use messages or positions of neighbors.
const WITH_NEIGHBORS: [&str; 4] = ["gradient", "neigh8", "neighred8", "messages8"];

const TARGETS: [(&str, &str); 4] = [
    ("avr", "ATmega328P, cycles"),
    ("thumbv6m", "Cortex-M0, instructions"),
    ("thumbv7em", "Cortex-M4F, instructions"),
    ("host", "x86-64, instructions"),
];

/// Returns the scripts that both implementations run on a target, and how many times fewer cycles or
/// instructions a step takes than in the C BittyBuzz.
fn ratios(target: &str) -> Vec<(String, f64)> {
    let ours = baseline(target);
    let reference = table("bench/reference.toml");
    let scripts = entries(&reference, "script").into_iter().filter_map(|script| {
        let name = script["name"].as_str()?;
        let ratio = script.get(target)?.as_integer()? as f64 / count(&ours, name)?;
        Some((name.to_owned(), ratio))
    });
    scripts.collect()
}

/// Returns the figure with which the README begins.
fn worth() -> String {
    let ratios: Vec<f64> = ratios("avr").into_iter().map(|(_, ratio)| ratio).collect();
    let sizes = sizes_file();
    format!(
        "On the processor of a Kilobot, **a script takes {:.0} times fewer cycles than with the C BittyBuzz** \
         ([mean of {} scripts](docs/performance.md)); firmware, virtual machine and script take {} bytes of flash.\n",
        geometric_mean(&ratios),
        ratios.len(),
        number(sizes["kilobot"]["flash"].as_f64().unwrap())
    )
}

/// Returns the sizes that `cargo xtask sizes --update` recorded.
fn sizes_file() -> Value {
    serde_json::from_str(&fs::read_to_string(path("bench/sizes.json")).unwrap()).unwrap()
}

/// The robots in the order of the tables.
const ROBOTS: [(&str, &str, &str); 3] = [
    ("kilobot", "Kilobot", "`hello`, with the parts of the machine that it uses"),
    ("zooids", "Zooid", "the longest example, without defmt"),
    ("crazyflie", "Crazyflie", "a script, with defmt"),
];

fn sizes() -> String {
    let sizes = sizes_file();
    let mut text =
        "\n| Robot | Image | Flash | Limit | Static RAM | Limit |\n|---|---|---|---|---|---|\n"
            .to_owned();
    for (name, robot, image) in ROBOTS {
        let budget = bittybuzz_robot_files::find(name).unwrap().budget.unwrap();
        let cell = |key: &str| number(sizes[name][key].as_f64().unwrap());
        text += &format!(
            "| {robot} | {image} | {} | {} | {} | {} |\n",
            cell("flash"),
            number(budget.flash_bytes.into()),
            cell("ram"),
            number(budget.ram_bytes.into())
        );
    }
    format!("{text}\nRecorded on {}.\n\n", sizes["date"].as_str().unwrap())
}

fn machine() -> String {
    let sizes = sizes_file();
    let mut text = "\n| Machine | Kilobot | Zooid | Crazyflie |\n|---|---|---|---|\n".to_owned();
    for (key, title) in [
        ("vm_flash", "flash, profile `tiny`, every part"),
        ("vm_min_flash", "flash, without `math` and the swarm's parts"),
        ("vm_full_flash", "flash, profile `full`, with strings"),
        ("vm_ram", "the object in RAM, with the slots of the robot"),
    ] {
        let cells =
            ROBOTS.map(|(name, ..)| sizes[name][key].as_f64().map_or(String::new(), number));
        text += &format!("| {title} | {} |\n", cells.join(" | "));
    }
    text + "\n"
}

/// The rows of the table of slices: a title, and the scripts of tests/hil of which the longest slice
/// counts.
const SLICES: [(&str, &[&str]); 9] = [
    ("loop", &["loop"]),
    ("functions of `math`; on the Kilobot `%` and `/` of floats", &["maths", "floats"]),
    ("a table that fills the memory", &["pairs", "foreach", "tables", "array"]),
    ("texts with 200 characters or more as keys", &["text keys", "text keys of entries"]),
    ("a stigmergy with all its entries", &["full store"]),
    (
        "a full heap that is collected all the time",
        &["garbage", "seldom", "fields", "list", "texts", "calls", "iterations"],
    ),
    ("the longest message into a full queue", &["messages", "other messages", "entries"]),
    (
        "`log` of a table that fills the memory",
        &["log of a table", "log that names a table ten times"],
    ),
    (
        "texts of 1,000 characters, the most",
        &["parts of the longest text", "order of the longest texts", "numbers in the longest text"],
    ),
];

fn slices() -> String {
    let recorded = fs::read_to_string(path("bench/hil.json")).unwrap();
    let recorded: Value = serde_json::from_str(&recorded).unwrap();
    let robots = ["crazyflie", "zooids", "kilobot"].map(|robot| &recorded["slices_us"][robot]);
    for robot in robots {
        let mut scripts = robot.as_object().unwrap().keys();
        assert!(scripts.all(|script| SLICES.iter().any(|(_, row)| row.contains(&&**script))));
    }
    let mut text = "\n| Script | Crazyflie | Zooid | Kilobot |\n|---|---|---|---|\n".to_owned();
    for (title, scripts) in SLICES {
        let longest = |robot: &Value| scripts.iter().filter_map(|name| robot[*name].as_u64()).max();
        let cells =
            robots.map(|robot| longest(robot).map_or(String::new(), |slice| number(slice as f64)));
        text += &format!("| {title} | {} |\n", cells.join(" | "));
    }
    format!("{text}\nRecorded on {}.\n\n", recorded["date"].as_str().unwrap())
}

/// A row of a table of a robot's figures: the quantity, group and name of the figure in bench/hil.json,
/// the factor to the unit that is printed, the digits and the unit, and the limit.
type FigureRow = (&'static str, [&'static str; 2], f64, usize, &'static str, &'static str);

const CRAZYFLIE: [FigureRow; 6] = [
    (
        "longest wait of a received byte, under noise at line rate",
        ["byte_wait_ns", "longest"],
        1.0,
        0,
        "ns",
        "10 µs",
    ),
    (
        "echo of a frame while a step never ends, slowest of 100",
        ["echo_us", "slowest of 100"],
        1e-3,
        2,
        "ms",
        "2 ms",
    ),
    (
        "answer to a shutdown request while a step never ends",
        ["shutdown_us", "answer"],
        1e-3,
        2,
        "ms",
        "2 ms",
    ),
    ("from a dead task to the reset, longest", ["dead_task_ms", "longest"], 1.0, 0, "ms", "351 ms"),
    (
        "from a pulse of the gyroscope to the end of both reads, longest",
        ["sensors", "slowest_us"],
        1.0,
        0,
        "µs",
        "500 µs",
    ),
    (
        "wake-ups of the sensors' task per sample of two reads",
        ["sensors", "wake_ups_per_1000"],
        1e-3,
        2,
        "",
        "3.4",
    ),
];

const ZOOID: [FigureRow; 7] = [
    ("stack used, of 2,048 bytes", ["stack_bytes", "used"], 1.0, 0, "bytes", "1,536 bytes"),
    ("position while it drives at 0.3 m/s", ["drive", "um rms"], 1e-3, 2, "mm rms", "2.5 mm"),
    ("heading", ["drive", "millidegrees rms"], 1e-3, 1, "degrees rms", "3 degrees"),
    ("8 messages in an empty step", ["messages_us", "in an empty step"], 1e-3, 3, "ms", "0.2 ms"),
    (
        "8 messages with their reception by radio",
        ["messages_us", "with their reception"],
        1e-3,
        3,
        "ms",
        "0.854 ms",
    ),
    ("gradient with 8 neighbors", ["gradient_us", "the step"], 1e-3, 2, "ms", "1.5 ms"),
    (
        "gradient with 8 neighbors and their reception",
        ["gradient_us", "with the radio"],
        1e-3,
        2,
        "ms",
        "1.5 ms",
    ),
];

fn figures(robot: &str, rows: &[FigureRow]) -> String {
    let recorded = fs::read_to_string(path("bench/hil.json")).unwrap();
    let recorded: Value = serde_json::from_str(&recorded).unwrap();
    let mut text = "\n| Quantity | Measured | Limit |\n|---|---|---|\n".to_owned();
    for (quantity, [group, name], factor, digits, unit, limit) in rows {
        let figure = recorded[group][robot][name].as_f64().unwrap();
        let value = match *digits {
            0 => number(figure * factor),
            digits => format!("{:.digits$}", figure * factor),
        };
        let value = format!("{value} {unit}");
        text += &format!("| {quantity} | {} | {limit} |\n", value.trim_end());
    }
    format!("{text}\nRecorded on {}.\n\n", recorded["date"].as_str().unwrap())
}

fn means() -> String {
    let mut text = "\n| Target | Mean over all scripts | Mean without neighbors | Least |\n|---|---|---|---|\n".to_owned();
    for (target, title) in TARGETS {
        let ratios = ratios(target);
        let all: Vec<f64> = ratios.iter().map(|(_, ratio)| *ratio).collect();
        let alone = ratios.iter().filter(|(name, _)| !WITH_NEIGHBORS.contains(&name.as_str()));
        let alone: Vec<f64> = alone.map(|(_, ratio)| *ratio).collect();
        let least = ratios.iter().min_by(|one, other| one.1.total_cmp(&other.1)).unwrap();
        text += &format!(
            "| {title} | {:.0} times fewer ({}) | {:.0} ({}) | {:.0} (`{}`) |\n",
            geometric_mean(&all),
            all.len(),
            geometric_mean(&alone),
            alone.len(),
            least.1,
            least.0
        );
    }
    text + "\n"
}

/// Scripts of the table of other interpreters.
const COMPARED: [&str; 8] =
    ["empty", "fib10", "tak", "loopsum", "table16", "method", "float", "gradient"];

fn peers() -> String {
    let recorded = table("bench/peers.toml");
    let columns = COMPARED.map(|name| format!("`{name}`")).join(" | ");
    let head = format!(
        "| Interpreter | {columns} | Flash |\n|---|{}---|\n",
        "---|".repeat(COMPARED.len())
    );
    let row = |title: String, counts: &dyn Fn(&str) -> Option<f64>, flash: Option<f64>| {
        let cells = COMPARED.map(|name| counts(name).map_or(String::new(), number)).join(" | ");
        format!("| {title} | {cells} | {} |\n", flash.map_or(String::new(), number))
    };
    let mut text = String::new();
    let arm = baseline("thumbv7em-full");
    let avr = baseline("avr");
    for (core, title, ours) in [
        ("Cortex-M4F", "Cortex-M4F, instructions of a step", &arm),
        ("AVR", "AVR, cycles of a step; BittyBuzz has profile `tiny`", &avr),
    ] {
        text += &format!("\n**{title}**\n\n{head}");
        text += &row("BittyBuzz in Rust".to_owned(), &|name| count(ours, name), None);
        for peer in entries(&recorded, "peer") {
            let is_here = peer["target"].as_str().unwrap().starts_with(core);
            let counts = peer.get("count").and_then(toml::Value::as_table);
            let (true, Some(counts)) = (is_here, counts) else { continue };
            let name =
                format!("{} {}", peer["name"].as_str().unwrap(), peer["version"].as_str().unwrap());
            let flags = peer["flags"].as_str().unwrap();
            // The first option belongs to the interpreter.
            let option = flags.split([' ', ',']).find(|option| option.starts_with("-O"));
            let title =
                format!("{name}{}", option.map_or(String::new(), |option| format!(", {option}")));
            let integer = |value: &toml::Value| value.as_integer().map(|value| value as f64);
            let flash = ["flash_bytes", "flash_whole_image_bytes"];
            let flash = flash.iter().find_map(|key| peer.get(*key).and_then(integer));
            text += &row(title, &|script| counts.get(script).and_then(integer), flash);
        }
    }
    text + "\n"
}

fn flight() -> String {
    let recorded = fs::read_to_string(path("bench/flight.json")).unwrap();
    let recorded: Value = serde_json::from_str(&recorded).unwrap();
    let cell = |value: &Value| value.as_f64().map_or(String::new(), number);
    let mut text = String::new();
    for (name, title) in [("pose", "Poses from outside"), ("deck", "Flow deck")] {
        let flight = &recorded[name];
        text += &format!(
            "\n**{title}**\n\n| Task | Per second | Instructions, mean | Most |\n|---|---|---|---|\n"
        );
        for (task, cost) in flight["tasks"].as_object().unwrap() {
            let [per_second, mean, most] =
                ["per_second", "mean", "most"].map(|key| cell(&cost[key]));
            // Tasks of the start alone have no rate.
            if per_second != "0" {
                text += &format!("| {task} | {per_second} | {mean} | {most} |\n");
            }
        }
        let [all, most] = ["per_second", "most_in_ms"].map(|key| cell(&flight[key]));
        text += &format!("| all, in a second | | {all} | |\n| all, in 1 ms | | | {most} |\n");
    }
    text + "\n"
}
