//! Pulses of kilolib's transmitter, as measured in simavr (in cycles of 8 MHz).

use bittybuzz_kilobot::receiver::{BIT, MESSAGE, Pulse, Receiver};

/// The intervals from the first pulse to the second, from there to the first byte's start bit, from
/// bit to bit, and from a stop bit to the next start bit.
const LEAD: f64 = 2420.0;
const TO_BYTES: f64 = 286.0;
const PITCH: f64 = 270.0;
const TO_NEXT: f64 = 282.0;

/// Returns the times of a message's pulses, for a receiver whose clock runs `rate` times as fast as
/// the sender's.
fn pulses(message: &[u8; MESSAGE], start: f64, rate: f64) -> Vec<u16> {
    let mut at = LEAD + TO_BYTES;
    let mut times = vec![0.0, LEAD];
    for byte in message {
        let bits = 1 | u16::from(*byte) << 1 | 1 << 9;
        times.extend(
            (0..10).filter(|bit| bits >> bit & 1 != 0).map(|bit| at + f64::from(bit) * PITCH),
        );
        at += 9.0 * PITCH + TO_NEXT;
    }
    times.into_iter().map(|time| (start + time * rate) as u64 as u16).collect()
}

fn receive(receiver: &mut Receiver, pulses: &[u16]) -> Option<[u8; MESSAGE]> {
    let last = pulses.iter().map(|at| receiver.pulse(*at)).last();
    (last == Some(Pulse::Last)).then_some(receiver.received.message)
}

const MESSAGES: [[u8; MESSAGE]; 4] = [
    [0; MESSAGE],
    [0xff; MESSAGE],
    [1, 2, 3, 4, 5, 6, 7, 8, 9, 0, 0x18, 0xa7],
    [0x80, 0x01, 0x55, 0xaa, 0x7f, 0xfe, 0x10, 0x08, 0xc3, 0x3c, 0, 1],
];

#[test]
fn clocks_may_differ_from_minus_five_to_plus_four_percent() {
    let mut receiver = Receiver::new();
    for message in MESSAGES {
        for permille in -50..=40 {
            // The counter wraps around during some of the messages.
            let start = 60_000.0 + f64::from(permille);
            let pulses = pulses(&message, start, 1.0 + f64::from(permille) / 1000.0);
            assert_eq!(receive(&mut receiver, &pulses), Some(message), "{permille} permille");
            assert!(!receiver.is_busy());
        }
    }
    // Far outside this range no message is received.
    for percent in [-8.0, 6.0] {
        let pulses = pulses(&MESSAGES[1], 0.0, 1.0 + percent / 100.0);
        assert_eq!(receive(&mut Receiver::new(), &pulses), None, "{percent} percent");
    }
}

#[test]
fn each_pulse_has_its_meaning() {
    let mut receiver = Receiver::new();
    let kinds: Vec<Pulse> =
        pulses(&MESSAGES[0], 5.0, 1.0).iter().map(|at| receiver.pulse(*at)).collect();
    assert_eq!(kinds[..4], [Pulse::First, Pulse::Second, Pulse::Start, Pulse::Inside]);
    assert_eq!(kinds.len(), 2 + 12 * 2);
    assert_eq!(kinds[25], Pulse::Last);
    assert_eq!(kinds.iter().filter(|kind| **kind == Pulse::Start).count(), 12);
}

#[test]
fn overlapping_senders_give_no_message() {
    // The lead of the second sender comes during that of the first, as a bit of a byte that must be
    // 0.
    let mut receiver = Receiver::new();
    assert_eq!(receiver.pulse(0), Pulse::First);
    assert_eq!(receiver.pulse(3 * BIT), Pulse::Inside);
    assert_eq!(receiver.pulse(9 * BIT), Pulse::Stray);
    assert!(!receiver.is_busy());
    // A pulse directly after another one comes from another sender.
    assert_eq!(receiver.pulse(0), Pulse::First);
    assert_eq!(receiver.pulse(BIT / 2), Pulse::Stray);
    assert!(!receiver.is_busy());
}

#[test]
fn a_message_after_an_interrupted_one_is_received() {
    let mut receiver = Receiver::new();
    let [first, .., third, _] = MESSAGES;
    let cut = pulses(&first, 0.0, 1.0);
    for at in &cut[..9] {
        receiver.pulse(*at);
    }
    assert!(receiver.is_busy());
    receiver.give_up();
    assert_eq!(receive(&mut receiver, &pulses(&third, 30_000.0, 1.0)), Some(third));
}
