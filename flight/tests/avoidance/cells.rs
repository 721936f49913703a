//! Properties of one call, and of a swarm with perfect information.

use bittybuzz_flight::Vec3;
use bittybuzz_flight::avoidance::{
    Avoidance, AvoidanceOutcome, AvoidanceSettings, PeerReport, RefusedReport,
};
use proptest::prelude::*;

const SETTINGS: AvoidanceSettings = AvoidanceSettings::CRAZYFLIE;
const WITHOUT_LAG: AvoidanceSettings = AvoidanceSettings { lag_s: 0.0, ..SETTINGS };

fn vector(most: f32) -> impl Strategy<Value = Vec3> {
    (-most..most, -most..most, -most..most).prop_map(|(x, y, z)| Vec3::new(x, y, z))
}

/// Returns vectors of all numbers, also those that are not finite.
fn any_vector() -> impl Strategy<Value = Vec3> {
    let any = proptest::num::f32::ANY;
    (any, any, any).prop_map(|(x, y, z)| Vec3::new(x, y, z))
}

fn report(id: u16, position_m: Vec3, measured_at_ms: u32) -> PeerReport {
    PeerReport { id, position_m, velocity_m_s: Some(Vec3::ZERO), measured_at_ms }
}

fn with_peers(settings: AvoidanceSettings, peers: &[Vec3]) -> Avoidance<10> {
    let mut avoidance = Avoidance::new(0, settings).expect("valid settings");
    for (id, peer) in (1..).zip(peers) {
        assert_eq!(avoidance.update_peer(report(id, *peer, 0)), Ok(()));
    }
    avoidance
}

/// Returns the difference of two positions divided by the half-axes of the ellipsoid.
fn scaled(own: Vec3, other: Vec3) -> [f64; 3] {
    let way = own - other;
    [f64::from(way.x) / 0.3, f64::from(way.y) / 0.3, f64::from(way.z) / 0.9]
}

fn length(v: [f64; 3]) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// Returns the scaled distance to the middle plane after the horizon, less 1. The peer and the
/// robot rest at the start.
fn room(own: Vec3, other: Vec3, velocity: Vec3) -> f64 {
    let way = scaled(own, other);
    let apart = length(way);
    let moved = scaled(velocity * SETTINGS.horizon_s, Vec3::ZERO);
    let along: f64 = way.iter().zip(moved).map(|(w, m)| w / apart * m).sum();
    along + apart / 2.0 - 1.0
}

proptest! {
    #[test]
    fn the_velocity_is_the_nearest_of_the_cell(
        peers in proptest::collection::vec(vector(2.0), 0..=10),
        wanted in vector(0.6),
        others in proptest::collection::vec(vector(0.5), 200),
    ) {
        let apart = |peer: &Vec3| length(scaled(Vec3::ZERO, *peer)) > 2.0;
        let peers: Vec<Vec3> = peers.into_iter().filter(apart).collect();
        let safe = with_peers(WITHOUT_LAG, &peers).limit(Vec3::ZERO, Vec3::ZERO, wanted, 0);
        prop_assert!(matches!(safe.outcome, AvoidanceOutcome::Free | AvoidanceOutcome::Limited));
        let is_allowed = |velocity: Vec3, slack: f64| {
            velocity.length() <= 0.5 + 1e-5
                && peers.iter().all(|peer| room(Vec3::ZERO, *peer, velocity) >= -slack)
        };
        prop_assert!(is_allowed(safe.velocity_m_s, 1e-4), "{safe:?}");
        let short = wanted * (0.5 / wanted.length()).min(1.0);
        let distance = safe.velocity_m_s.distance(short);
        for other in others {
            let is_nearer = other.distance(short) < distance - 1e-4;
            prop_assert!(!(is_nearer && is_allowed(other, 0.0)), "{other} is nearer than {safe:?}");
        }
    }

    #[test]
    fn no_input_gives_a_number_that_is_not_finite(
        peers in proptest::collection::vec((any_vector(), any_vector()), 0..=10),
        near in proptest::collection::vec(vector(0.5), 0..=5),
        position in any_vector(),
        is_at_origin in any::<bool>(),
        velocity in any_vector(),
        wanted in any_vector(),
        now_ms in any::<u32>(),
    ) {
        let mut avoidance = Avoidance::<10>::new(0, SETTINGS).unwrap();
        for (id, peer) in (1..).zip(near) {
            let _ = avoidance.update_peer(report(id, peer, now_ms));
        }
        for (id, (position, velocity)) in (20..).zip(peers) {
            let velocity_m_s = Some(velocity);
            let far = report(id, position, now_ms);
            let _ = avoidance.update_peer(PeerReport { velocity_m_s, ..far });
        }
        let position = if is_at_origin { Vec3::ZERO } else { position };
        let safe = avoidance.limit(position, velocity, wanted, now_ms);
        prop_assert!(safe.velocity_m_s.length() <= 0.5 + 1e-4, "{safe:?}");
    }

    /// The guarantee of the module, for the shortest horizon. The motion between two commands is
    /// the closed form of the lag.
    #[test]
    fn ellipsoids_never_overlap_with_perfect_information(
        starts in proptest::collection::vec(vector(1.0), 2..=8),
        goals in proptest::collection::vec(vector(1.0), 8 * 8),
    ) {
        let settings = AvoidanceSettings { horizon_s: 0.1, ..SETTINGS };
        let mut positions: Vec<Vec3> = Vec::new();
        for start in starts {
            if positions.iter().all(|other| length(scaled(start, *other)) > 2.0) {
                positions.push(start);
            }
        }
        let mut velocities = vec![Vec3::ZERO; positions.len()];
        let mut swarm: Vec<Avoidance<10>> = (0..positions.len())
            .map(|id| Avoidance::new(id as u16, settings).unwrap())
            .collect();
        for tick in 0..80 {
            let now_ms = 100 * tick as u32;
            let mut commands = Vec::new();
            for (own, avoidance) in swarm.iter_mut().enumerate() {
                for (id, position) in positions.iter().enumerate().filter(|(id, _)| *id != own) {
                    let velocity_m_s = Some(velocities[id]);
                    let report = report(id as u16, *position, now_ms);
                    avoidance.update_peer(PeerReport { velocity_m_s, ..report }).unwrap();
                }
                let position = positions[own];
                // The goals change every second.
                let wanted = 10.0 * (goals[own + 8 * (tick / 10)] - position);
                let safe = avoidance.limit(position, velocities[own], wanted, now_ms);
                prop_assert!(safe.outcome != AvoidanceOutcome::Crowded);
                commands.push(safe.velocity_m_s);
            }
            for _ in 0..10 {
                let decay = (-0.01f32 / settings.lag_s).exp();
                for ((x, v), u) in positions.iter_mut().zip(&mut velocities).zip(&commands) {
                    *x += 0.01 * *u + settings.lag_s * (1.0 - decay) * (*v - *u);
                    *v = *u + decay * (*v - *u);
                }
                for (own, position) in positions.iter().enumerate() {
                    for other in &positions[..own] {
                        let apart = length(scaled(*position, *other));
                        prop_assert!(apart > 2.0 - 1e-3, "{apart} at {now_ms} ms");
                    }
                }
            }
        }
    }
}

#[test]
fn robots_at_the_same_point_separate() {
    for peer in [Vec3::ZERO, Vec3::new(0.0, 0.0, 0.05)] {
        let mut first = Avoidance::<10>::new(1, SETTINGS).unwrap();
        let mut second = Avoidance::<10>::new(2, SETTINGS).unwrap();
        first.update_peer(report(2, peer, 0)).unwrap();
        second.update_peer(report(1, Vec3::ZERO, 0)).unwrap();
        let up = first.limit(Vec3::ZERO, Vec3::ZERO, Vec3::ZERO, 0).velocity_m_s;
        let down = second.limit(peer, Vec3::ZERO, Vec3::ZERO, 0).velocity_m_s;
        assert!((up - down).length() > 0.5, "{up} {down}");
        assert!((up + down).length() < 1e-3, "{up} {down}");
    }
}

#[test]
fn robots_above_each_other_keep_a_longer_distance() {
    let command = |peer: Vec3| {
        with_peers(SETTINGS, &[peer]).limit(Vec3::ZERO, Vec3::ZERO, Vec3::ZERO, 0).velocity_m_s
    };
    // The ellipsoids touch at 1.8 m above each other and at 0.6 m next to each other.
    assert_eq!(command(Vec3::new(0.0, 0.0, 1.81)), Vec3::ZERO);
    assert_eq!(command(Vec3::new(0.61, 0.0, 0.0)), Vec3::ZERO);
    // 10 cm too near: each of both has to move 5 cm within the horizon of 0.5 s.
    assert!(command(Vec3::new(0.0, 0.0, 1.7)).distance(Vec3::new(0.0, 0.0, -0.1)) < 1e-5);
    assert!(command(Vec3::new(0.5, 0.0, 0.0)).distance(Vec3::new(-0.1, 0.0, 0.0)) < 1e-5);
}

#[test]
fn an_enclosed_robot_stops() {
    let peers = [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z].map(|v| 0.3 * v);
    let safe = with_peers(SETTINGS, &peers).limit(Vec3::ZERO, Vec3::ZERO, Vec3::X, 0);
    assert_eq!(safe.outcome, AvoidanceOutcome::Crowded);
    assert!(safe.velocity_m_s.length() < 1e-6);
}

#[test]
fn an_old_report_stops_but_does_not_push() {
    let forward = Vec3::new(0.3, 0.0, 0.0);
    let command = |wanted: Vec3, now_ms: u32| {
        let mut avoidance = with_peers(WITHOUT_LAG, &[Vec3::new(0.8, 0.0, 0.0)]);
        avoidance.limit(Vec3::ZERO, Vec3::ZERO, Vec3::ZERO, now_ms);
        avoidance.limit(Vec3::ZERO, Vec3::ZERO, wanted, now_ms).velocity_m_s
    };
    // 10 cm to the plane of a present robot, less 0.5 m/s · 0.2 s / 2 for an age of 0.2 s.
    assert!(command(forward, 0).distance(Vec3::new(0.2, 0.0, 0.0)) < 1e-5);
    assert!(command(forward, 200).distance(Vec3::new(0.1, 0.0, 0.0)) < 1e-5);
    assert!(command(forward, 1000).length() < 1e-5);
    assert!(command(Vec3::ZERO, 5000).length() < 1e-5);
    assert_eq!(command(forward, 5001), forward);
}

#[test]
fn walls_limit_the_velocity_and_push_back() {
    let walls = AvoidanceSettings {
        lowest_m: Vec3::new(-1.0, -1.0, 0.2),
        highest_m: Vec3::splat(1.0),
        ..WITHOUT_LAG
    };
    let command = |position: Vec3, wanted: Vec3| {
        with_peers(walls, &[]).limit(position, Vec3::ZERO, wanted, 0).velocity_m_s
    };
    let down = Vec3::new(0.1, 0.0, -0.4);
    assert!(command(Vec3::new(0.0, 0.0, 0.3), down).distance(Vec3::new(0.1, 0.0, -0.2)) < 1e-5);
    assert!(command(Vec3::new(0.0, 0.0, 0.1), down).distance(Vec3::new(0.1, 0.0, 0.2)) < 1e-5);
}

/// The documents state this size.
#[test]
fn an_avoidance_of_ten_robots_has_740_bytes() {
    assert_eq!(size_of::<Avoidance<10>>(), 740);
}

#[test]
fn wrong_input_is_refused() {
    let mut avoidance = Avoidance::<10>::new(3, SETTINGS).unwrap();
    assert_eq!(avoidance.update_peer(report(3, Vec3::X, 0)), Err(RefusedReport::OwnId));
    assert_eq!(avoidance.update_peer(report(4, Vec3::NAN, 0)), Err(RefusedReport::OutOfRange));
    let lost = avoidance.limit(Vec3::NAN, Vec3::ZERO, Vec3::X, 0);
    assert_eq!((lost.velocity_m_s, lost.outcome), (Vec3::ZERO, AvoidanceOutcome::Lost));
    let nowhere = avoidance.limit(Vec3::ZERO, Vec3::ZERO, Vec3::NAN, 0);
    assert_eq!(nowhere.velocity_m_s, Vec3::ZERO);
    for bad in [
        AvoidanceSettings { radius_m: 0.0, ..SETTINGS },
        AvoidanceSettings { horizon_s: f32::NAN, ..SETTINGS },
        AvoidanceSettings { lag_s: -0.1, ..SETTINGS },
        AvoidanceSettings { lowest_m: Vec3::ONE, highest_m: Vec3::ONE, ..SETTINGS },
    ] {
        assert!(Avoidance::<10>::new(0, bad).is_none(), "{bad:?}");
    }
}
