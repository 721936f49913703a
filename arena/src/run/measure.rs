//! Measures of a scenario, with their names resolved.

use crate::scenario::{Measure, MeasureTime};

use super::quantity::QuantityProbe;
use super::tick_at;

/// A measure whose names are resolved.
#[derive(Debug, Clone, PartialEq)]
pub struct BoundMeasure {
    pub measure: Measure,
    pub probe: QuantityProbe,
    /// The tick of a measure that has a time.
    pub tick: Option<u64>,
}

impl BoundMeasure {
    /// Returns a measure whose quantity is resolved.
    pub fn new(measure: &Measure, probe: QuantityProbe) -> Self {
        let tick = match measure.time {
            MeasureTime::At(time) => Some(tick_at(time)),
            MeasureTime::End | MeasureTime::First => None,
        };
        BoundMeasure { measure: measure.clone(), probe, tick }
    }
}
