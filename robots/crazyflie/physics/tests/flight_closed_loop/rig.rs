//! A robot with its flight controller.

use bittybuzz_crazyflie_physics::sensors::{
    FloorSurface, FlowCounts, FlowSensor, FlowSettings, HeightReading, HeightSensor, Imu,
    ImuSettings, MotionCapture, MotionCaptureSettings, SensorFault,
};
use bittybuzz_crazyflie_physics::{
    Airframe, DVec3, Drone, DroneState, DroneSurroundings, STEP_S, Wind,
};
use bittybuzz_flight::ekf::{FlowMeasurement, FlowSurface, PoseMeasurement, PositionMeasurement};
use bittybuzz_flight::planner::PositionFence;
use bittybuzz_flight::stack::{FlightStack, StackSettings};
use bittybuzz_flight::supervisor::SupervisorStage;
use bittybuzz_flight::{FlightState, ImuSample, MotorDuties};

/// Motion capture at 100 Hz with 1 mm, 10 ms late.
pub const CAPTURE: MotionCaptureSettings =
    MotionCaptureSettings { position_sigma_m: 0.001, ..MotionCaptureSettings::ROOM };

/// Time in seconds after the command to take off from which figures count.
pub const SETTLED_S: f64 = 5.0;

/// The sensors of the position.
pub enum Positioning {
    Capture(Box<MotionCapture>),
    Deck { flow: Box<FlowSensor>, height: Box<HeightSensor>, sigma_counts: f32 },
}

/// Measurements of the Flow deck in one millisecond.
#[derive(Clone, Copy, Debug, Default)]
pub struct DeckReadings {
    pub counts: Option<[f64; 2]>,
    pub range_m: Option<f64>,
}

/// Returns false for counts over a floor that shows no motion.
fn is_usable(counts: &FlowCounts) -> bool {
    let FlowCounts { quality, shutter, .. } = *counts;
    FlowSurface { quality, shutter }.sigma_counts().is_some()
}

/// A robot with its flight controller.
pub struct Rig {
    pub drone: Drone,
    pub stack: FlightStack,
    pub surroundings: DroneSurroundings,
    /// A wind that replaces that of the surroundings.
    pub wind: Option<Wind>,
    /// The age in seconds that the flight controller assumes for each pose in place of the true one.
    pub assumed_age_s: Option<f64>,
    /// The motion capture sends positions without attitudes.
    pub sends_positions: bool,
    /// The state of another robot, which the motion capture takes for this one.
    pub seen: Option<DroneState>,
    /// Measurements in the last millisecond.
    pub readings: DeckReadings,
    imu: Imu,
    positioning: Positioning,
    duties: MotorDuties,
}

impl Rig {
    /// A robot in a room with motion capture.
    pub fn with_capture(seed: u64) -> Self {
        Self::new(Positioning::Capture(Box::new(MotionCapture::new(CAPTURE, seed))), seed)
    }

    /// A Crazyflie 2.1+ of another build in a room with motion capture.
    pub fn with_airframe(airframe: Airframe, seed: u64) -> Self {
        let capture = Positioning::Capture(Box::new(MotionCapture::new(CAPTURE, seed)));
        Self::of_kind(airframe, StackSettings::CRAZYFLIE_2_1_PLUS, capture, seed)
    }

    /// A robot with a fence in a room with motion capture.
    pub fn with_fence(fence: PositionFence, seed: u64) -> Self {
        Self::with_settings(StackSettings { fence, ..StackSettings::CRAZYFLIE_2_1_PLUS }, seed)
    }

    /// A robot with other settings in a room with motion capture.
    pub fn with_settings(settings: StackSettings, seed: u64) -> Self {
        let capture = Positioning::Capture(Box::new(MotionCapture::new(CAPTURE, seed)));
        Self::of_kind(Airframe::CRAZYFLIE_2_1_PLUS, settings, capture, seed)
    }

    /// A Brushless in a room with motion capture.
    pub fn brushless_with_capture(seed: u64) -> Self {
        let capture = Positioning::Capture(Box::new(MotionCapture::new(CAPTURE, seed)));
        let settings = StackSettings::CRAZYFLIE_BRUSHLESS;
        Self::of_kind(Airframe::CRAZYFLIE_BRUSHLESS, settings, capture, seed)
    }

    /// A robot with a Flow deck.
    pub fn with_deck(seed: u64) -> Self {
        Self::with_flow_noise(seed, FlowSettings::PMW3901.sigma_counts)
    }

    /// A robot with a Flow deck whose flow has this noise, which the filter knows.
    pub fn with_flow_noise(seed: u64, sigma_counts: f64) -> Self {
        Self::with_assumed_flow_noise(seed, sigma_counts, sigma_counts)
    }

    /// A robot with a Flow deck whose flow has this noise, while the filter assumes another one.
    pub fn with_assumed_flow_noise(seed: u64, sigma_counts: f64, assumed_counts: f64) -> Self {
        let settings = FlowSettings { sigma_counts, ..FlowSettings::PMW3901 };
        let deck = Positioning::Deck {
            flow: Box::new(FlowSensor::new(settings, seed)),
            height: Box::new(HeightSensor::new(seed)),
            sigma_counts: assumed_counts as f32,
        };
        Self::new(deck, seed)
    }

    /// Sets or clears a fault of the motion capture.
    pub fn set_capture_fault(&mut self, fault: Option<SensorFault>) {
        if let Some(capture) = self.capture() {
            capture.set_fault(fault);
        }
    }

    /// Sets or clears a fault of the distance to the ground.
    pub fn set_range_fault(&mut self, fault: Option<SensorFault>) {
        if let Positioning::Deck { height, .. } = &mut self.positioning {
            height.set_fault(fault);
        }
    }

    /// Sets the time from the moment of a distance to the ground until it arrives, in ms.
    pub fn set_range_age(&mut self, ms: u64) {
        if let Positioning::Deck { height, .. } = &mut self.positioning {
            height.set_age_steps(ms);
        }
    }

    /// Replaces the floor that the flow sensor sees.
    pub fn set_surface(&mut self, surface: FloorSurface) {
        if let Positioning::Deck { flow, .. } = &mut self.positioning {
            flow.set_surface(surface);
        }
    }

    /// Returns the motion capture of a robot that has one.
    pub fn capture(&mut self) -> Option<&mut MotionCapture> {
        match &mut self.positioning {
            Positioning::Capture(capture) => Some(capture),
            Positioning::Deck { .. } => None,
        }
    }

    fn new(positioning: Positioning, seed: u64) -> Self {
        let settings = StackSettings::CRAZYFLIE_2_1_PLUS;
        Self::of_kind(Airframe::CRAZYFLIE_2_1_PLUS, settings, positioning, seed)
    }

    fn of_kind(
        airframe: Airframe,
        settings: StackSettings,
        positioning: Positioning,
        seed: u64,
    ) -> Self {
        let drone = Drone::new(airframe, seed);
        let at = FlightState {
            position_m: drone.state().position_m.as_vec3(),
            ..FlightState::default()
        };
        Rig {
            stack: FlightStack::new(settings, &at),
            imu: Imu::new(&airframe, ImuSettings::BMI088, seed),
            duties: MotorDuties::default(),
            surroundings: DroneSurroundings::default(),
            wind: None,
            assumed_age_s: None,
            sends_positions: false,
            seen: None,
            readings: DeckReadings::default(),
            positioning,
            drone,
        }
    }

    /// Advances by a millisecond.
    pub fn step(&mut self) {
        self.readings = DeckReadings::default();
        if let Some(wind) = &mut self.wind {
            self.surroundings.wind_m_s = wind.step();
        }
        self.drone.step(self.duties.0.map(f64::from), &self.surroundings);
        let state = *self.drone.state();
        self.measure(&state);
        if let Some(counts) = self.imu.sample(&state) {
            let sample = ImuSample {
                gyro_rad_s: counts.gyro_rad_s().as_vec3(),
                accel_m_s2: counts.accel_m_s2().as_vec3(),
            };
            let volts = self.drone.battery_volts() as f32;
            self.duties = self.stack.tick(Some(&sample), volts);
        }
    }

    fn measure(&mut self, state: &DroneState) {
        match &mut self.positioning {
            Positioning::Capture(capture) => {
                let seen =
                    self.seen.map_or(*state, |seen| DroneState { steps: state.steps, ..seen });
                let Some(pose) = capture.sample(&seen) else { return };
                let age_s = (state.steps - pose.steps) as f64 * STEP_S;
                let pose = PoseMeasurement {
                    position_m: pose.position_m.as_vec3(),
                    attitude: pose.attitude.as_quat(),
                    sigma_m: CAPTURE.position_sigma_m as f32,
                    sigma_rad: CAPTURE.attitude_sigma_rad as f32,
                    age_s: self.assumed_age_s.unwrap_or(age_s) as f32,
                };
                if self.sends_positions {
                    let PoseMeasurement { position_m, sigma_m, age_s, .. } = pose;
                    self.stack.receive_position(&PositionMeasurement {
                        position_m,
                        sigma_m,
                        age_s,
                    });
                } else {
                    self.stack.receive_pose(&pose);
                }
            }
            Positioning::Deck { flow, height, sigma_counts } => {
                let ground_m = self.surroundings.ground_m;
                if let Some(counts) = flow.sample(state, ground_m)
                    && counts.is_valid
                    && is_usable(&counts)
                {
                    self.readings.counts = Some([counts.x.into(), counts.y.into()]);
                    self.stack.receive_flow(&FlowMeasurement {
                        counts_x: counts.x.into(),
                        counts_y: counts.y.into(),
                        sigma_counts: *sigma_counts,
                        seconds: 0.01,
                    });
                }
                if let Some(HeightReading::Distance(mm)) = height.sample(state, ground_m) {
                    self.readings.range_m = Some(f64::from(mm) / 1000.0);
                    self.stack.receive_range(f32::from(mm) / 1000.0);
                }
            }
        }
    }

    /// Advances with signs of life of the script, and calls `each` every millisecond.
    pub fn run(&mut self, seconds: f64, mut each: impl FnMut(&mut Rig)) {
        for _ in 0..(seconds * 1000.0).round() as u64 {
            self.stack.renew();
            self.step();
            each(self);
        }
    }

    /// Switches on, arms and waits until the rotors idle.
    pub fn arm(&mut self) {
        for _ in 0..3000 {
            self.stack.renew();
            self.step();
            if self.stack.arm().is_ok() {
                break;
            }
        }
        self.run(0.3, |_| {});
        assert_eq!(self.stack.stage(), SupervisorStage::Armed);
    }

    /// Arms, takes off to a height above the ground in 2 s, and waits until figures count.
    pub fn take_off(&mut self, height_m: f32) {
        self.arm();
        self.stack.take_off(height_m, Some(2.0)).expect("no take-off");
        self.run(SETTLED_S, |_| {});
        assert_eq!(self.stack.stage(), SupervisorStage::Flying, "{:?}", self.drone.state());
    }

    /// Returns true if no motor is driven.
    pub fn motors_are_off(&self) -> bool {
        self.duties == MotorDuties::default()
    }

    /// Returns the distance in m between the body and the reference.
    pub fn true_error_m(&self) -> f64 {
        (self.drone.state().position_m - self.reference_m()).length()
    }

    /// Returns the distance in m between the estimate and the reference.
    pub fn own_error_m(&self) -> f64 {
        (self.stack.state().position_m.as_dvec3() - self.reference_m()).length()
    }

    /// Returns the position of the reference in m.
    pub fn reference_m(&self) -> DVec3 {
        self.stack.reference().expect("no reference").position_m.as_dvec3()
    }

    /// Returns the error of the estimated position in m.
    pub fn estimate_error_m(&self) -> DVec3 {
        self.stack.state().position_m.as_dvec3() - self.drone.state().position_m
    }
}
