//! The simulated world in which robots move and exchange frames.
//!
//! # Purpose
//! The simulator serves to develop and to evaluate a behavior before it is flashed. It runs up to
//! 20,000 robots with the bodies and the links of the real ones, much faster than in reality.
//!
//! # Principles
//! 1. **One seed, one trace**, bit for bit, on any machine and any number of threads.
//! 2. **Frames, not messages**: the frames that a robot receives depend on the times at which its
//!    neighbors send. Frames take time, collide, wait for a free channel and get lost.
//! 3. **Every number has a source** (data sheet, paper, another simulator), or is marked as a
//!    choice.
//! 4. **Both backends share one world**: a robot has the same body, the same errors and the same
//!    contacts, no matter if a virtual machine in this process or its own image in an emulator
//!    controls it.
//!
//! # Features
//! * `emulators` (on by default): robots that run their firmware in emulator programs
//!   (`backend = "firmware"`). The feature adds the reader of firmware traces:
//!   `bittybuzz-trace-reader` with `defmt-decoder`, together 51 crates. Without the feature, a
//!   scenario with such a robot is rejected, and a WebAssembly build of the crate imports nothing.
//!
//! Emulators are separate programs, and their licenses do not affect this crate, which has only the
//! client (`bittybuzz-emulation`).
//!
//! # Parts
//! * [`engine`]: bodies, contacts, links, light.
//! * [`output`]: recordings, pictures, tables.
//! * [`robot`]: the interface to models of robots, and robots with their scripts.
//! * [`run`]: a run of a scenario, with the scripts of its robots, its events, expectations and
//!   observers.
//! * [`scenario`]: files with the content of a world, its events, and the expected results.
//! * [`sweep`]: many runs with several values of some keys, as data.
//! * [`statistics`]: quantiles, and times that not every run reaches.

#![forbid(unsafe_code)]

pub mod engine;
pub mod output;
pub mod robot;
pub mod run;
pub mod scenario;
pub mod statistics;
pub mod sweep;
