//! Runs one hovering robot with its inertial sensors for 20 seconds and prints its final state.
//!
//! It measures the cost of a step, for example by instruction counts:
//! `valgrind --tool=callgrind target/release/examples/step_cost`. A first argument replaces the
//! seconds, and a second one, `ground`, keeps the robot on the ground.

use bittybuzz_crazyflie_physics::sensors::{Imu, ImuSettings};
use bittybuzz_crazyflie_physics::{
    Airframe, DVec3, Drone, DroneState, DroneSurroundings, PowerSource,
};

fn main() {
    let mut arguments = std::env::args().skip(1);
    let seconds: u64 = arguments.next().and_then(|text| text.parse().ok()).unwrap_or(20);
    let is_on_ground = arguments.next().is_some_and(|text| text == "ground");

    let airframe = Airframe::CRAZYFLIE_2_1_PLUS;
    let mut drone = Drone::nominal(airframe);
    let mut imu = Imu::new(&airframe, ImuSettings::BMI088, 1);
    let hover = airframe.hover_speed_rpm();
    drone.set_power(PowerSource::Constant { volts: 4.0 });
    let mut duties = [0.0; 4];
    if !is_on_ground {
        let start = DroneState::at_rest(DVec3::new(0.0, 0.0, 2.0), 0.0);
        drone.set_state(DroneState { rotor_rpm: [hover; 4], ..start });
        duties = [airframe.volts(hover) / 4.0; 4];
    }
    let surroundings = DroneSurroundings::default();
    let mut counts = 0_i64;
    for _ in 0..seconds * 1000 {
        drone.step(duties, &surroundings);
        counts += imu.sample(drone.state()).map_or(0, |reading| i64::from(reading.accel[2]));
    }
    println!("{counts} counts\n{:?}", drone.state());
}
