//! The Kilobot in the simulator: two vibration motors on three stiff legs, infrared, a light sensor.
//!
//! The parameters are those of the real robot, of another simulator ([`Preset`]), or of a
//! scenario's `[body.kilobot]`. In an emulator the robot runs its firmware image on simavr, with
//! kilolib's EEPROM.

mod body;
mod emulation;
mod functions;
mod script;

use std::sync::Arc;

use bittybuzz_arena::engine::Media;
use bittybuzz_arena::robot::{Effect, Emulation, Glyph, ModelKeys, RobotModel};
use bittybuzz_arena::scenario::Section;
use bittybuzz_arena::scenario::keys::{GAIN_ERROR, RADIUS, SectionKeys};
use bittybuzz_arena::scenario_keys;
use bittybuzz_robot_spec::RobotFunction;

pub use body::{KilobotModel, KilobotMotors, Preset};

/// Names of the robot files for which this model holds.
const ROBOTS: &[&str] = &["kilobot"];

/// The keys of the Kilobot in scenarios.
pub const KEYS: ModelKeys = ModelKeys {
    body: SectionKeys {
        name: "[body.kilobot]",
        keys: scenario_keys![
            "preset" "word" "standard" "source of the numbers for bodies and infrared: standard, kilombo, argos or kilosim",
            "radius" "number" "of the preset" "in mm",
            "speed" "number" "of the preset" "speed straight on with the calibrated duty, in mm/s",
            "turn" "number" "of the preset" "turn rate with the calibrated duty, in degrees per second",
            "dead_duty" "integer" "of the preset" "largest duty that does not move the robot, less than the calibrated duties; standard: 60",
            "speed_error" "0 to 1" "of the preset" "standard deviation of the speed between robots, as a share of it; standard: 0.13",
            "turn_error" "0 to 1" "of the preset" "standard deviation of each motor's turn rate, as a share of it; standard: 0.1",
            "heading_bias" "0 to 5000" "of the preset" "standard deviation of the bias between robots, in degrees per second; standard: 6",
            "heading_noise" "0 to 5000" "of the preset" "standard deviation of the noise, in degrees per second; a turn with one motor has 0.71 of it; standard: 1",
            "heading_noise_time" "0 to 100000" "of the preset" "time constant of the noise, in seconds; 0: it is new in each tick; standard: 10",
        ],
    },
    robots: "the Kilobots",
    model: "the `model` of these Kilobots",
    world_only: &["preset", "radius"],
    link: "the `link` of these Kilobots",
};

const PRESETS: [(&str, Preset); 4] = [
    ("standard", Preset::Standard),
    ("kilombo", Preset::Kilombo),
    ("argos", Preset::Argos),
    ("kilosim", Preset::Kilosim),
];

impl RobotModel for KilobotModel {
    fn name(&self) -> &'static str {
        "kilobot"
    }

    fn robots(&self) -> &'static [&'static str] {
        ROBOTS
    }

    fn keys(&self) -> &'static ModelKeys {
        &KEYS
    }

    fn read(&self, section: &Section<'_>) -> Arc<dyn RobotModel> {
        let preset = section.word("preset", &PRESETS);
        let mut model = preset.map_or(*self, Preset::model);
        let number = |key, range| section.number(key, range).map(|number| number as f32);
        model.radius = number("radius", RADIUS).unwrap_or(model.radius);
        model.speed = number("speed", 0.0..=10_000.0).unwrap_or(model.speed);
        let turn = section.number("turn", 0.0..=5000.0);
        model.turn_rate = turn.map_or(model.turn_rate, |degrees| degrees.to_radians() as f32);
        let dead_max = u32::from(model.straight_duty.min(model.turn_duty) - 1);
        let dead_duty = section.integer("dead_duty", 0..=dead_max);
        model.dead_duty = dead_duty.map_or(model.dead_duty, |duty| duty as u8);
        model.speed_sigma = number("speed_error", GAIN_ERROR).unwrap_or(model.speed_sigma);
        model.turn_sigma = number("turn_error", GAIN_ERROR).unwrap_or(model.turn_sigma);
        let rate = |key| number(key, 0.0..=5000.0).map(f32::to_radians);
        model.bias_sigma = rate("heading_bias").unwrap_or(model.bias_sigma);
        model.noise_sigma = rate("heading_noise").unwrap_or(model.noise_sigma);
        model.noise_time =
            number("heading_noise_time", 0.0..=100_000.0).unwrap_or(model.noise_time);
        Arc::new(model)
    }

    fn set_media(&self, media: &mut Media) {
        media.infrared = self.preset.infrared();
    }

    /// An instruction of a script takes some 150 cycles of the ATmega328P at 8 MHz.
    fn budget(&self) -> u16 {
        5_000
    }

    fn glyph(&self) -> Glyph {
        Glyph::Legs
    }

    fn effect(&self, function: &RobotFunction) -> Option<Effect> {
        functions::effect(self, function)
    }

    fn emulation(&self) -> Option<Arc<dyn Emulation>> {
        // A downloaded module starts no emulator, and should be small.
        if cfg!(target_family = "wasm") { None } else { Some(Arc::new(*self)) }
    }
}
