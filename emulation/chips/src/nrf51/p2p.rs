//! Frames from robot to robot.

use super::LinkFrame;

/// Most data bytes of a P2P frame.
pub const P2P_MAX: usize = 60;

/// The type of the frame that carries one to the STM32.
const P2P_BROADCAST: u8 = 0x0a;

/// A frame of another robot, as this robot's radio receives it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct P2pFrame {
    port: u8,
    rssi: u8,
    data: Vec<u8>,
}

impl P2pFrame {
    /// To `port`, 0 to 15, heard with `rssi` in -dBm; none if `data` is longer than [`P2P_MAX`].
    pub fn new(port: u8, rssi: u8, data: impl Into<Vec<u8>>) -> Option<P2pFrame> {
        let data = data.into();
        (data.len() <= P2P_MAX).then_some(P2pFrame { port: port & 0x0f, rssi, data })
    }

    /// Returns the frame for the STM32.
    pub(super) fn received(&self) -> LinkFrame {
        let payload = [&[self.port, self.rssi], self.data.as_slice()].concat();
        LinkFrame { kind: P2P_BROADCAST, payload }
    }
}
