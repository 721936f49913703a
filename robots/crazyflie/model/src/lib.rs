//! The Crazyflie in the simulator: it flies as the pilot of [`bittybuzz_flight`] commands, has a
//! Multi-ranger deck, and estimates its pose with a positioning system. Its body is kinematic, or a
//! rigid body that the flight controller flies.
//!
//! The parameters are those of the real robot, or of a scenario's `[body.crazyflie]`. In an
//! emulator the robot runs its firmware image.

mod body;
mod emulation;
mod flying;
mod functions;
mod pilot;
#[cfg(test)]
mod robot_file;

use std::ops::RangeInclusive;
use std::sync::Arc;

use bittybuzz_arena::robot::{Autopilot, Effect, Emulation, ModelKeys, RobotModel};
use bittybuzz_arena::scenario::Section;
use bittybuzz_arena::scenario::keys::{RADIUS, SectionKeys};
use bittybuzz_arena::scenario_keys;
use bittybuzz_robot_spec::RobotFunction;

pub use body::{CrazyflieModel, Fidelity, Flight, Positioning, Velocity};

/// The keys of the Crazyflie in scenarios.
pub const KEYS: ModelKeys = ModelKeys {
    body: SectionKeys {
        name: "[body.crazyflie]",
        keys: scenario_keys![
            "radius" "number" "of the model" "in mm",
            "speed" "number" "of the model" "largest speed, in mm/s",
            "acceleration" "number" "of the model" "largest acceleration, in mm/s²",
            "lag" "number" "of the model" "time constant of changes of velocity, in seconds",
            "crash_speed" "0 to 100000" "0" "closing speed in mm/s above which a contact in the air is a crash; 0: every contact is one",
            "positioning" "word" "of the model" "positioning system: none, flow, loco or lighthouse",
            "fidelity" "word" "kinematic" "kinematic: the body follows the planner's velocities; flight: a flight controller flies a body with four rotors",
            "armed" "true or false" "false" "true: a person has armed the robots at power-on; without it they do not take off",
            "avoidance" "0 to 5000" "0" "half of the distance in mm that a flying robot keeps from neighbors whose messages it receives; 0: no avoidance",
        ],
    },
    robots: "the Crazyflies",
    model: "the `model` of these Crazyflies",
    world_only: &["radius"],
    link: "the `link` of these Crazyflies",
};

/// Half distances in mm that robots can keep.
const AVOIDANCE: RangeInclusive<f64> = 0.0..=5000.0;

const FIDELITIES: [(&str, Fidelity); 2] =
    [("kinematic", Fidelity::Kinematic), ("flight", Fidelity::Flight)];

/// The words for `positioning`; the first one is no position.
const POSITIONINGS: [(&str, Positioning); 4] = [
    ("none", Positioning::None),
    ("flow", Positioning::FLOW),
    ("loco", Positioning::LOCO),
    ("lighthouse", Positioning::LIGHTHOUSE),
];

impl RobotModel for CrazyflieModel {
    fn name(&self) -> &'static str {
        "crazyflie"
    }

    fn robots(&self) -> &'static [&'static str] {
        &["crazyflie"]
    }

    fn keys(&self) -> &'static ModelKeys {
        &KEYS
    }

    fn read(&self, section: &Section<'_>) -> Arc<dyn RobotModel> {
        let mut model = *self;
        let number = |key, range| section.number(key, range).map(|number| number as f32);
        model.radius = number("radius", RADIUS).unwrap_or(model.radius);
        model.speed = number("speed", 0.0..=100_000.0).unwrap_or(model.speed);
        model.acceleration = number("acceleration", 1.0..=1e6).unwrap_or(model.acceleration);
        model.lag = number("lag", 0.0..=10.0).unwrap_or(model.lag);
        model.crash_speed = number("crash_speed", 0.0..=100_000.0).unwrap_or(model.crash_speed);
        model.fidelity = section.word("fidelity", &FIDELITIES).unwrap_or(model.fidelity);
        // A flight controller needs a position.
        let first = usize::from(model.fidelity == Fidelity::Flight);
        let positioning = section.word("positioning", &POSITIONINGS[first..]);
        model.positioning = positioning.unwrap_or(model.positioning);
        model.armed = section.boolean("armed").unwrap_or(model.armed);
        model.avoidance = number("avoidance", AVOIDANCE).unwrap_or(model.avoidance);
        Arc::new(model)
    }

    fn effect(&self, function: &RobotFunction) -> Option<Effect> {
        functions::effect(function)
    }

    fn autopilot(&self) -> Option<Box<dyn Autopilot>> {
        Some(Box::new(pilot::CrazyflieAutopilot::new(self)))
    }

    fn emulation(&self) -> Option<Arc<dyn Emulation>> {
        Some(Arc::new(*self))
    }
}
