//! The nRF51 as it is on robots: with old firmware and with new, with a queue that drops silently, and restarted while the
//! robot runs. And robots that have one id.

use std::time::Duration;

use bittybuzz_comms::syslink::{Ping, SWARM_PORT};
use bittybuzz_hil::{Command, EmulatorEvent, Member, Swarm, TimedEvent, frames, resets};

const CHANNEL: u8 = 0x01;
const READY: u8 = 0x0b;
const P2P: u8 = 0x0a;

const IDLE: &str = "function step() { }";

/// Sends with every step as much as its queue takes: in each frame the largest message.
const TALKATIVE: &str = "\
function init() { n = 0 t = {} var i = 0 for(i = 0, i < 30, i = i + 1) { t[i] = 1000000 + i } }
function step() {
  n = n + 1
  t[0] = n
  neighbors.broadcast(\"much\", t)
  neighbors.broadcast(\"more\", n)
}
";

/// Today's firmware, as Nordic's manuals say, with a shutdown of Bluetooth that takes so long.
fn radio_processor(ble_shutdown_us: u64) -> Command {
    Command::RadioProcessor { ready: true, rts_bytes: 2, ble_shutdown_us, ble_masks: false }
}

fn old_firmware() -> Command {
    Command::RadioProcessor { ready: false, rts_bytes: 2, ble_shutdown_us: 5000, ble_masks: false }
}

/// A robot, before it is switched on.
fn robot(script: &str, radio: &Command) -> Swarm {
    let mut swarm = Swarm::crazyflies(script, &[7]);
    swarm.members()[0].robot.execute(radio);
    swarm
}

fn said(member: &Member, text: &str) -> usize {
    member.trace_log.firmware.iter().filter(|line| line.contains(text)).count()
}

fn sent(member: &Member, kind: u8) -> Vec<Duration> {
    frames(&member.robot.events, kind).map(|(at, _)| at).collect()
}

fn count_p2p(events: &[TimedEvent]) -> usize {
    events.iter().filter(|event| matches!(event.event, EmulatorEvent::P2p { .. })).count()
}

/// Firmware from before October 2025 does not know RADIO_READY. The robot asks a few times, says that the radio is ready, and
/// asks no more.
#[test]
fn an_old_nrf51_is_set_up() {
    for (radio, most) in [(old_firmware(), 11), (radio_processor(5000), 1)] {
        let mut swarm = robot(IDLE, &radio);
        swarm.run_ms(4000);
        let member = &swarm.members()[0];
        assert_eq!(said(member, "radio ready"), 1, "{:?}", member.trace_log.firmware);
        assert_eq!(sent(member, CHANNEL).len(), 1);
        let asked = sent(member, READY);
        assert!((1..=most).contains(&asked.len()), "{asked:?}");
        assert!(asked.iter().all(|at| *at < Duration::from_millis(1500)), "{asked:?}");
    }
}

/// The nRF51 restarts. It hears other robots all the time, so that frames come from it, but reports nothing until it is
/// asked again.
#[test]
fn an_nrf51_that_restarts_is_set_up_again() {
    for radio in [old_firmware(), radio_processor(5000)] {
        let mut swarm = robot(TALKATIVE, &radio);
        swarm.run_ms(3000);
        swarm.members()[0].robot.execute(&Command::RadioRestart);
        for _ in 0..50 {
            let member = &mut swarm.members()[0];
            let at = member.robot.now();
            let strange = Command::P2p { at, port: 3, rssi: 60, payload: vec![1, 2, 3] };
            member.robot.execute(&strange);
            swarm.run_ms(100);
        }
        let member = &mut swarm.members()[0];
        assert_eq!(resets(&member.robot.events), []);
        assert_eq!(said(member, "radio ready"), 2, "{radio:?}: {:?}", member.trace_log.firmware);
        let channel = sent(member, CHANNEL);
        assert_eq!(channel.len(), 2, "{channel:?}");
        // Not before it is sure that reports have ended, and soon after.
        let after = channel[1] - Duration::from_millis(3000);
        assert!((1500..3000).contains(&after.as_millis()), "{after:?}");
        // Until then it gets no messages but those that waited while it started: Bluetooth is on again.
        let (started, asked) = (Duration::from_millis(3200), channel[1] - Duration::from_millis(5));
        let early = sent(member, P2P).into_iter().filter(|at| (started..asked).contains(at));
        assert_eq!(early.count(), 0);
        let end = member.robot.now() - Duration::from_secs(1);
        let talks = member.robot.events.iter().filter(|event| event.at > end);
        assert!(
            talks.filter(|event| matches!(event.event, EmulatorEvent::P2p { .. })).count() > 20
        );
    }
}

/// The traffic of a robot in a dense swarm gets through whole: messages of its own, frames of others as fast as the air
/// carries them, and pauses in which the nRF51 receives nothing.
fn no_byte_is_lost(rts_bytes: u8, ble_shutdown_us: u64, ble_masks: bool) {
    let radio = Command::RadioProcessor { ready: true, rts_bytes, ble_shutdown_us, ble_masks };
    let mut swarm = robot(TALKATIVE, &radio);
    // 415 us on the air, more than the line takes.
    let flood = |swarm: &mut Swarm, frames: u64| {
        for number in 0..frames {
            let member = &mut swarm.members()[0];
            let at = member.robot.now() + Duration::from_micros(500 + 430 * number);
            let payload = vec![number as u8; 60];
            member.robot.execute(&Command::P2p { at, port: 3, rssi: 60, payload });
        }
    };
    // The first frame that the radio sends, or receives, shuts Bluetooth down.
    swarm.run_ms(1500);
    for pause_ms in [3, 20, 60, 90] {
        flood(&mut swarm, 500);
        swarm.run_ms(50);
        swarm.members()[0].robot.execute(&Command::FlowControl { full: true });
        swarm.run_ms(pause_ms);
        swarm.members()[0].robot.execute(&Command::FlowControl { full: false });
        swarm.run_ms(250);
    }
    let member = &mut swarm.members()[0];
    let statistics = member.robot.board();
    let on_air = count_p2p(&member.robot.events);
    println!(
        "{on_air} frames on the air, {} bytes received, {statistics:?}",
        statistics.peer_received
    );
    assert!(on_air > 80, "{on_air}");
    assert!(statistics.radio_unheard > 0 && statistics.radio_overflown > 0);
    let lost = [statistics.peer_dropped, statistics.peer_overruns, statistics.peer_bad_checksums];
    assert_eq!(lost, [0; 3]);
    // That one may be cut off which shuts Bluetooth down.
    assert!(statistics.radio_cut <= 1, "{}", statistics.radio_cut);
}

#[test]
fn no_byte_is_lost_in_a_queue_that_is_not_read() {
    no_byte_is_lost(2, 90_000, false);
}

#[test]
fn no_byte_is_lost_where_rts_comes_early() {
    no_byte_is_lost(1, 20_000, true);
}

#[test]
fn no_byte_is_lost_where_rts_comes_late() {
    no_byte_is_lost(4, 20_000, true);
}

#[test]
fn no_byte_is_lost_without_bluetooth() {
    no_byte_is_lost(2, 0, false);
}

/// Two robots have one id. No frame that begins with it starts a storm: an answer is never answered.
#[test]
fn no_frame_starts_a_storm_among_robots_of_one_id() {
    let mut swarm = Swarm::crazyflies(IDLE, &[7, 7]);
    swarm.run_ms(300);
    for port in 0..16 {
        for start in [&[][..], &[0xb0], &[0xb1], &[0xb2], &[0xb3]] {
            let payload = [start, &7_u16.to_le_bytes(), b"are you there?"].concat();
            // The other one hears what this one answers.
            let member = &mut swarm.members()[0];
            let at = member.robot.now();
            member.robot.execute(&Command::P2p { at, port, rssi: 60, payload });
            let before: Vec<usize> =
                swarm.members().iter().map(|member| member.robot.events.len()).collect();
            swarm.run_ms(20);
            for (member, before) in swarm.members().iter().zip(before) {
                let answers = count_p2p(&member.robot.events[before..]);
                assert!(answers <= 1, "port {port}, {start:x?}: {answers}");
            }
        }
    }
}

fn ping(id: u16) -> Vec<u8> {
    let ping = Ping { robot: id, is_answer: false, data: b"?" };
    ping.write(&mut [0; 60]).unwrap().to_vec()
}

/// Ten answers in a second, however many pings come.
#[test]
fn pings_are_answered_at_a_limited_rate() {
    let mut swarm = Swarm::crazyflies(IDLE, &[7]);
    swarm.run_ms(300);
    let before = swarm.members()[0].robot.events.len();
    for _ in 0..500 {
        let member = &mut swarm.members()[0];
        let at = member.robot.now();
        member.robot.execute(&Command::P2p { at, port: SWARM_PORT, rssi: 60, payload: ping(7) });
        swarm.run_ms(2);
    }
    let answers = count_p2p(&swarm.members()[0].robot.events[before..]);
    assert!((10..=11).contains(&answers), "{answers}");
}

/// A robot that hears its own id says so once, also where no script sends, and counts.
#[test]
fn robots_of_one_id_notice_each_other() {
    let mut swarm = Swarm::crazyflies(IDLE, &[7, 7, 9]);
    swarm.run_ms(300);
    // All hear it; one answers.
    let payload = ping(7);
    let member = &mut swarm.members()[0];
    let at = member.robot.now();
    member.robot.execute(&Command::P2p { at, port: SWARM_PORT, rssi: 60, payload });
    swarm.run_ms(2_700);
    let warned = |member: &Member| said(member, "another robot has id 7, too");
    let members = swarm.members();
    assert_eq!(members.iter().map(warned).collect::<Vec<_>>()[1..], [1, 0]);
    assert_eq!(said(&members[1], "same_id: 1"), 1, "{:?}", members[1].trace_log.firmware);
    assert_eq!(said(&members[2], "same_id: 0"), 1, "{:?}", members[2].trace_log.firmware);
}
