//! The body of a flying Crazyflie: the forces of its motors, and the truth that its sensors measure.

use bittybuzz_chips::Time;
use bittybuzz_crazyflie_physics::sensors::{
    Barometer, FlowCounts, FlowSensor, FlowSettings, HeightReading, HeightSensor, Imu, ImuCounts,
    ImuSettings,
};
use bittybuzz_crazyflie_physics::{Airframe, Drone, DroneState, DroneSurroundings};

/// Time of a step of the physics.
const STEP: Time = Time::from_millis(1);
/// Steps between two measurements of the pressure: 50 Hz, as Bitcraze's firmware sets the chip up.
const PRESSURE_STEPS: u64 = 20;

/// The measurements of a step, in the units of the chips.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Sensed {
    pub(crate) inertial: Option<ImuCounts>,
    pub(crate) flow: Option<FlowCounts>,
    pub(crate) range: Option<HeightReading>,
    /// Pressure in Pa.
    pub(crate) pressure_pa: Option<f64>,
}

/// A body in the physics of a Crazyflie 2.1+, with the sensors of the robot and of a Flow deck.
pub(crate) struct FlightBody {
    drone: Drone,
    imu: Imu,
    flow: FlowSensor,
    height: HeightSensor,
    barometer: Barometer,
    surroundings: DroneSurroundings,
    /// The end of the next step.
    next: Time,
}

impl FlightBody {
    /// Returns a body that stands on the ground from `now` on.
    ///
    /// # Parameters
    /// * `seed`: the build and the noise of its sensors.
    /// * `place_m`: position along x and y in m, and the yaw in radians.
    pub(crate) fn new(seed: u64, place_m: [f64; 2], yaw_rad: f64, now: Time) -> Self {
        let airframe = Airframe::CRAZYFLIE_2_1_PLUS;
        let mut drone = Drone::new(airframe, seed);
        drone.stand(0.0, place_m[0], place_m[1], yaw_rad);
        FlightBody {
            drone,
            imu: Imu::new(&airframe, ImuSettings::BMI088, seed),
            flow: FlowSensor::new(FlowSettings::PMW3901, seed),
            height: HeightSensor::new(seed),
            barometer: Barometer::new(seed),
            surroundings: DroneSurroundings::default(),
            next: now + STEP,
        }
    }

    /// Returns the end of the next step.
    pub(crate) fn next_step(&self) -> Time {
        self.next
    }

    /// Moves the body by the step that ends now.
    ///
    /// # Parameters
    /// `duties`: the duty of each motor, 0 to 1.
    pub(crate) fn step(&mut self, duties: [f64; 4]) -> Sensed {
        self.next = self.next + STEP;
        self.drone.step(duties, &self.surroundings);
        let state = self.drone.state();
        let ground_m = self.surroundings.ground_m;
        Sensed {
            inertial: self.imu.sample(state),
            flow: self.flow.sample(state, ground_m),
            range: self.height.sample(state, ground_m),
            pressure_pa: state
                .steps
                .is_multiple_of(PRESSURE_STEPS)
                .then(|| self.barometer.measure(state)),
        }
    }

    /// Returns the motion of the body.
    pub(crate) fn state(&self) -> &DroneState {
        self.drone.state()
    }

    /// Returns the voltage of the battery in V.
    pub(crate) fn battery_volts(&self) -> f64 {
        self.drone.battery_volts()
    }
}
