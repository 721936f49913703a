//! Frames from robot to robot.

use super::LinkFrame;

/// The largest number of data bytes in a P2P frame.
pub const P2P_MAX: usize = 60;

/// Type of the link frame that carries a P2P frame to the STM32.
const P2P_BROADCAST: u8 = 0x0a;

/// A frame of another robot, as this robot's radio receives it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct P2pFrame {
    port: u8,
    rssi: u8,
    data: Vec<u8>,
}

impl P2pFrame {
    /// Creates a frame to `port`, 0 to 15, received with a signal strength of `rssi` in -dBm.
    /// Returns none if `data` is longer than [`P2P_MAX`].
    pub fn new(port: u8, rssi: u8, data: impl Into<Vec<u8>>) -> Option<P2pFrame> {
        let data = data.into();
        (data.len() <= P2P_MAX).then_some(P2pFrame { port: port & 0x0f, rssi, data })
    }

    /// Returns the link frame for the STM32.
    pub(super) fn received(&self) -> LinkFrame {
        let payload = [&[self.port, self.rssi], self.data.as_slice()].concat();
        LinkFrame { kind: P2P_BROADCAST, payload }
    }
}
