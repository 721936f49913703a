//! Times and periods of a scenario, which are whole numbers of ticks.
//!
//! Robots, events and expectations act at ticks only. A time between two ticks is rejected, because
//! the ticks before and after it may give different results.

use std::ops::RangeInclusive;

use bittybuzz_toml_reader::number_text;

use crate::engine::TICK_US;

use super::error::ScenarioCause;
use super::read::Entry;

const TICKS_PER_SECOND: f64 = 1e6 / TICK_US as f64;

/// The tolerance as a share of a tick: decimal fractions are not exact in binary.
const TOLERANCE: f64 = 1e-6;

/// Returns the seconds of a value, which must be a number in `range` and a whole number of ticks.
pub fn seconds(entry: &Entry<'_>, range: RangeInclusive<f64>) -> Option<f64> {
    let time = entry.number(range)?;
    check_ticks(entry, time)?;
    Some(time)
}

/// Reports a time in seconds that is between two ticks.
pub fn check_ticks(entry: &Entry<'_>, time: f64) -> Option<()> {
    let ticks = time * TICKS_PER_SECOND;
    if (ticks - ticks.round()).abs() <= TOLERANCE {
        return Some(());
    }
    let nearest = [ticks.floor(), ticks.ceil()].map(|ticks| number_text(ticks / TICKS_PER_SECOND));
    entry.fail(ScenarioCause::BetweenTicks {
        key: entry.key.clone(),
        value: number_text(time),
        nearest,
    });
    None
}
