//! Messages to which no listener waits take no room from others.

use crate::script::{folder, run};

/// Robots on a link without loss, with room for few messages.
const ROBOT: &str = r#"
name = "mine"
[vm]
slots = 1000
in_queue = 10
in_long = 2
out_queue = 40
out_long = 16
[body]
drive = "unicycle"
radius_mm = 30
speed_mm_s = 100
turn_deg_s = 90
[[sensor]]
name = "radio"
kind = "range-and-bearing"
range_mm = 2000
"#;

/// In each step, each of nine robots sends three numbers and two tables on a topic of its own, to which nobody listens. Robot 0
/// also sends a number and a table to all others.
const SCRIPT: &str = r#"
numbers = 0
tables = 0
sent = 0
function init() {
  neighbors.listen("number", function(topic, value, robot) { numbers = numbers + 1 })
  neighbors.listen("table", function(topic, value, robot) { tables = tables + value.x })
}
function step() {
  if(id == 0) {
    sent = sent + 1
    neighbors.broadcast("number", sent)
    neighbors.broadcast("table", { .x = 1, .y = sent, .z = "a long text, so that the table takes several frames", .w = "and more" })
  }
  t = string.concat("private ", string.tostring(id))
  i = 0
  while(i < 3) {
    neighbors.broadcast("other", sent + i)
    neighbors.broadcast(t, { .x = i, .y = 0 })
    i = i + 1
  }
}
"#;

#[test]
fn messages_to_which_no_listener_waits_displace_no_others() {
    let folder = folder("listeners", &[("s.bzz", SCRIPT), ("mine.toml", ROBOT)]);
    let summary = run(
        &folder,
        "[world]\nsize = [4000, 4000]\nduration = 20\n\
         [[robots]]\nrobot = \"mine.toml\"\nscript = \"s.bzz\"\ncount = 9\n\
         placement = \"circle\"\nradius = 500\n\
         [output]\nplot = [\"global.numbers\", \"global.tables\", \"neighbors\", \"global.sent\"]\n",
    );
    assert!(summary.faults.is_empty(), "{:?}", summary.faults);
    let [numbers, tables, neighbors, sent] =
        [0, 1, 2, 3].map(|place| summary.values[place].expect("the script has the global"));
    // The means include robot 0, which receives none of its own messages, and is the only one that counts them.
    let sent = sent[0] * 8.0;
    assert!(numbers[0] >= 0.98 * sent, "{} of {sent} numbers", numbers[0]);
    assert!(tables[0] >= 0.98 * sent, "{} of {sent} tables", tables[0]);
    // Robots stay known by messages without a listener.
    assert_eq!(neighbors[1], 8.0);
}
