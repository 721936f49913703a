//! The body of a Crazyflie with `fidelity = "flight"`: the flight controller of [`bittybuzz_flight`] at
//! its own rates, in the physics of [`bittybuzz_crazyflie_physics`].
//!
//! # Surroundings
//! A body feels the wind, and the downwash of robots above it. Obstacles below it are its floor: its
//! sensors see them, and it lands on them. The radio of poses is late, and its latency can sway.
//!
//! # Simplifications
//! * Floor and downwash change once in a tick. Every robot above pushes as a Crazyflie that hovers.
//! * The world resolves contacts: it moves the body, which loses its speed in that direction.
//! * The estimate starts at the true pose, as a robot does that is put on a known place.

use bittybuzz_arena::engine::{Attitude, Body, BodySurroundings, Pose, Stream, wrap};
use bittybuzz_arena::robot::PoseError;
use bittybuzz_crazyflie_physics::sensors::{
    FloorSurface, FlowSensor, FlowSettings, HeightReading, HeightSensor, Imu, ImuSettings,
    MotionCapture, MotionCaptureSettings,
};
use bittybuzz_crazyflie_physics::{
    Airframe, DQuat, DVec3, Drone, DroneState, DroneSurroundings, PowerSource, STEP_S, Wind,
    WindSettings, downwash_n,
};
use bittybuzz_flight::ekf::{FlowMeasurement, FlowSurface, PoseMeasurement};
use bittybuzz_flight::stack::{FlightStack, StackSettings};
use bittybuzz_flight::{FlightState, ImuSample, MotorDuties, Vec3};

use crate::{CrazyflieModel, FlightSurroundings, Positioning};

/// The flight controller that a brain commands, and the voltage that it measures.
#[derive(Clone, Debug)]
pub struct FlightControls {
    /// The flight controller.
    pub stack: Box<FlightStack>,
    /// Voltage of the battery in mV that an event of the scenario has set.
    pub battery_setting_mv: Option<u16>,
    /// Voltage of the battery in mV.
    pub battery_mv: u16,
    /// The errors of poses from outside that events of the scenario have caused.
    pub pose_error: PoseError,
}

/// The robot that the source of poses takes for this one.
#[derive(Clone, Copy, Debug)]
enum SeenRobot {
    /// Itself.
    Own,
    /// Another robot, with its state at the begin of the substep.
    Other(DroneState),
    /// A robot that the source does not see.
    None,
}

/// A source of position and attitude in the room.
#[derive(Clone, Debug)]
enum PositionSource {
    /// Poses from outside: motion capture, Lighthouse or Loco.
    Outside { source: Box<MotionCapture>, sigma_m: f32, sigma_rad: f32, latency: PoseLatency },
    /// The Flow deck's two sensors.
    Deck { flow: Box<FlowSensor>, height: Box<HeightSensor> },
}

/// The latency of poses in steps of the physics: a mean, and an amplitude of its sway.
#[derive(Clone, Copy, Debug)]
struct PoseLatency {
    mean: f64,
    sway: f64,
}

impl PoseLatency {
    /// Returns the latency at a step.
    fn at(&self, steps: u64) -> u32 {
        let phase = steps as f64 * STEP_S / SWAY_S * core::f64::consts::TAU;
        (self.mean + self.sway * libm::sin(phase)).round() as u32
    }
}

/// A Crazyflie's body with its flight controller.
#[derive(Clone, Debug)]
pub struct FlyingBody {
    controls: FlightControls,
    drone: Drone,
    wind: Option<Wind>,
    /// The floor below the robot and the force of downwash, for this tick.
    around: DroneSurroundings,
    seen: SeenRobot,
    imu: Imu,
    position: PositionSource,
    settings: StackSettings,
    duties: MotorDuties,
    /// The pose at the end of the last substep. The world moves the body if it has another one.
    pose: Pose,
    /// Time in seconds that the world is ahead of the physics, less than a step.
    behind_s: f64,
}

/// Time in seconds of the physics in one substep of the world, with the size of a body in m.
#[derive(Clone, Copy, Debug)]
pub struct FlyingStep {
    seconds: f64,
    radius_m: f64,
}

/// Steps of the physics in a millisecond.
const STEPS_PER_MS: f64 = 0.001 / STEP_S;
/// Age in seconds that the robot assumes of a pose from outside, which carries no time (choice).
const ASSUMED_AGE_S: f32 = 0.01;
/// Period in seconds in which a latency sways (choice).
const SWAY_S: f64 = 3.0;
/// Time in seconds over which the flow sensor counts.
const FLOW_PERIOD_S: f32 = 0.01;

impl PositionSource {
    fn new(positioning: Positioning, around: &FlightSurroundings, seed: u64) -> Self {
        match positioning {
            Positioning::Absolute { sigma, yaw_sigma, period_ms } => {
                let mean = f64::from(around.latency) * STEPS_PER_MS;
                let latency = PoseLatency { mean, sway: mean * f64::from(around.latency_sway) };
                let sigma_m = (sigma / 1000.0).max(0.0005);
                let sigma_rad = yaw_sigma.max(0.001);
                let settings = MotionCaptureSettings {
                    period_steps: (f64::from(period_ms) * STEPS_PER_MS) as u32,
                    latency_steps: latency.at(0),
                    position_sigma_m: f64::from(sigma) / 1000.0,
                    attitude_sigma_rad: yaw_sigma.into(),
                    loss_probability: 0.0,
                };
                let source = Box::new(MotionCapture::new(settings, seed));
                PositionSource::Outside { source, sigma_m, sigma_rad, latency }
            }
            Positioning::Flow { .. } | Positioning::None => {
                let mut flow = Box::new(FlowSensor::new(FlowSettings::PMW3901, seed));
                flow.set_surface(floor_surface(around.texture.into()));
                PositionSource::Deck { flow, height: Box::new(HeightSensor::new(seed)) }
            }
        }
    }

    /// Displaces all further poses by this way in mm.
    fn displace(&mut self, [x, y]: [f32; 2]) {
        if let PositionSource::Outside { source, .. } = self {
            source.set_jump_m(DVec3::new(x.into(), y.into(), 0.0) / 1000.0);
        }
    }

    /// Follows one step of the physics above a floor of this height, and passes measurements on. A source
    /// outside of the robot measures the state that it sees.
    fn step(
        &mut self,
        state: &DroneState,
        seen: Option<DroneState>,
        floor_m: f64,
        stack: &mut FlightStack,
    ) {
        match self {
            PositionSource::Outside { source, sigma_m, sigma_rad, latency } => {
                source.set_latency_steps(latency.at(state.steps));
                if let Some(pose) = seen.and_then(|seen| source.sample(&seen)) {
                    stack.receive_pose(&PoseMeasurement {
                        position_m: pose.position_m.as_vec3(),
                        attitude: pose.attitude.as_quat(),
                        sigma_m: *sigma_m,
                        sigma_rad: *sigma_rad,
                        age_s: ASSUMED_AGE_S,
                    });
                }
            }
            PositionSource::Deck { flow, height } => {
                if let Some(counts) = flow.sample(state, floor_m)
                    && counts.is_valid
                    && let Some(sigma_counts) =
                        (FlowSurface { quality: counts.quality, shutter: counts.shutter })
                            .sigma_counts()
                {
                    stack.receive_flow(&FlowMeasurement {
                        counts_x: counts.x.into(),
                        counts_y: counts.y.into(),
                        sigma_counts,
                        seconds: FLOW_PERIOD_S,
                    });
                }
                if let Some(HeightReading::Distance(mm)) = height.sample(state, floor_m) {
                    stack.receive_range(f32::from(mm) / 1000.0);
                }
            }
        }
    }
}

impl SeenRobot {
    /// Returns the state that the source of poses sees in a step of a substep that began at another one.
    fn at(&self, own: &DroneState, begin: u64) -> Option<DroneState> {
        match self {
            SeenRobot::Own => Some(*own),
            SeenRobot::None => None,
            SeenRobot::Other(other) => {
                let seconds = (own.steps - begin) as f64 * STEP_S;
                let turn = DQuat::from_scaled_axis(other.rate_rad_s * seconds);
                Some(DroneState {
                    steps: own.steps,
                    position_m: other.position_m + other.velocity_m_s * seconds,
                    attitude: (other.attitude * turn).normalize(),
                    ..*other
                })
            }
        }
    }
}

/// Returns a floor with this share of a usual one's features; the camera exposes the longer, the fewer it
/// sees.
fn floor_surface(texture: f64) -> FloorSurface {
    let (usual, least) = (FloorSurface::USUAL, FloorSurface::FEATURELESS);
    let missing = ((usual.texture - texture) / (usual.texture - least.texture)).clamp(0.0, 1.0);
    let longer = f64::from(least.shutter - usual.shutter) * missing;
    FloorSurface { texture, shutter: usual.shutter + longer.round() as u16 }
}

/// Returns the wind at a robot; `None` in calm air.
fn wind(around: &FlightSurroundings, seed: u64) -> Option<Wind> {
    if around.wind <= 0.0 && around.gusts <= 0.0 {
        return None;
    }
    let (sine, cosine) = libm::sincos(around.wind_direction.into());
    let settings = WindSettings {
        mean_m_s: DVec3::new(cosine, sine, 0.0) * (f64::from(around.wind) / 1000.0),
        gust_sigma_m_s: f64::from(around.gusts) / 1000.0,
        gust_s: around.gust_time.into(),
    };
    Some(Wind::new(settings, seed))
}

/// Returns the state in which a robot stands on its place in the world.
fn standing(drone: &Drone) -> FlightState {
    FlightState {
        position_m: drone.state().position_m.as_vec3(),
        attitude: drone.state().attitude.as_quat(),
        ..FlightState::default()
    }
}

fn yaw_rad(state: &DroneState) -> f64 {
    let ahead = state.attitude * DVec3::X;
    libm::atan2(ahead.y, ahead.x)
}

impl FlyingBody {
    /// Height in m of the center of mass above the height of the world's pose, which is 0 on the
    /// ground.
    fn feet_m(&self) -> f64 {
        self.drone.airframe().feet_below_m
    }

    /// Returns the pose in the world's units.
    fn world_pose(&self) -> Pose {
        let state = self.drone.state();
        let at = state.position_m;
        Pose {
            x: (at.x * 1000.0) as f32,
            y: (at.y * 1000.0) as f32,
            z: ((at.z - self.feet_m()) * 1000.0).max(0.0) as f32,
            heading: wrap(yaw_rad(state) as f32),
        }
    }

    /// Switches the flight controller on at the robot's place.
    fn power_on(&mut self) {
        *self.controls.stack = FlightStack::new(self.settings, &standing(&self.drone));
        self.duties = MotorDuties::default();
    }

    /// Adopts the pose to which the world moved the body: a short way is a push, a long one a person.
    fn adopt_world_pose(&mut self, pose: &Pose, radius_m: f64) {
        let there = DVec3::new(
            f64::from(pose.x) / 1000.0,
            f64::from(pose.y) / 1000.0,
            f64::from(pose.z) / 1000.0 + self.feet_m(),
        );
        let before = self.pose;
        let way = DVec3::new(
            f64::from(pose.x - before.x),
            f64::from(pose.y - before.y),
            f64::from(pose.z - before.z),
        ) / 1000.0;
        let mut state = *self.drone.state();
        if way.length() <= radius_m && pose.heading == before.heading {
            state.position_m += way;
            let direction = way.normalize_or_zero();
            state.velocity_m_s -= direction * state.velocity_m_s.dot(direction).min(0.0);
            self.drone.set_state(state);
        } else {
            self.drone.stand(self.around.ground_m, there.x, there.y, pose.heading.into());
            let mut state = *self.drone.state();
            state.position_m.z = state.position_m.z.max(there.z);
            self.drone.set_state(state);
            self.controls.stack.adopt(&standing(&self.drone));
        }
        self.pose = *pose;
    }

    /// Gives the battery the voltage that an event of the scenario has set.
    fn set_battery(&mut self) {
        if let Some(millivolts) = self.controls.battery_setting_mv {
            let volts = f64::from(millivolts) / 1000.0;
            self.drone.set_power(PowerSource::Constant { volts });
        }
    }
}

impl Body for FlyingBody {
    type Numbers = CrazyflieModel;
    type Step = FlyingStep;
    type Controls = FlightControls;

    fn new(model: &CrazyflieModel, pose: &Pose, build: &mut Stream) -> Self {
        let seed = build.seed();
        let airframe = Airframe::CRAZYFLIE_2_1_PLUS;
        let mut drone = Drone::new(airframe, seed);
        let [x_m, y_m] = [pose.x, pose.y].map(|mm| f64::from(mm) / 1000.0);
        drone.stand(0.0, x_m, y_m, pose.heading.into());
        let limits = model.pilot().limits;
        let settings =
            StackSettings { limits, fence: model.fence, ..StackSettings::CRAZYFLIE_2_1_PLUS };
        let stack = Box::new(FlightStack::new(settings, &standing(&drone)));
        let controls = FlightControls {
            stack,
            battery_setting_mv: None,
            battery_mv: 0,
            pose_error: PoseError::default(),
        };
        let mut body = FlyingBody {
            controls,
            imu: Imu::new(&airframe, ImuSettings::BMI088, seed),
            position: PositionSource::new(model.positioning, &model.surroundings, seed),
            wind: wind(&model.surroundings, seed),
            around: DroneSurroundings::default(),
            seen: SeenRobot::Own,
            settings,
            duties: MotorDuties::default(),
            pose: *pose,
            behind_s: 0.0,
            drone,
        };
        if pose.z > 0.0 {
            let moved = Pose { z: 0.0, ..*pose };
            body.pose = moved;
            body.adopt_world_pose(pose, 0.0);
        }
        body
    }

    fn prepare(model: &CrazyflieModel, seconds: f32) -> FlyingStep {
        // A substep in f32 is not exactly a number of steps; the nearest microsecond is.
        let seconds = libm::round(f64::from(seconds) * 1e6) / 1e6;
        FlyingStep { seconds, radius_m: f64::from(model.radius) / 1000.0 }
    }

    fn controls(&mut self) -> &mut FlightControls {
        self.controls.battery_mv = (self.drone.battery_volts() * 1000.0) as u16;
        &mut self.controls
    }

    fn halt(&mut self) {
        self.controls.stack.stop();
    }

    fn restart(&mut self) {
        if self.drone.has_crashed() {
            let at = self.drone.state().position_m;
            self.drone.stand(self.around.ground_m, at.x, at.y, self.pose.heading.into());
        }
        self.power_on();
    }

    fn exchange(bodies: &mut [Self]) {
        for index in 0..bodies.len() {
            let Some(offset) = bodies[index].controls.pose_error.seen_as else {
                bodies[index].seen = SeenRobot::Own;
                continue;
            };
            let other =
                index.checked_add_signed(offset as isize).and_then(|other| bodies.get(other));
            bodies[index].seen =
                other.map_or(SeenRobot::None, |other| SeenRobot::Other(*other.drone.state()));
        }
    }

    fn surround(&mut self, surroundings: BodySurroundings) {
        let radius_m = self.drone.airframe().propeller_radius_m;
        let pushes_n = surroundings.above_mm.iter().map(|[x, y, z]| {
            let aside_m = f64::from(libm::hypotf(*x, *y)) / 1000.0;
            downwash_n(f64::from(*z) / 1000.0, aside_m, radius_m)
        });
        self.around = DroneSurroundings {
            ground_m: f64::from(surroundings.floor_mm) / 1000.0,
            external_force_n: DVec3::NEG_Z * pushes_n.sum::<f64>(),
            ..DroneSurroundings::default()
        };
    }

    fn step(&mut self, pose: &mut Pose, step: &FlyingStep) {
        if *pose != self.pose {
            self.adopt_world_pose(pose, step.radius_m);
        }
        self.set_battery();
        self.position.displace(self.controls.pose_error.displaced_mm);
        self.behind_s += step.seconds;
        let begin = self.drone.state().steps;
        while self.behind_s >= STEP_S / 2.0 {
            self.behind_s -= STEP_S;
            let duties = self.duties.0.map(f64::from);
            if let Some(wind) = &mut self.wind {
                self.around.wind_m_s = wind.step();
            }
            self.drone.step(duties, &self.around);
            let state = *self.drone.state();
            let seen = self.seen.at(&state, begin);
            self.position.step(&state, seen, self.around.ground_m, &mut self.controls.stack);
            if let Some(counts) = self.imu.sample(&state) {
                let sample = ImuSample {
                    gyro_rad_s: counts.gyro_rad_s().as_vec3(),
                    accel_m_s2: counts.accel_m_s2().as_vec3(),
                };
                let volts = self.drone.battery_volts() as f32;
                self.duties = self.controls.stack.tick(Some(&sample), volts);
            }
        }
        self.pose = self.world_pose();
        *pose = self.pose;
    }

    fn is_broken(&self) -> bool {
        self.drone.has_crashed()
    }

    fn attitude(&self) -> Option<Attitude> {
        let (state, airframe) = (self.drone.state(), self.drone.airframe());
        let [ahead, left, up] = DVec3::AXES.map(|axis| state.attitude * axis);
        let thrust_n: f64 = state.rotor_rpm.iter().map(|speed| airframe.thrust_n(*speed)).sum();
        Some(Attitude {
            roll_rad: libm::atan2(left.z, up.z) as f32,
            pitch_rad: libm::asin(-ahead.z.clamp(-1.0, 1.0)) as f32,
            thrust: (thrust_n / (4.0 * airframe.hover_thrust_n())) as f32,
        })
    }

    fn sense(
        &mut self,
        pose: &Pose,
        model: &CrazyflieModel,
        seconds: f32,
        _: impl FnOnce() -> Stream,
    ) -> Option<Pose> {
        if seconds == 0.0 && *pose != self.pose {
            self.adopt_world_pose(pose, f64::from(model.radius) / 1000.0);
        }
        let stack = &self.controls.stack;
        let state = stack.state();
        let ahead = state.attitude * Vec3::X;
        let at = state.position_m * 1000.0;
        // On the ground a robot knows its place before it has measured it.
        let is_known = stack.health().is_position_valid || !stack.is_flying();
        is_known.then(|| Pose {
            x: at.x,
            y: at.y,
            z: at.z - (self.feet_m() * 1000.0) as f32,
            heading: wrap(libm::atan2f(ahead.y, ahead.x)),
        })
    }
}
