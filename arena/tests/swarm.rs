//! Measures of a swarm are what their formulas say, of configurations that are known.

use crate::script::{folder, read, run, run_with};
use bittybuzz_arena::engine::RobotView;
use bittybuzz_arena::output::{History, chart, metrics};
use bittybuzz_arena::run::Verdict;

const STILL: &str = "n = 0\nfunction step() { n = n + 1 neighbors.broadcast(\"n\", n) }\n";

/// Infrared with the range of the makers and no edge.
const SHARP: &str = "[medium.ir]\nrange = 70\nedge = 0\n";

/// Kilobots that stand still, and what must come of them after a second.
#[track_caller]
fn holds(test: &str, groups: &str, expects: &[&str]) {
    let folder = folder(&format!("swarm_{test}"), &[("s.bzz", STILL)]);
    let expects: Vec<String> =
        expects.iter().map(|expect| format!("[[expect]]\nat = 1\n{expect}\n")).collect();
    // Infrared ends sharply at 103 mm between the middles, unless a test says something else.
    let medium = if groups.contains("[medium.ir]") { "" } else { SHARP };
    let text = format!(
        "[world]\nsize = [2000, 2000]\nduration = 2\n{medium}{groups}\n{}",
        expects.concat()
    );
    let summary = run(&folder, &text);
    for (expect, found) in expects.iter().zip(&summary.convergences) {
        assert_eq!(found.verdict, Verdict::Held, "{expect}");
    }
}

fn group(more: &str) -> String {
    format!("[[robots]]\nrobot = \"kilobot\"\nscript = \"s.bzz\"\n{more}\n")
}

#[test]
fn a_circle() {
    // Eight on a circle of 200 mm: the nearest is at 2 * 200 * sin(22.5 degrees), out of reach of 103 mm.
    let circle = "count = 8\nplacement = \"circle\"\nradius = 200\nat = [50, -30]\nheading = 77";
    holds(
        "circle",
        &group(circle),
        &[
            "value = \"swarm.spread\"\nequals = 200\ntolerance = 0.01",
            "value = \"swarm.nearest\"\nequals = 153.0734\ntolerance = 0.01",
            "value = \"swarm.polarisation\"\nequals = 1\ntolerance = 0.0001",
            "value = \"swarm.contacts\"\nequals = 0",
            "value = \"swarm.components\"\nequals = 8",
            // Of a part of them: two neighbors.
            "robots = \"0..1\"\nvalue = \"swarm.spread\"\nequals = 76.5367\ntolerance = 0.01",
            "robots = \"0..1\"\nvalue = \"swarm.components\"\nequals = 2",
        ],
    );
    let within_reach = format!("{}[medium.ir]\nrange = 121\nedge = 0\n", group(circle));
    holds("wide_circle", &within_reach, &["value = \"swarm.components\"\nequals = 1"]);
}

#[test]
fn headings() {
    let at = |x: i32, heading: i32| group(&format!("positions = [[{x}, 0]]\nheading = {heading}"));
    let polarisation = |expected: f64| {
        format!("value = \"swarm.polarisation\"\nequals = {expected}\ntolerance = 0.0001")
    };
    let opposite = at(0, 30) + &at(200, -150);
    holds("opposite", &opposite, &[&polarisation(0.0)]);
    let star = at(0, 0) + &at(200, 120) + &at(400, -120);
    holds("star", &star, &[&polarisation(0.0)]);
    let right_angle = at(0, 0) + &at(200, 90);
    holds("right_angle", &right_angle, &[&polarisation(0.5_f64.sqrt())]);
    // No jump where angles wrap around.
    let west = at(0, 179) + &at(200, -179);
    holds("west", &west, &[&polarisation(1.0_f64.to_radians().cos())]);
}

#[test]
fn contacts_and_parts() {
    let line = |spacing: i32| {
        group(&format!("count = 5\nplacement = \"line\"\nat = [-200, 0]\nspacing = {spacing}"))
    };
    holds("touching", &line(33), &["value = \"swarm.contacts\"\nequals = 4"]);
    holds("apart", &line(36), &["value = \"swarm.contacts\"\nequals = 0"]);
    let parts = |count: u32| format!("value = \"swarm.components\"\nequals = {count}");
    holds("chain", &line(100), &[&parts(1)]);
    // Who has failed or been stopped passes nothing on, and is no part itself.
    let event = |event: &str| format!("{}[[event]]\nat = 0.5\n{event}\n", line(100));
    holds("failed", &event("fail = 2"), &[&parts(2)]);
    holds("stopped", &event("stop = 4"), &[&parts(1)]);
    holds("block", &event("block = [1, 2]"), &[&parts(2)]);
    holds("partition", &event("partition = [[0, 2], [1, 3]]"), &[&parts(5)]);
    // A link that only one end hears is none.
    let weak = line(100) + &group("positions = [[-300, 0]]\nlink = { range = 50 }");
    holds("weak", &weak, &[&parts(2)]);
    // Media are apart.
    let zooid = "[[robots]]\nrobot = \"zooids\"\nscript = \"s.bzz\"\npositions = [[-200, 60], [900, 900]]\n";
    holds("media", &(line(100) + zooid), &[&parts(2)]);
}

#[test]
fn measures_of_too_few_robots_are_absent() {
    holds(
        "one",
        &(group("positions = [[0, 0]]") + &group("name = \"away\"\ncount = 3\npresent = false")),
        &[
            "value = \"swarm.nearest\"\nexists = false",
            "value = \"swarm.spread\"\nequals = 0",
            "value = \"swarm.components\"\nequals = 1",
            "robots = \"away\"\nvalue = \"swarm.polarisation\"\nexists = false",
            "robots = \"away\"\nvalue = \"swarm.spread\"\nexists = false",
            "robots = \"away\"\nvalue = \"swarm.contacts\"\nequals = 0",
            "robots = \"away\"\nvalue = \"swarm.components\"\nequals = 0",
        ],
    );
}

/// Measured by all pairs.
#[test]
fn swarm_measures_agree_with_all_pairs() {
    let folder = folder("swarm_many", &[("s.bzz", STILL)]);
    let quantities = ["swarm.nearest", "swarm.contacts", "swarm.components"];
    let text = format!(
        "[world]\nsize = [1500, 1200]\nduration = 1\n{SHARP}{}{}[output]\nplot = {quantities:?}\n",
        group("count = 90\nplacement = \"random\""),
        group("count = 20\nplacement = \"line\"\nspacing = 33.5\nat = [-600, 583.5]"),
    );
    for seed in 0..5 {
        let text = text.replace("duration = 1\n", &format!("duration = 1\nseed = {seed}\n"));
        let mut views: Vec<RobotView> = Vec::new();
        let summary = run_with(&folder, &text, 1, |simulation| {
            views = (0..110).filter_map(|robot| simulation.view(robot)).collect();
        });
        let distance = |a: usize, b: usize| {
            let (a, b) = (views[a].pose, views[b].pose);
            f64::from(a.x - b.x).hypot(f64::from(a.y - b.y))
        };
        let mut nearest = 0.0;
        let mut contacts = 0;
        for a in 0..views.len() {
            let others = (0..views.len()).filter(|b| *b != a).map(|b| distance(a, b));
            let others: Vec<f64> = others.collect();
            nearest += others.iter().copied().fold(f64::MAX, f64::min) / views.len() as f64;
            contacts += others.iter().filter(|distance| **distance <= 34.0).count();
        }
        let mut part: Vec<usize> = (0..views.len()).collect();
        for a in 0..views.len() {
            for b in 0..views.len() {
                if distance(a, b) <= 103.0 && part[a] != part[b] {
                    let (old, new) = (part[b], part[a]);
                    part.iter_mut().filter(|part| **part == old).for_each(|part| *part = new);
                }
            }
        }
        part.sort_unstable();
        part.dedup();
        let found: Vec<f64> = summary.values.iter().map(|value| value.unwrap()[0]).collect();
        assert!((found[0] - nearest).abs() < 1e-3, "{found:?} {nearest}");
        assert_eq!(found[1..], [contacts as f64 / 2.0, part.len() as f64], "seed {seed}");
        assert!(contacts >= 38 && part.len() > 1);
    }
}

/// One column and one curve each.
#[test]
fn swarm_measures_appear_in_pictures_and_tables() {
    let folder = folder("swarm_table", &[("s.bzz", STILL)]);
    let text = format!(
        "[world]\nsize = [500, 500]\nduration = 1\n{}[output]\nevery = 0.1\nplot = [\"x\", \"swarm.spread\"]\n",
        group("count = 60\nplacement = \"grid\"\nspacing = 40")
    );
    let mut history = History::default();
    let summary = run_with(&folder, &text, 1, |simulation| history.sample(simulation));
    assert!(history.values[1].iter().all(|sample| sample.len() == 1));
    let picture = chart("swarm.spread", &history.times, &history.values[1]);
    // One curve, not the quartiles of many.
    assert_eq!(picture.matches("stroke-width=\"1.2\"").count(), 1);
    let (scenario, _) = read(&folder, &text);
    let columns = metrics::metrics(&scenario);
    let values = metrics::values(&scenario, &summary);
    assert_eq!(columns.len(), values.len());
    let names: Vec<&str> = columns.iter().map(|column| column.name.as_str()).collect();
    assert_eq!(names[2..7], ["mean x", "min x", "max x", "swarm.spread", "sent"]);
    // A grid of 8 by 8, the last row half full: 4 of 60 are missing; between that of 7 rows and that of 8.
    let of = |columns: f64, rows: f64| {
        40.0 * ((columns * columns - 1.0) / 12.0 + (rows * rows - 1.0) / 12.0).sqrt()
    };
    let spread = values[5].unwrap();
    assert!(spread > of(8.0, 7.0) && spread < of(8.0, 8.0), "{spread}");
}
