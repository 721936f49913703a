//! Errors of scenario files, each with its line, column and remedy.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::LazyLock;

use bittybuzz_arena::scenario::{Scenario, ScenarioError};

/// A folder with the scripts that the scenarios name, written before the first test reads it.
static FOLDER: LazyLock<PathBuf> = LazyLock::new(|| {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("scenario_errors");
    fs::create_dir_all(folder.join("sub")).unwrap();
    fs::write(folder.join("walk.bzz"), "function step() {}\n").unwrap();
    fs::write(folder.join("broken.toml"), "name = \"mine\"\nnmae = 3\nprofile = \"big\"\n")
        .unwrap();
    let kilobot = bittybuzz_robot_files::shipped()[0].text;
    fs::write(folder.join("mine.toml"), kilobot.replace("\"kilobot\"", "\"mine\"")).unwrap();
    folder
});

fn errors(text: &str, set: &[&str]) -> Vec<ScenarioError> {
    let set: Vec<String> = set.iter().map(|set| (*set).to_owned()).collect();
    Scenario::parse(text, "s.toml", &FOLDER, &set, &bittybuzz_robot_models::all())
        .err()
        .unwrap_or_default()
}

/// `s.toml:3:1: message | help`
fn printed(error: &ScenarioError) -> String {
    let place = match &error.place {
        Some(place) => format!("{}:{}:{}", place.path, place.line, place.column),
        None => "-".to_owned(),
    };
    format!("{place}: {error} | {}", error.help().unwrap_or_default())
}

/// What most cases begin with; nine lines.
const BASE: &str = r#"[world]
size = [1000, 800]
duration = 60

[[robots]]
robot = "kilobot"
script = "walk.bzz"
count = 5

"#;

/// A group in a world; the case goes on in the group, in line 7.
const GROUP: &str = "[world]\nsize = [1000, 800]\nduration = 60\n[[robots]]\nrobot = \"kilobot\"\nscript = \"walk.bzz\"\n";

/// What follows a start, where the error is, and what it says.
const AFTER_BASE: &[(&str, &str, &[&str])] = &[
    // Keys and types.
    ("[medum]\n", "10:2", &["unknown key `medum` in the file", "did you mean `medium`?"]),
    ("[medium.irr]\n", "10:9", &["unknown key `irr` in [medium]", "did you mean `ir`?"]),
    ("[medium.ir]\nrnage = 3\n", "11:1", &["unknown key `rnage` in [medium.ir]", "`range`?"]),
    ("[medium.ir]\nrange = \"far\"\n", "11:9", &["`range` must be a number, not a string"]),
    ("[medium.ir]\nloss = 1.5\n", "11:8", &["`loss` cannot be 1.5", "from 0 to 1"]),
    ("[medium.ir]\nloss = nan\n", "11:8", &["`loss` cannot be NaN", "from 0 to 1"]),
    ("[medium.ir]\nrate = -2\n", "11:8", &["`rate` cannot be -2"]),
    ("[medium.ir]\nloss = [0, 2]\n", "11:12", &["`loss` cannot be 2"]),
    ("[medium.ir]\nloss = [0.5]\n", "11:8", &["a number or two as [near, far], not a list of 1"]),
    ("[medium.nrf24]\nrange = 3\n", "10:1", &["no robot of the scenario has", "`nrf24`"]),
    // Adversaries.
    ("[[adversary]]\nat = [0, 0]\n", "10:1", &["this [[adversary]] has no `kind`"]),
    ("[[adversary]]\nkind = \"jam\"\n", "10:1", &["this [[adversary]] has no `at`"]),
    ("[[adversary]]\nkind = \"jem\"\nat = [0, 0]\n", "11:8", &["`kind` cannot be", "`jam`?"]),
    ("[[adversary]]\nkind = \"jam\"\nat = [600, 0]\n", "12:6", &["(600, 0) would be outside"]),
    (
        "[[adversary]]\nkind = \"jam\"\nat = [0, 0]\nid = 1\n",
        "13:6",
        &["`id` means nothing without `kind = \"same-id\"`"],
    ),
    (
        "[[adversary]]\nkind = \"same-id\"\nat = [0, 0]\n",
        "10:1",
        &["this [[adversary]] has no `id`"],
    ),
    ("[[adversary]]\nkind = \"same-id\"\nat = [0, 0]\nid = 5\n", "13:6", &["there is no robot 5"]),
    (
        "[[adversary]]\nkind = \"jam\"\nat = [0, 0]\nrate = 300\n",
        "13:8",
        &["`rate` cannot be 300", "226"],
    ),
    (
        "[[adversary]]\nkind = \"jam\"\nat = [0, 0]\nfrom = 60\n",
        "13:8",
        &["`from` is not within the run"],
    ),
    (
        "[[adversary]]\nkind = \"jam\"\nat = [0, 0]\nuntil = 61\n",
        "13:9",
        &["`until` is not within the run"],
    ),
    (
        "[[adversary]]\nkind = \"jam\"\nat = [0, 0]\ngroup = \"kilobt\"\n",
        "13:9",
        &["no group of robots is named `kilobt`", "`kilobot`?"],
    ),
    (
        "[[event]]\nat = 1\nadversary = { kind = \"jam\", at = [0, 0], from = 2 }\n",
        "12:49",
        &["`from` means nothing without `[[adversary]]`"],
    ),
    ("[[event]]\nat = 1\nbrown_out = 5\n", "12:13", &["no robot 5"]),
    // Events.
    ("[[event]]\nfail = 1\n", "10:1", &["this [[event]] has no `at`"]),
    (
        "[[event]]\nat = 61\nheal = true\n",
        "11:6",
        &["not within the run", "`duration` in [world] is 60"],
    ),
    ("[[event]]\nat = -1e300\nheal = true\n", "11:6", &["cannot be -1e300 | a number from 0 on"]),
    ("[[event]]\nat = 1\nmove = 1\nto = [1e300, 0]\n", "13:6", &["(1e300, 0) would be outside"]),
    ("[[event]]\nat = 1\n", "10:1", &["does not say what is meant", "one of fail, stop,"]),
    ("[[event]]\nat = 1\nfail = 1\nstop = 2\n", "13:8", &["`stop` and `fail` cannot stand"]),
    ("[[event]]\nat = 1\nfail = 5\n", "12:8", &["no robot 5", "`kilobot` with ids 0 to 4"]),
    ("[[event]]\nat = 1\nfail = \"3..7\"\n", "12:8", &["there is no robot 3..7"]),
    ("[[event]]\nat = 1\nfail = \"3..1\"\n", "12:8", &["no robot is in `3..1`"]),
    ("[[event]]\nat = 1\nfail = [1, \"kilobots\"]\n", "12:12", &["no group", "`kilobot`?"]),
    ("[[event]]\nat = 1\nfail = 1.5\n", "12:8", &["`fail` must be robots:"]),
    ("[[event]]\nat = 1\nmove = 1\n", "10:1", &["one of to, by is needed"]),
    ("[[event]]\nat = 1\nmove = 1\nto = [1, 900]\n", "13:6", &["(1, 900)", "1000 mm by 800 mm"]),
    ("[[event]]\nat = 1\nfail = 1\nto = [1, 2]\n", "13:6", &["`to` means nothing without `move`"]),
    ("[[event]]\nat = 1\nheal = false\n", "12:8", &["`heal` must be true"]),
    ("[[event]]\nat = 1\nblock = [1]\n", "12:9", &["`block` must be two lists of robots", "of 1"]),
    ("[[event]]\nat = 1\nloss = 0.1\nmedium = \"it\"\n", "13:10", &["\"it\"", "`ir`?"]),
    ("[[event]]\nat = 1\nloss = 0.1\nmedium = \"p2p\"\n", "13:10", &["no robot", "`p2p`"]),
    ("[[event]]\nat = 1\nlight = { at = [1, 2], brightness = 2000 }\n", "12:37", &["2000"]),
    ("[[event]]\nat = 60\nheal = true\n", "11:6", &["not within the run"]),
    ("[[event]]\nat = 1\npartition = []\n", "12:13", &["1 to 255 parts"]),
    ("[[event]]\nat = 1\npartition = [[0, 1], [2, 1]]\n", "12:22", &["robot 1 is in two parts"]),
    ("[[event]]\nat = 0.05\nheal = true\n", "11:6", &["`at` cannot be 0.05", "0 and 0.1 are"]),
    // Expectations.
    (
        "[[expect]]\nat = 9.99\nvalue = \"x\"\nabove = 1\n",
        "11:6",
        &["cannot be 9.99", "9.9 and 10"],
    ),
    (
        "[[expect]]\nwithin = 5.05\nvalue = \"x\"\nabove = 1\n",
        "11:10",
        &["`within` cannot be 5.05", "5 and 5.1 are the nearest"],
    ),
    (
        "[[expect]]\nalways = [1, 2.35]\nvalue = \"x\"\nabove = 1\n",
        "11:14",
        &["`always` cannot be 2.35", "2.3 and 2.4"],
    ),
    ("[[expect]]\nvalue = \"x\"\nabove = 1\n", "10:1", &["one of at, within, always is needed"]),
    ("[[expect]]\nat = 1\nabove = 1\n", "10:1", &["this [[expect]] has no `value`"]),
    ("[[expect]]\nat = 1\nvalue = \"x\"\n", "10:1", &["one of equals, differs"]),
    ("[[expect]]\nat = 1\nvalue = \"ledd\"\nequals = 1\n", "12:9", &["`ledd`", "`led`?"]),
    ("[[expect]]\nat = 1\nvalue = \"globl.a\"\nequals = 1\n", "12:9", &["`global.NAME`?"]),
    ("[[expect]]\nat = 1\nvalue = \"global.1a\"\nequals = 1\n", "12:9", &["no quantity"]),
    ("[[expect]]\nat = 1\nvalue = \"stigmergy.70000.a\"\nequals = 1\n", "12:9", &["no quantity"]),
    ("[[expect]]\nat = 1\nwithin = 2\nvalue = \"x\"\nabove = 1\n", "12:10", &["`within` and `at`"]),
    ("[[expect]]\nalways = [5, 2]\nvalue = \"x\"\nabove = 1\n", "11:10", &["[5, 2]"]),
    ("[[expect]]\nat = 1\nvalue = \"x\"\nof = \"al\"\nabove = 1\n", "13:6", &["\"al\"", "`all`?"]),
    ("[[expect]]\nat = 1\nvalue = \"x\"\nof = 0\nabove = 1\n", "13:6", &["`of` cannot be 0"]),
    (
        "[[expect]]\nat = 1\nvalue = \"x\"\nof = \"mean\"\nexists = true\n",
        "13:6",
        &["\"mean\" needs"],
    ),
    (
        "[[expect]]\nat = 1\nvalue = \"x\"\nabove = 1\ntolerance = 1\n",
        "14:13",
        &["without `equals`"],
    ),
    (
        "[[expect]]\nat = 1\nvalue = \"x\"\nequals = [1]\n",
        "13:10",
        &["a number or a string, not a list"],
    ),
    ("[[expect]]\nat = 1\nvalue = \"x\"\nbetween = [3, 1]\n", "13:11", &["[3, 1]"]),
    (
        "[[expect]]\nat = 1\nvalue = \"x\"\nbetween = [3]\n",
        "13:11",
        &["[low, high], not a list of 1"],
    ),
    (
        "[[expect]]\nname = \"far out\"\nat = 1\nvalue = \"x\"\nabove = 1\n",
        "11:8",
        &["\"far out\" cannot be the name of an expectation", "letters, digits and _"],
    ),
    ("[[expect]]\nname = \"1\"\nat = 1\nvalue = \"x\"\nabove = 1\n", "11:8", &["\"1\" cannot"]),
    ("[[expect]]\nname = \"\"\nat = 1\nvalue = \"x\"\nabove = 1\n", "11:8", &["\"\" cannot be"]),
    (
        "[[expect]]\nname = \"a\\nb\"\nat = 1\nvalue = \"x\"\nabove = 1\n",
        "11:8",
        &["\"a\\nb\" cannot be the name"],
    ),
    ("[[expect]]\nname = 3\nat = 1\nvalue = \"x\"\nabove = 1\n", "11:8", &["must be a string"]),
    (
        "[[expect]]\nname = \"a\"\nat = 1\nvalue = \"x\"\nabove = 1\n\
         [[expect]]\nat = 1\nname = \"a\"\nvalue = \"x\"\nabove = 1\n",
        "17:8",
        &["an expectation `a` is defined a second time", "the first is in line 11"],
    ),
    // Files.
    ("[[file]]\npath = \"a.bzz\"\n", "10:1", &["this [[file]] has no `text`"]),
    (
        "[[file]]\npath = \"a.bzz\"\ntext = \"\"\n[[file]]\ntext = \"\"\npath = \"a.bzz\"\n",
        "15:8",
        &["the file `a.bzz` stands here a second time", "the first is in line 11"],
    ),
    // Output.
    ("[output]\nevery = 0\n", "11:9", &["`every` cannot be 0"]),
    (
        "[output]\nevery = 0.25\n",
        "11:9",
        &["`every` cannot be 0.25", "tick each 0.1 s", "0.2 and 0.3"],
    ),
    ("[output]\nevery = 0.19999\n", "11:9", &["`every` cannot be 0.19999", "0.1 and 0.2"]),
    ("[output]\nplot = [\"x\", \"speeed\"]\n", "11:14", &["no quantity `speeed`"]),
    // TOML itself.
    ("[output\n", "10:1", &["this is not TOML: this `[` is never closed", "write the `]`"]),
    ("[medium.ir]\nloss = [0, 0.5\n[output]\nevery = 1\n", "11:8", &["`[` is never closed"]),
];

const AFTER_GROUP: &[(&str, &str, &[&str])] = &[
    ("count = 0\n", "7:9", &["`count` cannot be 0", "1 to 65536"]),
    ("cuont = 3\n", "7:1", &["unknown key `cuont` in this [[robots]]", "`count`?"]),
    ("first_id = 70000\n", "7:12", &["`first_id` cannot be 70000"]),
    ("count = 10\nfirst_id = 65530\n", "8:12", &["id 65539", "0 to 65535"]),
    ("placement = \"gird\"\n", "7:13", &["\"gird\"", "`grid`?"]),
    ("positions = \"grid\"\n", "7:13", &["`positions` must be a list, not a string"]),
    ("placement = \"grid\"\n", "4:1", &["this [[robots]] has no `spacing`"]),
    (
        "placement = \"grid\"\nspacing = 50\nradius = 3\n",
        "9:10",
        &["without `placement = \"circle\"`"],
    ),
    (
        "placement = \"line\"\nspacing = 400\ncount = 9\n",
        "7:13",
        &["robot 2 of this group at (800, 0)"],
    ),
    ("at = [1001, 0]\n", "7:6", &["(1001, 0) would be outside", "1000 mm by 800 mm"]),
    (
        "positions = [[1, 1], [2]]\n",
        "7:22",
        &["two numbers as [x, y], or three as [x, y, degrees], not a list of 1"],
    ),
    ("positions = [3]\n", "7:14", &["two numbers as [x, y], or three", "not an integer"]),
    ("positions = [[1, 1, 400]]\n", "7:21", &["cannot be 400", "-360 to 360"]),
    ("positions = [[1, 1, \"x\"]]\n", "7:21", &["must be a number, not a string"]),
    ("positions = [[2000, 1, 0]]\n", "7:14", &["(2000, 1) would be outside"]),
    ("count = 3\npositions = [[1, 1]]\n", "8:13", &["as long as `count` says"]),
    ("heading = \"left\"\n", "7:11", &["a number of degrees or \"random\""]),
    ("heading = 400\n", "7:11", &["`heading` cannot be 400", "-360 to 360"]),
    ("present = \"no\"\n", "7:11", &["`present` must be true or false"]),
    ("on_fault = \"land\"\n", "7:12", &["\"land\"", "one of restart, stop"]),
    ("body = \"kilobt\"\n", "7:8", &["\"kilobt\"", "`kilobot`?"]),
    ("body = 3\n", "7:8", &["`body` must be a string, not an integer"]),
    (
        "[[expect]]\nat = 1\nvalue = \"swarm.spread\"\nof = \"mean\"\nabove = 3\n",
        "10:6",
        &["`of` means nothing here"],
    ),
    (
        "[[expect]]\nat = 1\nvalue = \"swarm.polarization\"\nabove = 3\n",
        "9:9",
        &["no quantity `swarm.polarization`", "one of swarm.polarisation, swarm.nearest"],
    ),
    ("positions = []\n", "7:13", &["a list of one place [x, y] or more, not a list of 0"]),
    ("name = \"all\"\n", "7:8", &["\"all\" cannot be the name of a group", "a word is needed"]),
    ("name = \"\"\n", "7:8", &["\"\" cannot be the name"]),
    ("name = \"3\"\n", "7:8", &["\"3\" cannot be the name"]),
    ("name = \"0 .. 3\"\n", "7:8", &["\"0 .. 3\" cannot be the name"]),
    ("count = 9\n[[event]]\nat = 1\nfail = []\n", "10:8", &["a list of one robot or more"]),
    (
        "count = 9\n[[expect]]\nat = 1\nvalue = \"x\"\nrobots = [0, 3]\nof = 3\nabove = 3\n",
        "12:6",
        &["`of` cannot be 3", "2 robots are looked at"],
    ),
    ("model = 3\n", "7:9", &["`model` must be a table, not an integer"]),
    ("model = { speed_error = 2 }\n", "7:25", &["`speed_error` cannot be 2", "from 0 to 1"]),
    (
        "model = { tern_error = 2 }\n",
        "7:11",
        &["in the `model` of these Kilobots", "`turn_error`?"],
    ),
    (
        "model = { radius = 20 }\n",
        "7:11",
        &["unknown key `radius`", "one of speed, turn, dead_duty, speed_error"],
    ),
    ("model = { lag = 1 }\n", "7:11", &["unknown key `lag` in the `model` of these Kilobots"]),
    ("link = { range = -1 }\n", "7:18", &["`range` cannot be -1"]),
    ("link = { lose = 0.1 }\n", "7:10", &["in the `link` of these Kilobots", "`loss`?"]),
    ("[body.kilobot]\nspede = 3\n", "8:1", &["unknown key `spede`", "`speed`?"]),
    ("[body.kilobot]\npreset = \"argus\"\n", "8:10", &["\"argus\"", "`argos`?"]),
    (
        "[body.crazyflie]\npositioning = \"gps\"\n",
        "8:15",
        &["\"gps\"", "one of none, flow, loco, lighthouse, capture"],
    ),
    ("[body]\nkilobot = { turn_error = 2 }\n", "8:26", &["`turn_error` cannot be 2"]),
    (
        "[[robots]]\nrobot = \"kilobot\"\nscript = \"walk.bzz\"\nfirst_id = 0\n",
        "10:12",
        &["robot 0 is defined", "line 4"],
    ),
    (
        "[[robots]]\nrobot = \"kilobot\"\nscript = \"walk.bzz\"\nname = \"kilobot\"\n",
        "10:8",
        &["a second time", "line 4"],
    ),
    (
        "[[robots]]\nrobot = \"killobot\"\nscript = \"walk.bzz\"\n",
        "8:9",
        &["no robot is named `killobot`", "`kilobot`?"],
    ),
    ("[[robots]]\nrobot = \"mine.toml\"\nscript = \"walk.bzz\"\n", "7:1", &["describes no body"]),
    (
        "[[robots]]\nrobot = \"none.toml\"\nscript = \"walk.bzz\"\n",
        "8:9",
        &["cannot read", "none.toml"],
    ),
    (
        "[[robots]]\nrobot = \"kilobot\"\nscript = \"wlak.bzz\"\n",
        "9:10",
        &["no such file", "`walk.bzz`?"],
    ),
    ("[[robots]]\nrobot = \"kilobot\"\nscript = \"sub\"\n", "9:10", &["it is a folder"]),
    ("[[robots]]\nrobot = \"kilobot\"\n", "7:1", &["this [[robots]] has no `script`"]),
    ("[[robots]]\nscript = \"walk.bzz\"\n", "7:1", &["this [[robots]] has no `robot`"]),
];

/// Whole files.
const FILES: &[(&str, &str, &[&str])] = &[
    ("", "1:1", &["the file has no `world`"]),
    ("[world]\nduration = 3\n", "1:1", &["[world] has no `size`"]),
    ("[world]\nsize = [3]\nduration = 3\n", "2:8", &["[width, height], not a list of 1"]),
    ("[world]\nsize = [0, 100]\nduration = 3\n", "2:9", &["`size` cannot be 0"]),
    ("[world]\nsize = [100, 100]\n", "1:1", &["[world] has no `duration`"]),
    ("[world]\nsize = [100, 100]\nduration = 0\n", "3:12", &["`duration` cannot be 0"]),
    (
        "[world]\nsize = [100, 100]\nduration = 0.33\n",
        "3:12",
        &["`duration` cannot be 0.33", "0.3 and 0.4 are the nearest"],
    ),
    ("[world]\nsize = [100, 100]\nduration = 9\nseed = -1\n", "4:8", &["`seed` cannot be -1"]),
    ("[world]\nsize = [100, 100]\nduration = 9\n", "1:1", &["no robots", "[[robots]] section"]),
    (
        "[world]\nsize = [100, 100]\nduration = 9\nobstacles = [{ at = [5, 5] }]\n",
        "4:14",
        &["one of radius, size, from"],
    ),
    (
        "[world]\nsize = [100, 100]\nduration = 9\nobstacles = [{ at = [5, 500], radius = 3 }]\n",
        "4:21",
        &["(5, 500)"],
    ),
    (
        "[world]\nsize = [100, 100]\nduration = 9\nobstacles = [{ at = [5, 5], radius = 3, heading = 30 }]\n",
        "4:51",
        &["`heading` means nothing without `size`"],
    ),
    (
        "[world]\nsize = [100, 100]\nduration = 9\nobstacles = [{ from = [5, 5], to = [9, 5], heading = 30 }]\n",
        "4:54",
        &["`heading` means nothing without `size`"],
    ),
    (
        "[world]\nsize = [100, 100]\nduration = 9\nobstacles = [{ at = [5, 5], size = [9, 5], heading = \"random\" }]\n",
        "4:54",
        &["`heading` must be a number"],
    ),
    (
        "[world]\nsize = [100, 100]\nduration = 9\nobstacles = [{ at = [5, 5], size = [9, 5], heading = 400 }]\n",
        "4:54",
        &["`heading` cannot be 400", "from -360 to 360"],
    ),
    (
        "[world]\nsize = [100, 100]\nduration = 9\nground = 0.5\n",
        "4:10",
        &["`ground` must be a list"],
    ),
    ("[world]\nsize = [100, 100]\nduration = 9\nground = [0.5]\n", "4:11", &["must be a table"]),
    (
        "[world]\nsize = [100, 100]\nduration = 9\nground = [{ at = [5, 5], brightness = 0 }]\n",
        "4:11",
        &["this patch of the ground", "one of radius, size"],
    ),
    (
        "[world]\nsize = [100, 100]\nduration = 9\nground = [{ at = [5, 5], radius = 3, size = [9, 5] }]\n",
        "4:45",
        &["`size`", "`radius`"],
    ),
    (
        "[world]\nsize = [100, 100]\nduration = 9\nground = [{ radius = 3 }]\n",
        "4:11",
        &["this patch of the ground has no `at`"],
    ),
    (
        "[world]\nsize = [100, 100]\nduration = 9\nground = [{ at = [5, 51], radius = 3 }]\n",
        "4:18",
        &["(5, 51) would be outside"],
    ),
    (
        "[world]\nsize = [100, 100]\nduration = 9\nground = [{ at = [5, 5], radius = 3, brightness = 255 }]\n",
        "4:51",
        &["`brightness` cannot be 255", "from 0 to 1"],
    ),
    (
        "[world]\nsize = [100, 100]\nduration = 9\nground = [{ at = [5, 5], radius = 0.5 }]\n",
        "4:35",
        &["`radius` cannot be 0.5"],
    ),
    (
        "[world]\nsize = [100, 100]\nduration = 9\nground = [{ at = [5, 5], radius = 3, heading = 9 }]\n",
        "4:48",
        &["`heading` means nothing without `size`"],
    ),
    (
        "[world]\nsize = [100, 100]\nduration = 9\nground = [{ at = [5, 5], radius = 3, height = 9 }]\n",
        "4:38",
        &["unknown key `height` in this patch of the ground"],
    ),
    (
        "[world]\nsize = [100, 100]\nduration = 9\nlights = [[5, -51]]\n",
        "4:11",
        &["(5, -51) would be outside"],
    ),
    ("world = 3\n", "1:9", &["`world` must be a table, not an integer"]),
    ("[world]\nsize = [100, 100]\nduration = 9\nduration = 9\n", "4:1", &["not TOML", "duplicate"]),
];

#[track_caller]
fn check(text: &str, place: &str, parts: &[&str]) {
    let found: Vec<String> = errors(text, &[]).iter().map(printed).collect();
    let start = format!("s.toml:{place}: ");
    let fits = |printed: &&String| {
        printed.starts_with(&start) && parts.iter().all(|part| printed.contains(part))
    };
    assert!(
        found.iter().any(|printed| fits(&printed)),
        "{place} {parts:?}\nfound {found:#?}\nin {text}"
    );
}

/// Only the mistake itself is reported, not its consequences.
#[test]
fn one_mistake_causes_no_further_errors() {
    let follows = "[[event]]\nat = 3\nfail = \"2..4\"\n[[event]]\nat = 3\nloss = 1\n\
                   [[expect]]\nat = 3\nrobots = \"walkers\"\nvalue = \"x\"\nabove = 3\n\
                   [[expect]]\nat = 3\nrobots = [0, 3]\nvalue = \"x\"\nabove = 3\n";
    let line = "placement = \"line\"\nspacing = 150\nat = [-450, 0]\n";
    for (wrong, place) in [
        ("count = -5\n", "11:9"),
        ("count = 0\n", "11:9"),
        ("count = \"many\"\n", "11:9"),
        ("count = 65537\n", "11:9"),
        ("count = 5\nfirst_id = 65535\n", "12:12"),
    ] {
        let text = format!("{GROUP}name = \"walkers\"\n{line}{wrong}{follows}");
        let found: Vec<String> = errors(&text, &[]).iter().map(printed).collect();
        let [only] = found.as_slice() else { panic!("{wrong}{found:#?}") };
        assert!(only.starts_with(&format!("s.toml:{place}: ")), "{only}");
    }
    let positions = "name = \"walkers\"\npositions = [[0, 0], [50, 0]]\n";
    let found = errors(&format!("{GROUP}{positions}count = -5\n{follows}"), &[]);
    assert_eq!(found.len(), 1, "{found:#?}");
    // What a wrong robot talks by is not known.
    let text = GROUP.replace("\"kilobot\"", "\"killobot\"");
    let media = "[medium.nrf24]\nloss = 0.1\n[[event]]\nat = 3\nloss = 1\nmedium = \"ir\"\n";
    let found = errors(&format!("{text}count = 5\nname = \"walkers\"\n{media}{follows}"), &[]);
    assert_eq!(found.len(), 1, "{found:#?}");
}

#[test]
fn every_mistake_has_a_place_and_help() {
    for (case, place, parts) in AFTER_BASE {
        check(&format!("{BASE}{case}"), place, parts);
    }
    for (case, place, parts) in AFTER_GROUP {
        check(&format!("{GROUP}{case}"), place, parts);
    }
    for (case, place, parts) in FILES {
        check(case, place, parts);
    }
}

#[test]
fn each_mistake_gives_one_error() {
    let cases = AFTER_BASE;
    for (case, ..) in cases {
        let found: Vec<String> =
            errors(&format!("{BASE}{case}"), &[]).iter().map(printed).collect();
        assert_eq!(found.len(), 1, "{case}\n{found:#?}");
    }
    for (case, ..) in AFTER_GROUP {
        let found: Vec<String> =
            errors(&format!("{GROUP}{case}"), &[]).iter().map(printed).collect();
        assert_eq!(found.len(), 1, "{case}\n{found:#?}");
    }
}

/// A Kilobot's radius is 16.5 mm. Two bodies need 33 mm, and ten on a circle 16.5 / sin(18 degrees) = 53.4 mm.
const STARTS: &[(&str, &[&str])] = &[
    (
        "count = 3\nplacement = \"line\"\nspacing = 20\n",
        &[
            "robot 0 at (0, 0) and robot 1 at (20, 0) overlap",
            "need 33 mm",
            "least `spacing` is 33",
        ],
    ),
    (
        "count = 4\nplacement = \"grid\"\nspacing = 32.9\n",
        &["robot 0 at (-16.45, -16.45) and robot 1 at (16.45, -16.45) overlap", "`spacing` is 33"],
    ),
    (
        "count = 10\nplacement = \"circle\"\nradius = 50\nat = [-200, -200]\nfirst_id = 7\n",
        &["robot 7 at (-150, -200) and robot 8 at (-159.55, -170.61) overlap", "`radius` is 53.4"],
    ),
    (
        "count = 2\nplacement = \"hexagonal\"\nspacing = 20\n",
        &["robot 0 at (-10, 0) and robot 1 at (10, 0) overlap", "the least `spacing` is 33"],
    ),
    (
        "positions = [[0, 0], [100, 0], [0, 0]]\n",
        &[
            "robot 0 at (0, 0) and robot 2 at (0, 0) overlap | their bodies need 33 mm from middle to middle",
        ],
    ),
    (
        "positions = [[483.6, 0]]\n",
        &[
            "robot 0 at (483.6, 0) would stand in the wall",
            "16.5 mm: x is from -483.5 to 483.5, y from -383.5 to",
        ],
    ),
    (
        "placement = \"line\"\nspacing = 50\nat = [0, -390]\n",
        &["robot 0 at (0, -390) would stand in the wall"],
    ),
    (
        "positions = [[0, 110]]\n",
        &["robot 0 at (0, 110) would stand in an obstacle", "16.5 mm, which must be"],
    ),
    ("positions = [[0, 200]]\n", &["robot 0 at (0, 200) would stand in an obstacle"]),
    ("positions = [[300, 15]]\n", &["robot 0 at (300, 15) would stand in an obstacle"]),
    // 37 mm above the middle of the turned box are 37 / sqrt 2 = 26.16 mm beside it, of which 10 are inside. (82, 82) is 82 sqrt 2 =
    // 115.97 mm along the box, which ends at 100.
    ("positions = [[250, -213]]\n", &["robot 0 at (250, -213) would stand in an obstacle"]),
    ("positions = [[332, -168]]\n", &["robot 0 at (332, -168) would stand in an obstacle"]),
    (
        "present = false\npositions = [[50, 0], [60, 0]]\n[[event]]\nat = 1\njoin = \"all\"\n",
        &["robot 0 at (50, 0) and robot 1 at (60, 0) overlap"],
    ),
];

/// A disc of 20 mm, a box of 100 mm, a thin wall and a box of 200 mm by 20 mm that rises by 45 degrees stand in the world.
#[test]
fn starts_that_have_no_room_are_refused() {
    let obstacles = "obstacles = [{ at = [0, 80], radius = 20 }, { at = [0, 200], size = [100, 100] }, { from = [200, 0], to = [400, 0] }, { at = [250, -250], size = [200, 20], heading = 45 }]";
    let world = GROUP.replace("duration = 60", &format!("duration = 60\n{obstacles}"));
    for (case, parts) in STARTS {
        let found: Vec<String> =
            errors(&format!("{world}{case}"), &[]).iter().map(printed).collect();
        let [only] = found.as_slice() else { panic!("{case}{found:#?}") };
        assert!(only.starts_with("s.toml:5:1: "), "{only}");
        for part in *parts {
            assert!(only.contains(part), "{part} is not in {only}");
        }
    }
    // Bodies may touch each other and all else; who joins alone may come to where others were.
    for case in [
        "count = 9\nplacement = \"grid\"\nspacing = 33\nat = [-100, -100]\n",
        "count = 10\nplacement = \"circle\"\nradius = 53.4\nat = [-100, -100]\n",
        "positions = [[483.5, -383.5], [0, 116.5], [66.5, 200], [300, -16.5], [250, -212], [333, -167]]\n",
        "present = false\npositions = [[50, 0], [50, 0]]\n[[event]]\nat = 1\njoin = 0\n[[event]]\nat = 9\njoin = 1\n",
    ] {
        let found: Vec<String> =
            errors(&format!("{world}{case}"), &[]).iter().map(printed).collect();
        assert_eq!(found, [""; 0], "{case}");
    }
    // Robots of two groups.
    let pair = format!(
        "{world}positions = [[50, 0]]\n[[robots]]\nrobot = \"zooids\"\nscript = \"walk.bzz\"\npositions = [[60, 0]]\n"
    );
    let found: Vec<String> = errors(&pair, &[]).iter().map(printed).collect();
    assert_eq!(
        found,
        [
            "s.toml:9:1: robot 0 at (50, 0) and robot 1 at (60, 0) overlap | their bodies need 29.5 mm from middle to middle"
        ]
    );
}

/// The mistakes of a world of 1000 mm by 800 mm with these obstacles, one in each line.
fn errors_of_obstacles(obstacles: &str) -> Vec<String> {
    let list = format!("duration = 60\nobstacles = [\n{obstacles}\n]");
    let text = GROUP.replace("duration = 60", &list) + "positions = [[-400, -300]]\n";
    errors(&text, &[]).iter().map(printed).collect()
}

/// The box and the wall of the world end at x = 200 and x = 500.
#[test]
fn movable_discs_need_room_of_their_own() {
    let fixed = "{ at = [100, 0], size = [200, 100] },\n";
    for (others, disc, expected) in [
        (
            fixed,
            "{ at = [229, 0], radius = 30, movable = true }",
            "(229, 0) would stand in an obstacle | its radius is 30 mm",
        ),
        (
            "",
            "{ at = [471, 0], radius = 30, movable = true }",
            "(471, 0) would stand in the wall of the world",
        ),
        (
            "",
            "{ at = [0, 0], radius = 450, movable = true }",
            "(0, 0) would stand in the wall of the world",
        ),
        (
            "{ at = [300, 0], radius = 50, movable = true },\n",
            "{ at = [379, 0], radius = 30, movable = true }",
            "(379, 0) would stand in the one at (300, 0)",
        ),
    ] {
        let found = errors_of_obstacles(&format!("{others}{disc}"));
        let [only] = found.as_slice() else { panic!("{found:#?}") };
        let line = 5 + others.lines().count();
        assert!(
            only.starts_with(&format!("s.toml:{line}:1: the movable disc at {expected}")),
            "{only}"
        );
    }
    let touching = "{ at = [230, 0], radius = 30, movable = true },\n{ at = [470, 0], radius = 30, movable = true },\n\
         { at = [310, 0], radius = 50, movable = true },\n{ at = [100, 0], size = [200, 100] },\n\
         { at = [0, 300], radius = 30, movable = false },\n{ at = [0, 300], size = [9, 9], movable = false }";
    assert_eq!(errors_of_obstacles(touching), [""; 0]);
}

#[test]
fn only_discs_are_movable() {
    for other in ["at = [0, 0], size = [10, 10]", "from = [0, 0], to = [10, 10]"] {
        let found = errors_of_obstacles(&format!("{{ {other}, movable = true }}"));
        let column = other.len() + 15;
        let start =
            format!("s.toml:5:{column}: only a disc can be movable | replace its size by `at`");
        let [only] = found.as_slice() else { panic!("{found:#?}") };
        assert!(only.starts_with(&start), "{only}");
    }
    let found = errors_of_obstacles("{ at = [0, 0], radius = 10, movable = 1 }");
    assert!(found[0].contains("true or false"), "{found:#?}");
}

/// Robots neither start in a movable disc nor are moved there, nor placed there at random.
#[test]
fn movable_discs_bar_robots_like_obstacles() {
    let disc = "duration = 60\nobstacles = [{ at = [0, 0], radius = 300, movable = true }]";
    let world = GROUP.replace("duration = 60", disc);
    let found = errors(&format!("{world}positions = [[0, 316]]\n"), &[]);
    let expected = "robot 0 at (0, 316) would stand in an obstacle";
    assert!(printed(&found[0]).contains(expected), "{found:#?}");
    let moved = "positions = [[0, 316.5]]\n[[event]]\nat = 1\nmove = 0\nto = [0, -316]\n";
    let found = errors(&format!("{world}{moved}"), &[]);
    assert!(printed(&found[0]).contains("(0, -316) would stand in an obstacle"), "{found:#?}");
}

#[test]
fn one_robot_is_not_moved_into_an_obstacle() {
    let obstacles = "obstacles = [{ at = [0, 80], radius = 20 }]";
    let world = GROUP.replace("duration = 60", &format!("duration = 60\n{obstacles}"));
    let moved = |robots: &str, to: &str| {
        let text = format!("{world}count = 3\n[[event]]\nat = 1\nmove = {robots}\nto = {to}\n");
        errors(&text, &[]).iter().map(printed).collect::<Vec<String>>()
    };
    let [obstacle] = &moved("1", "[0, 110]")[..] else { panic!("{:?}", moved("1", "[0, 110]")) };
    assert!(
        obstacle.starts_with("s.toml:12:6: robot 1 at (0, 110) would stand in an obst"),
        "{obstacle}"
    );
    let [wall] = &moved("2", "[490, 0]")[..] else { panic!("{:?}", moved("2", "[490, 0]")) };
    assert!(wall.starts_with("s.toml:12:6: robot 2 at (490, 0) would stand in the wall"), "{wall}");
    assert_eq!(moved("1", "[0, 116.5]"), [""; 0]);
    // The places of several depend on where they are then.
    assert_eq!(moved("\"all\"", "[0, 110]"), [""; 0]);
}

/// From a tick to four weeks: decimal fractions are not exact in binary.
#[test]
fn events_can_be_at_every_tick() {
    for tick in (1..200).chain([24_191_999, 24_192_000]) {
        let text = BASE.replace("duration = 60", &format!("duration = {}", f64::from(tick) / 10.0));
        let found: Vec<String> = errors(&text, &[]).iter().map(printed).collect();
        assert_eq!(found, [""; 0], "{tick}");
    }
}

#[test]
fn errors_are_reported_in_order() {
    let text = r#"[world]
size = [1000]
duration = "long"
[[robots]]
robot = "kilbot"
script = "none.bzz"
[[robots]]
robot = "kilobot"
script = "walk.bzz"
count = -1
[medium.ir]
loss = 2
[[event]]
at = "now"
fail = "nobody"
[[expect]]
at = 1
value = "led"
equals = true
"#;
    let lines: Vec<usize> =
        errors(text, &[]).iter().filter_map(|error| Some(error.place.as_ref()?.line)).collect();
    assert_eq!(lines, [2, 3, 5, 6, 10, 12, 14, 15, 19]);
}

#[test]
fn errors_in_a_robot_file_have_their_places() {
    let text = format!("{GROUP}[[robots]]\nrobot = \"broken.toml\"\nscript = \"walk.bzz\"\n");
    let found = errors(&text, &[]);
    let found: Vec<String> = found.iter().map(printed).collect();
    // Besides the unknown key, the profile is wrong.
    assert!(
        found.len() > 1 && found.iter().all(|printed| printed.contains("broken.toml:")),
        "{found:#?}"
    );
    let unknown = |printed: &&String| printed.contains("broken.toml:2:1: unknown key `nmae`");
    assert!(found.iter().any(|printed| unknown(&printed)), "{found:#?}");
}

#[test]
fn at_most_a_hundred_errors_are_printed() {
    let events: String =
        (0..20_000).map(|n| format!("[[event]]\nat = 1\nfail = \"g{n}\"\n")).collect();
    let found: Vec<String> = errors(&format!("{BASE}{events}"), &[]).iter().map(printed).collect();
    assert_eq!(found.len(), 101);
    assert!(found[0].starts_with("s.toml:12:8: no group of robots is named `g0`"), "{}", found[0]);
    assert_eq!(found[100], "-: 19900 more mistakes are not shown | ");
    let keys: String = (0..200_000).map(|number| format!("key{number} = 1\n")).collect();
    let found: Vec<String> = errors(&format!("{keys}{BASE}"), &[]).iter().map(printed).collect();
    assert_eq!(found.last().unwrap(), "-: 199900 more mistakes are not shown | ");
}

#[test]
fn a_message_does_not_describe_a_thousand_groups() {
    let group = &GROUP[GROUP.find("[[robots]]").unwrap()..];
    let text = format!("{GROUP}{}[[event]]\nat = 1\nfail = 5000\n", group.repeat(999));
    let found: Vec<String> = errors(&text, &[]).iter().map(printed).collect();
    let [only] = found.as_slice() else { panic!("{found:#?}") };
    assert!(only.contains("`kilobot-24` with ids 23 to 23, 976 more groups"), "{only}");
    assert!(!only.contains("kilobot-25"), "{only}");
}

#[test]
fn errors_in_set_options_name_the_option() {
    for (set, parts) in [
        ("medium.ir.loss=2", &["--set medium.ir.loss:1:1", "`loss` cannot be 2"][..]),
        ("medium.ir.los=0.2", &["--set medium.ir.los:1:1", "did you mean `loss`?"]),
        ("robots.1.count=3", &["there is no `robots.1`", "the file has 1"]),
        ("robots.count=3", &["--set robots.count:1:1", "no group of robots is named `count`"]),
        ("wrld.seed=3", &["--set wrld.seed", "did you mean `world`?"]),
        ("world.seed=abc", &["`seed` must be an integer, not a string"]),
        ("robots.0.script=wakl.bzz", &["--set robots.0.script", "`walk.bzz`?"]),
    ] {
        let found: Vec<String> = errors(BASE, &[set]).iter().map(printed).collect();
        assert_eq!(found.len(), 1, "{set}: {found:#?}");
        for part in parts {
            assert!(found[0].contains(part), "{part} is not in {}", found[0]);
        }
    }
}

#[test]
fn a_set_option_overrides_the_file() {
    let set =
        ["robots.0.count=7", "medium.ir.loss=0.25", "world.seed=9", "body.kilobot.preset=kilombo"];
    let set = set.map(str::to_owned);
    let scenario =
        Scenario::parse(BASE, "s.toml", &FOLDER, &set, &bittybuzz_robot_models::all()).unwrap();
    assert_eq!(scenario.groups[0].count, 7);
    assert_eq!(scenario.media.ir.loss.map(|loss| loss.far), Some(0.25));
    assert_eq!(scenario.world.seed, 9);
    let model: &dyn std::any::Any = &*scenario.groups[0].model;
    let model: &bittybuzz_kilobot_model::KilobotModel = model.downcast_ref().unwrap();
    assert_eq!(model.preset, bittybuzz_kilobot_model::Preset::Kilombo);
}
