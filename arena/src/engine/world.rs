//! The world: robots, obstacles, lamps, and what one may do to them.

use core::hash::{Hash, Hasher};

use rayon::ThreadPool;

use super::body::Body;
use super::brain::Brain;
use super::contact::Crowd;
use super::error::{AddError, SettingsError, UnknownRobot};
use super::geometry::Pose;
use super::light::{Light, LightId};
use super::link::{Air, Calibration, Loss, Medium, Radio, Schedule, Topology};
use super::obstacle::{Obstacle, Obstacles};
use super::robot::{Robot, RobotId, RobotKind, RobotState, View};
use super::settings::Settings;
use super::statistics::Statistics;
use super::step::Scratch;
use super::stream::{Purpose, Stream};
use super::variant::{Numbers, Variant};

/// Robots with brains of type `B`, and everything around them.
#[derive(Debug)]
pub struct World<B> {
    pub(crate) settings: Settings,
    pub(crate) now: u64,
    pub(crate) brains: Vec<B>,
    pub(crate) robots: Vec<Robot>,
    pub(crate) poses: Vec<Pose>,
    pub(crate) kinds: Vec<RobotKind>,
    pub(crate) obstacles: Obstacles,
    pub(crate) lights: Vec<Light>,
    pub(crate) crowd: Crowd,
    pub(crate) substeps: u32,
    /// Of each variant.
    pub(crate) numbers: Vec<Numbers>,
    pub(crate) air: [Air; Medium::COUNT],
    pub(crate) schedules: [Schedule; Medium::COUNT],
    pub(crate) topology: Topology,
    pub(crate) calibration: Calibration,
    pub(crate) statistics: Statistics,
    pub(crate) scratch: Vec<Scratch>,
    /// `None`: the caller's thread does everything.
    pub(crate) pool: Option<ThreadPool>,
}

impl<B: Brain> World<B> {
    /// An empty world.
    pub fn new(settings: Settings) -> Result<Self, SettingsError> {
        settings.check()?;
        let Settings { area, kilobot, zooid, crazyflie, infrared, nrf24, p2p, .. } = settings;
        let pool = if settings.threads == 1 {
            None
        } else {
            // A machine that gives no threads still simulates.
            rayon::ThreadPoolBuilder::new().num_threads(settings.threads).build().ok()
        };
        let widest = kilobot.radius.max(zooid.radius).max(crazyflie.radius);
        Ok(World {
            settings,
            now: 0,
            brains: Vec::new(),
            robots: Vec::new(),
            poses: Vec::new(),
            kinds: Vec::new(),
            obstacles: Obstacles::new(area, widest + 1.0),
            lights: Vec::new(),
            crowd: Crowd::new(area, &settings),
            substeps: 1,
            numbers: vec![Numbers::new(settings, 1)],
            air: [
                Air::new(Medium::Infrared, infrared.link, 2.0 * kilobot.radius, area),
                Air::new(Medium::Nrf24, nrf24.link, 0.0, area),
                Air::new(Medium::P2p, p2p.link, 0.0, area),
            ],
            schedules: Default::default(),
            topology: Topology::default(),
            calibration: Calibration::new(),
            statistics: Statistics::default(),
            scratch: Vec::new(),
            pool,
        })
    }

    /// Adds numbers that hold for some robots: how they move, and what becomes of the frames that they send. Seed, area,
    /// light and the sizes of bodies are the world's.
    pub fn add_variant(&mut self, settings: Settings) -> Result<Variant, SettingsError> {
        settings.check()?;
        let too_many = SettingsError { field: "variant", must: "one of at most 65536" };
        let number = u16::try_from(self.numbers.len()).map_err(|_| too_many)?;
        let mut settings = settings;
        settings.kilobot.radius = self.settings.kilobot.radius;
        settings.zooid.radius = self.settings.zooid.radius;
        settings.crazyflie.radius = self.settings.crazyflie.radius;
        let Settings { infrared, nrf24, p2p, .. } = settings;
        for (air, link) in self.air.iter_mut().zip([infrared.link, nrf24.link, p2p.link]) {
            air.add_link(link, self.settings.area);
        }
        self.numbers.push(Numbers::new(settings, self.substeps));
        Ok(Variant(number))
    }

    /// Puts a robot into the world, also while it runs. Ids count up from 0.
    pub fn add(&mut self, kind: RobotKind, pose: Pose, brain: B) -> Result<RobotId, AddError> {
        self.add_as(Variant::STANDARD, kind, pose, brain)
    }

    /// Puts a robot of a variant of this world into it.
    pub fn add_as(
        &mut self,
        variant: Variant,
        kind: RobotKind,
        pose: Pose,
        brain: B,
    ) -> Result<RobotId, AddError> {
        let id = u16::try_from(self.brains.len()).map_err(|_| AddError::TooMany)?;
        if !pose.is_finite() || !self.settings.area.contains(pose.x, pose.y) {
            return Err(AddError::Outside);
        }
        let Some(Numbers { settings, pacing, .. }) = self.numbers.get(usize::from(variant.0))
        else {
            return Err(AddError::UnknownVariant);
        };
        let mut build = Stream::new(self.settings.seed, Purpose::Build, id, 0);
        let body = Body::new(kind, &pose, settings, &mut build);
        let radio = Radio::new(kind.medium(), pacing, &mut build);
        let substeps = kind.substeps(settings);
        let is_new = !self.kinds.contains(&kind);
        let has_doubled = self.brains.len().is_power_of_two();
        self.brains.push(brain);
        self.robots.push(Robot { variant, body, radio, state: RobotState::Running, led: 0 });
        self.poses.push(pose);
        self.kinds.push(kind);
        self.crowd.add();
        if is_new || has_doubled {
            self.crowd.resize(self.settings.area, &self.kinds);
        }
        if substeps > self.substeps {
            self.substeps = substeps;
            for numbers in &mut self.numbers {
                *numbers = Numbers::new(numbers.settings, substeps);
            }
        }
        self.place(usize::from(id), pose);
        Ok(RobotId(id))
    }

    /// Adds a wall or an obstacle. A size counts without its sign; what is further away than 10 km, or at
    /// no number, is nowhere.
    pub fn add_obstacle(&mut self, obstacle: Obstacle) {
        self.obstacles.add(obstacle);
    }

    /// All obstacles.
    #[must_use]
    pub fn obstacles(&self) -> &[Obstacle] {
        self.obstacles.all()
    }

    /// Lights a lamp.
    pub fn add_light(&mut self, light: Light) -> LightId {
        self.lights.push(light);
        LightId(self.lights.len() - 1)
    }

    /// Changes a lamp: moved, dimmed, or off with intensity 0.
    pub fn set_light(&mut self, id: LightId, light: Light) {
        if let Some(lamp) = self.lights.get_mut(id.0) {
            *lamp = light;
        }
    }

    /// Changes the daylight, 0 to 1023.
    pub fn set_ambient_light(&mut self, reading: f32) {
        self.settings.ambient_light = reading.clamp(0.0, 1023.0);
    }

    /// Changes the loss of a medium, whoever sends.
    pub fn set_loss(&mut self, medium: Medium, loss: Loss) {
        let Loss { near, far } = loss;
        let loss = Loss { near: near.clamp(0.0, 1.0), far: far.clamp(0.0, 1.0) };
        self.air[medium as usize].set_loss(loss);
    }

    /// Nothing passes between the two robots any more, in either direction.
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

    /// Splits the links: nothing passes between robots of unlike groups. Robots that join later are in group 0.
    pub fn partition(&mut self, group: impl FnMut(RobotId) -> u8) {
        self.topology.partition(self.ids().map(group).collect());
    }

    /// Undoes [`partition`](Self::partition).
    pub fn heal(&mut self) {
        self.topology.heal();
    }

    /// The robot fails, as if its power was cut; its body stays, and nothing but a [`restart`](Self::restart) brings it back.
    pub fn fail(&mut self, id: RobotId) -> Result<(), UnknownRobot> {
        self.silence(id, RobotState::Failed)
    }

    /// Stops a running robot: motors off, deaf and silent, until it is resumed.
    pub fn stop(&mut self, id: RobotId) -> Result<(), UnknownRobot> {
        self.silence(id, RobotState::Stopped)
    }

    /// Lets a stopped robot go on where its brain was; a failed one stays as it is.
    pub fn resume(&mut self, id: RobotId) -> Result<(), UnknownRobot> {
        let index = self.index(id)?;
        let state = &mut self.robots[index].state;
        if *state == RobotState::Stopped {
            *state = RobotState::Running;
        }
        Ok(())
    }

    /// Switches a robot off and on, whatever its state: it runs, where it is, with another brain and its motors off. What is
    /// of its body stays, such as the gains of its motors. Returns the brain that it had.
    pub fn restart(&mut self, id: RobotId, brain: B) -> Result<B, UnknownRobot> {
        let index = self.index(id)?;
        let robot = &mut self.robots[index];
        robot.state = RobotState::Running;
        robot.led = 0;
        robot.body.restart();
        robot.radio.silence();
        self.place(index, self.poses[index]);
        Ok(core::mem::replace(&mut self.brains[index], brain))
    }

    /// Takes a robot somewhere else. A place outside of the world becomes the nearest inside.
    pub fn move_to(&mut self, id: RobotId, pose: Pose) -> Result<(), UnknownRobot> {
        let index = self.index(id)?;
        if pose.is_finite() {
            self.place(index, pose);
        }
        Ok(())
    }

    /// Ticks since the beginning.
    #[must_use]
    pub fn now(&self) -> u64 {
        self.now
    }

    /// How many robots there are; their ids are below.
    #[must_use]
    pub fn len(&self) -> usize {
        self.brains.len()
    }

    /// Whether there are no robots.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.brains.is_empty()
    }

    /// The ids of all robots.
    pub fn ids(&self) -> impl Iterator<Item = RobotId> + use<B> {
        (0..self.brains.len()).map(|index| RobotId(index as u16))
    }

    /// What can be seen of a robot.
    #[must_use]
    pub fn robot(&self, id: RobotId) -> Option<View> {
        let index = self.index(id).ok()?;
        let Robot { body, state, led, .. } = &self.robots[index];
        let kind = self.kinds[index];
        Some(View {
            kind,
            state: *state,
            pose: self.poses[index],
            estimate: body.estimate().copied(),
            radius: kind.radius(&self.settings),
            led: *led,
        })
    }

    /// All robots in the order of their ids.
    pub fn robots(&self) -> impl Iterator<Item = View> + '_ {
        self.ids().filter_map(|id| self.robot(id))
    }

    /// A robot's brain.
    #[must_use]
    pub fn brain(&self, id: RobotId) -> Option<&B> {
        self.brains.get(usize::from(id.0))
    }

    /// A robot's brain, to be changed between ticks.
    pub fn brain_mut(&mut self, id: RobotId) -> Option<&mut B> {
        self.brains.get_mut(usize::from(id.0))
    }

    /// How far the frames of a robot reach, in mm between two middles; 0 if there is no such robot.
    #[must_use]
    pub fn reach(&self, id: RobotId) -> f64 {
        let Ok(index) = self.index(id) else { return 0.0 };
        let medium = self.kinds[index].medium();
        f64::from(self.air[medium as usize].reach(self.robots[index].variant))
    }

    /// Whether frames of one robot get to another: they have one medium, are near enough, and nothing cuts them off.
    #[must_use]
    pub fn can_hear(&self, by: RobotId, of: RobotId) -> bool {
        let (Ok(listener), Ok(sender)) = (self.index(by), self.index(of)) else { return false };
        let (here, there) = (self.poses[listener], self.poses[sender]);
        let [dx, dy, dz] = [here.x - there.x, here.y - there.y, here.z - there.z].map(f64::from);
        let reach = self.reach(of);
        self.kinds[listener].medium() == self.kinds[sender].medium()
            && dx * dx + dy * dy + dz * dz <= reach * reach
            && self.topology.connects(by, of)
    }

    /// Whether nothing cuts two robots off from each other; distance does not count.
    #[must_use]
    pub fn connects(&self, a: RobotId, b: RobotId) -> bool {
        self.topology.connects(a, b)
    }

    /// What was counted since the beginning.
    #[must_use]
    pub fn statistics(&self) -> &Statistics {
        &self.statistics
    }

    /// The numbers that the world began with; light and loss may have been changed since.
    #[must_use]
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// A number that stands for the whole state but the brains: worlds that went the same way have the same.
    #[must_use]
    pub fn digest(&self) -> u64 {
        let mut digest = Fnv(0xcbf2_9ce4_8422_2325);
        self.now.hash(&mut digest);
        self.statistics.hash(&mut digest);
        let all = self.poses.iter().zip(&self.robots);
        for (pose, Robot { body, radio, state, led, .. }) in all {
            for pose in [Some(pose), body.estimate()].into_iter().flatten() {
                for part in [pose.x, pose.y, pose.z, pose.heading] {
                    part.to_bits().hash(&mut digest);
                }
            }
            (radio.attempt, radio.waits, *state as u8, led).hash(&mut digest);
        }
        digest.finish()
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
            robot.body.halt();
            robot.radio.silence();
            if state == RobotState::Failed {
                robot.led = 0;
            }
        }
        Ok(())
    }

    fn place(&mut self, index: usize, pose: Pose) {
        let radius = self.kinds[index].radius(&self.settings);
        let mut pose = Pose { z: pose.z.max(0.0), heading: super::wrap(pose.heading), ..pose };
        if let Some((x, y)) = self.obstacles.push_out(pose.x, pose.y, radius) {
            (pose.x, pose.y) = (x, y);
        }
        self.poses[index] = pose;
        let (seed, now) = (self.settings.seed, self.now);
        let robot = &mut self.robots[index];
        let models = &self.numbers[usize::from(robot.variant.0)].models;
        robot
            .body
            .sense(&pose, models, 0.0, || Stream::new(seed, Purpose::Estimate, index as u16, now));
    }
}

/// FNV-1a: the same on every machine and in every release, which the standard library does not promise of its own.
struct Fnv(u64);

impl Hasher for Fnv {
    fn finish(&self) -> u64 {
        self.0
    }

    fn write(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            self.0 = (self.0 ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
        }
    }
}
