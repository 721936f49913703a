//! The body of a flying Crazyflie: the forces of its motors, and the truth that its sensors measure.

use bittybuzz_chips::{BodyMotion, ExternalPose, Time};
use bittybuzz_crazyflie_physics::sensors::{
    Barometer, FlowCounts, FlowSensor, FlowSettings, HeightReading, HeightSensor, Imu, ImuCounts,
    ImuSettings, MotionCapture, MotionCaptureSettings,
};
use bittybuzz_crazyflie_physics::{Airframe, Drone, DroneSurroundings, PowerSource};

/// Time of a step of the physics.
const STEP: Time = Time::from_millis(1);
/// Steps between two measurements of the pressure: 50 Hz, as Bitcraze's firmware sets the chip up.
const PRESSURE_STEPS: u64 = 20;
/// Steps between two reports of the motion.
const REPORT_STEPS: u64 = 20;

/// Height of the floor in m.
const FLOOR_M: f64 = 0.0;

/// The place where a body begins, and the room around it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BodySettings {
    /// The build, and the noise of the sensors.
    pub seed: u64,
    /// Position along x and y in m.
    pub place_m: [f64; 2],
    /// Direction of the robot's nose in radians, from x towards y.
    pub yaw_rad: f64,
    /// Poses from outside that the robot gets by radio, if any.
    pub poses: Option<PoseSource>,
}

/// A source of poses outside of the robot. They are 10 ms late, and 1 % of them is lost.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PoseSource {
    /// Time in ms between two poses.
    pub period_ms: u32,
    /// Standard deviation of each coordinate in m.
    pub position_sigma_m: f64,
    /// Standard deviation of the rotation about each axis in radians.
    pub attitude_sigma_rad: f64,
}

/// The measurements of a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Sensed {
    /// Counts of the inertial sensors.
    pub(crate) inertial: Option<ImuCounts>,
    /// Pressure in Pa.
    pub(crate) pressure_pa: Option<f64>,
    /// The motion of the ground in the image of a Flow deck.
    pub(crate) flow: Option<FlowCounts>,
    /// The distance to the ground along the axis of a Flow deck.
    pub(crate) distance: HeightReading,
    /// A pose that arrived by radio.
    pub(crate) pose: Option<ExternalPose>,
    /// The true motion, if a report is due.
    pub(crate) motion: Option<BodyMotion>,
}

/// A body in the physics of a Crazyflie 2.1+, with its sensors.
pub(crate) struct FlightBody {
    drone: Drone,
    imu: Imu,
    barometer: Barometer,
    flow: FlowSensor,
    height: HeightSensor,
    capture: Option<MotionCapture>,
    surroundings: DroneSurroundings,
    /// The end of the next step.
    next: Time,
}

impl FlightBody {
    /// Returns a body that stands on the ground from `now` on.
    pub(crate) fn new(settings: &BodySettings, now: Time) -> Self {
        let BodySettings { seed, place_m, yaw_rad, poses } = *settings;
        let airframe = Airframe::CRAZYFLIE_2_1_PLUS;
        let mut drone = Drone::new(airframe, seed);
        drone.stand(FLOOR_M, place_m[0], place_m[1], yaw_rad);
        FlightBody {
            drone,
            imu: Imu::new(&airframe, ImuSettings::BMI088, seed),
            barometer: Barometer::new(seed),
            flow: FlowSensor::new(FlowSettings::PMW3901, seed),
            height: HeightSensor::new(seed),
            capture: poses.map(|poses| {
                let PoseSource { period_ms, position_sigma_m, attitude_sigma_rad } = poses;
                let source = MotionCaptureSettings {
                    period_steps: period_ms,
                    position_sigma_m,
                    attitude_sigma_rad,
                    ..MotionCaptureSettings::ROOM
                };
                MotionCapture::new(source, seed)
            }),
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
        let is_due = |period| state.steps.is_multiple_of(period);
        let pose = self.capture.as_mut().and_then(|capture| capture.sample(state));
        Sensed {
            inertial: self.imu.sample(state),
            pressure_pa: is_due(PRESSURE_STEPS).then(|| self.barometer.measure(state)),
            flow: self.flow.sample(state, FLOOR_M),
            distance: self.height.measure(state, FLOOR_M),
            pose: pose.map(|pose| ExternalPose {
                position_m: pose.position_m.as_vec3().to_array(),
                attitude: pose.attitude.as_quat().to_array(),
            }),
            motion: is_due(REPORT_STEPS).then(|| BodyMotion {
                position_m: state.position_m.to_array(),
                velocity_m_s: state.velocity_m_s.to_array(),
                attitude: state.attitude.to_array(),
                has_crashed: self.drone.has_crashed(),
            }),
        }
    }

    /// Gives the motors this voltage in V from now on, whatever they take.
    pub(crate) fn set_battery_volts(&mut self, volts: f64) {
        self.drone.set_power(PowerSource::Constant { volts });
    }

    /// Returns the voltage of the battery in V.
    pub(crate) fn battery_volts(&self) -> f64 {
        self.drone.battery_volts()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const POSES: PoseSource =
        PoseSource { period_ms: 10, position_sigma_m: 0.0005, attitude_sigma_rad: 0.005 };
    const SETTINGS: BodySettings =
        BodySettings { seed: 1, place_m: [0.5, -0.25], yaw_rad: 0.0, poses: Some(POSES) };

    /// Returns the measurements of a body that stands for a second, and then has these duties for one.
    fn measured(duties: [f64; 4]) -> (FlightBody, Vec<Sensed>) {
        let mut body = FlightBody::new(&SETTINGS, Time::ZERO);
        let mut sensed: Vec<Sensed> = (0..1000).map(|_| body.step([0.0; 4])).collect();
        sensed.extend((0..1000).map(|_| body.step(duties)));
        (body, sensed)
    }

    /// 1 g is 1,365 of 65,536 counts for 48 g, within the offset of 20 mg and vibration.
    #[test]
    fn a_standing_body_measures_its_weight() {
        let (body, sensed) = measured([0.0; 4]);
        assert_eq!(body.next_step(), Time::from_millis(2001));
        let up = sensed.iter().filter_map(|one| one.inertial).map(|counts| counts.accel[2]);
        assert!(up.clone().count() == 2000 && up.into_iter().all(|z| (z - 1365).abs() < 60));
        let pressures = sensed.iter().filter_map(|one| one.pressure_pa);
        assert!(
            pressures.clone().count() == 100
                && pressures.into_iter().all(|pa| (pa - 101_325.0).abs() < 6.0)
        );
    }

    /// Poses come each 10 ms, 10 ms late, and 1 % of them is lost; reports each 20 ms.
    #[test]
    fn poses_and_reports_have_their_rates() {
        let (_, sensed) = measured([0.0; 4]);
        let poses: Vec<ExternalPose> = sensed.iter().filter_map(|one| one.pose).collect();
        assert!((190..=199).contains(&poses.len()), "{}", poses.len());
        assert!(poses.iter().all(|pose| (pose.position_m[0] - 0.5).abs() < 0.004));
        assert_eq!(sensed.iter().filter(|one| one.motion.is_some()).count(), 100);
    }

    /// Equal duties tip a robot whose motors differ, but only after it has risen.
    #[test]
    fn motors_lift_the_body_and_take_charge() {
        let mut body = FlightBody::new(&SETTINGS, Time::ZERO);
        let idle_volts = body.battery_volts();
        let sensed: Vec<Sensed> = (0..300).map(|_| body.step([0.8; 4])).collect();
        let last = sensed.iter().filter_map(|one| one.motion).next_back().expect("reports");
        assert!(last.position_m[2] > 0.035 && !last.has_crashed, "{last:?}");
        assert!(body.battery_volts() < idle_volts - 0.2);
    }
}
