//! The link to the nRF51822: syslink on USART6 at 1 Mbaud.
//!
//! The Crazyflie has two processors. The nRF51 owns the radio, the power switch and the charger;
//! the STM32 reaches all of them by frames over one serial line. If the link stalls, the robot
//! receives no messages, does not know its battery and cannot switch off. The link must therefore
//! work whatever the script does.
//!
//! # Layers
//! * [`uart`] moves bytes between the pins and two rings, in an interrupt above all critical
//!   sections: a byte arrives every 10 µs, and the chip has room for one.
//! * [`receive`] turns the bytes into frames and handles them: battery, shutdown, packets of other
//!   robots.
//! * [`send`] writes frames, one at a time. The nRF51 has flow control for its UART but not for the
//!   queue after it, so the task waits until the nRF51 has read the previous frame.
//! * [`swarm`] carries the script's messages over P2P broadcasts.
//! * [`station`] executes the packets of a ground station, and [`log_values`] has what it logs.
//! * [`one_wire`] exchanges requests and answers about the memories of decks.
//! * [`setup`] sets the radio up, and repeats this when the nRF51 has restarted and lost its
//!   settings.
//!
//! No function here waits for a reader. A packet that finds no room is dropped and counted, and a
//! damaged frame is skipped up to the next start.

mod log_values;
pub mod one_wire;
pub mod receive;
pub mod send;
mod setup;
pub mod station;
pub mod swarm;
pub mod uart;

use core::sync::atomic::{AtomicBool, AtomicI16, AtomicU16, AtomicU32, Ordering};

use bittybuzz_flight::ekf::{PoseMeasurement, PositionMeasurement};
use bittybuzz_runtime::pose::LatestPose;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;

/// The state of the link, which other tasks read.
pub struct LinkState {
    /// The battery's voltage in mV; 0 until the nRF51 reported it.
    battery_mv: AtomicU16,
    /// True while USB supplies power.
    usb_powered: AtomicBool,
    /// The signal strength of the last radio packet in dBm; 0 until one was received.
    rssi: AtomicI16,
    /// The number of frames with a correct checksum.
    received: AtomicU32,
    /// The number of false starts: frames with a wrong checksum or length.
    rejected: AtomicU32,
    /// The number of P2P frames of other robots.
    heard: AtomicU32,
    /// The number of P2P frames on the port of swarm messages that were no swarm messages.
    unknown: AtomicU32,
    /// The number of P2P frames of robots with this one's id.
    same_id: AtomicU32,
    /// The number of frames that could not be sent in time.
    dropped: AtomicU32,
    /// True while frames to other robots may be sent.
    can_send: AtomicBool,
}

/// The robot's pose from a positioning system, sent by the ground station: as it came, or the estimate
/// after a position without attitude.
pub static POSE: LatestPose = LatestPose::new();

/// A measured place of the robot, for the flight controller.
pub enum FlightPose {
    Pose(PoseMeasurement),
    Position(PositionMeasurement),
}

/// The latest pose for the flight controller, which takes each pose once.
pub static FLIGHT_POSE: Signal<CriticalSectionRawMutex, FlightPose> = Signal::new();

/// The state of the only link.
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

/// The periodic report about the link: the signal strength in dBm, the counts of [`LinkState`], and
/// the number of swarm messages that were received while an equal one waited.
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
    /// Returns the battery's voltage in mV, once it is known.
    pub fn battery_mv(&self) -> Option<u16> {
        Some(self.battery_mv.load(Ordering::Relaxed)).filter(|mv| *mv > 0)
    }

    /// Returns true if USB powers the robot, so that its battery is charged or full.
    pub fn is_usb_powered(&self) -> bool {
        self.usb_powered.load(Ordering::Relaxed)
    }

    /// Returns the signal strength of the last radio packet in dBm.
    fn rssi(&self) -> i16 {
        self.rssi.load(Ordering::Relaxed)
    }

    /// Returns the number of frames with a correct checksum.
    fn received(&self) -> u32 {
        self.received.load(Ordering::Relaxed)
    }

    /// Returns the number of P2P frames of other robots.
    fn heard(&self) -> u32 {
        self.heard.load(Ordering::Relaxed)
    }

    /// Returns true if frames to other robots may be sent.
    pub fn can_send(&self) -> bool {
        self.can_send.load(Ordering::Relaxed)
    }

    fn set_can_send(&self, can_send: bool) {
        self.can_send.store(can_send, Ordering::Relaxed);
    }

    /// Returns all counts since the start.
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
