//! Robots of one kind that differ from others of it: worse motors, a weaker link.

use super::body::Models;
use super::link::Pacing;
use super::settings::Settings;

/// Which numbers hold for a robot: those of the world, or others that were added to it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Variant(pub(crate) u16);

impl Variant {
    /// The world's own numbers.
    pub const STANDARD: Variant = Variant(0);
}

/// The numbers of a variant.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Numbers {
    pub(crate) settings: Settings,
    pub(crate) models: Models,
    pub(crate) pacing: Pacing,
}

impl Numbers {
    pub(crate) fn new(settings: Settings, substeps: u32) -> Self {
        let Settings { infrared, nrf24, p2p, .. } = settings;
        let models = Models::new(&settings, substeps);
        Numbers { settings, models, pacing: Pacing { infrared, nrf24, p2p } }
    }
}
