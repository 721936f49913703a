//! The physical world: bodies, contacts, links and light. The behavior of a robot is a [`Brain`].
//!
//! # One tick
//! A tick is 100 ms ([`TICK_US`]) and has three phases:
//! 1. The [`Environment`] is read at the places of all robots. Every robot receives the frames of
//!    the last tick, and its brain runs.
//! 2. Bodies move, in as many substeps as the fastest body needs, and push each other apart.
//! 3. The links send in chronological order, with a resolution of one microsecond. A link takes the
//!    frame from the brain when the transmission starts.
//!
//! Robots that are controlled from outside of the engine are moved between the substeps
//! ([`World::tick_with`], [`World::roll`]).
//!
//! # Units
//! Millimeters, radians (anticlockwise positive, in (-pi, pi]), seconds; microseconds inside a tick. The world is a
//! rectangle with the origin in its middle, x to the right and y up.
//!
//! # Simplifications
//! * Walls and obstacles block infrared and the light of lamps, but no radio; robots block nothing.
//! * If two frames overlap, the stronger one is lost, too. A frame disturbs others exactly as far as
//!   it can be received. In the edge of an infrared range each frame has its own chance; that some
//!   pairs of robots reach farther than others is not modeled.
//! * All scripts see the state of the world at the beginning of the tick. Only their frames are
//!   sent at different times within the tick.
//! * A contact does not rotate a body, and bodies have no mass: two bodies that overlap both move
//!   by half of the overlap. A [`MovableDisc`] is such a body without a drive, and has no friction
//!   either. The 15 ms of spin-up of a Kilobot are too fast to be modeled here,
//!   temperature is too slow. A model may simulate more, such as the attitude of a drone.
//! * The rate of a Kilobot's oscillator has a constant error, although temperature and voltage would
//!   change it. Two hidden terminals with equal rates may therefore collide for a long time.
//! * The position estimate of a Crazyflie starts at the true position in the frame of the world,
//!   even with a Flow deck.
//!
//! ```
//! use bittybuzz_arena::engine::{Brain, Io, Media, Pose, World, WorldSettings};
//! use bittybuzz_kilobot_model::{KilobotModel, KilobotMotors};
//!
//! struct Forward;
//! impl Brain for Forward {
//!     fn tick(&mut self, io: &mut Io<'_>) {
//!         if let Some(motors) = io.controls::<KilobotMotors>() {
//!             (motors.left, motors.right) = (70, 70);
//!         }
//!     }
//! }
//!
//! let mut world = World::new(WorldSettings::default())?;
//! let herd = world.add_herd(std::sync::Arc::new(KilobotModel::STANDARD), Media::STANDARD)?;
//! let id = world.add(herd, Pose::default(), Forward)?;
//! for _ in 0..10 {
//!     world.tick();
//! }
//! let moved = world.robot(id).unwrap().pose.x;
//! assert!(moved > 5.0 && moved < 15.0, "{moved} mm in a second");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod body;
mod brain;
mod contact;
mod digest;
mod environment;
mod error;
mod geometry;
mod grid;
mod herd;
mod id;
mod intruder;
mod intruders;
mod light;
mod link;
mod movable;
mod obstacle;
mod oscillator;
mod outside;
mod paint;
mod pool;
mod ranger;
mod ray;
mod reach;
mod robot;
mod scratch;
mod settings;
mod shadow;
mod statistics;
mod step;
mod stream;
mod world;
mod world_digest;

pub(crate) use body::BLOCK_ROBOTS_MAX;
pub use body::{Attitude, Bodies, Body, BodyBlock, BodyModel, BodySize, BodySurroundings, Moment};
pub use brain::{Brain, Io, ReceivedFrame, Sensors, TickFrames};
pub(crate) use digest::Digest;
pub use environment::Environment;
pub use error::{AddError, SettingsError, UnknownRobot};
pub use geometry::{Area, Pose, wrap};
pub use herd::HerdId;
pub use id::RobotId;
pub use intruder::{Intruder, IntruderSettings};
pub use light::{Lamp, LightId};
pub use link::{
    Arrival, Fate, FrameLog, FrameSighting, Infrared, InfraredPreset, LinkSettings, Loss,
    LossCause, Media, Medium, Nrf24Medium, P2p, RangeAndBearing, SendAttempt, SentFrame,
};
pub use movable::MovableDisc;
pub(crate) use obstacle::OVERLAP_TOLERANCE_MM;
pub use obstacle::Obstacle;
pub use oscillator::Oscillator;
pub use paint::{PaintedGround, Patch, PatchShape};
pub use ray::Side;
pub use robot::{RobotState, RobotView};
pub use settings::{WorldSettings, above_0, first_wrong, not_below_0, within};
pub use statistics::{LinkStatistics, WorldStatistics};
pub use stream::Stream;
pub use world::World;

/// Length of a tick in microseconds: the period of the robots' scripts.
pub const TICK_US: u32 = 100_000;

/// Length of a tick in seconds.
pub const TICK_S: f32 = 0.1;
