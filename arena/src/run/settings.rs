//! From what a scenario says to the numbers of the engine.

use std::sync::Arc;

use crate::engine::{self, BodyModel};
use crate::robots::crazyflie::{self, CrazyflieModel};
use crate::robots::kilobot::KilobotModel;
use crate::robots::zooid::ZooidModel;
use crate::scenario::{
    Bodies, Body, Group, Light, Loss, Media, Medium, MediumSettings, Obstacle, Positioning,
    Scenario,
};

/// The numbers of all kinds of robots and of their links.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Numbers {
    pub kilobot: KilobotModel,
    pub zooid: ZooidModel,
    pub crazyflie: CrazyflieModel,
    pub media: engine::Media,
}

/// The engine's settings for a run.
pub fn settings(scenario: &Scenario, seed: u32, threads: usize) -> engine::Settings {
    let [width, height] = scenario.world.size.map(|side| side as f32);
    engine::Settings {
        seed: u64::from(seed),
        threads,
        area: engine::Area { width, height },
        ambient_light: scenario.world.ambient as f32,
    }
}

impl Numbers {
    /// Those of a scenario.
    pub fn new(scenario: &Scenario) -> Self {
        let preset = scenario.bodies.kilobot.preset;
        let media = engine::Media { infrared: preset.infrared(), ..engine::Media::STANDARD };
        let mut numbers = Numbers {
            kilobot: preset.model(),
            zooid: ZooidModel::STANDARD,
            crazyflie: CrazyflieModel::STANDARD,
            media,
        };
        numbers.set_bodies(&scenario.bodies);
        let Media { ir, nrf24, p2p } = &scenario.media;
        numbers.set_medium(Medium::Ir, ir);
        numbers.set_medium(Medium::Nrf24, nrf24);
        numbers.set_medium(Medium::P2p, p2p);
        numbers
    }

    /// Those of a group, of which `self` holds for the world.
    pub fn of_group(mut self, group: &Group) -> Self {
        self.set_bodies(&group.model);
        self.set_medium(group.body.medium(), &group.link);
        self
    }

    /// The model of a body.
    pub fn model(&self, body: Body) -> Arc<dyn BodyModel> {
        match body {
            Body::Kilobot => Arc::new(self.kilobot),
            Body::Zooid => Arc::new(self.zooid),
            Body::Crazyflie => Arc::new(self.crazyflie),
        }
    }

    /// Radius of a body in mm.
    pub fn radius(&self, body: Body) -> f64 {
        f64::from(self.model(body).shape().radius)
    }

    fn set_bodies(&mut self, bodies: &Bodies) {
        let kilobot = &mut self.kilobot;
        set(&mut kilobot.radius, bodies.kilobot.radius);
        set(&mut kilobot.speed, bodies.kilobot.speed);
        set(&mut kilobot.turn_rate, bodies.kilobot.turn.map(f64::to_radians));
        set(&mut kilobot.gain_sigma, bodies.kilobot.gain_error);
        let zooid = &mut self.zooid;
        set(&mut zooid.radius, bodies.zooid.radius);
        set(&mut zooid.speed, bodies.zooid.speed);
        set(&mut zooid.gain_sigma, bodies.zooid.gain_error);
        let crazyflie = &mut self.crazyflie;
        set(&mut crazyflie.radius, bodies.crazyflie.radius);
        set(&mut crazyflie.speed, bodies.crazyflie.speed);
        set(&mut crazyflie.acceleration, bodies.crazyflie.acceleration);
        set(&mut crazyflie.lag, bodies.crazyflie.lag);
        if let Some(positioning) = bodies.crazyflie.positioning {
            crazyflie.positioning = match positioning {
                Positioning::None => crazyflie::Positioning::None,
                Positioning::Flow => crazyflie::Positioning::FLOW,
                Positioning::Loco => crazyflie::Positioning::LOCO,
                Positioning::Lighthouse => crazyflie::Positioning::LIGHTHOUSE,
            };
        }
    }

    fn set_medium(&mut self, medium: Medium, differs: &MediumSettings) {
        let link = self.media.link_mut(engine_medium(medium));
        if let Some(range) = differs.range {
            link.range = Some(range as f32);
        }
        if let Some(loss) = differs.loss {
            link.loss = engine_loss(loss);
        }
        set(&mut link.duplicate, differs.duplication);
        set(&mut link.reorder, differs.reordering);
        // Only infrared has these.
        set(&mut self.media.infrared.distance_sigma, differs.distance_error);
        if let Some(rate) = differs.rate {
            // In units of 128 µs.
            self.media.infrared.tx_period = (1.0 / rate / 128e-6).clamp(1.0, 65_535.0) as u16;
        }
    }
}

fn set(number: &mut f32, value: Option<f64>) {
    if let Some(value) = value {
        *number = value as f32;
    }
}

pub fn engine_loss(loss: Loss) -> engine::Loss {
    engine::Loss { near: loss.near as f32, far: loss.far as f32 }
}

pub fn engine_medium(medium: Medium) -> engine::Medium {
    match medium {
        Medium::Ir => engine::Medium::Infrared,
        Medium::Nrf24 => engine::Medium::Nrf24,
        Medium::P2p => engine::Medium::P2p,
    }
}

pub fn engine_light(light: Light) -> engine::Light {
    let [x, y] = light.at.map(|axis| axis as f32);
    engine::Light { x, y, intensity: light.brightness as f32 }
}

pub fn engine_obstacle(obstacle: Obstacle) -> engine::Obstacle {
    let point = |at: [f64; 2]| at.map(|axis| axis as f32);
    match obstacle {
        Obstacle::Disc { at, radius } => {
            let [x, y] = point(at);
            engine::Obstacle::Round { x, y, radius: radius as f32 }
        }
        Obstacle::Block { at, size } => {
            let ([x, y], [width, height]) = (point(at), point(size));
            engine::Obstacle::Box { x, y, width, height }
        }
        Obstacle::Wall(from, to) => {
            engine::Obstacle::Segment { from: point(from).into(), to: point(to).into() }
        }
    }
}
