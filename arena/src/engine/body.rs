//! Bodies: the interface between the world and a model of robots.
//!
//! To the world, a robot is an upright cylinder that exchanges frames over a medium. A
//! [`BodyModel`] gives the size of the bodies and makes [`BodyBlock`]s of them. The world calls a block
//! once for all of its robots, so that a model costs one dynamic call for up to 256 robots
//! instead of one for each. [`Bodies`] makes such a block out of the body of a single robot.

use core::any::Any;
use core::fmt::Debug;

use super::TICK_S;
use super::error::SettingsError;
use super::geometry::Pose;
use super::id::RobotId;
use super::link::Medium;
use super::stream::{Stream, StreamPurpose};

/// The largest number of robots in a block, small enough that a few slow brains do not hold up the
/// other threads.
pub(crate) const BLOCK_ROBOTS_MAX: usize = 256;

/// Size of a body: an upright cylinder.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BodySize {
    /// Radius in mm.
    pub radius_mm: f32,
    /// Height in mm.
    pub height_mm: f32,
}

/// The world around a body at the beginning of a tick.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BodySurroundings {
    /// Height in mm of the highest obstacle below the body; 0 above the ground.
    pub floor_mm: f32,
    /// Vectors in mm to the robots that are higher, as far as the model asks for them.
    pub above_mm: Vec<[f32; 3]>,
}

/// The attitude of a body in the air, and the thrust that holds it there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Attitude {
    /// Rotation about the axis ahead in radians; positive lifts the left side.
    pub roll_rad: f32,
    /// Rotation about the axis to the left in radians, before the roll; positive lowers the nose.
    pub pitch_rad: f32,
    /// Thrust of all rotors as a share of that in hover.
    pub thrust: f32,
}

/// The properties of a robot model that the world needs.
pub trait BodyModel: Debug + Send + Sync {
    /// Returns the size of a body.
    fn shape(&self) -> BodySize;

    /// Returns the speed of the fastest point of a body in mm/s. The world divides a tick into substeps in which no body moves more than
    /// half of its radius.
    fn top_speed_mm_s(&self) -> f32;

    /// Returns the medium that carries the robots' frames.
    fn medium(&self) -> Medium;

    /// Returns the closing speed in mm/s above which a contact in the air is a crash. At 0 every
    /// contact in the air is a crash. `None` stands for bodies that do not crash.
    fn crash_speed_mm_s(&self) -> Option<f32> {
        None
    }

    /// Returns true if the robots have a positioning system. Otherwise [`BodyBlock::sense`] is never
    /// called.
    fn has_positioning(&self) -> bool;

    /// Returns the place of each ground sensor on a body: mm ahead of the middle and to the left of
    /// it. The world reads them at the beginning of a tick.
    fn ground_sensors(&self) -> Vec<[f32; 2]> {
        Vec::new()
    }

    /// Returns the distance in mm within which bodies feel robots above them. `None` stands for bodies
    /// that feel neither these nor a floor above the ground; [`BodyBlock::surround`] is never called
    /// for them.
    fn feels_within_mm(&self) -> Option<f32> {
        None
    }

    /// Fails if a parameter is not valid for a body.
    fn check(&self) -> Result<(), SettingsError>;

    /// Returns a block without robots, for substeps of that length in seconds.
    fn block(&self, substep_s: f32) -> Box<dyn BodyBlock>;
}

/// The bodies of at most 256 robots with consecutive ids. `index` counts from the first robot
/// of the block. The `Debug` text contains the complete state, because digests of runs are computed
/// from it.
pub trait BodyBlock: Debug + Send + Sync {
    /// Returns a copy of the block whose robots continue exactly as the originals would.
    fn copy(&self) -> Box<dyn BodyBlock>;

    /// Adds a robot. `build` gives the random differences between robots of one kind.
    fn add(&mut self, pose: &Pose, build: &mut Stream);

    /// Changes the length of a substep, in seconds.
    fn set_substep(&mut self, seconds: f32);

    /// Gives a robot its surroundings, once in a tick.
    fn surround(&mut self, index: usize, surroundings: BodySurroundings);

    /// Moves all robots for one substep.
    fn step(&mut self, poses: &mut [Pose]);

    /// Returns the commands by which a brain moves a robot, for [`Io::controls`](super::Io::controls).
    fn controls(&mut self, index: usize) -> &mut dyn Any;

    /// Switches the motors of a robot off.
    fn halt(&mut self, index: usize);

    /// Puts a robot into the state after power-on: motors off and no position estimate.
    fn restart(&mut self, index: usize);

    /// Runs the wheels or vibration motors for `seconds` with these duties in percent, on behalf of
    /// firmware outside of the engine. Returns the speeds in mm/s ahead and radians per second,
    /// which are 0 for a body that stops at once; `None` for a body without such motors.
    fn roll(
        &mut self,
        index: usize,
        duties: [f32; 2],
        pose: &mut Pose,
        seconds: f32,
    ) -> Option<[f32; 2]>;

    /// Returns true if the body of a robot broke by itself, such as by a fall on the ground. The
    /// world makes the robot fail; contacts with robots and walls are the world's own task.
    fn is_broken(&self, index: usize) -> bool;

    /// Returns the attitude of a robot; `None` for a body that is always level.
    fn attitude(&self, index: usize) -> Option<Attitude>;

    /// Writes the position estimates of the robots from index `first` on.
    fn sense(
        &mut self,
        first: usize,
        poses: &[Pose],
        estimates: &mut [Option<Pose>],
        moment: &Moment,
    );
}

impl Clone for Box<dyn BodyBlock> {
    fn clone(&self) -> Self {
        (**self).copy()
    }
}

/// The time of an update of the position estimates.
#[derive(Clone, Copy, Debug)]
pub struct Moment {
    /// Seconds since the last update.
    pub seconds: f32,
    pub(crate) seed: u64,
    pub(crate) now: u64,
    /// The robot with index 0 in the block.
    pub(crate) first: RobotId,
}

impl Moment {
    /// Returns the random numbers for the estimate of a robot.
    #[must_use]
    pub fn stream(&self, index: usize) -> Stream {
        Stream::new(self.seed, StreamPurpose::Estimate, self.first.0 + index as u16, self.now)
    }
}

/// The body of one robot. Its `Debug` text contains its complete state.
pub trait Body: Clone + Debug + Send + Sync + 'static {
    /// The parameters of a kind of robot.
    type Numbers: Copy + Debug + Send + Sync;
    /// The parameters, prepared for one length of substep.
    type Step: Clone + Debug + Send + Sync;
    /// The commands by which a brain moves the body.
    type Controls: Any;

    /// Returns a body. `build` gives the random differences between robots of one kind.
    fn new(numbers: &Self::Numbers, pose: &Pose, build: &mut Stream) -> Self;

    /// Prepares the parameters for substeps of that length in seconds.
    fn prepare(numbers: &Self::Numbers, seconds: f32) -> Self::Step;

    /// Returns the commands by which a brain moves the body.
    fn controls(&mut self) -> &mut Self::Controls;

    /// Switches the motors off.
    fn halt(&mut self);

    /// Puts the body into the state after power-on.
    fn restart(&mut self) {
        self.halt();
    }

    /// Lets bodies of a block see each other before a substep.
    fn exchange(bodies: &mut [Self]) {
        let _ = bodies;
    }

    /// Takes the surroundings of the body, see [`BodyModel::feels_within_mm`].
    fn surround(&mut self, surroundings: BodySurroundings) {
        let _ = surroundings;
    }

    /// Moves the body for one substep.
    fn step(&mut self, pose: &mut Pose, step: &Self::Step);

    /// Runs the motors, see [`BodyBlock::roll`].
    fn roll(
        &mut self,
        duties: [f32; 2],
        pose: &mut Pose,
        step: &Self::Step,
        seconds: f32,
    ) -> Option<[f32; 2]> {
        let _ = (duties, pose, step, seconds);
        None
    }

    /// Returns true if the body broke, see [`BodyBlock::is_broken`]. Bodies that cannot fall never do.
    fn is_broken(&self) -> bool {
        false
    }

    /// Returns the attitude of the body, see [`BodyBlock::attitude`].
    fn attitude(&self) -> Option<Attitude> {
        None
    }

    /// Returns the body's estimate of its pose, `seconds` after the last update. `stream` gives
    /// random numbers for the errors of the estimate.
    fn sense(
        &mut self,
        pose: &Pose,
        numbers: &Self::Numbers,
        seconds: f32,
        stream: impl FnOnce() -> Stream,
    ) -> Option<Pose> {
        let _ = (pose, numbers, seconds, stream);
        None
    }
}

/// A block of bodies of one type.
#[derive(Clone, Debug)]
pub struct Bodies<B: Body> {
    numbers: B::Numbers,
    step: B::Step,
    bodies: Vec<B>,
}

impl<B: Body> Bodies<B> {
    /// Returns a block without robots, for substeps of that length in seconds.
    #[must_use]
    pub fn new(numbers: B::Numbers, substep_s: f32) -> Self {
        let step = B::prepare(&numbers, substep_s);
        Bodies { numbers, step, bodies: Vec::new() }
    }
}

impl<B: Body> BodyBlock for Bodies<B> {
    fn copy(&self) -> Box<dyn BodyBlock> {
        Box::new(self.clone())
    }

    fn add(&mut self, pose: &Pose, build: &mut Stream) {
        self.bodies.push(B::new(&self.numbers, pose, build));
    }

    fn set_substep(&mut self, seconds: f32) {
        self.step = B::prepare(&self.numbers, seconds);
    }

    fn surround(&mut self, index: usize, surroundings: BodySurroundings) {
        self.bodies[index].surround(surroundings);
    }

    fn step(&mut self, poses: &mut [Pose]) {
        B::exchange(&mut self.bodies);
        for (body, pose) in self.bodies.iter_mut().zip(poses) {
            body.step(pose, &self.step);
        }
    }

    fn controls(&mut self, index: usize) -> &mut dyn Any {
        self.bodies[index].controls()
    }

    fn halt(&mut self, index: usize) {
        self.bodies[index].halt();
    }

    fn restart(&mut self, index: usize) {
        self.bodies[index].restart();
    }

    fn roll(
        &mut self,
        index: usize,
        duties: [f32; 2],
        pose: &mut Pose,
        seconds: f32,
    ) -> Option<[f32; 2]> {
        self.bodies[index].roll(duties, pose, &self.step, seconds)
    }

    fn is_broken(&self, index: usize) -> bool {
        self.bodies[index].is_broken()
    }

    fn attitude(&self, index: usize) -> Option<Attitude> {
        self.bodies[index].attitude()
    }

    fn sense(
        &mut self,
        first: usize,
        poses: &[Pose],
        estimates: &mut [Option<Pose>],
        moment: &Moment,
    ) {
        let bodies = self.bodies[first..].iter_mut().zip(poses).zip(estimates).enumerate();
        for (offset, ((body, pose), estimate)) in bodies {
            let stream = || moment.stream(first + offset);
            *estimate = body.sense(pose, &self.numbers, moment.seconds, stream);
        }
    }
}

/// The largest number of substeps of a tick. Very fast bodies do not get more, because more
/// substeps would only cost time.
const SUBSTEPS_MAX: u32 = 50;

/// Returns the number of substeps into which a tick is divided for a model.
pub(crate) fn substeps(model: &dyn BodyModel) -> u32 {
    let halves = model.top_speed_mm_s() * TICK_S / (model.shape().radius_mm / 2.0);
    (halves.ceil() as u32).clamp(1, SUBSTEPS_MAX)
}
