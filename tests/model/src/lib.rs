//! The stigmergy's protocol, explored state by state: three robots that put, delete and forget, and a network that loses,
//! doubles and reorders.
//!
//! The robots are no model: each transition is made by the virtual machine, which is given what the robot knows and what
//! happens, runs a step, and is asked what it knows then ([`replica`]). What is explored is every order of events ([`world`]).
//!
//! The supervisor of a flight is explored in the same way ([`supervisor`]).

pub mod history;
pub mod replica;
pub mod supervisor;
pub mod world;
