//! The tests of this crate, as one program, so that they are linked once.

#![allow(clippy::unwrap_used, reason = "a failure here fails the test")]

mod adversaries;
mod backends;
mod barriers;
mod bodies;
mod busy;
mod checks;
mod clocks;
mod commands;
mod common;
mod contacts;
mod crashes;
mod delivery;
mod described;
mod determinism;
mod digest;
mod events;
mod expectations;
mod faults;
mod flight_fidelity;
mod globals;
mod groups;
mod inspection;
mod kilobot_motion;
mod links;
mod loads;
mod long_messages;
mod memory_files;
mod numbers;
mod observer;
mod pictures;
mod recording;
mod robots;
mod scenario_document;
mod scenario_errors;
mod script;
mod sensors;
mod session;
mod snapshot;
mod steps;
mod swarm;
mod torture;
