//! The body of a flying Crazyflie: the forces of its motors, and the truth that its sensors measure.

use bittybuzz_chips::{BodyMotion, ExternalPose, Random, Time};
use bittybuzz_crazyflie_physics::sensors::{
    Barometer, FlowCounts, FlowSensor, FlowSettings, HeightReading, HeightSensor, Imu, ImuCounts,
    ImuSettings, MotionCapture, MotionCaptureSettings, SensorFault,
};
use bittybuzz_crazyflie_physics::{
    Airframe, DQuat, DVec3, Drone, DroneSurroundings, PowerSource, Wind, WindSettings,
};
use bittybuzz_emulation::message::{BodySensor, MeasurementFault, PoseErrors, Powertrain, Room};

/// Time of a step of the physics.
const STEP: Time = Time::from_millis(1);
/// Steps between two measurements of the pressure: 50 Hz, as Bitcraze's firmware sets the chip up.
const PRESSURE_STEPS: u64 = 20;
/// Steps between two reports of the motion.
const REPORT_STEPS: u64 = 20;

/// Height in m of the floor on which a body begins.
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
    /// A wind with gusts.
    wind: Option<Wind>,
    /// The probability that a pose is lost, and the losses.
    pose_loss: (f64, Random),
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
            wind: None,
            pose_loss: (0.0, Random::new(0)),
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
        if let Some(wind) = &mut self.wind {
            self.surroundings.wind_m_s = wind.step();
        }
        self.drone.step(duties, &self.surroundings);
        let state = self.drone.state();
        let floor_m = self.surroundings.ground_m;
        let is_due = |period| state.steps.is_multiple_of(period);
        let (loss, losses) = &mut self.pose_loss;
        let pose = self.capture.as_mut().and_then(|capture| capture.sample(state));
        let pose = pose.filter(|_| losses.unit() >= *loss);
        Sensed {
            inertial: self.imu.sample(state),
            pressure_pa: is_due(PRESSURE_STEPS).then(|| self.barometer.measure(state)),
            flow: self.flow.sample(state, floor_m),
            distance: self.height.measure(state, floor_m),
            pose: pose.map(|pose| ExternalPose {
                position_m: pose.position_m.as_vec3().to_array(),
                attitude: pose.attitude.as_quat().to_array(),
            }),
            motion: is_due(REPORT_STEPS).then(|| BodyMotion {
                position_m: state.position_m.to_array(),
                velocity_m_s: state.velocity_m_s.to_array(),
                attitude: state.attitude.to_array(),
                has_crashed: self.drone.has_crashed(),
                battery_volts: self.drone.battery_volts(),
                battery_charge: match self.drone.power() {
                    PowerSource::Battery { charge } => Some(charge),
                    PowerSource::Constant { .. } => None,
                },
            }),
        }
    }

    /// Gives the motors this voltage in V from now on, whatever they take.
    pub(crate) fn set_battery_volts(&mut self, volts: f64) {
        self.drone.set_power(PowerSource::Constant { volts });
    }

    /// Sets the air and the floor around the body.
    pub(crate) fn set_room(&mut self, room: &Room) {
        let mean_m_s = DVec3::from_array(room.wind_m_s);
        let (gust_sigma_m_s, gust_s) = (room.gusts_m_s, room.gust_s);
        let settings = WindSettings { mean_m_s, gust_sigma_m_s, gust_s };
        self.wind = (gust_sigma_m_s > 0.0).then(|| Wind::new(settings, room.seed));
        self.surroundings = DroneSurroundings {
            ground_m: room.floor_mm / 1000.0,
            wind_m_s: mean_m_s,
            external_force_n: DVec3::from_array(room.force_n),
        };
    }

    /// Sets the errors of poses from outside, if there are any.
    pub(crate) fn set_pose_errors(&mut self, errors: &PoseErrors) {
        self.pose_loss = (errors.lose, Random::new(errors.seed));
        let Some(capture) = &mut self.capture else { return };
        let marker_turn = DVec3::from_array(errors.marker_turn_degrees.map(f64::to_radians));
        capture.set_latency_steps(errors.latency_ms);
        capture.set_jump_m(DVec3::from_array(errors.jump_mm) / 1000.0);
        capture.set_turn(DQuat::from_rotation_z(errors.turn_degrees.to_radians()));
        capture.set_marker_turn(DQuat::from_scaled_axis(marker_turn));
    }

    /// Sets the motors and their power.
    pub(crate) fn set_powertrain(&mut self, powertrain: &Powertrain) {
        self.drone.set_motor_efficiency(powertrain.thrust_shares);
        if let Some(charge) = powertrain.charge {
            self.drone.set_power(PowerSource::Battery { charge });
        }
    }

    /// Sets or ends a fault of the measurements of a sensor.
    pub(crate) fn set_fault(&mut self, sensor: BodySensor, fault: Option<MeasurementFault>) {
        let fault = fault.map(|fault| match fault {
            MeasurementFault::Stuck => SensorFault::Stuck,
            MeasurementFault::Noisy(factor) => SensorFault::Noisy(factor),
            MeasurementFault::Silent => SensorFault::Silent,
        });
        match sensor {
            BodySensor::Inertial => self.imu.set_fault(fault),
            BodySensor::Flow => self.flow.set_fault(fault),
            BodySensor::Distance => self.height.set_fault(fault),
            BodySensor::Poses => {
                if let Some(capture) = &mut self.capture {
                    capture.set_fault(fault);
                }
            }
        }
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

    /// 15 m/s² upwards, less 9.81 m/s², are a way of 0.65 m in half a second, of which drag takes a
    /// part.
    #[test]
    fn forces_and_floors_act_on_the_body() {
        let (mut body, _) = measured([0.0; 4]);
        let force_n = [0.0, 0.0, 15.0 * body.drone.airframe().mass_kg];
        body.set_room(&Room { force_n, floor_mm: -200.0, ..Room::default() });
        (0..500).for_each(|_| {
            body.step([0.0; 4]);
        });
        let risen_m = body.drone.state().position_m.z;
        assert!((0.5..0.7).contains(&risen_m), "{risen_m}");
        body.set_room(&Room { floor_mm: -200.0, ..Room::default() });
        (0..3000).for_each(|_| {
            body.step([0.0; 4]);
        });
        assert!(body.drone.state().position_m.z < -0.1, "{:?}", body.drone.state());
    }

    /// A displacement and a turn of the frame by 90 degrees take (0.5, -0.25) to (0.25, 0.5) and 1 m
    /// further along x; later no pose comes.
    #[test]
    fn poses_have_the_errors_that_were_set() {
        let (mut body, _) = measured([0.0; 4]);
        let errors =
            PoseErrors { jump_mm: [1000.0, 0.0, 0.0], turn_degrees: 90.0, ..PoseErrors::default() };
        body.set_pose_errors(&errors);
        let poses = |body: &mut FlightBody| -> Vec<ExternalPose> {
            (0..500).filter_map(|_| body.step([0.0; 4]).pose).collect()
        };
        let [x, y, _] = poses(&mut body).pop().expect("poses").position_m;
        assert!((x - 1.25).abs() < 0.003 && (y - 0.5).abs() < 0.003, "{x} {y}");
        body.set_fault(BodySensor::Poses, Some(MeasurementFault::Silent));
        // Those on their way arrive.
        assert!(poses(&mut body).len() <= 1);
        body.set_fault(BodySensor::Poses, None);
        body.set_pose_errors(&PoseErrors { lose: 1.0, ..PoseErrors::default() });
        assert_eq!(poses(&mut body).len(), 0);
    }

    /// Equal duties tip a robot whose motors differ, but only after it has risen.
    #[test]
    fn motors_lift_the_body_and_take_charge() {
        let mut body = FlightBody::new(&SETTINGS, Time::ZERO);
        let idle_volts = body.battery_volts();
        let sensed: Vec<Sensed> = (0..300).map(|_| body.step([0.8; 4])).collect();
        let last = sensed.iter().filter_map(|one| one.motion).next_back().expect("reports");
        assert!(last.position_m[2] > 0.035 && !last.has_crashed, "{last:?}");
        assert!(last.battery_volts < idle_volts - 0.2, "{last:?}");
        let charge = last.battery_charge.expect("the battery gives the power");
        assert!((0.99..1.0).contains(&charge), "{charge}");
        body.set_battery_volts(3.5);
        let sensed: Vec<Sensed> = (0..20).map(|_| body.step([0.8; 4])).collect();
        let last = sensed.iter().filter_map(|one| one.motion).next_back().expect("reports");
        assert_eq!((last.battery_volts, last.battery_charge), (3.5, None));
    }
}
