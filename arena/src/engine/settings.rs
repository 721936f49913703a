//! The numbers of a world, and which of them are possible.

use super::body::{CrazyflieModel, KilobotModel, Positioning, ZooidModel};
use super::error::SettingsError;
use super::geometry::Area;
use super::link::{Infrared, Link, Nrf24, P2p};

/// Numbers that a world has from its beginning.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Of all chance in the world.
    pub seed: u64,
    /// How many threads work; the trace does not depend on it. 0 is one per core.
    pub threads: usize,
    /// Size of the world.
    pub area: Area,
    /// Body of the Kilobots.
    pub kilobot: KilobotModel,
    /// Body of the Zooids.
    pub zooid: ZooidModel,
    /// Body of the Crazyflies.
    pub crazyflie: CrazyflieModel,
    /// Link of the Kilobots.
    pub infrared: Infrared,
    /// Link of the Zooids.
    pub nrf24: Nrf24,
    /// Link of the Crazyflies.
    pub p2p: P2p,
    /// What light sensors read far from all lamps, 0 to 1023.
    pub ambient_light: f32,
}

impl Default for Settings {
    fn default() -> Self {
        Settings {
            seed: 0,
            threads: 1,
            area: Area { width: 2000.0, height: 2000.0 },
            kilobot: KilobotModel::STANDARD,
            zooid: ZooidModel::STANDARD,
            crazyflie: CrazyflieModel::STANDARD,
            infrared: Infrared::STANDARD,
            nrf24: Nrf24::STANDARD,
            p2p: P2p::STANDARD,
            ambient_light: 0.0,
        }
    }
}

impl Settings {
    /// Kilobots as Kilombo has them: 70 mm between middles, no loss, exact distances.
    pub fn kilombo(&mut self) {
        self.kilobot = KilobotModel::KILOMBO;
        self.ideal_infrared(70.0 - 2.0 * 17.0);
    }

    /// Kilobots as the Kilobot plugin of ARGoS has them: 100 mm between middles, a frame every 100 ms.
    pub fn argos(&mut self) {
        self.kilobot = KilobotModel::ARGOS;
        self.ideal_infrared(100.0 - 2.0 * 16.5);
        self.infrared.tx_period = 767;
    }

    /// Kilobots as Kilosim has them: 96 mm between middles.
    pub fn kilosim(&mut self) {
        self.kilobot = KilobotModel::KILOSIM;
        self.ideal_infrared(96.0 - 2.0 * 16.5);
    }

    fn ideal_infrared(&mut self, range: f32) {
        let link =
            Link { range: Some(range), loss: super::Loss::even(0.0), ..Infrared::STANDARD.link };
        self.infrared = Infrared { link, distance_sigma: 0.0, ..Infrared::STANDARD };
    }

    /// Whether a world can have these numbers.
    pub fn check(&self) -> Result<(), SettingsError> {
        let Settings { kilobot, zooid, crazyflie, .. } = self;
        let [least, most] = self.p2p.pause_us;
        let length = "a number from 1 to 1e6";
        let positive = "a number greater than 0";
        let not_negative = "0 or more";
        let checks = [
            ("area.width", within(self.area.width, 1.0, 1e6), length),
            ("area.height", within(self.area.height, 1.0, 1e6), length),
            ("ambient_light", within(self.ambient_light, 0.0, 1023.0), "0 to 1023"),
            ("kilobot.radius", within(kilobot.radius, 1.0, 1e4), "1 to 10000"),
            ("kilobot.leg_angle", kilobot.leg_angle.is_finite(), "a number"),
            ("kilobot.leg_distance", not_below_0(kilobot.leg_distance), not_negative),
            ("kilobot.speed", within(kilobot.speed, 0.0, 1e4), "0 to 10000"),
            ("kilobot.turn_rate", within(kilobot.turn_rate, 0.0, 100.0), "0 to 100"),
            ("kilobot.straight_duty", kilobot.straight_duty > kilobot.dead_duty, "above dead_duty"),
            ("kilobot.turn_duty", kilobot.turn_duty > kilobot.dead_duty, "above dead_duty"),
            ("kilobot.gain_sigma", within(kilobot.gain_sigma, 0.0, 1.0), "0 to 1"),
            ("zooid.radius", within(zooid.radius, 1.0, 1e4), "1 to 10000"),
            ("zooid.track", above_0(zooid.track), positive),
            ("zooid.speed", within(zooid.speed, 0.0, 1e4), "0 to 10000"),
            ("zooid.full_duty", zooid.full_duty > zooid.dead_duty, "above dead_duty"),
            ("zooid.gain_sigma", within(zooid.gain_sigma, 0.0, 1.0), "0 to 1"),
            ("zooid.unit", above_0(zooid.unit), positive),
            ("crazyflie.radius", within(crazyflie.radius, 1.0, 1e4), "1 to 10000"),
            ("crazyflie.lag", not_below_0(crazyflie.lag), not_negative),
            ("crazyflie.speed", within(crazyflie.speed, 0.0, 1e5), "0 to 100000"),
            ("crazyflie.acceleration", above_0(crazyflie.acceleration), positive),
            ("crazyflie.positioning", possible(&crazyflie.positioning), "without negative numbers"),
            ("infrared.clock_sigma", within(self.infrared.clock_sigma, 0.0, 0.1), "0 to 0.1"),
            ("infrared.distance_sigma", not_below_0(self.infrared.distance_sigma), not_negative),
            ("nrf24.backoff_us", (1..=100_000).contains(&self.nrf24.backoff_us), "1 to 100000"),
            ("p2p.pause_us", least <= most && most <= 100_000, "0 to 100000, the less first"),
        ];
        for (field, holds, must) in checks {
            if !holds {
                return Err(SettingsError { field, must });
            }
        }
        check_link(&self.infrared.link, LINKS[0])?;
        check_link(&self.nrf24.link, LINKS[1])?;
        check_link(&self.p2p.link, LINKS[2])
    }
}

/// Names of a link's fields, per medium.
const LINKS: [[&str; 5]; 3] = [
    [
        "infrared.link.range",
        "infrared.link.loss.near",
        "infrared.link.loss.far",
        "infrared.link.duplicate",
        "infrared.link.reorder",
    ],
    [
        "nrf24.link.range",
        "nrf24.link.loss.near",
        "nrf24.link.loss.far",
        "nrf24.link.duplicate",
        "nrf24.link.reorder",
    ],
    [
        "p2p.link.range",
        "p2p.link.loss.near",
        "p2p.link.loss.far",
        "p2p.link.duplicate",
        "p2p.link.reorder",
    ],
];

fn check_link(link: &Link, names: [&'static str; 5]) -> Result<(), SettingsError> {
    if link.range.is_some_and(|range| !within(range, 0.0, 1e6)) {
        return Err(SettingsError { field: names[0], must: "a distance from 0 to 1e6" });
    }
    let probabilities = [link.loss.near, link.loss.far, link.duplicate, link.reorder];
    for (probability, field) in probabilities.into_iter().zip(&names[1..]) {
        if !within(probability, 0.0, 1.0) {
            return Err(SettingsError { field, must: "a probability from 0 to 1" });
        }
    }
    Ok(())
}

fn within(number: f32, least: f32, most: f32) -> bool {
    number >= least && number <= most
}

fn above_0(number: f32) -> bool {
    number > 0.0 && number.is_finite()
}

fn not_below_0(number: f32) -> bool {
    number >= 0.0 && number.is_finite()
}

fn possible(positioning: &Positioning) -> bool {
    match *positioning {
        Positioning::None => true,
        Positioning::Flow { walk, yaw_walk } => not_below_0(walk) && not_below_0(yaw_walk),
        Positioning::Absolute { sigma, yaw_sigma } => not_below_0(sigma) && not_below_0(yaw_sigma),
    }
}
