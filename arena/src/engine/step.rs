//! One tick of the world.

use core::convert::Infallible;

use super::body::{BodySurroundings, Moment};
use super::brain::{Brain, Controls, Io, Scene, Sensors, TickFrames};
use super::environment::Ground;
use super::error::UnknownRobot;
use super::geometry::Pose;
use super::herd::{Cohort, Herd};
use super::id::RobotId;
use super::link::{Attempt, Barriers, Ether, Listener, Medium, Senders, Window};
use super::ranger::Sight;
use super::robot::{EngineRobot, RobotState};
use super::scratch::Scratch;
use super::shadow::Shadows;
use super::stream::{Stream, StreamPurpose};
use super::world::World;
use super::{TICK_S, TICK_US};

/// The data that all robots share while their brains run.
struct Surroundings<'a> {
    ether: [Ether<'a>; Medium::COUNT],
    scene: Scene<'a>,
    seed: u64,
    now: u64,
    is_watched: bool,
}

/// A cohort with the data of its robots.
struct CohortPart<'a, B> {
    cohort: &'a mut Cohort,
    scratch: &'a mut Scratch,
    robots: &'a mut [EngineRobot],
    brains: &'a mut [B],
    poses: &'a mut [Pose],
    estimates: &'a mut [Option<Pose>],
}

/// Removes the first `count` elements from a slice and returns them.
fn cut<'a, T>(rest: &mut &'a mut [T], count: usize) -> &'a mut [T] {
    let (first, others) = core::mem::take(rest).split_at_mut(count);
    *rest = others;
    first
}

impl<B: Brain> World<B> {
    /// Simulates 100 ms.
    pub fn tick(&mut self) {
        let Ok(()) = self.tick_with(|_| Ok::<(), Infallible>(()));
    }

    /// Simulates 100 ms in which the caller moves robots, too. `before` is called before each of
    /// the [substeps](Self::substeps), and bodies push each other apart after each. An error ends
    /// the tick at once.
    pub fn tick_with<E>(
        &mut self,
        mut before: impl FnMut(&mut Self) -> Result<(), E>,
    ) -> Result<(), E> {
        before(self)?;
        self.think();
        self.overhear();
        self.settle();
        for _ in 1..self.substeps {
            before(self)?;
            self.each(|part| part.cohort.block.step(part.poses));
            self.settle();
        }
        self.crash();
        self.crowd.count(&mut self.statistics);
        self.sense();
        self.transmit();
        self.now += 1;
        Ok(())
    }

    /// Lets every robot receive frames, run its brain, and make its first substep.
    fn think(&mut self) {
        let World {
            settings,
            now,
            brains,
            robots,
            poses,
            estimates,
            herds,
            cohorts,
            obstacles,
            ground,
            lights,
            crowd,
            air,
            topology,
            calibration,
            scratch,
            frame_log,
            pool,
            ..
        } = self;
        if let Some(ground) = ground {
            ground.sense(cohorts, herds, poses);
        }
        let shadows = Shadows { obstacles, movables: &crowd.movables };
        let barriers = Barriers { topology, shadows };
        let around = Surroundings {
            ether: air.each_ref().map(|air| Ether { air, barriers, calibration }),
            scene: Scene {
                sight: Sight { area: settings.area, obstacles, crowd },
                herds,
                ambient: settings.ambient_light,
                lights,
                ground: ground.as_ref().map_or(&[], Ground::values),
            },
            seed: settings.seed,
            now: *now,
            is_watched: frame_log.is_some(),
        };
        pool.each(parts(cohorts, scratch, robots, brains, poses, estimates), |part| {
            part.think(&around)
        });
        for scratch in &mut self.scratch {
            for (schedule, planned) in self.schedules.iter_mut().zip(&mut scratch.planned) {
                schedule.planned.append(planned);
            }
            for (sum, links) in self.statistics.links.iter_mut().zip(&mut scratch.links) {
                sum.add(&core::mem::take(links));
            }
            if let Some(log) = &mut self.frame_log {
                log.arrivals.append(&mut scratch.arrivals);
            }
        }
    }

    fn settle(&mut self) {
        let seconds = TICK_S / self.substeps as f32;
        self.crowd.settle(&mut self.poses, &self.obstacles, &self.pool, seconds);
    }

    /// Makes robots fail that have crashed.
    fn crash(&mut self) {
        for id in self.crowd.crashed().into_iter().chain(self.broken()) {
            self.crash_robot(id).expect("the crowd has only robots of this world");
        }
    }

    /// Makes a robot fail that has crashed, unless it has failed before.
    pub fn crash_robot(&mut self, id: RobotId) -> Result<(), UnknownRobot> {
        if self.robot(id).is_some_and(|robot| robot.state == RobotState::Failed) {
            return Ok(());
        }
        self.fail(id)?;
        self.robots[usize::from(id.0)].crashes += 1;
        self.statistics.crashes += 1;
        self.statistics.first_crash.get_or_insert((self.now, id));
        Ok(())
    }

    /// Returns the robots whose bodies broke without a contact with a robot or a wall.
    fn broken(&self) -> Vec<RobotId> {
        let robots = self.cohorts.iter().filter(|cohort| {
            self.herds[usize::from(cohort.herd.0)].model.crash_speed_mm_s().is_some()
        });
        let broken = robots.flat_map(|cohort| {
            let broken = (0..cohort.count).filter(|index| cohort.block.is_broken(*index));
            broken.map(|index| RobotId((cohort.first + index) as u16))
        });
        broken.collect()
    }

    /// Updates the position estimates of robots with a positioning system.
    fn sense(&mut self) {
        if !self.herds.iter().any(|herd| herd.has_positioning) {
            return;
        }
        let (seed, now) = (self.settings.seed, self.now);
        let has_positioning: Vec<bool> =
            self.herds.iter().map(|herd| herd.has_positioning).collect();
        self.each(
            |CohortPart { cohort: Cohort { herd, first, block, .. }, poses, estimates, .. }| {
                if has_positioning[usize::from(herd.0)] {
                    let moment =
                        Moment { seconds: TICK_S, seed, now, first: RobotId(*first as u16) };
                    block.sense(0, poses, estimates, &moment);
                }
            },
        );
    }

    /// Calls `work` with every cohort.
    fn each(&mut self, work: impl Fn(CohortPart<'_, B>) + Send + Sync) {
        let World { pool, scratch, robots, brains, poses, estimates, cohorts, .. } = self;
        pool.each(parts(cohorts, scratch, robots, brains, poses, estimates), work);
    }

    /// Lets the links send.
    fn transmit(&mut self) {
        let window = Window {
            barriers: Barriers {
                topology: &self.topology,
                shadows: Shadows { obstacles: &self.obstacles, movables: &self.crowd.movables },
            },
            herds: &self.herds,
            poses: &self.poses,
            estimates: &self.estimates,
            seed: self.settings.seed,
            now: self.now,
        };
        for medium in Medium::ALL {
            let index = medium as usize;
            let air = &mut self.air[index];
            air.turn();
            let count = &mut self.statistics.links[index];
            let (robots, brains) = (&mut *self.robots, &mut *self.brains);
            let senders = Senders { robots, brains, stations: &mut self.stations };
            let seen = self.frame_log.as_deref_mut().map(|log| &mut log.attempts);
            self.schedules[index].run(&window, senders, air, count, seen);
        }
    }
}

/// Divides the data of the robots into cohorts.
fn parts<'a, B>(
    cohorts: &'a mut [Cohort],
    scratch: &'a mut [Scratch],
    mut robots: &'a mut [EngineRobot],
    mut brains: &'a mut [B],
    mut poses: &'a mut [Pose],
    mut estimates: &'a mut [Option<Pose>],
) -> impl ExactSizeIterator<Item = CohortPart<'a, B>> {
    cohorts.iter_mut().zip(scratch).map(move |(cohort, scratch)| {
        let count = cohort.count;
        CohortPart {
            cohort,
            scratch,
            robots: cut(&mut robots, count),
            brains: cut(&mut brains, count),
            poses: cut(&mut poses, count),
            estimates: cut(&mut estimates, count),
        }
    })
}

impl<B: Brain> CohortPart<'_, B> {
    fn think(self, around: &Surroundings<'_>) {
        let CohortPart { cohort, scratch, robots, brains, poses, estimates } = self;
        let herd = &around.scene.herds[usize::from(cohort.herd.0)];
        let senses = poses.iter().zip(estimates);
        let robots = robots.iter_mut().zip(brains).zip(senses).enumerate();
        for (index, ((robot, brain), (pose, estimate))) in robots {
            robot.radio.turn(herd.medium);
            if around.is_watched {
                let id = RobotId((cohort.first + index) as u16);
                let (ether, is_running) =
                    (&around.ether[herd.medium as usize], robot.state == RobotState::Running);
                let Scratch { near, arrivals, .. } = &mut *scratch;
                ether.miss(id, pose, around.now, is_running, near, arrivals);
            }
            if robot.state == RobotState::Running {
                let id = RobotId((cohort.first + index) as u16);
                let body = Controls { block: &mut *cohort.block, index };
                let first_ground = cohort.ground_sensors_before + index * herd.ground_sensors.len();
                let estimate = estimate.as_ref();
                let of = Thinker { id, robot, herd, body, pose, estimate, first_ground };
                of.think(brain, scratch, around);
            }
        }
        if let Some(reach_mm) = herd.model.feels_within_mm() {
            let Sight { obstacles, crowd, .. } = around.scene.sight;
            for (index, pose) in poses.iter().enumerate() {
                let id = RobotId((cohort.first + index) as u16);
                let mut above_mm = Vec::new();
                crowd.within(id, pose, reach_mm, |_, way_mm| {
                    if way_mm[2] > 0.0 {
                        above_mm.push(way_mm);
                    }
                });
                let floor_mm = obstacles.floor_mm(pose);
                cohort.block.surround(index, BodySurroundings { floor_mm, above_mm });
            }
        }
        cohort.block.step(poses);
    }
}

/// A robot whose brain is about to run.
struct Thinker<'a> {
    id: RobotId,
    robot: &'a mut EngineRobot,
    herd: &'a Herd,
    body: Controls<'a>,
    pose: &'a Pose,
    estimate: Option<&'a Pose>,
    first_ground: usize,
}

impl Thinker<'_> {
    /// Receives frames, runs the brain, and plans the time when the link sends.
    fn think(self, brain: &mut impl Brain, scratch: &mut Scratch, around: &Surroundings<'_>) {
        let Thinker { id, robot, herd, body, pose, estimate, first_ground } = self;
        let Herd { medium, media, .. } = herd;
        let now = around.now;
        let ether = &around.ether[*medium as usize];
        let late = robot.radio.late.take_if(|late| late.due <= now);
        let mut listener = Listener { id, pose, estimate, media, late: &mut robot.radio.late, now };
        let stream = || Stream::new(around.seed, StreamPurpose::Receive, id.0, now);
        let Scratch { near, received, links, arrivals, .. } = scratch;
        let count = &mut links[*medium as usize];
        if around.is_watched {
            ether.receive(&mut listener, stream, near, received, count, |frame, fate| {
                arrivals.push(ether.arrival(id, now, frame, fate));
            });
        } else {
            ether.receive(&mut listener, stream, near, received, count, |_, _| ());
        }
        brain.tick(&mut Io {
            id,
            now,
            clock: robot.radio.oscillator,
            inbox: TickFrames {
                received: &scratch.received,
                air: ether.air,
                late: late.as_deref(),
            },
            sensors: Sensors {
                id,
                herd: robot.herd,
                pose,
                estimate,
                first_ground,
                scene: &around.scene,
            },
            led: &mut robot.led,
            body,
        });
        if !robot.radio.waits {
            if !brain.has_frame() {
                return;
            }
            let mut stream = Stream::new(around.seed, StreamPurpose::Send, id.0, now);
            robot.radio.plan(*medium, media, now, &mut stream);
        }
        if robot.radio.attempt < TICK_US as i32 {
            scratch.planned[*medium as usize].push(Attempt { at: robot.radio.attempt, robot: id });
        }
    }
}
