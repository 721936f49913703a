//! Packets that cflib 0.1.34 sent for these calls: `vectors/cflib.jsonl`, recorded on 2026-11-28
//! with `tests/cflib/client.py`. A line has the version of the protocol, the call, its arguments and
//! the packet.

use bittybuzz_crtp::{Identity, Ports, SupervisorInfo};
use serde_json::Value;

use crate::oracle::{assert_equal, expected, meaning};

const VECTORS: &str = include_str!("vectors/cflib.jsonl");

/// Returns the bytes of hexadecimal digits.
fn bytes(digits: &str) -> Vec<u8> {
    let pairs = digits.as_bytes().chunks(2);
    pairs.map(|pair| u8::from_str_radix(str::from_utf8(pair).unwrap(), 16).unwrap()).collect()
}

/// Returns the packets of all vectors.
pub fn packets() -> Vec<Vec<u8>> {
    let packet = |line: &str| {
        let vector: Value = serde_json::from_str(line).unwrap();
        bytes(vector[3].as_str().unwrap())
    };
    VECTORS.lines().map(packet).collect()
}

#[test]
fn packets_of_cflib_mean_what_was_called() {
    let mut calls = 0;
    for line in VECTORS.lines() {
        let vector: Value = serde_json::from_str(line).unwrap();
        let [version, path, arguments, packet] = vector.as_array().unwrap().as_slice() else {
            panic!("{line}");
        };
        let path = path.as_str().unwrap();
        let mut ports = Ports::new(Identity { id: 0xe7, firmware: "", device: "" });
        let packet = bytes(packet.as_str().unwrap());
        let reaction = ports.receive(&packet, 0, &SupervisorInfo::default());
        assert_equal(meaning(reaction.command), expected(path, arguments), line);
        let is_refused = path == "platform.set_continous_wave";
        assert_eq!(ports.refusals().total(), u32::from(is_refused), "{line}");
        assert!(version.as_u64().unwrap() >= 7);
        calls += 1;
    }
    assert!(calls >= 40, "{calls} calls");
}
