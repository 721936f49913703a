//! Hosts of the virtual machine for tests.
//!
//! * [`Recorder`] answers a script as the test wants it and records all requests of the script.
//! * [`Program`] compiles text; [`ImageParts`] lays out an image by hand.
//! * [`TestRobot`] is a machine with its recorder, which steps, restarts and keeps its fault.
//! * [`Swarm`] is a row of robots with [`Air`] between them: it loses, doubles and delays frames,
//!   limits how many a robot sends per step, and shows every frame to an observer. [`Direct`] and
//!   [`Queues`] are the robots' ends of it.
//! * [`Hostile`] is a sender in that air which is no robot: it forges, invents, replays and babbles.
//! * [`frame`] and [`fragments`] encode messages.
//! * [`forged`] makes messages with a value of each class, on each topic and key of a script.
//!
//! # Principles
//! 1. **The same run every time.** All chance comes from a seed.
//! 2. **A recording holds values, not text.** A test compares [`Event`]s or renders them itself.
//! 3. **A mistake panics**, because this is a test.
//!
//! # Where it is not used
//! `tests/on-chip` and `bench/run` run on microcontrollers without an allocator, where a recording
//! must be a checksum and a robot must cost nothing; their hosts are their own. So is that of
//! `bbz/tests/support`, which writes the records of `comms::trace` from the machine's own
//! arguments.
//!
//! # Use
//! ```
//! use bittybuzz_testkit::Swarm;
//! use bittybuzz_vm_core::number::Tiny;
//!
//! let mut swarm: Swarm<Tiny> = Swarm::new(3, "function step() { log(neighbors.count()) }");
//! swarm.air.seed(7);
//! swarm.air.loss = 0.1;
//! swarm.steps(40);
//! assert_eq!(swarm.last(), ["2", "2", "2"]);
//! ```

/// Makes a test of a function that is generic in the number profile and runs it in both.
#[macro_export]
macro_rules! in_both_profiles {
    ($name:ident, $check:ident) => {
        #[test]
        fn $name() {
            $check::<$crate::profiles::Tiny>();
            $check::<$crate::profiles::Full>();
        }
    };
}

#[doc(hidden)]
pub use bittybuzz_vm_core::number as profiles;

mod air;
pub mod forged;
mod frames;
mod hostile;
mod image;
mod link;
mod program;
mod random;
mod recorder;
mod robot;
mod swarm;

pub use air::{Air, OnAir, Place};
pub use frames::{fragments, frame};
pub use hostile::{Attack, FORGER, Hostile, INVENTED};
pub use image::ImageParts;
pub use link::{Direct, Link, Queues, Received};
pub use program::Program;
pub use random::Random;
pub use recorder::{Answer, Call, Event, RecordedArgument, Recorder};
pub use robot::{LARGE_SIZES, LARGE_SLOTS, SIZES, TestRobot};
pub use swarm::Swarm;
