//! The tests of this crate, as one program, so that they are linked once.

#![allow(clippy::unwrap_used, reason = "a failure here fails the test")]

mod bad_inputs;
mod batch;
mod book;
mod build;
mod check;
mod checks;
mod command_line;
mod controls;
mod data;
mod emulated;
mod files;
mod flash;
mod flash_kilobot;
mod flood;
mod grade;
mod guide;
mod import;
mod interrupt;
mod launch;
mod new;
mod object;
mod own_robot;
mod plot;
mod probe;
mod run;
mod sim;
mod sim_runs;
mod sim_view;
mod stubs;
mod support;
mod sweep;
mod trace;
mod trace_view;
mod unfinished;
