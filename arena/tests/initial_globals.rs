//! `globals` of a group: the numbers with which its scripts begin.

use std::path::Path;
use std::sync::Arc;

use bittybuzz_arena::run::{Setup, Simulation};
use bittybuzz_arena::scenario::{Quantity, Scenario, ScenarioError};

use crate::script::{folder, program, read, setup_errors};

/// Robots whose behavior depends on the globals, with `MOVES` used before and in `init`.
const SCRIPT: &str = "GROUP = 5\nGAIN = 0.5\nseen = 0\nat_init = 0\n\
    function init() {\n  at_init = GROUP\n  neighbors.listen(\"o\", function(topic, value, robot) {\n\
        if(seen < GROUP) seen = seen + 1\n  })\n}\n\
    function step() {\n  neighbors.broadcast(\"o\", GROUP)\n\
    if(rand() % 10 < GROUP) forward() else left()\n  led(GROUP % 8)\n}\n";

fn world(globals: &str, more: &str) -> String {
    format!(
        "[world]\nsize = [600, 600]\nduration = 20\nseed = 7\n\
         [[robots]]\nname = \"walkers\"\nrobot = \"kilobot\"\nscript = \"s.bzz\"\ncount = 12\n{globals}\n\
         [[robots]]\nname = \"others\"\nrobot = \"kilobot\"\nscript = \"s.bzz\"\ncount = 4\n{more}\n"
    )
}

fn event(robots: &str, global: &str, number: &str) -> String {
    format!("[[event]]\nat = 0\nset = \"{robots}\"\nglobal = \"{global}\"\nnumber = {number}\n")
}

fn start(folder: &Path, text: &str, set: &[&str]) -> Simulation {
    let set: Vec<String> = set.iter().map(|set| (*set).to_owned()).collect();
    let models = bittybuzz_robot_models::all();
    let scenario = Scenario::parse(text, "test.toml", folder, &set, &models);
    let scenario = scenario.unwrap_or_else(|errors| panic!("{errors:#?}"));
    let programs = scenario.scripts().map(|(group, script)| program(script, group).unwrap());
    let programs: Vec<_> = programs.collect();
    let seed = scenario.world.seed;
    let setup = Setup::new(scenario, programs).unwrap_or_else(|error| panic!("{error:#?}"));
    Simulation::new(Arc::new(setup), seed, 1).unwrap()
}

/// The digests after each second.
fn digests(folder: &Path, text: &str, set: &[&str]) -> Vec<u64> {
    let mut run = start(folder, text, set);
    let mut digests = Vec::new();
    while !run.is_over() {
        (0..10).for_each(|_| run.tick().unwrap());
        digests.push(run.digest());
    }
    digests
}

fn numbers(run: &Simulation, quantity: &str) -> Vec<Option<f64>> {
    let probe = run.setup().probe(&Quantity::parse(quantity).unwrap()).unwrap();
    run.numbers(&probe)
}

#[test]
fn globals_are_what_an_event_at_0_sets() {
    let folder = folder("initial_same", &[("s.bzz", SCRIPT)]);
    let events = event("walkers", "GROUP", "3") + &event("walkers", "GAIN", "0.75");
    let by_event = digests(&folder, &world("", &events), &[]);
    let by_group = digests(&folder, &world("globals = { GROUP = 3, GAIN = 0.75 }", ""), &[]);
    assert_eq!(by_group, by_event);
    assert_ne!(by_group, digests(&folder, &world("", ""), &[]));
    // An event has the last word.
    let both = world("globals = { GROUP = 9, GAIN = 0.75 }", &event("walkers", "GROUP", "3"));
    assert_eq!(digests(&folder, &both, &[]), by_event);
}

#[test]
fn set_gives_globals_to_groups_by_name_and_number() {
    let folder = folder("initial_set", &[("s.bzz", SCRIPT)]);
    let events = event("walkers", "GROUP", "3") + &event("walkers", "GAIN", "0.75");
    let expected = digests(&folder, &world("", &events), &[]);
    for (globals, set) in [
        ("", ["robots.walkers.globals.GROUP=3", "robots.0.globals.GAIN=0.75"]),
        (
            "globals = { GROUP = 8 }",
            ["robots.walkers.globals={ GROUP = 8, GAIN = 0.75 }", "robots.0.globals.GROUP=3"],
        ),
        ("globals.GROUP = 8", ["robots.0.globals.GAIN=0.75", "robots.walkers.globals.GROUP=3"]),
    ] {
        assert_eq!(digests(&folder, &world(globals, ""), &set), expected, "{globals} {set:?}");
    }
}

#[test]
fn globals_hold_at_every_start_of_a_script() {
    let faulty = format!("{SCRIPT}bad = 0\nfunction fail() {{ bad = nil + 1 }}\n");
    let folder = folder("initial_starts", &[("s.bzz", &faulty)]);
    let more = "present = false\nglobals = { GROUP = 6 }\n\
        [[event]]\nat = 1\njoin = \"others\"\n\
        [[event]]\nat = 2\nrestart = [0, 1]\n\
        [[event]]\nat = 3\ncall = [2, 3]\nfunction = \"fail\"\n\
        [[event]]\nat = 4\nbrown_out = [4]\n\
        [[event]]\nat = 5\nset = [5]\nglobal = \"GROUP\"\nnumber = 1\n";
    let mut run = start(&folder, &world("globals = { GROUP = 3 }", more), &[]);
    (0..100).for_each(|_| run.tick().unwrap());
    let mut expected = [[Some(3.0); 12].as_slice(), &[Some(6.0); 4]].concat();
    // `init` sees the numbers.
    assert_eq!(numbers(&run, "global.at_init"), expected);
    expected[5] = Some(1.0);
    assert_eq!(numbers(&run, "global.GROUP"), expected);
    assert_eq!(numbers(&run, "sum(restarts)"), [Some(2.0)]);
}

/// So that all values of a sweep are of one type.
#[test]
fn an_integer_for_a_float_becomes_a_float() {
    let script = "GAIN = 0.5\nhalf = 0\nfunction step() { half = GAIN / 2 }\n";
    let folder = folder("initial_float", &[("s.bzz", script)]);
    let mut run = start(&folder, &world("globals = { GAIN = 3 }", ""), &[]);
    (0..3).for_each(|_| run.tick().unwrap());
    // Of integers, 3 / 2 would be 1.
    assert_eq!(numbers(&run, "global.half")[0], Some(1.5));
}

#[test]
fn questions_keep_the_globals() {
    let folder = folder("initial_question", &[("s.bzz", SCRIPT)]);
    let more =
        "[[event]]\nat = 1\nask = \"GROUP + 1\"\nrobots = [0]\n[[event]]\nat = 2\nrestart = [0]\n";
    let mut run = start(&folder, &world("globals = { GROUP = 3 }", more), &[]);
    (0..30).for_each(|_| run.tick().unwrap());
    assert_eq!(numbers(&run, "global.GROUP")[0], Some(3.0));
}

fn errors(script: &str, globals: &str, set: &[&str]) -> String {
    let folder = folder("initial_errors", &[("s.bzz", script)]);
    let text = world(globals, "");
    let set: Vec<String> = set.iter().map(|set| (*set).to_owned()).collect();
    let read_it =
        Scenario::parse(&text, "test.toml", &folder, &set, &bittybuzz_robot_models::all());
    let describe = |errors: Vec<ScenarioError>| -> String {
        let lines = errors.iter().map(|error| {
            let place = error.place.as_ref();
            let place =
                place.map_or(String::new(), |place| format!("{}:{}", place.path, place.line));
            format!("{place}: {error}; {}\n", error.help().unwrap_or_default())
        });
        lines.collect()
    };
    match read_it {
        Err(errors) => describe(errors),
        Ok(_) if set.is_empty() => describe(setup_errors(&folder, &text)),
        Ok(_) => String::new(),
    }
}

#[test]
fn mistakes_name_place_and_remedy() {
    let of = |globals: &str| errors(SCRIPT, globals, &[]);
    let has = |text: &str, parts: &[&str]| {
        for part in parts {
            assert!(text.contains(part), "{part}\n{text}");
        }
    };
    has(
        &of("globals = { GROPU = 3 }"),
        &["test.toml:10: no script has a global `GROPU`; did you mean `GROUP`?"],
    );
    has(
        &of("globals = { GROUP = 2.5 }"),
        &[
            "test.toml:10: `GROUP` is an integer in line 1 of `",
            "s.bzz`, and 2.5 is a float; write an integer; or",
            "`GROUP = 1.0`",
        ],
    );
    // Also a float without a fraction: the script would compute with floats.
    has(&of("globals = { GROUP = 2.0 }"), &["2.0 is a float"]);
    assert_eq!(of("globals = { GROUP = 2, GAIN = 1 }"), "");
    has(
        &of("globals = { GROUP = \"3\" }"),
        &["test.toml:10: `GROUP` must be a number, not a string"],
    );
    has(&of("globals = { GROUP = true }"), &["`GROUP` must be a number, not true or false"]);
    has(
        &of("globals = { GROUP = 40000 }"),
        &["`GROUP` cannot be 40000; a number from -32768 to 32767"],
    );
    has(&of("globals = 3"), &["test.toml:10: `globals` must be a table, not an integer"]);
    has(
        &of("backend = \"firmware\"\nglobals = { GROUP = 3 }"),
        &["`globals` cannot be had of robots that run firmware"],
    );
    assert_eq!(of("globals = {}"), "");
    // A number that the script computes may be both.
    assert_eq!(
        errors("GROUP = 2 + id\nfunction step() {}\n", "globals = { GROUP = 2.5 }", &[]),
        ""
    );
    let set = |set: &str| errors(SCRIPT, "", &[set]);
    has(
        &set("robots.walker.globals.GROUP=3"),
        &[
            "--set robots.walker.globals.GROUP:1: no group of robots is named `walker`; did you mean `walkers`?",
        ],
    );
    has(&set("robots.2.globals.GROUP=3"), &["there is no `robots.2`: the file has 2"]);
    has(&set("robots.walkers.globals.GROUP=x"), &["`GROUP` must be a number, not a string"]);
    has(
        &set("robots.walkers.globas.GROUP=3"),
        &["unknown key `globas`", "did you mean `globals`?"],
    );
}

/// Reads what the other tests read, so that the scenario itself is right.
#[test]
fn the_world_of_these_tests_is_valid() {
    let folder = folder("initial_valid", &[("s.bzz", SCRIPT)]);
    let (scenario, _) = read(&folder, &world("globals = { GROUP = 3 }", ""));
    assert_eq!(scenario.groups[0].globals.len(), 1);
    assert!(scenario.groups[1].globals.is_empty());
}
