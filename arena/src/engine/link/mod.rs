//! Links: the exchange of frames between robots.

mod air;
mod calibration;
mod delivery;
mod edge;
mod frame_log;
mod infrared;
mod packet;
mod radio;
mod receive;
mod schedule;
mod topology;

use super::error::SettingsError;
use super::settings::{first_wrong, not_below_0, within};

pub(crate) use air::{Near, Transmissions};
pub use bittybuzz_robot_spec::Medium;
pub(crate) use calibration::Calibration;
pub(crate) use delivery::{DeliveredFrame, Late};
pub use frame_log::{Arrival, Fate, FrameLog, LossCause, SendAttempt, SentFrame};
pub use infrared::{Infrared, InfraredPreset};
pub use packet::FrameSighting;
pub(crate) use packet::{Packet, Transmission};
pub(crate) use radio::{RobotRadio, UNIT_US};
pub(crate) use receive::{Ether, Listener};
pub(crate) use schedule::{Attempt, Schedule, Senders, Window};
pub(crate) use topology::{Barriers, Topology};

/// Probability that a frame is lost on the way, in addition to collisions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Loss {
    /// Probability between robots that touch, 0 to 1.
    pub near: f32,
    /// Probability at the end of the range. The loss grows with the square of the distance.
    pub far: f32,
}

impl Loss {
    /// Returns a loss that is the same at any distance.
    #[must_use]
    pub fn even(probability: f32) -> Self {
        Loss { near: probability, far: probability }
    }
}

/// The parameters that all media have in common.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinkSettings {
    /// The range in mm: between the rims of two robots for infrared, between their middles for
    /// radio; `None` is unlimited.
    pub range: Option<f32>,
    /// Half of the width of the range's edge, mm: reception falls from 90 % to a half of its level
    /// over this distance before the end of the range, and to 10 % over the same distance after it.
    /// 0 is a sharp end.
    pub edge: f32,
    pub loss: Loss,
    /// For tests: probability that a frame arrives twice.
    pub duplicate: f32,
    /// For tests: probability that a frame is held back up to half a second while later ones pass.
    pub reorder: f32,
}

/// nRF24 radio of the Zooids: broadcast with carrier sense and random back-off.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Nrf24Medium {
    pub link: LinkSettings,
    /// Longest random wait before a frame, and after a busy channel, µs.
    pub backoff_us: u32,
}

impl Nrf24Medium {
    /// All Zooids on a table receive each other. The loss is a choice: no source that was read gives
    /// one for Zooids.
    pub const STANDARD: Self = Nrf24Medium {
        link: LinkSettings {
            range: None,
            edge: 0.0,
            loss: Loss { near: 0.01, far: 0.02 },
            duplicate: 0.0,
            reorder: 0.0,
        },
        backoff_us: 2000,
    };
}

/// Peer-to-peer broadcast of the Crazyflies: no carrier sense, and no reception while sending.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct P2p {
    pub link: LinkSettings,
    /// Shortest and longest random pause before each frame, µs.
    pub pause_us: [u32; 2],
}

impl P2p {
    /// All Crazyflies in a room receive each other. The loss is a choice: no source that was read
    /// gives one for P2P. The pauses are those of the firmware (firmware/runtime/src/mail.rs).
    pub const STANDARD: Self = P2p {
        link: LinkSettings {
            range: None,
            edge: 0.0,
            loss: Loss { near: 0.01, far: 0.05 },
            duplicate: 0.0,
            reorder: 0.0,
        },
        pause_us: [2_000, 18_000],
    };
}

/// Link of described robots: broadcast with carrier sense and random back-off. The receiver
/// measures the direction from which a frame came.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RangeAndBearing {
    pub link: LinkSettings,
    /// Longest random wait before a frame, and after a busy channel, µs.
    pub backoff_us: u32,
    /// Standard deviation of the measured distance, mm.
    pub distance_sigma: f32,
    /// Standard deviation of the measured direction, radians.
    pub bearing_sigma: f32,
}

impl RangeAndBearing {
    /// A link without reach, loss or noise, which come from the robot file. The back-off is that of
    /// the nRF24.
    pub const STANDARD: Self = RangeAndBearing {
        link: LinkSettings {
            range: Some(0.0),
            edge: 0.0,
            loss: Loss { near: 0.0, far: 0.0 },
            duplicate: 0.0,
            reorder: 0.0,
        },
        backoff_us: Nrf24Medium::STANDARD.backoff_us,
        distance_sigma: 0.0,
        bearing_sigma: 0.0,
    };
}

/// The parameters of every medium for one herd.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Media {
    /// Infrared light.
    pub infrared: Infrared,
    /// nRF24 radio.
    pub nrf24: Nrf24Medium,
    /// Peer-to-peer broadcast.
    pub p2p: P2p,
    /// Link of described robots.
    pub range_and_bearing: RangeAndBearing,
}

/// Paths of the fields of a link, per medium, for error messages.
const LINKS: [[&str; 6]; Medium::COUNT] = [
    [
        "infrared.link.range",
        "infrared.link.edge",
        "infrared.link.loss.near",
        "infrared.link.loss.far",
        "infrared.link.duplicate",
        "infrared.link.reorder",
    ],
    [
        "nrf24.link.range",
        "nrf24.link.edge",
        "nrf24.link.loss.near",
        "nrf24.link.loss.far",
        "nrf24.link.duplicate",
        "nrf24.link.reorder",
    ],
    [
        "p2p.link.range",
        "p2p.link.edge",
        "p2p.link.loss.near",
        "p2p.link.loss.far",
        "p2p.link.duplicate",
        "p2p.link.reorder",
    ],
    [
        "range_and_bearing.link.range",
        "range_and_bearing.link.edge",
        "range_and_bearing.link.loss.near",
        "range_and_bearing.link.loss.far",
        "range_and_bearing.link.duplicate",
        "range_and_bearing.link.reorder",
    ],
];

impl Media {
    /// The parameters of the real links.
    pub const STANDARD: Self = Media {
        infrared: Infrared::STANDARD,
        nrf24: Nrf24Medium::STANDARD,
        p2p: P2p::STANDARD,
        range_and_bearing: RangeAndBearing::STANDARD,
    };

    /// Returns the common parameters of a medium.
    #[must_use]
    pub fn link(&self, medium: Medium) -> &LinkSettings {
        match medium {
            Medium::Infrared => &self.infrared.link,
            Medium::Nrf24 => &self.nrf24.link,
            Medium::P2p => &self.p2p.link,
            Medium::RangeAndBearing => &self.range_and_bearing.link,
        }
    }

    /// Returns the common parameters of a medium for changes.
    pub fn link_mut(&mut self, medium: Medium) -> &mut LinkSettings {
        match medium {
            Medium::Infrared => &mut self.infrared.link,
            Medium::Nrf24 => &mut self.nrf24.link,
            Medium::P2p => &mut self.p2p.link,
            Medium::RangeAndBearing => &mut self.range_and_bearing.link,
        }
    }

    /// Fails if a parameter is not valid for a link.
    pub fn check(&self) -> Result<(), SettingsError> {
        let Media { infrared, nrf24, p2p, range_and_bearing } = self;
        let [least, most] = p2p.pause_us;
        first_wrong(&[
            ("infrared.clock_sigma", within(infrared.clock_sigma, 0.0, 0.1), "0 to 0.1"),
            ("infrared.distance_sigma", not_below_0(infrared.distance_sigma), "0 or more"),
            ("nrf24.backoff_us", (1..=100_000).contains(&nrf24.backoff_us), "1 to 100000"),
            ("p2p.pause_us", least <= most && most <= 100_000, "0 to 100000, the less first"),
            (
                "range_and_bearing.backoff_us",
                (1..=100_000).contains(&range_and_bearing.backoff_us),
                "1 to 100000",
            ),
            (
                "range_and_bearing.distance_sigma",
                not_below_0(range_and_bearing.distance_sigma),
                "0 or more",
            ),
            (
                "range_and_bearing.bearing_sigma",
                not_below_0(range_and_bearing.bearing_sigma),
                "0 or more",
            ),
        ])?;
        Medium::ALL.into_iter().try_for_each(|medium| {
            let LinkSettings { range, edge, loss, duplicate, reorder } = self.link(medium);
            let [of_range, of_edge, names @ ..] = LINKS[medium as usize];
            let is_distance = range.is_none_or(|range| within(range, 0.0, 1e6));
            let must = "a distance from 0 to 1e6";
            first_wrong(&[
                (of_range, is_distance, must),
                (of_edge, within(*edge, 0.0, 1e6), must),
            ])?;
            let shares = [loss.near, loss.far, *duplicate, *reorder];
            let checks = names.into_iter().zip(shares);
            let must = "a probability from 0 to 1";
            checks
                .into_iter()
                .try_for_each(|(name, share)| first_wrong(&[(name, within(share, 0.0, 1.0), must)]))
        })
    }
}
