//! Discs on the ground that robots push.
//!
//! A movable disc takes part in the rounds of [`contact`](super::contact) like a robot without a
//! drive. It has neither mass nor friction: it moves only while something overlaps with it.

use core::hash::Hash;

use super::digest::Digest;
use super::geometry::Area;
use super::grid::Cells;
use super::obstacle::{COORDINATE_MM_MAX, Obstacles, away};
use super::ray::Ray;

/// A disc on the ground that robots push: its middle, radius and height in mm. Bodies at its height
/// and above pass over it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MovableDisc {
    pub x: f32,
    pub y: f32,
    pub radius_mm: f32,
    pub height_mm: f32,
}

/// A disc after a round.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Movable {
    pub(crate) disc: MovableDisc,
    /// True if the last round moved it.
    pub(crate) moved: bool,
}

/// The least radius in mm. It keeps the sum of two radii above the overlap that is tolerated.
const RADIUS_MM_MIN: f32 = 1.0;

/// The number of cells up to which their memory is negligible.
const CELLS_MAX: usize = 1000;

/// mm by which the search for a disc is wider than necessary, because discs are sorted by their
/// cells only once in a substep. A disc that is pushed farther may miss a contact until the next.
pub(crate) const MARGIN_MM: f32 = 3.0;

/// All movable discs.
#[derive(Clone, Debug)]
pub(crate) struct Movables {
    area: Area,
    all: Vec<Movable>,
    /// The result of a round, before it replaces `all`.
    pub(crate) next: Vec<Movable>,
    /// The largest radius in mm.
    widest_mm: f32,
    cells: Cells,
    /// The index in `members` of each cell's first disc; two more entries at the end.
    starts: Vec<u32>,
    /// The numbers of the discs, sorted by cells.
    members: Vec<u32>,
    /// True if no disc has moved since they were sorted.
    is_sorted: bool,
}

impl Movables {
    pub(crate) fn new(area: Area) -> Self {
        Movables {
            area,
            all: Vec::new(),
            next: Vec::new(),
            widest_mm: 0.0,
            // The real cells are made with the first disc.
            cells: Cells::new(area, f32::INFINITY, 1),
            starts: Vec::new(),
            members: Vec::new(),
            is_sorted: false,
        }
    }

    /// Adds a disc, which walls and obstacles push out at once.
    pub(crate) fn add(&mut self, disc: MovableDisc, obstacles: &Obstacles) {
        let MovableDisc { x, y, radius_mm, height_mm } = disc;
        // The caller knows that a disc with such numbers is ignored.
        let is_sound = [x, y, radius_mm].iter().all(|number| number.abs() < COORDINATE_MM_MAX);
        if !is_sound || height_mm.is_nan() {
            return;
        }
        let radius_mm = radius_mm.abs().max(RADIUS_MM_MIN);
        let (x, y) = obstacles.push_out_wide(x, y, radius_mm).unwrap_or((x, y));
        let movable = Movable { disc: MovableDisc { x, y, radius_mm, height_mm }, moved: true };
        self.all.push(movable);
        self.next.push(movable);
        self.is_sorted = false;
        let is_wider = radius_mm > self.widest_mm;
        if is_wider || self.all.len().is_power_of_two() {
            self.widest_mm = self.widest_mm.max(radius_mm);
            let side_mm = 2.0 * self.widest_mm + MARGIN_MM;
            self.cells = Cells::new(self.area, side_mm, CELLS_MAX.max(8 * self.all.len()));
            self.starts = vec![0; self.cells.count() + 2];
        }
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.all.is_empty()
    }

    pub(crate) fn all(&self) -> &[Movable] {
        &self.all
    }

    /// Returns the discs that the last round moved.
    pub(crate) fn moved(&self) -> impl Iterator<Item = &Movable> {
        self.all.iter().filter(|movable| movable.moved)
    }

    /// Sorts the discs by cells; within a cell by number.
    pub(crate) fn sort(&mut self) {
        if self.is_sorted {
            return;
        }
        let cell_of = |movable: &Movable| self.cells.cell_at(movable.disc.x, movable.disc.y);
        self.starts.fill(0);
        for movable in &self.all {
            self.starts[cell_of(movable) + 2] += 1;
        }
        let mut sum = 0;
        for start in &mut self.starts {
            sum += *start;
            *start = sum;
        }
        self.members.resize(self.all.len(), 0);
        for (number, movable) in (0..).zip(&self.all) {
            let slot = &mut self.starts[cell_of(movable) + 1];
            self.members[*slot as usize] = number;
            *slot += 1;
        }
        self.is_sorted = true;
    }

    /// Returns the discs, with their numbers, that may touch a disc of that radius, and some others.
    pub(crate) fn near(
        &self,
        x: f32,
        y: f32,
        radius_mm: f32,
    ) -> impl Iterator<Item = (u32, &MovableDisc)> {
        let reach_mm = radius_mm + self.widest_mm + MARGIN_MM;
        let cells = self.cells.covered((x - reach_mm, y - reach_mm), (x + reach_mm, y + reach_mm));
        let members = cells.flat_map(|cell| {
            let range = self.starts[cell] as usize..self.starts[cell + 1] as usize;
            self.members[range].iter().copied()
        });
        members.map(|number| (number, &self.all[number as usize].disc))
    }

    /// Replaces the discs by those in `next`.
    pub(crate) fn turn(&mut self) {
        core::mem::swap(&mut self.all, &mut self.next);
        let is_at_rest = self.moved().next().is_none();
        self.is_sorted &= is_at_rest;
    }

    /// Returns the place to which the discs push a body at the height `z`; `None` if it is free.
    pub(crate) fn push_out(&self, x: f32, y: f32, z: f32, radius_mm: f32) -> Option<(f32, f32)> {
        let mut place = None;
        for Movable { disc, .. } in &self.all {
            if z < disc.height_mm {
                let (x, y) = place.unwrap_or((x, y));
                place =
                    away(x, y, disc.x, disc.y, radius_mm + disc.radius_mm, (1.0, 0.0)).or(place);
            }
        }
        place
    }

    /// Returns the distance along a ray to the first disc at the height of the ray, at most
    /// `reach_mm`.
    pub(crate) fn nearest(&self, ray: &Ray, height_mm: f32, reach_mm: f32) -> f32 {
        let discs = self.all.iter().map(|movable| movable.disc);
        let level = discs.filter(|disc| height_mm < disc.height_mm);
        level
            .filter_map(|disc| ray.to_disc(disc.x, disc.y, disc.radius_mm))
            .fold(reach_mm, f32::min)
    }

    /// Adds the discs to a digest. A round skips a disc that nothing touches unless it has moved.
    pub(crate) fn add_to(&self, digest: &mut Digest) {
        for Movable { disc: MovableDisc { x, y, radius_mm, height_mm }, moved } in &self.all {
            [x, y, radius_mm, height_mm].into_iter().for_each(|part| digest.float(*part));
            moved.hash(digest);
        }
    }
}
