//! Memory of one cohort during a tick.

use super::link::{Attempt, Heard, Medium, Near};
use super::statistics::LinkStatistics;

/// Results of one cohort in a tick; kept for its memory.
#[derive(Clone, Debug, Default)]
pub(crate) struct Scratch {
    pub(crate) near: Vec<Near>,
    pub(crate) heard: Vec<Heard>,
    pub(crate) planned: [Vec<Attempt>; Medium::COUNT],
    pub(crate) links: [LinkStatistics; Medium::COUNT],
}
