//! The timing of a robot's transmissions: its link's own clock, pacing and back-off.

use core::hash::Hash;

use super::packet::Late;
use super::{Media, Medium};
use crate::engine::TICK_US;
use crate::engine::digest::Digest;
use crate::engine::stream::Stream;

/// Units of kilolib's `kilo_tx_period`, µs.
const UNIT_US: u32 = 128;

/// kilolib's timer: 256 units. It asks for a message at each interrupt.
const TIMER_US: u32 = 256 * UNIT_US;

/// The time in µs before its own start in which a transmitter cannot sense the start of another.
const fn blind_us(medium: Medium) -> i32 {
    match medium {
        // The interrupt of the first pulse.
        Medium::Infrared => 2,
        // The nRF24 takes 130 µs from listening to sending.
        Medium::Nrf24 | Medium::RangeAndBearing => 130,
        // It never listens before.
        Medium::P2p => i32::MAX,
    }
}

/// A robot's link. Times are microseconds after the tick's beginning.
#[derive(Clone, Debug)]
pub(crate) struct Radio {
    pub(crate) late: Option<Box<Late>>,
    /// The brain has a frame for it.
    pub(crate) waits: bool,
    /// The time of its attempt.
    pub(crate) attempt: i32,
    /// Earliest time for the next frame.
    ready: i32,
    /// The time within a tick when the robot's script has frames for it: robots are switched on at
    /// different times.
    script: i32,
    /// Infrared: the first timer interrupt of this tick.
    interrupt: i32,
    /// Infrared: time between two timer interrupts.
    period: i32,
}

impl Radio {
    pub(crate) fn new(medium: Medium, pacing: &Media, build: &mut Stream) -> Self {
        let period = match medium {
            Medium::Infrared => (TIMER_US as f32 * build.gain(pacing.infrared.clock_sigma)) as u32,
            Medium::Nrf24 | Medium::P2p | Medium::RangeAndBearing => 0,
        };
        // Early enough that the first frame is usually out before the next tick.
        let wait = match medium {
            Medium::Infrared => period,
            Medium::Nrf24 => pacing.nrf24.backoff_us,
            Medium::RangeAndBearing => pacing.range_and_bearing.backoff_us,
            Medium::P2p => pacing.p2p.pause_us[1],
        };
        Radio {
            late: None,
            waits: false,
            attempt: 0,
            ready: 0,
            script: build.below(TICK_US.saturating_sub(wait).max(1)) as i32,
            interrupt: build.below(period.max(1)) as i32,
            period: period as i32,
        }
    }

    /// Adds all of its state to a digest.
    pub(crate) fn add_to(&self, digest: &mut Digest) {
        let Radio { late, waits, attempt, ready, script, interrupt, period } = self;
        (waits, attempt, ready, script, interrupt, period).hash(digest);
        digest.text_of(late);
    }

    /// Discards the frames to be sent and those on their way.
    pub(crate) fn silence(&mut self) {
        self.waits = false;
        self.late = None;
    }

    /// Begins the next tick.
    pub(crate) fn turn(&mut self, medium: Medium) {
        let tick = TICK_US as i32;
        self.attempt = self.attempt.saturating_sub(tick);
        self.ready = self.ready.saturating_sub(tick).max(-tick);
        if medium == Medium::Infrared {
            self.interrupt = self.timer(tick) - tick;
        }
    }

    /// The brain has a frame, and had none: when will the link first try to send it?
    pub(crate) fn plan(&mut self, medium: Medium, pacing: &Media, stream: &mut Stream) {
        let from = self.ready.max(self.script);
        self.waits = true;
        self.attempt = match medium {
            // A link that was not ready for long had other frames, and the script this one, too: it was waiting.
            Medium::Infrared if self.ready > -self.period => self.timer(self.ready.max(0)),
            Medium::Infrared => self.timer(from),
            Medium::Nrf24 => from + stream.below(pacing.nrf24.backoff_us) as i32,
            Medium::RangeAndBearing => {
                from + stream.below(pacing.range_and_bearing.backoff_us) as i32
            }
            Medium::P2p => from + pause(pacing, stream),
        };
    }

    /// Up to which time a frame must have begun to be noticed by a sender that begins at `at`; `None` if it does not
    /// listen.
    pub(crate) fn senses(medium: Medium, at: i32) -> Option<i32> {
        (medium != Medium::P2p).then(|| at - blind_us(medium))
    }

    /// Plans a later attempt: the channel was busy at `self.attempt` with `frames` frames.
    ///
    /// kilolib: a receiver inside a frame keeps the timer's interrupt from sending; one that two
    /// frames confuse believes
    /// to be idle, sends its first pulse, sees light and asks for an early interrupt after 0 to 255
    /// units.
    pub(crate) fn back_off(
        &mut self,
        medium: Medium,
        frames: usize,
        pacing: &Media,
        stream: &mut Stream,
    ) {
        self.attempt = match medium {
            Medium::Infrared if frames > 1 => {
                self.attempt + (stream.below(256) * UNIT_US) as i32 + 1
            }
            Medium::Infrared => self.timer(self.attempt + 1),
            Medium::Nrf24 | Medium::P2p => {
                self.attempt + 1 + stream.below(pacing.nrf24.backoff_us) as i32
            }
            Medium::RangeAndBearing => {
                self.attempt + 1 + stream.below(pacing.range_and_bearing.backoff_us) as i32
            }
        };
    }

    /// A frame began at `self.attempt`: when may the next, if there is one?
    pub(crate) fn sent(&mut self, medium: Medium, pacing: &Media, stream: &mut Stream) {
        let end = self.attempt + medium.air_time_us() as i32;
        self.attempt = match medium {
            Medium::Infrared => {
                let pause = u32::from(pacing.infrared.tx_period) * UNIT_US;
                self.ready = end.max(self.attempt + pause as i32);
                self.timer(self.ready)
            }
            Medium::Nrf24 => end + stream.below(pacing.nrf24.backoff_us) as i32,
            Medium::RangeAndBearing => {
                end + stream.below(pacing.range_and_bearing.backoff_us) as i32
            }
            Medium::P2p => end + pause(pacing, stream),
        };
        if medium != Medium::Infrared {
            self.ready = end;
        }
    }

    /// The first timer interrupt at or after a time.
    fn timer(&self, at: i32) -> i32 {
        let since = at - self.interrupt;
        if since <= 0 {
            return self.interrupt;
        }
        self.interrupt + (since + self.period - 1) / self.period * self.period
    }
}

/// Returns the pause of a Crazyflie before a frame, in µs.
fn pause(pacing: &Media, stream: &mut Stream) -> i32 {
    let [least, most] = pacing.p2p.pause_us;
    (least + stream.below((most - least).max(1))) as i32
}

#[cfg(test)]
mod tests {
    use super::super::Infrared;
    use super::*;
    use crate::engine::stream::Purpose;

    fn pacing() -> Media {
        let infrared = Infrared { clock_sigma: 0.0, ..Infrared::STANDARD };
        Media { infrared, ..Media::STANDARD }
    }

    /// kilolib's default: 16 interrupts of 32.768 ms between two frames.
    #[test]
    fn kilobots_send_twice_a_second() {
        let pacing = pacing();
        let mut stream = Stream::new(1, Purpose::Send, 0, 0);
        let mut radio = Radio::new(Medium::Infrared, &pacing, &mut stream);
        let (mut elapsed, mut last, mut sent) = (0_i64, None, 0);
        for _ in 0..600 {
            radio.turn(Medium::Infrared);
            elapsed += i64::from(TICK_US);
            radio.plan(Medium::Infrared, &pacing, &mut stream);
            while radio.attempt < TICK_US as i32 {
                let at = elapsed + i64::from(radio.attempt);
                if let Some(last) = last {
                    assert_eq!(at - last, 16 * 32_768);
                }
                last = Some(at);
                sent += 1;
                radio.sent(Medium::Infrared, &pacing, &mut stream);
            }
        }
        assert!((114..=115).contains(&sent), "{sent} frames in a minute");
    }

    #[test]
    fn a_busy_channel_waits_for_the_next_interrupt() {
        let pacing = pacing();
        let mut stream = Stream::new(1, Purpose::Send, 0, 0);
        let mut radio = Radio::new(Medium::Infrared, &pacing, &mut stream);
        radio.plan(Medium::Infrared, &pacing, &mut stream);
        let first = radio.attempt;
        radio.back_off(Medium::Infrared, 1, &pacing, &mut stream);
        assert_eq!(radio.attempt - first, 32_768);
        radio.back_off(Medium::Infrared, 2, &pacing, &mut stream);
        assert!(radio.attempt - first - 32_768 <= 32_640 + 1);
    }
}
