//! The tests of this crate, as one program, so that they are linked once.

#![allow(clippy::unwrap_used, reason = "a failure here fails the test")]

mod backends;
mod barriers;
mod battery;
mod behaviors;
mod board;
mod brown_out;
mod cable;
mod conformance;
mod debugger;
mod ear;
mod failures;
mod figures;
mod flight;
mod forged;
mod kilobot_board;
mod kilobot_brown_out;
mod kilobot_faults;
mod kilobot_light;
mod kilobot_load;
mod kilobot_slices;
mod kilobots;
mod link;
mod mixed_swarm;
mod nrf51;
mod radio_flash;
mod replay;
mod resets;
mod restarts;
mod script;
mod sensors;
mod slices;
mod squeezed;
mod swarm;
mod zooid_battery;
mod zooid_brown_out;
mod zooid_costs;
mod zooid_failures;
mod zooid_power;
mod zooid_script;
mod zooid_settings;
mod zooid_touch;
mod zooids;
