//! Scenarios and robot files.

use bittybuzz_random::Random;

use super::Entry;
use crate::bases::{Bases, SCENARIO, SCRIPT};
use crate::case::Case;
use crate::controls;
use crate::mutation::{any, any_mutated, any_truncated, below, changed_text, one};

pub const KINDS: &[Entry] = &[
    ("scenario-truncated", |bases, random, _| {
        let scenario = any_truncated(random, &bases.scenarios);
        call(random, scenario)
    }),
    ("scenario-mutated", |bases, random, _| {
        let scenario = any_mutated(random, &bases.scenarios);
        call(random, scenario)
    }),
    ("scenario-words", |_, random, _| {
        let scenario = changed_text(random, SCENARIO, WORDS);
        call(random, scenario)
    }),
    ("scenario-values", |_, random, _| {
        let scenario = with_value(random, SCENARIO);
        call(random, scenario)
    }),
    ("scenario-structure", structure),
    ("scenario-events", |_, random, _| {
        let count = 1 + below(random, 4);
        let events: String =
            (0..count).map(|_| section(random, "event", EVENTS, EVENT_KEYS)).collect();
        call(random, format!("{SCENARIO}{events}"))
    }),
    ("scenario-adversaries", |_, random, _| {
        let added = section(random, "adversary", ADVERSARIES, ADVERSARY_KEYS);
        call(random, format!("{SCENARIO}{added}"))
    }),
    ("scenario-expectations", |_, random, _| {
        let count = 1 + below(random, 4);
        let expected: String =
            (0..count).map(|_| section(random, "expect", EXPECTED, EXPECT_KEYS)).collect();
        call(random, format!("{SCENARIO}{expected}"))
    }),
    ("scenario-measures", |_, random, _| {
        let count = 1 + below(random, 4);
        let measured: String =
            (0..count).map(|_| section(random, "measure", MEASURED, EXPECT_KEYS)).collect();
        call(random, format!("{SCENARIO}{measured}"))
    }),
    ("scenario-sweeps", |_, random, _| {
        let count = below(random, 4);
        let parameters: String =
            (0..count).map(|_| section(random, "sweep.parameter", VARIED, SWEEP_KEYS)).collect();
        let valid = one(random, SWEEPS);
        let sweep = with_value(random, valid);
        call(random, format!("{SCENARIO}[sweep]\n{sweep}{parameters}"))
    }),
    ("scenario-huge", huge),
    ("scenario-set", |_, random, _| {
        let key = one(random, SET_KEYS);
        let value = one(random, VALUES);
        let arguments = ["sim", "s.toml", "--headless", "--set"].map(str::to_owned);
        let set = match random.below(4) {
            0 => format!("{key}={value},{}", one(random, VALUES)),
            1 => key.to_owned(),
            2 => format!("{key}{value}"),
            _ => format!("{key}={value}"),
        };
        in_folder(Case::new(arguments.into_iter().chain([set])), SCENARIO)
    }),
    ("scenario-controls", |_, random, seed| {
        let evil = controls::escaped(&controls::hostile());
        let raw = controls::hostile();
        let scenario = match seed % 7 {
            0 => SCENARIO.replace("equals = 3", &format!("equals = \"{evil}\"")),
            1 => SCENARIO.replace("\"some\"", &format!("\"{evil}\"")),
            2 => format!("{SCENARIO}\n\"{evil}\" = \"{evil}\"\n"),
            3 => format!("{SCENARIO}[assignment]\ntitle = \"{evil}\"\ntext = \"{evil}\"\n"),
            4 => SCENARIO.replace("s.bzz", &evil),
            5 => SCENARIO.replace("\"kilobot\"", &format!("\"{evil}\"")),
            _ => format!("{SCENARIO}# {raw}\n{raw} = 1\n"),
        };
        call(random, scenario)
    }),
    ("robot-file-mutated", |bases, random, _| {
        let file = any_mutated(random, &bases.robot_files);
        robot_call(random, file)
    }),
    ("robot-file-truncated", |bases, random, _| {
        let file = any_truncated(random, &bases.robot_files);
        robot_call(random, file)
    }),
    ("robot-file-words", |bases, random, _| {
        let file = String::from_utf8_lossy(any(random, &bases.robots)).into_owned();
        let file = changed_text(random, &file, WORDS);
        robot_call(random, file)
    }),
    ("robot-file-values", |bases, random, _| {
        let file = String::from_utf8_lossy(any(random, &bases.robots)).into_owned();
        let file = with_value(random, &file);
        robot_call(random, file)
    }),
];

const WORDS: &[&str] = &[
    "[",
    "]",
    "[[",
    "]]",
    "{",
    "}",
    "=",
    ".",
    "\"",
    "'",
    "\n",
    "#",
    "0",
    "-1",
    "65536",
    "1e308",
    "inf",
    "nan",
    "true",
    "\"\"",
    "[]",
    "{}",
    "robots",
    "[world]",
    "event",
    "expect",
    "medium",
    "at",
    "count",
    "group",
    "body",
    "name",
    "\u{e9}",
    "\\",
    "1979-05-27",
    "\"\"\"",
    "0x10",
    "\u{202e}",
];

/// Values of all types, and numbers beyond all ranges. None asks for a run of more than seconds.
const VALUES: &[&str] = &[
    "0",
    "-1",
    "1",
    "0.5",
    "65536",
    "4294967296",
    "-9223372036854775808",
    "9223372036854775807",
    "1e308",
    "-1e308",
    "1e-320",
    "inf",
    "-inf",
    "nan",
    "true",
    "\"\"",
    "\"x\"",
    "[]",
    "[1]",
    "[1, 2, 3]",
    "{}",
    "[[1, 2], [3]]",
    "{ a = 1 }",
    "1979-05-27T07:32:00Z",
    "99999999999999999999",
    "\"\\u0000\"",
    "\"\\u202e\"",
    "[nan, inf]",
    "\"../../x\"",
    "\"/dev/zero\"",
    "'",
    "=",
    "0.000001",
    "1:9:2",
    "9:1",
    "0:1:0",
    "1:99999999999999",
];

const SET_KEYS: &[&str] = &[
    "world.duration",
    "world.size",
    "medium.loss",
    "medium.range",
    "robots.0.count",
    "robots.9.count",
    "robots.some.count",
    "robots.some.globals.i",
    "robots.0.globals",
    "robots.0.globals.",
    "robots.some.globals.i=1,2;robots.0.count",
    "global.i",
    "global",
    "",
    "=",
    ".",
    "..",
    "robots",
    "robots.0",
    "event.0.at",
    "expect.0.equals",
    "seed",
    "world",
    "light.ambient",
    "\u{1b}[2J",
    "\u{202e}x",
    "a.b.c.d.e.f.g",
];

const EVENT_KEYS: &[&str] = &[
    "at",
    "fail",
    "stop",
    "resume",
    "restart",
    "brown_out",
    "load",
    "script",
    "keep",
    "set",
    "global",
    "number",
    "call",
    "function",
    "join",
    "move",
    "to",
    "by",
    "heading",
    "displace",
    "relabel",
    "battery",
    "volts",
    "light",
    "loss",
    "medium",
    "block",
    "restore",
    "partition",
    "heal",
    "adversary",
];

const EXPECT_KEYS: &[&str] = &[
    "name",
    "at",
    "within",
    "always",
    "robots",
    "value",
    "of",
    "equals",
    "differs",
    "below",
    "above",
    "between",
    "exists",
    "tolerance",
];

const ADVERSARY_KEYS: &[&str] =
    &["kind", "at", "height", "group", "range", "rate", "id", "from", "until"];

const QUANTITIES: &[&str] = &[
    "\"global.i\"",
    "\"distance(0, 1)\"",
    "\"distance(9, 9)\"",
    "\"distance(\"",
    "\"faults\"",
    "\"x\"",
    "\"global.\"",
    "\"global.i.i\"",
    "\"neighbors\"",
    "\"led\"",
    "\"(((((((((\"",
    "\"robots 0\"",
    "\"share(global.i == 1 where running)\"",
    "\"share(\"",
    "\"mean(mean(x))\"",
    "\"quantile(2, x)\"",
    "\"mean(displacement(1))\"",
    "\"displacement(1e300)\"",
    "\"swarm.cluster(nan)\"",
    "\"inside(0, 0, 1e308, 1e308)\"",
];

const SWEEP_KEYS: &[&str] = &["key", "name", "values", "from", "to"];

/// Valid events.
const EVENTS: &[&str] = &[
    "at = 1\nfail = [0]\n",
    "at = 1\nstop = [0, 1]\n",
    "at = 1\nrestart = \"all\"\n",
    "at = 1\nbrown_out = [0, 2]\n",
    "at = 1\nload = [0]\nscript = \"s.bzz\"\nkeep = true\n",
    "at = 1\nset = [0]\nglobal = \"i\"\nnumber = 3\n",
    "at = 1\ncall = [0]\nfunction = \"init\"\n",
    "at = 1\nmove = [0]\nto = [10, 20]\nheading = 90\n",
    "at = 1\nmove = [0, 1]\nby = [10, 20]\n",
    "at = 1\nlight = [10, 20]\n",
    "at = 1\nloss = 0.5\nmedium = \"ir\"\n",
    "at = 1\nblock = [0, 2]\n",
    "at = 1\npartition = [[0, 1], [2]]\n",
    "at = 1\nheal = true\n",
    "at = 1\nadversary = { kind = \"jam\", at = [0, 0] }\n",
];

/// Valid expectations.
const EXPECTED: &[&str] = &[
    "at = 1\nvalue = \"global.i\"\nequals = 3\n",
    "within = 2\nvalue = \"global.i\"\nabove = -1\nof = \"any\"\n",
    "always = [1, 2]\nvalue = \"global.x\"\nexists = false\nrobots = [0]\n",
    "always = 1\nvalue = \"distance(0, 1)\"\nbelow = 1e6\n",
    "at = 1\nvalue = \"global.i\"\nof = \"mean\"\nbetween = [0, 9]\n",
    "name = \"n\"\nat = 1\nvalue = \"global.i\"\ndiffers = 9\ntolerance = 0.5\nof = 2\n",
    "at = 1\nvalue = \"global.t\"\nequals = \"text\"\n",
];

/// Valid measures.
const MEASURED: &[&str] = &[
    "name = \"m\"\nvalue = \"mean(global.i)\"\n",
    "name = \"m\"\nvalue = \"share(global.i >= 1 where running)\"\nat = 1\n",
    "name = \"n\"\nvalue = \"global.i\"\nabove = 3\nof = \"any\"\n",
    "name = \"o\"\nvalue = \"mean_square(displacement(1))\"\nrobots = [0]\n",
    "name = \"p\"\nvalue = \"swarm.cluster(100)\"\nabove = 1\nat = \"end\"\n",
];

/// Valid studies without their parameters.
const SWEEPS: &[&str] = &[
    "chance = \"common\"\nseeds = 2\n",
    "chance = \"independent\"\ndesign = \"list\"\n",
    "chance = \"common\"\ndesign = \"random\"\npoints = 3\nseed = 9\n",
    "chance = \"common\"\ndesign = \"latin-hypercube\"\npoints = 3\n",
];

/// Valid parameters of studies.
const VARIED: &[&str] = &[
    "key = \"robots.some.globals.i\"\nvalues = [1, 2]\n",
    "key = \"medium.ir.loss\"\nname = \"loss\"\nvalues = \"0:0.2:0.1\"\n",
    "key = \"robots.0.globals.i\"\nfrom = 1\nto = 5\n",
];

/// Valid adversaries.
const ADVERSARIES: &[&str] = &[
    "kind = \"jam\"\nat = [0, 0]\n",
    "kind = \"babble\"\nat = [0, 0]\nrate = 50\n",
    "kind = \"replay\"\nat = [9, 9]\nfrom = 1\nuntil = 2\n",
    "kind = \"forged-clock\"\nat = [0, 0]\ngroup = \"some\"\n",
    "kind = \"poison\"\nat = [0, 0]\nrange = 100\n",
    "kind = \"invented-ids\"\nat = [0, 0]\nheight = 3\n",
    "kind = \"same-id\"\nat = [0, 0]\nid = 1\n",
];

/// Returns a valid section with other values in some of its lines, and sometimes with another line.
fn section(random: &mut Random, name: &str, valid: &[&str], keys: &[&str]) -> String {
    let mut text = one(random, valid).to_owned();
    for _ in 0..random.below(3) {
        text = with_value(random, &text);
    }
    if random.chance(0.3) {
        let values = if random.chance(0.3) { QUANTITIES } else { VALUES };
        text += &format!("{} = {}\n", one(random, keys), one(random, values));
    }
    format!("[[{name}]]\n{text}")
}

/// Returns the text with another value in one of its lines.
fn with_value(random: &mut Random, text: &str) -> String {
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    let places: Vec<usize> = (0..lines.len()).filter(|at| lines[*at].contains(" = ")).collect();
    if let Some(at) = places.get(below(random, places.len())) {
        let key = lines[*at].split(" = ").next().unwrap_or_default().to_owned();
        lines[*at] = format!("{key} = {}", one(random, VALUES));
    }
    lines.join("\n") + "\n"
}

/// Returns a call that reads the scenario `s.toml`.
fn call(random: &mut Random, scenario: impl Into<Vec<u8>>) -> Case {
    let arguments: &[&str] = one(
        random,
        &[
            &["sim", "s.toml", "--headless"][..],
            &["sim", "s.toml", "--json"],
            &["sim", "s.toml"],
            &["sim", "s.toml", "--headless", "--record", "out.bbr", "--svg", "pictures"],
            &["sim", "s.toml", "--runs", "2", "--csv", "out.csv"],
            &["sim", "s.toml", "--headless", "--checks"],
            &["grade", ".", "--scenario", "s.toml"],
            &["sim", "s.toml", "--view", "--no-browser"],
        ],
    );
    let case = Case::new(arguments).writing("out.bbr").writing("out.csv").writing("pictures");
    in_folder(case, scenario)
}

/// Adds the scenario, its script, and limits of a run that a mutation may have made endless: the
/// script then has no say, and the limit of processor time would be broken.
fn in_folder(case: Case, scenario: impl Into<Vec<u8>>) -> Case {
    case.with("s.toml", scenario).with("s.bzz", SCRIPT)
}

fn structure(_: &Bases, random: &mut Random, seed: u64) -> Case {
    let depth = 1 << below(random, 14);
    let scenario = match seed % 10 {
        0 => format!("{SCENARIO}{SCENARIO}"),
        1 => format!("{SCENARIO}[world]\n"),
        2 => format!("x = {}{}\n{SCENARIO}", "[".repeat(depth), "]".repeat(depth)),
        3 => format!("x = {}1{}\n{SCENARIO}", "{ a = ".repeat(depth), " }".repeat(depth)),
        4 => format!("{}x = 1\n{SCENARIO}", "a.".repeat(depth)),
        5 => format!("[{}a]\n{SCENARIO}", "a.".repeat(depth)),
        6 => SCENARIO.replace("[[robots]]", "[robots]"),
        7 => SCENARIO.replace("[world]", "[[world]]"),
        8 => SCENARIO.replace('\n', "\r"),
        _ => SCENARIO.lines().rev().collect::<Vec<_>>().join("\n"),
    };
    call(random, scenario)
}

fn huge(_: &Bases, random: &mut Random, seed: u64) -> Case {
    let count = 1 << (6 + below(random, 6));
    let many = |text: &str| text.repeat(count);
    let group = "[[robots]]\nrobot = \"kilobot\"\nscript = \"s.bzz\"\ncount = 1\n";
    let added = match seed % 6 {
        0 => many("[[expect]]\nat = 0.1\nvalue = \"global.i\"\nequals = 3\n"),
        1 => many("[[event]]\nat = 0.1\nstop = [0]\n"),
        2 => format!("[output.plot]\nx = [{}]\n", many("[1, 2], ")),
        3 => many(group),
        4 => many("unknown = 1\n"),
        _ => format!("# {}\n", many("a long comment ")),
    };
    let scenario = SCENARIO.replace("duration = 3", "duration = 0.2");
    let scenario = scenario.replace("at = 1\n", "at = 0.1\n").replace("at = 2\n", "at = 0.1\n");
    call(random, format!("{scenario}\n{added}"))
}

/// Returns a call that reads the robot file `r.toml`.
fn robot_call(random: &mut Random, file: impl Into<Vec<u8>>) -> Case {
    let arguments: &[&str] = one(
        random,
        &[
            &["robots", "r.toml"][..],
            &["check", "s.bzz", "--robot", "r.toml"],
            &["build", "s.bzz", "--robot", "r.toml", "-o", "out"],
            &["run", "s.bzz", "--robot", "r.toml", "--steps", "2"],
            &["sim", "s.toml", "--headless"],
            &["flash", "s.bzz", "--robot", "r.toml", "--dry-run"],
            &["guide", "--robot", "r.toml"],
            &["new", "made", "--robot", "r.toml"],
        ],
    );
    let scenario = SCENARIO.replace("\"kilobot\"", "\"r.toml\"");
    let case = in_folder(Case::new(arguments), scenario).with("r.toml", file);
    case.writing("out.bbi").writing("out.sym").writing("made")
}
