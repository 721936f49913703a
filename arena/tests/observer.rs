//! An observer sees frames, faults, logs and calls, and changes nothing.

use crate::busy;
use std::collections::BTreeMap;
use std::sync::Arc;

use crate::script::{folder, read};
use bittybuzz_arena::engine::{LossCause, Medium, TICK_US, WorldStatistics};
use bittybuzz_arena::robot::{
    CallResult, Consequence, FaultRecord, FunctionCall, Interest, LogLine, Piece,
};
use bittybuzz_arena::run::{EventKind, ObservedEvent, Observer, Setup, Simulation};
use bittybuzz_vm_core::{RobotFault, Type};

/// Counts what it sees.
#[derive(Debug, Default, PartialEq)]
struct Counter {
    /// By medium: frames that were sent, attempts that were postponed, frames that were heard, heard twice, held back.
    links: BTreeMap<u8, [u64; 5]>,
    lost: BTreeMap<LossCause, u64>,
    unsent: u64,
    /// Sender and beginning of each frame.
    sent: BTreeMap<(usize, u64), Vec<u8>>,
}

impl Counter {
    fn count(&mut self, medium: Medium, what: usize) {
        self.links.entry(medium as u8).or_default()[what] += 1;
    }

    fn lost(&self, cause: LossCause) -> u64 {
        self.lost.get(&cause).copied().unwrap_or(0)
    }
}

impl Observer for Counter {
    fn interest(&self) -> Interest {
        Interest::ALL
    }

    fn see(&mut self, ObservedEvent { tick, robot, kind }: ObservedEvent<'_>) {
        match kind {
            EventKind::Sent(frame) => {
                self.count(frame.medium, 0);
                assert_eq!(frame.start_us / u64::from(TICK_US), tick, "a frame begins in its tick");
                let known = self.sent.insert((robot, frame.start_us), frame.bytes.to_vec());
                assert_eq!(known, None, "two frames of one robot at one time");
            }
            EventKind::Postponed { sensed, .. } => {
                assert!(sensed > 0);
                // Only Zooids and Kilobots listen before they send.
                self.count(if robot < 9 { Medium::Infrared } else { Medium::Nrf24 }, 1);
            }
            EventKind::Received { frame, receiver, is_duplicated, held_until } => {
                self.count(frame.medium, 2);
                if is_duplicated {
                    self.count(frame.medium, 3);
                }
                if let Some(until) = held_until {
                    assert!(until > tick);
                    self.count(frame.medium, 4);
                }
                assert_ne!(robot, receiver);
                assert_eq!(
                    self.sent[&(robot, frame.start_us)],
                    frame.bytes,
                    "heard as it was sent"
                );
                let end = frame.start_us + u64::from(frame.medium.air_time_us());
                assert_eq!(
                    (end - 1) / u64::from(TICK_US),
                    tick - 1,
                    "heard in the tick after its end"
                );
            }
            EventKind::Lost { frame, receiver, cause } => {
                assert_ne!(robot, receiver);
                assert_eq!(self.sent[&(robot, frame.start_us)], frame.bytes);
                *self.lost.entry(cause).or_default() += 1;
            }
            EventKind::Unsent { .. } => self.unsent += 1,
            EventKind::Log(_) | EventKind::Fault(_) | EventKind::Call(_) => {}
        }
    }
}

/// Keeps what it sees.
#[derive(Debug, Default, PartialEq)]
struct RecordingObserver {
    /// Everything, as text.
    events: Vec<String>,
    /// Tick, sender and receiver of each fate of a frame.
    fates: Vec<(u64, usize, usize)>,
    robots: Vec<(u64, usize)>,
    logs: Vec<(usize, LogLine)>,
    faults: Vec<(usize, FaultRecord)>,
    calls: Vec<(u64, usize, FunctionCall)>,
}

impl Observer for RecordingObserver {
    fn interest(&self) -> Interest {
        Interest::ALL
    }

    fn see(&mut self, event: ObservedEvent<'_>) {
        self.events.push(format!("{event:?}"));
        let ObservedEvent { tick, robot, kind } = event;
        self.robots.push((tick, robot));
        match kind {
            EventKind::Received { receiver, .. } | EventKind::Lost { receiver, .. } => {
                self.fates.push((tick, robot, receiver));
            }
            EventKind::Log(line) => self.logs.push((robot, line.clone())),
            EventKind::Fault(found) => self.faults.push((robot, found.fault.clone())),
            EventKind::Call(call) => self.calls.push((tick, robot, call.clone())),
            EventKind::Sent(_) | EventKind::Postponed { .. } | EventKind::Unsent { .. } => {}
        }
    }
}

fn observe(simulation: &mut Simulation, observer: &mut dyn Observer) {
    while !simulation.is_over() {
        simulation.tick_observed(observer).unwrap();
    }
}

/// The media of the world of [`busy`], with every fate that chance decides.
const TROUBLE: &str = "\n[medium.ir]\nduplication = 0.1\nreordering = 0.1\n\
     [medium.nrf24]\nduplication = 0.1\nreordering = 0.1\n[medium.p2p]\nloss = 0.2\n";

fn check_links(counter: &Counter, statistics: &WorldStatistics) {
    for medium in Medium::ALL {
        let link = statistics.link(medium);
        let counted = counter.links.get(&(medium as u8)).copied().unwrap_or_default();
        let expected = [link.sent, link.postponed, link.received, link.duplicated, link.delayed];
        assert_eq!(counted, expected, "{medium:?}");
    }
    let all = statistics.all_links();
    let lost = [LossCause::Sending, LossCause::Collision, LossCause::Chance];
    assert_eq!(lost.map(|cause| counter.lost(cause)), [all.deaf, all.collided, all.lost]);
}

#[test]
fn observed_frames_agree_with_the_statistics() {
    let mut run = Simulation::new(busy::setup("counted", TROUBLE), 5, 1).unwrap();
    let mut counter = Counter::default();
    observe(&mut run, &mut counter);
    let summary = run.summary();
    check_links(&counter, &summary.statistics);
    for (medium, of) in [(Medium::Infrared, 0..5), (Medium::Nrf24, 0..5)] {
        let counted = counter.links[&(medium as u8)];
        assert!(of.clone().all(|what| counted[what] > 0), "{medium:?}: {counted:?}");
    }
    let unread = counter.lost(LossCause::QueueFull) + counter.lost(LossCause::Unreadable);
    assert_eq!([unread, counter.unsent], summary.dropped);
}

/// Crazyflies with more messages than their queues hold, of both profiles, some of which sleep.
const CROWD: &str = "[world]\nsize = [2000, 2000]\nduration = 20\n\
    [[robots]]\nname = \"full\"\nrobot = \"crazyflie\"\nscript = \"talk.bzz\"\ncount = 4\n\
    placement = \"line\"\nat = [-500, 0]\nspacing = 200\n\
    [[robots]]\nname = \"tiny\"\nrobot = \"crazyflie\"\nprofile = \"tiny\"\nscript = \"talk.bzz\"\ncount = 2\n\
    placement = \"line\"\nat = [-500, 500]\nspacing = 200\n\
    [[robots]]\nname = \"sleepers\"\nrobot = \"crazyflie\"\nscript = \"talk.bzz\"\ncount = 1\nat = [0, -500]\n\
    placement = \"line\"\nspacing = 200\n\
    [[event]]\nat = 4\nstop = 0\n[[event]]\nat = 6\nresume = 0\n\
    [[event]]\nat = 8\npartition = [[0, 1], [2, 3]]\n[[event]]\nat = 10\nheal = true\n\
    [[event]]\nat = 12\nblock = [0, 1]\n[[event]]\nat = 14\nfail = 3\n";

/// Twelve messages a step; ten fit the queue. Robot 6 sleeps, so that its queue of received messages becomes full.
const TALK: &str = "function say(topic) { neighbors.broadcast(topic, id) }\n\
    function hear(topic) { neighbors.listen(topic, function(topic, value, robot) { }) }\n\
    function init() {\n hear(\"a\") hear(\"b\") hear(\"c\") hear(\"d\") hear(\"e\") hear(\"f\")\n\
    hear(\"g\") hear(\"h\") hear(\"i\") hear(\"j\") hear(\"k\") hear(\"l\")\n}\n\
    function step() {\n if(id == 6) delay(3000)\n say(\"a\") say(\"b\") say(\"c\") say(\"d\") say(\"e\") say(\"f\")\n\
    say(\"g\") say(\"h\") say(\"i\") say(\"j\") say(\"k\") say(\"l\")\n}\n";

fn crowd(name: &str) -> Arc<Setup> {
    let folder = folder(name, &[("talk.bzz", TALK)]);
    let (scenario, programs) = read(&folder, CROWD);
    Arc::new(Setup::new(scenario, programs).unwrap())
}

#[test]
fn each_lost_frame_has_a_cause() {
    let mut run = Simulation::new(crowd("causes"), 3, 1).unwrap();
    let mut counter = Counter::default();
    observe(&mut run, &mut counter);
    for cause in LossCause::ALL {
        assert!(counter.lost(cause) > 0, "{cause:?}: {:?}", counter.lost);
    }
    let summary = run.summary();
    check_links(&counter, &summary.statistics);
    let unread = counter.lost(LossCause::QueueFull) + counter.lost(LossCause::Unreadable);
    assert_eq!([unread, counter.unsent], summary.dropped);
    assert!(counter.unsent > 0);
}

/// Log lines and faults alone, or with calls or frames, are those of an observer of everything.
#[test]
fn an_observer_sees_what_it_uses_and_nothing_else() {
    struct Part(Interest, RecordingObserver);
    impl Observer for Part {
        fn interest(&self) -> Interest {
            self.0
        }

        fn see(&mut self, event: ObservedEvent<'_>) {
            self.1.see(event);
        }
    }
    let observed = |interest| {
        let mut run = Simulation::new(busy::setup("interest", TROUBLE), 5, 1).unwrap();
        let mut part = Part(interest, RecordingObserver::default());
        observe(&mut run, &mut part);
        (run.digest(), part.1)
    };
    let (digest, all) = observed(Interest::ALL);
    for interest in [(false, false), (false, true), (true, false)] {
        let (frames, calls) = interest;
        let (other, part) = observed(Interest { frames, calls });
        assert_eq!(other, digest);
        assert_eq!((&part.logs, &part.faults), (&all.logs, &all.faults));
        assert_eq!(part.calls, if calls { all.calls.clone() } else { Vec::new() });
        let of_frames = |event: &&String| {
            let kinds = ["Sent(", "Postponed ", "Received ", "Lost ", "Unsent "];
            kinds.iter().any(|kind| event.contains(&format!("kind: {kind}")))
        };
        let of = |seen: &RecordingObserver| -> Vec<String> {
            seen.events.iter().filter(of_frames).cloned().collect()
        };
        assert!(of(&all).len() > 1000);
        assert_eq!(of(&part), if frames { of(&all) } else { Vec::new() });
    }
}

/// A frame that nothing loses reaches everybody else: each has one fate at each robot in reach.
#[test]
fn each_frame_has_a_fate_at_each_robot_in_reach() {
    let mut run = Simulation::new(crowd("fates"), 3, 1).unwrap();
    #[derive(Default)]
    struct Fates(BTreeMap<(usize, u64), Vec<usize>>);
    impl Observer for Fates {
        fn interest(&self) -> Interest {
            Interest::ALL
        }

        fn see(&mut self, ObservedEvent { robot, kind, .. }: ObservedEvent<'_>) {
            let (frame, receiver) = match kind {
                EventKind::Sent(frame) => (frame, None),
                EventKind::Received { frame, receiver, .. } => (frame, Some(receiver)),
                // These were heard before.
                EventKind::Lost { cause: LossCause::QueueFull | LossCause::Unreadable, .. } => {
                    return;
                }
                EventKind::Lost { frame, receiver, .. } => (frame, Some(receiver)),
                _ => return,
            };
            self.0.entry((robot, frame.start_us)).or_default().extend(receiver);
        }
    }
    let mut fates = Fates::default();
    observe(&mut run, &mut fates);
    let end_us = run.now() * u64::from(TICK_US);
    let air_us = u64::from(Medium::P2p.air_time_us());
    // What ends in the last tick is heard after the run.
    let over = |start: u64| start + air_us <= end_us - u64::from(TICK_US);
    let mut seen = 0;
    for ((sender, _), receivers) in fates.0.iter().filter(|((_, start), _)| over(*start)) {
        let others: Vec<usize> = (0..7).filter(|other| other != sender).collect();
        assert_eq!(*receivers, others);
        seen += 1;
    }
    assert!(seen > 1000, "{seen} frames");
}

#[test]
fn an_observer_does_not_change_a_run() {
    let setup = busy::setup("unchanged", TROUBLE);
    let unobserved = busy::rest(&mut Simulation::new(setup.clone(), 5, 1).unwrap());
    for threads in [1, 2] {
        let mut run = Simulation::new(setup.clone(), 5, threads).unwrap();
        let mut observer = RecordingObserver::default();
        let mut seen = Vec::new();
        while !run.is_over() {
            // Now and then nobody looks.
            match run.now() % 7 {
                3 => run.tick().unwrap(),
                _ => run.tick_observed(&mut observer).unwrap(),
            }
            seen.push((run.digest(), run.take_log()));
        }
        assert_eq!(seen, unobserved, "{threads} threads");
        assert!(observer.robots.iter().all(|(tick, _)| tick % 7 != 3));
    }
}

#[test]
fn the_number_of_threads_does_not_change_events() {
    let setup = busy::setup("threads", TROUBLE);
    let [one, two] = [1, 2].map(|threads| {
        let mut run = Simulation::new(setup.clone(), 5, threads).unwrap();
        let mut observer = RecordingObserver::default();
        observe(&mut run, &mut observer);
        observer
    });
    assert_eq!(one, two);
    assert!(one.robots.is_sorted(), "by tick and robot");
    assert!(one.fates.is_sorted(), "by tick, sender and receiver");
}

#[test]
fn a_snapshot_has_no_observer() {
    let mut run = Simulation::new(busy::setup("unseen", TROUBLE), 5, 1).unwrap();
    let mut observer = RecordingObserver::default();
    for _ in 0..30 {
        run.tick_observed(&mut observer).unwrap();
    }
    let mut copy = run.snapshot().unwrap();
    let seen = observer.events.len();
    let rest_of_copy = busy::rest(&mut copy);
    assert_eq!(observer.events.len(), seen);
    assert_eq!(rest_of_copy, busy::rest(&mut run));
}

#[test]
fn an_observer_sees_nothing_of_the_ticks_between_its_own() {
    let run = || Simulation::new(busy::setup("gaps", TROUBLE), 5, 1).unwrap();
    let (mut all, mut some) = (RecordingObserver::default(), RecordingObserver::default());
    observe(&mut run(), &mut all);
    let is_observed = |tick: u64| (tick / 3).is_multiple_of(2);
    let mut run = run();
    while !run.is_over() {
        match is_observed(run.now()) {
            true => run.tick_observed(&mut some).unwrap(),
            false => run.tick().unwrap(),
        }
    }
    all.calls.retain(|(tick, ..)| is_observed(*tick));
    assert!(!some.calls.is_empty() && some.calls == all.calls);
    all.faults.retain(|(_, fault)| is_observed(fault.tick));
    assert!(!some.faults.is_empty() && some.faults == all.faults);
}

#[test]
fn observed_logs_and_faults_agree_with_the_report() {
    let mut run = Simulation::new(busy::setup("reported", ""), 5, 1).unwrap();
    let (mut observer, mut logged) = (RecordingObserver::default(), Vec::new());
    while !run.is_over() {
        run.tick_observed(&mut observer).unwrap();
        logged.extend(run.take_log());
    }
    assert!(!logged.is_empty());
    assert_eq!(observer.logs, logged);
    let summary = run.summary();
    let contained =
        |(_, fault): &&(usize, FaultRecord)| fault.consequence == Consequence::Contained;
    let handler_faults = observer.faults.iter().filter(contained).count() as u64;
    let faults = observer.faults.len() as u64 - handler_faults;
    let counts = summary.fault_counts;
    assert_eq!([faults, handler_faults], [counts.faults, counts.handler_faults]);
    assert!(faults > 0);
    for place in &summary.faults {
        let first = observer
            .faults
            .iter()
            .find(|(robot, fault)| (*robot, fault.tick) == (place.robot, place.record.tick));
        let (_, first) = first.unwrap();
        assert_eq!(FaultRecord { count: 1, ..place.record.clone() }, *first);
    }
}

/// Robots of one kind that run `s.bzz`, and what their observer sees in a second.
fn seen_of(name: &str, robot: &str, script: &str) -> RecordingObserver {
    let folder = folder(name, &[("s.bzz", script)]);
    let text = format!(
        "[world]\nsize = [2000, 2000]\nduration = 5\nambient = 300\n\
         [[robots]]\nrobot = \"{robot}\"\nscript = \"s.bzz\"\nplacement = \"line\"\nspacing = 100\n\
         [body.crazyflie]\narmed = true\n"
    );
    let (scenario, programs) = read(&folder, &text);
    let setup = Arc::new(Setup::new(scenario, programs).unwrap());
    let mut run = Simulation::new(setup, 1, 1).unwrap();
    let mut observer = RecordingObserver::default();
    observe(&mut run, &mut observer);
    observer
}

fn call(function: &str, arguments: Vec<Piece>, result: CallResult) -> FunctionCall {
    FunctionCall { function: function.to_owned(), arguments, result }
}

#[test]
fn calls_have_name_arguments_and_result() {
    let script = "t = 0 e = {}\nfunction step() { t = t + 1 if(t == 1) { led(5) l = light() } if(t == 2) led(e.x) }\n";
    let observer = seen_of("calls", "kilobot", script);
    let returned = CallResult::Returned;
    let refused = CallResult::Refused(RobotFault::WrongType(Type::Nil));
    let expected = [
        (1, 0, call("led", vec![Piece::Int(5)], returned(Piece::Nil))),
        (1, 0, call("light", vec![], returned(Piece::Int(300)))),
        (2, 0, call("led", vec![Piece::Nil], refused)),
    ];
    assert_eq!(observer.calls[..3], expected);
    // The refusal is a fault of the script.
    let (_, fault) = &observer.faults[0];
    assert_eq!((fault.tick, fault.consequence), (2, Consequence::Pause(10)));
    assert!(fault.refusal.as_ref().unwrap().starts_with("led takes"));
}

/// A function that takes several ticks is seen when it begins and when it ends.
#[test]
fn a_call_that_waits_is_seen_twice() {
    let script = "function init() { takeoff(500) }\nfunction step() {}\n";
    let observer = seen_of("waits", "crazyflie", script);
    let arguments = || vec![Piece::Int(500)];
    let calls: Vec<FunctionCall> = observer.calls.iter().map(|(.., call)| call.clone()).collect();
    let ends = CallResult::Returned(Piece::Int(1));
    let expected =
        [call("takeoff", arguments(), CallResult::Waiting), call("takeoff", arguments(), ends)];
    assert_eq!(calls, expected);
    assert!(observer.calls[1].0 >= observer.calls[0].0 + 5, "half a second at least");
}

/// A function that logs is a call and a line.
#[test]
fn a_line_of_a_function_comes_before_its_call() {
    let observer =
        seen_of("shows", "crazyflie", "function init() { show(7) }\nfunction step() {}\n");
    let kinds: Vec<&str> = observer
        .events
        .iter()
        .filter_map(|event| ["Log(", "Call("].into_iter().find(|kind| event.contains(kind)))
        .collect();
    assert_eq!(kinds, ["Log(", "Call("]);
}
