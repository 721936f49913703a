//! The Crazyflie's other processor, seen from the STM32: power management and radio behind a serial link.
//!
//! Written anew from the protocol's description and not with the crate that the firmware uses, so that a
//! misunderstanding shared by sender and receiver does not stay hidden.

mod crtp;
mod link;
mod p2p;
mod peer;
mod radio;
mod syslink;

pub use crtp::Pose;
pub use link::Link;
pub use p2p::{P2P_MAX, P2pFrame};

pub use peer::{BAUD, Nrf51, Nrf51Settings, Output};
pub use radio::RadioCounts;
pub use syslink::{LinkFrame, MAX_PAYLOAD};

/// The measurements of the power management.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Battery {
    /// Voltage of the cell.
    pub volts: f32,
    /// Charging at this moment.
    pub charging: bool,
    /// Powered through USB.
    pub usb_powered: bool,
}

impl Default for Battery {
    /// Half full, in flight.
    fn default() -> Self {
        Battery { volts: 3.8, charging: false, usb_powered: false }
    }
}
