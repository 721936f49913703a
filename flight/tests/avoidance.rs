//! Simulations of robots that avoid each other.
mod swarm {
    use bittybuzz_flight::Vec3;
    use bittybuzz_flight::avoidance::{Avoidance, AvoidanceOutcome, AvoidanceSettings, PeerReport};

    pub struct Random(pub u64);
    impl Random {
        pub fn unit(&mut self) -> f32 {
            self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
            let mut z = self.0;
            z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
            z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
            z ^= z >> 31;
            (z >> 40) as f32 / (1u64 << 24) as f32
        }
        fn normal(&mut self) -> f32 {
            (0..12).map(|_| self.unit()).sum::<f32>() - 6.0
        }
        fn noise(&mut self, sigma: f32) -> Vec3 {
            Vec3::new(self.normal(), self.normal(), self.normal()) * sigma
        }
        pub fn between(&mut self, low: Vec3, high: Vec3) -> Vec3 {
            low + (high - low) * Vec3::new(self.unit(), self.unit(), self.unit())
        }
    }

    #[derive(Clone, Copy)]
    pub struct World {
        pub avoid: bool,
        pub loss: f32,
        pub latency_ms: u32,
        pub with_velocity: bool,
        pub noise_m: f32,
        pub settings: AvoidanceSettings,
        pub seconds: u32,
    }

    #[derive(Debug)]
    pub struct Result {
        pub nearest_m: f32,
        pub nearest_scaled: f32,
        pub arrived: usize,
        pub finished_s: f32,
        pub crowded: usize,
        pub commands: usize,
        pub end: Vec<(Vec3, Vec3)>,
    }

    const LAG_S: f32 = 0.3;
    const ACCELERATION: f32 = 3.6;
    const STEP_MS: u32 = 10;

    pub fn run(world: World, seed: u64, starts: &[Vec3], goals: &[Vec3]) -> Result {
        let mut random = Random(seed);
        let n = starts.len();
        let mut position = starts.to_vec();
        let mut velocity = vec![Vec3::ZERO; n];
        let mut command = vec![Vec3::ZERO; n];
        let phase: Vec<u32> = (0..n).map(|_| (random.unit() * 10.0) as u32 * 10).collect();
        let mut avoid: Vec<Avoidance<10>> =
            (0..n).map(|i| Avoidance::new(i as u16, world.settings).unwrap()).collect();
        let mut air: Vec<(u32, usize, PeerReport)> = Vec::new();
        let scale =
            Vec3::new(world.settings.radius_m, world.settings.radius_m, world.settings.height_m)
                .recip();
        let mut result = Result {
            nearest_m: f32::INFINITY,
            nearest_scaled: f32::INFINITY,
            arrived: 0,
            finished_s: 0.0,
            crowded: 0,
            commands: 0,
            end: vec![],
        };
        for now_ms in (0..world.seconds * 1000).step_by(STEP_MS as usize) {
            air.retain(|(at, to, report)| {
                if *at <= now_ms {
                    let _ = avoid[*to].update_peer(*report);
                }
                *at > now_ms
            });
            for i in 0..n {
                if now_ms % 100 != phase[i] {
                    continue;
                }
                let seen = position[i] + random.noise(world.noise_m);
                let seen_velocity = velocity[i] + random.noise(world.noise_m * 2.0);
                let wanted = (goals[i] - seen).clamp_length_max(world.settings.speed_m_s);
                if world.avoid && now_ms >= 1000 {
                    let safe = avoid[i].limit(seen, seen_velocity, wanted, now_ms);
                    assert!(safe.velocity_m_s.length() <= world.settings.speed_m_s * 1.001);
                    result.commands += 1;
                    result.crowded += usize::from(safe.outcome == AvoidanceOutcome::Crowded);
                    command[i] = safe.velocity_m_s;
                } else if now_ms >= 1000 {
                    command[i] = wanted;
                }
                for to in 0..n {
                    if to != i && random.unit() >= world.loss {
                        let velocity_m_s =
                            if world.with_velocity { seen_velocity } else { Vec3::ZERO };
                        air.push((
                            now_ms + world.latency_ms,
                            to,
                            PeerReport {
                                id: i as u16,
                                position_m: seen,
                                velocity_m_s,
                                measured_at_ms: now_ms,
                            },
                        ));
                    }
                }
            }
            let dt = STEP_MS as f32 * 1e-3;
            for i in 0..n {
                let a = ((command[i] - velocity[i]) / LAG_S).clamp_length_max(ACCELERATION);
                velocity[i] += a * dt;
                position[i] += velocity[i] * dt;
            }
            for i in 0..n {
                for k in 0..i {
                    let d = position[i] - position[k];
                    result.nearest_m = result.nearest_m.min(d.length());
                    result.nearest_scaled = result.nearest_scaled.min((d * scale).length());
                }
            }
            let arrived = (0..n).filter(|&i| position[i].distance(goals[i]) < 0.15).count();
            if arrived < n {
                result.finished_s = now_ms as f32 * 1e-3;
            }
            result.arrived = arrived;
        }
        result.end = position.into_iter().zip(goals.iter().copied()).collect();
        result
    }
}

use bittybuzz_flight::Vec3;
use bittybuzz_flight::avoidance::AvoidanceSettings;
use swarm::*;

fn circle(n: usize, radius: f32) -> (Vec<Vec3>, Vec<Vec3>) {
    let at = |i: usize| {
        let a = core::f32::consts::TAU * i as f32 / n as f32;
        Vec3::new(radius * a.cos(), radius * a.sin(), 1.0)
    };
    ((0..n).map(at).collect(), (0..n).map(|i| -at(i) + Vec3::Z * 2.0).collect())
}

fn spread(random: &mut Random, n: usize, apart: f32) -> Vec<Vec3> {
    let scale = Vec3::new(1.0, 1.0, 1.0 / 3.0);
    'again: loop {
        let mut points: Vec<Vec3> = vec![];
        for _ in 0..n {
            let mut tries = 0;
            loop {
                let p = random.between(Vec3::new(0.0, 0.0, 0.3), Vec3::new(3.0, 3.0, 1.8));
                if points.iter().all(|q| ((p - *q) * scale).length() > apart) {
                    points.push(p);
                    break;
                }
                tries += 1;
                if tries > 200 {
                    continue 'again;
                }
            }
        }
        return points;
    }
}

#[test]
fn explore() {
    let env = |k: &str, d: f32| std::env::var(k).ok().and_then(|v| v.parse().ok()).unwrap_or(d);
    let settings = AvoidanceSettings {
        horizon_s: env("T", 1.0),
        lag_s: env("LAG", 0.3),
        ..AvoidanceSettings::CRAZYFLIE
    };
    let world = World {
        avoid: env("AVOID", 1.0) > 0.0,
        loss: env("LOSS", 0.2),
        latency_ms: env("LAT", 100.0) as u32,
        with_velocity: env("VEL", 1.0) > 0.0,
        noise_m: env("NOISE", 0.01),
        settings,
        seconds: env("SEC", 60.0) as u32,
    };
    let seeds = env("SEEDS", 20.0) as u64;
    let show = |name: &str, results: Vec<Result>, n: usize| {
        let d = results.iter().map(|r| r.nearest_m).fold(9.0, f32::min);
        let s = results.iter().map(|r| r.nearest_scaled).fold(9.0, f32::min);
        let arrived: usize = results.iter().map(|r| r.arrived).sum();
        let all = results.iter().filter(|r| r.arrived == n).count();
        let mut t: Vec<f32> = results.iter().map(|r| r.finished_s).collect();
        t.sort_by(f32::total_cmp);
        let crowded: usize = results.iter().map(|r| r.crowded).sum();
        let commands: usize = results.iter().map(|r| r.commands).sum();
        println!(
            "{name}: nearest {d:.3} m, scaled {s:.2}, arrived {:.1}%, all {all}/{}, time median {:.1} 90% {:.1} max {:.1}, crowded {:.2}%",
            100.0 * arrived as f32 / (n * results.len()) as f32,
            results.len(),
            t[t.len() / 2],
            t[t.len() * 9 / 10],
            t[t.len() - 1],
            100.0 * crowded as f32 / commands.max(1) as f32
        );
    };
    for (n, r) in [(2, 1.5), (4, 1.5), (8, 1.5), (8, 2.0), (10, 1.5), (10, 2.0)] {
        let (starts, goals) = circle(n, r);
        show(
            &format!("swap {n} r {r}"),
            (0..seeds).map(|s| run(world, s, &starts, &goals)).collect(),
            n,
        );
    }
    for n in [6, 10] {
        show(
            &format!("random {n}"),
            (0..seeds)
                .map(|s| {
                    let mut random = Random(1000 + s);
                    let a = spread(&mut random, n, env("APART", 0.7));
                    let b = spread(&mut random, n, env("APART", 0.7));
                    let result = run(world, s, &a, &b);
                    if result.arrived < n && std::env::var("SHOW").is_ok() {
                        for (p, g) in &result.end {
                            println!(
                                "   {s}: {p:.2} goal {g:.2} {}",
                                if p.distance(*g) > 0.15 { "STUCK" } else { "" }
                            );
                        }
                    }
                    result
                })
                .collect(),
            n,
        );
    }
}
