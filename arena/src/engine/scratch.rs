//! Memory of one cohort during a tick.

use super::link::{Arrival, Attempt, DeliveredFrame, Medium, Near};
use super::statistics::LinkStatistics;

/// The results of one cohort in a tick. The value is kept to reuse its memory.
#[derive(Clone, Debug, Default)]
pub(crate) struct Scratch {
    pub(crate) near: Vec<Near>,
    pub(crate) received: Vec<DeliveredFrame>,
    pub(crate) planned: [Vec<Attempt>; Medium::COUNT],
    pub(crate) links: [LinkStatistics; Medium::COUNT],
    /// The fates of frames, while the world is watched.
    pub(crate) arrivals: Vec<Arrival>,
}
