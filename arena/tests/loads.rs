//! Scripts that events and commands load into robots during a run.

use std::fs;
use std::sync::Arc;

use crate::script::{folder, program, read, run};
use bittybuzz_arena::robot::{Piece, ProgramId};
use bittybuzz_arena::run::{Setup, Simulation, Verdict};

/// Counts up from 0, and says so.
const FIRST: &str = "n = 0 heard = 0\n\
    function init() { neighbors.listen(\"n\", function(topic, value, robot) { heard = heard + 1 }) }\n\
    function step() { n = n + 1 neighbors.broadcast(\"n\", n) if(n == 9) log(\"first\") }\n";

/// Counts down from 0. No string of it is one of the first script, so that texts of the one are not found in the other.
const SECOND: &str = "below = 0 got = 0\n\
    function init() { neighbors.listen(\"down\", function(topic, value, robot) { got = got + 1 }) }\n\
    function step() { below = below - 1 neighbors.broadcast(\"down\", below) if(below == 0 - 5) log(\"second\") }\n";

const WORLD: &str = "[world]\nsize = [600, 600]\nduration = 10\n\n\
    [[robots]]\nrobot = \"kilobot\"\nscript = \"first.bzz\"\nclock_skew = 0\ncount = 3\nplacement = \"line\"\nspacing = 50\n\n\
    [[robots]]\nrobot = \"kilobot\"\nname = \"late\"\nscript = \"first.bzz\"\nclock_skew = 0\nat = [200, 200]\npresent = false\n\n\
    [medium.ir]\nloss = 0\n\n";

fn texts(event: &str) -> String {
    [WORLD, event].concat()
}

#[test]
fn robots_run_the_script_that_an_event_loads() {
    let folder = folder("loads_event", &[("first.bzz", FIRST), ("second.bzz", SECOND)]);
    let text = texts(
        "[[event]]\nat = 4\nload = [1, 2, \"late\"]\nscript = \"second.bzz\"\n\n\
         [[event]]\nat = 5\njoin = \"late\"\n\n\
         [[event]]\nat = 7\nrestart = 2\n\n\
         [[expect]]\nat = 10\nrobots = 0\nvalue = \"global.n\"\nequals = 99\n\n\
         [[expect]]\nat = 10\nrobots = 1\nvalue = \"global.below\"\nequals = -59\n\n\
         [[expect]]\nat = 10\nrobots = 2\nvalue = \"global.below\"\nequals = -29\n\n\
         [[expect]]\nat = 10\nrobots = 3\nvalue = \"global.below\"\nequals = -49\n\n\
         [[expect]]\nat = 10\nrobots = 1\nvalue = \"global.n\"\nof = \"all\"\nexists = false\n\n\
         [[expect]]\nat = 10\nrobots = [1, 2]\nvalue = \"global.got\"\nabove = 3\n",
    );
    let (scenario, programs) = read(&folder, &text);
    let scripts: Vec<_> = scenario.programs().map(|(group, _)| group.name.clone()).collect();
    assert_eq!(scripts, ["kilobot", "late", "kilobot", "late"]);
    let setup = Arc::new(Setup::new(scenario, programs).unwrap());
    let mut simulation = Simulation::new(setup.clone(), 1, 1).unwrap();
    let mut log = Vec::new();
    while !simulation.is_over() {
        simulation.tick().unwrap();
        log.extend(simulation.take_log());
    }
    let summary = simulation.summary();
    for (convergence, expect) in summary.convergences.iter().zip(&setup.scenario.expects) {
        assert_eq!(convergence.verdict, Verdict::Held, "{expect}");
    }
    assert!(summary.unusable.foreign > 0, "robots with unlike scripts hear each other");
    // Each line is known with its script, before and after.
    let lines: Vec<(usize, &str)> = log
        .iter()
        .map(|(robot, line)| {
            let [Piece::Constant(number)] = *line.pieces else { panic!("{line:?}") };
            (*robot, setup.program(line.program).unwrap().string(number).unwrap())
        })
        .collect();
    let count = |text| lines.iter().filter(|(_, known)| *known == text).count();
    assert_eq!((count("first"), count("second")), (3, 4), "{lines:?}");
}

/// A line that nobody has taken yet is still one of the script that has logged it.
#[test]
fn a_waiting_log_line_keeps_its_script() {
    let folder = folder("loads_lines", &[("first.bzz", FIRST), ("second.bzz", SECOND)]);
    let text = texts("[[event]]\nat = 4\nload = \"all\"\nscript = \"second.bzz\"\n");
    let (scenario, programs) = read(&folder, &text);
    let setup = Arc::new(Setup::new(scenario, programs).unwrap());
    let mut simulation = Simulation::new(setup.clone(), 1, 1).unwrap();
    while !simulation.is_over() {
        simulation.tick().unwrap();
    }
    let of_first_robot: Vec<(u64, ProgramId)> = simulation
        .take_log()
        .iter()
        .filter(|(robot, _)| *robot == 0)
        .map(|(_, line)| (line.tick, line.program))
        .collect();
    assert_eq!(of_first_robot, [(9, ProgramId(0)), (45, ProgramId(2))]);
}

#[test]
fn a_fault_names_its_program() {
    let bad = "function step() { x = nothing + 1 }\n";
    let folder = folder("loads_faults", &[("first.bzz", FIRST), ("bad.bzz", bad)]);
    let summary = run(&folder, &texts("[[event]]\nat = 4\nload = 1\nscript = \"bad.bzz\"\n"));
    let programs: Vec<_> =
        summary.faults.iter().map(|fault| (fault.robot, fault.record.program)).collect();
    assert_eq!(programs, [(1, ProgramId(2))]);
}

#[test]
fn an_event_may_load_the_script_of_the_group_again() {
    let folder = folder("loads_own", &[("first.bzz", FIRST), ("second.bzz", SECOND)]);
    let text = texts(
        "[[event]]\nat = 2\nload = 0\nscript = \"second.bzz\"\n\n\
         [[event]]\nat = 6\nload = 0\nscript = \"first.bzz\"\n\n\
         [[expect]]\nat = 10\nrobots = 0\nvalue = \"global.n\"\nequals = 39\n",
    );
    let (scenario, programs) = read(&folder, &text);
    assert_eq!(programs.len(), 3);
    let mut simulation = Simulation::new(Arc::new(Setup::new(scenario, programs).unwrap()), 1, 1);
    let simulation = simulation.as_mut().unwrap();
    (0..100).for_each(|_| simulation.tick().unwrap());
    assert!(simulation.summary().is_success());
    assert!(simulation.program(0).global("n").is_some());
}

/// What is looked for has a name in the script that a command has brought.
#[test]
fn expectations_read_globals_of_a_loaded_script() {
    let both = "below = nil n = 0 function step() { n = n + 1 }\n";
    let folder = folder("loads_command", &[("first.bzz", both), ("second.bzz", SECOND)]);
    let expect = "[[expect]]\nat = 10\nrobots = 1\nvalue = \"global.below\"\nequals = -69\n\n\
        [output]\nplot = [\"global.below\"]\n";
    let (scenario, programs) = read(&folder, &texts(expect));
    let setup = Setup::new(scenario, programs).unwrap().with_compiler(Arc::new(program));
    let mut simulation = Simulation::new(Arc::new(setup), 1, 1).unwrap();
    (0..30).for_each(|_| simulation.tick().unwrap());
    simulation.command("load = 1\nscript = \"second.bzz\"").unwrap();
    (0..70).for_each(|_| simulation.tick().unwrap());
    let summary = simulation.summary();
    assert!(summary.is_success(), "{summary:#?}");
    assert_eq!(summary.values, [Some([-69.0; 3])]);
}

#[test]
fn scripts_that_cannot_be_loaded_change_nothing() {
    let scripts = [
        ("first.bzz", FIRST),
        ("second.bzz", SECOND),
        ("broken.bzz", "function step() { fly() }\n"),
        ("changing.bzz", "a = 1\n"),
    ];
    let folder = folder("loads_refused", &scripts);
    let (scenario, programs) = read(&folder, WORLD);
    let bare = Setup::new(scenario, programs).unwrap();
    let mut simulation = Simulation::new(Arc::new(bare.clone()), 1, 1).unwrap();
    let printed = |simulation: &mut Simulation, text: &str| -> String {
        let errors = simulation.command(text).unwrap_err();
        errors.iter().map(|error| format!("{error}\n{:?}\n", error.help())).collect()
    };
    let text = "load = 0\nscript = \"second.bzz\"";
    assert!(printed(&mut simulation, text).contains("nothing compiles scripts in this run"));
    let setup = bare.with_compiler(Arc::new(program));
    let mut simulation = Simulation::new(Arc::new(setup), 1, 1).unwrap();
    let digest = simulation.digest();
    for (text, reason) in [
        ("load = 0", "`script`"),
        ("script = \"second.bzz\"", "one of"),
        ("fail = 0\nscript = \"second.bzz\"", "`script` means nothing without `load`"),
        ("load = 9\nscript = \"second.bzz\"", "there is no robot 9"),
        ("load = 0\nscript = \"missing.bzz\"", "missing.bzz` cannot be loaded"),
        ("load = 0\nscript = \"broken.bzz\"", "there is no function `fly`"),
    ] {
        let printed = printed(&mut simulation, text);
        assert!(printed.contains(reason), "{text}: {printed}");
    }
    assert_eq!((simulation.commands().as_str(), simulation.digest()), ("", digest));
    let text = "load = 0\nscript = \"changing.bzz\"";
    simulation.command(text).unwrap();
    // The same again has the same text.
    simulation.command(text).unwrap();
    fs::write(folder.join("changing.bzz"), "a = 2\n").unwrap();
    assert!(printed(&mut simulation, text).contains("has changed since it was loaded"));
    assert_eq!(simulation.commands().matches("[[event]]").count(), 2);
}

#[test]
fn events_with_missing_scripts_are_refused() {
    let folder = folder("loads_missing", &[("first.bzz", FIRST), ("second.bzz", SECOND)]);
    let text = texts("[[event]]\nat = 1\nload = 0\nscript = \"secund.bzz\"\n");
    let read = bittybuzz_arena::scenario::Scenario::parse(
        &text,
        "test.toml",
        &folder,
        &[],
        &bittybuzz_robot_models::all(),
    );
    let errors = read.unwrap_err();
    let [error] = &*errors else { panic!("{errors:#?}") };
    assert_eq!(error.to_string(), "cannot read `secund.bzz`: there is no such file");
    assert_eq!(error.help().as_deref(), Some("did you mean `second.bzz`?"));
    assert_eq!(error.place.as_ref().unwrap().line, 27);
}
