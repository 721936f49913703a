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

use bittybuzz_arena::robot::{
    Autopilot, Effect, Emulation, Glyph, ModelKeys, RobotModel, SurroundingsKey,
};
use bittybuzz_arena::scenario::Section;
use bittybuzz_arena::scenario::keys::{RADIUS, SectionKeys};
use bittybuzz_arena::scenario_keys;
use bittybuzz_flight::planner::PositionFence;
use bittybuzz_robot_spec::RobotFunction;

pub use body::{CrazyflieModel, Fidelity, Flight, FlightSurroundings, Positioning, Velocity};

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
            "positioning" "word" "of the model" "positioning system: none, flow, loco, lighthouse or capture (cameras in the room)",
            "fidelity" "word" "kinematic" "kinematic: the body follows the planner's velocities; flight: a flight controller flies a body with four rotors",
            "armed" "true or false" "false" "true: a person has armed the robots at power-on; without it they do not take off",
            "avoidance" "0 to 5000" "0" "distance in mm that a flying robot keeps from walls and obstacles, and twice from neighbors whose messages it receives; 0: no avoidance",
            "wind" "0 to 20000" "0" "mean speed of the wind, in mm/s",
            "wind_direction" "degrees" "0" "direction to which the wind blows: 0 along x, counterclockwise",
            "gusts" "0 to 10000" "0" "standard deviation of each coordinate of the gusts, in mm/s",
            "gust_time" "0.05 to 60" "1" "time of correlation of the gusts, in seconds",
            "texture" "0 to 1" "1" "share of a usual floor's features that a Flow deck sees",
            "latency" "0 to 150" "10" "time until a pose of capture, lighthouse or loco arrives, in ms",
            "latency_sway" "0 to 1" "0" "share of the latency by which it sways",
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
const POSITIONINGS: [(&str, Positioning); 5] = [
    ("none", Positioning::None),
    ("flow", Positioning::FLOW),
    ("loco", Positioning::LOCO),
    ("lighthouse", Positioning::LIGHTHOUSE),
    ("capture", Positioning::CAPTURE),
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
        let around = &mut model.surroundings;
        around.wind = number("wind", 0.0..=20_000.0).unwrap_or(around.wind);
        around.wind_direction =
            number("wind_direction", -360.0..=360.0).map_or(around.wind_direction, f32::to_radians);
        around.gusts = number("gusts", 0.0..=10_000.0).unwrap_or(around.gusts);
        around.gust_time = number("gust_time", 0.05..=60.0).unwrap_or(around.gust_time);
        around.texture = number("texture", 0.0..=1.0).unwrap_or(around.texture);
        around.latency = number("latency", 0.0..=150.0).unwrap_or(around.latency);
        around.latency_sway = number("latency_sway", 0.0..=1.0).unwrap_or(around.latency_sway);
        Arc::new(model)
    }

    fn with_settings(&self, settings: &[(&str, u16)]) -> Option<Arc<dyn RobotModel>> {
        // Without a flight controller, robots have no limits of the flight.
        (self.fidelity == Fidelity::Flight).then(|| Arc::new(self.limited(settings)) as _)
    }

    fn fence_mm(&self) -> Option<[[f32; 3]; 2]> {
        let [least, most] = [self.fence.least_m(), self.fence.most_m()].map(<[f32; 3]>::from);
        let wide = PositionFence::WIDE;
        let [none_least, none_most] = [wide.least_m(), wide.most_m()].map(<[f32; 3]>::from);
        let limit =
            |at: f32, none: f32| if at == none { none * f32::INFINITY } else { at * 1000.0 };
        let corner =
            |at: [f32; 3], none: [f32; 3]| [0, 1, 2].map(|axis| limit(at[axis], none[axis]));
        (self.fence != wide).then(|| [corner(least, none_least), corner(most, none_most)])
    }

    fn glyph(&self) -> Glyph {
        Glyph::Rotors
    }

    fn effect(&self, function: &RobotFunction) -> Option<Effect> {
        functions::effect(function)
    }

    fn wind_mm_s(&self) -> Option<[f32; 2]> {
        let FlightSurroundings { wind, wind_direction, .. } = self.surroundings;
        let (sine, cosine) = libm::sincosf(wind_direction);
        (wind > 0.0).then_some([wind * cosine, wind * sine])
    }

    fn unusual_surroundings(&self) -> Vec<SurroundingsKey> {
        let (here, calm) = (&self.surroundings, &FlightSurroundings::CALM);
        let key = |name, value, usual, unit| {
            (value != usual).then_some(SurroundingsKey { name, value, unit })
        };
        let direction = here.wind_direction.to_degrees();
        let keys = [
            key("wind", here.wind, calm.wind, "mm/s"),
            key("wind_direction", direction, calm.wind_direction, "degrees"),
            key("gusts", here.gusts, calm.gusts, "mm/s"),
            key("gust_time", here.gust_time, calm.gust_time, "s"),
            key("texture", here.texture, calm.texture, ""),
            key("latency", here.latency, calm.latency, "ms"),
            key("latency_sway", here.latency_sway, calm.latency_sway, ""),
        ];
        keys.into_iter().flatten().collect()
    }

    fn has_outside_poses(&self) -> bool {
        let is_outside = matches!(self.positioning, Positioning::Absolute { .. });
        self.fidelity == Fidelity::Flight && is_outside
    }

    fn autopilot(&self) -> Option<Box<dyn Autopilot>> {
        Some(Box::new(pilot::CrazyflieAutopilot::new(self)))
    }

    fn emulation(&self) -> Option<Arc<dyn Emulation>> {
        // A downloaded module starts no emulator, and should be small.
        if cfg!(target_family = "wasm") { None } else { Some(Arc::new(*self)) }
    }
}
