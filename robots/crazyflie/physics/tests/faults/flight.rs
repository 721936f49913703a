//! One flight with a fault, and what was observed.

use bittybuzz_crazyflie_physics::sensors::{HeightReading, SensorFault, SensorSuite};
use bittybuzz_crazyflie_physics::{
    Airframe, DVec3, Drone, DroneState, DroneSurroundings, PowerSource, STEP_S,
};
use bittybuzz_flight::ekf::{FlowMeasurement, PoseMeasurement};
use bittybuzz_flight::planner::{PositionFence, VelocityCommand};
use bittybuzz_flight::stack::{FlightStack, StackSettings};
use bittybuzz_flight::supervisor::SupervisorStage;
use bittybuzz_flight::{FlightState, ImuSample, MotorDuties, Vec3};
use bittybuzz_random::Random;

use crate::faults::fault::{FaultKind, PositionSource, Scenario};
use crate::faults::pilot::{COMMAND_TICKS, Pilot};

/// Corners of the fence in m.
const FENCE_MIN_M: Vec3 = Vec3::new(-1.0, -1.0, 0.0);
const FENCE_MAX_M: Vec3 = Vec3::new(1.0, 1.0, 1.5);
/// Height in m below which a robot may land without a position. It judges by its own estimate above the
/// ground, 0.15 m, which is wrong by up to 5 cm after half a second without a pose; its middle is 15 mm
/// above its feet.
const LOW_M: f64 = 0.215;
/// Time in seconds for which the pilot flies on after a fault.
const FLIGHT_AFTER_FAULT_S: f64 = 7.0;
/// Longest flight after a fault in seconds. The supervisor ends a descent after 30 s.
const AFTER_FAULT_S_MAX: f64 = 45.0;
/// Time in seconds for which a robot with motors off is observed.
const OBSERVED_S: f64 = 2.0;

/// Observations of a flight.
#[derive(Clone, Debug)]
pub struct Observations {
    /// Height at the time of the fault in m.
    pub fault_height_m: f64,
    /// Largest distance outside the fence in m while the flight controller had a position.
    pub excursion_m: f64,
    /// Largest distance outside the fence in m in the whole flight.
    pub whole_excursion_m: f64,
    /// Longest time in ms for which the robot followed its path without a position.
    pub blind_following_ms: u64,
    /// Time in ms from the fault until motors were off for good; `None` if they never were.
    pub off_after_ms: Option<u64>,
    /// Time in ms from the crash until motors were off for good.
    pub off_after_crash_ms: Option<u64>,
    /// Time in ms for which motors ran while the supervisor had recognized a crash or had locked.
    pub forbidden_ms: u64,
    /// The robot crashed by the criteria of the physics.
    pub has_crashed: bool,
    /// The supervisor took the shock of a landing for a crash.
    pub has_false_crash: bool,
    /// The robot stands on its feet with motors off.
    pub stands: bool,
    /// Speed of the last impact on the ground in m/s.
    pub impact_m_s: f64,
    /// Stages of the supervisor since the fault, with the time in ms after it.
    pub stages: Vec<(u64, SupervisorStage)>,
}

impl Observations {
    /// Returns the time in ms after the fault at which the robot stopped following the pilot, unless
    /// the pilot was silent by then.
    pub fn found_ms(&self) -> Option<u64> {
        let is_end = |(_, stage): &&(u64, SupervisorStage)| *stage != SupervisorStage::Flying;
        let ms = self.stages.iter().find(is_end).map(|(ms, _)| *ms)?;
        ((ms as f64) < FLIGHT_AFTER_FAULT_S * 1000.0).then_some(ms)
    }

    /// Returns true if the robot landed upright.
    pub fn has_landed(&self) -> bool {
        self.stands && !self.has_crashed
    }
}

/// A robot in its room.
struct Room {
    drone: Drone,
    sensors: SensorSuite,
    stack: FlightStack,
    duties: MotorDuties,
    /// Probability that a pose does not arrive.
    loss: f64,
    radio: Random,
    source: PositionSource,
}

fn settings() -> StackSettings {
    let mut settings = StackSettings::CRAZYFLIE_2_1_PLUS;
    settings.fence = PositionFence::new(FENCE_MIN_M, FENCE_MAX_M).expect("a box");
    settings
}

fn outside_m(position_m: DVec3) -> f64 {
    let nearest = position_m.clamp(FENCE_MIN_M.as_dvec3(), FENCE_MAX_M.as_dvec3());
    position_m.distance(nearest)
}

impl Room {
    fn new(scenario: &Scenario) -> Self {
        let airframe = Airframe::CRAZYFLIE_2_1_PLUS;
        let drone = Drone::new(airframe, scenario.seed);
        let at = FlightState {
            position_m: drone.state().position_m.as_vec3(),
            ..FlightState::default()
        };
        Room {
            sensors: SensorSuite::new(&airframe, scenario.seed),
            stack: FlightStack::new(settings(), &at),
            duties: MotorDuties::default(),
            loss: 0.0,
            radio: Random::new(scenario.seed ^ 0x7ad1),
            source: scenario.source,
            drone,
        }
    }

    fn begin(&mut self, scenario: &Scenario) {
        let noisy = Some(SensorFault::Noisy(scenario.noise_factor));
        let (stuck, silent) = (Some(SensorFault::Stuck), Some(SensorFault::Silent));
        match scenario.kind {
            FaultKind::ImuStuck => self.sensors.imu.set_fault(stuck),
            FaultKind::ImuNoisy => self.sensors.imu.set_fault(noisy),
            FaultKind::ImuSilent => self.sensors.imu.set_fault(silent),
            FaultKind::FlowStuck => self.sensors.flow.set_fault(stuck),
            FaultKind::FlowNoisy => self.sensors.flow.set_fault(noisy),
            FaultKind::FlowSilent => self.sensors.flow.set_fault(silent),
            FaultKind::RangeStuck => self.sensors.height.set_fault(stuck),
            FaultKind::RangeNoisy => self.sensors.height.set_fault(noisy),
            FaultKind::RangeSilent => self.sensors.height.set_fault(silent),
            FaultKind::CaptureStuck => self.sensors.motion_capture.set_fault(stuck),
            FaultKind::CaptureNoisy => self.sensors.motion_capture.set_fault(noisy),
            FaultKind::CaptureSilent => self.sensors.motion_capture.set_fault(silent),
            FaultKind::PosesLost => self.loss = scenario.loss,
            FaultKind::PoseJump => self.sensors.motion_capture.set_jump_m(scenario.jump_m),
            FaultKind::WeakMotor => {
                let mut shares = [1.0; 4];
                shares[scenario.motor] = 0.8;
                self.drone.set_motor_efficiency(shares);
            }
            FaultKind::EmptyBattery => self.drone.set_power(match scenario.volts {
                Some(volts) => PowerSource::Constant { volts },
                None => PowerSource::Battery { charge: scenario.charge },
            }),
            FaultKind::ScriptFault => self.stack.set_script_fault(true),
            // The script is silent.
            FaultKind::CommandsLost | FaultKind::StuckScript => {}
        }
    }

    /// Advances by 1 ms: a step of the physics and one of the flight controller.
    fn tick(&mut self) {
        self.drone.step(self.duties.0.map(f64::from), &DroneSurroundings::default());
        let state = *self.drone.state();
        self.measure_position(&state);
        let sample = self.sensors.imu.sample(&state).map(|counts| ImuSample {
            gyro_rad_s: counts.gyro_rad_s().as_vec3(),
            accel_m_s2: counts.accel_m_s2().as_vec3(),
        });
        let volts = self.drone.battery_volts() as f32;
        self.duties = self.stack.tick(sample.as_ref(), volts);
    }

    fn measure_position(&mut self, state: &DroneState) {
        match self.source {
            PositionSource::MotionCapture => {
                let Some(pose) = self.sensors.motion_capture.sample(state) else { return };
                let unit = self.radio.unit();
                if unit >= self.loss {
                    self.stack.receive_pose(&PoseMeasurement {
                        position_m: pose.position_m.as_vec3(),
                        attitude: pose.attitude.as_quat(),
                        sigma_m: 0.001,
                        sigma_rad: 0.01,
                        age_s: ((state.steps - pose.steps) as f64 * STEP_S) as f32,
                    });
                }
            }
            PositionSource::FlowDeck => {
                if let Some(counts) = self.sensors.flow.sample(state, 0.0)
                    && counts.is_valid
                {
                    self.stack.receive_flow(&FlowMeasurement {
                        counts_x: counts.x.into(),
                        counts_y: counts.y.into(),
                        sigma_counts: 2.0,
                        seconds: 0.01,
                    });
                }
                if let Some(HeightReading::Distance(mm)) = self.sensors.height.sample(state, 0.0) {
                    self.stack.receive_range(f32::from(mm) / 1000.0);
                }
            }
        }
    }

    fn is_off(&self) -> bool {
        self.duties == MotorDuties::default()
    }

    fn is_flying(&self) -> bool {
        use SupervisorStage::{Flying, Landing, LevelOut};
        matches!(self.stack.stage(), Flying | Landing | LevelOut)
    }

    fn is_stopped(&self) -> bool {
        matches!(self.stack.stage(), SupervisorStage::Crashed | SupervisorStage::Locked)
    }
}

/// Flies until the time of the fault, which is about to begin.
fn fly_to_fault(room: &mut Room, pilot: &mut Pilot, scenario: &Scenario) {
    let mut ticks: u64 = 0;
    let mut flown: Option<u64> = None;
    loop {
        if ticks.is_multiple_of(COMMAND_TICKS) {
            if room.stack.stage() == SupervisorStage::Preflight {
                room.stack.fly(&VelocityCommand::STOP);
            } else {
                room.stack.fly(&pilot.command(&room.stack.state()));
                // A person arms once the robot is ready; later requests are refused.
                let _ = room.stack.arm();
            }
        }
        room.tick();
        ticks += 1;
        if let Some(flown) = &mut flown {
            *flown += 1;
            if *flown as f64 / 1000.0 >= scenario.fault_after_s {
                return;
            }
        } else if room.stack.stage() == SupervisorStage::Flying {
            flown = Some(0);
        }
        assert!(ticks < 20_000, "no flight: {:?} {:?}", scenario, room.stack.stage());
    }
}

/// Flies a scenario to its end.
pub fn fly(scenario: &Scenario) -> Observations {
    let mut room = Room::new(scenario);
    let mut pilot = Pilot::new(scenario.pilot.clone());
    fly_to_fault(&mut room, &mut pilot, scenario);
    let mut found = Observations {
        fault_height_m: room.drone.state().position_m.z,
        excursion_m: 0.0,
        whole_excursion_m: 0.0,
        blind_following_ms: 0,
        off_after_ms: None,
        off_after_crash_ms: None,
        forbidden_ms: 0,
        has_crashed: false,
        has_false_crash: false,
        stands: false,
        impact_m_s: 0.0,
        stages: Vec::new(),
    };
    room.begin(scenario);
    let is_silent_script = matches!(
        scenario.kind,
        FaultKind::CommandsLost | FaultKind::ScriptFault | FaultKind::StuckScript
    );
    let mut crash_ms = None;
    let mut blind_ms = 0;
    for ms in 0..(AFTER_FAULT_S_MAX * 1000.0) as u64 {
        // A pilot goes on after a crash, which must not start the motors.
        let has_pilot = (room.is_flying() || room.is_stopped())
            && (room.is_stopped() || (ms as f64) < FLIGHT_AFTER_FAULT_S * 1000.0)
            && !is_silent_script;
        if has_pilot && ms.is_multiple_of(COMMAND_TICKS) {
            room.stack.fly(&pilot.command(&room.stack.state()));
        }
        room.tick();
        let stage = room.stack.stage();
        if found.stages.last().is_none_or(|(_, last)| *last != stage) {
            found.stages.push((ms, stage));
        }
        if room.drone.has_crashed() && crash_ms.is_none() {
            crash_ms = Some(ms);
        }
        if room.is_off() {
            found.off_after_ms = found.off_after_ms.or(Some(ms));
            let off_after_crash = crash_ms.map(|crash| ms - crash);
            found.off_after_crash_ms = found.off_after_crash_ms.or(off_after_crash);
        } else {
            found.off_after_ms = None;
            found.off_after_crash_ms = None;
            found.forbidden_ms += u64::from(room.is_stopped());
        }
        let excursion_m = outside_m(room.drone.state().position_m);
        found.whole_excursion_m = found.whole_excursion_m.max(excursion_m);
        let health = room.stack.health();
        if !room.is_flying() || room.drone.state().position_m.z < LOW_M {
            blind_ms = 0;
        } else if health.is_position_valid && health.is_height_valid {
            found.excursion_m = found.excursion_m.max(excursion_m);
            blind_ms = 0;
        } else if matches!(stage, SupervisorStage::Flying | SupervisorStage::Landing) {
            blind_ms += 1;
            found.blind_following_ms = found.blind_following_ms.max(blind_ms);
        }
        let is_observed = |off_ms: u64| ms >= off_ms + (OBSERVED_S * 1000.0) as u64;
        if found.off_after_ms.is_some_and(is_observed) {
            break;
        }
    }
    let state = room.drone.state();
    found.has_crashed = room.drone.has_crashed();
    found.has_false_crash = !found.has_crashed && room.stack.stage() == SupervisorStage::Crashed;
    found.stands = room.is_off()
        && room.drone.contact().is_touching()
        && state.velocity_m_s.length() < 0.01
        && state.tilt_rad() < 0.1;
    found.impact_m_s = room.drone.contact().last_impact().map_or(0.0, |impact| impact.speed_m_s);
    found
}
