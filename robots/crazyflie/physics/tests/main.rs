//! The tests of this crate, as one program, so that they are linked once.

#![allow(clippy::unwrap_used, reason = "a failure here fails the test")]

mod disturbances;
mod faults;
mod flight;
mod flight_closed_loop;
mod fresh;
mod ground;
mod held;
mod labels;
mod load;
mod set_points;
