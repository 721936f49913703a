//! Steps of scripts: how often they come, and what becomes of those that take too long.

use std::path::Path;

use crate::script::{folder, run};
use bittybuzz_arena::run::Verdict;
use bittybuzz_arena::scenario::Scenario;

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
fn waiting_does_not_count_as_an_overrun() {
    let script = "function step() { delay(350) }\n";
    let folder = folder("overruns_delay", &[("s.bzz", script)]);
    let summary = run(&folder, &world("kilobot", ""));
    assert_eq!(summary.overruns, Default::default());
}

/// A robot file with that many steps per second.
fn rated(hz: u32) -> String {
    format!(
        "name = \"mine\"\ntick_hz = {hz}\n\n[body]\ndrive = \"unicycle\"\nradius_mm = 30\nspeed_mm_s = 100\nturn_deg_s = 90\n"
    )
}

/// Global code and `init` are due in tick 0, then a step in every second, fifth or tenth tick, to tick 99. A robot that is switched
/// on in tick 3 counts from there: five steps per second are those of ticks 5, 7 to 99.
#[test]
fn the_robot_file_sets_the_step_rate() {
    for (hz, from_start, from_tick_3) in [(10, 99, 96), (5, 49, 48), (2, 19, 19), (1, 9, 9)] {
        let scripts = [("s.bzz", "function step() { }\n"), ("mine.toml", &rated(hz))];
        let folder = folder(&format!("rate_{hz}"), &scripts);
        let more = format!(
            "positions = [[0, 0], [100, 0]]\n[[event]]\nat = 0.3\nrestart = 1\n\
             [[expect]]\nat = 10\nrobots = 0\nvalue = \"steps\"\nequals = {from_start}\n\
             [[expect]]\nat = 10\nrobots = 1\nvalue = \"steps\"\nequals = {from_tick_3}\n"
        );
        let summary = run(&folder, &world("mine.toml", &more));
        for found in &summary.convergences {
            assert_eq!(found.verdict, Verdict::Held, "{hz}: {found:?}");
        }
        assert_eq!(summary.overruns, Default::default(), "{hz}");
    }
}

/// At two steps per second the steps are those of ticks 5, 10 and 15, of which the last never ends.
#[test]
fn a_slow_robot_misses_only_due_steps() {
    let script = "n = 0\nfunction step() { n = n + 1 if(n == 3) while(1) n = 4 }\n";
    let folder = folder("rate_slow", &[("s.bzz", script), ("mine.toml", &rated(2))]);
    let summary = run(&folder, &world("mine.toml", ""));
    // Ticks 20, 25 to 95.
    assert_eq!(summary.overruns.missed, 16);
    assert_eq!(summary.overruns.first.map(|(_, overrun)| overrun.tick), Some(20));
}

#[test]
fn steps_between_two_ticks_are_refused() {
    for hz in [3, 4, 20, 100] {
        let scripts = [("s.bzz", "function step() { }\n"), ("mine.toml", &rated(hz))];
        let folder = folder(&format!("rate_{hz}"), &scripts);
        let text = world("mine.toml", "");
        let models = bittybuzz_robot_models::all();
        let errors =
            Scenario::parse(&text, "s.toml", Path::new(&folder), &[], &models).unwrap_err();
        let [error] = errors.as_slice() else { panic!("{errors:#?}") };
        let place = error.place.as_ref().map(|place| (place.line, place.column));
        assert_eq!(place, Some((5, 9)), "{error}");
        assert!(error.to_string().contains(&format!("asks for {hz} steps per second")), "{error}");
        let help = error.help().unwrap_or_default();
        assert!(help.contains("`tick_hz` can be one of 10, 5, 2, 1"), "{help}");
    }
}
