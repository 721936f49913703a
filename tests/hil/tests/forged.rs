//! A forged message stops no image for good: on each topic and key of an example each robot receives a value of each
//! class. It ends a call at most, or the script starts again, and LEDs and motors go on.
//!
//! `tests/tests/protocol/endurance/forged.rs` does the same with every example and more values, on virtual machines of this process.

use std::path::Path;
use std::time::Duration;

use bittybuzz_comms::infrared::{self, FaultReport};
use bittybuzz_comms::nrf24::{PAYLOAD_MAX, Payload};
use bittybuzz_comms::syslink::{P2P_MAX, SWARM_PORT, SwarmFrame};
use bittybuzz_emulation::{AVR_FLASH_SIZE, FirmwareImage};
use bittybuzz_hil::kilobots::behavior;
use bittybuzz_hil::{
    Command, EmulatorEvent, Kilobots, Place, Swarm, Table, TimedEvent, TraceLog, compiled_for,
};
use bittybuzz_kilobot::phase::{self, Phase};
use bittybuzz_testkit::FORGER;
use bittybuzz_testkit::forged::{self, Target};
use bittybuzz_tests::files;
use bittybuzz_vm_core::builtin::string;
use bittybuzz_vm_core::message::ScriptIdentity;
use bittybuzz_vm_core::message::content::ContentItem;
use bittybuzz_vm_core::number::{Full, Profile, Tiny};

/// Those of the forged values that the robots receive: one of each class.
const CLASSES: [&str; 5] = ["nil", "32767", "string", "a table", "a function"];

/// The message comes between the fifth step and the sixth.
const WARM_MS: u64 = 550;
/// Between two frames of a message.
const APART: Duration = Duration::from_millis(10);
/// The robot is watched from then on: a hundred steps and a pause of 1 s, or pauses of 1, 2 and 4 s.
const WATCHED_MS: u64 = 11_000;
/// Steps after the message, of a script that starts again at most once.
const STEPS_MIN: u32 = 95;

/// What a robot did after a message.
#[derive(Debug)]
struct Aftermath {
    steps: u32,
    restarts: usize,
    /// The message ended in a fault, or was counted as one of a class that the script never sends.
    has_arrived: bool,
    /// A LED or motor changed later than a second after the message.
    has_shown: bool,
}

/// Forges messages for the targets of an example with these names. `play` sends frames to a robot with that script.
/// Returns the number of messages that ended in a fault or were dropped.
fn survive<P: Profile>(
    robot: &str,
    example: &str,
    names: &[&str],
    play: impl Fn(&str, &[Vec<u8>]) -> Aftermath,
) -> usize {
    let text = files::read(example);
    let symbols = compiled_for(robot, &text).symbols.unwrap();
    let strings = string::COUNT + symbols.strings.len() as u16;
    let script = ScriptIdentity { hash: symbols.script_hash, strings };
    let mut targets: Vec<(String, Target<P>)> = forged::targets(&text, &symbols.strings);
    targets.retain(|(name, _)| names.contains(&name.as_str()));
    assert_eq!(targets.len(), names.len(), "{example}");
    let values: Vec<(&str, Vec<ContentItem<P>>)> =
        forged::values().into_iter().filter(|(class, _)| CLASSES.contains(class)).collect();
    assert_eq!(values.len(), CLASSES.len());
    let (mut arrived, mut wrong) = (0, Vec::new());
    for (name, target) in targets {
        for (class, items) in &values {
            let after = play(&text, &forged::frames(script, target, items));
            println!("{robot} {example} {name} = {class}: {after:?}");
            arrived += usize::from(after.has_arrived);
            let goes_on = after.restarts >= 2 || after.steps >= STEPS_MIN;
            if !goes_on || !after.has_shown {
                wrong.push(format!("{name} = {class}: {after:?}"));
            }
        }
    }
    assert!(wrong.is_empty(), "{robot}, {example}: {wrong:#?}");
    arrived
}

fn has_shown(events: &[TimedEvent], since: Duration) -> bool {
    let late = since + Duration::from_secs(1);
    events.iter().filter(|event| event.at > late).any(|event| {
        matches!(
            event.event,
            EmulatorEvent::Led { .. } | EmulatorEvent::Motor { .. } | EmulatorEvent::Color { .. }
        )
    })
}

/// The aftermath on a robot that has a debug probe.
fn aftermath(trace_log: &TraceLog, events: &[TimedEvent], since: Duration) -> Aftermath {
    // Steps are printed every hundred; five were completed before the message.
    let steps = trace_log
        .firmware
        .iter()
        .rev()
        .find_map(|line| line.split_once(" steps, ")?.0.parse().ok());
    let is = |record: &&String, start: &str| record.starts_with(start);
    Aftermath {
        steps: steps.unwrap_or(5) - 5,
        restarts: trace_log
            .records
            .iter()
            .filter(|r| is(r, "Restart") && r.contains("pause: 0"))
            .count(),
        has_arrived: trace_log.unused.messages.malformed > 0
            || trace_log.records.iter().any(|r| is(&r, "fault") || is(&r, "contained")),
        has_shown: has_shown(events, since),
    }
}

fn play_on_a_kilobot(program: &Path, frames: &[Vec<u8>]) -> Aftermath {
    let image = FirmwareImage::open_avr(program, AVR_FLASH_SIZE).unwrap();
    let phase = image.symbol(phase::SYMBOL).unwrap();
    let mut robots = Kilobots::with_program(program, 1);
    robots.start();
    robots.run_ms(WARM_MS);
    let since = robots.now();
    for frame in frames {
        let payload = infrared::message_of(frame).unwrap().to_vec();
        robots.execute_on(0, &Command::Radio { at: robots.now(), payload });
        robots.run_for(APART);
    }
    let (mut restarts, mut was_pause) = (0, false);
    for _ in 0..WATCHED_MS / 20 {
        robots.run_ms(20);
        // After a restart it waits for a tick of 100 ms.
        let phase = robots.memory(0, phase, 1)[0];
        let is_pause = phase == Phase::Rests as u8 || phase == Phase::Relays as u8;
        restarts += usize::from(was_pause && !is_pause);
        was_pause = is_pause;
    }
    let events = &robots.events[0];
    let steps =
        events.iter().filter(|event| event.at > since && event.event == EmulatorEvent::Step);
    Aftermath {
        steps: steps.count() as u32,
        restarts,
        has_arrived: robots.sent(0).iter().any(|(_, sent)| FaultReport::of(sent).is_some()),
        has_shown: has_shown(events, since),
    }
}

fn play_on_a_zooid(script: &str, frames: &[Vec<u8>]) -> Aftermath {
    let mut table = Table::new(script, &[1]);
    table.put(0, Place::at(100.0, 50.0, 30.0));
    table.run_ms(WARM_MS);
    let since = table.now();
    for frame in frames {
        let mut room = [0; PAYLOAD_MAX];
        let payload = Payload { robot: FORGER, position: Some([0, 50]), message: frame };
        let length = payload.write(&mut room).unwrap();
        table.radio(table.now(), &room[..length]);
        table.run(APART);
    }
    table.run_ms(WATCHED_MS);
    let zooid = &table.zooids()[0];
    aftermath(&zooid.trace_log, &zooid.events, since)
}

fn play_on_a_crazyflie(script: &str, frames: &[Vec<u8>]) -> Aftermath {
    // The robot's id says how long it works at the barrier: 5.2 s.
    let mut swarm = Swarm::crazyflies(script, &[6]);
    swarm.run_ms(WARM_MS);
    let since = swarm.members()[0].robot.now();
    for frame in frames {
        let mut room = [0; P2P_MAX];
        let sent = SwarmFrame { robot: FORGER, position: None, message: frame };
        let payload = sent.write(&mut room).unwrap().to_vec();
        let robot = &mut swarm.members()[0].robot;
        let at = robot.now();
        robot.execute(&Command::P2p { at, port: SWARM_PORT, rssi: 60, payload });
        swarm.run_ms(APART.as_millis() as u64);
    }
    swarm.run_ms(WATCHED_MS);
    let member = &swarm.members()[0];
    aftermath(&member.trace_log, &member.robot.events, since)
}

/// Otherwise the messages may have been lost, and a test shows nothing.
fn assert_arrived(arrived: usize) {
    assert!(arrived > 0, "no message ended in a fault or was dropped");
}

#[test]
fn a_kilobot_survives_forged_messages() {
    let played = [("random_walk", "topic here"), ("stigmergy", "key color with clock 1000")];
    let arrived = played.map(|(name, target)| {
        let example = format!("examples/kilobot/{name}.bzz");
        survive::<Tiny>("kilobot", &example, &[target], |_, frames| {
            play_on_a_kilobot(&behavior(name), frames)
        })
    });
    assert_arrived(arrived.iter().sum());
}

#[test]
fn a_zooid_survives_forged_messages() {
    let (blinking, auction) = ("examples/swarm/blinking.bzz", "examples/swarm/auction.bzz");
    let keys = [0, 1, 2, 3].map(|key| format!("key {key} with clock 1000"));
    let keys = keys.each_ref().map(String::as_str);
    let arrived = survive::<Tiny>("zooids", blinking, &["topic clock"], play_on_a_zooid)
        + survive::<Tiny>("zooids", auction, &keys, play_on_a_zooid);
    assert_arrived(arrived);
}

/// Keeps a processor busy for forty seconds. CI has the same test of Zooids.
#[test]
#[ignore = "soak"]
fn a_crazyflie_survives_forged_messages() {
    let (blinking, barrier) = ("examples/swarm/blinking.bzz", "examples/swarm/barrier.bzz");
    let keys = ["key 0 with clock 1000", "key 1 with clock 1000"];
    let arrived = survive::<Full>("crazyflie", blinking, &["topic clock"], play_on_a_crazyflie)
        + survive::<Full>("crazyflie", barrier, &keys, play_on_a_crazyflie);
    assert_arrived(arrived);
}
