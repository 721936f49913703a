//! Robots of a run are inspected between ticks, and the run is the same.

use crate::busy::{rest, setup};
use crate::script::{folder, run_with};
use bittybuzz_arena::run::Simulation;
use bittybuzz_inspect::{Inspection, Limits, QueuedMessage, ScriptValue};

fn global<'a>(found: &'a Inspection, name: &str) -> &'a ScriptValue {
    &found.globals.iter().find(|global| global.name == name).unwrap().value
}

#[test]
fn inspection_between_ticks_changes_nothing() {
    let setup = setup("inspection", "");
    let expected = rest(&mut Simulation::new(setup.clone(), 5, 1).unwrap());
    let mut simulation = Simulation::new(setup.clone(), 5, 1).unwrap();
    let (mut neighbors, mut entries, mut waiting, mut messages) = (0, 0, 0, 0);
    for (digest, lines) in expected {
        simulation.tick().unwrap();
        for number in 0..simulation.robot_count() {
            let Some(found) = simulation.inspect(number, Limits::NONE) else { continue };
            // The values of expectations, read by another way.
            let names = simulation.program(number).globals();
            let at = names.iter().position(|name| name == "heard").unwrap();
            assert_eq!(names[at], found.globals[at].name);
            neighbors += found.neighbors.len();
            entries += found.stigmergies.iter().map(|one| one.entries.len()).sum::<usize>();
            let queues = found.queues.as_ref().unwrap();
            assert!(queues.inbox.messages.len() <= queues.inbox.capacity);
            assert!(queues.outbox.messages.len() <= queues.outbox.capacity);
            waiting += queues.inbox.messages.len() + queues.outbox.messages.len();
            let is_broadcast = |message: &&QueuedMessage<ScriptValue>| {
                let topic = ScriptValue::String("n".to_owned());
                matches!(message, QueuedMessage::Broadcast { topic: on, .. } if *on == topic)
            };
            let queued = queues.inbox.messages.iter().chain(&queues.outbox.messages);
            messages += queued.filter(is_broadcast).count();
            if let ScriptValue::Table(far) = global(&found, "far") {
                assert!(found.objects.contains_key(far));
            }
        }
        assert_eq!((simulation.digest(), simulation.take_log()), (digest, lines));
    }
    assert!(neighbors > 0 && entries > 0 && waiting > 0 && messages > 0);
}

#[test]
fn an_absent_robot_has_no_inspection() {
    let more = "[[robots]]\nname = \"late\"\nrobot = \"kilobot\"\nscript = \"kilobot.bzz\"\ncount = 1\npresent = false\nfirst_id = 90\n";
    let simulation = Simulation::new(setup("inspection-absent", more), 5, 1).unwrap();
    let last = simulation.robot_count() - 1;
    assert!(simulation.inspect(last, Limits::NONE).is_none());
    assert!(simulation.inspect(last + 1, Limits::NONE).is_none());
    assert!(simulation.inspect(0, Limits::NONE).is_some());
}

/// A foot-bot's script gets cm, people get mm.
#[test]
fn neighbors_are_shown_in_mm_in_any_unit_of_scripts() {
    let script = "d = 0\nfunction step() { neighbors.broadcast(\"x\", 1) \
                  neighbors.foreach(function(i, data) { d = data.distance }) }\n";
    let folder = folder("unit", &[("s.bzz", script)]);
    let text = "[world]\nsize = [2000, 2000]\nduration = 2\n\n[[robots]]\nrobot = \"footbot\"\n\
                script = \"s.bzz\"\npositions = [[0, 0], [500, 0]]\n";
    let mut last = None;
    run_with(&folder, text, 1, |run| last = run.inspect(0, Limits::NONE));
    let memory = last.unwrap();
    let [neighbor] = &memory.neighbors[..] else { panic!("{:?}", memory.neighbors) };
    assert_eq!(neighbor.place.unwrap()[0], 500.0);
    assert_eq!(*global(&memory, "d"), ScriptValue::Float(50.0));
}

/// After a minute of 7 in the air, from 4.15 V to 3.2 V; and as an event sets it.
#[test]
fn the_battery_is_the_one_that_the_script_reads() {
    let flier = "mv = 0\nfunction init() { takeoff(500) }\nfunction step() { mv = battery() }\n";
    let folder = folder("battery", &[("fly.bzz", flier), ("rest.bzz", "mv = 0\n")]);
    let text = "[world]\nsize = [2000, 2000]\nduration = 70\n\n\
                [[robots]]\nrobot = \"crazyflie\"\nscript = \"fly.bzz\"\ncount = 1\nmodel = { armed = true }\n\n\
                [[robots]]\nrobot = \"kilobot\"\nscript = \"rest.bzz\"\ncount = 1\n\n\
                [[event]]\nat = 65\nbattery = 0\nvolts = 3.5\n";
    let mut read = Vec::new();
    run_with(&folder, text, 1, |run| {
        let memory = run.inspect(0, Limits::NONE).unwrap();
        if let ScriptValue::Int(mv) = global(&memory, "mv") {
            read.push((f64::from(run.battery(0).unwrap().millivolts), f64::from(*mv)));
        }
        assert_eq!(run.battery(1), None);
    });
    let flown = |seconds: f64| 4150.0 - (4150.0 - 3200.0) * seconds / 420.0;
    let (known, sensed) = read[600];
    assert!((known - flown(60.0)).abs() < 10.0 && (known - sensed).abs() < 2.0, "{known} {sensed}");
    assert_eq!(read.last(), Some(&(3500.0, 3500.0)));
}
