//! Painted ground.

use super::environment::Environment;
use super::geometry::{direction, turned_back};

/// The brightness of ground without paint.
pub(crate) const WHITE: f32 = 1.0;

/// A painted part of the ground.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Patch {
    /// mm
    pub x: f32,
    /// mm
    pub y: f32,
    pub shape: PatchShape,
    /// 0 (black) to 1 (white).
    pub brightness: f32,
}

/// The shape of a patch around its middle, rim included.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PatchShape {
    /// A disc with this radius (mm).
    Disc(f32),
    /// A box (mm).
    Box {
        /// Size along `along`.
        width: f32,
        /// Size across `along`.
        height: f32,
        /// The direction of the width. Its length does not matter.
        along: (f32, f32),
    },
}

/// White ground with patches on it: the brightness of the ground as an [`Environment`].
#[derive(Clone, Debug, Default)]
pub struct PaintedGround {
    /// From the bottom to the top.
    patches: Vec<Patch>,
}

impl PaintedGround {
    /// Returns ground with these patches, of which later ones lie over earlier ones. A box without
    /// a direction is left out.
    #[must_use]
    pub fn new(patches: impl IntoIterator<Item = Patch>) -> Self {
        let sound = |patch: Patch| {
            let shape = match patch.shape {
                PatchShape::Box { width, height, along } => {
                    PatchShape::Box { width, height, along: direction(along)? }
                }
                disc @ PatchShape::Disc(_) => disc,
            };
            Some(Patch { shape, ..patch })
        };
        PaintedGround { patches: patches.into_iter().filter_map(sound).collect() }
    }

    fn brightness(&self, [x, y]: [f32; 2]) -> f32 {
        let top = self.patches.iter().rfind(|patch| patch.covers(x - patch.x, y - patch.y));
        top.map_or(WHITE, |patch| patch.brightness)
    }
}

impl Patch {
    /// Returns true if the patch covers the place that is `dx` and `dy` from its middle.
    fn covers(&self, dx: f32, dy: f32) -> bool {
        match self.shape {
            PatchShape::Disc(radius) => dx * dx + dy * dy <= radius * radius,
            PatchShape::Box { width, height, along } => {
                let (here_x, here_y) = turned_back((dx, dy), along);
                here_x.abs() <= width / 2.0 && here_y.abs() <= height / 2.0
            }
        }
    }
}

impl Environment for PaintedGround {
    fn copy(&self) -> Box<dyn Environment> {
        Box::new(self.clone())
    }

    fn sense(&mut self, places: &[[f32; 2]], values: &mut [f32]) {
        for (place, value) in places.iter().zip(values) {
            *value = self.brightness(*place);
        }
    }
}
