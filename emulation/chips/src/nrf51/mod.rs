//! The Crazyflie's second processor as the STM32 sees it: power management and radio, connected by
//! a serial link.
//!
//! This model was written from the description of the protocol, without the crate that the firmware
//! uses. A misunderstanding shared by sender and receiver would otherwise stay hidden.

mod crtp;
mod link;
mod p2p;
mod peer;
mod radio;
mod syslink;

pub use crtp::ExternalPose;
pub use link::LineQuality;
pub use p2p::{P2P_MAX, P2pFrame};

pub use peer::{BAUD, BYTE_TIME_MIN, Nrf51, Nrf51Settings, P2P_COMMAND_TIME_MIN, PeerAction};
pub use radio::RadioCounts;
pub use syslink::{FRAME_PAYLOAD_MAX, LinkFrame};

/// The measurements of the power management.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Battery {
    /// Voltage of the cell.
    pub volts: f32,
    /// True while the battery is charging.
    pub charging: bool,
    /// True while the robot is powered through USB.
    pub usb_powered: bool,
}

impl Default for Battery {
    /// Returns the state of a half full battery in flight.
    fn default() -> Self {
        Battery { volts: 3.8, charging: false, usb_powered: false }
    }
}
