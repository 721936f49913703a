//! What is on the air of one medium during a tick.

use super::packet::Transmission;
use super::topology::Topology;
use super::{Link, Loss, Medium};
use crate::engine::TICK_US;
use crate::engine::geometry::{Area, Pose};
use crate::engine::grid::Cells;
use crate::engine::robot::RobotId;
use crate::engine::variant::Variant;

/// Most cells of a medium: they are never cleared, so they cost memory only.
const CELLS: usize = 100_000;

/// No transmission follows.
const END: u32 = u32::MAX;

/// What one needs of a transmission to know whether it is heard.
#[derive(Clone, Copy, Debug)]
struct Beam {
    x: f32,
    y: f32,
    z: f32,
    start: i32,
    from: RobotId,
    /// Of the sender.
    variant: Variant,
    /// The one before in the same cell.
    earlier: u32,
}

/// All transmissions that are or were on the air in this tick, and those of the last that may overlap with them.
#[derive(Debug)]
pub(crate) struct Air {
    pub(crate) medium: Medium,
    /// Of each variant of senders.
    links: Vec<Link>,
    /// Of each, the distance between middles at which a frame is just heard, mm.
    reaches: Vec<f32>,
    /// What of that distance the two bodies take, mm.
    pub(crate) bodies: f32,
    /// As large as the longest reach.
    cells: Cells,
    /// Of each cell, the latest transmission.
    latest: Vec<u32>,
    beams: Vec<Beam>,
    transmissions: Vec<Transmission>,
}

/// A transmission within reach.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Near {
    pub(crate) start: i32,
    pub(crate) index: u32,
    pub(crate) distance: f32,
    pub(crate) from: RobotId,
    pub(crate) variant: Variant,
}

impl Air {
    /// `bodies` mm of a distance between two middles are not counted by the link's range.
    pub(crate) fn new(medium: Medium, link: Link, bodies: f32, area: Area) -> Self {
        let cells = Cells::new(area, f32::INFINITY, 1);
        let mut air = Air {
            medium,
            links: Vec::new(),
            reaches: Vec::new(),
            bodies,
            cells,
            latest: Vec::new(),
            beams: Vec::new(),
            transmissions: Vec::new(),
        };
        air.add_link(link, area);
        air
    }

    /// The link of one more variant of senders.
    pub(crate) fn add_link(&mut self, link: Link, area: Area) {
        let reach = link.range.map_or(f32::INFINITY, |range| range + self.bodies);
        self.links.push(link);
        self.reaches.push(reach);
        let widest = self.reaches.iter().copied().fold(0.0, f32::max);
        self.cells = Cells::new(area, widest, CELLS);
        self.latest = vec![END; self.cells.count()];
        self.beams.clear();
        for index in 0..self.transmissions.len() {
            self.enter(index);
        }
    }

    /// How it is with the frames of that variant.
    pub(crate) fn link(&self, variant: Variant) -> &Link {
        &self.links[usize::from(variant.0)]
    }

    /// All links lose that share of frames.
    pub(crate) fn set_loss(&mut self, loss: Loss) {
        for link in &mut self.links {
            link.loss = loss;
        }
    }

    /// Distance between middles at which a frame of that variant is just heard, mm.
    pub(crate) fn reach(&self, variant: Variant) -> f32 {
        self.reaches[usize::from(variant.0)]
    }

    fn reaches(&self, beam: &Beam, squared: f32) -> bool {
        let reach = self.reach(beam.variant);
        squared <= reach * reach
    }

    pub(crate) fn transmissions(&self) -> &[Transmission] {
        &self.transmissions
    }

    /// Begins the next tick: keeps what is still on the air, or overlapped with what is.
    pub(crate) fn turn(&mut self) {
        let (tick, air_time) = (TICK_US as i32, self.medium.air_time_us() as i32);
        for beam in &self.beams {
            self.latest[self.cells.of(beam.x, beam.y)] = END;
        }
        self.beams.clear();
        self.transmissions.retain_mut(|transmission| {
            transmission.start -= tick;
            transmission.start + 2 * air_time > 0
        });
        for index in 0..self.transmissions.len() {
            self.enter(index);
        }
    }

    /// Puts a frame on the air. Frames come in the order of their beginnings.
    pub(crate) fn send(&mut self, transmission: Transmission) {
        self.transmissions.push(transmission);
        self.enter(self.transmissions.len() - 1);
    }

    fn enter(&mut self, index: usize) {
        let Transmission { x, y, z, start, from, variant, .. } = self.transmissions[index];
        let latest = &mut self.latest[self.cells.of(x, y)];
        self.beams.push(Beam { x, y, z, start, from, variant, earlier: *latest });
        *latest = index as u32;
    }

    /// How many frames a robot senses at time `at` that began before `since`; its own count too.
    pub(crate) fn sensed(
        &self,
        robot: RobotId,
        pose: &Pose,
        at: i32,
        since: i32,
        topology: &Topology,
    ) -> usize {
        let on_air = at - self.medium.air_time_us() as i32;
        let mut count = 0;
        for row in self.cells.around(self.cells.of(pose.x, pose.y)) {
            for &latest in &self.latest[row] {
                let mut next = latest;
                // Of one cell the later come first: behind the first that has ended all have.
                while let Some(beam) = self.beams.get(next as usize) {
                    if beam.start <= on_air {
                        break;
                    }
                    if beam.start < since
                        && self.reaches(beam, distance_squared(beam, pose))
                        && topology.connects(robot, beam.from)
                    {
                        count += 1;
                    }
                    next = beam.earlier;
                }
            }
        }
        count
    }

    /// Everything within a robot's reach, sorted by time.
    pub(crate) fn near(
        &self,
        robot: RobotId,
        pose: &Pose,
        topology: &Topology,
        found: &mut Vec<Near>,
    ) {
        found.clear();
        for row in self.cells.around(self.cells.of(pose.x, pose.y)) {
            for &latest in &self.latest[row] {
                let mut next = latest;
                while let Some(beam) = self.beams.get(next as usize) {
                    let squared = distance_squared(beam, pose);
                    if self.reaches(beam, squared) && topology.connects(robot, beam.from) {
                        found.push(Near {
                            start: beam.start,
                            index: next,
                            distance: squared.sqrt(),
                            from: beam.from,
                            variant: beam.variant,
                        });
                    }
                    next = beam.earlier;
                }
            }
        }
        found.sort_unstable_by_key(|near| (near.start, near.index));
    }
}

fn distance_squared(beam: &Beam, pose: &Pose) -> f32 {
    let (dx, dy, dz) = (beam.x - pose.x, beam.y - pose.y, beam.z - pose.z);
    dx * dx + dy * dy + dz * dz
}
