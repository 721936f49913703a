//! Hostile streams: good frames are received whatever precedes them.

use bittybuzz_comms::syslink::{FRAME_MAX, MTU, SyslinkFrame, SyslinkPacket, SyslinkParser};
use proptest::prelude::*;

fn bytes(kind: u8, data: &[u8]) -> Vec<u8> {
    SyslinkFrame::new(kind, data)
        .expect("not longer than the link allows")
        .bytes()
        .as_slice()
        .to_vec()
}

fn frames(stream: &[u8]) -> Vec<(u8, Vec<u8>)> {
    let mut parser = SyslinkParser::new();
    let mut found = Vec::new();
    for byte in stream {
        parser.push(*byte, |frame| found.push((frame.kind(), frame.data().to_vec())));
    }
    found
}

/// Finds the frames of a whole stream by their definition.
fn by_definition(stream: &[u8]) -> Vec<(u8, Vec<u8>)> {
    let mut found = Vec::new();
    let mut at = 0;
    while at + 6 <= stream.len() {
        let length = usize::from(stream[at + 3]);
        let end = at + 6 + length;
        let covered = stream.get(at + 2..at + 4 + length);
        let sums = covered.map(|covered| {
            covered.iter().fold((0u32, 0u32), |(a, b), byte| {
                let a = (a + u32::from(*byte)) % 256;
                (a, (a + b) % 256)
            })
        });
        let whole = stream[at..at + 2] == [0xbc, 0xcf] && length <= MTU && end <= stream.len();
        if whole && sums == Some((stream[end - 2].into(), stream[end - 1].into())) {
            found.push((stream[at + 2], stream[at + 4..end - 2].to_vec()));
            at = end;
        } else {
            at += 1;
        }
    }
    found
}

fn any_frame() -> impl Strategy<Value = Vec<u8>> {
    (any::<u8>(), prop::collection::vec(any::<u8>(), 0..=MTU))
        .prop_map(|(kind, data)| bytes(kind, &data))
}

/// Returns bytes that often look like the start of a frame.
fn noise() -> impl Strategy<Value = Vec<u8>> {
    let byte = prop_oneof![Just(0xbc), Just(0xcf), 0u8..4, any::<u8>()];
    prop::collection::vec(byte, 0..120)
}

proptest! {
    #[test]
    fn agrees_with_the_definition(parts in prop::collection::vec(prop_oneof![any_frame(), noise()], 0..6)) {
        // The stream ends with bytes that begin no frame, so that no frame is still pending.
        let stream = [parts.concat(), vec![0; FRAME_MAX]].concat();
        prop_assert_eq!(frames(&stream), by_definition(&stream));
    }

    #[test]
    fn a_damaged_stream_loses_only_the_damaged_frames(
        count in 1usize..20,
        victim in any::<prop::sample::Index>(),
        flip in 1u8..=255,
    ) {
        // These data cannot look like a frame.
        let good: Vec<Vec<u8>> = (0..count).map(|n| bytes(n as u8, &[n as u8; 9])).collect();
        let mut stream = good.concat();
        let at = victim.index(stream.len());
        stream[at] ^= flip;
        stream.extend([0; FRAME_MAX]);
        let found = frames(&stream);
        prop_assert!(found.len() + 1 >= count, "{} of {count}", found.len());
    }

    #[test]
    fn packets_survive_the_way_there_and_back(data in prop::collection::vec(any::<u8>(), 0..=60), port in 0u8..16, rssi in 0i16..=255) {
        let mut buffer = [0; MTU];
        let packet = SyslinkPacket::P2pReceived { port, rssi: -rssi, data: &data };
        let frame = packet.frame(&mut buffer).expect("it fits");
        prop_assert_eq!(SyslinkPacket::received(frame), Ok(packet));
    }

    #[test]
    fn any_frame_is_understood_or_refused(kind in any::<u8>(), data in prop::collection::vec(any::<u8>(), 0..=MTU)) {
        let frame = SyslinkFrame::new(kind, &data).expect("not longer than the link allows");
        if let Ok(packet) = SyslinkPacket::received(frame) {
            let mut buffer = [0; MTU];
            let again = packet.frame(&mut buffer).expect("it came in a frame");
            prop_assert_eq!(again.kind(), kind);
        }
    }
}

/// The stream has a million damaged bytes, with a good frame after each thousand.
#[test]
fn a_million_damaged_bytes() {
    let mut state = 0x2545_f491u32;
    let mut random = move || {
        state ^= state << 13;
        state ^= state >> 17;
        state ^= state << 5;
        state
    };
    let mut parser = SyslinkParser::new();
    let marker = bytes(0x0a, &[3, 40, 1, 2, 3]);
    let mut received = 0;
    for _ in 0..1000 {
        let mut stream = Vec::new();
        while stream.len() < 1000 {
            let data: Vec<u8> = (0..random() % 65).map(|_| random() as u8).collect();
            let mut frame = bytes(random() as u8, &data);
            match random() % 3 {
                0 => frame.truncate(random() as usize % frame.len()),
                1 => {
                    let at = random() as usize % frame.len();
                    frame[at] ^= 1 << (random() % 8);
                }
                _ => frame = (0..random() % 40).map(|_| random() as u8).collect(),
            }
            stream.extend(frame);
        }
        // The parser needs at most a frame's length to discard pending bytes.
        stream.extend([0; FRAME_MAX]);
        stream.extend(&marker);
        for byte in stream {
            parser.push(byte, |frame| {
                received += usize::from(frame.bytes().as_slice() == marker);
            });
        }
    }
    assert_eq!(received, 1000);
}
