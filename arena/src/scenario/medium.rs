//! `[medium.*]`: the loss, range and rate of the frames that robots send each other.

use toml::de::DeValue;

use crate::engine::{InfraredPreset, Medium};

use super::error::ScenarioCause;
use super::keys::{IR, NRF24, P2P, RAB};
use super::read::{Entry, Section};

/// The settings of a medium. A field that is `None` follows the physical model of the medium.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct MediumSettings {
    /// The experiment from which range, edge and loss come; infrared only.
    pub preset: Option<InfraredPreset>,
    /// The largest distance in mm at which a frame is received: from rim to rim for infrared, from
    /// middle to middle for radio. With an edge, half of the frames are received there.
    pub range: Option<f64>,
    /// Half of the width of the range's edge in mm; infrared only.
    pub edge: Option<f64>,
    /// The share of frames that are lost.
    pub loss: Option<LossSetting>,
    /// The share of frames that arrive twice.
    pub duplication: Option<f64>,
    /// The share of frames that arrive up to half a second late.
    pub reordering: Option<f64>,
    /// The number of frames per second that a robot can send; infrared only.
    pub rate: Option<f64>,
    /// Standard deviation of measured distances in mm; infrared only.
    pub distance_error: Option<f64>,
    /// Standard deviation of the robots' oscillators in percent; infrared only.
    pub clock_error: Option<f64>,
}

/// The share of frames that are lost on a link, in addition to collisions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LossSetting {
    /// For robots that touch.
    pub near: f64,
    /// For robots as far apart as the medium reaches.
    pub far: f64,
}

impl LossSetting {
    /// Reports a loss that depends on the distance, which an emulator does not model.
    pub(super) fn check_emulated(self, entry: &Entry<'_>) {
        if self.near != self.far {
            entry.fail(ScenarioCause::NotEmulated { key: "loss = [near, far]" });
        }
    }
}

/// The settings of every medium.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct MediaSettings {
    /// Infrared light.
    pub ir: MediumSettings,
    /// nRF24L01+ radio.
    pub nrf24: MediumSettings,
    /// Peer-to-peer packets.
    pub p2p: MediumSettings,
    /// Range and bearing.
    pub rab: MediumSettings,
}

impl MediaSettings {
    /// Returns the settings of a medium.
    pub fn settings(&self, medium: Medium) -> &MediumSettings {
        match medium {
            Medium::Infrared => &self.ir,
            Medium::Nrf24 => &self.nrf24,
            Medium::P2p => &self.p2p,
            Medium::RangeAndBearing => &self.rab,
        }
    }
}

/// Keys of effects that emulators do not have.
const NOT_EMULATED: [&str; 2] = ["duplication", "reordering"];

/// Reads the media of the file. `used` are those of all robots, and `emulated` those that carry
/// packets between emulated robots.
pub fn read(root: &Section<'_>, used: &[Medium], emulated: &[Medium]) -> MediaSettings {
    let mut media = MediaSettings::default();
    let Some(section) = root.section("medium", super::keys::MEDIUM) else { return media };
    for (medium, name) in [
        (Medium::Infrared, IR),
        (Medium::Nrf24, NRF24),
        (Medium::P2p, P2P),
        (Medium::RangeAndBearing, RAB),
    ] {
        let key = medium.word();
        let Some(settings) = section.section(key, name) else { continue };
        if !used.contains(&medium) && !used.is_empty() {
            settings.fail(ScenarioCause::NoSuchMedium { medium: key });
        }
        for key in NOT_EMULATED.into_iter().filter(|_| emulated.contains(&medium)) {
            if let Some(entry) = settings.get(key) {
                entry.fail(ScenarioCause::NotEmulated { key });
            }
        }
        let section = settings;
        let settings = read_one(&section);
        if emulated.contains(&medium)
            && medium != Medium::Infrared
            && let (Some(loss), Some(entry)) = (settings.loss, section.get("loss"))
        {
            loss.check_emulated(&entry);
        }
        match medium {
            Medium::Infrared => media.ir = settings,
            Medium::Nrf24 => media.nrf24 = settings,
            Medium::P2p => media.p2p = settings,
            Medium::RangeAndBearing => media.rab = settings,
        }
    }
    media
}

/// Reads the settings of a group's frames that differ from the medium's. `name` is the name of the
/// section in messages.
pub fn link(group: &Section<'_>, name: &'static str) -> MediumSettings {
    group.section("link", name).map_or_else(MediumSettings::default, |section| read_one(&section))
}

fn read_one(section: &Section<'_>) -> MediumSettings {
    let share = |key| section.number(key, 0.0..=1.0);
    MediumSettings {
        preset: section.word("preset", &InfraredPreset::WORDS),
        range: section.number("range", 1.0..=1e6),
        edge: section.number("edge", 0.0..=1000.0),
        loss: section.get("loss").and_then(|entry| loss(&entry)),
        duplication: share("duplication"),
        reordering: share("reordering"),
        // A frame takes 4.4 ms, which limits the rate from above. The period of kilolib is 16 bits
        // in units of 128 µs, which limits it from below.
        rate: section.number("rate", 0.12..=225.0),
        distance_error: section.number("distance_error", 0.0..=1000.0),
        clock_error: section.number("clock_error", 0.0..=10.0),
    }
}

/// Reads one share for all links, or one for near and one for far links.
pub fn loss(entry: &Entry<'_>) -> Option<LossSetting> {
    if let DeValue::Array(_) = entry.value {
        let [near, far] = entry.numbers("a number or two as [near, far]", 0.0..=1.0)?;
        return Some(LossSetting { near, far });
    }
    let share = entry.number(0.0..=1.0)?;
    Some(LossSetting { near: share, far: share })
}
