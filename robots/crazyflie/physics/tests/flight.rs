//! Flight, power and faults of a whole robot.

use bittybuzz_crazyflie_physics::{
    Airframe, DVec3, Drone, DroneState, DroneSurroundings, GRAVITY_M_S2, PowerSource, downwash_n,
};

const PLUS: Airframe = Airframe::CRAZYFLIE_2_1_PLUS;
const CALM: DroneSurroundings =
    DroneSurroundings { ground_m: 0.0, wind_m_s: DVec3::ZERO, external_force_n: DVec3::ZERO };

/// A robot in the air whose rotors turn at the speed of hover.
fn hovering(airframe: Airframe) -> (Drone, [f64; 4]) {
    let mut drone = Drone::nominal(airframe);
    let hover = airframe.hover_speed_rpm();
    // A duty that is a whole number of steps.
    let duty = 0.75;
    drone.set_power(PowerSource::Constant { volts: airframe.volts(hover) / duty });
    let start = DroneState::at_rest(DVec3::new(0.0, 0.0, 100.0), 0.0);
    drone.set_state(DroneState { rotor_rpm: [hover; 4], ..start });
    (drone, [duty; 4])
}

#[test]
fn hover_holds_the_height() {
    for airframe in [PLUS, Airframe::CRAZYFLIE_BRUSHLESS] {
        let (mut drone, duties) = hovering(airframe);
        for _ in 0..5000 {
            drone.step(duties, &CALM);
        }
        // The ground effect at 100 m is below a millionth of the thrust.
        let state = drone.state();
        assert!((state.position_m.z - 100.0).abs() < 1e-3, "{state:?}");
        assert!((state.specific_force_m_s2.z - GRAVITY_M_S2).abs() < 1e-4);
        assert!(state.rate_rad_s.length() < 1e-9);
    }
}

/// The timer of the 2.1+ counts to 255, so the motors know 256 duties, and never the whole voltage.
#[test]
fn the_motors_get_the_nearest_step_of_the_duty() {
    let end = |duty: f64| {
        let mut drone = Drone::nominal(PLUS);
        (0..100).for_each(|_| {
            drone.step([duty; 4], &CALM);
        });
        drone.state().rotor_rpm[0]
    };
    let step = 1.0 / 256.0;
    assert_eq!(end(0.75), end(0.75 + 0.49 * step));
    assert!(end(0.75) < end(0.75 + 0.51 * step));
    assert_eq!(end(1.0), end(255.0 * step));
    assert!(end(0.49 * step) == 0.0 && end(0.51 * step) > 0.0);
}

#[test]
fn free_fall_matches_the_closed_form() {
    let mut airframe = PLUS;
    airframe.drag_n_s_m = DVec3::ZERO;
    let mut drone = Drone::nominal(airframe);
    drone.set_state(DroneState::at_rest(DVec3::new(1.0, 2.0, 50.0), 0.4));
    for _ in 0..1000 {
        drone.step([0.0; 4], &CALM);
        assert!(drone.state().specific_force_m_s2.length() < 1e-9);
    }
    let state = drone.state();
    assert!((state.position_m.z - (50.0 - GRAVITY_M_S2 / 2.0)).abs() < 1e-9);
    assert!((state.velocity_m_s.z + GRAVITY_M_S2).abs() < 1e-9);
    assert!((state.seconds() - 1.0).abs() < 1e-12);
}

#[test]
fn a_full_battery_sags_and_empties() {
    let mut drone = Drone::nominal(PLUS);
    assert!((drone.battery_volts() - (4.2 - 0.2 * 0.24)).abs() < 1e-9);
    let hover = PLUS.hover_speed_rpm();
    for _ in 0..2000 {
        let duty = PLUS.volts(hover) / drone.battery_volts();
        drone.step([duty; 4], &CALM);
    }
    let PowerSource::Battery { charge } = drone.power() else { panic!("no battery") };
    let sag = PLUS.battery.open_circuit_volts(charge) - drone.battery_volts();
    // 2.34 A at hover by the bench, through 0.2 Ω.
    assert!((sag - 0.468).abs() < 0.01, "{sag}");
    assert!(charge < 1.0 && charge > 0.99);
    drone.set_power(PowerSource::Battery { charge: f64::NAN });
    assert_eq!(drone.power(), PowerSource::Battery { charge: 0.0 });
}

#[test]
fn a_weak_motor_tilts_the_robot_towards_it() {
    let (mut drone, duties) = hovering(PLUS);
    drone.set_motor_efficiency([0.8, 1.0, 1.0, 1.0]);
    for _ in 0..50 {
        drone.step(duties, &CALM);
    }
    // Motor 1 is ahead on the right: right side and nose go down.
    let rate = drone.state().rate_rad_s;
    assert!(rate.x > 0.5 && rate.y > 0.5, "{rate}");
}

#[test]
fn builds_differ_and_repeat() {
    let (one, same, other) = (Drone::new(PLUS, 1), Drone::new(PLUS, 1), Drone::new(PLUS, 2));
    assert_eq!(one, same);
    assert_ne!(one, other);
    assert_eq!(format!("{one:?}"), format!("{same:?}"));
}

#[test]
fn downwash_pushes_down() {
    let (mut drone, duties) = hovering(PLUS);
    let push = downwash_n(0.5, 0.0, PLUS.propeller_radius_m);
    let below = DroneSurroundings { external_force_n: DVec3::new(0.0, 0.0, -push), ..CALM };
    for _ in 0..100 {
        drone.step(duties, &below);
    }
    let exact = -push / PLUS.mass_kg * 0.1;
    assert!((drone.state().velocity_m_s.z / exact - 1.0).abs() < 0.05);
}

/// Nothing that a caller passes makes the state other than finite.
#[test]
fn invalid_inputs_leave_the_state_finite() {
    let mut drone = Drone::nominal(PLUS);
    drone.set_motor_efficiency([f64::NAN, 2.0, -1.0, 1.0]);
    let bad = [f64::NAN, f64::INFINITY, -1e300, 1e300];
    for step in 0..4000 {
        let value = |shift: usize| bad[(step + shift) % 4];
        let surroundings = DroneSurroundings {
            ground_m: if step % 7 == 0 { f64::NAN } else { 0.0 },
            wind_m_s: DVec3::new(value(0), value(1), value(2)),
            external_force_n: DVec3::new(value(2), value(3), 1e300),
        };
        drone.step([value(0), value(1), value(2), value(3)], &surroundings);
        let state = drone.state();
        assert!(state.position_m.is_finite() && state.attitude.is_finite(), "{state:?}");
        assert!(state.rate_rad_s.is_finite() && state.velocity_m_s.is_finite());
    }
}
