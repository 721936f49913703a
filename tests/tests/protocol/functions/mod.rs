//! Every function of `neighbors`, `swarm` and `stigmergy`, between two and more robots.

mod long;
mod neighbors;
mod stigmergy;
mod swarms;

use bittybuzz_testkit::{LARGE_SIZES, LARGE_SLOTS, SIZES, Swarm, TestRobot};
use bittybuzz_vm_core::Sizes;
use bittybuzz_vm_core::number::{Full, Profile, Tiny};

/// Runs a script on robots with ids 1, 2, ..., in both profiles, and compares what each printed last. Robots with much memory
/// print the same.
fn last(robots: usize, steps: usize, script: &str, expected: &[&str]) {
    run::<Tiny, 600>(robots, steps, script, SIZES, expected);
    run::<Full, 600>(robots, steps, script, SIZES, expected);
    run::<Full, LARGE_SLOTS>(robots, steps, script, LARGE_SIZES, expected);
    let mut swarm = Swarm::<Full, _, LARGE_SLOTS>::with_sizes(robots, script, LARGE_SIZES);
    swarm.robots.iter_mut().for_each(TestRobot::pause);
    swarm.steps(steps);
    assert_eq!(swarm.last(), expected, "in slices: {script}");
}

fn run<P: Profile, const SLOTS: usize>(
    robots: usize,
    steps: usize,
    script: &str,
    sizes: Sizes,
    expected: &[&str],
) {
    let mut swarm: Swarm<P, &'static [u8], SLOTS> = Swarm::with_sizes(robots, script, sizes);
    swarm.steps(steps);
    assert_eq!(swarm.last(), expected, "{}, {SLOTS} slots: {script}", P::NAME);
}

#[test]
fn duplicates_and_foreign_frames_are_ignored() {
    let script = "heard = 0
        function init() { v = stigmergy.create(1)  neighbors.listen(\"x\", function(t, x, r) { heard = heard + 1 }) }
        function step() { v.put(\"k\", id)  neighbors.broadcast(\"x\", 1)  log(heard) }";
    let mut swarm: Swarm<Tiny> = Swarm::new(2, script);
    let mut other: Swarm<Tiny> = Swarm::new(2, &format!("{script}\nlog(\"other\")"));
    swarm.air.duplication = 1.0;
    swarm.step();
    assert_eq!(other.robots[1].step(), Ok(()));
    let frames = other.robots[1].take_sent();
    assert!(!frames.is_empty());
    let count = frames.len();
    for frame in frames {
        swarm.inject(&frame, [0]);
    }
    // Too short, of no type, nothing at all.
    for bad in [vec![0x20, 1], vec![0xff; 10], vec![]] {
        swarm.inject(&bad, [0]);
    }
    swarm.step();
    assert_eq!(swarm.last(), ["2", "2"]);
    let counters = swarm.robots[0].counters();
    assert_eq!(usize::from(counters.foreign), count);
    assert_eq!(counters.malformed, 3);
}
