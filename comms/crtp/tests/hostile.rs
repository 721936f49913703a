//! Packets of all lengths with anything in them, and frames of other robots.

use bittybuzz_comms::syslink::{SyslinkFrame, SyslinkPacket, SyslinkParser, kind};
use bittybuzz_crtp::{Command, PACKET_MAX, Parameter, Ports, SupervisorInfo, Value};
use bittybuzz_random::Random;

use crate::commands::ports;

/// Checks what must hold after each packet.
fn send(ports: &mut Ports, packet: &[u8], now_ms: u64, info: &SupervisorInfo) {
    let before = ports.refusals().total();
    let reaction = ports.receive(packet, now_ms, info);
    let is_refused = ports.refusals().total() > before;
    if let Some(command) = reaction.command {
        assert!(!is_refused, "{packet:?}");
        let text = format!("{command:?}");
        assert!(!text.contains("NaN") && !text.contains("inf"), "{packet:?}: {text}");
        if let Command::Parameter(change) = command {
            assert_eq!(ports.parameters().get(change.parameter), change.value);
        }
    }
    if let Some(answer) = reaction.answer {
        let bytes = answer.bytes();
        assert!(bytes.len() <= PACKET_MAX);
        assert_eq!(bytes[0], packet[0] & 0xf3, "an answer goes to the port that was asked");
    }
    for &parameter in Parameter::ALL {
        let value = ports.parameters().get(parameter).as_f32();
        let (least, most) = parameter.range();
        assert!((least..=most).contains(&value), "{parameter:?} {value} after {packet:?}");
    }
    for _ in 0..20 {
        let Some(packet) = ports.poll_log(now_ms, |_| Value::Float(f32::NAN)) else { break };
        assert!(packet.bytes().len() <= PACKET_MAX);
    }
}

/// Fills data with bytes that mean something: numbers of all kinds, small numbers, zeros.
fn fill(random: &mut Random, data: &mut [u8]) {
    for four in data.chunks_mut(4) {
        let number: [u8; 4] = match random.below(8) {
            0 => f32::NAN.to_le_bytes(),
            1 => f32::INFINITY.to_le_bytes(),
            2 => f32::MAX.to_le_bytes(),
            3 => f32::MIN_POSITIVE.to_le_bytes(),
            4 => (random.unit_f32() * 2.0 - 1.0).to_le_bytes(),
            5 => random.below(40).to_le_bytes(),
            6 => [0; 4],
            _ => (random.bits() as u32).to_le_bytes(),
        };
        let length = four.len();
        four.copy_from_slice(&number[..length]);
    }
}

#[test]
fn any_packet_of_each_length_is_survived() {
    let mut random = Random::new(6);
    let flying = SupervisorInfo { is_flying: true, ..SupervisorInfo::default() };
    let mut ports = ports();
    let mut now_ms = 0;
    for header in (0..=0xff).filter(|header| header & 0x0c == 0) {
        for first in (0..20).chain([0x7f, 0x80, 0xff]) {
            for length in 0..=32 {
                let mut packet = vec![header; 1 + length];
                fill(&mut random, &mut packet[1..]);
                if let Some(byte) = packet.get_mut(1) {
                    *byte = first;
                }
                now_ms += u64::from(random.below(40));
                let info = if random.chance(0.5) { flying } else { SupervisorInfo::default() };
                send(&mut ports, &packet, now_ms, &info);
            }
        }
    }
    assert!(ports.refusals().total() > 10_000);
}

/// Most of these packets are commands with a changed byte, an other length or an other header.
#[test]
fn changed_packets_are_survived() {
    let vectors: Vec<Vec<u8>> = crate::vectors::packets();
    let mut random = Random::new(7);
    let mut ports = ports();
    for now_ms in 0..200_000 {
        let mut packet = vectors[random.below(vectors.len() as u32) as usize].clone();
        for _ in 0..=random.below(3) {
            let at = random.below(packet.len() as u32) as usize;
            match random.below(4) {
                0 => packet[at] ^= 1 << random.below(8),
                1 => packet[at] = random.bits() as u8,
                2 => packet.truncate(at.max(1)),
                _ => packet.insert(at, random.bits() as u8),
            }
        }
        send(&mut ports, &packet, now_ms, &SupervisorInfo::default());
    }
}

/// The ports take the frames of the radio's address only. A frame of another robot has a type of its
/// own from the nRF51 on, whatever it contains.
#[test]
fn frames_of_other_robots_reach_no_port() {
    for packet in crate::vectors::packets() {
        // Port and signal strength, and the packet as what the other robot says.
        let data = [&[0, 40][..], &packet].concat();
        let frame = SyslinkFrame::new(kind::RADIO_P2P_BROADCAST, &data).unwrap();
        let mut parser = SyslinkParser::new();
        let mut frames = 0;
        for byte in frame.bytes().as_slice() {
            parser.push(*byte, |frame| {
                frames += 1;
                let received = SyslinkPacket::received(frame).unwrap();
                assert!(matches!(received, SyslinkPacket::P2pReceived { .. }), "{received:?}");
            });
        }
        assert_eq!(frames, 1);
    }
}
