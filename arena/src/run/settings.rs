//! From what a scenario says to the numbers of the engine.

use crate::engine;
use crate::scenario::{
    Bodies, Body, Group, Light, Loss, Media, Medium, MediumSettings, Obstacle, Positioning, Preset,
    Scenario,
};

/// The engine's settings for a run.
pub fn settings(scenario: &Scenario, seed: u32, threads: usize) -> engine::Settings {
    let [width, height] = scenario.world.size.map(|side| side as f32);
    let mut settings = engine::Settings {
        seed: u64::from(seed),
        threads,
        area: engine::Area { width, height },
        ambient_light: scenario.world.ambient as f32,
        ..engine::Settings::default()
    };
    match scenario.bodies.kilobot.preset {
        Preset::Standard => {}
        Preset::Kilombo => settings.kilombo(),
        Preset::Argos => settings.argos(),
        Preset::Kilosim => settings.kilosim(),
    }
    bodies(&mut settings, &scenario.bodies);
    let Media { ir, nrf24, p2p } = &scenario.media;
    medium(&mut settings, Medium::Ir, ir);
    medium(&mut settings, Medium::Nrf24, nrf24);
    medium(&mut settings, Medium::P2p, p2p);
    settings
}

/// The settings for a group, if they are others than `settings`, those of the world.
pub fn of_group(mut settings: engine::Settings, group: &Group) -> Option<engine::Settings> {
    if group.model == Bodies::default() && group.link == MediumSettings::default() {
        return None;
    }
    bodies(&mut settings, &group.model);
    medium(&mut settings, group.body.medium(), &group.link);
    Some(settings)
}

fn set(number: &mut f32, value: Option<f64>) {
    if let Some(value) = value {
        *number = value as f32;
    }
}

fn bodies(settings: &mut engine::Settings, bodies: &Bodies) {
    let kilobot = &mut settings.kilobot;
    set(&mut kilobot.radius, bodies.kilobot.radius);
    set(&mut kilobot.speed, bodies.kilobot.speed);
    set(&mut kilobot.turn_rate, bodies.kilobot.turn.map(f64::to_radians));
    set(&mut kilobot.gain_sigma, bodies.kilobot.gain_error);
    let zooid = &mut settings.zooid;
    set(&mut zooid.radius, bodies.zooid.radius);
    set(&mut zooid.speed, bodies.zooid.speed);
    set(&mut zooid.gain_sigma, bodies.zooid.gain_error);
    let crazyflie = &mut settings.crazyflie;
    set(&mut crazyflie.radius, bodies.crazyflie.radius);
    set(&mut crazyflie.speed, bodies.crazyflie.speed);
    set(&mut crazyflie.acceleration, bodies.crazyflie.acceleration);
    set(&mut crazyflie.lag, bodies.crazyflie.lag);
    if let Some(positioning) = bodies.crazyflie.positioning {
        crazyflie.positioning = match positioning {
            Positioning::None => engine::Positioning::None,
            Positioning::Flow => engine::Positioning::FLOW,
            Positioning::Loco => engine::Positioning::LOCO,
            Positioning::Lighthouse => engine::Positioning::LIGHTHOUSE,
        };
    }
}

fn medium(settings: &mut engine::Settings, medium: Medium, differs: &MediumSettings) {
    let link = match medium {
        Medium::Ir => &mut settings.infrared.link,
        Medium::Nrf24 => &mut settings.nrf24.link,
        Medium::P2p => &mut settings.p2p.link,
    };
    if let Some(range) = differs.range {
        link.range = Some(range as f32);
    }
    if let Some(loss) = differs.loss {
        link.loss = engine_loss(loss);
    }
    set(&mut link.duplicate, differs.duplication);
    set(&mut link.reorder, differs.reordering);
    // Only infrared has these.
    set(&mut settings.infrared.distance_sigma, differs.distance_error);
    if let Some(rate) = differs.rate {
        // In units of 128 µs.
        settings.infrared.tx_period = (1.0 / rate / 128e-6).clamp(1.0, 65_535.0) as u16;
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

pub fn kind(body: Body) -> engine::RobotKind {
    match body {
        Body::Kilobot => engine::RobotKind::Kilobot,
        Body::Zooid => engine::RobotKind::Zooid,
        Body::Crazyflie => engine::RobotKind::Crazyflie,
    }
}

/// Radius of a body in mm.
pub fn radius(settings: &engine::Settings, body: Body) -> f64 {
    f64::from(match body {
        Body::Kilobot => settings.kilobot.radius,
        Body::Zooid => settings.zooid.radius,
        Body::Crazyflie => settings.crazyflie.radius,
    })
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
