//! Robots without a chip, which have the memory of a computer.

use crate::script::{folder, run};
use bittybuzz_arena::run::{Summary, Verdict};

/// A robot as `bbz stubs` writes it.
const ROBOT: &str = "name = \"mine\"\n\n\
    [body]\ndrive = \"differential\"\nradius_mm = 50\nwheel_distance_mm = 80\nspeed_mm_s = 200\n\n\
    [[sensor]]\nname = \"radio\"\nkind = \"range-and-bearing\"\nrange_mm = 1000\n\n\
    [[function]]\nname = \"beep\"\naccepts = [\"n: any\"]\nlogs = true\nhelp = \"a test\"\n";

/// Runs a script on that many robots, all in reach of each other.
fn run_on(name: &str, count: u32, duration: u32, script: &str, more: &str) -> Summary {
    let folder = folder(name, &[("s.bzz", script), ("mine.toml", ROBOT)]);
    let text = format!(
        "[world]\nsize = [2000, 2000]\nduration = {duration}\n\
         [[robots]]\nrobot = \"mine.toml\"\nscript = \"s.bzz\"\ncount = {count}\n\
         placement = \"circle\"\nradius = 300\n{more}"
    );
    let summary = run(&folder, &text);
    assert!(summary.faults.is_empty(), "{:?}", summary.faults);
    summary
}

#[track_caller]
fn holds(summary: &Summary) {
    for convergence in &summary.convergences {
        assert_eq!(convergence.verdict, Verdict::Held, "{convergence:?}");
    }
    assert!(!summary.convergences.is_empty());
}

/// 30 nodes with two tables each are 30 * 2 + 1 tables, of at least one cell of 7 slots each: more
/// than the 400 slots of small chips.
#[test]
fn lists_and_graphs_of_students_fit() {
    let script = "nodes = {}
        for(i = 0, i < 30, i = i + 1) nodes[i] = { .at = i * 2, .next = {} }
        for(i = 0, i < 30, i = i + 1) nodes[i].next[0] = (i + 1) % 30
        # A list of 300 elements, a queue that goes through the graph breadth first.
        list = nil
        for(i = 0, i < 300, i = i + 1) list = { .value = i, .next = list }
        sum = 0
        seen = {}
        queue = { .0 = 0 }
        function step() {
          sum = 0
          var node = list
          while(node != nil) { sum = sum + node.value node = node.next }
          var first = 0
          queue = { .0 = 0 }
          seen = {}
          while(queue[first] != nil) {
            var at = queue[first]
            first = first + 1
            if(seen[at] == nil) {
              seen[at] = 1
              foreach(nodes[at].next, function(k, next) { queue[size(queue)] = next })
            }
          }
          visited = size(seen)
        }";
    // 0 + 1 + ... + 299 = 299 * 300 / 2.
    let expect = "[[expect]]\nat = 2\nvalue = \"global.sum\"\nequals = 44850\n\
        [[expect]]\nat = 2\nvalue = \"global.visited\"\nequals = 30\n";
    holds(&run_on("computer_graph", 1, 2, script, expect));
}

/// Ten robots send three messages in each of 10 steps per second: each receives 27 per step, more
/// than a queue for ten frames takes.
#[test]
fn three_topics_per_step_of_ten_robots_fit_the_queues() {
    let script = "heard = 0
        function init() {
          foreach({ .0 = \"load\", .1 = \"role\", .2 = \"task\" }, function(i, topic) {
            neighbors.listen(topic, function(t, v, r) { heard = heard + 1 })
          })
        }
        steps = 0
        function step() {
          steps = steps + 1
          neighbors.broadcast(\"load\", id)
          neighbors.broadcast(\"role\", steps)
          neighbors.broadcast(\"task\", steps % 7)
        }";
    let summary = run_on("computer_queue", 10, 20, script, "");
    assert_eq!(summary.dropped, [0, 0]);
}

/// Each robot writes every tenth cell of a map.
fn map(side: u32) -> String {
    format!(
        "cells = stigmergy.create(1)
        next = 0
        known = 0
        wrong = 0
        steps = 0
        function init() {{}}
        function step() {{
          var n = 0
          while(n < 4 and next < {cells}) {{
            if(next % 10 == id % 10) cells.put(next, next * 3)
            next = next + 1
            n = n + 1
          }}
          known = cells.size()
          steps = steps + 1
          if(steps % 100 == 0) {{
            wrong = 0
            cells.foreach(function(key, value, robot) {{
              if(value != key * 3 or robot % 10 != key % 10) wrong = wrong + 1
            }})
          }}
        }}",
        cells = side * side
    )
}

#[test]
fn maps_become_equal() {
    // Four cells per step are 3.6 s of writing for 144 cells, and 62.5 s for 2500.
    for (side, within) in [(12, 120), (50, 900)] {
        let expect = format!(
            "[[expect]]\nwithin = {within}\nvalue = \"global.known\"\nof = \"min\"\nequals = {}\n\
             [[expect]]\nat = {within}\nvalue = \"global.wrong\"\nof = \"max\"\nequals = 0\n",
            side * side
        );
        holds(&run_on(&format!("computer_map_{side}"), 10, within, &map(side), &expect));
    }
}

/// The index of entries agrees with a table, while keys of all types are put, deleted, forgotten
/// after a minute and put again.
#[test]
fn entries_are_those_of_a_table() {
    let script = "cells = stigmergy.create(1)
        others = stigmergy.create(7)
        model = {}
        steps = 0
        wrong = 0
        function key(n) {
          if(n % 3 == 0) return n
          if(n % 3 == 1) return n + 0.5
          return string.concat(\"key\", string.tostring(n))
        }
        function init() {}
        function step() {
          steps = steps + 1
          var i = 0
          while(i < 20) {
            var n = math.rng.uniform(0, 600)
            if(math.rng.uniform(0, 3) == 0) { cells.put(key(n), nil) model[n] = nil }
            else { cells.put(key(n), steps) model[n] = steps }
            others.put(n, n)
            i = i + 1
          }
          if(steps % 50 == 0) {
            var n = 0
            var count = 0
            while(n < 600) {
              if(cells.get(key(n)) != model[n]) wrong = wrong + 1
              if(others.get(n) != nil and others.get(n) != n) wrong = wrong + 1
              if(model[n] != nil) count = count + 1
              n = n + 1
            }
            if(count != cells.size()) wrong = wrong + 1
          }
        }";
    let expect = "[[expect]]\nat = 200\nvalue = \"global.wrong\"\nequals = 0\n\
        [[expect]]\nat = 200\nvalue = \"global.steps\"\nabove = 1000\n";
    holds(&run_on("computer_index", 1, 200, script, expect));
}

/// Without a chip, a file may state some of the sizes, up to those of the machine.
#[test]
fn the_largest_memory_runs() {
    let robot = format!("{ROBOT}\n[vm]\nslots = 60000\nneighbors = 10\nstigmergy_entries = 600\n");
    let script = "list = nil
        # 8,000 tables of 7 slots are 56,000 slots.
        function init() { for(i = 0, i < 8000, i = i + 1) list = { .next = list, .n = i } }
        function step() {}";
    let folder = folder("computer_largest", &[("s.bzz", script), ("mine.toml", &robot)]);
    let text = "[world]\nsize = [500, 500]\nduration = 5\n\
        [[robots]]\nrobot = \"mine.toml\"\nscript = \"s.bzz\"\ncount = 1\nplacement = \"random\"\n\
        [[expect]]\nat = 5\nvalue = \"global.i\"\nequals = 8000\n";
    let summary = run(&folder, text);
    assert!(summary.faults.is_empty(), "{:?}", summary.faults);
    holds(&summary);
}
