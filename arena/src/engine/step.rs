//! One tick of the world.

use core::convert::Infallible;

use rayon::ThreadPool;
use rayon::prelude::*;

use super::TICK;
use super::TICK_US;
use super::brain::{Brain, Inbox, Io, Sensors};
use super::geometry::Pose;
use super::light::Light;
use super::link::{Attempt, Ether, Heard, Listener, Medium, Moment, Near};
use super::ranger::Sight;
use super::robot::{Robot, RobotId, RobotKind, RobotState};
use super::statistics::LinkStatistics;
use super::stream::{Purpose, Stream};
use super::variant::Numbers;
use super::world::World;

/// Robots that one thread takes at a time. Small enough that a few slow brains do not hold up the others.
const CHUNK: usize = 256;

/// What one chunk needs and finds out in a tick; kept for its memory.
#[derive(Debug, Default)]
pub(crate) struct Scratch {
    near: Vec<Near>,
    heard: Vec<Heard>,
    planned: [Vec<Attempt>; Medium::COUNT],
    links: [LinkStatistics; Medium::COUNT],
}

/// What holds for all robots while they think.
struct Surroundings<'a> {
    ether: [Ether<'a>; Medium::COUNT],
    sight: Sight<'a>,
    lights: &'a [Light],
    ambient: f32,
    numbers: &'a [Numbers],
    seed: u64,
    now: u64,
}

/// Robots of a chunk.
struct Chunk<'a, B> {
    first: usize,
    robots: &'a mut [Robot],
    brains: &'a mut [B],
    poses: &'a mut [Pose],
    scratch: &'a mut Scratch,
}

impl<B: Brain> World<B> {
    /// Simulates 100 ms.
    pub fn tick(&mut self) {
        let Ok(()) = self.tick_with(|_| Ok::<(), Infallible>(()));
    }

    /// Simulates 100 ms, in which something else moves robots too, beside those with a brain: `before` is called before
    /// each of the [substeps](Self::substeps), and bodies push each other apart after each. An error ends the tick at once.
    pub fn tick_with<E>(
        &mut self,
        mut before: impl FnMut(&mut Self) -> Result<(), E>,
    ) -> Result<(), E> {
        before(self)?;
        self.think();
        self.settle();
        for _ in 1..self.substeps {
            before(self)?;
            let numbers = &self.numbers;
            each(self.pool.as_ref(), &mut self.robots, &mut self.poses, |_, robot, pose| {
                robot.body.advance(pose, &numbers[usize::from(robot.variant.0)].models);
            });
            self.settle();
        }
        self.crowd.count(&mut self.statistics);
        self.sense();
        self.transmit();
        self.now += 1;
        Ok(())
    }

    /// Every robot hears, decides, and makes its first substep.
    fn think(&mut self) {
        self.scratch.resize_with(self.robots.len().div_ceil(CHUNK), Scratch::default);
        let surroundings = Surroundings {
            ether: [0, 1, 2].map(|medium| Ether {
                air: &self.air[medium],
                topology: &self.topology,
                calibration: &self.calibration,
            }),
            sight: Sight {
                area: self.settings.area,
                obstacles: &self.obstacles,
                crowd: &self.crowd,
            },
            lights: &self.lights,
            ambient: self.settings.ambient_light,
            numbers: &self.numbers,
            seed: self.settings.seed,
            now: self.now,
        };
        match &self.pool {
            Some(pool) if self.robots.len() > CHUNK => pool.install(|| {
                let robots = self.robots.par_chunks_mut(CHUNK);
                let parts = robots.zip(self.brains.par_chunks_mut(CHUNK));
                let parts = parts.zip(self.poses.par_chunks_mut(CHUNK));
                parts.zip(&mut self.scratch).enumerate().for_each(
                    |(number, (((robots, brains), poses), scratch))| {
                        let first = number * CHUNK;
                        Chunk { first, robots, brains, poses, scratch }.think(&surroundings);
                    },
                );
            }),
            _ => {
                let robots = self.robots.chunks_mut(CHUNK);
                let parts = robots.zip(self.brains.chunks_mut(CHUNK));
                let parts = parts.zip(self.poses.chunks_mut(CHUNK));
                for (number, (((robots, brains), poses), scratch)) in
                    parts.zip(&mut self.scratch).enumerate()
                {
                    let first = number * CHUNK;
                    Chunk { first, robots, brains, poses, scratch }.think(&surroundings);
                }
            }
        }
        for scratch in &mut self.scratch {
            for (schedule, planned) in self.schedules.iter_mut().zip(&mut scratch.planned) {
                schedule.planned.append(planned);
            }
            for (sum, links) in self.statistics.links.iter_mut().zip(&mut scratch.links) {
                sum.add(&core::mem::take(links));
            }
        }
    }

    fn settle(&mut self) {
        self.crowd.settle(&mut self.poses, &self.kinds, &self.obstacles, self.pool.as_ref());
    }

    /// Robots with a positioning system learn where they are.
    fn sense(&mut self) {
        if self.kinds.iter().all(|&kind| kind == RobotKind::Kilobot) {
            return;
        }
        let (seed, now, numbers) = (self.settings.seed, self.now, &self.numbers);
        each(self.pool.as_ref(), &mut self.robots, &mut self.poses, |id, robot, pose| {
            let models = &numbers[usize::from(robot.variant.0)].models;
            robot.body.sense(pose, models, TICK, || Stream::new(seed, Purpose::Estimate, id, now));
        });
    }

    /// The links send.
    fn transmit(&mut self) {
        let moment = Moment {
            topology: &self.topology,
            numbers: &self.numbers,
            seed: self.settings.seed,
            now: self.now,
        };
        for medium in Medium::ALL {
            let index = medium as usize;
            let air = &mut self.air[index];
            air.turn();
            let count = &mut self.statistics.links[index];
            let (robots, brains) = (&mut self.robots, &mut self.brains);
            self.schedules[index].run(&moment, robots, brains, &self.poses, air, count);
        }
    }
}

/// Does the same with every robot.
fn each(
    pool: Option<&ThreadPool>,
    robots: &mut [Robot],
    poses: &mut [Pose],
    work: impl Fn(u16, &mut Robot, &mut Pose) + Send + Sync,
) {
    match pool {
        Some(pool) if robots.len() > CHUNK => pool.install(|| {
            let all = robots.par_iter_mut().zip(poses).enumerate().with_min_len(CHUNK);
            all.for_each(|(id, (robot, pose))| work(id as u16, robot, pose));
        }),
        _ => {
            for (id, (robot, pose)) in robots.iter_mut().zip(poses).enumerate() {
                work(id as u16, robot, pose);
            }
        }
    }
}

impl<B: Brain> Chunk<'_, B> {
    fn think(self, around: &Surroundings<'_>) {
        let Chunk { first, robots, brains, poses, scratch } = self;
        for (offset, (robot, brain)) in robots.iter_mut().zip(brains).enumerate() {
            let id = RobotId((first + offset) as u16);
            let pose = &mut poses[offset];
            let medium = robot.body.kind().medium();
            robot.radio.turn(medium);
            if robot.state == RobotState::Running {
                think(id, robot, brain, pose, medium, scratch, around);
            }
            robot.body.advance(pose, &around.numbers[usize::from(robot.variant.0)].models);
        }
    }
}

/// One robot hears and decides; its link plans when to send.
fn think(
    id: RobotId,
    robot: &mut Robot,
    brain: &mut impl Brain,
    pose: &Pose,
    medium: Medium,
    scratch: &mut Scratch,
    around: &Surroundings<'_>,
) {
    let now = around.now;
    let ether = &around.ether[medium as usize];
    let late = robot.radio.late.take_if(|late| late.due <= now);
    let pacing = &around.numbers[usize::from(robot.variant.0)].pacing;
    let mut listener = Listener {
        id,
        pose,
        estimate: robot.body.estimate(),
        distance_sigma: pacing.infrared.distance_sigma,
        late: &mut robot.radio.late,
        now,
    };
    ether.hear(
        &mut listener,
        || Stream::new(around.seed, Purpose::Hear, id.0, now),
        &mut scratch.near,
        &mut scratch.heard,
        &mut scratch.links[medium as usize],
    );
    let estimate = robot.body.estimate().copied();
    brain.tick(&mut Io {
        id,
        now,
        inbox: Inbox {
            heard: &scratch.heard,
            air: ether.air.transmissions(),
            late: late.as_deref(),
        },
        sensors: Sensors {
            id,
            sight: around.sight,
            pose,
            estimate: estimate.as_ref(),
            ambient: around.ambient,
            lights: around.lights,
        },
        actuators: robot.body.actuators(),
        led: &mut robot.led,
    });
    if !robot.radio.waits {
        if !brain.has_frame() {
            return;
        }
        let mut stream = Stream::new(around.seed, Purpose::Send, id.0, now);
        robot.radio.plan(medium, pacing, &mut stream);
    }
    if robot.radio.attempt < TICK_US as i32 {
        scratch.planned[medium as usize].push(Attempt { at: robot.radio.attempt, robot: id });
    }
}
