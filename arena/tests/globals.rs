//! Globals of scripts that events and commands set, and that robots keep when they get another script.

use std::sync::Arc;

use crate::script::{folder, program, read};
use bittybuzz_arena::run::{Session, Setup, SetupError, Simulation, Verdict, complete_watched};
use bittybuzz_arena::scenario::{Quantity, Scenario, ScenarioError};

const COUNTS: &str = "join = 1 doubled = 0 half = 0.5 n = 0 whole = 0 t = {.a = 1}\n\
    function init() { doubled = 2 * join }\n\
    function step() { n = n + 1 whole = isint(join) }\n";

/// Has `n` and `half` of the other one, a table by the name of its number, and a number by that of its table.
const NEXT: &str = "n = 1000 half = 7.5 join = {.now = 6} t = 3 new = 4\n\
    function init() { n = 2000 }\n\
    function whole() { return 1 }\n\
    function step() { n = n + whole() }\n";

const WORLD: &str = "[world]\nsize = [600, 600]\nduration = 10\n\n\
    [[robots]]\nrobot = \"kilobot\"\nscript = \"counts.bzz\"\nclock_skew = 0\ncount = 3\nplacement = \"line\"\nspacing = 50\n\n\
    [[robots]]\nrobot = \"crazyflie\"\nname = \"flies\"\nscript = \"counts.bzz\"\nat = [200, 0]\n\n\
    [[robots]]\nrobot = \"kilobot\"\nname = \"late\"\nscript = \"counts.bzz\"\nclock_skew = 0\nat = [200, 200]\npresent = false\n\n";

fn simulation(test: &str, events: &str) -> Simulation {
    let folder = folder(test, &[("counts.bzz", COUNTS), ("next.bzz", NEXT)]);
    let (scenario, programs) = read(&folder, &[WORLD, events].concat());
    let setup = Setup::new(scenario, programs).unwrap().with_compiler(Arc::new(program));
    Simulation::new(Arc::new(setup), 1, 1).unwrap()
}

/// Runs to the end; all that is expected must hold.
fn run(test: &str, events: &str) {
    let mut simulation = simulation(test, events);
    while !simulation.is_over() {
        simulation.tick().unwrap();
    }
    let summary = simulation.summary();
    let expects = &simulation.setup().scenario.expects;
    assert!(!expects.is_empty() && expects.len() == summary.convergences.len());
    for (convergence, expect) in summary.convergences.iter().zip(expects) {
        assert_eq!(convergence.verdict, Verdict::Held, "{expect}");
    }
}

fn equals(at: u32, robots: &str, global: &str, number: &str) -> String {
    format!(
        "[[expect]]\nat = {at}\nrobots = {robots}\nvalue = \"global.{global}\"\nequals = {number}\n\n"
    )
}

#[test]
fn init_sees_a_global_set_before_the_first_tick() {
    let event = "[[event]]\nat = 0\nset = [1, \"flies\"]\nglobal = \"join\"\nnumber = 20\n\n";
    let expects = [
        equals(1, "[1, \"flies\"]", "doubled", "40"),
        equals(1, "[1, \"flies\"]", "join", "20"),
        equals(1, "[0, 2]", "doubled", "2"),
    ];
    run("globals_first", &(event.to_owned() + &expects.concat()));
}

#[test]
fn a_global_is_set_during_the_run_as_an_integer_or_a_float() {
    let events = "[[event]]\nat = 3\nset = 0\nglobal = \"join\"\nnumber = -7\n\n\
        [[event]]\nat = 3\nset = 1\nglobal = \"join\"\nnumber = 2.5\n\n\
        [[event]]\nat = 3\nset = \"flies\"\nglobal = \"join\"\nnumber = 100000\n\n\
        [[event]]\nat = 3\nset = 2\nglobal = \"t\"\nnumber = 5.0\n\n";
    let expects = [
        equals(5, "0", "join", "-7"),
        equals(5, "0", "whole", "1"),
        // `init` has run before.
        equals(5, "0", "doubled", "2"),
        equals(5, "1", "join", "2.5"),
        equals(5, "1", "whole", "0"),
        equals(5, "\"flies\"", "join", "100000"),
        // Also one that held a table, which is garbage then.
        equals(5, "2", "t", "5"),
        equals(10, "2", "n", "99"),
    ];
    run("globals_later", &(events.to_owned() + &expects.concat()));
}

#[test]
fn each_robot_gets_its_own_number() {
    let events = "[[event]]\nat = 3\nset = [2, \"flies\", 0]\nglobal = \"join\"\nnumbers = [-7, 2.5, 100]\n\n\
        [[event]]\nat = 3\nset = \"kilobot\"\nglobal = \"n\"\nnumbers = [500, nan, 0]\n\n\
        [[event]]\nat = 4\njoin = \"late\"\n\n";
    let expects = [
        // The order is that of the scenario, whatever that of the list of robots is.
        equals(5, "0", "join", "-7"),
        equals(5, "2", "join", "2.5"),
        equals(5, "\"flies\"", "join", "100"),
        equals(5, "1", "join", "1"),
        equals(5, "0", "whole", "1"),
        equals(5, "2", "whole", "0"),
        // Seventy steps after the event; the other robot has counted all of its own.
        equals(10, "0", "n", "570"),
        equals(10, "1", "n", "99"),
        equals(10, "2", "n", "70"),
    ];
    run("globals_each", &(events.to_owned() + &expects.concat()));
}

#[test]
fn a_batch_reads_quantities_after_each_tick() {
    let setup = simulation("globals_batch", "").setup().clone();
    let probe = setup.probe(&Quantity::parse("global.n").unwrap()).unwrap();
    let mut seen = Vec::new();
    let mut read = |run: &Simulation| seen.push((run.now(), run.numbers(&probe)[0]));
    let summary = complete_watched(&setup, 1, || false, &mut read).unwrap().unwrap();
    assert_eq!(summary.ticks, 100);
    let ticks: Vec<u64> = seen.iter().map(|(tick, _)| *tick).collect();
    assert_eq!(ticks, (0..=100).collect::<Vec<u64>>());
    // The global code and `init` take the first tick.
    assert_eq!((seen[0].1, seen[1].1, seen[100].1), (None, Some(0.0), Some(99.0)));
}

#[test]
fn late_and_restarted_robots_start_with_the_script_value() {
    let events = "[[event]]\nat = 3\nset = \"all\"\nglobal = \"join\"\nnumber = 9\n\n\
        [[event]]\nat = 5\njoin = \"late\"\n\n\
        [[event]]\nat = 5\nrestart = 2\n\n";
    let expects = [
        equals(10, "[0, 1]", "join", "9"),
        equals(10, "2", "join", "1"),
        equals(10, "\"late\"", "join", "1"),
    ];
    run("globals_joined", &(events.to_owned() + &expects.concat()));
}

#[test]
fn a_loaded_script_keeps_globals_on_request() {
    let events = "[[event]]\nat = 3\nset = 1\nglobal = \"half\"\nnumber = 0.25\n\n\
        [[event]]\nat = 5\nload = [0, 1]\nscript = \"next.bzz\"\nkeep = true\n\n\
        [[event]]\nat = 5\nload = 2\nscript = \"next.bzz\"\nkeep = false\n\n\
        [[event]]\nat = 7\nrestart = 1\n\n";
    let expects = [
        // `init` sets `n` to 2000 before the number of the old script comes back, which had 49 steps.
        equals(6, "[0, 1]", "n", "58"),
        equals(6, "0", "half", "0.5"),
        equals(6, "1", "half", "0.25"),
        equals(6, "0", "new", "4"),
        // The old one was a table; the new ones are a table and a function, and stay so.
        equals(6, "0", "t", "3"),
        equals(6, "0", "join.now", "6"),
        // Not asked, or begun anew.
        equals(6, "2", "n", "2009"),
        equals(6, "2", "half", "7.5"),
        equals(10, "1", "n", "2029"),
        equals(10, "1", "half", "7.5"),
    ];
    run("globals_kept", &(events.to_owned() + &expects.concat()));
}

#[test]
fn a_session_with_settings_replays_and_goes_back() {
    let commands = [
        (0, "set = \"all\"\nglobal = \"join\"\nnumber = 3"),
        (20, "set = [0, 2]\nglobal = \"n\"\nnumber = 500"),
        (40, "load = \"kilobot\"\nscript = \"next.bzz\"\nkeep = true"),
        (41, "set = \"kilobot\"\nglobal = \"half\"\nnumber = 1.5"),
        (45, "set = \"kilobot\"\nglobal = \"half\"\nnumbers = [0.25, nan, 3]"),
    ];
    let mut session = Session::new(simulation("globals_session", ""), 10);
    for tick in 0..60 {
        let due = commands.iter().filter(|(at, _)| *at == tick);
        due.for_each(|(_, text)| session.command(text).unwrap());
        session.tick().unwrap();
    }
    let digest = session.run().digest();
    let mut replayed = simulation("globals_session", &session.run().commands());
    while replayed.now() < 60 {
        replayed.tick().unwrap();
    }
    assert_eq!(replayed.digest(), digest);
    // At tick 41 the new scripts have not run `init` yet, at 42 they have.
    for tick in [0, 1, 20, 21, 40, 41, 42, 45, 46] {
        session.go_to(tick).unwrap();
        session.go_to(60).unwrap();
        assert_eq!(session.run().digest(), digest, "back to {tick}");
    }
}

fn printed(errors: &[ScenarioError]) -> Vec<String> {
    let place = |error: &ScenarioError| match &error.place {
        Some(place) => format!("{}:{}", place.line, place.column),
        None => "-".to_owned(),
    };
    let errors = errors.iter();
    errors.map(|one| format!("{} {one} | {}", place(one), one.help().unwrap_or_default())).collect()
}

#[test]
fn globals_that_no_script_has_are_errors() {
    let folder = folder("globals_unknown", &[("counts.bzz", COUNTS)]);
    let event = "[[event]]\nat = 3\nset = \"all\"\nglobal = \"jion\"\nnumber = 3\n";
    let (scenario, programs) = read(&folder, &[WORLD, event].concat());
    let Err(SetupError::Scenario(errors)) = Setup::new(scenario, programs) else { panic!() };
    let line = WORLD.lines().count() + 4;
    let expected = format!("{line}:10 no script has a global `jion` | did you mean `join`?");
    assert_eq!(printed(&errors), [expected]);
    let mut live = simulation("globals_unknown_too", "");
    let errors = live.command("set = 0\nglobal = \"jion\"\nnumber = 3").unwrap_err();
    assert_eq!(printed(&errors), ["- no script has a global `jion` | did you mean `join`?"]);
    assert_eq!(live.commands(), "");
}

#[test]
fn an_error_explains_why_a_global_cannot_be_set() {
    let folder = folder("globals_refused", &[("counts.bzz", COUNTS)]);
    for (event, expected) in [
        ("set = 0\nglobal = \"join\"", "this [[event]] has no `number`"),
        ("set = 0\nnumber = 1", "this [[event]] has no `global`"),
        ("set = 0\nglobal = 5\nnumber = 1", "`global` must be a string, not an integer"),
        ("set = 0\nglobal = \"join\"\nnumber = \"1\"", "`number` must be a number, not a string"),
        // A Kilobot's integers have 16 bits, its floats an exponent up to 31; a Crazyflie's numbers have 32 bits.
        ("set = \"all\"\nglobal = \"join\"\nnumber = 32768", "`number` cannot be 32768"),
        ("set = 0\nglobal = \"join\"\nnumber = -4.3e9", "`number` cannot be -4300000000"),
        (
            "set = \"flies\"\nglobal = \"join\"\nnumber = 2147483648",
            "`number` cannot be 2147483648",
        ),
        ("set = \"flies\"\nglobal = \"join\"\nnumber = nan", "`number` cannot be NaN"),
        (
            "set = [0, 1]\nglobal = \"join\"\nnumbers = [1]",
            "`numbers` must be a list with one number for each robot, not a list of 1",
        ),
        ("set = 0\nglobal = \"join\"\nnumbers = 1", "`numbers` must be a list, not an integer"),
        ("set = 0\nglobal = \"join\"\nnumbers = [true]", "`numbers` must be a number"),
        (
            "set = \"all\"\nglobal = \"join\"\nnumbers = [1, 2, 32768, 3, 4]",
            "`numbers` cannot be 32768",
        ),
        ("set = 0\nglobal = \"join\"\nnumber = 1\nnumbers = [1]", "`number`"),
        ("fail = 0\nnumbers = [1]", "`numbers` means nothing without `set`"),
        (
            "set = 0\nglobal = \"join\"\nnumber = 1\nscript = \"counts.bzz\"",
            "`script` means nothing without `load`",
        ),
        (
            "load = 0\nscript = \"counts.bzz\"\nkeep = 1",
            "`keep` must be true or false, not an integer",
        ),
        ("fail = 0\nkeep = true", "`keep` means nothing without `load`"),
    ] {
        let text = format!("{WORLD}[[event]]\nat = 3\n{event}\n");
        let models = bittybuzz_robot_models::all();
        let errors = Scenario::parse(&text, "test.toml", &folder, &[], &models).unwrap_err();
        assert!(errors[0].to_string().contains(expected), "{event}: {:?}", printed(&errors));
    }
    for number in ["32767", "-32768", "-4290772992.0"] {
        let mut live = simulation("globals_fit", "");
        live.command(&format!("set = 0\nglobal = \"join\"\nnumber = {number}")).unwrap();
        live.tick().unwrap();
    }
}

/// `reset_count` is called before the step at 5 s, in one robot of a kind whose script calls it never, and `goal` has no value but
/// that of the event.
const CALLED: &str = "n = 0 calls = 0 before = -1\n\
    function reset_count() { before = n n = 0 calls = calls + 1 }\n\
    function step() { n = n + 1 if(goal) far = goal }\n";

fn called(test: &str, script: &str, events: &str) -> Simulation {
    let folder = folder(test, &[("counts.bzz", script), ("next.bzz", NEXT)]);
    let (scenario, programs) = read(&folder, &[WORLD, events].concat());
    let setup = Setup::new(scenario, programs).unwrap().with_compiler(Arc::new(program));
    Simulation::new(Arc::new(setup), 1, 1).unwrap()
}

fn all_hold(mut simulation: Simulation) {
    while !simulation.is_over() {
        simulation.tick().unwrap();
    }
    let summary = simulation.summary();
    assert!(summary.is_success(), "{:?}\n{:?}", summary.convergences, summary.faults);
}

#[test]
fn an_event_calls_a_function_of_the_script() {
    // The first step of a robot is in its second tick: the step at 5 s is the 50th.
    let events = "[[event]]\nat = 5\ncall = [1, \"flies\"]\nfunction = \"reset_count\"\n\n\
        [[event]]\nat = 5\ncall = 1\nfunction = \"reset_count\"\n\n\
        [[event]]\nat = 7\nset = \"all\"\nglobal = \"goal\"\nnumber = 3\n\n";
    let expects = [
        equals(10, "[1, \"flies\"]", "calls", "1"),
        equals(10, "[1, \"flies\"]", "before", "49"),
        equals(10, "[1, \"flies\"]", "n", "50"),
        equals(10, "[0, 2]", "calls", "0"),
        equals(10, "[0, 2]", "n", "99"),
        equals(10, "[0, 1, 2]", "far", "3"),
    ];
    all_hold(called("globals_call", CALLED, &(events.to_owned() + &expects.concat())));
}

/// A call at the start comes after `init`, and before the first step.
#[test]
fn a_call_at_the_start_comes_after_init() {
    let script = "order = 0\nfunction init() { order = order * 10 + 1 }\n\
        function begin() { order = order * 10 + 2 }\nfunction step() { if(order < 100) order = order * 10 + 3 }\n";
    let events = "[[event]]\nat = 0\ncall = \"all\"\nfunction = \"begin\"\n\n";
    let expects = equals(1, "[0, 1, 2]", "order", "123");
    all_hold(called("globals_call_first", script, &(events.to_owned() + &expects)));
}

#[test]
fn functions_that_no_script_has_are_errors() {
    let folder = folder("globals_no_function", &[("counts.bzz", CALLED), ("next.bzz", NEXT)]);
    let event = "[[event]]\nat = 5\ncall = 1\nfunction = \"reset_cuont\"\n";
    let (scenario, programs) = read(&folder, &[WORLD, event].concat());
    let Err(SetupError::Scenario(errors)) = Setup::new(scenario, programs) else {
        panic!("accepted")
    };
    let text = printed(&errors).join("\n");
    assert!(text.contains("no script of these robots has a function `reset_cuont`"), "{text}");
    // A session has the functions of the scenario's events.
    let event = "[[event]]\nat = 9\ncall = 1\nfunction = \"reset_count\"\n";
    let mut simulation = called("globals_call_session", CALLED, event);
    assert!(simulation.command("call = 0\nfunction = \"reset_count\"").is_ok());
    assert!(simulation.command("call = 0\nfunction = \"step\"").is_err());
    let errors = simulation.command("call = 0").unwrap_err();
    assert!(printed(&errors).join("\n").contains("`function`"), "{:?}", printed(&errors));
}
