//! The supervision of the radio's set-up: sends the nRF51 the settings that it has not echoed, and
//! sends all of them again when its reports end.

use bittybuzz_comms::syslink::{RadioSettings, Setup, SyslinkPacket};
use embassy_time::{Duration, Instant};

use super::STATE;
use super::send::send;
use bittybuzz_board::log;

/// The time between two attempts.
const RETRY: Duration = Duration::from_millis(100);

/// The time without a report after which no frames are sent to other robots. Reports come every 10
/// ms; without them the nRF51 may have restarted, and would lose frames that come before Bluetooth
/// is off.
const DOUBT: Duration = Duration::from_millis(50);

/// The time without a report after which the nRF51 has restarted, or the link is broken. Its first
/// report comes a second after its start. Other frames do not count as reports: the radio may
/// receive again before it is set up.
const SILENCE: Duration = Duration::from_millis(2000);

/// The radio's set-up together with its timing.
pub struct RadioSetup {
    setup: Setup,
    next: Instant,
    /// The time of the last report, or of the start of the set-up.
    reported: Instant,
    has_reported: bool,
}

impl RadioSetup {
    /// Returns a set-up that starts at once.
    pub fn new(radio: RadioSettings, robot_id: u16) -> Self {
        let now = Instant::now();
        let setup = Setup::new(radio, robot_id);
        RadioSetup { setup, next: now, reported: now, has_reported: false }
    }

    /// Executes the actions that are due. Call this function regularly.
    pub fn poll(&mut self) {
        let now = Instant::now();
        let silence = now - self.reported;
        if silence > SILENCE {
            if self.setup.has_begun() {
                log::warning!("the nRF51 is silent: setting the radio up again");
            }
            self.setup.restart();
            (self.reported, self.has_reported) = (now, false);
        }
        if !self.setup.is_done() && now >= self.next {
            self.next = now + RETRY;
            self.setup.attempt().for_each(|packet| send(&packet));
            if self.setup.is_old() {
                log::info!("radio ready; the nRF51's firmware is from before October 2025");
            }
        }
        let in_doubt = self.has_reported && silence > DOUBT;
        STATE.set_can_send(self.setup.can_send() && !in_doubt);
    }

    /// Processes a received packet, which may be a report or an echo.
    pub fn process(&mut self, packet: &SyslinkPacket<'_>) {
        if matches!(packet, SyslinkPacket::Battery(_)) {
            (self.reported, self.has_reported) = (Instant::now(), true);
        }
        let was_done = self.setup.is_done();
        self.setup.process(packet);
        if self.setup.is_done() && !was_done {
            log::info!("radio ready");
        }
    }
}
