//! The protocol between robots: what they send, and what they make of what arrives. One binary, which is built for each of
//! the small mistakes of `cargo xtask soak protocol`.

mod absence;
mod classes;
mod conflicts;
mod containment;
mod endurance;
mod floors;
mod frames;
mod functions;
mod large;
mod merging;
mod numbers;
mod rules;
mod stigmergy;
