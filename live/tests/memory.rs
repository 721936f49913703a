//! The memory of a page with many robots. This is a process of its own, because it
//! measures itself.

#![allow(clippy::unwrap_used, reason = "what fails here fails the test")]
#![cfg(target_os = "linux")]

use std::fs;
use std::time::Duration;

use bittybuzz_arena::run::{COPIES_BYTES, Session};
use bittybuzz_live::{Live, SharedFiles, Shelf, Source};

/// A robot as `bbz stubs` writes it.
const ROBOT: &str = "name = \"rover\"\n\n\
    [body]\ndrive = \"differential\"\nradius_mm = 50\nwheel_distance_mm = 80\nspeed_mm_s = 200\n\n\
    [[sensor]]\nname = \"radio\"\nkind = \"range-and-bearing\"\nrange_mm = 1000\n\n\
    [[function]]\nname = \"wheels\"\naccepts = [\"left: number, right: number\"]\n\
    sets = { left_wheel = \"left\", right_wheel = \"right\" }\nhelp = \"speeds in mm/s\"\n";

/// Each robot makes garbage, sends numbers and tables, and shares its cell of a map.
const SCRIPT: &str = "heard = 0\n\
    function init() {\n\
    \x20 cells = stigmergy.create(1)\n\
    \x20 neighbors.listen(\"n\", function(t, v, r) { heard = heard + 1 })\n\
    \x20 neighbors.listen(\"place\", function(t, v, r) { heard = heard + v.x })\n\
    }\n\
    n = 0\n\
    function step() {\n\
    \x20 n = n + 1\n\
    \x20 wheels(100 + id % 50, 100)\n\
    \x20 var list = {}\n\
    \x20 for(i = 0, i < 30, i = i + 1) list[i] = { .at = i }\n\
    \x20 if(n % 5 == id % 5) neighbors.broadcast(\"n\", n)\n\
    \x20 if(n % 50 == id % 50) neighbors.broadcast(\"place\", { .x = n, .y = id })\n\
    \x20 if(n % 100 == id % 100) cells.put(id, n)\n\
    }\n";

/// After a minute the session has the most copies already. The memory at the end of five minutes is
/// the same.
const SCENARIO: &str = "[world]\nsize = [10000, 10000]\nduration = 60\n\n\
    [[robots]]\nrobot = \"rover.toml\"\nscript = \"rover.bzz\"\ncount = 200\nplacement = \"random\"\n";

/// Copies of the run that `bbz sim --view` keeps.
const COPIES: usize = 32;

/// Returns the largest resident memory of this process until now, in MB.
fn peak_mb() -> u64 {
    let status = fs::read_to_string("/proc/self/status").unwrap();
    let line = status.lines().find(|line| line.starts_with("VmHWM:")).unwrap();
    line.split_whitespace().nth(1).unwrap().parse::<u64>().unwrap() * 1024 / 1_000_000
}

/// Each robot keeps the content of its machine at its fault.
const FAILING: &str = "[world]\nsize = [10000, 10000]\nduration = 6\n\n\
    [[robots]]\nrobot = \"kilobot\"\nscript = \"fail.bzz\"\ncount = 2000\nplacement = \"random\"\n";

const FAIL: &str = "n = 0\nfunction step() { n = n + 1 if(n % 4 == 0) led(n / 0) }\n";

/// Room for the copies of that world.
const FEW_BYTES: usize = 60_000_000;

/// Crazyflies take the most memory: 16 MB, so that 32 copies would take 512 MB.
const CRAZYFLIES: &str = "[world]\nsize = [10000, 10000]\nduration = 10\n\n\
    [[robots]]\nrobot = \"crazyflie\"\nscript = \"count.bzz\"\ncount = 300\nplacement = \"random\"\n";

const COUNT: &str = "n = 0\nfunction step() { n = n + 1 }\n";

/// Plays a scenario to its end and returns the largest resident memory in MB before and after.
fn play(files: &SharedFiles, scenario: &str, bytes_max: usize) -> [u64; 2] {
    let (run, text) = Shelf::new(files.clone(), scenario.into()).open(2).unwrap();
    let before = peak_mb();
    let mut live = Live::new(Session::with_bytes(run, COPIES, bytes_max), text);
    live.request("{\"play\":{}}", Duration::ZERO);
    let mut now = 0;
    while !live.session().run().is_over() {
        let mut ticks = 0..1;
        live.advance(Duration::from_millis(now), &mut || ticks.next().is_some());
        live.take_sample();
        live.take_events();
        now += 100;
    }
    [before, peak_mb()]
}

/// Each world takes more than the one before, so that the peaks are apart.
#[test]
fn failing_robots_robots_without_a_chip_and_many_crazyflies_stay_within_their_memory() {
    let files = SharedFiles::default();
    files.add("rover.toml", ROBOT);
    files.add("rover.bzz", SCRIPT);
    files.add("rovers.toml", SCENARIO);
    files.add("count.bzz", COUNT);
    files.add("crazyflies.toml", CRAZYFLIES);
    files.add("fail.bzz", FAIL);
    files.add("failing.toml", FAILING);
    let [before, after] = play(&files, "failing.toml", FEW_BYTES);
    // Without the contents, the copies would take 68 MB.
    assert!(after < before + FEW_BYTES as u64 / 1_000_000, "{after} MB, {before} MB before");
    let [before, after] = play(&files, "rovers.toml", COPIES_BYTES);
    assert!(after < 200, "{after} MB, {before} MB of them before the first tick");
    let [before, after] = play(&files, "crazyflies.toml", COPIES_BYTES);
    let copies = COPIES_BYTES as u64 / 1_000_000;
    // The run itself was there before, and the copies fill most of their room.
    assert!(after > 200 && after < before + copies + 30, "{after} MB, {before} MB before");
}
