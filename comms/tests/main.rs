//! The tests of this crate, as one program, so that they are linked once.

#![allow(clippy::unwrap_used, reason = "a failure here fails the test")]

mod long;
mod p2p;
mod packets;
mod queue;
mod stream;
mod trace;
mod trace_log;
