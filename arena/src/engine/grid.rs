//! A grid of square cells over the world, so that a robot examines only its neighborhood.

use core::ops::Range;

use super::geometry::Area;

/// A division of the world into cells. A rim of empty cells surrounds it, so that every cell has
/// eight neighbors.
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
    /// Returns cells that are at least `size` mm wide, and hardly more than `most` of them. An
    /// infinite size gives a single cell.
    pub(crate) fn new(area: Area, size_mm: f32, most: usize) -> Self {
        let most = most.max(1) as f32;
        let side = size_mm.max((area.width / most * area.height).sqrt());
        // In a long, narrow world the square root alone would still give too many cells.
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

    /// Returns the side of a cell in mm.
    pub(crate) fn side(&self) -> f32 {
        1.0 / self.per_mm
    }

    /// Returns the number of cells, the rim included.
    pub(crate) fn count(&self) -> usize {
        self.count
    }

    /// Returns the cell of a place. Places outside of the world belong to the nearest cell.
    #[inline]
    pub(crate) fn cell_at(&self, x: f32, y: f32) -> usize {
        let column = number(((x - self.left) * self.per_mm).clamp(0.0, self.last_column));
        let row = number(((y - self.bottom) * self.per_mm).clamp(0.0, self.last_row));
        (row + 1) * self.stride + column + 1
    }

    /// Returns a cell and its eight neighbors: three rows of three.
    pub(crate) fn around(&self, cell: usize) -> [Range<usize>; 3] {
        [cell - self.stride, cell, cell + self.stride].map(|middle| middle - 1..middle + 2)
    }

    /// Returns the cells that a rectangle touches.
    pub(crate) fn covered(&self, low: (f32, f32), high: (f32, f32)) -> impl Iterator<Item = usize> {
        let (first, last) = (self.cell_at(low.0, low.1), self.cell_at(high.0, high.1));
        let width = last % self.stride - first % self.stride;
        let stride = self.stride;
        (first..=last - width).step_by(stride).flat_map(move |start| start..=start + width)
    }
}

/// Rounds a number of columns or rows down. The conversion to 32 bits takes fewer instructions than that to `usize`.
#[inline]
fn number(cells: f32) -> usize {
    cells as i32 as usize
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::stream::Stream;

    fn is_around(cells: &Cells, here: (f32, f32), there: (f32, f32)) -> bool {
        let other = cells.cell_at(there.0, there.1);
        cells.around(cells.cell_at(here.0, here.1)).iter().any(|row| row.contains(&other))
    }

    /// A point that is nearer than the side of a cell is in the cells around, in worlds of all
    /// shapes.
    #[test]
    fn neighbors_are_around() {
        let mut stream = Stream::for_brain(1, 1);
        for _ in 0..300 {
            let side = |stream: &mut Stream| 1.0 + 3000.0 * stream.unit() * stream.unit();
            let area = Area { width: side(&mut stream), height: side(&mut stream) };
            let size = 5.0 + 200.0 * stream.unit();
            let cells = Cells::new(area, size, 2000);
            assert!(cells.count() < 4 * 2000);
            for _ in 0..50 {
                let here =
                    ((stream.unit() - 0.5) * area.width, (stream.unit() - 0.5) * area.height);
                let angle = stream.unit() * core::f32::consts::TAU;
                let distance = size * stream.unit();
                let there = (here.0 + distance * angle.cos(), here.1 + distance * angle.sin());
                assert!(is_around(&cells, here, there), "{area:?} {size}: {here:?} {there:?}");
                let low = (here.0.min(there.0), here.1.min(there.1));
                let high = (here.0.max(there.0), here.1.max(there.1));
                let covered: Vec<_> = cells.covered(low, high).collect();
                assert!(covered.contains(&cells.cell_at(here.0, here.1)));
                assert!(covered.contains(&cells.cell_at(there.0, there.1)));
            }
        }
    }
}
