//! The longest slice of scripts that do what takes longest, on the images of Crazyflie and Zooid, as the robots' own
//! clocks count it.

use crate::figures::{self, SLICE_TOLERANCE};
use bittybuzz_hil::{Swarm, Table, TraceLog};
use bittybuzz_runtime::script::SLICE_MAX;

/// Scripts, in which `PAIRS` stands for as many entries as nearly fill the memory of the robot, `TABLES` for as many
/// tables, and `ITEMS` for as many numbers as fit a message.
const SCRIPTS: [(&str, &str); 11] = [
    ("loop", "function step() { i = 0 while(i < 1000) i = i + 1 }"),
    (
        "maths",
        "function step() { i = 0 while(i < 100) { x = math.tan(1.2) x = math.asin(0.7) x = math.acos(0.6) i = i + 1 } }",
    ),
    (
        "pairs",
        "t = {}
        function init() { i = 1 while(i < PAIRS) { t[0 - i] = 1 i = i + 1 } }
        function step() {
          i = 0
          while(i < 50) { t[0 - PAIRS] = 1 size(t) t[0 - PAIRS] = nil x = t[0 - PAIRS] i = i + 1 }
        }",
    ),
    (
        "foreach",
        "t = {}
        function init() { i = 1 while(i < PAIRS) { t[0 - i] = 1 i = i + 1 } }
        function step() { foreach(t, function(key, value) { }) }",
    ),
    (
        "garbage",
        "keep = {}
        function init() { i = 0 while(i < TABLES) { keep[i] = { .a = i, .b = i } i = i + 1 } }
        function step() { i = 0 while(i < 100) { t = { .x = i, .y = { .z = i } } i = i + 1 } }",
    ),
    // The machine looks at the clock seldom, and then a collection comes.
    (
        "seldom",
        "keep = {}
        function init() { i = 0 while(i < TABLES) { keep[i] = { .a = i, .b = i } i = i + 1 } }
        function step() {
          i = 0
          while(i < 100) {
            x = i * 2 + 1  y = x * 2 + 1  z = y * 2 + 1  x = y * 2 + z  y = x + y * z
            t = {}
            i = i + 1
          }
        }",
    ),
    // Searches in as many cells as the quick loop follows, which takes no look at the clock, and then a collection.
    (
        "fields",
        "keep = {}
        t = {}
        a = {}
        function init() {
          t.a = 1 t.b = 1 t.c = 1 t.d = 1 t.e = 1 t.f = 1 t.g = 1
          t.h = 1 t.i = 1 t.j = 1 t.k = 1 t.l = 1 t.m = 1 t.n = 1
          i = 0
          while(i < 96) { a[i] = i i = i + 1 }
          i = 0
          while(i < TABLES - 24) { keep[i] = { .a = i, .b = i } i = i + 1 }
        }
        function step() {
          i = 0
          while(i < 100) {
            x = t.n  a[95] = t.n  t.n = a[95]  x = t.n  a[95] = t.n  t.n = a[95]  x = t.n  a[95] = t.n
            t.n = a[95]  x = t.n  a[95] = t.n
            y = {}
            i = i + 1
          }
        }",
    ),
    (
        "messages",
        "a = {}
        function init() {
          s = stigmergy.create(1)
          i = 0
          while(i < ITEMS) { a[i] = 300 + i i = i + 1 }
        }
        function step() { i = 0 while(i < 20) { s.put(1, a) neighbors.broadcast(\"a\", a) i = i + 1 } }",
    ),
    // No frame is like one that waits, so each is compared with all of them and displaces one.
    (
        "other messages",
        "a = {}
        n = 0
        function init() { i = 0 while(i < ITEMS) { a[i] = 300 + i i = i + 1 } }
        function step() {
          i = 0
          while(i < 20) {
            a[0] = 300 + n
            neighbors.broadcast(\"a\", a)
            neighbors.broadcast(\"b\", a)
            n = (n + 1) % 3000
            i = i + 1
          }
        }",
    ),
    (
        "log of a table",
        "t = {}
        function init() { i = 1 while(i < PAIRS) { t[0 - i] = 1 i = i + 1 } }
        function step() { log(t) }",
    ),
    (
        "log that names a table ten times",
        "t = {}
        function init() { i = 1 while(i < PAIRS) { t[0 - i] = 1 i = i + 1 } }
        function step() { log(t, t, t, t, t, t, t, t, t, t) }",
    ),
];

/// Scripts for a robot with much memory and with text: they keep most of the memory, and make garbage in the rest. `LIVE`
/// stands for nearly as many cells as there are.
const LARGE_SCRIPTS: [(&str, &str); 12] = [
    (
        "list",
        "head = nil
        function init() { i = 0 while(i < LIVE) { head = { .n = i, .next = head } i = i + 1 } }
        function step() { i = 0 while(i < 100) { t = { .x = i, .y = { .z = i } } i = i + 1 } }",
    ),
    (
        "array",
        "t = {}
        function init() { i = 0 while(i < WIDTH) { t[i] = 1 i = i + 1 } i = 1 while(i < WIDTH - 1) { t[i] = nil i = i + 1 } }
        function step() { t[WIDTH - 1] = 2 size(t) foreach(t, function(k, v) { }) t[WIDTH - 1] = nil t[WIDTH - 1] = 1 }",
    ),
    (
        "text keys",
        "t = {}
        a = \"0123456789\"
        function init() {
          a = string.concat(a, a, a, a, a)
          a = string.concat(a, a, a, a, a)
          i = 10
          while(i < 44) { t[string.concat(a, \"abc\", string.tostring(i))] = i i = i + 1 }
        }
        function step() {
          i = 10
          while(i < 40) { k = string.concat(a, \"abc\", string.tostring(43)) t[k] = t[k] + 1 x = t[\"none\"] i = i + 1 }
        }",
    ),
    (
        "texts",
        "keep = {}
        a = \"0123456789\"
        function init() {
          a = string.concat(a, a, a, a, a)
          a = string.concat(a, a, a, a, a, \"01234\")
          i = 0
          while(i < LIVE - 60) { keep[i] = { .a = i, .b = i } i = i + 1 }
        }
        function step() { i = 0 while(i < 10) { x = string.concat(\"\", a) y = string.sub(x, 1, 250) z = x == y i = i + 1 } }",
    ),
    (
        "calls",
        "keep = {}
        function init() { i = 0 while(i < LIVE - 40) { keep[i] = { .a = i, .b = i } i = i + 1 } }
        function deep(n) { var t = { .n = n } if(n > 0) { var u = deep(n - 1) return u } return t }
        function step() { i = 0 while(i < 20) { deep(12) f = function(x) { return i + x } f(1) i = i + 1 } }",
    ),
    (
        "iterations",
        "keep = {}
        function init() { i = 0 while(i < 160) { keep[0 - i] = { .a = i, .get = function() { return self } } i = i + 1 } }
        function step() { foreach(keep, function(k, v) { t = { .k = v.get } }) map(keep, function(k, v) { return k }) }",
    ),
    (
        "entries",
        "a = {}
        function init() {
          s = stigmergy.create(1)
          i = 0
          while(i < 30) { a[i] = 300 + i i = i + 1 }
          i = 0
          while(i < 60) { s.put(i, a) i = i + 1 }
          n = 0
        }
        function step() { a[0] = n s.put(n % 60, a) n = n + 1 foreach(s.get(1), function(k, v) { }) }",
    ),
    (
        "full store",
        "function init() {
          s = stigmergy.create(1)
          i = 0
          while(i < 255) { s.put(i, 1000 + i) i = i + 1 }
        }
        function step() {
          i = 0
          while(i < 20) { s.put(254, i) s.get(254) s.size() s.get(300) i = i + 1 }
          s.foreach(function(k, v, r) { })
          s.put(100, nil) s.put(100, 1)
        }",
    ),
    (
        "text keys of entries",
        "a = \"0123456789\"
        function init() {
          s = stigmergy.create(1)
          a = string.concat(a, a, a, a, a)
          a = string.concat(a, a, a, a)
          i = 10
          while(i < 50) { s.put(string.concat(a, \"abc\", string.tostring(i)), i) i = i + 1 }
        }
        function step() {
          i = 10
          while(i < 40) { k = string.concat(a, \"abc\", string.tostring(49)) s.put(k, i) s.get(k) i = i + 1 }
        }",
    ),
    (
        "parts of the longest text",
        "a = \"0123456789\"
        function init() {
          a = string.concat(a, a, a, a, a, a, a, a, a, a)
          a = string.concat(a, a, a, a, a, a, a, a, a, a)
        }
        function step() { i = 0 while(i < 10) { x = string.sub(a, 1) y = string.concat(x, \"1\") i = i + 1 } }",
    ),
    (
        "order of the longest texts",
        "a = \"0123456789\"
        function init() {
          a = string.concat(a, a, a, a, a, a, a, a, a, a)
          a = string.concat(a, a, a, a, a, a, a, a, a, a)
          b = string.concat(string.sub(a, 0, 999), \"x\")
        }
        function step() { i = 0 while(i < 10) { x = a < b x = a == b i = i + 1 } }",
    ),
    (
        "numbers in the longest text",
        "a = \"0000000000\"
        function init() {
          a = string.concat(a, a, a, a, a, a, a, a, a, a)
          a = string.concat(a, a, a, a, a, a, a, a, a, a)
        }
        function step() { i = 0 while(i < 10) { x = string.toint(a) x = string.tofloat(a) i = i + 1 } }",
    ),
];

fn text(script: &str, [pairs, tables, items]: [u16; 3]) -> String {
    let script = script.replace("PAIRS", &pairs.to_string());
    script.replace("TABLES", &tables.to_string()).replace("ITEMS", &items.to_string())
}

/// The time after which a Crazyflie has made 20 steps and reported its longest slice.
const CRAZYFLIE_MS: u64 = 4_500;

/// The time in µs of a sample of a Crazyflie's flight task, which interrupts slices once per millisecond.
const FLIGHT_US: u64 = 145;

/// Returns the longest slice, in µs, of a robot that reports it after the first steps. Tasks of a
/// higher priority interrupt a slice for at most `interruption_us`.
fn longest_slice(name: &str, trace_log: &TraceLog, interruption_us: u64) -> u64 {
    let is_overrun = |record: &String| record.starts_with("Overrun");
    assert!(trace_log.records.iter().all(is_overrun), "{name}: {:?}", trace_log.records);
    let longest = trace_log.firmware.iter().rev().find_map(|line| {
        let (_, rest) = line.split_once("longest slice ")?;
        rest.split(' ').next()?.parse().ok()
    });
    let longest = longest.unwrap_or_else(|| panic!("{name}: no status line"));
    println!("{name}: longest slice {longest} us");
    let most = SLICE_MAX.as_micros() + interruption_us;
    assert!((1..=most).contains(&longest), "{name}: {longest} us");
    longest
}

#[test]
#[ignore = "soak"]
fn slices_of_a_crazyflie_are_short() {
    let slices = [&SCRIPTS[..], &LARGE_SCRIPTS].concat().into_iter().map(|(name, script)| {
        let script = script.replace("LIVE", "420").replace("WIDTH", "2700");
        let mut swarm = Swarm::crazyflies(&text(&script, [1340, 390, 34]), &[1]);
        swarm.run_ms(CRAZYFLIE_MS);
        (name, longest_slice(name, &swarm.members()[0].trace_log, FLIGHT_US))
    });
    let slices: Vec<_> = slices.collect();
    figures::check("crazyflie", "slices_us", &slices, SLICE_TOLERANCE);
}

#[test]
fn slices_of_a_zooid_are_short() {
    let slices = SCRIPTS.map(|(name, script)| {
        let mut table = Table::new(&text(script, [110, 40, 5]), &[1]);
        table.run_ms(10_200);
        (name, longest_slice(name, &table.zooids()[0].trace_log, 0))
    });
    figures::check("zooids", "slices_us", &slices, SLICE_TOLERANCE);
}
