//! A tick of a copy of a run is read statement by statement, and the run is the same.

use std::sync::Arc;

use crate::busy::{rest, setup};
use crate::script::{folder, read};
use bittybuzz_arena::robot::checks::{WatchStop, WatchedTick};
use bittybuzz_arena::run::{Session, Setup, Simulation};
use bittybuzz_inspect::{Inspection, Limits, ScriptValue};

/// A script with `init`, a loop, a call, and a listener.
const SCRIPT: &str = "\
heard = 0
total = 0
function add(a) {
  var b = a + 1
  return b
}
function init() {
  neighbors.listen(\"n\", function(topic, value) {
    heard = value
  })
}
function step() {
  for(i = 0, i < 2, i = i + 1) {
    total = add(total)
  }
  neighbors.broadcast(\"n\", 7)
}
";

const WORLD: &str = "\
[world]
size = [2000, 2000]
duration = 5

[[robots]]
robot = \"footbot\"
script = \"walk.bzz\"
positions = [[0, 0], [500, 0]]
";

/// Simulates the next tick in a copy, with a watch on a robot.
fn look(run: &Simulation, robot: usize, stop: WatchStop) -> Option<WatchedTick> {
    let mut copy = run.snapshot().unwrap();
    copy.watch_statements(robot, stop);
    copy.tick().unwrap();
    copy.take_statements(robot)
}

/// Returns the lines of the statements of the next tick, in their order.
fn lines(run: &Simulation, robot: usize) -> Vec<u32> {
    let symbols = run.program(robot).symbols.clone().unwrap();
    let tick = look(run, robot, WatchStop::Never).unwrap();
    let line = |position| symbols.statement(position).unwrap().line;
    tick.statements.iter().map(|statement| line(statement.position)).collect()
}

fn global(found: &Inspection, name: &str) -> ScriptValue {
    found.globals.iter().find(|global| global.name == name).unwrap().value.clone()
}

fn begin(name: &str) -> Simulation {
    let folder = folder(name, &[("walk.bzz", SCRIPT)]);
    let (scenario, programs) = read(&folder, WORLD);
    let setup = Arc::new(Setup::new(scenario, programs).unwrap());
    Simulation::new(setup, 1, 1).unwrap()
}

#[test]
fn a_tick_has_its_statements_in_order() {
    let mut run = begin("statements_order");
    // The global code, `init`, then nothing else in the first tick.
    assert_eq!(lines(&run, 0), [1, 2, 8]);
    run.tick().unwrap();
    // The condition of the loop comes before each turn and after the last one.
    let step = [13, 13, 14, 4, 5, 13, 13, 14, 4, 5, 13, 13, 16];
    assert_eq!(lines(&run, 0), step);
    let mut has_heard = false;
    for _ in 0..10 {
        run.tick().unwrap();
        let lines = lines(&run, 0);
        // A message is handled before the step.
        let (handled, stepped) = lines.split_at(lines.len() - step.len());
        assert_eq!(stepped, step);
        assert!(handled.iter().all(|line| *line == 9), "{handled:?}");
        has_heard |= !handled.is_empty();
    }
    assert!(has_heard);
}

#[test]
fn the_machine_is_read_before_a_statement() {
    let mut run = begin("statements_content");
    run.tick().unwrap();
    let at = |number| look(&run, 0, WatchStop::Number(number, Limits::NONE));
    // `return b` of the second call.
    let found = at(9).unwrap();
    assert_eq!(found.statements.len(), 10);
    let content = found.content.unwrap();
    assert_eq!(global(&content, "total"), ScriptValue::Int(1));
    let locals: Vec<_> =
        content.frames[0].locals.iter().map(|one| (&*one.name, one.value.clone())).collect();
    assert!(locals.contains(&("a", ScriptValue::Int(1))), "{locals:?}");
    assert!(locals.contains(&("b", ScriptValue::Int(2))), "{locals:?}");
    let depths: Vec<usize> = found.statements.iter().map(|statement| statement.depth).collect();
    assert!(depths[9] > depths[7] && depths[7] == depths[0], "{depths:?}");
    assert!(at(12).is_some() && at(13).is_none());
}

#[test]
fn a_robot_that_does_not_exist_has_no_statements() {
    let run = begin("statements_absent");
    assert!(look(&run, 99, WatchStop::Never).is_none());
}

/// Runs a world with a watch on another robot in each tick, and compares it with the same world without.
fn watches_change_nothing_in(setup: &Arc<Setup>) {
    let expected = rest(&mut Simulation::new(setup.clone(), 5, 1).unwrap());
    let mut session = Session::new(Simulation::new(setup.clone(), 5, 1).unwrap(), 4);
    let mut seen = 0;
    for (tick, (digest, lines)) in expected.into_iter().enumerate() {
        let robot = tick % session.run().robot_count();
        look(session.run(), robot, WatchStop::Number(tick % 5, Limits::NONE));
        // The run itself is watched, too.
        session.watch_statements(robot, WatchStop::Never);
        session.tick().unwrap();
        seen += session.take_statements(robot).map_or(0, |found| found.statements.len());
        assert_eq!((session.run().digest(), session.take_log()), (digest, lines));
    }
    assert!(seen > 100, "{seen}");
}

#[test]
fn watches_change_nothing() {
    watches_change_nothing_in(&setup("statements_same", ""));
}

#[test]
fn watches_change_nothing_in_scripts_that_are_checked() {
    let checked = Arc::into_inner(setup("statements_checked", "")).unwrap().checked(|_| None);
    watches_change_nothing_in(&Arc::new(checked));
}

/// Instructions and text use up the budget of a tick, so that a step lasts for several.
#[test]
fn watches_do_not_change_the_budget() {
    let script = "s = \"0123456789\" n = 0\nfunction step() {\n  n = n + 1\n  var i = 0\n\
                  while(i < 3000) { i = i + 1 var t = string.concat(s, s, s) }\n  log(n)\n}\n";
    let folder = folder("statements_budget", &[("walk.bzz", script)]);
    let (scenario, programs) = read(&folder, &WORLD.replace("footbot", "crazyflie"));
    let setup = Arc::new(Setup::new(scenario, programs).unwrap());
    let mut run = Simulation::new(setup.clone(), 1, 1).unwrap();
    rest(&mut run);
    assert!(run.summary().overruns.missed > 10, "a step takes longer than a tick");
    watches_change_nothing_in(&setup);
}
