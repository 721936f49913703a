//! The Zooid in the simulator: two wheels, an nRF24 radio, and a projector from which the robot
//! reads its position.
//!
//! The parameters are those of the real robot, or of a scenario's `[body.zooid]`. In an emulator
//! the robot runs its firmware image; only there the projector's light can have faults ([`ProjectorFaults`]).

mod body;
mod emulation;
mod functions;
mod table;

use std::sync::Arc;

use bittybuzz_arena::robot::{Effect, Emulation, Glyph, ModelKeys, RobotModel};
use bittybuzz_arena::scenario::Section;
use bittybuzz_arena::scenario::keys::{GAIN_ERROR, RADIUS, SectionKeys};
use bittybuzz_arena::scenario_keys;
use bittybuzz_emulation::message::PowerDetector;
use bittybuzz_robot_spec::RobotFunction;

pub use body::{Drive, ProjectorFaults, ZooidModel};

/// The keys of the Zooid in scenarios.
pub const KEYS: ModelKeys = ModelKeys {
    body: SectionKeys {
        name: "[body.zooid]",
        keys: scenario_keys![
            "radius" "number" "of the model" "in mm",
            "speed" "number" "of the model" "speed of a wheel at full duty, in mm/s",
            "gain_error" "0 to 1" "of the model" "standard deviation of each motor's gain, as a share of it",
            "frame_loss" "0 to 1" "0" "share of the projector's frames that the firmware misses; a virtual machine misses none",
            "edge_jitter" "0 to 300" "0" "largest shift of an edge of the projector's light at the firmware, early or late, in µs",
            "glitches" "0 to 10000" "0" "wrong levels per second at each photodiode of the firmware; each lasts 1 to 50 µs",
            "power_detector" "word" "latched" "register RPD of the firmware's radio: latched, a packet sets it until the radio stops listening; live, it follows the signal",
        ],
    },
    robots: "the Zooids",
    model: "the `model` of these Zooids",
    world_only: &["radius"],
    link: "the `link` of these Zooids",
};

const POWER_DETECTORS: [(&str, PowerDetector); 2] =
    [("latched", PowerDetector::Latched), ("live", PowerDetector::Live)];

impl RobotModel for ZooidModel {
    fn name(&self) -> &'static str {
        "zooid"
    }

    fn robots(&self) -> &'static [&'static str] {
        &["zooids"]
    }

    fn keys(&self) -> &'static ModelKeys {
        &KEYS
    }

    fn read(&self, section: &Section<'_>) -> Arc<dyn RobotModel> {
        let mut model = *self;
        let number = |key, range| section.number(key, range).map(|number| number as f32);
        model.radius = number("radius", RADIUS).unwrap_or(model.radius);
        model.speed = number("speed", 0.0..=10_000.0).unwrap_or(model.speed);
        model.gain_sigma = number("gain_error", GAIN_ERROR).unwrap_or(model.gain_sigma);
        let light = &mut model.light;
        light.lose = section.number("frame_loss", 0.0..=1.0).unwrap_or(light.lose);
        light.jitter_us = section.number("edge_jitter", 0.0..=300.0).unwrap_or(light.jitter_us);
        light.glitches_per_s =
            section.number("glitches", 0.0..=10_000.0).unwrap_or(light.glitches_per_s);
        let detector = section.word("power_detector", &POWER_DETECTORS);
        model.power_detector = detector.unwrap_or(model.power_detector);
        Arc::new(model)
    }

    fn glyph(&self) -> Glyph {
        Glyph::Wheels
    }

    fn effect(&self, function: &RobotFunction) -> Option<Effect> {
        functions::effect(function)
    }

    fn emulation(&self) -> Option<Arc<dyn Emulation>> {
        // A downloaded module starts no emulator, and should be small.
        if cfg!(target_family = "wasm") { None } else { Some(Arc::new(*self)) }
    }
}
