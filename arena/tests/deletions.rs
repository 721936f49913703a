//! Deletions last: no robot that was away brings a deleted key back, and what robots put meanwhile arrives.

use bittybuzz_arena::engine::Medium;
use bittybuzz_arena::run::{Summary, TICKS_PER_SECOND};

use crate::script::{folder, run, run_with};

/// Kinds of nine robots, the distance between two of them in mm, and the entries that one has room for.
const KINDS: [Kind; 3] = [
    Kind { robot: "kilobot", spacing: 50, room: 4 },
    Kind { robot: "zooids", spacing: 60, room: 12 },
    Kind { robot: "crazyflie", spacing: 500, room: 100 },
];

#[derive(Clone, Copy)]
struct Kind {
    robot: &'static str,
    spacing: u32,
    room: u32,
}

/// How robots are away.
#[derive(Clone, Copy, Debug)]
enum Away {
    /// They hear each other.
    Partition,
    /// They neither hear nor count steps.
    Stop,
}

/// A run in which robots are away from second 10 on.
struct Run<'r> {
    kind: Kind,
    away: Away,
    robots: &'r str,
    seconds: u32,
    loss: f32,
    seed: u32,
}

impl Run<'_> {
    /// The sums of all values that the nine robots know half a minute after all are together again, least and greatest, and
    /// the frames per second and robot in the half minute after that. `step` is the body of the script's step.
    fn outcome(&self, step: &str) -> ([f64; 2], f64) {
        let Run { kind: Kind { robot, spacing, room }, away, robots, seconds, loss, seed } = *self;
        let script = format!(
            "s = stigmergy.create(1)
             t = 0
             sum = 0
             room = {room}
             function add(key, value) {{ sum = sum + value }}
             function step() {{
               t = t + 1
               {step}
               sum = 0
               s.foreach(add)
             }}"
        );
        let folder = folder("deletions", &[("s.bzz", &script)]);
        let (begin, end) = match away {
            Away::Partition => (format!("partition = [{robots}]"), "heal = true".to_string()),
            Away::Stop => (format!("stop = {robots}"), format!("resume = {robots}")),
        };
        let back = 10 + seconds;
        let (settled, end_of_run) = (back + 40, back + 70);
        let scenario = format!(
            "[world]\nsize = [4000, 4000]\nduration = {end_of_run}\nseed = {seed}\n\
             [[robots]]\nrobot = \"{robot}\"\nscript = \"s.bzz\"\ncount = 9\n\
             placement = \"grid\"\nspacing = {spacing}\nlink = {{ loss = {loss} }}\n\
             [[event]]\nat = 10\n{begin}\n[[event]]\nat = {back}\n{end}\n\
             [output]\nplot = [\"global.sum\"]\n"
        );
        let mut sums = None;
        let mut sent = 0;
        let media = [Medium::Infrared, Medium::Nrf24, Medium::P2p];
        let sent_of = |summary: &Summary| -> u64 {
            media.iter().map(|medium| summary.statistics.link(*medium).sent).sum()
        };
        let summary = run_with(&folder, &scenario, 1, |run| {
            if run.now() == u64::from(settled) * TICKS_PER_SECOND as u64 {
                let summary = run.summary();
                sums = summary.values[0];
                sent = sent_of(&summary);
            }
        });
        let [_, least, greatest] = sums.expect("the script has the global");
        ([least, greatest], (sent_of(&summary) - sent) as f64 / 9.0 / 30.0)
    }

    /// Fails unless all robots know values of that sum in the end, and are quiet then.
    fn expect(&self, sum: u32, step: &str) {
        let (sums, rate) = self.outcome(step);
        let Run { kind, away, robots, seconds, loss, seed } = self;
        let what = format!(
            "{} {robots}, {away:?} of {seconds} s, loss {loss}, seed {seed}: {sums:?}, {rate:.2} frames",
            kind.robot
        );
        assert_eq!(sums, [f64::from(sum); 2], "{what}");
        assert!(rate < 0.7, "{what}");
    }
}

/// Robot 0 puts two keys and deletes one of them when the others are away.
const DELETE: &str = "if(id == 0 and t == 20) { s.put(\"kept\", 1) s.put(\"deleted\", 100) }
    if(id == 0 and t == 200) s.put(\"deleted\", nil)";

/// What [`DELETE`] does; then robot 0 fills its store and deletes all but one of these keys, so that the place of the
/// first deletion is taken.
const CROWD: &str = "if(id == 0 and t == 20) { s.put(\"kept\", 1) s.put(\"deleted\", 100) }
    if(id == 0 and t == 200) s.put(\"deleted\", nil)
    if(id == 0 and t > 900 and t <= 900 + 5 * (room - 1) and t % 5 == 0) s.put((t - 900) / 5, 2)
    if(id == 0 and t > 1500 and t <= 1500 + 5 * (room - 2) and t % 5 == 0) s.put((t - 1500) / 5, nil)";

/// How many of the seeds of a case run.
#[derive(Clone, Copy)]
enum Seeds {
    /// A few of each case, for every change.
    Sample,
    /// All of each case: minutes.
    All,
}

impl Seeds {
    fn of(self, all: u32) -> u32 {
        match self {
            Seeds::Sample => all.div_ceil(4),
            Seeds::All => all,
        }
    }
}

fn runs(
    robots: &str,
    away: &[Away],
    seconds: &[u32],
    losses: &[f32],
    seeds: u32,
    sum: u32,
    step: &str,
) {
    for kind in KINDS {
        for away in away {
            for seconds in seconds {
                for loss in losses {
                    for seed in 1..=seeds {
                        let (away, seconds, loss) = (*away, *seconds, *loss);
                        Run { kind, away, robots, seconds, loss, seed }.expect(sum, step);
                    }
                }
            }
        }
    }
}

fn one_robot_was_away(seeds: Seeds) {
    let away = [Away::Partition, Away::Stop];
    runs("[8]", &away, &[50, 100, 300], &[0.0, 0.3], seeds.of(10), 1, DELETE);
}

fn several_robots_were_away(seeds: Seeds) {
    runs("[6, 7, 8]", &[Away::Partition], &[100, 300], &[0.0, 0.3], seeds.of(10), 1, DELETE);
}

/// The robot that was away has put the key itself.
fn the_owner_was_away(seeds: Seeds) {
    let step = "if(id == 8 and t == 20) { s.put(\"kept\", 1) s.put(\"deleted\", 100) }
        if(id == 0 and t == 200) s.put(\"deleted\", nil)";
    runs("[8]", &[Away::Partition, Away::Stop], &[100], &[0.0, 0.3], seeds.of(10), 1, step);
}

fn its_place_was_taken(seeds: Seeds) {
    let away = [Away::Partition, Away::Stop];
    runs("[8]", &away, &[240], &[0.0, 0.3], seeds.of(10), 3, CROWD);
    runs("[6, 7, 8]", &[Away::Partition], &[240], &[0.0, 0.3], seeds.of(10), 3, CROWD);
}

/// A robot that was alone puts a new key with an earlier clock than that of the deletion, whose place was taken. The script
/// deletes keys that are numbers, but never the string.
fn a_robot_puts_alone(seeds: Seeds) {
    for key in ["\"new\"", "1000"] {
        let step = format!("{CROWD} if(id == 8 and t == 1000) s.put({key}, 10)");
        runs("[8]", &[Away::Partition], &[240], &[0.0, 0.3], seeds.of(10), 13, &step);
    }
}

/// Both parts delete a key of both, and both fill their stores, so that the places of these deletions are taken. Clocks of
/// the parts are equal, or those of one later.
fn two_parts_delete(seeds: Seeds) {
    let step = "if(id == 0 and t == 20) s.put(\"first\", 100)
        if(id == 8 and t == 20) s.put(\"last\", 1000)
        if(id == 0 and t == 200) s.put(\"first\", nil)
        if(id == 8 and t == 200) s.put(\"last\", nil)
        n = 0
        if(t > 900 and t % 5 == 0) n = (t - 900) / 5
        if((id == 0 or id == 8) and n > 0 and n < room) s.put(1000 * id + n, 2)
        n = 0
        if(t > 1500 and t % 5 == 0) n = (t - 1500) / 5
        if((id == 0 or id == 8) and n > 0 and n < room - 1) s.put(1000 * id + n, nil)";
    let later = format!("{step} if(id == 8 and t > 800 and t <= 820) s.put(8001, 2)");
    for robots in ["[8]", "[6, 7, 8]", "[5, 6, 7, 8]", "6, 7, 8"] {
        for step in [step, &later] {
            runs(robots, &[Away::Partition], &[300], &[0.0, 0.3], seeds.of(5), 4, step);
        }
    }
}

/// The robots of a part put a new key; the place of the deletion is still theirs.
fn a_part_puts(seeds: Seeds) {
    let step = format!("{DELETE} if(id == 8 and t == 1000) s.put(\"new\", 10)");
    runs("[6, 7, 8]", &[Away::Partition], &[150], &[0.0, 0.3], seeds.of(10), 11, &step);
}

#[test]
fn a_robot_that_was_away_does_not_bring_a_key_back() {
    one_robot_was_away(Seeds::Sample);
}

#[test]
fn robots_that_were_away_together_do_not_bring_a_key_back() {
    several_robots_were_away(Seeds::Sample);
}

#[test]
fn the_robot_that_put_a_key_does_not_bring_it_back() {
    the_owner_was_away(Seeds::Sample);
}

#[test]
fn a_deletion_lasts_after_its_place_was_taken() {
    its_place_was_taken(Seeds::Sample);
}

#[test]
fn what_a_robot_puts_alone_arrives() {
    a_robot_puts_alone(Seeds::Sample);
}

#[test]
fn deletions_of_two_parts_last() {
    two_parts_delete(Seeds::Sample);
}

#[test]
fn what_a_part_puts_arrives() {
    a_part_puts(Seeds::Sample);
}

#[test]
#[ignore = "takes minutes: all seeds"]
fn every_deletion_lasts() {
    let cases = [
        one_robot_was_away,
        several_robots_were_away,
        the_owner_was_away,
        its_place_was_taken,
        a_robot_puts_alone,
        two_parts_delete,
        a_part_puts,
    ];
    for case in cases {
        case(Seeds::All);
    }
}

/// A robot that is switched off and on learns all entries from the others, and they learn what it puts at its start.
#[test]
fn a_robot_that_is_switched_on_late_learns_all_and_keeps_its_puts() {
    for kind in KINDS {
        for (seed, key) in [(1, "\"own\""), (2, "\"own\""), (1, "1000"), (2, "1000")] {
            let Kind { robot, spacing, room } = kind;
            let script = format!(
                "s = stigmergy.create(1)
                 t = 0
                 sum = 0
                 room = {room}
                 function add(key, value) {{ sum = sum + value }}
                 function init() {{ if(id == 8) s.put({key}, 10) }}
                 function step() {{ t = t + 1 {CROWD} sum = 0 s.foreach(add) }}"
            );
            let folder = folder("late", &[("s.bzz", &script)]);
            let text = format!(
                "[world]\nsize = [4000, 4000]\nduration = 300\nseed = {seed}\n\
                 [[robots]]\nrobot = \"{robot}\"\nscript = \"s.bzz\"\ncount = 9\n\
                 placement = \"grid\"\nspacing = {spacing}\n\
                 [[event]]\nat = 0\nfail = 8\n[[event]]\nat = 250\nrestart = 8\n\
                 [output]\nplot = [\"global.sum\"]\n"
            );
            let [_, least, greatest] = run(&folder, &text).values[0].unwrap();
            assert_eq!([least, greatest], [13.0; 2], "{robot}, seed {seed}, {key}");
        }
    }
}
