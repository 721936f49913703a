//! Bytes and pulses that robots receive: the serial link of a Crazyflie, payloads of Zooids, light
//! of Kilobots.

use bittybuzz_comms::infrared::{self, FaultReport};
use bittybuzz_comms::nrf24::{self, Payload};
use bittybuzz_comms::syslink::{
    Crtp, MTU, P2P_MAX, Ping, Position, SWARM_PORT, SwarmFrame, SyslinkFrame, SyslinkPacket,
    SyslinkParser, kind,
};
use bittybuzz_kilobot::mode::ModeSwitch;
use bittybuzz_kilobot::receiver::{BIT, DEADLINE, Pulse, Receiver};

use crate::choices::Choices;

/// Bytes around the data of a frame, and one more frame's length of silence: the longest that a
/// false start waits.
const SILENCE: usize = 2 * (MTU + 6);

/// Sends bytes and good frames over the serial link, reads the frames, and writes them again.
/// Returns true if one of them had a meaning.
pub fn syslink(data: &[u8]) -> bool {
    let mut choices = Choices::new(data);
    let mut parser = SyslinkParser::new();
    let mut understood = false;
    while !choices.is_empty() {
        for byte in serial(&mut choices) {
            parser.push(byte, |frame| understood |= check_frame(frame));
        }
    }
    // Whatever came before, a good frame gets through, if nothing else did in its place.
    let good = SyslinkFrame::new(3, &[1, 2, 3]).expect("it is short");
    let mut frames = 0;
    for byte in good.bytes().as_slice().iter().chain(&[0; SILENCE]) {
        parser.push(*byte, |_| frames += 1);
    }
    assert!(frames > 0, "the parser is deaf");
    understood
}

/// Noise, a frame, or a frame with a mistake.
fn serial(choices: &mut Choices<'_>) -> Vec<u8> {
    let noise = |choices: &mut Choices<'_>, length: usize| -> Vec<u8> {
        (0..length).map(|_| choices.byte()).collect()
    };
    let change = choices.below(8);
    if change == 0 {
        let length = choices.below(256);
        return noise(choices, length);
    }
    let kind = [
        kind::RADIO_RAW,
        kind::RADIO_CHANNEL,
        kind::RADIO_DATARATE,
        kind::RADIO_RSSI,
        kind::RADIO_ADDRESS,
        kind::RADIO_POWER,
        kind::RADIO_P2P_BROADCAST,
        kind::RADIO_READY,
        kind::PM_BATTERY_STATE,
        choices.byte(),
    ][choices.below(10)];
    // The length that the kind asks for, and beginnings that mean something, or anything.
    let (beginning, length): (&[u8], usize) = match (kind, choices.below(8)) {
        (_, 0) => (&[], choices.below(256)),
        (kind::RADIO_CHANNEL | kind::RADIO_DATARATE | kind::RADIO_RSSI | kind::RADIO_POWER, _) => {
            (&[], 1)
        }
        (kind::RADIO_ADDRESS, _) => (&[], 5),
        (kind::RADIO_P2P_BROADCAST, 1..4) => (&[SWARM_PORT, 40, 0xb0], choices.below(60)),
        (kind::RADIO_P2P_BROADCAST, 4) => (&[SWARM_PORT, 40, 0xb2], choices.below(60)),
        (kind::RADIO_P2P_BROADCAST, _) => (&[SWARM_PORT, 40, 0xb1], choices.below(60)),
        (kind::RADIO_RAW, 1) => (&[0xf0], choices.below(30)),
        // A pose.
        (kind::RADIO_RAW, _) => (&[0x61, 8], 28),
        (kind::PM_BATTERY_STATE, 1..4) => (&[1, 0, 0, 0x80, 0x40], 4),
        (kind::PM_BATTERY_STATE, _) => (&[], 13),
        _ => (&[], 0),
    };
    let data = [beginning, &noise(choices, length)].concat();
    let Ok(frame) = SyslinkFrame::new(kind, &data) else { return data };
    let mut bytes = frame.bytes().as_slice().to_vec();
    if change == 1 {
        let at = choices.below(bytes.len());
        bytes[at] ^= choices.byte();
    }
    bytes
}

/// Reads a frame and what is in it. Returns whether it means something.
fn check_frame(frame: SyslinkFrame<'_>) -> bool {
    let mut again = 0;
    let mut parser = SyslinkParser::new();
    for byte in frame.bytes().as_slice() {
        parser.push(*byte, |read| {
            assert_eq!((read.kind(), read.data()), (frame.kind(), frame.data()));
            again += 1;
        });
    }
    assert_eq!(again, 1, "a frame is not received as it was sent");
    let Ok(packet) = SyslinkPacket::received(frame) else { return false };
    let mut room = [0; MTU];
    assert!(packet.frame(&mut room).is_ok(), "{packet:?} cannot be sent");
    match packet {
        SyslinkPacket::Raw(data) => Crtp::parse(data).is_some(),
        SyslinkPacket::P2pReceived { data, .. } => check_swarm_frame(data) || check_ping(data),
        _ => true,
    }
}

fn check_ping(data: &[u8]) -> bool {
    let Some(read) = Ping::parse(data) else { return false };
    assert_eq!(read.write(&mut [0; P2P_MAX]), Some(data));
    let answer = Ping { is_answer: true, ..read };
    assert!(read.is_answer || answer.write(&mut [0; P2P_MAX]) != Some(data));
    true
}

fn check_swarm_frame(data: &[u8]) -> bool {
    let Some(read) = SwarmFrame::parse(data) else { return false };
    assert_eq!(read.write(&mut [0; P2P_MAX]), Some(data));
    if let Some(position) = read.position {
        assert_eq!(Position::from_mm(position.mm()), Some(position));
    }
    true
}

/// Reads a payload and writes it again: the bytes themselves, after a byte that may make them one
/// of ours. Returns whether they were.
pub fn nrf24(data: &[u8]) -> bool {
    let Some((first, rest)) = data.split_first() else { return false };
    let tags: &[u8] = match first % 4 {
        0 => &[0xb0],
        1 | 2 => &[0xb1],
        _ => &[],
    };
    let bytes = [tags, rest].concat();
    let Some(payload) = Payload::parse(&bytes) else { return false };
    let mut room = [0; nrf24::PAYLOAD_MAX];
    let length = payload.write(&mut room).expect("a payload that was read");
    assert_eq!(room[..length], bytes, "{payload:?}");
    true
}

/// Sends light to a Kilobot: pulses anywhere, and messages, some with a mistake. A message after
/// silence is received. Returns whether one was received whole.
pub fn ir(data: &[u8]) -> bool {
    let mut choices = Choices::new(data);
    let mut receiver = Receiver::new();
    let mut mode = ModeSwitch::new(1, [0; 4]);
    let mut now = 0u16;
    let mut understood = false;
    while !choices.is_empty() {
        let pulses = light(&mut choices);
        for after in pulses {
            if receiver.is_busy() && after > DEADLINE {
                receiver.give_up();
            }
            now = now.wrapping_add(after);
            if receiver.pulse(now) == Pulse::Last {
                understood |= check_message(&receiver.received.message, &mut mode);
            }
        }
    }
    receiver.give_up();
    let message = infrared::sealed(choices.byte(), &[0xa5; 9]);
    let mut pulse = Pulse::Stray;
    for after in pulses_of(&message) {
        now = now.wrapping_add(after);
        pulse = receiver.pulse(now);
    }
    assert_eq!((pulse, receiver.received.message), (Pulse::Last, message));
    understood
}

/// Returns times from pulse to pulse: noise, or those of a message of which some are changed.
fn light(choices: &mut Choices<'_>) -> Vec<u16> {
    let kind = choices.byte();
    if kind.is_multiple_of(4) {
        let time = |choices: &mut Choices<'_>| u16::from_le_bytes([choices.byte(), choices.byte()]);
        return (0..choices.below(8)).map(|_| time(choices)).collect();
    }
    let data = [0; 9].map(|_: u8| choices.byte());
    let mut message = infrared::sealed(choices.byte() % 160, &data);
    if kind % 4 == 1 {
        message[choices.below(message.len())] ^= choices.byte();
    }
    let mut pulses = pulses_of(&message);
    for _ in 0..usize::from(kind >> 6) {
        let at = choices.below(pulses.len());
        match choices.below(4) {
            // Another sender, or one whose clock is wrong.
            0 => pulses.insert(at, u16::from(choices.byte())),
            1 => {
                pulses.remove(at);
            }
            2 => pulses[at] = pulses[at].wrapping_add(u16::from(choices.byte())),
            _ => pulses[at] = pulses[at].wrapping_sub(u16::from(choices.byte())),
        }
    }
    pulses
}

/// Returns the times from pulse to pulse of a message after silence.
fn pulses_of(message: &[u8]) -> Vec<u16> {
    // Places of the pulses in bits: each byte has a start bit, eight bits and a stop bit.
    let mut bits = vec![0, 9];
    for (byte, start) in message.iter().zip((10u16..).step_by(10)) {
        let set = (0..8).filter(|bit| byte >> bit & 1 != 0).map(|bit| start + 1 + bit);
        bits.extend(std::iter::once(start).chain(set).chain([start + 9]));
    }
    let after = bits.windows(2).map(|pair| (pair[1] - pair[0]) * BIT);
    std::iter::once(2 * DEADLINE).chain(after).collect()
}

/// Reads a message in every way that a robot and a computer do. Returns whether it is whole.
fn check_message(message: &[u8; infrared::MESSAGE], mode: &mut ModeSwitch) -> bool {
    let digits: String = message.iter().map(|byte| format!("{byte:02x}")).collect();
    assert_eq!(infrared::from_line(format!("ir {digits}\r\n").as_bytes()).as_ref(), Some(message));
    let Some((kind, data)) = infrared::opened(message) else {
        assert!(infrared::frame_of(message).is_none() && FaultReport::of(message).is_none());
        return false;
    };
    assert_eq!(infrared::sealed(kind, data), *message);
    if let Some(frame) = infrared::frame_of(message) {
        assert_eq!(infrared::message_of(&frame).as_ref(), Some(message));
    }
    if let Some(report) = FaultReport::of(message) {
        assert_eq!(FaultReport::of(&report.message()), Some(report));
    }
    let _ = mode.handle(kind, data);
    true
}
