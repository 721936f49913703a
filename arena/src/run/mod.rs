//! Runs a scenario: scripts in robots, events, expectations, many runs at once.
//!
//! [`Setup`] is a scenario with its programs, checked against each other. A [`Simulation`] is one
//! run of a setup with one seed, and owns everything that it needs. The caller advances it tick by
//! tick, reads it in between, and may take snapshots. A [`Session`] is a run that commands change
//! and that can be taken back to any tick. An [`Observer`] sees frames, faults, logs and calls of
//! robot functions.

mod adversary;
mod asked;
mod complete;
mod condition;
mod event_queue;
mod expectation;
#[cfg_attr(not(feature = "emulators"), path = "no_firmware.rs")]
mod firmware;
mod group;
mod measure;
mod observer;
mod place;
mod program;
mod quantity;
mod session;
mod settings;
mod setup;
mod simulation;
mod summary;
mod swarm;

pub use complete::{RunError, RunWatcher, complete, complete_watched};
pub use expectation::{Convergence, Verdict};
pub use firmware::FirmwareError;
#[cfg(feature = "emulators")]
pub use firmware::{FirmwareFailure, P2pAir, RadioTurns, TurnLength};
pub use measure::BoundMeasure;
pub use observer::{EventKind, FrameOnAir, ObservedEvent, Observer};
pub use place::poses as start_poses;
pub use program::{Compiler, Program};
pub use quantity::{AggregateProbe, QuantityProbe, QuantityReading};
pub use session::{COPIES_BYTES, NoWayBack, NotReplaced, Session};
pub use setup::{Setup, SetupError, emulated};
pub use simulation::{JoinedRobot, Simulation};
pub use summary::{FaultOf, OverrunSummary, Summary, Unusable};

/// Ticks per second.
pub const TICKS_PER_SECOND: f64 = 10.0;

/// Returns the first tick at or after a time.
fn tick_at(seconds: f64) -> u64 {
    // The tolerance keeps a time that is a whole number of ticks at this tick, although binary
    // fractions are inexact.
    (seconds * TICKS_PER_SECOND - 1e-6).ceil().max(0.0) as u64
}
