//! Square cells over the world, so that a robot looks at its neighbourhood only.

use core::ops::Range;

use super::geometry::Area;

/// How the world is divided. Around the world lies a rim of cells in which nothing is, so that every cell has eight
/// neighbours.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cells {
    left: f32,
    bottom: f32,
    per_mm: f32,
    last_column: f32,
    last_row: f32,
    stride: usize,
    count: usize,
}

impl Cells {
    /// Cells at least `size` mm wide (of infinite size there is one), and hardly more than `most` of them.
    pub(crate) fn new(area: Area, size: f32, most: usize) -> Self {
        let most = most.max(1) as f32;
        let side = size.max((area.width / most * area.height).sqrt());
        // In a narrow world the root alone would still give too many.
        let side = side.max(area.width / most).max(area.height / most).max(1.0);
        let columns = (area.width / side).ceil().max(1.0);
        let rows = (area.height / side).ceil().max(1.0);
        let stride = columns as usize + 2;
        Cells {
            left: -area.width / 2.0,
            bottom: -area.height / 2.0,
            per_mm: 1.0 / side,
            last_column: columns - 1.0,
            last_row: rows - 1.0,
            stride,
            count: stride * (rows as usize + 2),
        }
    }

    /// mm from side to side of a cell.
    pub(crate) fn side(&self) -> f32 {
        1.0 / self.per_mm
    }

    /// How many cells there are, the rim included.
    pub(crate) fn count(&self) -> usize {
        self.count
    }

    /// The cell of a place; places outside belong to the nearest cell.
    pub(crate) fn of(&self, x: f32, y: f32) -> usize {
        let column = ((x - self.left) * self.per_mm).clamp(0.0, self.last_column) as usize;
        let row = ((y - self.bottom) * self.per_mm).clamp(0.0, self.last_row) as usize;
        (row + 1) * self.stride + column + 1
    }

    /// The cells around a cell and itself: three rows of three.
    pub(crate) fn around(&self, cell: usize) -> [Range<usize>; 3] {
        [cell - self.stride, cell, cell + self.stride].map(|middle| middle - 1..middle + 2)
    }

    /// The cells that a rectangle touches.
    pub(crate) fn covered(&self, low: (f32, f32), high: (f32, f32)) -> impl Iterator<Item = usize> {
        let (first, last) = (self.of(low.0, low.1), self.of(high.0, high.1));
        let width = last % self.stride - first % self.stride;
        let stride = self.stride;
        (first..=last - width).step_by(stride).flat_map(move |start| start..=start + width)
    }
}
