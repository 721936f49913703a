//! An emulated robot as the world sees it: the effects of its signals, lights and messages.

use std::collections::BTreeSet;
use std::sync::Arc;
use std::time::Duration;

use bittybuzz_chips::ResetCause;
use bittybuzz_comms::infrared::FaultReport;
use bittybuzz_comms::syslink::{SWARM_PORT, SwarmFrame};
use bittybuzz_emulation::message::{Command, EmulatorEvent, TimedEvent};

use crate::engine::{Pose, RobotId, World};
use crate::robot::{BatteryState, Emulation, Piece, SimRobot};

use super::table::Motion;
use super::trace_events::{TraceEvent, TraceEventReader};
use super::{FirmwareFailure, IN_WORLD};

/// Returns the log line for an event that ends a run with this project's firmware. A foreign image
/// may reset the chip, or ignore its rules, as on the robot.
fn noted(event: &EmulatorEvent) -> Option<String> {
    match event {
        EmulatorEvent::HardwareError { text } => Some(format!("hardware error: {text}")),
        EmulatorEvent::Reset { cause } => Some(format!("reset: {cause}")),
        EmulatorEvent::PowerOff { .. } => Some("power off".to_owned()),
        _ => None,
    }
}

/// The state of an emulated robot that is visible from outside.
pub(super) struct Emulated {
    pub(super) emulation: Arc<dyn Emulation>,
    pub(super) id: RobotId,
    /// The id that its script sees.
    pub(super) own_id: u16,
    /// Duties of the inputs of the motors' drivers, 0 to 1.
    pub(super) inputs: [f64; 4],
    pub(super) led: u8,
    /// The time up to which its wheels have turned.
    pub(super) rolled: Duration,
    /// The motion that was last sent to the emulator.
    pub(super) last_motion: Option<Motion>,
    /// True if it runs a foreign image.
    pub(super) is_image: bool,
    pub(super) is_on: bool,
    /// True once its body has crashed.
    pub(super) has_crashed: bool,
    /// The battery of its body, once the body has reported it.
    pub(super) battery: Option<BatteryState>,
    /// The pool's numbers of the robots that it is cut off from.
    pub(super) deaf_to: BTreeSet<usize>,
    /// The command by which a person permits it to fly, until it accepts it.
    pub(super) permission: Option<Command>,
    /// The last distances that were sent to it.
    pub(super) measured: Option<Command>,
    /// The last command that described its surroundings.
    pub(super) sensed: Option<Command>,
    /// `None` if the firmware has no trace.
    pub(super) reader: Option<TraceEventReader>,
}

impl Emulated {
    fn duties(&self) -> [f32; 2] {
        self.emulation.duties(self.inputs)
    }

    /// Returns the current pose and motion of the robot; `None` for a body without wheels.
    pub(super) fn motion(&self, world: &mut World<SimRobot>, now: Duration) -> Option<Motion> {
        let [speed_mm_s, turn_rad_s] = world.roll(self.id, self.duties(), 0.0).expect(IN_WORLD)?;
        let pose = world.robot(self.id).expect(IN_WORLD).pose;
        Some(Motion { since: now, pose, speed_mm_s, turn_rad_s })
    }

    /// Moves the robot in the world up to `until`, with the current duties of its motors.
    pub(super) fn roll(&mut self, until: Duration, world: &mut World<SimRobot>) {
        let span = until.saturating_sub(self.rolled);
        self.rolled = self.rolled.max(until);
        world.roll(self.id, self.duties(), span.as_secs_f32()).expect(IN_WORLD);
    }

    /// Handles an event of the robot. Its effects are at `until` at the latest.
    pub(super) fn note(
        &mut self,
        TimedEvent { at, event }: TimedEvent,
        until: Duration,
        world: &mut World<SimRobot>,
    ) -> Result<(), FirmwareFailure> {
        if self.is_image
            && let Some(text) = noted(&event)
        {
            let tick = world.now();
            let robot = world.brain_mut(self.id).expect(IN_WORLD);
            robot.has_logged(tick, vec![Piece::Text(text.into_bytes())]);
            return Ok(());
        }
        if self.permission.is_some() && self.emulation.is_permitted(&event) {
            self.permission = None;
        }
        match event {
            EmulatorEvent::Motor { number, duty, .. } => {
                // An event at the end of an instruction may be slightly later than `until`.
                self.roll(at.min(until), world);
                let input = usize::from(number).checked_sub(1);
                // Numbers of other motors mean nothing to the body.
                if let Some(input) = input.and_then(|input| self.inputs.get_mut(input)) {
                    *input = duty;
                }
            }
            EmulatorEvent::Led { name, on } => {
                let bit = match name.as_str() {
                    "red" | "red_left" => 1,
                    "green" | "green_left" => 2,
                    "blue" | "blue_left" => 4,
                    // The firmware controls the other LEDs, not the script.
                    _ => return Ok(()),
                };
                self.led = if on { self.led | bit } else { self.led & !bit };
                world.shine(self.id, self.led).expect(IN_WORLD);
            }
            EmulatorEvent::Color { red, green, blue } => {
                let shines = [red, green, blue].map(|part| u8::from(part > 0));
                self.led = shines[0] | shines[1] << 1 | shines[2] << 2;
                world.shine(self.id, self.led).expect(IN_WORLD);
            }
            EmulatorEvent::Rtt { bytes } => {
                // Without a trace, nothing is known about the bytes.
                let Some(reader) = &mut self.reader else { return Ok(()) };
                let tick = world.now();
                let robot = world.brain_mut(self.id).expect(IN_WORLD);
                for event in reader.read(&bytes) {
                    match event {
                        TraceEvent::Log(pieces) => robot.has_logged(tick, pieces),
                        TraceEvent::Fault(fault, positions) => {
                            robot.has_stopped(tick, fault, positions)
                        }
                        TraceEvent::Contained(fault, positions) => {
                            robot.has_contained(tick, fault, positions);
                        }
                        TraceEvent::Restart(pause) => robot.has_restarted(pause),
                        TraceEvent::Unused(unused) => robot.has_missed(unused),
                        TraceEvent::Overrun(missed) => robot.has_overrun(tick, missed),
                        TraceEvent::Refused(cause) => return Err(FirmwareFailure::Refused(cause)),
                    }
                }
            }
            EmulatorEvent::Infrared { payload, .. } => {
                // Other frames are messages of scripts.
                let message = payload.as_slice().try_into().ok();
                let Some(report) = message.and_then(FaultReport::of) else { return Ok(()) };
                let fault = report.fault.ok_or(FirmwareFailure::Unsuitable)?;
                let tick = world.now();
                let robot = world.brain_mut(self.id).expect(IN_WORLD);
                // The robot repeats each report, so that only a new one counts.
                if report.is_contained {
                    robot.has_contained_once(tick, fault);
                } else if !robot.state().is_faulted() {
                    robot.has_failed(tick, fault);
                }
            }
            EmulatorEvent::Motion {
                position_m: [x, y, z],
                attitude: [qx, qy, qz, qw],
                crashed,
                battery_volts,
                battery_charge,
                ..
            } => {
                self.battery = Some(BatteryState {
                    millivolts: (battery_volts * 1000.0) as u16,
                    charge: battery_charge.map(|charge| charge as f32),
                });
                // The direction of the body's x axis, seen from above.
                let ahead = 1.0 - 2.0 * (qy * qy + qz * qz);
                let left = 2.0 * (qx * qy + qw * qz);
                let [x, y, z] = [x, y, z].map(|m| (m * 1000.0) as f32);
                let z = (z - self.emulation.standing_mm()).max(0.0);
                let pose = Pose { x, y, z, heading: left.atan2(ahead) as f32 };
                world.move_to(self.id, pose).expect(IN_WORLD);
                if crashed && !std::mem::replace(&mut self.has_crashed, true) {
                    world.crash_robot(self.id).expect(IN_WORLD);
                }
            }
            EmulatorEvent::Step => {
                world.brain_mut(self.id).expect(IN_WORLD).has_stepped();
            }
            // A cut or a restored power supply is no failure.
            EmulatorEvent::Reset { cause } if cause == ResetCause::PowerOff.name() => {}
            EmulatorEvent::Reset { cause } if cause == ResetCause::PowerOn.name() => {
                self.reader = self.reader.take().map(TraceEventReader::anew);
            }
            EmulatorEvent::Reset { cause } => return Err(FirmwareFailure::Reset { cause }),
            EmulatorEvent::Loader { name } => {
                return Err(FirmwareFailure::Reset { cause: format!("loader {name}") });
            }
            EmulatorEvent::HardwareError { text } => {
                return Err(FirmwareFailure::Hardware { text });
            }
            EmulatorEvent::Lockup { pc } => return Err(FirmwareFailure::Lockup { pc }),
            // Each message has the position that the robot knows of itself.
            EmulatorEvent::P2p { port, payload, .. } if self.emulation.flies() => {
                if let Some(SwarmFrame { position: Some(position), .. }) =
                    SwarmFrame::parse(&payload).filter(|_| port == SWARM_PORT)
                {
                    let [x, y, z] = position.mm();
                    let place = [x, y, z - self.emulation.standing_mm()];
                    world.set_estimate(self.id, place).expect(IN_WORLD);
                }
            }
            EmulatorEvent::Syslink { .. }
            | EmulatorEvent::P2p { .. }
            | EmulatorEvent::Radio { .. }
            | EmulatorEvent::Serial { .. }
            | EmulatorEvent::PowerOff { .. } => {}
        }
        Ok(())
    }
}
