//! The timing of a robot's transmissions: its link's own clock, pacing and back-off.

use core::hash::Hash;

use super::delivery::Late;
use super::{Media, Medium};
use crate::engine::TICK_US;
use crate::engine::digest::Digest;
use crate::engine::oscillator::Oscillator;
use crate::engine::stream::Stream;

/// Units of kilolib's `kilo_tx_period`, µs.
pub(crate) const UNIT_US: u32 = 128;

/// The period of kilolib's timer: 256 units. kilolib asks for a message at each interrupt.
const TIMER_US: u32 = 256 * UNIT_US;

/// The time from one fragment of a long message to the next, in units of 128 µs, and the most
/// fragments for which the pause after the message makes up: as in the firmware
/// (robots/kilobot/link/src/sender.rs).
const SPACING: u16 = 256;
const EARLY_MAX: u8 = 5;

/// The most times in a row that a robot lets others finish their messages, twice the fragments of the
/// longest message: as in the firmware. A Zooid, which sends many frames a second, gets one more with
/// each frame that it sends.
const DEFERRALS_MAX: u8 = 16;

/// Returns the time in µs after a fragment in which the next one of the same message has arrived, and
/// the longest random time that a robot adds before it sends; `None` if the firmware lets no other
/// robot finish its message. They are those of robots/kilobot/link/src/sender.rs and
/// firmware/zooids/src/radio/mod.rs.
pub(super) const fn deferral_us(medium: Medium) -> Option<[u32; 2]> {
    match medium {
        Medium::Infrared => Some([SPACING as u32 * UNIT_US, 256 * UNIT_US]),
        Medium::Nrf24 => Some([18_000, 16_000]),
        Medium::P2p | Medium::RangeAndBearing => None,
    }
}

/// Returns the time in µs before its own start in which a transmitter cannot sense the start of
/// another one.
const fn blind_us(medium: Medium) -> i32 {
    match medium {
        // The interrupt of the first pulse.
        Medium::Infrared => 2,
        // The nRF24 takes 130 µs from listening to sending.
        Medium::Nrf24 | Medium::RangeAndBearing => 130,
        // P2P never senses the channel before it sends.
        Medium::P2p => i32::MAX,
    }
}

/// The state of a robot's link. Times are microseconds after the beginning of the tick.
#[derive(Clone, Debug)]
pub(crate) struct RobotRadio {
    pub(crate) late: Option<Box<Late>>,
    /// True if the brain has a frame to send.
    pub(crate) waits: bool,
    /// The time of the next attempt to send.
    pub(crate) attempt: i32,
    /// Earliest time for the next frame.
    ready: i32,
    /// The clock of the robot. The time within a tick at which the script has its frames ready differs
    /// between robots, because they are switched on at different times, and moves with the clock's
    /// error.
    pub(crate) oscillator: Oscillator,
    /// Infrared: the first timer interrupt of this tick.
    interrupt: i32,
    /// Infrared: time between two timer interrupts.
    period: i32,
    /// Infrared: the number of fragments that were sent [`SPACING`] after another one.
    early: u8,
    /// The number of times that the robot has let others finish their messages.
    deferrals: u8,
}

impl RobotRadio {
    pub(crate) fn new(medium: Medium, pacing: &Media, build: &mut Stream) -> Self {
        let error_ppm = match medium {
            Medium::Infrared => {
                (1e6 * (build.gain(pacing.infrared.clock_sigma) - 1.0)).round() as i32
            }
            // Crystals.
            Medium::Nrf24 | Medium::P2p | Medium::RangeAndBearing => 0,
        };
        // A script with an exact clock has its frames ready so early that the first one is usually sent
        // before the next tick.
        let wait = match medium {
            // The phase moves through the whole tick.
            Medium::Infrared => 0,
            Medium::Nrf24 => pacing.nrf24.backoff_us,
            Medium::RangeAndBearing => pacing.range_and_bearing.backoff_us,
            Medium::P2p => pacing.p2p.pause_us[1],
        };
        let script_us = build.below(TICK_US.saturating_sub(wait).max(1));
        let oscillator = Oscillator::new(error_ppm, script_us);
        let period = period_us(medium, oscillator);
        RobotRadio {
            late: None,
            waits: false,
            attempt: 0,
            ready: 0,
            oscillator,
            interrupt: build.below(period.max(1) as u32) as i32,
            period,
            early: 0,
            deferrals: 0,
        }
    }

    /// Adds the complete state to a digest.
    pub(crate) fn add_to(&self, digest: &mut Digest) {
        let RobotRadio { late, waits, attempt, ready, oscillator, interrupt, period, .. } = self;
        (waits, attempt, ready, oscillator, interrupt, period).hash(digest);
        (self.early, self.deferrals).hash(digest);
        digest.text_of(late);
    }

    /// Discards the frame to be sent and a received frame that was held back.
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

    /// Sets the error of the robot's oscillator, in millionths.
    pub(crate) fn set_clock_error(&mut self, medium: Medium, error_ppm: i32) {
        self.oscillator = self.oscillator.with_error(error_ppm);
        self.period = period_us(medium, self.oscillator);
    }

    /// Plans the first attempt to send a frame that the brain has just produced in tick `now`.
    pub(crate) fn plan(&mut self, medium: Medium, pacing: &Media, now: u64, stream: &mut Stream) {
        let from = self.ready.max(self.oscillator.script_us(now));
        self.waits = true;
        self.attempt = match medium {
            // If the link became ready less than a period ago, it was busy with other frames
            // before. The script already had this frame then, so its time within the tick does not
            // count.
            Medium::Infrared if self.ready > -self.period => self.timer(self.ready.max(0)),
            Medium::Infrared => self.timer(from),
            Medium::Nrf24 => from + stream.below(pacing.nrf24.backoff_us) as i32,
            Medium::RangeAndBearing => {
                from + stream.below(pacing.range_and_bearing.backoff_us) as i32
            }
            Medium::P2p => from + pause(pacing, stream),
        };
    }

    /// Returns the time before which another frame must have started so that a robot notices it
    /// when it starts to send at `at`; `None` if the robot does not listen before.
    pub(crate) fn senses(medium: Medium, at: i32) -> Option<i32> {
        (medium != Medium::P2p).then(|| at - blind_us(medium))
    }

    /// Plans a later attempt, because the channel was busy with `frames` frames at `self.attempt`.
    ///
    /// kilolib's receiver keeps the timer's interrupt from sending while it is inside a frame. A
    /// receiver that is confused by two overlapping frames believes that the channel is idle: it
    /// sends its first pulse, detects light and asks for an early interrupt after 0 to 255 units.
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

    /// Plans a later attempt, because another robot's fragment ended at `heard` and the next one of
    /// the same message is to be expected. Returns false if the robot sends nevertheless.
    pub(crate) fn defer(&mut self, medium: Medium, heard: i32, stream: &mut Stream) -> bool {
        let Some([following, random]) = deferral_us(medium) else { return false };
        let at = heard + (following + stream.below(random)) as i32;
        if at <= self.attempt || self.deferrals == DEFERRALS_MAX {
            return false;
        }
        self.deferrals += 1;
        self.attempt = if medium == Medium::Infrared { self.timer(at) } else { at };
        true
    }

    /// Plans the next attempt after a frame that started at `self.attempt`. `is_within` is true if
    /// the next frame continues a long message.
    pub(crate) fn sent(
        &mut self,
        medium: Medium,
        pacing: &Media,
        is_within: bool,
        stream: &mut Stream,
    ) {
        let end = self.attempt + medium.air_time_us() as i32;
        self.deferrals = match medium {
            Medium::Nrf24 => self.deferrals.saturating_sub(1),
            _ => 0,
        };
        self.attempt = match medium {
            Medium::Infrared => {
                let period = u32::from(pacing.infrared.tx_period);
                let spacing = period.min(SPACING.into());
                let units = if is_within {
                    self.early = (self.early + 1).min(EARLY_MAX);
                    spacing
                } else {
                    period + u32::from(core::mem::take(&mut self.early)) * (period - spacing)
                };
                // The robot counts with its own clock.
                let pause =
                    i64::from(units * UNIT_US) * i64::from(self.period) / i64::from(TIMER_US);
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

    /// Returns the time of the first timer interrupt at or after a time.
    fn timer(&self, at: i32) -> i32 {
        let since = at - self.interrupt;
        if since <= 0 {
            return self.interrupt;
        }
        self.interrupt + (since + self.period - 1) / self.period * self.period
    }
}

/// Returns the time between two interrupts of the timer that sends, in µs; 0 without such a timer.
fn period_us(medium: Medium, oscillator: Oscillator) -> i32 {
    let is_timed = medium == Medium::Infrared;
    if is_timed { (u64::from(TIMER_US) * 1_000_000 / oscillator.rate()) as i32 } else { 0 }
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
    use crate::engine::stream::StreamPurpose;

    fn pacing() -> Media {
        let infrared = Infrared { clock_sigma: 0.0, ..Infrared::STANDARD };
        Media { infrared, ..Media::STANDARD }
    }

    /// kilolib's default: 16 interrupts of 32.768 ms between two frames.
    #[test]
    fn kilobots_send_twice_a_second() {
        let pacing = pacing();
        let mut stream = Stream::new(1, StreamPurpose::Send, 0, 0);
        let mut radio = RobotRadio::new(Medium::Infrared, &pacing, &mut stream);
        let (mut elapsed, mut last, mut sent) = (0_i64, None, 0);
        for tick in 0..600 {
            radio.turn(Medium::Infrared);
            elapsed += i64::from(TICK_US);
            radio.plan(Medium::Infrared, &pacing, tick, &mut stream);
            while radio.attempt < TICK_US as i32 {
                let at = elapsed + i64::from(radio.attempt);
                if let Some(last) = last {
                    assert_eq!(at - last, 16 * 32_768);
                }
                last = Some(at);
                sent += 1;
                radio.sent(Medium::Infrared, &pacing, false, &mut stream);
            }
        }
        assert!((114..=115).contains(&sent), "{sent} frames in a minute");
    }

    /// A robot whose clock is fast or slow sends at each of its interrupts within a message.
    #[test]
    fn fragments_follow_each_other_whatever_the_clock() {
        let pacing = Media::STANDARD;
        for seed in 0..20 {
            let mut stream = Stream::new(seed, StreamPurpose::Send, 0, 0);
            let mut radio = RobotRadio::new(Medium::Infrared, &pacing, &mut stream);
            radio.plan(Medium::Infrared, &pacing, 0, &mut stream);
            let first = radio.attempt;
            radio.sent(Medium::Infrared, &pacing, true, &mut stream);
            assert!(
                (32_000..33_600).contains(&(radio.attempt - first)),
                "{}",
                radio.attempt - first
            );
        }
    }

    #[test]
    fn a_robot_waits_for_a_message_that_has_begun_but_not_for_ever() {
        let media =
            [(Medium::Infrared, 100_000, 1_600), (Medium::Nrf24, 34_000, 100), (Medium::P2p, 0, 0)];
        for (medium, most, most_waits) in media {
            let pacing = pacing();
            let mut stream = Stream::new(1, StreamPurpose::Send, 0, 0);
            let mut radio = RobotRadio::new(medium, &pacing, &mut stream);
            radio.plan(medium, &pacing, 0, &mut stream);
            let mut waits = 0;
            loop {
                let heard = radio.attempt;
                if !radio.defer(medium, heard, &mut stream) {
                    break;
                }
                assert!((heard + 1..=heard + most).contains(&radio.attempt), "{medium:?}");
                waits += 1;
            }
            assert_eq!(waits, if most == 0 { 0 } else { 16 }, "{medium:?}");
            // Others that begin messages without end, for the next frames.
            let mut waits = 0;
            for _ in 0..100 {
                radio.sent(medium, &pacing, false, &mut stream);
                while radio.defer(medium, radio.attempt, &mut stream) {
                    waits += 1;
                }
            }
            assert!(waits <= most_waits, "{medium:?}: {waits}");
            // A fragment from long ago.
            radio.sent(medium, &pacing, false, &mut stream);
            let long_ago = radio.attempt - 70_000;
            assert!(!radio.defer(medium, long_ago, &mut stream));
        }
    }

    #[test]
    fn a_busy_channel_waits_for_the_next_interrupt() {
        let pacing = pacing();
        let mut stream = Stream::new(1, StreamPurpose::Send, 0, 0);
        let mut radio = RobotRadio::new(Medium::Infrared, &pacing, &mut stream);
        radio.plan(Medium::Infrared, &pacing, 0, &mut stream);
        let first = radio.attempt;
        radio.back_off(Medium::Infrared, 1, &pacing, &mut stream);
        assert_eq!(radio.attempt - first, 32_768);
        radio.back_off(Medium::Infrared, 2, &pacing, &mut stream);
        assert!(radio.attempt - first - 32_768 <= 32_640 + 1);
    }
}
