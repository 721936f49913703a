//! Steps of scripts: how often they come, and what becomes of those that take too long.

#![allow(clippy::unwrap_used, reason = "what fails here fails the test")]

mod script;

use bittybuzz_arena::run::Verdict;
use script::{folder, run};

/// The third step of robot 1 never ends.
const ENDLESS: &str = "\
n = 0
function step() {
  n = n + 1
  if(n == 3 and id == 1)
    while(1) {
      n = 4
    }
}
";

fn world(robot: &str, more: &str) -> String {
    format!(
        "[world]\nsize = [1000, 1000]\nduration = 10\n[[robots]]\nrobot = \"{robot}\"\nscript = \"s.bzz\"\n{more}"
    )
}

/// The third step begins in tick 3; those of ticks 4 to 99 are left out.
#[test]
fn steps_that_take_too_long_are_counted() {
    let folder = folder("overruns", &[("s.bzz", ENDLESS)]);
    let expects = "[[expect]]\nat = 10\nrobots = 1\nvalue = \"overruns\"\nequals = 96\n\
                   [[expect]]\nat = 0.4\nvalue = \"overruns\"\nequals = 0\n\
                   [[expect]]\nat = 0.5\nvalue = \"overruns\"\nof = \"sum\"\nequals = 1\n\
                   [[expect]]\nat = 10\nvalue = \"overruns\"\nof = \"sum\"\nequals = 96\n";
    for robot in ["kilobot", "zooids"] {
        let summary = run(&folder, &world(robot, &format!("count = 3\n{expects}")));
        for (number, found) in summary.convergences.iter().enumerate() {
            assert_eq!(found.verdict, Verdict::Held, "{robot} {number}: {found:?}");
        }
        let overruns = &summary.overruns;
        assert_eq!((overruns.missed, overruns.robots), (96, 1));
        let (first, overrun) = overruns.first.as_ref().unwrap();
        assert_eq!((*first, overrun.tick), (1, 4));
        assert!(overrun.position.is_some());
    }
}

/// A robot that is switched off and on has overrun twice; its first was the earlier one.
#[test]
fn overruns_before_a_restart_stay_counted() {
    let folder = folder("overruns_restart", &[("s.bzz", ENDLESS)]);
    // Switched on in tick 50: the third step begins in tick 53, and 46 are left out from tick 54 on; before, those of 4 to 49.
    let summary = run(&folder, &world("kilobot", "count = 2\n[[event]]\nat = 5\nrestart = 1\n"));
    assert_eq!((summary.overruns.missed, summary.overruns.robots), (46 + 46, 2));
    assert_eq!(summary.overruns.first.map(|(robot, overrun)| (robot, overrun.tick)), Some((1, 4)));
}

#[test]
fn waiting_is_no_overrun() {
    let script = "function step() { delay(350) }\n";
    let folder = folder("overruns_delay", &[("s.bzz", script)]);
    let summary = run(&folder, &world("kilobot", ""));
    assert_eq!(summary.overruns, Default::default());
}
