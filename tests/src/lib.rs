//! Common code of the end-to-end tests: runs `bbz`, reads the expectations in the comments of scripts, and
//! prints the differences.
//!
//! The tests themselves are Buzz scripts; README.md of this crate explains how to write one. The files
//! under `tests/tests` only collect scripts and hand them to this crate:
//!
//! * `language`: every script of `bzz/`, with expectations in its comments ([`script`]);
//! * `conformance`: the scripts of `conformance/`, each with an `.expect` file ([`conformance`]);
//! * `compatibility`: the differences from Buzz, recorded on both ([`compatibility`]);
//! * `malformed`: bad scripts, images and command lines from `malformed/` ([`malformed`]);
//! * `examples`: the behaviors that are shipped in `examples/` ([`example`]).
//!
//! All of them go through the built command line tool ([`bbz`]), as a user does. A test never stops at the
//! first bad script: all failures are reported together.
//!
//! Others run compiler and virtual machine in this process (`compiler`, `machine`), because they need to reach
//! into the machine or run it a million times:
//!
//! * `random_programs`: programs that [`generator`] makes up, run in every way there is (`torture`);
//! * `shared_language`: programs of [`shared_language`], with results recorded from Buzz;
//! * `arguments`: functions and operators with [`arguments`] of every type, beside recorded results of Buzz;
//! * `torture`: all scripts, in those same ways;
//! * `swarm`: several robots that run a script together (`bittybuzz_testkit::Swarm`);
//! * `memory`: structures and garbage that fill the memory.

pub mod arguments;
pub mod bbz;
pub mod buzz;
pub mod compatibility;
#[cfg(feature = "in-process")]
pub mod compiler;
pub mod conformance;
pub mod diagnostics;
pub mod diff;
pub mod example;
pub mod files;
pub mod generator;
#[cfg(feature = "in-process")]
pub mod here;
#[cfg(feature = "in-process")]
pub mod machine;
pub mod malformed;
pub mod report;
pub mod script;
pub mod shared_language;
#[cfg(feature = "in-process")]
pub mod torture;
