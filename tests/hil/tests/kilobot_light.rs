//! The Kilobot's infrared light, pulse by pulse: two senders at once.

#![allow(clippy::unwrap_used, reason = "what fails here fails the test")]

use std::time::Duration;

use bittybuzz_hil::kilobots::{behaviour, kind};
use bittybuzz_hil::{Command, Event, Kilobots};

/// It has something to send whenever it may.
const TALKS: &str = "n = 0\nfunction step() { n = n + 1 neighbors.broadcast(\"count\", n) }\n";

/// Robots whose image has what the script uses.
fn talkers(script: &str, count: usize) -> Kilobots {
    Kilobots::in_image(script, &behaviour("gradient"), count)
}

/// A message on the air.
struct Sent {
    /// The first pulse begins.
    begin: Duration,
    payload: Vec<u8>,
}

/// The messages that a robot has sent.
fn sent(robots: &Kilobots, robot: usize) -> Vec<Sent> {
    let messages = robots.events[robot].iter().filter_map(|event| match &event.event {
        Event::Infrared { payload, air } => {
            Some(Sent { begin: event.at - *air, payload: payload.clone() })
        }
        _ => None,
    });
    messages.collect()
}

/// The controller sends at a time to come.
fn announce(robots: &mut Kilobots, at: Duration, kind: u8) {
    let payload = [&[0; 9][..], &[kind]].concat();
    robots.tell(0, &Command::Radio { at, payload });
}

/// Someone else begins while a robot looks for others, between its first two pulses: it gives up and tries again later.
///
/// The other's first pulse is the only one in that time, and as short as any: 9 cycles of 8 MHz. The sixteen places of it are
/// a cycle apart, so that no look at the receiver fits between them by chance.
#[test]
fn one_who_sees_another_begin_gives_up_and_tries_again() {
    // The same program does the same each time.
    let mut robots = talkers(TALKS, 1);
    robots.start();
    robots.run_ms(1500);
    let second = sent(&robots, 0).swap_remove(1);
    for cycle in 0..16 {
        let mut robots = talkers(TALKS, 1);
        robots.start();
        // In the middle of the seven bits that kilolib looks for, from two bits after its pulse on (message_send.S).
        let other = second.begin + Duration::from_nanos(180_000 + 125 * cycle);
        announce(&mut robots, other, kind::RUN);
        robots.run_for(second.begin + Duration::from_millis(100) - robots.now());
        let again = sent(&robots, 0).swap_remove(1);
        // It sends when the other one, who takes 4.4 ms, is done; it waits for 32.6 ms at most, and once more if it is disturbed.
        let later = again.begin.checked_sub(other);
        let range = Duration::from_micros(4_400)..Duration::from_millis(80);
        assert!(
            later.is_some_and(|later| range.contains(&later)),
            "cycle {cycle}: after {later:?}"
        );
        assert_eq!(again.payload, second.payload, "cycle {cycle}");
    }
}
