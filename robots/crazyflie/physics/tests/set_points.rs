//! Set-points with any finite numbers: the robot flies on, in its fence.

use bittybuzz_crazyflie_physics::DVec3;
use bittybuzz_flight::planner::{Destination, PositionFence, VelocityCommand, VelocityFrame};
use bittybuzz_flight::stack::AttitudeCommand;
use bittybuzz_flight::supervisor::SupervisorStage;
use bittybuzz_flight::{Reference, Vec3};
use bittybuzz_random::Random;
use rayon::iter::{IntoParallelIterator, ParallelIterator};

use crate::flight_closed_loop::rig::Rig;

/// Largest distance outside the fence in m.
const EXCURSION_M_MAX: f64 = 0.3;
/// Commands of one flight, which is shorter than a charge of the battery.
const COMMANDS: u32 = 1000;

/// Returns a number of either sign: mostly of the size of flights, otherwise of any size.
fn number(random: &mut Random) -> f32 {
    let sign = if random.chance(0.5) { 1.0 } else { -1.0 };
    let exponent = if random.chance(0.7) { random.uniform(1.3) } else { random.uniform(38.5) };
    sign * 10f32.powf(exponent as f32)
}

fn vector(random: &mut Random) -> Vec3 {
    let mut part = || if random.chance(0.3) { 0.0 } else { number(random) };
    Vec3::new(part(), part(), part())
}

/// Gives a random command. A refused one leaves the last one in force.
fn command(rig: &mut Rig, random: &mut Random) {
    match random.below(5) {
        0 => {
            let _ = rig.stack.track(&Reference {
                position_m: vector(random),
                velocity_m_s: vector(random),
                acceleration_m_s2: vector(random),
                jerk_m_s3: vector(random),
                snap_m_s4: vector(random),
                yaw_rad: number(random),
                yaw_rate_rad_s: number(random),
            });
        }
        1 | 2 => {
            let _ = rig.stack.hold(&AttitudeCommand {
                roll_rad: number(random),
                pitch_rad: number(random),
                yaw_rate_rad_s: number(random),
                climb_m_s: number(random),
            });
        }
        3 => rig.stack.fly(&VelocityCommand {
            frame: if random.chance(0.5) { VelocityFrame::World } else { VelocityFrame::Yaw },
            velocity_m_s: vector(random),
            yaw_rate_rad_s: number(random),
        }),
        _ => {
            let position_m = vector(random);
            let yaw_rad = Some(number(random));
            let _ = rig.stack.go_to(Destination::Absolute { position_m, yaw_rad }, None);
        }
    }
}

/// Returns the largest distance outside the fence in m of flights with these numbers. The fence of every
/// other flight reaches the ground, and the robot may land there.
fn fly(seeds: std::ops::Range<u64>) -> f64 {
    let corner = Vec3::new(1.5, 1.5, 2.0);
    let mut worst_m = 0.0f64;
    for seed in seeds {
        let has_ground = seed % 2 == 1;
        let floor_m = if has_ground { 0.0 } else { 0.4 };
        let fence = PositionFence::new((-corner).with_z(floor_m), corner).expect("a box");
        let mut random = Random::new(seed);
        let mut rig = Rig::with_fence(fence, seed);
        rig.take_off(0.8);
        'flight: for number in 0..COMMANDS {
            command(&mut rig, &mut random);
            // Some commands last for one step of the controller, some until the robot has stopped.
            let ms = 2 + random.below(if number % 20 == 0 { 2000 } else { 100 });
            for _ in 0..ms {
                rig.run(0.001, |_| {});
                let here_m = rig.drone.state().position_m;
                let (least_m, most_m) = (fence.least_m().as_dvec3(), fence.most_m().as_dvec3());
                worst_m = worst_m.max((here_m - here_m.clamp(least_m, most_m)).length());
                let stage = rig.stack.stage();
                assert!(!rig.drone.has_crashed(), "{seed}, {number}: {here_m}");
                if has_ground && stage == SupervisorStage::Landed {
                    break 'flight;
                }
                assert_eq!(stage, SupervisorStage::Flying, "{seed}, {number}: {here_m}");
            }
        }
    }
    worst_m
}

#[test]
fn any_finite_set_point_keeps_the_robot_flying_in_its_fence() {
    let worst_m = fly(0..5);
    println!("{worst_m:.3} m outside the fence");
    assert!(worst_m <= EXCURSION_M_MAX, "{worst_m}");
}

/// A million commands on all processors.
#[test]
#[ignore = "`cargo xtask soak claims` runs it"]
fn a_million_set_points_keep_the_robot_flying_in_its_fence() {
    let worst = (1000..2000_u64).into_par_iter().map(|seed| fly(seed..seed + 1));
    let worst_m = worst.reduce(|| 0.0, f64::max);
    println!("{worst_m:.3} m outside the fence");
    assert!(worst_m <= EXCURSION_M_MAX, "{worst_m}");
}

/// The fence of a robot whose pilot leans on its border.
#[test]
fn a_robot_that_is_pushed_over_the_border_comes_back() {
    let corner = Vec3::new(1.0, 1.0, 2.0);
    let fence = PositionFence::new((-corner).with_z(0.0), corner).expect("a box");
    let mut rig = Rig::with_fence(fence, 3);
    rig.take_off(0.8);
    for pitch_rad in [0.5, -0.5] {
        let command = AttitudeCommand { pitch_rad, ..AttitudeCommand::default() };
        rig.stack.hold(&command).expect("no flight");
        let mut worst_m = 0.0f64;
        rig.run(6.0, |rig| worst_m = worst_m.max(rig.drone.state().position_m.x.abs() - 1.0));
        println!("{worst_m:.3} m outside at a pitch of {pitch_rad}");
        assert!(worst_m <= EXCURSION_M_MAX, "{worst_m}");
        let here_m: DVec3 = rig.drone.state().position_m;
        assert!(here_m.x * f64::from(pitch_rad.signum()) > 0.7, "{here_m}");
    }
}
