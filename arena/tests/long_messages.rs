//! Values that need several frames: of k frames, they arrive nearly as often as k single frames do, and under overload no fewer
//! arrive.
//!
//! The table in docs/testing.md is that of this test: `UPDATE_DOCS=1` writes it.

use std::fmt::Write as _;
use std::path::Path;
use std::{env, fs};

use crate::script::{folder, run};

/// Forms of a value, each with its frames in the profiles `tiny` and `full`. The first one is a single frame in both.
const FORMS: [(&str, &str, [u32; 2]); 6] = [
    ("integer", "n", [1, 1]),
    ("constant string", "\"word\"", [1, 1]),
    ("function", "answer", [2, 1]),
    ("table of 1", "{ .x = n }", [3, 1]),
    ("table of 2", "{ .x = n, .y = id }", [4, 1]),
    ("table of 4", "{ .x = n, .y = id, .z = 3, .w = 4 }", [6, 2]),
];

/// Robots on a circle on which all hear each other.
struct Circle {
    robot: &'static str,
    profile: usize,
    radius: u16,
    counts: &'static [usize],
    /// The steps between two broadcasts of a robot: the longest message of all robots together takes at most 60 % of the air
    /// and of what a robot may send, and seldom are more robots inside a message than a receiver has places.
    period: u32,
    seconds: u32,
    /// The entries for which a robot has room.
    entries: usize,
}

const CIRCLES: [Circle; 3] = [
    // More than eight Kilobots do not hear each other from everywhere.
    Circle {
        robot: "kilobot",
        profile: 0,
        radius: 45,
        counts: &[2, 4, 8],
        period: 80,
        seconds: 1600,
        entries: 4,
    },
    Circle {
        robot: "zooids",
        profile: 0,
        radius: 600,
        counts: &[2, 4, 8, 16],
        period: 10,
        seconds: 200,
        entries: 12,
    },
    Circle {
        robot: "crazyflie",
        profile: 1,
        radius: 600,
        counts: &[2, 4, 8, 16],
        period: 5,
        seconds: 100,
        entries: 64,
    },
];

/// The numbers of values that a robot received in the mean, and that arrived if all did.
fn received(circle: &Circle, count: usize, value: &str, period: u32) -> [f64; 2] {
    let Circle { robot, radius, seconds, .. } = circle;
    // The robots send one after the other, as far as there are steps.
    let apart = (period / count as u32).max(1);
    let script = format!(
        "got = 0
         sent = 0
         n = 0
         function answer(a) {{ return a }}
         function init() {{ neighbors.listen(\"topic\", function(topic, value, robot) {{ got = got + 1 }}) }}
         function step() {{
           n = n + 1
           if((n + id * {apart}) % {period} == 0) {{
             neighbors.broadcast(\"topic\", {value})
             sent = sent + 1
           }}
         }}"
    );
    let folder = folder(&format!("long-{robot}"), &[("s.bzz", &script)]);
    let summary = run(
        &folder,
        &format!(
            "[world]\nsize = [4000, 4000]\nduration = {seconds}\n\
             [[robots]]\nrobot = \"{robot}\"\nscript = \"s.bzz\"\ncount = {count}\n\
             placement = \"circle\"\nradius = {radius}\n\
             [output]\nplot = [\"global.got\", \"global.sent\"]\n"
        ),
    );
    let mean = |place: usize| summary.values[place].expect("the script has the global")[0];
    [mean(0), mean(1) * (count - 1) as f64]
}

/// Numbers of stigmergies that published scripts use.
const NUMBERS: [u16; 8] = [0, 1, 2, 3, 5, 20, 101, 200];

/// The frames of an entry with two numbers of a stigmergy after the first three, in the profiles `tiny` and `full`. Its content
/// has 12 bytes before the key: 12 + 2 * 3 = 18 in fragments of 6, and 12 + 2 * 5 = 22 in one of 45.
const FOURTH_FRAMES: [u32; 2] = [3, 1];

/// The share of puts whose values another robot gets before the next put. Each robot has a key of its own; `others` are the
/// stigmergies that the script creates before.
fn entries(circle: &Circle, count: usize, others: &[u16], number: u16) -> f64 {
    let Circle { robot, radius, seconds, .. } = circle;
    // Each robot that gets an entry sends it on, so that entries take more air than broadcasts.
    let period = 2 * circle.period;
    let apart = (period / count as u32).max(1);
    let others: String =
        others.iter().map(|other| format!("stigmergy.create({other})\n")).collect();
    let script = format!(
        "got = 0
         sent = 0
         n = 0
         known = {{}}
         function init() {{ {others} s = stigmergy.create({number}) }}
         function step() {{
           n = n + 1
           s.foreach(function(key, value, robot) {{
             if(key != id and known[key] != value) {{
               known[key] = value
               got = got + 1
             }}
           }})
           if((n + id * {apart}) % {period} == 0) {{
             s.put(id, n)
             sent = sent + 1
           }}
         }}"
    );
    let folder = folder(&format!("entries-{robot}"), &[("s.bzz", &script)]);
    let summary = run(
        &folder,
        &format!(
            "[world]\nsize = [4000, 4000]\nduration = {seconds}\n\
             [[robots]]\nrobot = \"{robot}\"\nscript = \"s.bzz\"\ncount = {count}\n\
             placement = \"circle\"\nradius = {radius}\n\
             [output]\nplot = [\"global.got\", \"global.sent\"]\n"
        ),
    );
    let mean = |place: usize| summary.values[place].expect("the script has the global")[0];
    mean(0) / (mean(1) * (count - 1) as f64)
}

/// Returns the smallest share of puts that arrive, over these numbers of a stigmergy: as the only one, and as the fourth one.
/// Adds a line to `too_few` if one is smaller than that of as many single frames.
fn least_entries(
    circle: &Circle,
    count: usize,
    numbers: &[u16],
    single: f64,
    too_few: &mut String,
) -> [f64; 2] {
    let fourth = FOURTH_FRAMES[circle.profile];
    [(&[][..], 1), (&[301, 302, 303], fourth)].map(|(others, frames)| {
        let share = |number: &u16| {
            let share = entries(circle, count, others, *number);
            if share < 0.9 * single.powf(frames.into()) {
                let (robot, place) = (circle.robot, others.len() + 1);
                writeln!(
                    too_few,
                    "{count} {robot}: entries of number {number} in place {place}: {share:.3}, single frames {single:.3}"
                )
                .unwrap();
            }
            share
        };
        numbers.iter().map(share).fold(1.0, f64::min)
    })
}

const DOCS: &str = "../docs/testing.md";
const BEGIN: &str = "<!-- arena/tests/long_messages.rs -->\n";
const END: &str = "<!-- end -->\n";

#[test]
fn messages_of_k_frames_arrive_nearly_as_often_as_k_frames() {
    let names = FORMS.map(|(name, ..)| name).join(" | ");
    let entries = "entry | entry of a 4th stigmergy";
    let mut table =
        format!("| Robots | {names} | {entries} |\n|---{}|\n", "|---".repeat(FORMS.len() + 2));
    let mut too_few = String::new();
    for circle in &CIRCLES {
        for &count in circle.counts {
            let mut single = None;
            write!(table, "| {count} {} ", circle.robot).unwrap();
            for (name, value, frames) in FORMS {
                let [got, all] = received(circle, count, value, circle.period);
                let share = got / all;
                let frames = frames[circle.profile];
                let single = *single.get_or_insert(share);
                if share < 0.9 * single.powf(frames.into()) {
                    writeln!(
                        too_few,
                        "{count} {}: {name}: {share:.3}, single frames {single:.3}",
                        circle.robot
                    )
                    .unwrap();
                }
                write!(table, "| {:.0} % ", 100.0 * share).unwrap();
            }
            let numbers = if count == 4 { &NUMBERS[..] } else { &[101] };
            let has_room = count <= circle.entries;
            for share in single
                .filter(|_| has_room)
                .map(|single| least_entries(circle, count, numbers, single, &mut too_few))
                .into_iter()
                .flatten()
            {
                write!(table, "| {:.0} % ", 100.0 * share).unwrap();
            }
            table += if has_room { "|\n" } else { "| | |\n" };
        }
    }
    assert_eq!(too_few, "", "\n{table}");
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(DOCS);
    let text = fs::read_to_string(&path).unwrap();
    let (before, rest) = text.split_once(BEGIN).expect("docs/testing.md has the table");
    let (shown, after) = rest.split_once(END).expect("the table has an end");
    if env::var_os("UPDATE_DOCS").is_some() {
        fs::write(&path, [before, BEGIN, &table, END, after].concat()).unwrap();
    } else {
        assert_eq!(shown, table, "docs/testing.md: write the table with UPDATE_DOCS=1");
    }
}

/// Loads from far below to far above what the swarm can carry: as more is sent, the number of values that arrive does not fall
/// below 70 % of the most.
#[test]
fn more_messages_than_the_swarm_can_carry_do_not_reduce_what_arrives() {
    let loads: [(usize, usize, &[u32]); 3] = [
        (0, 8, &[160, 80, 40, 20, 10, 5]),
        (1, 16, &[20, 10, 5, 2, 1]),
        (2, 16, &[20, 10, 5, 2, 1]),
    ];
    for (circle, count, periods) in loads {
        let circle = Circle { seconds: CIRCLES[circle].seconds / 4, ..CIRCLES[circle] };
        for (name, value, _) in &FORMS[2..] {
            let mut most = 0.0_f64;
            for &period in periods {
                let [got, _] = received(&circle, count, value, period);
                most = most.max(got);
                assert!(
                    got >= 0.7 * most,
                    "{count} {}, {name} each {period} steps: {got:.1} arrive, {most:.1} when less is sent",
                    circle.robot
                );
            }
        }
    }
}

/// A robot that shares a stigmergy late gets all entries of the other one. Each takes a digest and four frames, 2.5 s at two frames
/// per second, so that all four are sent ten times in 100 s. The queue has room for only one of them at a time.
#[test]
fn a_robot_that_comes_late_gets_all_long_entries() {
    let script = "t = 0
        size = 0
        function step() {
          t = t + 1
          if(t == 1 and id == 0) {
            s = stigmergy.create(1)
            k = 0
            while(k < 4) { s.put(k, { .x = k }) k = k + 1 }
          }
          if(t == 300 and id == 1) s = stigmergy.create(1)
          if(t > 300) size = s.size()
        }";
    let folder = folder("late", &[("s.bzz", script)]);
    for seed in 1..=20 {
        let summary = run(
            &folder,
            &format!(
                "[world]\nsize = [1000, 1000]\nduration = 130\nseed = {seed}\n\
                 [[robots]]\nrobot = \"kilobot\"\nscript = \"s.bzz\"\ncount = 2\n\
                 placement = \"circle\"\nradius = 45\n\
                 [output]\nplot = [\"global.size\"]\n"
            ),
        );
        assert!(summary.faults.is_empty(), "{:?}", summary.faults);
        assert_eq!(summary.values[0], Some([4.0; 3]), "seed {seed}");
    }
}
