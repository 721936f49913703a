//! What a scenario says of robots that run their firmware is checked before anything is emulated.

use crate::script;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::LazyLock;

use bittybuzz_arena::scenario::{Backend, Scenario, ScenarioError};

/// A folder with a script, and two files in the place of firmware.
static FOLDER: LazyLock<PathBuf> = LazyLock::new(|| {
    let folder = script::folder("backends", &[("s.bzz", "x = 0\nfunction step() { }\n")]);
    for name in ["zooids.elf", "other.elf"] {
        fs::write(folder.join(name), "no firmware").unwrap();
    }
    let crazyflie = include_str!("../../robots/crazyflie/robot.toml");
    let lines = crazyflie.lines().filter(|line| !line.starts_with("id = "));
    fs::write(folder.join("nameless.toml"), lines.collect::<Vec<_>>().join("\n")).unwrap();
    folder
});

/// A world; seven lines.
const WORLD: &str = "[world]\nsize = [800, 500]\nduration = 10\n\n[medium.nrf24]\nloss = 0.1\n\n";

/// A world without messages; seven lines.
const EMPTY: &str = "[world]\nsize = [800, 500]\nduration = 10\n\n\n\n\n";

/// Two Zooids on their firmware, ids 0 and 1; six lines.
const EMULATED: &str = "[[robots]]\nrobot = \"zooids\"\nscript = \"s.bzz\"\ncount = 2\nbackend = \"firmware\"\nfirmware = \"zooids.elf\"\n";

/// Two Zooids in virtual machines; five lines.
const SIMULATED: &str =
    "[[robots]]\nrobot = \"zooids\"\nname = \"vm\"\nscript = \"s.bzz\"\ncount = 2\n";

/// Two Kilobots, which talk to nobody else; five lines.
const KILOBOTS: &str =
    "[[robots]]\nrobot = \"kilobot\"\nscript = \"s.bzz\"\nname = \"k\"\ncount = 2\n";

/// A Crazyflie that cannot be given an id; four lines.
const NAMELESS: &str = "[[robots]]\nrobot = \"nameless.toml\"\nscript = \"s.bzz\"\nname = \"c\"\n";

/// Two Crazyflies on their firmware; six lines.
const CRAZYFLIES: &str = "[[robots]]\nrobot = \"crazyflie\"\nscript = \"s.bzz\"\ncount = 2\nbackend = \"firmware\"\nfirmware = \"other.elf\"\n";

fn parse(text: &str) -> Result<Scenario, Vec<ScenarioError>> {
    Scenario::parse(text, "s.toml", &FOLDER, &[], &bittybuzz_robot_models::all())
}

/// `8:1: message | help`
fn printed(error: &ScenarioError) -> String {
    let place = error.place.as_ref().unwrap();
    let help = error.help().unwrap_or_default();
    format!("{}:{}: {error} | {help}", place.line, place.column)
}

/// The only error of a scenario.
fn error(text: &str) -> String {
    let errors = parse(text).err().unwrap_or_default();
    assert_eq!(errors.len(), 1, "{errors:#?}\n{text}");
    printed(&errors[0])
}

fn assert_error(parts: &[&str], place: &str, expected: &[&str]) {
    let text = parts.concat();
    let error = error(&text);
    assert!(error.starts_with(&format!("{place}: ")), "{error}\n{text}");
    for part in expected {
        assert!(error.contains(part), "{error}\nlacks {part}");
    }
}

#[test]
fn a_group_runs_in_a_virtual_machine_or_on_its_firmware() {
    let scenario = parse(&[WORLD, EMULATED].concat()).unwrap();
    assert_eq!(scenario.groups[0].backend.firmware(), Some(FOLDER.join("zooids.elf").as_path()));
    // One file for both: what the firmware is may be said, too.
    let set = ["robots.0.backend=vm".to_owned()];
    let text = [WORLD, EMULATED].concat();
    let scenario =
        Scenario::parse(&text, "s.toml", &FOLDER, &set, &bittybuzz_robot_models::all()).unwrap();
    assert_eq!(scenario.groups[0].backend, Backend::Vm);
    let scenario = parse(&[WORLD, SIMULATED].concat()).unwrap();
    assert_eq!(scenario.groups[0].backend, Backend::Vm);
}

#[test]
fn robots_without_an_emulator_are_refused() {
    assert_error(
        &[WORLD, EMULATED, NAMELESS, "backend = \"firmware\"\n"],
        "18:11",
        &["nothing emulates a `", "backend = \"vm\"", "where their id is"],
    );
    assert_error(
        &[WORLD, EMULATED, KILOBOTS, "backend = \"qemu\"\n"],
        "19:11",
        &["`backend` cannot be \"qemu\"", "vm"],
    );
    assert_error(
        &[WORLD, EMULATED, "link = { loss = 0.2 }\n"],
        "14:8",
        &["`link` cannot be had of robots that run firmware", "\"vm\" has it"],
    );
    assert_error(
        &[WORLD, EMULATED, "on_fault = \"stop\"\n"],
        "14:12",
        &["`on_fault` cannot be had of robots that run firmware", "\"vm\" has it"],
    );
    assert_error(
        &[WORLD, EMULATED, "clock_skew = 1\n"],
        "14:14",
        &["`clock_skew` cannot be had of robots that run firmware"],
    );
    assert_error(
        &[WORLD, EMULATED, "brown_out_every = 1\n"],
        "14:19",
        &["`brown_out_every` cannot be had of robots that run firmware"],
    );
    assert_error(
        &[WORLD, EMULATED, "[[adversary]]\nkind = \"jam\"\nat = [0, 0]\n"],
        "14:1",
        &["`[[adversary]]` cannot be had of robots that run firmware"],
    );
    assert_error(
        &[WORLD, EMULATED, "present = false\n"],
        "14:11",
        &["`present = false` cannot be had"],
    );
    for key in ["duplication = 0.1", "reordering = 0.1"] {
        let world = WORLD.replace("loss = 0.1", key);
        let (name, _) = key.split_once(' ').unwrap();
        let at = format!("6:{}", name.len() + 4);
        assert_error(&[&world, EMULATED], &at, &[&format!("`{name}` cannot be had")]);
    }
}

#[test]
fn emulated_links_must_have_equal_loss() {
    let uneven = WORLD.replace("loss = 0.1", "loss = [0.1, 0.2]");
    assert_error(&[&uneven, EMULATED], "6:8", &["`loss = [near, far]` cannot be had"]);
    parse(&[&uneven, SIMULATED].concat()).unwrap();
    let event = "[[event]]\nat = 1\nloss = [0, 0.5]\n";
    assert_error(&[WORLD, EMULATED, event], "16:8", &["`loss = [near, far]` cannot be had"]);
    parse(&[&WORLD.replace("0.1", "[0.1, 0.1]"), EMULATED].concat()).unwrap();
}

#[test]
fn an_error_about_missing_firmware_says_how_to_build_it() {
    assert_error(
        &[WORLD, &EMULATED.replace("zooids.elf", "none.elf")],
        "13:12",
        &["`none.elf`: there is no such file", "cargo xtask build zooids"],
    );
    let folder = EMULATED.replace("zooids.elf", ".");
    assert_error(&[WORLD, &folder], "13:12", &["it is a folder"]);
    // Nothing is above the root; the script is not there either.
    let text = [WORLD, &EMULATED.replace("firmware = \"zooids.elf\"\n", "")].concat();
    let errors =
        Scenario::parse(&text, "s.toml", Path::new("/"), &[], &bittybuzz_robot_models::all())
            .unwrap_err();
    let printed: Vec<String> = errors.iter().map(printed).collect();
    assert!(
        printed
            .iter()
            .any(|error| error.starts_with("12:11: cannot use firmware `firmware/zooids/")
                && error.contains("cargo xtask build zooids")),
        "{printed:#?}"
    );
}

#[test]
fn emulated_infrared_has_no_duplication_or_reordering() {
    let kilobots = [KILOBOTS, "backend = \"firmware\"\nfirmware = \"other.elf\"\n"].concat();
    let world = WORLD.replace("nrf24", "ir");
    parse(&(world.replace("0.1", "[0.1, 0.2]") + &kilobots)).unwrap();
    let world = world.replace("loss", "duplication");
    assert_error(&[&world, &kilobots], "6:15", &["`duplication` cannot be had"]);
    let errors = script::setup_errors(&FOLDER, &[WORLD, SIMULATED, &kilobots].concat());
    assert!(printed(&errors[0]).contains("not a 32-bit ELF file"), "{errors:?}");
}

#[test]
fn invalid_firmware_is_an_error_before_the_run() {
    let errors = script::setup_errors(&FOLDER, &[WORLD, EMULATED].concat());
    let printed: Vec<String> = errors.iter().map(printed).collect();
    assert_eq!(printed.len(), 1, "{printed:?}");
    assert!(printed[0].starts_with("12:11: cannot use firmware `"), "{printed:?}");
}

#[test]
fn zooids_with_different_backends_are_refused() {
    assert_error(
        &[WORLD, EMULATED, SIMULATED],
        "14:1",
        &[
            "these robots and those of line 8 would not receive each other's messages",
            "the same `backend`",
        ],
    );
    assert_error(
        &[WORLD, SIMULATED, EMULATED],
        "17:11",
        &["those of line 8 would not receive each other's messages"],
    );
    let other = EMULATED.replace("zooids.elf", "other.elf");
    assert_error(&[WORLD, EMULATED, &other], "18:11", &["another firmware than those of line 8"]);
    // Kilobots would not hear them anyway; each kind has a program and an image of its own.
    parse(&[WORLD, EMULATED, KILOBOTS].concat()).unwrap();
    let kilobots = [KILOBOTS, "backend = \"firmware\"\nfirmware = \"other.elf\"\n"].concat();
    parse(&[WORLD, EMULATED, &kilobots].concat()).unwrap();
    parse(&[WORLD, SIMULATED, &kilobots].concat()).unwrap();
    assert_error(
        &[WORLD, SIMULATED, &kilobots, &KILOBOTS.replace("\"k\"", "\"l\"")],
        "20:1",
        &["the same `backend`"],
    );
    let many = EMULATED.replace("count = 2", "count = 99");
    assert_error(&[WORLD, EMULATED, &many], "18:11", &["101 robots are too many", "100"]);
    let many = CRAZYFLIES.replace("count = 2", "count = 21");
    assert_error(&[WORLD, EMULATED, &many], "18:11", &["21 robots are too many", "20"]);
}

#[test]
fn events_that_an_emulator_does_not_support_are_refused() {
    let event = |action: &str| format!("[[event]]\nat = 1\n{action}\n");
    for (action, column) in [("stop = \"zooids\"", 8), ("resume = 1", 10)] {
        let (key, _) = action.split_once(' ').unwrap();
        assert_error(
            &[WORLD, EMULATED, KILOBOTS, &event(action)],
            &format!("21:{column}"),
            &[&format!("`{key}` cannot be had of robots that run firmware"), "moved"],
        );
    }
    // Nothing here takes the power of an emulated Crazyflie away.
    for (action, column) in [("fail = 0", 8), ("restart = \"all\"", 11), ("brown_out = 1", 13)] {
        let event = event(action);
        assert_error(
            &[&WORLD.replace("nrf24", "p2p"), CRAZYFLIES, &event],
            &format!("16:{column}"),
            &["cannot be had of robots that run firmware"],
        );
    }
    for action in [
        "stop = \"k\"",
        "fail = 0",
        "restart = \"all\"",
        "block = [0, 1]",
        "restore = [0, 1]",
        "partition = [[0], [1]]",
        "heal = true",
        "move = 0\nto = [0, 0]",
        "loss = 0.5\nmedium = \"nrf24\"",
    ] {
        parse(&[WORLD, EMULATED, KILOBOTS, &event(action)].concat()).unwrap();
    }
}

#[test]
fn script_state_of_emulated_robots_cannot_be_read() {
    let expect = |robots: &str, value: &str| {
        format!("[[expect]]\nat = 1\nrobots = {robots}\nvalue = \"{value}\"\nequals = 0\n")
    };
    for value in ["neighbors", "free", "global.x", "stigmergy.1.0", "steps"] {
        assert_error(
            &[WORLD, EMULATED, KILOBOTS, &expect("\"all\"", value)],
            "22:9",
            &[&format!("`{value}` cannot be seen of robots that run firmware"), "LED"],
        );
        parse(&[WORLD, EMULATED, KILOBOTS, &expect("\"k\"", value)].concat()).unwrap();
        let plot = format!("[output]\nplot = [\"x\", \"{value}\"]\n");
        assert_error(&[WORLD, EMULATED, &plot], "15:14", &["cannot be seen"]);
        // A column of the others.
        parse(&[WORLD, EMULATED, KILOBOTS, &plot].concat()).unwrap();
    }
    for value in ["x", "heading", "led", "distance(1, 2)", "running"] {
        parse(&[WORLD, EMULATED, &expect("\"all\"", value)].concat()).unwrap();
    }
    // Of a Kilobot's memory the emulator knows that much.
    let kilobots = [KILOBOTS, "backend = \"firmware\"\nfirmware = \"other.elf\"\n"].concat();
    parse(&[WORLD, &kilobots, SIMULATED, &expect("\"all\"", "steps")].concat()).unwrap();
    assert_error(
        &[WORLD, &kilobots, EMULATED, &expect("\"all\"", "steps")],
        "24:9",
        &["`steps` cannot be seen"],
    );
}

#[test]
fn settings_in_flash_are_checked_against_the_robot_file() {
    let model = "model = { fidelity = \"flight\" }\n";
    let with = |group: &str, settings: &str| format!("{EMPTY}{group}settings = {settings}\n");
    let on_firmware =
        with(&[CRAZYFLIES, model].concat(), "[\"height_mm=700\", \"fence_back_mm=0\"]");
    let group = &parse(&on_firmware).unwrap().groups[0];
    assert_eq!(group.settings, [None, None, Some(700), None, Some(0), None, None]);
    assert_eq!(
        group.model.fence_mm().unwrap(),
        [[0.0, f32::NEG_INFINITY, f32::NEG_INFINITY], [f32::INFINITY, f32::INFINITY, 700.0]]
    );
    // Without `fidelity = "flight"` the firmware has them, too, and the world knows of no fence.
    assert_eq!(
        parse(&with(CRAZYFLIES, "[\"height_mm=700\"]")).unwrap().groups[0].settings[2],
        Some(700)
    );
    assert!(parse(&format!("{WORLD}{EMULATED}settings = [\"range_mm=300\"]\n")).is_ok());
    for (settings, reason) in [
        ("[\"height_mm=1\"]", "no whole number from 200 to 65534"),
        ("[\"width_mm=300\"]", "no setting has this name"),
        ("[\"height_mm\"]", "not of the form NAME=NUMBER"),
        ("[\"height_mm=300\", \"height_mm=400\"]", "given twice"),
    ] {
        assert_error(&[EMPTY, CRAZYFLIES, &format!("settings = {settings}\n")], "14:12", &[reason]);
    }
    assert_error(&[EMPTY, CRAZYFLIES, "settings = \"height_mm=300\"\n"], "14:12", &["list"]);
    let refused = ["`settings` have no effect", "backend = \"firmware\""];
    assert_error(&[WORLD, SIMULATED, "settings = [\"range_mm=300\"]\n"], "13:12", &refused);
    let kilobots = [EMPTY, KILOBOTS, "settings = [\"range_mm=300\"]\n"];
    assert_error(&kilobots, "13:12", &["the Kilobot does not take", "it has no settings"]);
}
