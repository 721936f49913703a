//! The flight task: from a sample of the inertial sensors to the compare registers of the motors.
//!
//! # Each millisecond
//! | from the pulse | work |
//! |---|---|
//! | 0 to 430 µs | both sensors are read ([`super::sensors`]) |
//! | then | estimate, supervise and control: [`Controller::step`] to the compare registers |
//! | then | one pose, or else one measurement of a Flow deck; the commands of the pilot, a copy for it |
//!
//! Work after the motors are set delays no sample as long as it ends before the next pulse, and one
//! that it does delay is late by the excess only. Plans are not made here ([`super::pilot_desk`]).
//!
//! # Deadlines
//! The times from data-ready pulses to the compare registers in flight are counted in [`Deadlines`],
//! which the log shows.

use core::sync::atomic::Ordering;

use bittybuzz_flight::ekf::{FlowMeasurement, FlowSurface};
use bittybuzz_flight::pilot::PilotSettings;
use bittybuzz_flight::stack::{COPY_TICKS, FlightStack};
use bittybuzz_flight::supervisor::SupervisorStage;
use bittybuzz_flight::{ImuSample, Vec3};
use bittybuzz_pmw3901::MotionCounts;
use bittybuzz_runtime::pose::{LatestPose, Pose};
use embassy_time::{Duration, Instant};

use super::pilot_desk;
use super::state::{self, Deadlines, Sample};
use crate::decks::{flow, ranging};
use crate::link::{self, FlightPose};
use crate::motors;

/// The duration of a tick of the flight controller.
const TICK_US: u64 = 1_000;
/// The most ticks between two samples. The flight controller gives the sensors up after 5 ms without
/// one.
const TICKS_MAX: u64 = 10;

/// The quality from which on a picture without motion shows a robot at rest: that below which PixArt's
/// application note on the PMW3901 rejects counts.
const STILL_QUALITY: u8 = 0x19;

/// The greatest age of the last sample of a flow sensor that works.
const FLOW_AGE_MAX: Duration = Duration::from_secs(1);

/// The flight controller with its inputs and outputs.
pub struct Controller {
    stack: &'static mut FlightStack,
    /// The time of the sample of the last tick.
    ticked_at: Option<Instant>,
    samples: u32,
    /// The time of the last sample of a flow sensor.
    flow_at: Option<Instant>,
    deadlines: Deadlines,
}

impl Controller {
    /// Returns the controller of a robot that was just switched on.
    pub fn new(stack: &'static mut FlightStack) -> Self {
        stack.plan_elsewhere();
        let deadlines = Deadlines::default();
        Controller { stack, ticked_at: None, samples: 0, flow_at: None, deadlines }
    }

    /// Uses a sample.
    pub fn step(&mut self, sample: &Sample) {
        // A robot that is locked until power-on needs no estimate.
        if self.stack.stage() != SupervisorStage::Locked {
            self.fly(sample);
        }
        self.exchange();
    }

    fn fly(&mut self, sample: &Sample) {
        // The last tick due is that of the sample.
        for _ in 1..self.ticks_due(sample.ready_at) {
            self.tick(None);
        }
        self.ticked_at = Some(sample.ready_at);
        let [p, q, r] = sample.rate.rad_per_s;
        let [x, y, z] = sample.acceleration.m_per_s2;
        self.tick(Some(&ImuSample {
            gyro_rad_s: Vec3::new(p, q, r),
            accel_m_s2: Vec3::new(x, y, z),
        }));
        if self.stack.is_flying() {
            let time = Instant::now().saturating_duration_since(sample.ready_at);
            self.deadlines.note(time.as_micros() as u32);
            state::set_deadlines(self.deadlines);
        }
        self.receive_measurement();
    }

    /// Continues without a sample, which failed.
    pub fn miss(&mut self) {
        let due = self.ticks_due(Instant::now());
        for _ in 0..due {
            self.tick(None);
        }
        let passed = Duration::from_micros(u64::from(due) * TICK_US);
        self.ticked_at = self.ticked_at.and_then(|at| at.checked_add(passed));
    }

    /// Stops the motors, since the sensors have failed for longer than a flight can bear.
    pub fn stop(&mut self) {
        self.ticked_at = None;
        self.stack.stop();
        self.tick(None);
    }

    /// Returns the number of ticks since the last one. A robot whose motors are off needs none: it may
    /// have been halted by a debugger.
    fn ticks_due(&self, now: Instant) -> u32 {
        match self.ticked_at {
            Some(before) if self.stack.permission().allows_motors() => {
                let passed_us = now.saturating_duration_since(before).as_micros();
                ((passed_us + TICK_US / 2) / TICK_US).min(TICKS_MAX) as u32
            }
            _ => 0,
        }
    }

    fn tick(&mut self, sample: Option<&ImuSample>) {
        if pilot_desk::EMERGENCY_STOP.load(Ordering::Relaxed) {
            self.stack.emergency_stop();
        }
        if pilot_desk::DISARM.swap(false, Ordering::Relaxed) {
            self.stack.stop();
        }
        let volts = f32::from(link::STATE.battery_mv().unwrap_or(0)) / 1000.0;
        let duties = self.stack.tick(sample, volts);
        let may_turn = self.stack.permission().allows_motors();
        motors::fly(may_turn.then_some(&duties));
    }

    /// Takes one measurement. The others wait for the next sample.
    fn receive_measurement(&mut self) {
        if let Some(state) = pilot_desk::ADOPTED.try_take()
            && !self.stack.is_flying()
        {
            self.stack.adopt(&state);
        }
        if let Some(pose) = link::FLIGHT_POSE.try_take() {
            match pose {
                FlightPose::Pose(pose) => self.stack.receive_pose(&pose),
                FlightPose::Position(position) => {
                    if self.stack.receive_position(&position) {
                        // Scripts get a pose as it was sent, so this place is in the same frame.
                        self.publish(&link::POSE, Vec3::ZERO);
                    }
                }
            }
        } else if let Some(flow) = flow::FLIGHT_SAMPLE.try_take() {
            self.flow_at = Some(Instant::now());
            let MotionCounts { delta_x, delta_y, surface_quality, shutter, .. } = flow.counts;
            let surface = FlowSurface { quality: surface_quality, shutter };
            // Without motion, a floor too near for the lens looks like one at rest.
            let is_usable = flow.counts.has_valid_motion() || surface_quality >= STILL_QUALITY;
            let Some(sigma_counts) = surface.sigma_counts().filter(|_| is_usable) else { return };
            self.stack.receive_flow(&FlowMeasurement {
                // The chip's axes on the Flow deck.
                counts_x: -f32::from(delta_y),
                counts_y: -f32::from(delta_x),
                sigma_counts,
                seconds: flow.duration.as_micros() as f32 * 1e-6,
            });
        } else if let Some(distance_m) = ranging::FLIGHT_HEIGHT_M.try_take() {
            self.stack.receive_range(distance_m);
        }
    }

    /// Publishes the place that a robot with a flow sensor estimates, as scripts know it: above a robot
    /// that stands at height 0. Without that sensor its place is only the one where it was switched on.
    fn publish_estimate(&self) {
        if self.flow_at.is_some_and(|at| at.elapsed() < FLOW_AGE_MAX) {
            self.publish(&state::ESTIMATE, Vec3::Z * PilotSettings::CRAZYFLIE.standing_m);
        }
    }

    /// Publishes the estimated place relative to an origin, if it is known.
    fn publish(&self, latest: &LatestPose, origin_m: Vec3) {
        let health = self.stack.health();
        if health.is_position_valid && health.is_height_valid {
            let state = self.stack.state();
            let place_m = (state.position_m - origin_m).to_array();
            latest.set(Pose::new(place_m, state.attitude.to_array()));
        }
    }

    /// Takes the commands of the pilot, and gives it a new copy.
    fn exchange(&mut self) {
        let returned = pilot_desk::take_returned();
        if let Some(copy) = &returned {
            self.stack.take_commands(copy);
        }
        let is_plan_due = self.stack.is_plan_due();
        self.samples = self.samples.wrapping_add(1);
        let is_copy_due = is_plan_due || self.samples.is_multiple_of(COPY_TICKS);
        let copy = returned.or_else(|| is_copy_due.then(pilot_desk::take_unused).flatten());
        let Some(copy) = copy else { return };
        self.publish_estimate();
        *copy = *self.stack;
        pilot_desk::lend(copy);
        if is_plan_due {
            pilot_desk::PLAN_DUE.signal(());
        }
    }
}
