//! A forged message stops no example for good: each that listens or shares receives one message with a value of each
//! class on each of its topics and keys. It ends a call at most, or the script starts again.

use bittybuzz_testkit::{Answer, FORGER, Received, Recorder, SIZES, TestRobot, fragments};
use bittybuzz_tests::{compiler, files, report};
use bittybuzz_vm_core::builtin::{self, string};
use bittybuzz_vm_core::message::content::{Head, Item};
use bittybuzz_vm_core::message::{Entry, Message};
use bittybuzz_vm_core::number::{Full, Profile, Tiny};
use bittybuzz_vm_core::{Fault, FaultCode, Restarts, Value};

/// Steps before the message: none, and enough for all neighbors and entries to be known.
const WARM: [usize; 2] = [0, 5];
/// Ticks after the message: a pause of 1 s, one of 2 s, and some more.
const TICKS: usize = 45;

/// A value of each class, as items of a long message. All but the last ones fit a frame, too.
fn values<P: Profile>() -> Vec<(&'static str, Vec<Item<P>>)> {
    let plain = [
        ("nil", Value::nil()),
        ("string", Value::string(string::COUNT)),
        ("NaN", Value::float(f32::NAN)),
        ("inf", Value::float(f32::INFINITY)),
        ("32767", Value::int(32767)),
        ("-32767", Value::int(-32767)),
        ("-1", Value::int(-1)),
        ("0", Value::int(0)),
    ];
    let mut values: Vec<(&str, Vec<Item<P>>)> =
        plain.into_iter().map(|(name, value)| (name, vec![Item::Plain(value)])).collect();
    let pair = [Item::Plain(Value::string(0)), Item::Plain(Value::int(1))];
    values.push(("an empty table", vec![Item::Table(0)]));
    values.push(("a table", [&[Item::Table(1)], &pair[..]].concat()));
    values.push(("a function", vec![Item::Function(0)]));
    values
}

/// A message to a script: on a topic, or an entry of a stigmergy.
#[derive(Clone, Copy)]
enum To<P: Profile> {
    Topic(u16),
    Entry { stigmergy: u16, key: Value<P>, clock: u32 },
}

/// A robot that starts its script again after a fault, as all hosts do.
struct Host<P: Profile> {
    robot: TestRobot<P>,
    restarts: Restarts,
    is_pausing: bool,
    /// Ticks in which a step began.
    begun: usize,
    faults: Vec<Fault>,
}

impl<P: Profile> Host<P> {
    fn new(image: &'static [u8]) -> Self {
        let mut robot: TestRobot<P> = TestRobot::new(image, 3, SIZES);
        robot.host = Recorder::answering(|_| Answer::Int(0));
        robot.host.position = [Some(0.0); 4];
        let (restarts, faults) = (Restarts::new(), Vec::new());
        Host { robot, restarts, is_pausing: false, begun: 0, faults }
    }

    fn tick(&mut self) {
        self.begun += usize::from(!self.is_pausing);
        let is_over = self.is_pausing && self.restarts.tick();
        let result = if is_over {
            self.is_pausing = false;
            self.robot.start()
        } else {
            self.robot.step()
        };
        match result {
            Ok(()) if is_over || self.is_pausing => {}
            Ok(()) => self.restarts.step(),
            Err(fault) => {
                self.faults.push(fault);
                self.restarts.pause();
                self.is_pausing = true;
                self.robot.rest();
            }
        }
    }

    /// The message arrives, in fragments if it does not fit a frame.
    fn receive(&mut self, to: To<P>, items: &[Item<P>]) {
        let whole = match (to, items) {
            (To::Topic(topic), [Item::Plain(value)]) => {
                Some(Message::Broadcast { robot: FORGER, topic, value: *value })
            }
            (To::Entry { stigmergy, key, clock }, [Item::Plain(value)]) => {
                Some(Message::Entry(Entry { stigmergy, owner: FORGER, clock, key, value: *value }))
            }
            _ => None,
        };
        if let Some(message) = whole {
            self.push(self.robot.frame(&message));
            return;
        }
        let (head, first) = match to {
            To::Topic(topic) => (Head::Broadcast, Value::string(topic)),
            To::Entry { stigmergy, key, clock } => {
                (Head::Entry { stigmergy, owner: FORGER, clock, digest: 0 }, key)
            }
        };
        let items = [&[Item::Plain(first)], items].concat();
        for bytes in fragments(self.robot.script(), FORGER, head, &items) {
            self.push(bytes);
        }
    }

    fn push(&mut self, bytes: Vec<u8>) {
        let place = Some([50.0, 0.0, 0.0]);
        self.robot.host.link.push(Received { bytes, sender: Some(FORGER), place });
    }
}

/// The topics that a script listens to, and the keys of its stigmergies.
fn targets<P: Profile>(text: &str, own_strings: &[String]) -> Vec<(String, To<P>)> {
    let mut targets = Vec::new();
    for listen in text.split("neighbors.listen(\"").skip(1) {
        let (topic, _) = listen.split_once('"').expect("a topic is a constant");
        let own = own_strings.iter().position(|string| string == topic);
        let number = match own {
            Some(own) => string::COUNT + own as u16,
            None => {
                let known = builtin::STRINGS.iter().position(|known| *known == topic);
                known.expect("a topic is a string of the script or of the machine") as u16
            }
        };
        targets.push((format!("topic {topic}"), To::Topic(number)));
    }
    for create in text.split("stigmergy.create(").skip(1) {
        // Comments write `n`.
        let number = create.split(')').next().and_then(|number| number.parse().ok());
        let Some(stigmergy) = number else { continue };
        let strings = own_strings
            .iter()
            .enumerate()
            .map(|(own, name)| (format!("key {name}"), Value::string(string::COUNT + own as u16)));
        let integers = (-1..=8).map(|key| (format!("key {key}"), Value::int(key)));
        for (name, key) in strings.chain(integers) {
            for clock in [1, 1000] {
                let to = To::Entry { stigmergy, key, clock };
                targets.push((format!("{name} with clock {clock}"), to));
            }
        }
    }
    targets
}

/// Forges messages for a script. Returns the number of those that ended in a fault, and what went wrong.
fn survey<P: Profile>(path: &str) -> (usize, Vec<String>) {
    let text = files::read(path);
    let compiled = compiler::compile_file(path, P::FULL);
    let (Some(image), Some(symbols)) = (compiled.image, compiled.symbols) else {
        panic!("{path}: {:?}", compiled.diagnostics);
    };
    let image: &'static [u8] = Vec::leak(image);
    let targets = targets::<P>(&text, &symbols.strings);
    assert!(!targets.is_empty(), "{path} neither listens nor shares");
    let (mut effective, mut failures) = (0, Vec::new());
    for (name, to) in targets {
        for (class, items) in values::<P>() {
            for warm in WARM {
                let mut host: Host<P> = Host::new(image);
                (0..warm).for_each(|_| host.tick());
                assert_eq!(host.faults, [], "{path} has a fault of its own");
                host.receive(to, &items);
                host.begun = 0;
                (0..TICKS).for_each(|_| host.tick());
                let stopped = host.faults.iter().any(|f| f.code == FaultCode::AssertFailed);
                // A script that fails in each step begins one after each of two pauses.
                let least = if host.faults.is_empty() { TICKS } else { 2 };
                if stopped || host.begun < least {
                    let steps = host.begun;
                    let faults = &host.faults;
                    failures.push(format!(
                        "{path}: {name} = {class} after {warm} steps: {steps} steps, {faults:?}\n"
                    ));
                }
                let is_harmless = host.faults.is_empty() && host.robot.host.contained.is_empty();
                effective += usize::from(!is_harmless);
            }
        }
    }
    (effective, failures)
}

#[test]
fn examples_survive_forged_messages() {
    let mut paths = files::with_extension("examples", "bzz");
    paths.retain(|path| {
        let text = files::read(path);
        text.contains("neighbors.listen(") || text.contains("= stigmergy.create(")
    });
    let results = files::in_parallel(&paths, |path| {
        let text = files::read(path);
        let robots = text.lines().find_map(|line| line.strip_prefix("# Robots: "));
        let is_tiny =
            robots.is_some_and(|robots| robots.contains("kilobot") || robots.contains("zooids"));
        if is_tiny { survey::<Tiny>(path) } else { survey::<Full>(path) }
    });
    // Otherwise the messages are no danger, and the test shows nothing.
    let endangered = results.iter().filter(|(effective, _)| *effective > 0).count();
    assert!(endangered >= 6, "{endangered} of {} scripts have faults", paths.len());
    let failures: Vec<String> = results.into_iter().flat_map(|(_, failures)| failures).collect();
    report::conclude("forged messages", paths.len(), 12, &failures);
}
