//! Motion capture: cameras in the room measure the pose, and a radio sends it to the robot.

use glam::{DQuat, DVec3};

use crate::DroneState;
use crate::random::{NoiseConsumer, NoiseStream};
use crate::sensors::SensorFault;
use crate::sensors::delay::DelayLine;
use crate::sensors::fault::FaultGate;

/// Largest number of poses on their way. A pose that finds them all in use is lost.
const ON_THE_WAY_MAX: usize = 32;

/// The properties of motion capture and of its radio.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MotionCaptureSettings {
    /// Steps of a millisecond between poses; 0 counts as 1.
    pub period_steps: u32,
    /// Steps of a millisecond until a pose arrives.
    pub latency_steps: u32,
    /// Standard deviation of each coordinate in m.
    pub position_sigma_m: f64,
    /// Standard deviation of the rotation about each axis in radians.
    pub attitude_sigma_rad: f64,
    /// Probability that a pose does not arrive, 0 to 1.
    pub loss_probability: f64,
}

impl MotionCaptureSettings {
    /// A room with usual cameras: 100 poses per second, 10 ms and 0.5 mm within the ranges of Preiss
    /// et al. 2017, "Crazyswarm" (8 to 26 ms, 0.1 to 1 mm). Attitude and loss are choices.
    pub const ROOM: Self = MotionCaptureSettings {
        period_steps: 10,
        latency_steps: 10,
        position_sigma_m: 0.0005,
        attitude_sigma_rad: 0.005,
        loss_probability: 0.01,
    };
}

/// One pose that arrived.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CapturedPose {
    /// Position in the world frame, in m.
    pub position_m: DVec3,
    /// Rotation from the body frame to the world frame.
    pub attitude: DQuat,
    /// The step to which the pose belongs.
    pub steps: u64,
}

/// Motion capture of one robot.
#[derive(Clone, Debug, PartialEq)]
pub struct MotionCapture {
    settings: MotionCaptureSettings,
    noise: NoiseStream,
    line: DelayLine<CapturedPose, ON_THE_WAY_MAX>,
    gate: FaultGate<CapturedPose>,
    jump_m: DVec3,
    turn: DQuat,
    marker_turn: DQuat,
}

impl MotionCapture {
    /// Returns the motion capture of one robot.
    ///
    /// # Parameters
    /// `seed`: its noise and losses.
    #[must_use]
    pub fn new(settings: MotionCaptureSettings, seed: u64) -> Self {
        MotionCapture {
            settings,
            noise: NoiseStream::new(seed, NoiseConsumer::MotionCapture),
            line: DelayLine::new(),
            gate: FaultGate::new(),
            jump_m: DVec3::ZERO,
            turn: DQuat::IDENTITY,
            marker_turn: DQuat::IDENTITY,
        }
    }

    /// Sets or clears the fault. A stuck source sends its last pose with the time of that pose.
    pub fn set_fault(&mut self, fault: Option<SensorFault>) {
        self.gate.fault = fault;
    }

    /// Adds this offset in m to all further poses, as when cameras confuse two robots.
    pub fn set_jump_m(&mut self, jump_m: DVec3) {
        self.jump_m = jump_m;
    }

    /// Turns the frame of all further poses about its origin, as when cameras are calibrated again.
    /// The offset of [`Self::set_jump_m`] is added afterwards.
    ///
    /// # Parameters
    /// `turn`: a rotation of length 1.
    pub fn set_turn(&mut self, turn: DQuat) {
        self.turn = turn;
    }

    /// Turns the body's frame of all further poses by this rotation of length 1, as when markers were
    /// put on the robot anew.
    pub fn set_marker_turn(&mut self, turn: DQuat) {
        self.marker_turn = turn;
    }

    /// Sets the time in steps until a further pose arrives. Poses stay in order, so one that
    /// overtakes another one arrives right after it.
    pub fn set_latency_steps(&mut self, steps: u32) {
        self.settings.latency_steps = steps;
    }

    /// Follows one step, and returns a pose if one arrives in it.
    pub fn sample(&mut self, state: &DroneState) -> Option<CapturedPose> {
        let settings = &self.settings;
        if state.steps.is_multiple_of(u64::from(settings.period_steps.max(1))) {
            let factor = self.gate.noise_factor();
            let shift = self.noise.normal_vector() * (settings.position_sigma_m * factor);
            let turn = self.noise.normal_vector() * (settings.attitude_sigma_rad * factor);
            let is_lost = self.noise.chance(settings.loss_probability);
            let body = self.turn * state.attitude * self.marker_turn;
            let pose = CapturedPose {
                position_m: self.turn * (state.position_m + shift) + self.jump_m,
                attitude: (body * DQuat::from_scaled_axis(turn)).normalize(),
                steps: state.steps,
            };
            if !is_lost && let Some(pose) = self.gate.pass(pose) {
                self.line.push(state.steps + u64::from(settings.latency_steps), pose);
            }
        }
        self.line.pop(state.steps)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(capture: &mut MotionCapture, steps: u64) -> Vec<(u64, CapturedPose)> {
        let mut state = DroneState::at_rest(DVec3::new(1.0, -2.0, 0.5), 0.5);
        let mut found = Vec::new();
        for step in 1..=steps {
            state.steps = step;
            found.extend(capture.sample(&state).map(|pose| (step, pose)));
        }
        found
    }

    #[test]
    fn poses_arrive_late_and_noisy() {
        let mut capture = MotionCapture::new(MotionCaptureSettings::ROOM, 1);
        let poses = run(&mut capture, 100_000);
        // 1 % of 10,000 poses is lost: three deviations are 30.
        assert!((9870..=9930).contains(&poses.len()), "{}", poses.len());
        assert!(poses.iter().all(|(step, pose)| step - pose.steps == 10));
        let truth = DroneState::at_rest(DVec3::new(1.0, -2.0, 0.5), 0.5);
        let count = poses.len() as f64;
        let position: f64 =
            poses.iter().map(|(_, p)| (p.position_m - truth.position_m).length_squared()).sum();
        assert!(((position / count / 3.0).sqrt() / 0.0005 - 1.0).abs() < 0.03);
        let attitude: f64 =
            poses.iter().map(|(_, p)| p.attitude.angle_between(truth.attitude).powi(2)).sum();
        assert!(((attitude / count / 3.0).sqrt() / 0.005 - 1.0).abs() < 0.03);
    }

    #[test]
    fn long_latency_keeps_every_pose_on_its_way() {
        let settings = MotionCaptureSettings {
            latency_steps: 150,
            loss_probability: 0.0,
            ..MotionCaptureSettings::ROOM
        };
        assert_eq!(run(&mut MotionCapture::new(settings, 1), 1150).len(), 100);
    }

    /// A latency that falls by 20 ms lets poses arrive in order, each at its own time or later.
    #[test]
    fn latency_can_change() {
        let settings =
            MotionCaptureSettings { loss_probability: 0.0, ..MotionCaptureSettings::ROOM };
        let mut capture = MotionCapture::new(settings, 1);
        let mut state = DroneState::at_rest(DVec3::ZERO, 0.0);
        let mut found = Vec::new();
        for step in 1..=500_u64 {
            capture.set_latency_steps(if step < 250 { 60 } else { 40 });
            state.steps = step;
            found.extend(capture.sample(&state).map(|pose| (pose.steps, step - pose.steps)));
        }
        assert!(found.windows(2).all(|pair| pair[0].0 < pair[1].0), "{found:?}");
        let latency = |at: u64| found.iter().find(|(steps, _)| *steps == at).map(|found| found.1);
        assert_eq!((latency(200), latency(300)), (Some(60), Some(40)));
        assert!(found.len() >= 44, "{}", found.len());
    }

    #[test]
    fn faults_and_jumps_reach_the_poses() {
        let mut capture = MotionCapture::new(MotionCaptureSettings::ROOM, 1);
        capture.set_jump_m(DVec3::X);
        let poses = run(&mut capture, 1000);
        assert!(poses.iter().all(|(_, pose)| (pose.position_m.x - 2.0).abs() < 0.01));
        capture.set_turn(DQuat::from_rotation_z(core::f64::consts::FRAC_PI_2));
        // The turned frame shows (1, -2, 0.5) at (2, 1, 0.5).
        let turned = run(&mut capture, 1000);
        assert!(turned.iter().skip(1).all(|(_, pose)| {
            pose.position_m.distance(DVec3::new(3.0, 1.0, 0.5)) < 0.01
                && (pose.attitude * DVec3::X).dot(DQuat::from_rotation_z(0.5) * DVec3::Y) > 0.99
        }));
        capture.set_fault(Some(SensorFault::Silent));
        assert!(run(&mut capture, 1000).len() <= 1);
        capture.set_fault(Some(SensorFault::Stuck));
        let stuck = run(&mut capture, 1000);
        assert!(stuck.iter().skip(1).all(|(_, pose)| *pose == stuck[1].1));
    }
}
