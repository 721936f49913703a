//! Herds: robots of one model that talk over one link.

use std::sync::Arc;

use super::body::{Block, BodyModel, Shape};
use super::link::{Media, Medium};

/// The number of a herd in its world.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct HerdId(pub(crate) u16);

/// The numbers that hold for robots of one herd.
#[derive(Clone, Debug)]
pub(crate) struct Herd {
    pub(crate) model: Arc<dyn BodyModel>,
    pub(crate) shape: Shape,
    pub(crate) medium: Medium,
    pub(crate) media: Media,
    /// Its number among the links of its medium.
    pub(crate) link: u16,
    pub(crate) has_positioning: bool,
}

/// Robots of one herd with successive ids, and their bodies.
#[derive(Clone, Debug)]
pub(crate) struct Cohort {
    pub(crate) herd: HerdId,
    /// The first id.
    pub(crate) first: usize,
    pub(crate) count: usize,
    pub(crate) block: Box<dyn Block>,
}
