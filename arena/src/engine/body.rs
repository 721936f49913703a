//! Bodies: the interface between the world and a model of robots.
//!
//! The world knows robots as upright cylinders that talk over a medium. A [`BodyModel`] says how large they are and makes
//! [`Block`]s of their bodies; the world calls a block once for all of its robots, so that a model costs one dynamic call for
//! up to [`BLOCK`] robots and not one for each. [`Bodies`] makes such a block out of the body of a single robot.

use core::any::Any;
use core::fmt::Debug;

use super::TICK;
use super::error::SettingsError;
use super::geometry::Pose;
use super::id::RobotId;
use super::link::Medium;
use super::stream::{Purpose, Stream};

/// The most robots of a block. Small enough that a few slow brains do not hold up the other threads.
pub const BLOCK: usize = 256;

/// Size of a body: an upright cylinder.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shape {
    /// mm
    pub radius: f32,
    /// mm
    pub height: f32,
}

/// A model of robots, as far as the world needs it.
pub trait BodyModel: Debug + Send + Sync {
    /// Returns the size of a body.
    fn shape(&self) -> Shape;

    /// Returns the speed of the fastest point of a body in mm/s. The world divides a tick into substeps in which no body moves more than
    /// half of its radius.
    fn top_speed(&self) -> f32;

    /// Returns the medium that carries the robots' frames.
    fn medium(&self) -> Medium;

    /// Returns the closing speed in mm/s above which a contact in the air is a crash, 0 if every contact is one; `None` for bodies
    /// that do not crash.
    fn crash_speed(&self) -> Option<f32> {
        None
    }

    /// Returns true if robots learn where they are. Blocks of others are never asked.
    fn has_positioning(&self) -> bool;

    /// Refuses numbers that no body can have.
    fn check(&self) -> Result<(), SettingsError>;

    /// Returns a block without robots, for substeps of that length in seconds.
    fn block(&self, substep: f32) -> Box<dyn Block>;
}

/// The bodies of at most [`BLOCK`] robots with successive ids. `index` counts from the first of them. The `Debug` text is all of
/// their state, by which runs are compared.
pub trait Block: Debug + Send + Sync {
    /// Returns a copy of the whole block, whose robots go on as these would.
    fn copy(&self) -> Box<dyn Block>;

    /// Adds a robot. `build` gives the differences between robots of one kind.
    fn add(&mut self, pose: &Pose, build: &mut Stream);

    /// Changes the length of a substep, in seconds.
    fn set_substep(&mut self, seconds: f32);

    /// Moves all robots for one substep.
    fn step(&mut self, poses: &mut [Pose]);

    /// Returns the commands by which a brain moves a robot, for [`Io::controls`](super::Io::controls).
    fn controls(&mut self, index: usize) -> &mut dyn Any;

    /// Switches the motors of a robot off.
    fn halt(&mut self, index: usize);

    /// Puts a robot into the state after power-on: motors off, and nothing is known of its place.
    fn restart(&mut self, index: usize);

    /// Lets wheels or vibration motors run for `seconds` with these duties in percent, as firmware outside of the engine
    /// drives them. Returns mm/s ahead and radians per second, which are 0 for a body that stops at once; `None` for a body
    /// without such motors.
    fn roll(
        &mut self,
        index: usize,
        duties: [f32; 2],
        pose: &mut Pose,
        seconds: f32,
    ) -> Option<[f32; 2]>;

    /// Writes where robots believe to be, from number `first` on.
    fn sense(
        &mut self,
        first: usize,
        poses: &[Pose],
        estimates: &mut [Option<Pose>],
        moment: &Moment,
    );
}

impl Clone for Box<dyn Block> {
    fn clone(&self) -> Self {
        (**self).copy()
    }
}

/// The time at which robots learn where they are.
#[derive(Clone, Copy, Debug)]
pub struct Moment {
    /// Seconds since the last time.
    pub seconds: f32,
    pub(crate) seed: u64,
    pub(crate) now: u64,
    /// The robot that is number 0 of the block.
    pub(crate) first: RobotId,
}

impl Moment {
    /// Returns the random numbers for the estimate of a robot.
    #[must_use]
    pub fn stream(&self, index: usize) -> Stream {
        Stream::new(self.seed, Purpose::Estimate, self.first.0 + index as u16, self.now)
    }
}

/// The body of one robot. Its `Debug` text is all of its state.
pub trait Body: Clone + Debug + Send + Sync + 'static {
    /// The numbers of a kind of robot.
    type Numbers: Copy + Debug + Send + Sync;
    /// The numbers, prepared for one length of substep.
    type Step: Clone + Debug + Send + Sync;
    /// The commands by which a brain moves it.
    type Controls: Any;

    /// Returns a body. `build` gives the differences between robots of one kind.
    fn new(numbers: &Self::Numbers, pose: &Pose, build: &mut Stream) -> Self;

    /// Prepares the numbers for substeps of that many seconds.
    fn prepare(numbers: &Self::Numbers, seconds: f32) -> Self::Step;

    /// Returns the commands by which a brain moves it.
    fn controls(&mut self) -> &mut Self::Controls;

    /// Switches the motors off.
    fn halt(&mut self);

    /// Puts it into the state after power-on.
    fn restart(&mut self) {
        self.halt();
    }

    /// Moves it for one substep.
    fn step(&mut self, pose: &mut Pose, step: &Self::Step);

    /// Lets its motors run, see [`Block::roll`].
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

    /// Returns where it believes to be, `seconds` after the last time. `stream` is for bodies whose estimate has errors.
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
    pub fn new(numbers: B::Numbers, substep: f32) -> Self {
        let step = B::prepare(&numbers, substep);
        Bodies { numbers, step, bodies: Vec::new() }
    }
}

impl<B: Body> Block for Bodies<B> {
    fn copy(&self) -> Box<dyn Block> {
        Box::new(self.clone())
    }

    fn add(&mut self, pose: &Pose, build: &mut Stream) {
        self.bodies.push(B::new(&self.numbers, pose, build));
    }

    fn set_substep(&mut self, seconds: f32) {
        self.step = B::prepare(&self.numbers, seconds);
    }

    fn step(&mut self, poses: &mut [Pose]) {
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

/// The most substeps of a tick, however fast bodies are: more would only cost time.
const MOST_SUBSTEPS: u32 = 50;

/// Returns into how many substeps a tick is divided for a model.
pub(crate) fn substeps(model: &dyn BodyModel) -> u32 {
    let halves = model.top_speed() * TICK / (model.shape().radius / 2.0);
    (halves.ceil() as u32).clamp(1, MOST_SUBSTEPS)
}
