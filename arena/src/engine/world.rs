//! The world: robots, obstacles, lamps, and operations on them.

use std::sync::Arc;

use super::TICK_S;
use super::body::{Attitude, BLOCK_ROBOTS_MAX, BodyModel, BodySize, Moment, substeps};
use super::brain::Brain;
use super::contact::Crowd;
use super::environment::{Environment, Ground};
use super::error::{AddError, SettingsError, UnknownRobot};
use super::geometry::Pose;
use super::herd::{Cohort, Herd, HerdId};
use super::id::RobotId;
use super::intruder::Station;
use super::light::{Lamp, LightId};
use super::link::{
    Calibration, FrameLog, Loss, Media, Medium, RobotRadio, Schedule, Topology, Transmissions,
};
use super::movable::MovableDisc;
use super::obstacle::{Obstacle, Obstacles};
use super::pool::Pool;
use super::robot::{EngineRobot, RobotState, RobotView};
use super::scratch::Scratch;
use super::settings::WorldSettings;
use super::statistics::WorldStatistics;
use super::stream::{Stream, StreamPurpose};

/// Bytes of a body, of its last frames and of its place among its neighbors, measured with Kilobots
/// and Zooids.
const BODY_BYTES: usize = 512;

/// Robots with brains of type `B`, and their surroundings.
#[derive(Clone, Debug)]
pub struct World<B> {
    pub(crate) settings: WorldSettings,
    pub(crate) now: u64,
    pub(crate) brains: Vec<B>,
    pub(crate) robots: Vec<EngineRobot>,
    pub(crate) poses: Vec<Pose>,
    /// The robots' estimates of their own poses.
    pub(crate) estimates: Vec<Option<Pose>>,
    pub(crate) stations: Vec<Station>,
    pub(crate) herds: Vec<Herd>,
    /// All robots, grouped by herd in the order of their ids.
    pub(crate) cohorts: Vec<Cohort>,
    pub(crate) obstacles: Obstacles,
    /// `None` if the ground is white everywhere.
    pub(crate) ground: Option<Ground>,
    pub(crate) lights: Vec<Lamp>,
    pub(crate) crowd: Crowd,
    pub(crate) substeps: u32,
    pub(crate) air: [Transmissions; Medium::COUNT],
    pub(crate) schedules: [Schedule; Medium::COUNT],
    pub(crate) topology: Topology,
    pub(crate) calibration: Calibration,
    pub(crate) statistics: WorldStatistics,
    pub(crate) scratch: Vec<Scratch>,
    /// `None` if the run is not observed.
    pub(crate) frame_log: Option<Box<FrameLog>>,
    pub(crate) pool: Pool,
}

impl<B: Brain> World<B> {
    /// Returns an empty world.
    pub fn new(settings: WorldSettings) -> Result<Self, SettingsError> {
        settings.check()?;
        let WorldSettings { area, threads, .. } = settings;
        Ok(World {
            settings,
            now: 0,
            brains: Vec::new(),
            robots: Vec::new(),
            poses: Vec::new(),
            estimates: Vec::new(),
            stations: Vec::new(),
            herds: Vec::new(),
            cohorts: Vec::new(),
            obstacles: Obstacles::new(area),
            ground: None,
            lights: Vec::new(),
            crowd: Crowd::new(area),
            substeps: 1,
            air: Medium::ALL.map(|medium| Transmissions::new(medium, area, settings.seed)),
            schedules: Default::default(),
            topology: Topology::default(),
            calibration: Calibration::new(),
            statistics: WorldStatistics::default(),
            scratch: Vec::new(),
            frame_log: None,
            pool: Pool::new(threads),
        })
    }

    /// Adds a herd, which has no robots yet: the model of their bodies, and the parameters of the
    /// medium that carries their frames.
    pub fn add_herd(
        &mut self,
        model: Arc<dyn BodyModel>,
        media: Media,
    ) -> Result<HerdId, SettingsError> {
        model.check()?;
        media.check()?;
        let too_many = SettingsError { field: "herd", must: "one of at most 65536" };
        let number = u16::try_from(self.herds.len()).map_err(|_| too_many)?;
        let (shape, medium) = (model.shape(), model.medium());
        // The range of infrared is measured between the rims of two robots, that of radio between
        // their middles.
        let bodies_mm = if medium == Medium::Infrared { 2.0 * shape.radius_mm } else { 0.0 };
        let air = &mut self.air[medium as usize];
        let link = air.add_link(*media.link(medium), bodies_mm, self.settings.area);
        self.obstacles.admit(shape.radius_mm);
        self.crowd.add_herd(shape, model.crash_speed_mm_s());
        let has_positioning = model.has_positioning();
        let ground_sensors = model.ground_sensors();
        self.herds.push(Herd {
            model,
            shape,
            medium,
            media,
            link,
            has_positioning,
            ground_sensors,
        });
        Ok(HerdId(number))
    }

    /// Adds a robot, before or during a run. Ids count up from 0.
    pub fn add(&mut self, herd: HerdId, pose: Pose, brain: B) -> Result<RobotId, AddError> {
        let id = u16::try_from(self.brains.len()).map_err(|_| AddError::TooMany)?;
        // Intruders use the highest ids.
        if usize::from(u16::MAX - id) < self.stations.len() {
            return Err(AddError::TooMany);
        }
        if !pose.is_finite() || !self.settings.area.contains(pose.x, pose.y) {
            return Err(AddError::Outside);
        }
        let Some(Herd { model, medium, media, .. }) = self.herds.get(usize::from(herd.0)) else {
            return Err(AddError::UnknownHerd);
        };
        let (index, substeps) = (usize::from(id), substeps(&**model));
        let is_open = |last: &Cohort| last.herd == herd && last.count < BLOCK_ROBOTS_MAX;
        if !self.cohorts.last().is_some_and(is_open) {
            let block = model.block(TICK_S / self.substeps as f32);
            let ground_sensors_before = self.cohorts.last().map_or(0, |last| {
                let of_each = self.herds[usize::from(last.herd.0)].ground_sensors.len();
                last.ground_sensors_before + last.count * of_each
            });
            self.cohorts.push(Cohort {
                herd,
                first: index,
                count: 0,
                ground_sensors_before,
                block,
            });
            self.scratch.push(Scratch::default());
        }
        let cohort = (self.cohorts.len() - 1) as u32;
        let mut build = Stream::new(self.settings.seed, StreamPurpose::Build, id, 0);
        let Cohort { block, count, .. } = &mut self.cohorts[cohort as usize];
        block.add(&pose, &mut build);
        *count += 1;
        let radio = RobotRadio::new(*medium, media, &mut build);
        self.brains.push(brain);
        let state = RobotState::Running;
        self.robots.push(EngineRobot { herd, cohort, radio, state, led: 0, crashes: 0 });
        self.poses.push(pose);
        self.estimates.push(None);
        self.crowd.add(herd.0, self.settings.area);
        if substeps > self.substeps {
            self.substeps = substeps;
            for cohort in &mut self.cohorts {
                cohort.block.set_substep(TICK_S / substeps as f32);
            }
        }
        self.place(index, pose);
        Ok(RobotId(id))
    }

    /// Adds a wall or an obstacle. A negative size counts as positive. An obstacle is ignored if it
    /// is more than 10 km away or has a number that is not finite.
    pub fn add_obstacle(&mut self, obstacle: Obstacle) {
        self.obstacles.add(obstacle, f32::INFINITY);
    }

    /// Adds a wall or an obstacle with a height in mm. Bodies at this height and above pass over
    /// the obstacle.
    pub fn add_obstacle_of_height(&mut self, obstacle: Obstacle, height_mm: f32) {
        self.obstacles.add(obstacle, height_mm);
    }

    /// Returns all obstacles.
    #[must_use]
    pub fn obstacles(&self) -> &[Obstacle] {
        self.obstacles.all()
    }

    /// Adds a disc on the ground that robots push, out of the walls and obstacles that the world has
    /// already. Numbers count as in [`add_obstacle`](Self::add_obstacle); a radius is at least 1 mm.
    pub fn add_movable(&mut self, disc: MovableDisc) {
        self.crowd.movables.add(disc, &self.obstacles);
    }

    /// Returns all movable discs where they are, in the order in which they were added.
    pub fn movables(&self) -> impl ExactSizeIterator<Item = MovableDisc> {
        self.crowd.movables.all().iter().map(|movable| movable.disc)
    }

    /// Sets the environment that ground sensors read: the brightness of the ground, 0 (black) to 1
    /// (white). Without one the ground is white.
    pub fn set_ground(&mut self, environment: impl Environment + 'static) {
        self.ground = Some(Ground::new(Box::new(environment)));
    }

    /// Adds a lamp.
    pub fn add_light(&mut self, light: Lamp) -> LightId {
        self.lights.push(light);
        LightId(self.lights.len() - 1)
    }

    /// Replaces a lamp: moves it, dims it, or switches it off with intensity 0.
    pub fn set_light(&mut self, id: LightId, light: Lamp) {
        self.lights[id.0] = light;
    }

    /// Returns all lamps, in the order in which they were added.
    #[must_use]
    pub fn lights(&self) -> &[Lamp] {
        &self.lights
    }

    /// Changes the ambient light, 0 to 1023.
    pub fn set_ambient_light(&mut self, reading: f32) {
        self.settings.ambient_light = reading.clamp(0.0, 1023.0);
    }

    /// Sets the loss of a medium for all senders.
    pub fn set_loss(&mut self, medium: Medium, loss: Loss) {
        let Loss { near, far } = loss;
        let loss = Loss { near: near.clamp(0.0, 1.0), far: far.clamp(0.0, 1.0) };
        self.air[medium as usize].set_loss(loss);
    }

    /// Blocks the link between two robots in both directions.
    pub fn block(&mut self, a: RobotId, b: RobotId) -> Result<(), UnknownRobot> {
        self.index(a)?;
        self.index(b)?;
        self.topology.block(a, b);
        Ok(())
    }

    /// Undoes [`block`](Self::block).
    pub fn unblock(&mut self, a: RobotId, b: RobotId) -> Result<(), UnknownRobot> {
        self.index(a)?;
        self.index(b)?;
        self.topology.unblock(a, b);
        Ok(())
    }

    /// Partitions the links: frames pass only between robots of the same group. Robots that join
    /// later are in group 0.
    pub fn partition(&mut self, group: impl FnMut(RobotId) -> u8) {
        self.topology.partition(self.ids().map(group).collect());
    }

    /// Undoes [`partition`](Self::partition).
    pub fn heal(&mut self) {
        self.topology.heal();
    }

    /// Makes a robot fail as if its power was cut. Its body stays where it is, and only a
    /// [`restart`](Self::restart) makes it run again.
    pub fn fail(&mut self, id: RobotId) -> Result<(), UnknownRobot> {
        self.silence(id, RobotState::Failed)
    }

    /// Stops a running robot until it is resumed: its motors are off, and it neither receives nor
    /// sends.
    pub fn stop(&mut self, id: RobotId) -> Result<(), UnknownRobot> {
        self.silence(id, RobotState::Stopped)
    }

    /// Resumes a stopped robot, whose brain continues where it was. A failed robot stays failed.
    pub fn resume(&mut self, id: RobotId) -> Result<(), UnknownRobot> {
        let index = self.index(id)?;
        let state = &mut self.robots[index].state;
        if *state == RobotState::Stopped {
            *state = RobotState::Running;
        }
        Ok(())
    }

    /// Switches a robot off and on, whatever its state. It runs again at the same place, with
    /// another brain and its motors off. Properties of its body stay, such as the gains of its
    /// motors. Returns the old brain.
    pub fn restart(&mut self, id: RobotId, brain: B) -> Result<B, UnknownRobot> {
        let index = self.index(id)?;
        let robot = &mut self.robots[index];
        robot.state = RobotState::Running;
        robot.led = 0;
        robot.radio.silence();
        let Cohort { first, block, .. } = &mut self.cohorts[robot.cohort as usize];
        block.restart(index - *first);
        self.estimates[index] = None;
        self.place(index, self.poses[index]);
        Ok(core::mem::replace(&mut self.brains[index], brain))
    }

    /// Moves a robot to another pose. A place outside of the world is replaced by the nearest place
    /// inside; a pose that is not finite is ignored.
    pub fn move_to(&mut self, id: RobotId, pose: Pose) -> Result<(), UnknownRobot> {
        let index = self.index(id)?;
        if pose.is_finite() {
            self.place(index, pose);
        }
        Ok(())
    }

    /// Returns the number of ticks since the world began.
    #[must_use]
    pub fn now(&self) -> u64 {
        self.now
    }

    /// Returns the number of robots; their ids are below it.
    #[must_use]
    pub fn len(&self) -> usize {
        self.brains.len()
    }

    /// Returns true if there are no robots.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.brains.is_empty()
    }

    /// Returns the ids of all robots.
    pub fn ids(&self) -> impl Iterator<Item = RobotId> + use<B> {
        (0..self.brains.len()).map(|index| RobotId(index as u16))
    }

    /// Returns the visible state of a robot.
    #[must_use]
    #[inline]
    pub fn robot(&self, id: RobotId) -> Option<RobotView> {
        self.index(id).ok().map(|index| self.view(index))
    }

    #[inline]
    fn view(&self, index: usize) -> RobotView {
        let EngineRobot { herd, state, led, crashes, .. } = self.robots[index];
        let BodySize { radius_mm, height_mm } = self.herds[usize::from(herd.0)].shape;
        let (pose, estimate) = (self.poses[index], self.estimates[index]);
        RobotView { herd, state, pose, estimate, radius_mm, height_mm, led, crashes }
    }

    /// Returns the attitudes of the robots that tilt, in the order of their ids.
    pub fn attitudes(&self) -> impl Iterator<Item = (RobotId, Attitude)> + '_ {
        self.cohorts.iter().flat_map(|cohort| {
            (0..cohort.count).filter_map(|index| {
                let attitude = cohort.block.attitude(index)?;
                Some((RobotId((cohort.first + index) as u16), attitude))
            })
        })
    }

    /// Returns the visible states of all robots in the order of their ids.
    pub fn robots(&self) -> impl Iterator<Item = RobotView> + '_ {
        (0..self.brains.len()).map(|index| self.view(index))
    }

    /// Returns the brains of all robots in the order of their ids.
    pub fn brains(&self) -> impl Iterator<Item = &B> {
        self.brains.iter()
    }

    /// Returns the brains of all robots for changes between ticks, in the order of their ids.
    pub fn brains_mut(&mut self) -> impl Iterator<Item = &mut B> {
        self.brains.iter_mut()
    }

    /// Returns a robot's brain.
    #[must_use]
    pub fn brain(&self, id: RobotId) -> Option<&B> {
        self.brains.get(usize::from(id.0))
    }

    /// Returns a robot's brain for changes between ticks.
    pub fn brain_mut(&mut self, id: RobotId) -> Option<&mut B> {
        self.brains.get_mut(usize::from(id.0))
    }

    /// Records the frames of each tick from now on, until [`take_frame_log`](Self::take_frame_log).
    pub fn watch(&mut self) {
        self.frame_log.get_or_insert_default();
    }

    /// Returns the frames since [`watch`](Self::watch) and stops recording.
    pub fn take_frame_log(&mut self) -> FrameLog {
        self.frame_log.take().map_or_else(FrameLog::default, |log| *log)
    }

    /// Uses the threads of another world from now on.
    pub fn share_threads(&mut self, other: &Self) {
        self.pool = other.pool.clone();
    }

    /// Returns about how many bytes a robot takes in addition to its brain.
    #[must_use]
    pub fn bytes_per_body(&self) -> usize {
        BODY_BYTES + size_of::<EngineRobot>() + size_of::<Pose>() + size_of::<Option<Pose>>()
    }

    /// Returns the counters since the world began.
    #[must_use]
    pub fn statistics(&self) -> &WorldStatistics {
        &self.statistics
    }

    /// Returns the media parameters with which a herd was added. The loss may have been changed
    /// since.
    #[must_use]
    pub fn media(&self, herd: HerdId) -> &Media {
        &self.herds[usize::from(herd.0)].media
    }

    /// Returns the settings with which the world began, but with the current ambient light.
    #[must_use]
    pub fn settings(&self) -> &WorldSettings {
        &self.settings
    }

    pub(crate) fn index(&self, id: RobotId) -> Result<usize, UnknownRobot> {
        let index = usize::from(id.0);
        if index < self.brains.len() { Ok(index) } else { Err(UnknownRobot(id)) }
    }

    fn silence(&mut self, id: RobotId, state: RobotState) -> Result<(), UnknownRobot> {
        let index = self.index(id)?;
        let robot = &mut self.robots[index];
        if robot.state != RobotState::Failed {
            robot.state = state;
            robot.radio.silence();
            let Cohort { first, block, .. } = &mut self.cohorts[robot.cohort as usize];
            block.halt(index - *first);
            if state == RobotState::Failed {
                robot.led = 0;
            }
        }
        Ok(())
    }

    fn place(&mut self, index: usize, pose: Pose) {
        let Herd { shape: BodySize { radius_mm, .. }, has_positioning, .. } = *self.herd_of(index);
        let mut pose = Pose { z: pose.z.max(0.0), heading: super::wrap(pose.heading), ..pose };
        if let Some((x, y)) = self.crowd.movables.push_out(pose.x, pose.y, pose.z, radius_mm) {
            (pose.x, pose.y) = (x, y);
        }
        if let Some((x, y)) = self.obstacles.push_out(pose.x, pose.y, pose.z, radius_mm) {
            (pose.x, pose.y) = (x, y);
        }
        self.poses[index] = pose;
        self.crowd.displace(index, &pose);
        if has_positioning {
            let (seed, now) = (self.settings.seed, self.now);
            let Cohort { first, block, .. } = &mut self.cohorts[self.robots[index].cohort as usize];
            let moment = Moment { seconds: 0.0, seed, now, first: RobotId(*first as u16) };
            let estimates = &mut self.estimates[index..=index];
            block.sense(index - *first, &[pose], estimates, &moment);
        }
    }

    pub(crate) fn herd_of(&self, index: usize) -> &Herd {
        &self.herds[usize::from(self.robots[index].herd.0)]
    }
}
