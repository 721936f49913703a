//! Compares the page of each robot with firmware with its robot file. `UPDATE_DOCS=1 cargo test
//! --locked -p bittybuzz-book` writes the pages again.

use bittybuzz_robot_files::all_shipped;
use bittybuzz_robot_spec::{
    Indicator, NumberProfile, OnFault, Robot, RobotFunction, SensorTable, Setting,
};
use fs_err as fs;
use std::env;
use std::path::{Path, PathBuf};

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/robots")
}

/// The robots with firmware.
fn flashed() -> Vec<Robot> {
    let mut robots = all_shipped();
    robots.retain(|robot| firmware(robot).is_some());
    robots
}

/// The folder of a robot's firmware, from the root.
fn firmware(robot: &Robot) -> Option<String> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let names = [robot.name.clone(), format!("{}-avr", robot.name)];
    let mut folders = names.iter().map(|name| format!("firmware/{name}"));
    folders.find(|folder| root.join(folder).join("README.md").is_file())
}

#[test]
fn the_pages_are_those_of_the_robot_files() {
    let robots = flashed();
    assert!(robots.len() >= 3, "{} robots with firmware", robots.len());
    for robot in robots {
        let path = folder().join(format!("{}.md", robot.name));
        let page = page(&robot);
        if env::var_os("UPDATE_DOCS").is_some() {
            fs::write(&path, &page).unwrap();
        }
        let committed = fs::read_to_string(&path).unwrap_or_default();
        assert!(
            committed == page,
            "{} is not that of the robot file; see the head of this test",
            path.display()
        );
    }
}

fn page(robot: &Robot) -> String {
    let Robot { title, name, .. } = robot;
    let firmware = firmware(robot).unwrap();
    let parts = [
        format!(
            "# {title}\n\n<!-- Written from robots/{name}/robot.toml by tools/book/tests/robot_pages.rs. -->\n\n\
             `--robot {name}` chooses this robot. [Its firmware](../../{firmware}/README.md) has a page of its own, which \
             says how to build, flash and watch it.\nThe firmware was tested in emulation and not on hardware.\n"
        ),
        "\n## Limits\n".to_owned(),
        limits(robot),
        "\n## Functions\n".to_owned(),
        robot.functions.iter().map(function).collect(),
        section("Tables", robot.tables.iter().map(table).collect()),
        section("Settings", robot.settings.iter().map(setting).collect()),
        section("Lights", robot.indicators.iter().map(indicator).collect()),
    ];
    parts.concat()
}

fn section(title: &str, entries: Vec<String>) -> String {
    match entries.is_empty() {
        true => String::new(),
        false => format!("\n## {title}\n{}", entries.concat()),
    }
}

fn limits(robot: &Robot) -> String {
    let vm = &robot.vm;
    let numbers = match robot.profile {
        NumberProfile::Tiny => "`tiny`: integers and floats of 16 bits",
        NumberProfile::Full => "`full`: integers and floats of 32 bits, strings made at run time",
    };
    let after_fault = match robot.on_fault {
        OnFault::Restart => "the script starts again after a pause",
        OnFault::Stop => "the script stops until power-on",
    };
    let mut rows = vec![
        ("number profile", numbers.to_owned()),
        ("steps", format!("{} per second", robot.tick_hz)),
        ("after a run-time error", after_fault.to_owned()),
        ("memory of the machine", format!("{} bytes", vm.memory)),
        ("slots for globals, tables and calls", vm.slots.to_string()),
        ("neighbors known at a time", vm.neighbors.to_string()),
        ("direction of neighbors", if vm.bearings { "known" } else { "nil" }.to_owned()),
        ("entries of all stigmergies", vm.stigmergy_entries.to_string()),
        ("swarms", vm.swarms.to_string()),
        ("messages that can wait to be read", vm.in_queue.to_string()),
        ("messages that can wait to be sent", vm.out_queue.to_string()),
        ("long messages that can be received at once", vm.in_long.to_string()),
        ("long messages that can wait to be sent", vm.out_long.to_string()),
    ];
    rows.extend(robot.chip.as_ref().map(|chip| ("chip", chip.clone())));
    if let Some(budget) = &robot.budget {
        rows.push((
            "flash for firmware and script",
            format!("{} bytes at most", budget.flash_bytes),
        ));
        rows.push(("static RAM", format!("{} bytes at most", budget.ram_bytes)));
    }
    let rows: String = rows.iter().map(|(name, value)| format!("| {name} | {value} |\n")).collect();
    format!("\n| | |\n|---|---|\n{rows}")
}

fn function(function: &RobotFunction) -> String {
    let RobotFunction { name, help, waits, .. } = function;
    let forms: String = function.forms().map(|form| form + "\n").collect();
    let waits = if *waits { "\nThe script waits until that is done." } else { "" };
    format!("\n### {name}\n```text\n{forms}```\n{}{waits}\n", sentence(help))
}

fn table(table: &SensorTable) -> String {
    let fields: Vec<String> = table.fields.iter().map(ToString::to_string).collect();
    let SensorTable { name, help, .. } = table;
    format!(
        "\n### {name}\n```text\n{name} = {{ {} }}\n```\n{}\n",
        fields.join(", "),
        sentence(help)
    )
}

fn setting(setting: &Setting) -> String {
    let Setting { name, least, most, help } = setting;
    format!("\n`bbz flash --set {name}={least}` to `{name}={most}`: {help}.\n")
}

fn indicator(indicator: &Indicator) -> String {
    let Indicator { shows, means } = indicator;
    format!("\n**{}.** {means}\n", sentence(shows).trim_end_matches('.'))
}

/// The text with a capital letter at its start and a full stop at its end.
fn sentence(text: &str) -> String {
    let mut letters = text.chars();
    let first: String = letters.next().into_iter().flat_map(char::to_uppercase).collect();
    format!("{first}{}.", letters.as_str().trim_end_matches('.'))
}
