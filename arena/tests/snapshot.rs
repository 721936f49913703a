//! A snapshot goes on as the run does from which it was taken.

use crate::busy::{rest, setup};
use bittybuzz_arena::run::Simulation;

fn run_to(simulation: &mut Simulation, tick: u64) {
    while simulation.now() < tick {
        simulation.tick().unwrap();
    }
}

#[test]
fn a_snapshot_continues_like_its_run() {
    let setup = setup("snapshot", "");
    let new = || Simulation::new(setup.clone(), 5, 1).unwrap();
    let mut whole = new();
    let expected = rest(&mut whole);
    let summary = format!("{:?}", whole.summary());
    // Something was logged, faults came, and messages arrived: the comparison is about something.
    assert!(expected.iter().any(|(_, lines)| !lines.is_empty()));
    assert!(whole.summary().fault_counts.faults > 0);
    for tick in 0..whole.end() {
        let mut first = new();
        for tick in 0..tick {
            run_to(&mut first, tick + 1);
            first.take_log();
        }
        let mut copy = first.snapshot().unwrap();
        // The first goes on beside its copy, and neither disturbs the other.
        let seen = rest(&mut first);
        assert_eq!(rest(&mut copy), seen, "copied after {tick} ticks");
        assert_eq!(seen, expected[tick as usize..], "{tick} ticks");
        assert_eq!(format!("{:?}", copy.summary()), summary);
    }
}

#[test]
fn a_snapshot_keeps_unread_log_lines() {
    let mut run = Simulation::new(setup("snapshot-log", ""), 5, 1).unwrap();
    run_to(&mut run, 60);
    let mut copy = run.snapshot().unwrap();
    let lines = copy.take_log();
    assert!(!lines.is_empty());
    assert_eq!(run.take_log(), lines);
}

#[test]
fn a_snapshot_of_a_snapshot_on_several_threads() {
    let setup = setup("snapshot-threads", "");
    let mut whole = Simulation::new(setup.clone(), 5, 1).unwrap();
    let expected = rest(&mut whole);
    let mut run = Simulation::new(setup, 5, 3).unwrap();
    while !run.is_over() {
        run.tick().unwrap();
        let lines = run.take_log();
        assert_eq!((run.digest(), lines), expected[run.now() as usize - 1]);
        run = run.snapshot().unwrap();
    }
}
