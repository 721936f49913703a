//! The content of a robot's machine at its last fault, for those who watch.

use std::path::Path;
use std::sync::Arc;

use crate::script::{folder, read};
use bittybuzz_arena::robot::{Consequence, Interest, PostMortem};
use bittybuzz_arena::run::{EventKind, ObservedEvent, Observer, Session, Setup, Simulation};
use bittybuzz_inspect::{FrameFunction, Inspection, Named, ScriptValue};

/// Robot 1 divides by zero in its tenth step, which is tick 10, and again ten steps after each start.
const SCRIPT: &str = "n = 0\nfunction share(whole) {\n  var rest = n - 10\n  return whole / rest\n}\n\
    function step() {\n  n = n + 1\n  if(id == 1) log(share(100))\n}\n";

fn simulation(test: &str, script: &str, count: u32) -> Simulation {
    let folder = folder(test, &[("s.bzz", script)]);
    start(&folder, count)
}

fn start(folder: &Path, count: u32) -> Simulation {
    let places: Vec<String> = (0..count).map(|number| format!("[{}, 0]", 60 * number)).collect();
    let text = format!(
        "[world]\nsize = [2000, 1000]\nduration = 20\n[medium.ir]\nloss = 0\nrange = 70\nedge = 0\n\
         [[robots]]\nrobot = \"kilobot\"\nscript = \"s.bzz\"\nclock_skew = 0\npositions = [{}]\n",
        places.join(", ")
    );
    let (scenario, programs) = read(folder, &text);
    let setup = Arc::new(Setup::new(scenario, programs).unwrap());
    Simulation::new(setup, 1, 1).unwrap()
}

fn value<'a>(named: &'a [Named], name: &str) -> &'a ScriptValue {
    &named.iter().find(|one| one.name == name).unwrap().value
}

fn content(found: &PostMortem) -> &Inspection {
    found.content.as_ref().unwrap()
}

/// Checks the content at the fault of [`SCRIPT`].
fn check(found: &PostMortem, tick: u64) {
    assert_eq!(found.fault.tick, tick);
    assert!(matches!(found.fault.consequence, Consequence::Pause(_)));
    let content = content(found);
    assert_eq!(value(&content.globals, "n"), &ScriptValue::Int(10));
    let names = content.frames.iter().map(|frame| match &frame.function {
        FrameFunction::Script { name, .. } => name.as_str(),
        other => panic!("{other:?}"),
    });
    assert!(names.eq(["share", "step"]));
    assert_eq!(value(&content.frames[0].locals, "whole"), &ScriptValue::Int(100));
    assert_eq!(value(&content.frames[0].locals, "rest"), &ScriptValue::Int(0));
}

#[test]
fn the_content_at_a_fault_outlives_the_restart() {
    let mut run = simulation("post_mortem", SCRIPT, 3);
    run.keep_post_mortems();
    (0..11).for_each(|_| run.tick().unwrap());
    check(run.post_mortem(1).unwrap(), 10);
    assert!(run.post_mortem(0).is_none() && run.post_mortem(2).is_none());
    // The script has started again, and has forgotten all.
    (0..14).for_each(|_| run.tick().unwrap());
    assert!(!run.is_faulted(1));
    check(run.post_mortem(1).unwrap(), 10);
    // The next fault replaces it.
    (0..10).for_each(|_| run.tick().unwrap());
    check(run.post_mortem(1).unwrap(), 30);
    // A robot that is switched off and on is like new.
    run.command("restart = 1").unwrap();
    run.tick().unwrap();
    assert!(run.post_mortem(1).is_none());
    (0..10).for_each(|_| run.tick().unwrap());
    check(run.post_mortem(1).unwrap(), 45);
}

#[test]
fn nothing_is_kept_for_nobody_and_the_run_is_the_same() {
    let folder = folder("post_mortem_same", &[("s.bzz", SCRIPT)]);
    let (mut bare, mut watched) = (start(&folder, 3), start(&folder, 3));
    watched.keep_post_mortems();
    for _ in 0..60 {
        bare.tick().unwrap();
        watched.tick().unwrap();
        assert_eq!(bare.digest(), watched.digest());
        assert!((0..3).all(|robot| bare.post_mortem(robot).is_none()));
    }
    assert!(watched.post_mortem(1).is_some());
}

#[test]
fn the_content_belongs_to_the_tick_of_the_fault() {
    let mut session = Session::new(simulation("post_mortem_back", SCRIPT, 2), 4);
    session.keep_post_mortems();
    session.go_to(5).unwrap();
    assert!(session.run().post_mortem(1).is_none());
    for tick in [11, 35, 29, 11] {
        session.go_to(tick).unwrap();
        check(session.run().post_mortem(1).unwrap(), if tick > 30 { 30 } else { 10 });
    }
    session.go_to(10).unwrap();
    assert!(session.run().post_mortem(1).is_none(), "the fault is yet to come");
}

#[derive(Default)]
struct Faults(Vec<PostMortem>);

impl Observer for Faults {
    fn interest(&self) -> Interest {
        Interest::default()
    }

    fn see(&mut self, event: ObservedEvent<'_>) {
        if let EventKind::Fault(found) = event.kind {
            self.0.push(found.clone());
        }
    }
}

#[test]
fn the_content_at_a_fault_of_a_listener_has_its_arguments() {
    let script = "t = 0\nfunction init() { neighbors.listen(\"x\", function(topic, sent, from) { sent.x = t }) }\n\
                  function step() { t = t + 1 if(id == 0 and t > 5) neighbors.broadcast(\"x\", 77) }\n";
    let mut run = simulation("post_mortem_listener", script, 2);
    run.keep_post_mortems();
    let mut faults = Faults::default();
    (0..30).for_each(|_| run.tick_observed(&mut faults).unwrap());
    let found = faults.0.last().unwrap();
    assert_eq!(found.fault.consequence, Consequence::Contained);
    let locals = &content(found).frames[0].locals;
    assert_eq!(value(locals, "sent"), &ScriptValue::Int(77));
    assert_eq!(value(locals, "from"), &ScriptValue::Int(0));
    assert_eq!(run.post_mortem(1), Some(found));
}

/// The robot in the middle hears both others, and its listener fails for each message.
#[test]
fn of_the_faults_of_listeners_in_a_tick_the_first_has_the_content() {
    let script = "function init() { neighbors.listen(\"x\", function(topic, sent, from) { sent.x = from }) }\n\
                  function step() { if(id != 1) neighbors.broadcast(\"x\", id) }\n";
    let mut run = simulation("post_mortem_many", script, 3);
    run.keep_post_mortems();
    let mut ticks = 0;
    while !run.is_over() {
        let mut faults = Faults::default();
        run.tick_observed(&mut faults).unwrap();
        let Some((first, further)) = faults.0.split_first() else { continue };
        assert_eq!(run.post_mortem(1), Some(first));
        assert!(first.content.is_some() && further.iter().all(|found| found.content.is_none()));
        ticks += usize::from(!further.is_empty());
    }
    assert!(ticks > 10, "{ticks} ticks with several faults");
}
