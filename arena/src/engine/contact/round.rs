//! One round of contacts: the pushes on one disc.

use super::{CELL_MARGIN_MM, CRASH, Disc, ROBOT, WALL};
use crate::engine::body::BodySize;
use crate::engine::grid::Cells;
use crate::engine::movable::{Movable, Movables};
use crate::engine::obstacle::{OVERLAP_TOLERANCE_MM, Obstacles};
use crate::engine::pool::Pool;

/// Discs that one thread takes at a time.
const CHUNK_DISCS: usize = 512;

/// The data that a disc reads in a round.
pub(super) struct RoundInput<'a> {
    pub(super) cells: &'a Cells,
    pub(super) shapes: &'a [BodySize],
    pub(super) crash_speeds_mm_s: &'a [Option<f32>],
    pub(super) velocities: &'a [[f32; 3]],
    pub(super) starts: &'a [u32],
    pub(super) discs: &'a [Disc],
    pub(super) awake: &'a [bool],
    pub(super) obstacles: &'a Obstacles,
    pub(super) movables: &'a Movables,
    /// The largest radius of a robot in mm.
    pub(super) widest_mm: f32,
    /// True if all discs are processed, not only those near one that moved.
    pub(super) all: bool,
    /// True if it is known that no two robots overlap.
    pub(super) are_apart: bool,
}

impl RoundInput<'_> {
    /// Writes all robots after a round to `next`.
    pub(super) fn push_robots(&self, next: &mut [Disc], pool: &Pool) {
        if self.movables.is_empty() {
            self.push_robots_with::<false>(next, pool);
        } else {
            self.push_robots_with::<true>(next, pool);
        }
    }

    fn push_robots_with<const HAS_MOVABLES: bool>(&self, next: &mut [Disc], pool: &Pool) {
        let work = |(chunk, next): (usize, &mut [Disc])| {
            for (offset, next) in next.iter_mut().enumerate() {
                *next = self.pushed::<HAS_MOVABLES>(chunk * CHUNK_DISCS + offset);
            }
        };
        pool.each(next.chunks_mut(CHUNK_DISCS).enumerate(), work);
    }

    /// Writes all movable discs after a round to `next`.
    pub(super) fn push_movables(&self, next: &mut [Movable], pool: &Pool) {
        let work = |(chunk, next): (usize, &mut [Movable])| {
            for (offset, next) in next.iter_mut().enumerate() {
                *next = self.pushed_movable(chunk * CHUNK_DISCS + offset);
            }
        };
        pool.each(next.chunks_mut(CHUNK_DISCS).enumerate(), work);
    }

    /// Returns a robot after its neighbors, movable discs, walls and obstacles pushed it.
    /// `HAS_MOVABLES` is a constant, because a test for each robot takes 0.2 % of the instructions
    /// of examples/speed.rs.
    fn pushed<const HAS_MOVABLES: bool>(&self, index: usize) -> Disc {
        let mut disc = self.discs[index];
        if !self.all && !self.awake[disc.cell as usize] {
            disc.moved = false;
            return disc;
        }
        let (mut push_x, mut push_y) = (0.0, 0.0);
        let around = self.cells.around(disc.cell as usize);
        for row in if self.are_apart { &[] } else { around.as_slice() } {
            let range = self.starts[row.start] as usize..self.starts[row.end] as usize;
            for (other_index, other) in range.clone().zip(&self.discs[range]) {
                let (dx, dy) = (disc.x - other.x, disc.y - other.y);
                let squared = dx * dx + dy * dy;
                let reach_mm = disc.radius_mm + other.radius_mm - OVERLAP_TOLERANCE_MM;
                if squared >= reach_mm * reach_mm
                    || other_index == index
                    || !self.level(&disc, other)
                {
                    continue;
                }
                disc.touches |= ROBOT | self.crash_with(&disc, other);
                let distance = squared.sqrt();
                let (ux, uy) = if distance > 0.0 {
                    (dx / distance, dy / distance)
                } else {
                    apart(disc.id, other.id)
                };
                let push = (reach_mm + OVERLAP_TOLERANCE_MM - distance) / 2.0;
                push_x += ux * push;
                push_y += uy * push;
            }
        }
        if HAS_MOVABLES {
            let (touches, x, y) = self.pushed_by_movables(index);
            disc.touches |= touches;
            push_x += x;
            push_y += y;
        }
        let (old_x, old_y) = (disc.x, disc.y);
        disc.x += push_x;
        disc.y += push_y;
        if let Some((x, y)) = self.obstacles.push_out(disc.x, disc.y, disc.z, disc.radius_mm) {
            disc.touches |= WALL | self.crash(&disc, [disc.x - x, disc.y - y, 0.0], [0.0; 3]);
            (disc.x, disc.y) = (x, y);
        }
        disc.moved = disc.x != old_x || disc.y != old_y;
        disc
    }

    /// Returns the contacts of a robot with movable discs, and the sum of their pushes.
    #[inline(never)] // Inlined, it makes worlds without such discs 1.5 % slower (examples/speed.rs).
    fn pushed_by_movables(&self, index: usize) -> (u8, f32, f32) {
        let disc = &self.discs[index];
        let (mut touches, mut push_x, mut push_y) = (0, 0.0, 0.0);
        for (number, other) in self.movables.near(disc.x, disc.y, disc.radius_mm) {
            let way = (disc.x - other.x, disc.y - other.y);
            let sum_mm = disc.radius_mm + other.radius_mm;
            if let Some((x, y)) = half_overlap(way, sum_mm, || by_number(number))
                && disc.z < other.height_mm
            {
                touches |= WALL | self.crash(disc, [-way.0, -way.1, 0.0], [0.0; 3]);
                push_x += x;
                push_y += y;
            }
        }
        (touches, push_x, push_y)
    }

    /// Returns a movable disc after robots, other discs, walls and obstacles pushed it.
    ///
    /// It moves by the mean of the pushes, each weighted by its length: by half of the overlap if
    /// one body pushes it, and by the difference if two push it from opposite sides. The sum would
    /// throw a large disc that many small robots touch on the same side, and robots all around it
    /// would make it tremble.
    fn pushed_movable(&self, number: usize) -> Movable {
        let Movable { mut disc, moved } = self.movables.all()[number];
        let (mut sum_x, mut sum_y, mut weights) = (0.0, 0.0, 0.0);
        let mut push = |(x, y): (f32, f32)| {
            let weight = (x * x + y * y).sqrt();
            sum_x += x * weight;
            sum_y += y * weight;
            weights += weight;
        };
        let reach_mm = disc.radius_mm + self.widest_mm + CELL_MARGIN_MM;
        let (low, high) =
            ((disc.x - reach_mm, disc.y - reach_mm), (disc.x + reach_mm, disc.y + reach_mm));
        for cell in self.cells.covered(low, high) {
            let range = self.starts[cell] as usize..self.starts[cell + 1] as usize;
            for robot in self.discs[range].iter().filter(|robot| robot.z < disc.height_mm) {
                let way = (disc.x - robot.x, disc.y - robot.y);
                let sum_mm = disc.radius_mm + robot.radius_mm;
                let opposite = || {
                    let (x, y) = by_number(number as u32);
                    (-x, -y)
                };
                half_overlap(way, sum_mm, opposite).into_iter().for_each(&mut push);
            }
        }
        for (other_number, other) in self.movables.near(disc.x, disc.y, disc.radius_mm) {
            if other_number as usize == number {
                continue;
            }
            let way = (disc.x - other.x, disc.y - other.y);
            let sum_mm = disc.radius_mm + other.radius_mm;
            let direction = || apart(number as u32, other_number);
            half_overlap(way, sum_mm, direction).into_iter().for_each(&mut push);
        }
        // A disc at rest is free of walls and obstacles.
        if weights == 0.0 && !moved {
            return Movable { disc, moved };
        }
        let (old_x, old_y) = (disc.x, disc.y);
        if weights > 0.0 {
            disc.x += sum_x / weights;
            disc.y += sum_y / weights;
        }
        if let Some(free) = self.obstacles.push_out_wide(disc.x, disc.y, disc.radius_mm) {
            (disc.x, disc.y) = free;
        }
        Movable { disc, moved: disc.x != old_x || disc.y != old_y }
    }

    /// Returns true if no two robots touch.
    pub(super) fn finds_all_apart(&self) -> bool {
        let reach_mm = self.widest_mm + self.widest_mm - OVERLAP_TOLERANCE_MM;
        self.discs.iter().enumerate().all(|(place, disc)| {
            self.discs[..place].iter().all(|other| {
                let (dx, dy) = (disc.x - other.x, disc.y - other.y);
                dx * dx + dy * dy >= reach_mm * reach_mm || !self.level(disc, other)
            })
        })
    }

    /// Returns [`CRASH`] if a disc crashes into another one.
    fn crash_with(&self, disc: &Disc, other: &Disc) -> u8 {
        // There are no velocities while no robot can crash.
        let Some(velocity) = self.velocities.get(usize::from(other.id)) else { return 0 };
        self.crash(disc, [other.x - disc.x, other.y - disc.y, other.z - disc.z], *velocity)
    }

    /// Returns [`CRASH`], or 0 if there is no crash, for a disc that touches something in direction
    /// `towards` that moves with `velocity`.
    fn crash(&self, disc: &Disc, towards: [f32; 3], velocity: [f32; 3]) -> u8 {
        // There are no velocities while no robot can crash, and some bodies never do.
        let Some(own) = self.velocities.get(usize::from(disc.id)) else { return 0 };
        let Some(limit_mm_s) = self.crash_speeds_mm_s[usize::from(disc.herd)] else { return 0 };
        if disc.z <= 0.0 {
            return 0;
        }
        let length = towards.iter().map(|part| part * part).sum::<f32>().sqrt();
        let way: f32 = (0..3).map(|axis| (own[axis] - velocity[axis]) * towards[axis]).sum();
        // A division by `length` would fail for two bodies at the same place.
        if limit_mm_s == 0.0 || way > limit_mm_s * length { CRASH } else { 0 }
    }

    /// Returns true if two bodies overlap in height.
    fn level(&self, a: &Disc, b: &Disc) -> bool {
        let height = |disc: &Disc| self.shapes[usize::from(disc.herd)].height_mm;
        a.z < b.z + height(b) && b.z < a.z + height(a)
    }
}

/// Returns half of the overlap of two discs, as the vector by which it moves the first one. `way`
/// leads from the second middle to the first one, and `sum_mm` is the sum of the radii. `direction`
/// is called if the middles coincide.
fn half_overlap(
    (dx, dy): (f32, f32),
    sum_mm: f32,
    direction: impl FnOnce() -> (f32, f32),
) -> Option<(f32, f32)> {
    let squared = dx * dx + dy * dy;
    let reach_mm = sum_mm - OVERLAP_TOLERANCE_MM;
    if squared >= reach_mm * reach_mm {
        return None;
    }
    let distance = squared.sqrt();
    let (ux, uy) = if distance > 0.0 { (dx / distance, dy / distance) } else { direction() };
    let push = (sum_mm - distance) / 2.0;
    Some((ux * push, uy * push))
}

/// Returns the direction that separates two discs at exactly the same place, another one for each
/// pair.
fn apart(a: impl Into<u32>, b: impl Into<u32>) -> (f32, f32) {
    let (a, b) = (a.into(), b.into());
    let pair = a.min(b).wrapping_mul(31).wrapping_add(a.max(b));
    let (x, y) = by_number(pair);
    if a < b { (x, y) } else { (-x, -y) }
}

/// Returns one of 1024 directions.
fn by_number(number: u32) -> (f32, f32) {
    let (sin, cos) = libm::sincosf((number % 1024) as f32 * 2.399_963);
    (cos, sin)
}
