//! Collision of bodies: discs that overlap push each other apart, and walls and obstacles push discs
//! out. A contact is such an overlap. Collisions of frames are in [`link`](super::link).
//!
//! A round reads all positions from the round before. Every disc moves by half of each overlap, so
//! the result does not depend on the order of the discs, and two discs move by the same amount in
//! opposite directions. A few more rounds follow near discs that moved. Overlaps that remain in
//! dense crowds are resolved in the next tick. Discs that robots push ([`movable`](super::movable))
//! take part in the rounds, but count as obstacles.
//!
//! A flying body crashes when it touches something in the air. Its velocity is computed from its
//! movement in the last substep.

use core::hash::Hash;
use std::collections::HashSet;

use super::body::BodySize;
use super::digest::Digest;
use super::geometry::{Area, Pose};
use super::grid::Cells;
use super::id::RobotId;
use super::movable::{Movable, MovableDisc, Movables};
use super::obstacle::Obstacles;
use super::pool::Pool;
use super::ray::Ray;
use super::statistics::WorldStatistics;

mod round;

use round::RoundInput;

/// The largest number of rounds in one substep.
const ROUNDS_MAX: usize = 4;

/// The number of cells up to which their memory is negligible.
const CELLS_MAX: usize = 1000;

/// Up to this number of discs, the first round compares all pairs. If all discs are apart, it skips
/// the search through the cells.
const PAIRWISE_MAX: usize = 64;

/// mm by which a cell is larger than the largest disc. A disc that is pushed farther in one substep
/// may miss a contact.
const CELL_MARGIN_MM: f32 = 3.0;

/// Bit of [`Disc::touches`]: the disc touches another robot.
const ROBOT: u8 = 1;
/// Bit of [`Disc::touches`]: the disc touches a wall or an obstacle.
const WALL: u8 = 2;
/// Bit of [`Disc::touches`]: the disc crashed into a robot, a wall or an obstacle.
const CRASH: u8 = 4;

/// A body seen from above.
#[derive(Clone, Copy, Debug)]
struct Disc {
    x: f32,
    y: f32,
    z: f32,
    radius_mm: f32,
    cell: u32,
    id: u16,
    herd: u16,
    /// The sum of [`ROBOT`], [`WALL`] and [`CRASH`].
    touches: u8,
    /// True if the last round moved it.
    moved: bool,
}

/// All robots, sorted by cells, and the discs that they push.
#[derive(Clone, Debug)]
pub(crate) struct Crowd {
    cells: Cells,
    /// The shape of each herd.
    shapes: Vec<BodySize>,
    /// The closing speed in mm/s of each herd above which a contact in the air is a crash.
    crash_speeds_mm_s: Vec<Option<f32>>,
    /// The herd of each robot.
    herds: Vec<u16>,
    /// The shapes of these robots: the bits of radius and height.
    known_shapes: HashSet<[u32; 2]>,
    /// The largest radius of a robot in mm.
    widest_mm: f32,
    /// True if a robot can crash.
    has_fliers: bool,
    /// The place of each robot after the last substep. `velocities` has its velocity since then in
    /// mm/s. Both are empty while no robot can crash.
    places: Vec<[f32; 3]>,
    velocities: Vec<[f32; 3]>,
    /// The index of each cell's first disc; two more entries at the end.
    starts: Vec<u32>,
    discs: Vec<Disc>,
    next: Vec<Disc>,
    /// True if the cells changed since the discs were sorted by cells.
    is_new: bool,
    /// True for each cell in or next to which the last round moved a disc. `woken` lists the cells
    /// of the discs that moved.
    awake: Vec<bool>,
    woken: Vec<u32>,
    /// The contacts of each robot in this tick; `touched` has those of the last tick.
    touches: Vec<u8>,
    touched: Vec<u8>,
    pub(crate) movables: Movables,
}

impl Crowd {
    pub(crate) fn new(area: Area) -> Self {
        let mut crowd = Crowd {
            cells: Cells::new(area, f32::INFINITY, 1),
            shapes: Vec::new(),
            crash_speeds_mm_s: Vec::new(),
            herds: Vec::new(),
            known_shapes: HashSet::new(),
            widest_mm: 1.0,
            has_fliers: false,
            places: Vec::new(),
            velocities: Vec::new(),
            starts: Vec::new(),
            discs: Vec::new(),
            next: Vec::new(),
            is_new: true,
            awake: Vec::new(),
            woken: Vec::new(),
            touches: Vec::new(),
            touched: Vec::new(),
            movables: Movables::new(area),
        };
        crowd.resize(area);
        crowd
    }

    /// Makes cells for the largest robot in the world. Their number grows with the number of
    /// robots, because every tick clears all of them.
    fn resize(&mut self, area: Area) {
        self.cells = Cells::new(
            area,
            2.0 * self.widest_mm + CELL_MARGIN_MM,
            CELLS_MAX.max(8 * self.herds.len()),
        );
        self.starts = vec![0; self.cells.count() + 2];
        self.awake = vec![false; self.cells.count()];
        self.woken.clear();
        self.is_new = true;
    }

    /// Adds the next herd.
    pub(crate) fn add_herd(&mut self, shape: BodySize, crash_speed_mm_s: Option<f32>) {
        self.shapes.push(shape);
        self.crash_speeds_mm_s.push(crash_speed_mm_s);
    }

    /// Adds a robot of a herd.
    pub(crate) fn add(&mut self, herd: u16, area: Area) {
        let shape = self.shapes[usize::from(herd)];
        let bits = [shape.radius_mm, shape.height_mm].map(f32::to_bits);
        let is_new = self.known_shapes.insert(bits);
        self.widest_mm = self.widest_mm.max(shape.radius_mm);
        let has_doubled = self.herds.len().is_power_of_two();
        self.herds.push(herd);
        self.has_fliers |= self.crash_speeds_mm_s[usize::from(herd)].is_some();
        self.touches.push(0);
        self.touched.push(0);
        if is_new || has_doubled {
            self.resize(area);
        }
    }

    /// Adds the places and contacts of the last tick to a digest. Sensors read these places, and
    /// velocities are computed from them.
    pub(crate) fn add_to(&self, digest: &mut Digest) {
        for Disc { x, y, z, id, .. } in &self.discs {
            id.hash(digest);
            [x, y, z].into_iter().for_each(|part| digest.float(*part));
        }
        self.places.iter().flatten().for_each(|part| digest.float(*part));
        self.touched.hash(digest);
        self.movables.add_to(digest);
    }

    /// Stores the new place of a robot that was moved by a command, so that the jump does not count
    /// as a velocity.
    pub(crate) fn displace(&mut self, index: usize, pose: &Pose) {
        // A new robot gets its place in the next substep.
        if let Some(place) = self.places.get_mut(index) {
            *place = [pose.x, pose.y, pose.z];
        }
    }

    /// Returns the robots that have crashed in this tick.
    pub(crate) fn crashed(&self) -> Vec<RobotId> {
        if !self.has_fliers {
            return Vec::new();
        }
        let touches = self.touches.iter().enumerate().filter(|(_, touches)| **touches & CRASH > 0);
        touches.map(|(index, _)| RobotId(index as u16)).collect()
    }

    /// Pushes everything apart. Called once per substep, whose length is `seconds`.
    pub(crate) fn settle(
        &mut self,
        poses: &mut [Pose],
        obstacles: &Obstacles,
        pool: &Pool,
        seconds: f32,
    ) {
        self.place(poses);
        self.movables.sort();
        if self.has_fliers {
            // Robots without an entry in `places` are new.
            self.places
                .extend(poses[self.places.len()..].iter().map(|pose| [pose.x, pose.y, pose.z]));
            self.velocities.clear();
            self.velocities.extend(poses.iter().zip(&self.places).map(|(pose, [x, y, z])| {
                [pose.x - x, pose.y - y, pose.z - z].map(|way| way / seconds)
            }));
        }
        for round in 0..ROUNDS_MAX {
            self.round(round, obstacles, pool);
            if round == 0 {
                for disc in &self.discs {
                    self.touches[usize::from(disc.id)] |= disc.touches;
                }
            }
            if !self.wake() {
                break;
            }
        }
        for disc in &self.discs {
            let pose = &mut poses[usize::from(disc.id)];
            (pose.x, pose.y) = (disc.x, disc.y);
        }
        for (place, pose) in self.places.iter_mut().zip(poses) {
            *place = [pose.x, pose.y, pose.z];
        }
    }

    /// Returns the distance along a ray to the first robot or movable disc at the height of the ray,
    /// at most `reach_mm`. They are where they were after the last tick.
    pub(crate) fn nearest(&self, robot: RobotId, ray: &Ray, height_mm: f32, reach_mm: f32) -> f32 {
        let mut nearest = self.movables.nearest(ray, height_mm, reach_mm);
        let mut walked = 0.0;
        // A robot that the ray meets is in the cell of one of these points or next to it.
        while walked < nearest + self.cells.side() {
            let (x, y) = ray.at(walked);
            for row in self.cells.around(self.cells.cell_at(x, y)) {
                let range = self.starts[row.start] as usize..self.starts[row.end] as usize;
                for disc in &self.discs[range] {
                    let is_level = disc.z <= height_mm && height_mm < disc.z + self.height(disc);
                    if disc.id == robot.0 || !is_level {
                        continue;
                    }
                    if let Some(distance) = ray.to_disc(disc.x, disc.y, disc.radius_mm) {
                        nearest = nearest.min(distance);
                    }
                }
            }
            walked += self.cells.side();
        }
        nearest
    }

    /// Calls `found` for every other robot whose middle is within `reach_mm` of a pose, with its
    /// herd and the vector to it. Robots are where they were after the last tick.
    pub(crate) fn within(
        &self,
        robot: RobotId,
        pose: &Pose,
        reach_mm: f32,
        mut found: impl FnMut(u16, [f32; 3]),
    ) {
        let mut check = |disc: &Disc| {
            let way = [disc.x - pose.x, disc.y - pose.y, disc.z - pose.z];
            let squared: f32 = way.iter().map(|part| part * part).sum();
            if disc.id != robot.0 && squared <= reach_mm * reach_mm {
                found(disc.herd, way);
            }
        };
        let (low, high) =
            ((pose.x - reach_mm, pose.y - reach_mm), (pose.x + reach_mm, pose.y + reach_mm));
        if self.cells.covered(low, high).take(self.discs.len()).count() >= self.discs.len() {
            self.discs.iter().for_each(check);
            return;
        }
        for cell in self.cells.covered(low, high) {
            let range = self.starts[cell] as usize..self.starts[cell + 1] as usize;
            self.discs[range].iter().for_each(&mut check);
        }
    }

    fn height(&self, disc: &Disc) -> f32 {
        self.shapes[usize::from(disc.herd)].height_mm
    }

    /// Counts the contacts of a tick.
    pub(crate) fn count(&mut self, statistics: &mut WorldStatistics) {
        for (now, before) in self.touches.iter_mut().zip(&mut self.touched) {
            statistics.contact_ticks += u64::from(*now & ROBOT);
            statistics.contacts += u64::from(*now & !*before & ROBOT);
            statistics.wall_ticks += u64::from((*now & WALL) / WALL);
            *before = core::mem::take(now);
        }
    }

    /// Sorts the discs by cells; within a cell by id.
    fn place(&mut self, poses: &[Pose]) {
        if self.stay_in_cells(poses) {
            return;
        }
        self.starts.fill(0);
        let unsorted = &mut self.next;
        unsorted.clear();
        unsorted.extend(poses.iter().zip(&self.herds).enumerate().map(|(id, (pose, &herd))| {
            let cell = self.cells.cell_at(pose.x, pose.y);
            self.starts[cell + 2] += 1;
            Disc {
                x: pose.x,
                y: pose.y,
                z: pose.z,
                radius_mm: self.shapes[usize::from(herd)].radius_mm,
                cell: cell as u32,
                id: id as u16,
                herd,
                touches: 0,
                moved: false,
            }
        }));
        let mut sum = 0;
        for start in &mut self.starts {
            sum += *start;
            *start = sum;
        }
        self.discs.clone_from(unsorted);
        for disc in unsorted {
            let slot = &mut self.starts[disc.cell as usize + 1];
            self.discs[*slot as usize] = *disc;
            *slot += 1;
        }
    }

    /// Moves the discs to these poses if no disc leaves its cell, so that the order of the discs
    /// stays valid. Returns false, and moves nothing, if one does.
    fn stay_in_cells(&mut self, poses: &[Pose]) -> bool {
        let cells = &self.cells;
        let stays = |disc: &Disc| {
            let pose = &poses[usize::from(disc.id)];
            disc.cell as usize == cells.cell_at(pose.x, pose.y)
        };
        if self.is_new || self.discs.len() != poses.len() || !self.discs.iter().all(stays) {
            self.is_new = false;
            return false;
        }
        for disc in &mut self.discs {
            let Pose { x, y, z, .. } = poses[usize::from(disc.id)];
            *disc = Disc { x, y, z, touches: 0, moved: false, ..*disc };
        }
        true
    }

    fn round(&mut self, round: usize, obstacles: &Obstacles, pool: &Pool) {
        let Crowd { cells, shapes, crash_speeds_mm_s, velocities, starts, .. } = self;
        let Crowd { widest_mm, discs, next, awake, movables, .. } = self;
        let mut movables_next = core::mem::take(&mut movables.next);
        let all = round == 0;
        let mut input = RoundInput {
            cells,
            shapes,
            crash_speeds_mm_s,
            velocities,
            starts,
            discs,
            awake,
            obstacles,
            movables,
            widest_mm: *widest_mm,
            all,
            are_apart: false,
        };
        input.are_apart = all && discs.len() <= PAIRWISE_MAX && input.finds_all_apart();
        input.push_robots(next, pool);
        input.push_movables(&mut movables_next, pool);
        core::mem::swap(&mut self.discs, &mut self.next);
        self.movables.next = movables_next;
        self.movables.turn();
    }

    /// Marks the cells near which a disc moved. Returns false if none did.
    fn wake(&mut self) -> bool {
        for cell in self.woken.drain(..) {
            for row in self.cells.around(cell as usize) {
                self.awake[row].fill(false);
            }
        }
        let mut last = u32::MAX;
        for disc in self.discs.iter().filter(|disc| disc.moved) {
            if disc.cell != last {
                last = disc.cell;
                self.woken.push(last);
                for row in self.cells.around(last as usize) {
                    self.awake[row].fill(true);
                }
            }
        }
        for Movable { disc: MovableDisc { x, y, radius_mm, .. }, .. } in self.movables.moved() {
            let reach_mm = radius_mm + self.widest_mm + CELL_MARGIN_MM;
            let (low, high) = ((x - reach_mm, y - reach_mm), (x + reach_mm, y + reach_mm));
            for cell in self.cells.covered(low, high) {
                self.woken.push(cell as u32);
                self.awake[cell] = true;
            }
        }
        !self.woken.is_empty()
    }
}
