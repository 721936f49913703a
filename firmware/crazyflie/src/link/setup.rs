//! Keeps the radio set up: tells the nRF51 what it has not echoed, and everything again when it has fallen silent.

use bittybuzz_comms::syslink::{Packet, Radio, Setup};
use embassy_time::{Duration, Instant};

use super::send::send;
use crate::log;

/// Between two attempts.
const RETRY: Duration = Duration::from_millis(100);

/// Battery messages come every 10 ms: after so long without a frame the nRF51 has restarted, or the link is broken.
const SILENCE: Duration = Duration::from_millis(1000);

/// The radio's set-up as a matter of time.
pub struct Keeper {
    setup: Setup,
    next: Instant,
    heard: Instant,
}

impl Keeper {
    /// Nothing is set up; begins at once.
    pub fn new() -> Self {
        let now = Instant::now();
        Keeper { setup: Setup::new(Radio::DEFAULT), next: now, heard: now }
    }

    /// Does what is due.
    pub fn tend(&mut self) {
        let now = Instant::now();
        if self.setup.is_done() && now - self.heard > SILENCE {
            log::warning!("the nRF51 is silent: setting the radio up again");
            self.setup.restart();
        }
        if !self.setup.is_done() && now >= self.next {
            self.next = now + RETRY;
            self.setup.missing().for_each(|packet| send(&packet));
        }
    }

    /// Takes note of a packet.
    pub fn hear(&mut self, packet: &Packet<'_>) {
        self.heard = Instant::now();
        let was_done = self.setup.is_done();
        self.setup.hear(packet);
        if self.setup.is_done() && !was_done {
            log::info!("radio ready");
        }
    }
}
