//! The robots that ship: their bodies.

pub mod crazyflie;
pub mod kilobot;
pub mod zooid;
