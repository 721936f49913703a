//! The transmissions of one medium during a tick.

use core::hash::Hash;

use super::edge::{Edge, farthest_mm};
use super::packet::{Packet, Transmission};
use super::radio::deferral_us;
use super::topology::Barriers;
use super::{LinkSettings, Loss, Medium};
use crate::engine::TICK_US;
use crate::engine::digest::Digest;
use crate::engine::geometry::{Area, Pose};
use crate::engine::grid::Cells;
use crate::engine::id::RobotId;
use crate::engine::stream::{Stream, StreamPurpose};

/// The largest number of cells of a medium. A tick does not clear all of them, so they cost only
/// memory.
const CELLS_MAX: usize = 100_000;

/// The end of the list of transmissions in a cell.
const END: u32 = u32::MAX;

/// The parts of a transmission that determine its receivers.
#[derive(Clone, Copy, Debug)]
struct Beam {
    x: f32,
    y: f32,
    z: f32,
    start: i32,
    from: RobotId,
    /// Index of the sender's link in [`Transmissions`].
    link: u16,
    /// A random number, from which its brightness at each receiver follows.
    key: u64,
    /// Index of the transmission before in the same cell, or [`END`].
    earlier: u32,
}

/// All transmissions of this tick, and those of the last tick that may overlap with them.
#[derive(Clone, Debug)]
pub(crate) struct Transmissions {
    pub(crate) medium: Medium,
    seed: u64,
    /// The beginning of the tick in which the latest transmissions started, in µs since the world
    /// began.
    window_us: u64,
    /// The links on this medium: one per herd and one per intruder.
    links: Vec<Reach>,
    /// The longest reach of a link, mm.
    widest: f32,
    /// Cells as large as the longest reach.
    cells: Cells,
    /// Index of the latest transmission of each cell, or [`END`].
    latest: Vec<u32>,
    beams: Vec<Beam>,
    transmissions: Vec<Transmission>,
    /// The frame of each transmission: its length, and the bytes of the longest frame of the medium. Robots read them in any order, and
    /// they are next to each other to stay in the cache.
    frames: Vec<u8>,
    /// The latest fragments after which others of their messages follow, as long as other robots wait
    /// for these.
    begun: Vec<Beam>,
}

/// A link and the reach of its frames.
#[derive(Clone, Copy, Debug)]
struct Reach {
    link: LinkSettings,
    /// The part of the distance between two middles that the bodies take and the range does not
    /// count, mm.
    bodies: f32,
    /// The distances between middles at which frames are bright enough.
    edge: Edge,
}

/// A transmission within reach of a robot.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Near {
    pub(crate) start: i32,
    pub(crate) index: u32,
    pub(crate) distance_mm: f32,
    pub(crate) from: RobotId,
    pub(crate) link: u16,
}

impl Transmissions {
    pub(crate) fn new(medium: Medium, area: Area, seed: u64) -> Self {
        let cells = Cells::new(area, f32::INFINITY, 1);
        Transmissions {
            medium,
            seed,
            window_us: 0,
            links: Vec::new(),
            widest: 0.0,
            cells,
            latest: vec![END; cells.count()],
            beams: Vec::new(),
            transmissions: Vec::new(),
            frames: Vec::new(),
            begun: Vec::new(),
        }
    }

    /// Adds a link and returns its index. The range of the link does not count `bodies` mm of the
    /// distance between two middles.
    pub(crate) fn add_link(&mut self, link: LinkSettings, bodies_mm: f32, area: Area) -> u16 {
        let range = link.range.map_or(f32::INFINITY, |range| range + bodies_mm);
        let edge = Edge::new(range, link.edge);
        self.links.push(Reach { link, bodies: bodies_mm, edge });
        let most = farthest_mm(range, link.edge);
        // Most groups have the reach of another one, and need no other cells.
        if most > self.widest || self.links.len() == 1 {
            self.widest = self.widest.max(most);
            self.cells = Cells::new(area, self.widest, CELLS_MAX);
            self.latest = vec![END; self.cells.count()];
            self.beams.clear();
            for index in 0..self.transmissions.len() {
                self.enter(index);
            }
        }
        (self.links.len() - 1) as u16
    }

    /// Returns true if another link can be added: their numbers have 16 bits.
    pub(crate) fn has_room(&self) -> bool {
        self.links.len() <= usize::from(u16::MAX)
    }

    pub(crate) fn link(&self, link: u16) -> &LinkSettings {
        &self.links[usize::from(link)].link
    }

    /// Returns the part of the distance between two middles that the bodies take, in mm.
    pub(crate) fn bodies_mm(&self, link: u16) -> f32 {
        self.links[usize::from(link)].bodies
    }

    /// Sets the loss of all links.
    pub(crate) fn set_loss(&mut self, loss: Loss) {
        for reach in &mut self.links {
            reach.link.loss = loss;
        }
    }

    /// Returns the distance between middles at which half of the frames are bright enough, in mm.
    pub(crate) fn reach_mm(&self, link: u16) -> f32 {
        self.links[usize::from(link)].edge.range_mm()
    }

    /// Returns true if a transmission is bright enough for a robot. `squared` is the square of the
    /// distance between the middles.
    fn reaches(&self, beam: &Beam, robot: RobotId, squared: f32) -> bool {
        self.links[usize::from(beam.link)].edge.reaches(squared, beam.key, robot.0)
    }

    /// Returns true if no barrier separates a robot at this pose from the sender.
    fn passes(&self, beam: &Beam, robot: RobotId, pose: &Pose, barriers: &Barriers<'_>) -> bool {
        let (here, there) = ([pose.x, pose.y, pose.z], [beam.x, beam.y, beam.z]);
        barriers.connect(self.medium, robot, here, beam.from, there)
    }

    pub(crate) fn transmissions(&self) -> &[Transmission] {
        &self.transmissions
    }

    /// Returns the number of bytes of a frame in [`Transmissions::frames`].
    fn stored_bytes(&self) -> usize {
        1 + self.medium.frame_bytes()
    }

    /// Returns the bytes of a transmission's frame.
    pub(crate) fn frame(&self, transmission: u32) -> &[u8] {
        let stored = &self.frames[transmission as usize * self.stored_bytes()..];
        &stored[1..][..usize::from(stored[0])]
    }

    /// Adds the frames that may still be received and the parameters of the links to a digest.
    /// Everything else is derived from these.
    pub(crate) fn add_to(&self, digest: &mut Digest) {
        digest.text_of(&self.links);
        for Beam { start, from, link, .. } in &self.begun {
            (start, from, link).hash(digest);
        }
        for (index, transmission) in (0..).zip(&self.transmissions) {
            let Transmission { start, from, link, x, y, z, claim } = transmission;
            (start, from, link, self.frame(index)).hash(digest);
            [x, y, z]
                .into_iter()
                .chain(claim.iter().flatten())
                .for_each(|part| digest.float(*part));
        }
    }

    /// Begins the next tick. Keeps the transmissions that are still on the air and those that may
    /// overlap with them.
    pub(crate) fn turn(&mut self) {
        let (tick, air_time) = (TICK_US as i32, self.medium.air_time_us() as i32);
        self.window_us += u64::from(TICK_US);
        for beam in &self.beams {
            self.latest[self.cells.cell_at(beam.x, beam.y)] = END;
        }
        self.beams.clear();
        let awaited: u32 = deferral_us(self.medium).unwrap_or_default().iter().sum();
        self.begun.retain_mut(|beam| {
            beam.start -= tick;
            beam.start + air_time + awaited as i32 > 0
        });
        let is_over = |transmission: &Transmission| transmission.start - tick + 2 * air_time <= 0;
        let ended = self.transmissions.partition_point(is_over);
        self.transmissions.drain(..ended);
        self.frames.drain(..ended * self.stored_bytes());
        for transmission in &mut self.transmissions {
            transmission.start -= tick;
        }
        for index in 0..self.transmissions.len() {
            self.enter(index);
        }
    }

    /// Adds a transmission with its frame. Transmissions are added in the order of their start times.
    pub(crate) fn send(&mut self, transmission: Transmission, packet: Packet) {
        let is_in_order = |last: &Transmission| last.start <= transmission.start;
        assert!(self.transmissions.last().is_none_or(is_in_order), "senders are sorted by time");
        self.transmissions.push(transmission);
        self.frames.push(packet.bytes().len() as u8);
        self.frames.extend_from_slice(packet.bytes());
        self.frames.resize(self.transmissions.len() * self.stored_bytes(), 0);
        self.enter(self.transmissions.len() - 1);
    }

    /// Takes note that other fragments of the same message follow the latest transmission.
    pub(crate) fn expect_more(&mut self) {
        if deferral_us(self.medium).is_some() {
            self.begun.extend(self.beams.last().copied());
        }
    }

    /// Returns the end of the latest fragment that a robot has received by the time `at`, and after
    /// which others of the same message follow.
    pub(crate) fn begun(
        &self,
        robot: RobotId,
        pose: &Pose,
        at: i32,
        barriers: &Barriers<'_>,
    ) -> Option<i32> {
        let reaches = |beam: &&Beam| {
            beam.from != robot
                && self.reaches(beam, robot, distance_squared(beam, pose))
                && self.passes(beam, robot, pose, barriers)
        };
        let ends = self.begun.iter().filter(reaches).map(|beam| beam.start);
        ends.map(|start| start + self.medium.air_time_us() as i32).filter(|end| *end <= at).max()
    }

    fn enter(&mut self, index: usize) {
        let Transmission { x, y, z, start, from, link, .. } = self.transmissions[index];
        let key = if self.links[usize::from(link)].edge.is_soft() {
            let start_us = self.window_us.wrapping_add_signed(start.into());
            Stream::new(self.seed, StreamPurpose::Brightness, from.0, start_us).seed()
        } else {
            0
        };
        let latest = &mut self.latest[self.cells.cell_at(x, y)];
        self.beams.push(Beam { x, y, z, start, from, link, key, earlier: *latest });
        *latest = index as u32;
    }

    /// Returns the number of frames that a robot senses at time `at` and that started before
    /// `since`. The robot's own frames count, too.
    pub(crate) fn sensed(
        &self,
        robot: RobotId,
        pose: &Pose,
        at: i32,
        since: i32,
        barriers: &Barriers<'_>,
    ) -> usize {
        let on_air = at - self.medium.air_time_us() as i32;
        let mut count = 0;
        for row in self.cells.around(self.cells.cell_at(pose.x, pose.y)) {
            for &latest in &self.latest[row] {
                let mut next = latest;
                // The list of a cell starts with the latest transmission. After the first that has
                // ended, all have ended.
                while let Some(beam) = self.beams.get(next as usize) {
                    if beam.start <= on_air {
                        break;
                    }
                    if beam.start < since
                        && self.reaches(beam, robot, distance_squared(beam, pose))
                        && self.passes(beam, robot, pose, barriers)
                    {
                        count += 1;
                    }
                    next = beam.earlier;
                }
            }
        }
        count
    }

    /// Fills `found` with the transmissions within reach of a robot, sorted by time.
    pub(crate) fn near(
        &self,
        robot: RobotId,
        pose: &Pose,
        barriers: &Barriers<'_>,
        found: &mut Vec<Near>,
    ) {
        self.within_reach(robot, pose, |beam| self.passes(beam, robot, pose, barriers), found);
    }

    /// Fills `found` with the transmissions within reach of a robot from whose senders it is cut
    /// off, sorted by time.
    pub(crate) fn cut_off(
        &self,
        robot: RobotId,
        pose: &Pose,
        barriers: &Barriers<'_>,
        found: &mut Vec<Near>,
    ) {
        self.within_reach(robot, pose, |beam| !self.passes(beam, robot, pose, barriers), found);
    }

    /// Fills `found` with the transmissions that reach a robot and meet `is_of`, sorted by time.
    fn within_reach(
        &self,
        robot: RobotId,
        pose: &Pose,
        is_of: impl Fn(&Beam) -> bool,
        found: &mut Vec<Near>,
    ) {
        found.clear();
        let widest_squared = self.widest * self.widest;
        for row in self.cells.around(self.cells.cell_at(pose.x, pose.y)) {
            for &latest in &self.latest[row] {
                let mut next = latest;
                while let Some(beam) = self.beams.get(next as usize) {
                    let squared = distance_squared(beam, pose);
                    // Most transmissions of these cells are farther away than any link reaches.
                    if squared <= widest_squared
                        && self.reaches(beam, robot, squared)
                        && is_of(beam)
                    {
                        found.push(Near {
                            start: beam.start,
                            index: next,
                            distance_mm: squared.sqrt(),
                            from: beam.from,
                            link: beam.link,
                        });
                    }
                    next = beam.earlier;
                }
            }
        }
        // The reversal puts the transmissions of each cell in order. Often there is only one cell
        // with any.
        found.reverse();
        found.sort_unstable_by_key(|near| (near.start, near.index));
    }
}

fn distance_squared(beam: &Beam, pose: &Pose) -> f32 {
    let (dx, dy, dz) = (beam.x - pose.x, beam.y - pose.y, beam.z - pose.z);
    dx * dx + dy * dy + dz * dz
}
