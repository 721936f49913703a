//! A session of the simulator as messages: requests of a page, events and samples for it.
//!
//! [`Live`] takes requests as JSON text and gives events as JSON text and samples as bytes. The caller carries them: a WebSocket of `bbz`, or a worker in the browser with the simulator as WebAssembly.
//!
//! # Principles
//! 1. **Time comes from the caller.** There is no clock here, so that it runs everywhere and tests wait for nothing.
//! 2. **Samples may be left out, events may not.** A slow page asks for a sample less often and then gets the newest one; faults and
//!    log lines wait until they are taken.
//! 3. **A client may send anything.** A request that makes no sense is answered with an event that says why, and changes nothing.
//!
//! # Requests
//! | Request | Effect |
//! |---|---|
//! | `{"play":{"rate":2}}` | the run goes on at twice the real time; 0.1 to 1000, without `rate` as fast as it can |
//! | `"pause"` | it stands still |
//! | `{"step":{"ticks":1}}` | it goes on for that number of ticks |
//! | `{"go_to":{"tick":100}}` | it is taken to a tick, back or forward, and stands still |
//! | `{"command":{"text":"fail = 3"}}` | the command of the text acts at the next tick |
//! | `{"inspect":{"robot":5}}` | after each sample an event has the memory of the robot with this number; `null`: no more |
//! | `"commands"` | an event has all commands, as the text of `[[event]]`s |
//!
//! # Events
//! Each is an object whose `event` names its kind: `begin` (the world), `state` (tick, whether it plays, how fast, whether it is over),
//! `log`, `fault`, `expectation`, `inspection`, `commands`, `refused` (a request that was not carried out) and `failed` (the run cannot
//! go on).
//!
//! # Samples
//! The bytes of a recording (docs/recording.md), piece by piece. A piece that begins with the recording's magic bytes begins anew:
//! the session was taken back.
//!
//! # What it will not do
//! Read files, compile scripts (the run's setup does, for commands), listen on a network, draw.

mod begin;
mod events;
mod inspection;
mod live;
mod pace;
mod request;
mod samples;

pub use live::Live;
