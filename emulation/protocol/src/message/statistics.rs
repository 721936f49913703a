//! What was counted.

use std::time::Duration;

use bittybuzz_chips as chips;
use serde::{Deserialize, Serialize};

use super::nanoseconds;

/// Counters since power-on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Statistics {
    /// What the core counted.
    pub core: CoreStatistics,
    /// What the board counted.
    pub board: BoardStatistics,
    /// What happened to the packets between all Zooids of the program, or the bursts of light between all Kilobots.
    pub air: AirStatistics,
}

/// What a core counts.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct CoreStatistics {
    /// Instructions executed; 0 where the core does not count them.
    pub instructions: u64,
    /// Cycles of the core's clock, without those that it slept.
    pub cycles: u64,
    /// Exceptions taken.
    pub exceptions: u64,
    /// Longest time that interrupts were masked; of a Kilobot, that one had to wait.
    #[serde(rename = "longest_masked_ns", with = "nanoseconds")]
    pub longest_masked: Duration,
    /// Cycles of the longest turn of a Kilobot's loop since this was asked last, without sleep; 0 of other robots.
    #[serde(default)]
    pub longest_turn: u64,
}

/// What the air did; the meaning of each stands in [`bittybuzz_chips::AirStatistics`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[allow(missing_docs, reason = "bittybuzz_chips::AirStatistics says it")]
pub struct AirStatistics {
    pub carried: u64,
    pub collided: u64,
    pub lost: u64,
}

impl From<chips::AirStatistics> for AirStatistics {
    fn from(s: chips::AirStatistics) -> Self {
        AirStatistics { carried: s.carried, collided: s.collided, lost: s.lost }
    }
}

/// What a board counts.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum BoardStatistics {
    /// That of a Crazyflie.
    Crazyflie(CrazyflieStatistics),
    /// That of a Zooid.
    Zooid(ZooidStatistics),
    /// That of a Kilobot.
    Kilobot(KilobotStatistics),
}

/// What a Kilobot's board counts; the meaning of each stands in [`bittybuzz_chips::KilobotStatistics`].
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(missing_docs, reason = "bittybuzz_chips::KilobotStatistics says it")]
pub struct KilobotStatistics {
    pub infrared_sent: u64,
    pub infrared_aborted: u64,
    pub infrared_arrived: u64,
    pub infrared_damaged: u64,
    pub infrared_collided: u64,
    pub pulses_unheard: u64,
    pub unknown: Vec<u32>,
}

impl From<chips::KilobotStatistics> for KilobotStatistics {
    fn from(s: chips::KilobotStatistics) -> Self {
        KilobotStatistics {
            infrared_sent: s.sent,
            infrared_aborted: s.aborted,
            infrared_arrived: s.arrived,
            infrared_damaged: s.damaged,
            infrared_collided: s.collided,
            pulses_unheard: s.unheard,
            unknown: s.unknown,
        }
    }
}

/// What a Zooid's board counts; the meaning of each stands in [`bittybuzz_chips::ZooidStatistics`].
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(missing_docs, reason = "bittybuzz_chips::ZooidStatistics says it")]
pub struct ZooidStatistics {
    pub radio_sent: u64,
    pub radio_received: u64,
    pub radio_damaged: u64,
    pub radio_unheard: u64,
    pub radio_overflown: u64,
    pub radio_too_early: u64,
    pub radio_written_while_active: u64,
    pub radio_short_pulses: u64,
    pub touch_addressed: u64,
    pub motion_addressed: u64,
    pub brightest: f64,
    pub clocks_hz: [u64; 2],
    pub accesses_without_clock: u64,
    pub unknown: Vec<u32>,
}

impl From<chips::ZooidStatistics> for ZooidStatistics {
    fn from(s: chips::ZooidStatistics) -> Self {
        ZooidStatistics {
            radio_sent: s.radio.sent,
            radio_received: s.radio.received,
            radio_damaged: s.radio.damaged,
            radio_unheard: s.radio.unheard,
            radio_overflown: s.radio.overflown,
            radio_too_early: s.radio.too_early,
            radio_written_while_active: s.radio.written_while_active,
            radio_short_pulses: s.radio.short_pulses,
            touch_addressed: s.touch_addressed,
            motion_addressed: s.motion_addressed,
            brightest: s.brightest,
            clocks_hz: s.clocks_hz,
            accesses_without_clock: s.accesses_without_clock,
            unknown: s.unknown,
        }
    }
}

/// What a Crazyflie's board counts; the meaning of each stands in [`bittybuzz_chips::Statistics`].
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(missing_docs, reason = "bittybuzz_chips::Statistics says it")]
pub struct CrazyflieStatistics {
    #[serde(rename = "receive_latency_ns", with = "nanoseconds")]
    pub receive_latency: Duration,
    pub overruns: u64,
    pub framing_errors: u64,
    pub peer_received: u64,
    pub peer_framing_errors: u64,
    pub peer_bad_checksums: u64,
    pub peer_dropped: u64,
    pub peer_overruns: u64,
    pub peer_unsent: u64,
    pub radio_unheard: u64,
    pub radio_overflown: u64,
    pub radio_cut: u64,
    pub link_lost: u64,
    pub link_corrupted: u64,
    pub clocks_hz: [u64; 3],
    pub accesses_without_clock: u64,
    pub unknown: Vec<u32>,
}

impl From<chips::Statistics> for CrazyflieStatistics {
    fn from(s: chips::Statistics) -> Self {
        CrazyflieStatistics {
            receive_latency: Duration::from_nanos(s.receive_latency.nanos()),
            overruns: s.overruns,
            framing_errors: s.framing_errors,
            peer_received: s.peer_received,
            peer_framing_errors: s.peer_framing_errors,
            peer_bad_checksums: s.peer_bad_checksums,
            peer_dropped: s.peer_dropped,
            peer_overruns: s.peer_overruns,
            peer_unsent: s.peer_unsent,
            radio_unheard: s.radio_unheard,
            radio_overflown: s.radio_overflown,
            radio_cut: s.radio_cut,
            link_lost: s.link_lost,
            link_corrupted: s.link_corrupted,
            clocks_hz: s.clocks_hz,
            accesses_without_clock: s.accesses_without_clock,
            unknown: s.unknown,
        }
    }
}
