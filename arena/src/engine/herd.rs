//! Herds: robots of one model that use the same link.

use std::sync::Arc;

use super::body::{BodyBlock, BodyModel, BodySize};
use super::link::{Media, Medium};

/// The number of a herd in its world.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct HerdId(pub(crate) u16);

/// The model and the link of the robots of one herd.
#[derive(Clone, Debug)]
pub(crate) struct Herd {
    pub(crate) model: Arc<dyn BodyModel>,
    pub(crate) shape: BodySize,
    pub(crate) medium: Medium,
    pub(crate) media: Media,
    /// Index of the herd's link among the links of its medium.
    pub(crate) link: u16,
    pub(crate) has_positioning: bool,
    /// The place of each ground sensor: mm ahead of the middle and to the left of it.
    pub(crate) ground_sensors: Vec<[f32; 2]>,
}

/// Robots of one herd with consecutive ids, and their bodies.
#[derive(Clone, Debug)]
pub(crate) struct Cohort {
    pub(crate) herd: HerdId,
    /// Id of the first robot.
    pub(crate) first: usize,
    pub(crate) count: usize,
    /// The number of ground sensors of all robots with lower ids.
    pub(crate) ground_sensors_before: usize,
    pub(crate) block: Box<dyn BodyBlock>,
}
