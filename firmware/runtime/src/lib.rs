//! The parts of the firmware that all embassy robots share: run the script at 10 Hz in short
//! slices, exchange its messages with the link, locate other robots ([`pose`]), stop the motors
//! when the script no longer completes steps, and feed the watchdog only while every task lives.
//!
//! # Principles
//! 1. **The script never delays the robot.** It runs in slices of at most [`script::SLICE_MAX`] and yields between them; a
//!    step that never ends delays neither radio nor motors.
//! 2. **A movement ends with its set-point.** A set-point holds for [`setpoint::HOLD`], and each
//!    completed step renews it. Without renewal the motors stop.
//! 3. **No robot stops silently.** Faults, refused images, missed ticks and expired set-points
//!    become records ([`bittybuzz_comms::trace`]), which the board reports.
//! 4. **A flood of messages does no harm.** Received frames and frames to be sent wait in queues of
//!    fixed size ([`mail`]). Frames that find no room are counted.
//! 5. **Boards stay thin.** A board supplies [`script::RobotHost`] and [`setpoint::MotorDriver`] and
//!    wires the tasks. This crate depends on no chip and is tested on the host.
//!
//! # Not included
//! Drivers, radio links and defmt belong to the boards.

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
