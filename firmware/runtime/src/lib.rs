//! What every embassy robot does the same way: run the script at 10 Hz in short slices, carry its messages to and from the
//! link, know where it sees others ([`pose`]), stop the motors when the script no longer completes steps, and feed the
//! watchdog only while every task lives.
//!
//! # Principles
//! 1. **The script never delays the robot.** It runs in slices of at most [`script::SLICE_MAX`] and yields between them; a
//!    step that never ends delays neither radio nor motors.
//! 2. **Nothing moves for longer than it was asked to.** A set-point holds for [`setpoint::HOLD`]; each completed step
//!    renews it, else the motors stop.
//! 3. **No robot stops silently.** Faults, refused images, missed ticks and expired set-points become records
//!    ([`bittybuzz_comms::trace`]) that the board passes to people.
//! 4. **A flood harms nobody.** What is heard and what is to be sent waits in queues of fixed size, [`mail`]; what there is
//!    no room for is counted.
//! 5. **Boards stay thin.** A board supplies [`script::RobotHost`] and [`setpoint::Motors`] and wires the tasks; this crate knows no
//!    chip and is tested on the host.
//!
//! # What it will not do
//! Drivers, radio links and defmt: those are the boards'.

#![no_std]
#![forbid(unsafe_code)]

pub mod battery;
pub mod blink;
pub mod call;
pub mod id;
pub mod liveness;
pub mod losses;
pub mod mail;
pub mod places;
pub mod pose;
pub mod script;
pub mod section;
pub mod setpoint;
