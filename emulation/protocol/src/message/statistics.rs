//! The counters that an emulator reports.

use std::time::Duration;

use bittybuzz_chips as chips;
use serde::{Deserialize, Serialize};

use super::nanoseconds;

/// Counters since power-on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RobotStatistics {
    /// The core's counters.
    pub core: CoreStatistics,
    /// The board's counters.
    pub board: BoardStatistics,
    /// The counters of the channel between all robots of the program: packets between Zooids, or
    /// bursts of light between Kilobots.
    pub air: AirStatistics,
}

/// The counters of a core.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct CoreStatistics {
    /// Instructions executed; 0 if the core does not count them.
    pub instructions: u64,
    /// Cycles of the core's clock, without the cycles that the core slept.
    pub cycles: u64,
    /// Exceptions taken.
    pub exceptions: u64,
    /// Longest time for which interrupts were masked; on a Kilobot, longest time that an interrupt
    /// had to wait.
    #[serde(rename = "longest_masked_ns", with = "nanoseconds")]
    pub longest_masked: Duration,
    /// Cycles of the longest turn of a Kilobot's main loop since the last query, without sleep; 0
    /// for other robots.
    #[serde(default)]
    pub longest_turn: u64,
}

/// The counters of the channel between the robots; [`bittybuzz_chips::AirStatistics`] documents
/// each.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
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

/// The counters of a board.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum BoardStatistics {
    /// The counters of a Crazyflie.
    Crazyflie(CrazyflieStatistics),
    /// The counters of a Zooid.
    Zooid(ZooidStatistics),
    /// The counters of a Kilobot.
    Kilobot(KilobotStatistics),
}

/// Counters of a Kilobot's board; `KilobotStatistics` of robots/kilobot/board documents each.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct KilobotStatistics {
    pub infrared_sent: u64,
    pub infrared_aborted: u64,
    pub infrared_arrived: u64,
    pub infrared_damaged: u64,
    pub infrared_collided: u64,
    pub pulses_unheard: u64,
    pub unknown: Vec<u32>,
}

/// Counters of a Zooid's board; `ZooidStatistics` of robots/zooids/board documents each.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
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

/// Counters of a Crazyflie's board; `Statistics` of robots/crazyflie/board documents each.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
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
