//! `[body.*]`: how the robots of a kind move, where that is different from the physical model.

use std::ops::RangeInclusive;

use bittybuzz_emulation::message::PowerDetector;
use bittybuzz_robot_spec::Robot;
use bittybuzz_toml_reader::TomlError;

use crate::robots::kilobot::Preset;

use super::keys;
use super::medium::Medium;
use super::read::Section;

/// What moves a robot.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Body {
    /// Vibration motors on stiff legs.
    Kilobot,
    /// Two wheels.
    Zooid,
    /// Four propellers.
    Crazyflie,
}

/// What differs from the models, for each kind of robot.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Bodies {
    /// Of the Kilobots.
    pub kilobot: KilobotBody,
    /// Of the Zooids.
    pub zooid: ZooidBody,
    /// Of the Crazyflies.
    pub crazyflie: CrazyflieBody,
}

/// What differs from the model of the Kilobots.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct KilobotBody {
    /// Whose numbers; bodies and infrared.
    pub preset: Preset,
    /// mm
    pub radius: Option<f64>,
    /// mm/s
    pub speed: Option<f64>,
    /// Degrees per second.
    pub turn: Option<f64>,
    /// Standard deviation of each motor's gain, as a share of it.
    pub gain_error: Option<f64>,
}

/// What differs from the model of the Zooids.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ZooidBody {
    /// mm
    pub radius: Option<f64>,
    /// Of a wheel at full duty, in mm/s.
    pub speed: Option<f64>,
    /// Standard deviation of each motor's gain, as a share of it.
    pub gain_error: Option<f64>,
    /// Share of the projector's frames that its firmware does not see.
    pub frame_loss: Option<f64>,
    /// Up to so many µs edges of the projector's light come too early or too late for its firmware.
    pub edge_jitter: Option<f64>,
    /// Glitches per second at each photodiode of its firmware.
    pub glitches: Option<f64>,
    /// Reading of the register RPD of its firmware's radio.
    pub power_detector: Option<PowerDetector>,
}

/// What differs from the model of the Crazyflies.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct CrazyflieBody {
    /// mm
    pub radius: Option<f64>,
    /// Fastest, in mm/s.
    pub speed: Option<f64>,
    /// Largest, in mm/s².
    pub acceleration: Option<f64>,
    /// Time constant with which velocities are reached, in seconds.
    pub lag: Option<f64>,
    /// How it knows where it is.
    pub positioning: Option<Positioning>,
}

/// How a Crazyflie knows where it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Positioning {
    /// Not at all.
    None,
    /// By the Flow deck, whose errors add up.
    Flow,
    /// By radio, to some 10 cm.
    Loco,
    /// By light, to some cm.
    Lighthouse,
}

const BODIES: [(&str, Body); 3] =
    [("kilobot", Body::Kilobot), ("zooid", Body::Zooid), ("crazyflie", Body::Crazyflie)];

const PRESETS: [(&str, Preset); 4] = [
    ("standard", Preset::Standard),
    ("kilombo", Preset::Kilombo),
    ("argos", Preset::Argos),
    ("kilosim", Preset::Kilosim),
];

const POSITIONINGS: [(&str, Positioning); 4] = [
    ("none", Positioning::None),
    ("flow", Positioning::Flow),
    ("loco", Positioning::Loco),
    ("lighthouse", Positioning::Lighthouse),
];

const POWER_DETECTORS: [(&str, PowerDetector); 2] =
    [("latched", PowerDetector::Latched), ("live", PowerDetector::Live)];

impl Body {
    /// What carries the frames of a robot with this body.
    pub fn medium(self) -> Medium {
        match self {
            Body::Kilobot => Medium::Ir,
            Body::Zooid => Medium::Nrf24,
            Body::Crazyflie => Medium::P2p,
        }
    }
}

/// The body of a group: that of a robot that ships, or the one that the group names.
pub fn of_group(section: &Section<'_>, robot: &Robot) -> Option<Body> {
    if section.get("body").is_some() {
        return section.word("body", &BODIES);
    }
    let body = match robot.name.as_str() {
        "kilobot" => Some(Body::Kilobot),
        "zooids" => Some(Body::Zooid),
        "crazyflie" => Some(Body::Crazyflie),
        _ => None,
    };
    if body.is_none() {
        section.fail(TomlError::MissingKey { key: "body", section: section.name });
    }
    body
}

pub fn read(root: &Section<'_>) -> Bodies {
    let Some(section) = root.section("body", keys::BODY) else { return Bodies::default() };
    Bodies {
        kilobot: section.section("kilobot", keys::KILOBOT).map_or_else(Default::default, kilobot),
        zooid: section.section("zooid", keys::ZOOID).map_or_else(Default::default, zooid),
        crazyflie: section
            .section("crazyflie", keys::CRAZYFLIE)
            .map_or_else(Default::default, crazyflie),
    }
}

/// How the robots of a group differ from others with that body.
pub fn model(group: &Section<'_>, body: Body) -> Bodies {
    let name = match body {
        Body::Kilobot => keys::KILOBOT_MODEL,
        Body::Zooid => keys::ZOOID_MODEL,
        Body::Crazyflie => keys::CRAZYFLIE_MODEL,
    };
    let mut bodies = Bodies::default();
    if let Some(section) = group.section("model", name) {
        match body {
            Body::Kilobot => bodies.kilobot = kilobot(section),
            Body::Zooid => bodies.zooid = zooid(section),
            Body::Crazyflie => bodies.crazyflie = crazyflie(section),
        }
    }
    bodies
}

const RADIUS: RangeInclusive<f64> = 1.0..=10_000.0;
const GAIN_ERROR: RangeInclusive<f64> = 0.0..=1.0;

fn kilobot(section: Section<'_>) -> KilobotBody {
    KilobotBody {
        preset: section.word("preset", &PRESETS).unwrap_or_default(),
        radius: section.number("radius", RADIUS),
        speed: section.number("speed", 0.0..=10_000.0),
        turn: section.number("turn", 0.0..=5000.0),
        gain_error: section.number("gain_error", GAIN_ERROR),
    }
}

fn zooid(section: Section<'_>) -> ZooidBody {
    ZooidBody {
        radius: section.number("radius", RADIUS),
        speed: section.number("speed", 0.0..=10_000.0),
        gain_error: section.number("gain_error", GAIN_ERROR),
        frame_loss: section.number("frame_loss", 0.0..=1.0),
        edge_jitter: section.number("edge_jitter", 0.0..=300.0),
        glitches: section.number("glitches", 0.0..=10_000.0),
        power_detector: section.word("power_detector", &POWER_DETECTORS),
    }
}

fn crazyflie(section: Section<'_>) -> CrazyflieBody {
    CrazyflieBody {
        radius: section.number("radius", RADIUS),
        speed: section.number("speed", 0.0..=100_000.0),
        acceleration: section.number("acceleration", 1.0..=1e6),
        lag: section.number("lag", 0.0..=10.0),
        positioning: section.word("positioning", &POSITIONINGS),
    }
}
