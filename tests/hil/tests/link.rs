//! The robot's side of syslink, as the nRF51 sees it.

use std::time::Duration;

use bittybuzz_comms::syslink::SWARM_PORT;
use bittybuzz_hil::{
    Command, Core, ECHO_HEADER, EmulatorEvent, RADIO_RAW, Robot, ScriptFile, frames, motors,
    resets, text, trace,
};

use crate::figures::{self, TOLERANCE};

const P2P: u8 = 0x0a;
const SHUTDOWN_ACK: u8 = 0x16;

/// Computes without end in every step, but its motors were set before.
const BUSY: &str = "\
function init() { n = 0 }
function step() {
  n = n + 1
  set_motor(0, 40) set_motor(1, 40) set_motor(2, 40) set_motor(3, 40)
  if(n == 3) { var i = 0 while(1) { i = (i + 1) % 1000 } }
}
";

const IDLE: &str = "function step() { }";

/// Kinds of all frames of the firmware, in order.
fn kinds(robot: &Robot) -> Vec<u8> {
    let frames = robot.events.iter().filter_map(|event| match event.event {
        EmulatorEvent::Syslink { kind, intact, .. } => {
            assert!(intact, "{event:?}");
            Some(kind)
        }
        _ => None,
    });
    frames.collect()
}

fn the_radio_is_set_up_once(core: Core) {
    let mut robot = Robot::crazyflie(core, IDLE);
    robot.run_ms(500);
    // A P2P frame that turns Bluetooth off; battery and signal strength, channel, data rate, address, power, ready; the search
    // for decks, of which there are none.
    assert_eq!(kinds(&robot), [0x0a, 0x14, 0x01, 0x02, 0x05, 0x07, 0x0b, 0x20]);
    let payload = |kind| {
        let payloads = frames(&robot.events, kind).map(|(_, payload)| payload.to_vec());
        payloads.collect::<Vec<_>>()
    };
    assert_eq!(payload(0x01), [[80]]);
    assert_eq!(payload(0x02), [[2]]);
    assert_eq!(payload(0x05), [[0xe7; 5]]);
    let statistics = robot.board();
    assert_eq!((statistics.framing_errors, statistics.peer_framing_errors), (0, 0));
    assert_eq!((statistics.overruns, statistics.peer_bad_checksums), (0, 0));
    assert_eq!(statistics.accesses_without_clock, 0);
    // The clock tree of Bitcraze's firmware: core, APB1, APB2.
    assert_eq!(statistics.clocks_hz, [168_000_000, 42_000_000, 84_000_000]);
    assert!(statistics.unknown.is_empty(), "{:x?}", statistics.unknown);
}

#[test]
fn the_radio_is_set_up_once_on_unicorn() {
    the_radio_is_set_up_once(Core::Unicorn);
}

#[test]
fn the_radio_is_set_up_once_on_qemu() {
    the_radio_is_set_up_once(Core::Qemu);
}

/// On a line that loses every third frame or so the radio is set up all the same.
#[test]
fn the_radio_is_set_up_on_a_bad_line() {
    let mut robot = Robot::crazyflie(Core::Unicorn, IDLE);
    robot.execute(&Command::Link { lose: 0.02, corrupt: 0.02, seed: 7 });
    robot.run_ms(3000);
    robot.execute(&Command::Link { lose: 0.0, corrupt: 0.0, seed: 7 });
    robot.run_ms(200);
    let before = robot.events.len();
    robot.run_ms(1000);
    // Done: nothing more is sent.
    assert_eq!(frames(&robot.events[before..], 0x0b).count(), 0);
    assert!(frames(&robot.events, 0x0b).count() >= 1);
    assert!(robot.ping(1, 10).is_some());
}

/// A step that never ends does not delay the link.
fn a_busy_script_does_not_delay_the_link(core: Core, pings: u8) {
    let mut robot = Robot::crazyflie(core, BUSY);
    robot.run_ms(400);
    let slowest = (0..pings).map(|number| {
        // Different places of a slice.
        robot.run_us(u64::from(number) * 37 % 900);
        robot.ping(number, 10).expect("an echo")
    });
    let slowest = slowest.max().unwrap();
    println!("slowest echo of {pings}: {slowest:?}");
    if core == Core::Unicorn {
        let figures = [("slowest of 100", slowest.as_micros() as u64)];
        figures::check("crazyflie", "echo_us", &figures, TOLERANCE);
    }
    assert!(slowest.as_micros() <= 2000, "{slowest:?}");
}

#[test]
fn a_busy_script_does_not_delay_the_link_on_unicorn() {
    a_busy_script_does_not_delay_the_link(Core::Unicorn, 100);
}

#[test]
fn a_busy_script_does_not_delay_the_link_on_qemu() {
    a_busy_script_does_not_delay_the_link(Core::Qemu, 3);
}

/// Before the power goes the motors stop, and the request is acknowledged, also while the script computes.
#[test]
fn shutdown_stops_the_motors_and_is_acknowledged() {
    let mut robot = Robot::crazyflie(Core::Unicorn, BUSY);
    robot.run_ms(350);
    assert!(motors(&robot.events).iter().all(|duty| *duty > 0.1));
    let asked = robot.now();
    robot.execute(&Command::Shutdown);
    let events = robot.run_ms(20);
    let (acknowledged, _) = frames(&events, SHUTDOWN_ACK).next().expect("an acknowledgement");
    println!("acknowledged after {:?}", acknowledged - asked);
    let figures = [("answer", (acknowledged - asked).as_micros() as u64)];
    figures::check("crazyflie", "shutdown_us", &figures, TOLERANCE);
    assert!((acknowledged - asked).as_micros() <= 2000, "{:?}", acknowledged - asked);
    assert_eq!(motors(&robot.events), [0.0; 4]);
    // Before the acknowledgement, after which the power goes and they stop anyway.
    for motor in 1..=4 {
        let stopped = events.iter().find(
            |event| matches!(event.event, EmulatorEvent::Motor { number, .. } if number == motor),
        );
        let stopped = stopped.unwrap_or_else(|| panic!("motor {motor} does not stop"));
        assert!(stopped.at < acknowledged, "motor {motor}: {:?}", stopped.at);
    }
    let off = events.iter().find_map(|event| match event.event {
        EmulatorEvent::PowerOff { acknowledged } => Some(acknowledged),
        _ => None,
    });
    assert!(off.is_none_or(|acknowledged| acknowledged));
}

/// Frames from other robots arrive, and one that is meant as a ping comes back.
#[test]
fn a_ping_over_the_radio_comes_back() {
    let mut robot = Robot::crazyflie(Core::Unicorn, IDLE);
    robot.run_ms(100);
    let id = robot_id();
    let text = b"are you there?";
    robot.send(P2P, &[&[SWARM_PORT, 60, 0xb2][..], &id.to_le_bytes(), text].concat());
    let events = robot.run_ms(5);
    let (_, answer) = frames(&events, P2P).next().expect("an answer");
    assert_eq!(answer, [&[SWARM_PORT, 0xb3][..], &id.to_le_bytes(), text].concat());
    // To somebody else, on another port, an answer, or without an id: no answer.
    for other in [
        [&[SWARM_PORT, 60, 0xb2][..], &(id ^ 1).to_le_bytes()].concat(),
        [&[15, 60, 0xb2][..], &id.to_le_bytes()].concat(),
        [&[SWARM_PORT, 60, 0xb3][..], &id.to_le_bytes()].concat(),
        vec![SWARM_PORT, 60, 0xb2],
        vec![SWARM_PORT],
        vec![],
    ] {
        // Later than its next answer.
        robot.run_ms(100);
        robot.send(P2P, &other);
        assert_eq!(frames(&robot.run_ms(5), P2P).count(), 0, "{other:?}");
    }
}

/// Frames that arrive take little of the core: the reader is not woken for each byte.
#[test]
fn a_byte_takes_few_instructions() {
    let mut robot = Robot::crazyflie(Core::Unicorn, IDLE);
    robot.run_ms(200);
    let mut instructions = |frames: &[Vec<u8>]| {
        let before = robot.statistics().core.instructions;
        for frame in frames {
            robot.execute(&Command::Bytes { bytes: frame.clone() });
            robot.run_ms(10);
        }
        robot.statistics().core.instructions - before
    };
    let idle = instructions(&vec![Vec::new(); 50]);
    // Packets of other radios, which this robot has no use for.
    let busy = instructions(&vec![frame(RADIO_RAW, &[0x55; 32]).repeat(5); 50]);
    let per_byte = (busy - idle) / (50 * 5 * 38);
    assert!(per_byte <= 300, "{per_byte} instructions a byte");
}

/// As the robot tells it at the start.
fn robot_id() -> u16 {
    let script = ScriptFile::new("id", IDLE);
    let trace = trace(Core::Unicorn, script.path(), 0.1);
    let start = trace.of("start").next().expect("a start");
    u16::try_from(start["robot_id"].as_u64().unwrap()).unwrap()
}

/// What the nRF51 reports of battery and radio reaches the script and the people.
#[test]
fn battery_and_signal_strength_arrive() {
    let source =
        "function init() { n = 0 }\nfunction step() { n = n + 1 if(n == 100) log(battery()) }";
    let script = ScriptFile::new("battery", source);
    let trace = trace(Core::Unicorn, script.path(), 10.4);
    let volts: f64 = trace.log()[0].1.parse().unwrap();
    assert!((3000.0..4300.0).contains(&volts), "{volts} mV");
    let status =
        trace.of("firmware").map(|line| text(&line["text"])).find(|text| text.contains("rssi: -"));
    assert!(status.is_some(), "{:?}", trace.lines);
}

/// While the nRF51 has no room nothing is sent, and nothing is lost then; when it has, all goes on.
#[test]
fn flow_control_is_respected() {
    let mut robot = Robot::crazyflie(Core::Unicorn, IDLE);
    robot.run_ms(100);
    robot.execute(&Command::FlowControl { full: true });
    // What was under way has ended.
    robot.run_us(50);
    let packet = [&[ECHO_HEADER][..], &[7; 29]].concat();
    robot.send(RADIO_RAW, &packet);
    assert_eq!(frames(&robot.run_ms(40), RADIO_RAW).count(), 0);
    robot.execute(&Command::FlowControl { full: false });
    let events = robot.run_ms(5);
    let echoes: Vec<&[u8]> = frames(&events, RADIO_RAW).map(|(_, payload)| payload).collect();
    assert_eq!(echoes, [packet.as_slice()]);
    // In the middle of a frame: the rest follows later, and the frame is whole.
    robot.send(RADIO_RAW, &packet);
    robot.run_us(500);
    robot.execute(&Command::FlowControl { full: true });
    robot.run_ms(30);
    robot.execute(&Command::FlowControl { full: false });
    robot.run_ms(5);
    let statistics = robot.board();
    assert_eq!((statistics.peer_bad_checksums, statistics.peer_dropped), (0, 0));
}

/// A nRF51 that never has room again does not stop the robot.
#[test]
fn a_line_that_stays_blocked_harms_nothing() {
    let mut robot = Robot::crazyflie(
        Core::Unicorn,
        "function init() { n = 0 } function step() { n = n + 1 led(n % 8) }",
    );
    robot.run_ms(100);
    robot.execute(&Command::FlowControl { full: true });
    for number in 0..40 {
        robot.send(RADIO_RAW, &[&[ECHO_HEADER, number][..], &[9; 28]].concat());
        robot.run_ms(100);
    }
    assert_eq!(resets(&robot.events), []);
    let recent = &robot.events[robot.events.len() - 40..];
    assert!(
        recent.iter().filter(|event| matches!(event.event, EmulatorEvent::Led { .. })).count() > 20
    );
    robot.execute(&Command::FlowControl { full: false });
    robot.run_ms(500);
    assert!(robot.ping(200, 20).is_some());
}

/// Everything that reaches the robot's receiver, as fast as the line can: neither harm nor loss afterwards.
/// Returns the longest wait of a received byte.
fn noise(bytes: usize, seed: u64) -> Duration {
    let script = "function init() { n = 0 } function step() { n = n + 1 led(n % 8) log(\"a line of some length \", n, \" \", n, \" \", n) }";
    let mut robot = Robot::crazyflie(Core::Unicorn, script);
    robot.run_ms(200);
    let mut random = seed;
    let mut next = move || {
        random ^= random << 13;
        random ^= random >> 7;
        random ^= random << 17;
        random
    };
    let mut sent = 0;
    while sent < bytes {
        // Noise, starts of frames, whole frames that are cut or changed.
        let mut chunk = Vec::new();
        while chunk.len() < 1000 {
            match next() % 4 {
                0 => chunk.extend((0..next() % 20).map(|_| next() as u8)),
                1 => chunk.extend([0xbc, 0xcf, next() as u8, (next() % 80) as u8]),
                _ => {
                    let payload: Vec<u8> = (0..next() % 65).map(|_| next() as u8).collect();
                    let mut frame = frame((next() % 32) as u8, &payload);
                    match next() % 3 {
                        0 => frame.truncate((next() % 70) as usize),
                        1 => {
                            let at = (next() % frame.len() as u64) as usize;
                            frame[at] ^= 1 << (next() % 8);
                        }
                        _ => {}
                    }
                    // A request to shut down would be obeyed.
                    if frame.get(2) != Some(&0x15) {
                        chunk.extend(frame);
                    }
                }
            }
        }
        sent += chunk.len();
        robot.execute(&Command::Bytes { bytes: chunk });
        // 1 Mbaud: 10 µs a byte.
        robot.run_ms(12);
    }
    assert_eq!(resets(&robot.events), []);
    assert!(
        !robot
            .events
            .iter()
            .any(|event| matches!(event.event, EmulatorEvent::HardwareError { .. }))
    );
    // Two frames may be needed to get out of a false start.
    robot.ping(1, 20);
    for number in 2..12 {
        assert!(robot.ping(number, 5).is_some(), "good frames after the noise are received");
    }
    let before = robot.events.len();
    robot.run_ms(1000);
    let lit = robot.events[before..].iter();
    let changes = lit.filter(
        |event| matches!(&event.event, EmulatorEvent::Led { name, .. } if name == "red_left"),
    );
    assert_eq!(changes.count(), 10, "the script goes on");
    let statistics = robot.board();
    assert_eq!(statistics.overruns, 0);
    // From the end of a byte's stop bit to the read of the data register.
    assert!(statistics.receive_latency.as_micros() <= 10, "{statistics:?}");
    statistics.receive_latency
}

fn frame(kind: u8, payload: &[u8]) -> Vec<u8> {
    let mut frame = vec![0xbc, 0xcf, kind, payload.len() as u8];
    frame.extend(payload);
    let check = frame[2..].iter().fold([0u8; 2], |[a, b], byte| {
        let a = a.wrapping_add(*byte);
        [a, b.wrapping_add(a)]
    });
    frame.extend(check);
    frame
}

/// The parts of a thousand by which the longest wait may differ. It is a handful of instructions, and the
/// order of the image's functions, which depends on the folder of the sources, decides which byte meets
/// them: 291, 333 and 401 ns were seen.
const COINCIDENCE: u64 = 200;

#[test]
fn noise_harms_nothing() {
    let longest = noise(30_000, 0x9e37_79b9_7f4a_7c15);
    let figures = [("longest", longest.as_nanos() as u64)];
    figures::check("crazyflie", "byte_wait_ns", &figures, COINCIDENCE);
}

/// A minute or so: `cargo xtask soak` runs it.
#[test]
#[ignore = "soak"]
fn a_million_bytes_of_noise_harm_nothing() {
    noise(1_000_000, 0x2545_f491_4f6c_dd1d);
}
