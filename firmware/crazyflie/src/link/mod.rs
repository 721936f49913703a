//! The link to the nRF51822: syslink on USART6 at 1 Mbaud.
//!
//! The Crazyflie has two processors. The nRF51 owns the radio, the power switch and the charger;
//! this one reaches all of them by frames over one serial line. If the link stalls, the robot
//! hears nobody, does not know its battery and cannot switch off, so the link must work whatever
//! the script does.
//!
//! # Layers
//! * [`uart`] moves bytes between the pins and two rings, in an interrupt above all critical
//!   sections: a byte arrives every 10 µs, and the chip has room for one.
//! * [`receive`] makes frames of the bytes and handles them: battery, shutdown, packets of other
//!   robots.
//! * [`send`] writes frames, one at a time. The nRF51 has flow control for its UART but not for
//!   the queue after it, so the task waits until the frame before has been read.
//! * [`swarm`] carries the script's messages over P2P broadcasts.
//! * [`setup`] sets the radio up, and does so again when the nRF51 has restarted and forgotten
//!   it.
//!
//! Nothing here waits for a reader: a packet that finds no room is dropped and counted, and a
//! damaged frame is skipped up to the next start.

pub mod receive;
pub mod send;
mod setup;
pub mod swarm;
pub mod uart;

use core::sync::atomic::{AtomicBool, AtomicI16, AtomicU16, AtomicU32, Ordering};

use bittybuzz_runtime::pose::LatestPose;

/// Numbers of the link that others read.
pub struct LinkState {
    /// The battery's voltage in mV; 0 until the nRF51 has sent it.
    battery_mv: AtomicU16,
    /// There is power on USB.
    usb_powered: AtomicBool,
    /// Strength of the last radio packet in dBm; 0 until one was heard.
    rssi: AtomicI16,
    /// Frames with a right checksum.
    received: AtomicU32,
    /// False starts: frames with a wrong checksum or length.
    rejected: AtomicU32,
    /// P2P frames of other robots.
    heard: AtomicU32,
    /// The number of these on the port of swarm messages that are no swarm messages.
    unknown: AtomicU32,
    /// P2P frames of robots with this one's id.
    same_id: AtomicU32,
    /// Frames that could not be sent in time.
    dropped: AtomicU32,
    /// Frames to other robots may be sent.
    can_send: AtomicBool,
}

/// The robot's pose from a positioning system, sent by the ground station.
pub static POSE: LatestPose = LatestPose::new();

/// There is one link.
pub static STATE: LinkState = LinkState {
    battery_mv: AtomicU16::new(0),
    usb_powered: AtomicBool::new(false),
    rssi: AtomicI16::new(0),
    received: AtomicU32::new(0),
    rejected: AtomicU32::new(0),
    heard: AtomicU32::new(0),
    unknown: AtomicU32::new(0),
    same_id: AtomicU32::new(0),
    dropped: AtomicU32::new(0),
    can_send: AtomicBool::new(false),
};

/// The periodic report about the link: signal strength in dBm, what [`LinkState`] counts, and swarm
/// messages that were
/// heard while the same one waited.
#[derive(Clone, Copy, Debug, PartialEq, Eq, defmt::Format)]
pub struct Counts {
    rssi: i16,
    received: u32,
    rejected: u32,
    overrun: u32,
    heard: u32,
    unknown: u32,
    same_id: u32,
    doubles: u16,
    dropped: u32,
}

impl LinkState {
    /// The battery's voltage in mV, once it is known.
    pub fn battery_mv(&self) -> Option<u16> {
        Some(self.battery_mv.load(Ordering::Relaxed)).filter(|mv| *mv > 0)
    }

    /// Returns true if USB powers the robot, so that its battery is charged or full.
    pub fn is_usb_powered(&self) -> bool {
        self.usb_powered.load(Ordering::Relaxed)
    }

    /// Returns true if frames to other robots may be sent.
    fn can_send(&self) -> bool {
        self.can_send.load(Ordering::Relaxed)
    }

    fn set_can_send(&self, can_send: bool) {
        self.can_send.store(can_send, Ordering::Relaxed);
    }

    /// Everything that is counted, since the start.
    pub fn counts(&self) -> Counts {
        Counts {
            rssi: self.rssi.load(Ordering::Relaxed),
            received: self.received.load(Ordering::Relaxed),
            rejected: self.rejected.load(Ordering::Relaxed),
            overrun: uart::overruns(),
            heard: self.heard.load(Ordering::Relaxed),
            unknown: self.unknown.load(Ordering::Relaxed),
            same_id: self.same_id.load(Ordering::Relaxed),
            doubles: swarm::MAIL.unread().duplicates,
            dropped: self.dropped.load(Ordering::Relaxed),
        }
    }
}
