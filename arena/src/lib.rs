//! The world in which simulated robots move and talk.
//!
//! # Purpose
//! To develop and to judge a behaviour before it is flashed: up to 20,000 robots with the bodies and the links of the
//! real ones, much faster than in reality.
//!
//! # Principles
//! 1. **One seed, one trace**, bit for bit, on any machine and any number of threads.
//! 2. **Frames, not messages**: what a robot hears depends on when its neighbours speak. Frames take time, collide, wait
//!    for a free channel and get lost.
//! 3. **Every number has a source** (data sheet, paper, another simulator), or says that it is a choice.
//! 4. **Both backends are one world**: whether a virtual machine of this process or the robot's own image in an emulator
//!    moves it, a robot has the same body, the same errors and the same contacts.
//!
//! # Features
//! * `emulators` (on by default): robots that run their firmware in emulator programs (`backend = "firmware"`). It costs the reader
//!   of firmware traces: `bittybuzz-trace-reader` with `defmt-decoder`, together 51 crates. Without it such a robot is an error of
//!   its scenario, and as WebAssembly the crate imports nothing.
//!
//! Emulators are programs of their own, and their licences stay there: this crate has the client (`bittybuzz-emulation`).
//!
//! # Parts
//! * [`engine`]: bodies, contacts, links, light.
//! * [`output`]: recordings, pictures, tables.
//! * [`robot`]: the interface to models of robots, and robots with their scripts.
//! * [`run`]: scripts in the robots of a scenario, its events, expectations and observers.
//! * [`scenario`]: files with the content of a world, its events, and the expected results.

#![forbid(unsafe_code)]

pub mod engine;
pub mod output;
pub mod robot;
pub mod run;
pub mod scenario;
