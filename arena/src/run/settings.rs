//! The translation of a scenario's settings to those of the engine.

use crate::engine::{self, Medium};
use crate::scenario::{
    Group, LampSection, LossSetting, MediumSettings, MovableSection, Outline, PatchSection,
    Scenario, Shape,
};

/// The engine's settings for a run.
pub fn settings(scenario: &Scenario, seed: u32, threads: usize) -> engine::WorldSettings {
    let [width, height] = scenario.world.size.map(|side| side as f32);
    engine::WorldSettings {
        seed: u64::from(seed),
        threads,
        area: engine::Area { width, height },
        ambient_light: scenario.world.ambient as f32,
    }
}

/// Returns the engine's settings of the media of a scenario.
pub fn media(scenario: &Scenario) -> engine::Media {
    let mut media = engine::Media::STANDARD;
    scenario.models.iter().for_each(|model| model.set_media(&mut media));
    for (_, medium) in Medium::WORDS {
        set_medium(&mut media, medium, scenario.media.settings(medium));
    }
    media
}

/// Returns the media of a group, where `media` are those of the whole world.
pub fn media_of(scenario: &Scenario, mut media: engine::Media, group: &Group) -> engine::Media {
    let medium = group.model.medium();
    group.model.set_own_media(&mut media);
    set_medium(&mut media, medium, scenario.media.settings(medium));
    set_medium(&mut media, medium, &group.link);
    media
}

fn set_medium(media: &mut engine::Media, medium: Medium, differs: &MediumSettings) {
    let link = media.link_mut(medium);
    if let Some(preset) = differs.preset {
        let engine::LinkSettings { range, edge, loss, .. } = preset.link();
        (link.range, link.edge, link.loss) = (range, edge, loss);
    }
    set(&mut link.edge, differs.edge);
    if let Some(range) = differs.range {
        link.range = Some(range as f32);
    }
    if let Some(loss) = differs.loss {
        link.loss = engine_loss(loss);
    }
    set(&mut link.duplicate, differs.duplication);
    set(&mut link.reorder, differs.reordering);
    // Only infrared has these.
    set(&mut media.infrared.distance_sigma, differs.distance_error);
    let clock_sigma = differs.clock_error.map(|percent| percent / 100.0);
    set(&mut media.infrared.clock_sigma, clock_sigma);
    if let Some(rate) = differs.rate {
        // The period is in units of 128 µs.
        media.infrared.tx_period = (1.0 / rate / 128e-6).clamp(1.0, 65_535.0) as u16;
    }
}

fn set(number: &mut f32, value: Option<f64>) {
    if let Some(value) = value {
        *number = value as f32;
    }
}

pub fn engine_loss(loss: LossSetting) -> engine::Loss {
    engine::Loss { near: loss.near as f32, far: loss.far as f32 }
}

pub fn engine_light(light: LampSection) -> engine::Lamp {
    let [x, y] = light.at.map(|axis| axis as f32);
    engine::Lamp { x, y, intensity: light.brightness as f32 }
}

pub fn engine_obstacle(outline: Outline) -> engine::Obstacle {
    match outline {
        Outline::Shape(Shape::Disc { at, radius }) => {
            let [x, y] = point(at);
            engine::Obstacle::Round { x, y, radius: radius as f32 }
        }
        Outline::Shape(Shape::Block { at, size, heading }) => {
            let ([x, y], [width, height]) = (point(at), point(size));
            if heading == 0.0 {
                engine::Obstacle::Box { x, y, width, height }
            } else {
                engine::Obstacle::TurnedBox { x, y, width, height, along: along(heading) }
            }
        }
        Outline::Wall(from, to) => {
            engine::Obstacle::Segment { from: point(from).into(), to: point(to).into() }
        }
    }
}

pub fn engine_movable(disc: &MovableSection) -> engine::MovableDisc {
    let [x, y] = point(disc.at);
    let height_mm = disc.height.map_or(f32::INFINITY, |height| height as f32);
    engine::MovableDisc { x, y, radius_mm: disc.radius as f32, height_mm }
}

/// Returns the ground of a world.
pub fn engine_ground(patches: &[PatchSection]) -> engine::PaintedGround {
    let patch = |patch: &PatchSection| {
        let (at, shape) = match patch.shape {
            Shape::Disc { at, radius } => (at, engine::PatchShape::Disc(radius as f32)),
            Shape::Block { at, size, heading } => {
                let ([width, height], along) = (point(size), along(heading));
                (at, engine::PatchShape::Box { width, height, along })
            }
        };
        let [x, y] = point(at);
        engine::Patch { x, y, shape, brightness: patch.brightness as f32 }
    };
    engine::PaintedGround::new(patches.iter().map(patch))
}

fn point(at: [f64; 2]) -> [f32; 2] {
    at.map(|axis| axis as f32)
}

/// Returns the vector of length 1 in a direction in degrees.
fn along(heading: f64) -> (f32, f32) {
    let (sin, cos) = libm::sincos(heading.to_radians());
    (cos as f32, sin as f32)
}
