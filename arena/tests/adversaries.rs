//! A swarm beside hostile and broken senders: it computes on, and agrees again when they fall silent.

use std::path::Path;
use std::sync::Arc;

use crate::script::{folder, read};
use bittybuzz_arena::engine::LossCause;
use bittybuzz_arena::robot::{FaultCounts, Interest};
use bittybuzz_arena::run::{EventKind, ObservedEvent, Observer, Setup, Simulation, Summary};
use bittybuzz_arena::scenario::Scenario;

/// The same swarm that the shipped scenario has.
const SCRIPT: &str = include_str!("../../tests/scenarios/adversaries.bzz");

/// Nine Kilobots that hear their neighbors in rows, columns and diagonals; robots 0 to 8.
const ROBOTS: usize = 9;
const WORLD: &str = "[world]\nsize = [1000, 1000]\nduration = 90\n[medium.ir]\nrange = 70\nedge = 0\n\
    [[robots]]\nrobot = \"kilobot\"\nscript = \"s.bzz\"\ncount = 9\nplacement = \"grid\"\nspacing = 60\nclock_skew = 0\n\
    [output]\nplot = [\"stigmergy.1.number\", \"steps\", \"neighbors\", \"global.words\", \"global.lists\"]\n";

/// Adversaries are there from 20 s to 60 s.
const FROM: u64 = 200;
const UNTIL: u64 = 600;
/// Ticks between two puts, and their number: the last one is at 70 s.
const PUT_EVERY: u64 = 100;
const PUTS: u64 = 7;

fn adversary(kind: &str) -> String {
    format!("[[adversary]]\nkind = {kind}\nat = [30, 30]\nfrom = 20\nuntil = 60\n")
}

fn setup(name: &str, more: &str) -> Arc<Setup> {
    let script = SCRIPT.replace("number < 18", &format!("number < {PUTS}"));
    let folder = folder(name, &[("s.bzz", &script)]);
    let (scenario, programs) = read(&folder, &[WORLD, more].concat());
    Arc::new(Setup::new(scenario, programs).unwrap())
}

/// The quantities of all robots at a tick.
#[derive(Clone, Debug)]
struct SwarmSample {
    tick: u64,
    number: Vec<Option<f64>>,
    steps: Vec<Option<f64>>,
    neighbors: Vec<Option<f64>>,
    words: f64,
    lists: f64,
}

impl SwarmSample {
    fn of(run: &Simulation) -> Self {
        let setup = run.setup().clone();
        let numbers = |quantity: usize| run.numbers(&setup.plots()[quantity]);
        let sum = |quantity| numbers(quantity).into_iter().flatten().sum();
        let [number, steps, neighbors] = [0, 1, 2].map(numbers);
        SwarmSample { tick: run.now(), number, steps, neighbors, words: sum(3), lists: sum(4) }
    }

    /// Puts of robot 0. Tick 0 has no step; the first put is in tick 100.
    fn puts(&self) -> f64 {
        ((self.tick - 1) / PUT_EVERY).min(PUTS) as f64
    }

    /// All robots have the number that robot 0 has put last.
    fn agrees(&self) -> bool {
        self.number.iter().all(|number| *number == Some(self.puts()))
    }

    /// All robots have the number that robot 0 has put last, ten seconds ago, or the one before. A Kilobot sends two frames per second.
    fn keeps_up(&self) -> bool {
        let known = [self.puts(), self.puts() - 1.0].map(Some);
        self.number.iter().all(|number| known.contains(number))
    }
}

/// Runs a world and takes a sample just before each put, and at the end.
fn run(name: &str, more: &str) -> (Vec<SwarmSample>, Summary) {
    let mut run = Simulation::new(setup(name, more), 1, 1).unwrap();
    let mut samples = Vec::new();
    while !run.is_over() {
        run.tick().unwrap();
        if run.now().is_multiple_of(PUT_EVERY) {
            samples.push(SwarmSample::of(&run));
        }
    }
    (samples, run.summary())
}

/// Every script made all of its steps without a fault, and all agree at the end.
fn survives((samples, summary): &(Vec<SwarmSample>, Summary)) {
    assert_eq!(summary.fault_counts, FaultCounts::default());
    let last = samples.last().unwrap();
    assert_eq!(last.steps, [Some(899.0); ROBOTS]);
    assert!(last.agrees(), "{last:?}");
}

fn during(samples: &[SwarmSample]) -> impl Iterator<Item = &SwarmSample> {
    samples.iter().filter(|sample| (FROM + PUT_EVERY..=UNTIL).contains(&sample.tick))
}

fn keeps_up((samples, _): &(Vec<SwarmSample>, Summary)) {
    let mut count = 0;
    for sample in during(samples) {
        assert!(sample.keeps_up(), "{sample:?}");
        count += 1;
    }
    assert_eq!(count, 4);
}

#[test]
fn robots_agree_without_an_adversary() {
    let quiet = run("no_adversary", "");
    survives(&quiet);
    keeps_up(&quiet);
}

/// Counts robots' received frames, by time, and the losses by collision.
#[derive(Default)]
struct FrameCounter {
    received_in_noise: usize,
    received_otherwise: usize,
    collided: usize,
    sent_by_adversary: usize,
    postponed: usize,
}

impl Observer for FrameCounter {
    fn interest(&self) -> Interest {
        Interest::ALL
    }

    fn see(&mut self, ObservedEvent { tick, robot, kind }: ObservedEvent<'_>) {
        // Two ticks for frames that were on their way.
        let is_noisy = (FROM + 2..UNTIL).contains(&tick);
        match kind {
            EventKind::Received { .. } if robot >= ROBOTS => {}
            EventKind::Received { .. } if is_noisy => self.received_in_noise += 1,
            EventKind::Received { .. } => self.received_otherwise += 1,
            EventKind::Lost { cause: LossCause::Collision, .. } if is_noisy => self.collided += 1,
            EventKind::Postponed { .. } if is_noisy => self.postponed += 1,
            EventKind::Sent(_) if robot >= ROBOTS => {
                assert!(robot == ROBOTS && (FROM..UNTIL).contains(&tick));
                self.sent_by_adversary += 1;
            }
            _ => {}
        }
    }
}

/// The limit: who is in reach of a jammer hears nobody. Scripts go on, and what was put meanwhile arrives afterwards.
#[test]
fn jam() {
    // Farther than the robots, so that it reaches all of them.
    let jam = [adversary("\"jam\"\nrange = 200"), String::new()].concat();
    let ended = run("jam", &jam);
    survives(&ended);
    let in_noise = during(&ended.0).last().unwrap();
    assert!(!in_noise.keeps_up(), "{in_noise:?}");
    let mut run = Simulation::new(setup("jam_observed", &jam), 1, 1).unwrap();
    let mut counter = FrameCounter::default();
    while !run.is_over() {
        run.tick_observed(&mut counter).unwrap();
    }
    assert_eq!(counter.received_in_noise, 0);
    assert!(counter.received_otherwise > 100 && counter.postponed > 100);
    // One frame of 4.41 ms behind the other for 40 s.
    assert!((9070..=9071).contains(&counter.sent_by_adversary), "{}", counter.sent_by_adversary);
}

/// A jammer that reaches only its surroundings leaves the others alone.
#[test]
fn a_jammer_has_a_range() {
    let far = "[[adversary]]\nkind = \"jam\"\nat = [-450, -450]\nrange = 50\n";
    let ended = run("jam_far", far);
    survives(&ended);
    keeps_up(&ended);
}

#[test]
fn babble() {
    let ended = run("babble", &adversary("\"babble\""));
    survives(&ended);
    keeps_up(&ended);
    let Summary { unusable, dropped, .. } = ended.1;
    assert!(unusable.malformed + unusable.foreign + dropped[0] > 100, "{unusable:?} {dropped:?}");
}

#[test]
fn replay() {
    let ended = run("replay", &adversary("\"replay\""));
    survives(&ended);
    keeps_up(&ended);
    // Broadcasts are believed again: there are more of them than without.
    let (quiet, _) = run("no_replay", "");
    assert!(ended.0.last().unwrap().words > 1.2 * quiet.last().unwrap().words);
}

/// The limit: a forged value holds until the next put.
#[test]
fn forged_clock() {
    let ended = run("forged_clock", &adversary("\"forged-clock\""));
    survives(&ended);
    assert!(during(&ended.0).any(|sample| !sample.keeps_up()));
}

/// The limit: a value of a type that the script uses is believed, here an integer. Others are discarded.
#[test]
fn poison() {
    let ended = run("poison", &adversary("\"poison\""));
    survives(&ended);
    assert!(ended.1.unusable.malformed > 100, "{:?}", ended.1.unusable);
    let is_number = |number: &Option<f64>| number.is_some();
    for sample in during(&ended.0) {
        assert!(sample.number.iter().all(is_number), "{sample:?}");
    }
}

#[test]
fn invented_ids() {
    let ended = run("invented_ids", &adversary("\"invented-ids\""));
    survives(&ended);
    keeps_up(&ended);
    let (quiet, _) = run("no_invented_ids", "");
    let most = |samples: &[SwarmSample]| {
        let counts = during(samples).flat_map(|sample| sample.neighbors.iter().flatten().copied());
        counts.fold(0.0, f64::max)
    };
    assert!(most(&quiet) <= 8.0);
    // The table of a Kilobot has 15 places.
    assert_eq!(most(&ended.0), 15.0);
    let last = ended.0.last().unwrap();
    assert!(last.neighbors.iter().flatten().all(|count| *count <= 8.0), "{last:?}");
}

/// Messages that are begun and not finished keep no place from others.
#[test]
fn held_fragments() {
    let ended = run("held_fragments", &adversary("\"held-fragments\""));
    survives(&ended);
    keeps_up(&ended);
    let (quiet, _) = run("no_held_fragments", "");
    let lists = |samples: &[SwarmSample], from: u64, until: u64| {
        let at = |tick| samples.iter().find(|sample| sample.tick == tick).unwrap().lists;
        at(until) - at(from)
    };
    let [held, normal] = [&ended.0, &quiet].map(|samples| lists(samples, FROM, UNTIL));
    // Some 200 lists are known to 7 %.
    assert!(held > 0.75 * normal, "{held} of {normal}");
    let [after, normal] = [&ended.0, &quiet].map(|samples| lists(samples, UNTIL, 900));
    assert!(after > 0.8 * normal, "{after} of {normal}");
}

/// The limit: others take it for the robot.
#[test]
fn same_id() {
    let ended = run("same_id", &adversary("\"same-id\"\nid = 4"));
    survives(&ended);
    assert!(ended.1.unusable.own_id > 50, "{:?}", ended.1.unusable);
    let nobody = run("no_same_id", "");
    assert_eq!(nobody.1.unusable.own_id, 0);
}

/// An adversary hears what a robot there would hear: one that nobody reaches has nothing to replay.
#[test]
fn an_adversary_out_of_range_replays_nothing() {
    let far = "[[adversary]]\nkind = \"replay\"\nat = [-450, -450]\n";
    let (alone, quiet) = (run("alone", far), run("not_alone", ""));
    assert_eq!(alone.1.statistics, quiet.1.statistics);
}

/// Everything comes from the seed, whatever the number of threads, and however often the run is copied.
#[test]
fn adversaries_are_deterministic() {
    let kinds =
        ["jam", "babble", "replay", "forged-clock", "poison", "invented-ids", "held-fragments"];
    let all: String =
        kinds.iter().map(|kind| adversary(&format!("\"{kind}\"\nrate = 4"))).collect();
    let setup = setup("deterministic", &[all, adversary("\"same-id\"\nid = 4")].concat());
    let trace = |seed, threads| {
        let mut run = Simulation::new(setup.clone(), seed, threads).unwrap();
        let mut digests = Vec::new();
        while !run.is_over() {
            run.tick().unwrap();
            digests.push(run.digest());
            if run.now().is_multiple_of(100) {
                run = run.snapshot().unwrap();
            }
        }
        digests
    };
    let one = trace(1, 1);
    assert_eq!(trace(1, 2), one);
    assert_ne!(trace(2, 1), one);
}

/// A command begins what a section does.
#[test]
fn a_command_can_add_an_adversary() {
    let text = "adversary = { kind = \"replay\", at = [30, 30], until = 60 }";
    let mut run = Simulation::new(setup("commanded_adversary", ""), 1, 1).unwrap();
    let mut digests = Vec::new();
    while !run.is_over() {
        if run.now() == FROM {
            run.command(text).unwrap();
        }
        run.tick().unwrap();
        digests.push(run.digest());
    }
    let written = run.commands();
    let section = adversary("\"replay\"");
    for (name, more) in [("as_event", written.as_str()), ("as_section", section.as_str())] {
        let mut again = Simulation::new(setup(name, more), 1, 1).unwrap();
        for digest in &digests {
            again.tick().unwrap();
            assert_eq!(again.digest(), *digest, "{name}");
        }
    }
}

/// 33 of them at one time are refused at the line of the last; one after the other they are not.
#[test]
fn the_number_of_adversaries_at_one_time_is_limited() {
    let base = "[world]\nsize = [1000, 800]\nduration = 60\n[[robots]]\nrobot = \"kilobot\"\nscript = \"adversaries.bzz\"\n";
    let parse = |text: &str| {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/scenarios");
        Scenario::parse(text, "s.toml", &folder, &[], &bittybuzz_robot_models::all())
    };
    let one = |from: u32, until: u32| {
        format!("[[adversary]]\nkind = \"jam\"\nat = [0, 0]\nfrom = {from}\nuntil = {until}\n")
    };
    let most = [base.to_owned(), one(3, 9).repeat(32)].concat();
    assert!(parse(&most).is_ok());
    let errors = parse(&[most.as_str(), &one(8, 60)].concat()).unwrap_err();
    let [error] = &errors[..] else { panic!("{errors:?}") };
    assert_eq!(error.place.as_ref().unwrap().line, 6 + 32 * 5 + 1);
    assert_eq!(error.to_string(), "more than 32 adversaries would send at 8 s");
    assert!(error.help().unwrap().contains("`until`"));
    let event = "[[event]]\nat = 3\nadversary = { kind = \"jam\", at = [0, 0] }\n";
    assert!(parse(&[most.as_str(), event].concat()).is_err());
    let turns: String = (0..59).map(|from| one(from, from + 1)).collect();
    assert!(parse(&[base, &turns].concat()).is_ok());
}
