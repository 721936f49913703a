//! Walls and obstacles, which push bodies out.

use super::geometry::{Area, Pose, direction, turned, turned_back};
use super::grid::Cells;

/// A wall or an obstacle, which bodies cannot enter below its height. The height is unlimited
/// unless the obstacle is added with one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Obstacle {
    /// A thin wall between two points (mm).
    Segment {
        /// One end.
        from: (f32, f32),
        /// The other end.
        to: (f32, f32),
    },
    /// A round obstacle: its middle and its radius (mm).
    Round { x: f32, y: f32, radius: f32 },
    /// A box with sides along the axes: its middle and its size (mm).
    Box {
        x: f32,
        y: f32,
        /// Size along x.
        width: f32,
        /// Size along y.
        height: f32,
    },
    /// A box with sides in any direction: its middle and its size (mm).
    TurnedBox {
        x: f32,
        y: f32,
        /// Size along `along`.
        width: f32,
        /// Size across `along`.
        height: f32,
        /// The direction of the width. Its length does not matter.
        along: (f32, f32),
    },
}

/// The overlap of two bodies in mm that is tolerated. It keeps bodies at rest from trembling.
pub(crate) const OVERLAP_TOLERANCE_MM: f32 = 0.05;

/// Height in mm by which feet sink into an obstacle on which a robot stands.
const SINK_MM: f32 = 1.0;

/// The limit for the numbers of obstacles in mm, far beyond every world.
pub(crate) const COORDINATE_MM_MAX: f32 = 1e7;

impl Obstacle {
    /// Returns the obstacle without negative sizes, and with a direction of length 1; `None` if a
    /// number is not finite or too large for the arithmetic, or if there is no direction.
    fn sound(self) -> Option<Self> {
        let (sound, numbers) = match self {
            Obstacle::Segment { from, to } => (self, [from.0, from.1, to.0, to.1]),
            Obstacle::Round { x, y, radius } => {
                (Obstacle::Round { x, y, radius: radius.abs() }, [x, y, radius, 0.0])
            }
            Obstacle::Box { x, y, width, height } => {
                let (width, height) = (width.abs(), height.abs());
                (Obstacle::Box { x, y, width, height }, [x, y, width, height])
            }
            Obstacle::TurnedBox { x, y, width, height, along } => {
                let along = direction(along)?;
                let (width, height) = (width.abs(), height.abs());
                (Obstacle::TurnedBox { x, y, width, height, along }, [x, y, width, height])
            }
        };
        numbers.iter().all(|number| number.abs() < COORDINATE_MM_MAX).then_some(sound)
    }

    /// Returns the lower left and the upper right corner of the smallest rectangle around the
    /// obstacle.
    fn bounds(&self) -> ((f32, f32), (f32, f32)) {
        match *self {
            Obstacle::Segment { from, to } => {
                ((from.0.min(to.0), from.1.min(to.1)), (from.0.max(to.0), from.1.max(to.1)))
            }
            Obstacle::Round { x, y, radius } => {
                ((x - radius, y - radius), (x + radius, y + radius))
            }
            Obstacle::Box { x, y, width, height } => {
                ((x - width / 2.0, y - height / 2.0), (x + width / 2.0, y + height / 2.0))
            }
            Obstacle::TurnedBox { x, y, width, height, along } => {
                let (cos, sin) = (along.0.abs(), along.1.abs());
                let (half_x, half_y) =
                    ((width * cos + height * sin) / 2.0, (width * sin + height * cos) / 2.0);
                ((x - half_x, y - half_y), (x + half_x, y + half_y))
            }
        }
    }

    /// Returns true if the smallest rectangle around the obstacle reaches into another rectangle,
    /// which is given by its lower left and its upper right corner.
    pub(crate) fn reaches_into(&self, low: (f32, f32), high: (f32, f32)) -> bool {
        let ((left, bottom), (right, top)) = self.bounds();
        left <= high.0 && right >= low.0 && bottom <= high.1 && top >= low.1
    }

    /// Returns true if the obstacle covers a place.
    fn covers(&self, x: f32, y: f32) -> bool {
        self.push_out(x, y, 0.0).is_some()
    }

    /// Returns the place at which the disc just touches the obstacle; `None` if the disc does not
    /// overlap with it.
    fn push_out(&self, x: f32, y: f32, radius_mm: f32) -> Option<(f32, f32)> {
        match *self {
            Obstacle::Segment { from, to } => {
                let (along_x, along_y) = (to.0 - from.0, to.1 - from.1);
                let length = (along_x * along_x + along_y * along_y).sqrt();
                let (ux, uy) =
                    if length > 0.0 { (along_x / length, along_y / length) } else { (1.0, 0.0) };
                let at = ((x - from.0) * ux + (y - from.1) * uy).clamp(0.0, length);
                away(x, y, from.0 + at * ux, from.1 + at * uy, radius_mm, (-uy, ux))
            }
            Obstacle::Round { x: cx, y: cy, radius: size } => {
                away(x, y, cx, cy, radius_mm + size, (1.0, 0.0))
            }
            Obstacle::Box { x: cx, y: cy, width, height } => {
                let (dx, dy) = (x - cx, y - cy);
                let (half_x, half_y) = (width / 2.0, height / 2.0);
                if dx.abs() <= half_x && dy.abs() <= half_y {
                    // The middle of the disc is inside of the box or on its rim: push it out
                    // through the nearest side.
                    return Some(if half_x - dx.abs() < half_y - dy.abs() {
                        (cx + (half_x + radius_mm).copysign(dx), y)
                    } else {
                        (x, cy + (half_y + radius_mm).copysign(dy))
                    });
                }
                let nearest = (cx + dx.clamp(-half_x, half_x), cy + dy.clamp(-half_y, half_y));
                away(x, y, nearest.0, nearest.1, radius_mm, (1.0, 0.0))
            }
            Obstacle::TurnedBox { x: cx, y: cy, width, height, along } => {
                let straight = Obstacle::Box { x: 0.0, y: 0.0, width, height };
                let (here_x, here_y) = turned_back((x - cx, y - cy), along);
                let free = straight.push_out(here_x, here_y, radius_mm)?;
                let (dx, dy) = turned(free, along);
                Some((cx + dx, cy + dy))
            }
        }
    }
}

/// Moves a point that is less than `distance` from another one to that distance; returns `None` if
/// it is far enough away. `normal` is the direction if the two points coincide.
pub(crate) fn away(
    x: f32,
    y: f32,
    from_x: f32,
    from_y: f32,
    distance_mm: f32,
    normal: (f32, f32),
) -> Option<(f32, f32)> {
    let (dx, dy) = (x - from_x, y - from_y);
    let squared = dx * dx + dy * dy;
    if squared >= (distance_mm - OVERLAP_TOLERANCE_MM) * (distance_mm - OVERLAP_TOLERANCE_MM) {
        return None;
    }
    let now = squared.sqrt();
    let (ux, uy) = if now > 0.0 { (dx / now, dy / now) } else { normal };
    Some((from_x + ux * distance_mm, from_y + uy * distance_mm))
}

/// The walls around the world and all obstacles in it.
#[derive(Clone, Debug)]
pub(crate) struct Obstacles {
    area: Area,
    /// mm by which obstacles are enlarged in the index: the greatest radius of a body plus its
    /// movement between two queries, at least [`MARGIN_MM_MIN`].
    margin_mm: f32,
    all: Vec<Obstacle>,
    /// The height in mm of each obstacle; bodies at that height or above pass over it.
    heights_mm: Vec<f32>,
    cells: Cells,
    /// The obstacles that reach into each cell.
    members: Vec<Vec<u32>>,
}

/// Side of a cell in mm, coarse enough that walls are in few cells, and fine enough that a cell has
/// few obstacles.
const CELL_MM: f32 = 100.0;

/// The largest number of cells, which cost only memory.
const CELLS_MAX: usize = 20_000;

/// The initial margin in mm, enough for most robots, so that their obstacles are entered only once.
const MARGIN_MM_MIN: f32 = 61.0;

impl Obstacles {
    pub(crate) fn new(area: Area) -> Self {
        // The real cells are made with the first obstacle.
        let cells = Cells::new(area, f32::INFINITY, 1);
        let members = vec![Vec::new(); cells.count()];
        Obstacles {
            area,
            margin_mm: MARGIN_MM_MIN,
            all: Vec::new(),
            heights_mm: Vec::new(),
            cells,
            members,
        }
    }

    /// Enlarges the margin for bodies of that radius in mm, if necessary.
    pub(crate) fn admit(&mut self, radius_mm: f32) {
        if radius_mm + 1.0 > self.margin_mm {
            self.margin_mm = radius_mm + 1.0;
            self.members.iter_mut().for_each(Vec::clear);
            let all = core::mem::take(&mut self.all);
            let heights_mm = core::mem::take(&mut self.heights_mm);
            let both = all.into_iter().zip(heights_mm);
            both.for_each(|(obstacle, height)| self.add(obstacle, height));
        }
    }

    pub(crate) fn add(&mut self, obstacle: Obstacle, height_mm: f32) {
        // The caller knows that an obstacle with such numbers is ignored.
        let Some(obstacle) = obstacle.sound() else { return };
        let (low, high) = obstacle.bounds();
        let low = (low.0 - self.margin_mm, low.1 - self.margin_mm);
        let high = (high.0 + self.margin_mm, high.1 + self.margin_mm);
        let index = self.all.len() as u32;
        if index == 0 {
            self.cells = Cells::new(self.area, CELL_MM, CELLS_MAX);
            self.members = vec![Vec::new(); self.cells.count()];
        }
        self.all.push(obstacle);
        self.heights_mm.push(height_mm);
        for cell in self.cells.covered(low, high) {
            self.members[cell].push(index);
        }
    }

    pub(crate) fn all(&self) -> &[Obstacle] {
        &self.all
    }

    /// Returns all obstacles with their heights in mm.
    pub(crate) fn with_heights(&self) -> impl Iterator<Item = (&Obstacle, f32)> {
        self.all.iter().zip(self.heights_mm.iter().copied())
    }

    /// Returns the obstacles that are higher than a height in mm.
    pub(crate) fn at(&self, height_mm: f32) -> impl Iterator<Item = &Obstacle> {
        let all = self.all.iter().zip(&self.heights_mm);
        all.filter(move |(_, top)| height_mm < **top).map(|(obstacle, _)| obstacle)
    }

    /// Returns the height in mm of the highest obstacle on which a body at this pose stands, or would
    /// fall; 0 if there is none.
    pub(crate) fn floor_mm(&self, pose: &Pose) -> f32 {
        if self.all.is_empty() {
            return 0.0;
        }
        let members = &self.members[self.cells.cell_at(pose.x, pose.y)];
        let tops = members.iter().filter_map(|&member| {
            let top_mm = self.heights_mm[member as usize];
            let is_below = pose.z >= top_mm - SINK_MM;
            (is_below && self.all[member as usize].covers(pose.x, pose.y)).then_some(top_mm)
        });
        tops.fold(0.0, f32::max)
    }

    /// Returns the place to which the walls and obstacles push a disc at the height `z`; `None` if
    /// the disc is free.
    pub(crate) fn push_out(&self, x: f32, y: f32, z: f32, radius_mm: f32) -> Option<(f32, f32)> {
        let (mut now_x, mut now_y) = (x, y);
        if !self.all.is_empty() {
            for &member in &self.members[self.cells.cell_at(x, y)] {
                if z >= self.heights_mm[member as usize] - SINK_MM {
                    continue;
                }
                if let Some(free) = self.all[member as usize].push_out(now_x, now_y, radius_mm) {
                    (now_x, now_y) = free;
                }
            }
        }
        let free = self.inside(now_x, now_y, radius_mm);
        (free != (x, y)).then_some(free)
    }

    /// Returns the place to which the walls and obstacles push a disc of any size that stands on the
    /// ground; `None` if it is free. The index is only for the bodies of robots, so this method
    /// examines all obstacles.
    pub(crate) fn push_out_wide(&self, x: f32, y: f32, radius_mm: f32) -> Option<(f32, f32)> {
        let pushed = self.at(0.0).fold((x, y), |(now_x, now_y), obstacle| {
            obstacle.push_out(now_x, now_y, radius_mm).unwrap_or((now_x, now_y))
        });
        let free = self.inside(pushed.0, pushed.1, radius_mm);
        (free != (x, y)).then_some(free)
    }

    /// Returns the nearest place of a disc within the walls.
    fn inside(&self, x: f32, y: f32, radius_mm: f32) -> (f32, f32) {
        let reach_x = (self.area.width / 2.0 - radius_mm).max(0.0);
        let reach_y = (self.area.height / 2.0 - radius_mm).max(0.0);
        (x.clamp(-reach_x, reach_x), y.clamp(-reach_y, reach_y))
    }
}
