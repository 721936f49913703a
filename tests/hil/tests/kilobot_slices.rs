//! The longest turn of a Kilobot's loop, in cycles that the emulator counts, while scripts do what takes longest: a turn
//! is a slice of the script and everything else that the robot does.

use crate::figures;
use bittybuzz_hil::Kilobots;

/// Fills the memory but for a little, and then makes garbage all the time. The number of turns of the inner loop changes, so
/// that collections begin at all moments of a slice: otherwise the longest turn would depend on a coincidence.
const GARBAGE: &str = "\
function init() {
  keep = {}
  i = 0
  while(i < 10) {
    keep[i] = { .a = i, .b = i }
    i = i + 1
  }
  pause = 0
}
function step() {
  i = 0
  while(i < 100) {
    t = { .x = i, .y = { .z = i } }
    pause = (pause * 5 + 3) % 16
    j = 0
    while(j < pause) j = j + 1
    i = i + 1
  }
}
";

/// Each instruction on the table looks through all of it.
const TABLES: &str = "\
function init() {
  t = {}
  i = 1
  while(i < 60) {
    t[0 - i] = 1
    i = i + 1
  }
}
function step() {
  i = 0
  while(i < 50) {
    t[0 - 60] = 1
    size(t)
    t[0 - 60] = nil
    i = i + 1
  }
}
";

const FLOATS: &str = "\
function step() {
  i = 0
  while(i < 50) {
    x = 1.5 % 0.7
    x = x / 1.3
    i = i + 1
  }
}
";

const LOOP: &str = "\
function step() {
  i = 0
  while(i < 500) i = i + 1
}
";

/// A slice ends at the first instruction that begins later than 480 µs after it.
const SLICE: u64 = 3840;
/// Everything else that the robot does in a turn, and interrupts.
const REST: u64 = 800;

fn longest_turn(script: &str) -> u64 {
    let mut robots = Kilobots::new(script, 1);
    robots.start();
    robots.run_ms(500);
    // The start of the script is left out: it takes the check of the image as well.
    robots.longest_turn(0);
    robots.run_ms(20_000);
    robots.longest_turn(0)
}

/// A turn takes as long as a slice, the rest, and one instruction; the longest of each script is that of
/// docs/instruction-set.md, or a collection of the whole memory.
#[test]
fn a_turn_is_a_slice_and_one_instruction() {
    let slices = [
        ("loop", LOOP, 200),
        ("floats", FLOATS, 2_100),
        ("tables", TABLES, 7_000),
        ("garbage", GARBAGE, 12_000),
    ]
    .map(|(name, script, instruction)| {
        let longest = longest_turn(script);
        println!("{name}: {longest} cycles, {} us", longest / 8);
        assert!(longest > SLICE && longest <= SLICE + REST + instruction, "{name}: {longest}");
        (name, longest / 8)
    });
    // In another folder of the sources the image differs, and these figures by up to 2 in 1,000.
    figures::check("kilobot", "slices_us", &slices, 10);
}
