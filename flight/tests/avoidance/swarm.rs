//! A simulated swarm: robots with a lag, noisy positions, and a radio that delays and loses
//! reports.

use bittybuzz_flight::Vec3;
use bittybuzz_flight::avoidance::{
    Avoidance, AvoidanceOutcome, AvoidanceSettings, Obstacle, PeerReport,
};
use bittybuzz_random::Random;

const STEP_MS: u32 = 10;
const COMMAND_PERIOD_MS: u32 = 100;
/// Time in ms in which the robots only report, as on the ground before a take-off.
const WARM_UP_MS: u32 = 1000;
const LAG_S: f32 = 0.3;
/// Acceleration in m/s² at a tilt of 20 degrees.
const ACCELERATION_M_S2_MAX: f32 = 3.6;
/// Distance in m from a goal that counts as arrived.
const ARRIVED_M: f32 = 0.15;

/// Returns a number from 0 to less than 1.
fn unit(random: &mut Random) -> f32 {
    (random.bits() >> 40) as f32 / (1_u64 << 24) as f32
}

/// Returns a vector with normal components (a sum of 12 uniform numbers has variance 1).
fn noise(random: &mut Random, sigma: f32) -> Vec3 {
    let mut normal = || (0..12).map(|_| unit(random)).sum::<f32>() - 6.0;
    sigma * Vec3::new(normal(), normal(), normal())
}

/// Returns a place that is uniform in the box between two corners.
pub fn between(random: &mut Random, low: Vec3, high: Vec3) -> Vec3 {
    low + (high - low) * Vec3::new(unit(random), unit(random), unit(random))
}

/// The conditions of a simulation.
#[derive(Clone, Copy)]
pub struct FlightConditions {
    pub settings: AvoidanceSettings,
    pub obstacles: &'static [Obstacle],
    pub is_avoiding: bool,
    pub reports_velocity: bool,
    pub loss: f32,
    pub delay_ms: u32,
    pub noise_m: f32,
    pub duration_s: u32,
}

impl FlightConditions {
    pub const USUAL: Self = FlightConditions {
        settings: AvoidanceSettings::CRAZYFLIE,
        obstacles: &[],
        is_avoiding: true,
        reports_velocity: true,
        loss: 0.2,
        delay_ms: 100,
        noise_m: 0.01,
        duration_s: 60,
    };
}

/// The result of a simulation.
#[derive(Clone, Copy, Debug)]
pub struct SwarmFlight {
    /// Least distance of two robots in m.
    pub nearest_m: f32,
    /// Least distance of two robots divided by the half-axes of the ellipsoid; 2 without overlap.
    pub nearest_scaled: f32,
    /// Least distance of a robot's middle from an obstacle in m.
    pub nearest_column_m: f32,
    /// Largest distance in m of a robot's middle beyond the bounds of the space.
    pub outside_m: f32,
    /// Number of robots at their goals at the end.
    pub arrived: usize,
    /// Time in seconds after which all robots stayed at their goals.
    pub finished_s: f32,
    /// Share of the commands that were the fallback.
    pub crowded: f32,
}

struct SwarmMotion {
    positions: Vec<Vec3>,
    velocities: Vec<Vec3>,
    commands: Vec<Vec3>,
}

impl SwarmMotion {
    fn step(&mut self) {
        let step_s = STEP_MS as f32 * 1e-3;
        let states = self.positions.iter_mut().zip(&mut self.velocities).zip(&self.commands);
        for ((position, velocity), command) in states {
            let acceleration = (*command - *velocity) / LAG_S;
            *velocity += step_s * acceleration.clamp_length_max(ACCELERATION_M_S2_MAX);
            *position += step_s * *velocity;
        }
    }

    fn pairs(&self) -> impl Iterator<Item = Vec3> + '_ {
        let pairs = |(own, first): (usize, &Vec3)| {
            let first = *first;
            self.positions.iter().take(own).map(move |second| first - *second)
        };
        self.positions.iter().enumerate().flat_map(pairs)
    }
}

/// Returns the distance of a place from a column in m.
pub fn gap_m(column: &Obstacle, place: Vec3) -> f32 {
    let local = column.along.rotate(glam::Vec2::Y).dot(place.truncate() - column.center_m);
    let along = column.along.dot(place.truncate() - column.center_m);
    let beyond = glam::Vec2::new(along, local).abs() - column.half_m;
    let flat = (beyond.max(glam::Vec2::ZERO).length() - column.rim_m).max(0.0);
    flat.hypot((place.z - column.top_m).max(0.0))
}

/// Simulates robots that fly straight to their goals. Each chooses its command at its own phase.
pub fn fly(
    conditions: FlightConditions,
    seed: u64,
    starts: &[Vec3],
    goals: &[Vec3],
) -> SwarmFlight {
    let settings = conditions.settings;
    let scale = Vec3::new(settings.radius_m, settings.radius_m, settings.height_m).recip();
    let count = starts.len();
    let mut random = Random::new(seed);
    let phases: Vec<u32> =
        (0..count).map(|_| (unit(&mut random) * 10.0) as u32 * STEP_MS).collect();
    let mut avoidances: Vec<Avoidance<10>> =
        (0..count).map(|id| Avoidance::new(id as u16, settings).expect("valid settings")).collect();
    let mut swarm = SwarmMotion {
        positions: starts.to_vec(),
        velocities: vec![Vec3::ZERO; count],
        commands: vec![Vec3::ZERO; count],
    };
    let mut on_air: Vec<(u32, usize, PeerReport)> = Vec::new();
    let (mut nearest_m, mut nearest_scaled) = (f32::INFINITY, f32::INFINITY);
    let (mut nearest_column_m, mut outside_m) = (f32::INFINITY, 0.0f32);
    let (mut arrived, mut finished_s) = (0, 0.0);
    let (mut crowded, mut commands) = (0, 0);
    for now_ms in (0..conditions.duration_s * 1000).step_by(STEP_MS as usize) {
        on_air.retain(|(at_ms, receiver, report)| {
            let is_received = *at_ms <= now_ms;
            if is_received {
                let _ = avoidances[*receiver].update_peer(*report);
            }
            !is_received
        });
        for own in (0..count).filter(|own| now_ms % COMMAND_PERIOD_MS == phases[*own]) {
            let position = swarm.positions[own] + noise(&mut random, conditions.noise_m);
            let velocity = swarm.velocities[own] + noise(&mut random, 2.0 * conditions.noise_m);
            for receiver in (0..count).filter(|receiver| *receiver != own) {
                if unit(&mut random) >= conditions.loss {
                    let report = PeerReport {
                        id: own as u16,
                        position_m: position,
                        velocity_m_s: conditions.reports_velocity.then_some(velocity),
                        measured_at_ms: now_ms,
                    };
                    on_air.push((now_ms + conditions.delay_ms, receiver, report));
                }
            }
            if now_ms < WARM_UP_MS {
                continue;
            }
            let wanted = (goals[own] - position).clamp_length_max(settings.speed_m_s);
            swarm.commands[own] = if conditions.is_avoiding {
                avoidances[own].set_obstacles(conditions.obstacles.iter().copied());
                let safe = avoidances[own].limit(position, velocity, wanted, now_ms);
                crowded += usize::from(safe.outcome == AvoidanceOutcome::Crowded);
                safe.velocity_m_s
            } else {
                wanted
            };
            commands += 1;
        }
        swarm.step();
        for way in swarm.pairs() {
            nearest_m = nearest_m.min(way.length());
            nearest_scaled = nearest_scaled.min((way * scale).length());
        }
        for position in &swarm.positions {
            let columns = conditions.obstacles.iter().map(|column| gap_m(column, *position));
            nearest_column_m = columns.fold(nearest_column_m, f32::min);
            let beyond = (settings.lowest_m - *position).max(*position - settings.highest_m);
            outside_m = outside_m.max(beyond.max_element());
        }
        let is_there = |(position, goal): &(&Vec3, &Vec3)| position.distance(**goal) < ARRIVED_M;
        arrived = swarm.positions.iter().zip(goals).filter(is_there).count();
        if arrived < count {
            finished_s = now_ms as f32 * 1e-3;
        }
    }
    let crowded = crowded as f32 / commands as f32;
    SwarmFlight {
        nearest_m,
        nearest_scaled,
        nearest_column_m,
        outside_m,
        arrived,
        finished_s,
        crowded,
    }
}
