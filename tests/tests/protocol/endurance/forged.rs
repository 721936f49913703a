//! A forged message stops no example for good: each that listens or shares receives one message with a value of each
//! class on each of its topics and keys. It ends a call at most, or the script starts again.

use bittybuzz_testkit::forged::{self, Target};
use bittybuzz_testkit::{Answer, FORGER, Received, Recorder, SIZES, TestRobot};
use bittybuzz_tests::{compiler, files, report};
use bittybuzz_vm_core::message::content::ContentItem;
use bittybuzz_vm_core::number::{Full, Profile, Tiny};
use bittybuzz_vm_core::{Fault, FaultCode, Restarts};

/// Steps before the message: none, and enough for all neighbors and entries to be known.
const WARM: [usize; 2] = [0, 5];
/// Ticks after the message: a pause of 1 s, one of 2 s, and some more.
const TICKS: usize = 45;

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
    fn receive(&mut self, target: Target<P>, items: &[ContentItem<P>]) {
        let place = Some([50.0, 0.0, 0.0]);
        for bytes in forged::frames(self.robot.script(), target, items) {
            self.robot.host.link.push(Received { bytes, sender: Some(FORGER), place });
        }
    }
}

/// Forges messages for a script. Returns the number of those that ended in a fault, and what went wrong.
fn survey<P: Profile>(path: &str) -> (usize, Vec<String>) {
    let text = files::read(path);
    let compiled = compiler::compile_file(path, P::FULL);
    let (Some(image), Some(symbols)) = (compiled.image, compiled.symbols) else {
        panic!("{path}: {:?}", compiled.diagnostics);
    };
    let image: &'static [u8] = Vec::leak(image);
    let targets = forged::targets::<P>(&text, &symbols.strings);
    assert!(!targets.is_empty(), "{path} neither listens nor shares");
    let (mut effective, mut failures) = (0, Vec::new());
    for (name, target) in targets {
        for (class, items) in forged::values::<P>() {
            for warm in WARM {
                let mut host: Host<P> = Host::new(image);
                (0..warm).for_each(|_| host.tick());
                assert_eq!(host.faults, [], "{path} has a fault of its own");
                host.receive(target, &items);
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
