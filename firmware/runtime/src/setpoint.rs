//! Set-points: commands for the motors with an expiry.
//!
//! The script's task has the [`SetpointWriter`], and the motors' task runs [`drive`]. The [`Channel`]
//! between them holds only the latest command, because an old one is of no use to a motor.

use core::future::pending;

use embassy_futures::select::{Either3, select3};
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use embassy_time::{Duration, Instant, Timer};

use crate::liveness::{BEAT, Pulse};

/// The time for which a set-point holds unless a completed step renews it.
pub const HOLD: Duration = Duration::from_millis(500);

/// A command for the motors' task.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MotorCommand<S> {
    /// Apply this set-point until this time.
    Hold(S, Instant),
    /// Stop at once.
    Stop,
}

/// Carries the latest command from the script's task to the motors'.
pub type Channel<S> = Signal<CriticalSectionRawMutex, MotorCommand<S>>;

/// The motors of a robot.
pub trait MotorDriver {
    /// A set-point of these motors.
    type Setpoint: Copy;
    /// Applies a set-point.
    fn apply(&mut self, setpoint: Self::Setpoint);
    /// Stops the motors.
    fn stop(&mut self);
    /// Does the motors' work until the next command, such as steering by the robot's pose.
    /// [`drive`] restarts the work when it ends, at each command, and after each [`BEAT`].
    fn steer(&mut self) -> impl Future<Output = ()> {
        pending()
    }
}

/// The script's end of the channel.
pub struct SetpointWriter<S: Copy + 'static> {
    channel: &'static Channel<S>,
    held: Option<S>,
    until: Instant,
}

impl<S: Copy> SetpointWriter<S> {
    /// Returns the writer of this channel, without a set-point.
    pub fn new(channel: &'static Channel<S>) -> Self {
        SetpointWriter { channel, held: None, until: Instant::now() + HOLD }
    }

    /// Returns the set-point, unless it has expired.
    pub fn held(&self) -> Option<S> {
        self.held
    }

    /// Sets the set-point. It takes effect at once and expires like one that was set when the last
    /// step was completed. If that time has passed already, it takes effect with the next completed
    /// step.
    pub fn set(&mut self, setpoint: S) {
        self.held = Some(setpoint);
        self.send();
    }

    /// Renews the set-point, since a step was completed.
    pub fn renew(&mut self) {
        self.until = Instant::now() + HOLD;
        self.send();
    }

    /// Clears a set-point that has expired, so that a later step does not renew it. Returns true if
    /// a set-point was cleared.
    pub fn expire(&mut self) -> bool {
        let expired = self.held.is_some() && Instant::now() >= self.until;
        if expired {
            self.held = None;
        }
        expired
    }

    /// Stops the motors and clears the set-point.
    pub fn stop(&mut self) {
        self.held = None;
        self.channel.signal(MotorCommand::Stop);
    }

    fn send(&self) {
        if let Some(setpoint) = self.held {
            self.channel.signal(MotorCommand::Hold(setpoint, self.until));
        }
    }
}

/// Runs the motors' task: applies each command for as long as it holds, and then stops the motors.
pub async fn drive<M: MotorDriver>(
    channel: &'static Channel<M::Setpoint>,
    motors: &mut M,
    pulse: Pulse,
) -> ! {
    motors.stop();
    let mut until = None;
    loop {
        pulse.beat();
        let beat = Instant::now() + BEAT;
        let wake = until.map_or(beat, |until: Instant| until.min(beat));
        match select3(channel.wait(), motors.steer(), Timer::at(wake)).await {
            Either3::First(MotorCommand::Hold(setpoint, end)) if Instant::now() < end => {
                motors.apply(setpoint);
                until = Some(end);
            }
            Either3::First(MotorCommand::Hold(..) | MotorCommand::Stop) => {
                motors.stop();
                until = None;
            }
            Either3::Second(()) | Either3::Third(()) => {
                if until.is_some_and(|until| Instant::now() >= until) {
                    motors.stop();
                    until = None;
                }
            }
        }
    }
}
