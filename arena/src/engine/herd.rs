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
}

/// Robots of one herd with consecutive ids, and their bodies.
#[derive(Clone, Debug)]
pub(crate) struct Cohort {
    pub(crate) herd: HerdId,
    /// Id of the first robot.
    pub(crate) first: usize,
    pub(crate) count: usize,
    pub(crate) block: Box<dyn BodyBlock>,
}
