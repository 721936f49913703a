//! Which commands a board obeys.

use std::ops::RangeInclusive;

use bittybuzz_chips::{
    Battery, Board, Chip, Crazyflie, Frame, Light, Link, MAX_PAYLOAD, Memory, Nrf51Settings, OTP,
    P2P_MAX, P2pFrame, Pose, ResetCause, TablePose, Time, Zooid,
};

use crate::message::{self, BoardStatistics, Command};

/// A board that is told what happens to its robot.
pub trait Control: Board {
    /// What people call the robot.
    const NAME: &'static str;

    /// Obeys a command that concerns the board.
    fn obey(&mut self, command: Command) -> Result<(), Refusal>;

    /// What it counted since power-on.
    fn counted(&self) -> BoardStatistics;
}

/// Why a board does not obey.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Refusal {
    /// Too much for the link.
    #[error("a frame's payload has at most {MAX_PAYLOAD} bytes, this one has {0}")]
    FrameTooLong(usize),
    /// Too much for the radio.
    #[error("a P2P frame has at most {P2P_MAX} bytes, this one has {0}")]
    P2pTooLong(usize),
    /// Not between 0 and 1.
    #[error("a probability is between 0 and 1, not {0}")]
    NotAProbability(f64),
    /// Not a number that makes sense there.
    #[error("{name} is a finite number, not {value}")]
    NotFinite {
        /// The member of the command.
        name: &'static str,
        /// What it was.
        value: f64,
    },
    /// Edges cannot be that late.
    #[error("jitter_us is between 0 and {most}, not {value}")]
    Jitter {
        /// What it may be.
        most: f64,
        /// What it was.
        value: f64,
    },
    /// No lamp is so bad.
    #[error("glitches_per_s is between 0 and {most}, not {value}")]
    Glitches {
        /// The limit.
        most: f64,
        /// The number in the command.
        value: f64,
    },
    /// No oscillator is so wrong.
    #[error("error_ppm is between -{most} and {most}, not {value}")]
    ClockError {
        /// What it may be, in either direction.
        most: f64,
        /// What it was.
        value: f64,
    },
    /// No oscillator of this chip is so slow or so fast.
    #[error("lsi_hz is between {} and {}, not {hz}", .range.start(), .range.end())]
    Lsi {
        /// The range in the data sheet.
        range: RangeInclusive<u64>,
        /// The number in the command.
        hz: u64,
    },
    /// The chip has fewer.
    #[error("a Crazyflie has {OTP} one-time programmable bytes, not {0}")]
    Otp(usize),
    /// The STM32 could not obey flow control.
    #[error("rts_bytes is between 1 and {most}, not {value}")]
    RtsBytes {
        /// The limit.
        most: u8,
        /// The number in the command.
        value: u8,
    },
    /// Longer than any test waits.
    #[error("ble_shutdown_us is at most 1000000, not {0}")]
    BleShutdown(u64),
    /// No frame of a Kilobot has so many bytes.
    #[error(
        "a Kilobot's frame is 9 bytes of data and its type, and 2 of its checksum or none: 10 or 12, not {0}"
    )]
    Infrared(usize),
    /// Another robot has it.
    #[error("a {0} has no such thing; docs/emulation.md says which robot obeys which command")]
    OtherRobot(&'static str),
}

/// `value`, if it is a probability.
pub fn probability(value: f64) -> Result<f64, Refusal> {
    if (0.0..=1.0).contains(&value) { Ok(value) } else { Err(Refusal::NotAProbability(value)) }
}

/// `value`, if it is finite; `name` is the member of the command.
pub fn finite(name: &'static str, value: f64) -> Result<f64, Refusal> {
    if value.is_finite() { Ok(value) } else { Err(Refusal::NotFinite { name, value }) }
}

/// The content of memory as the chips know it.
pub fn memory(memory: message::Memory, seed: u64) -> Memory {
    match memory {
        message::Memory::Kept => Memory::Kept,
        message::Memory::Zeroed => Memory::Zeroed,
        message::Memory::Noise => Memory::Noise { seed },
    }
}

/// `hz`, if an oscillator LSI can be so fast.
fn lsi(range: RangeInclusive<u64>, hz: u64) -> Result<u64, Refusal> {
    if range.contains(&hz) { Ok(hz) } else { Err(Refusal::Lsi { range, hz }) }
}

impl Control for Crazyflie {
    const NAME: &'static str = "Crazyflie";

    fn obey(&mut self, command: Command) -> Result<(), Refusal> {
        match command {
            Command::Send { kind, payload } => {
                let length = payload.len();
                let frame = Frame::new(kind, payload).ok_or(Refusal::FrameTooLong(length))?;
                self.send(&frame);
            }
            Command::P2p { at, port, rssi, payload } => {
                let length = payload.len();
                let frame = P2pFrame::new(port, rssi, payload);
                let frame = frame.ok_or(Refusal::P2pTooLong(length))?;
                let end = Time::from_nanos(u64::try_from(at.as_nanos()).unwrap_or(u64::MAX));
                Crazyflie::hear(self, &frame, end);
            }
            Command::Pose { x_mm, y_mm, z_mm, yaw_degrees } => {
                self.tell_pose(Pose { position_mm: [x_mm, y_mm, z_mm], yaw_degrees });
            }
            Command::Bytes { bytes } => self.send_bytes(&bytes),
            Command::Link { lose, corrupt, seed } => {
                let (lose, corrupt) = (probability(lose)?, probability(corrupt)?);
                self.set_link(Link { lose, corrupt, seed });
            }
            Command::RadioProcessor { ready, rts_bytes, ble_shutdown_us, ble_masks } => {
                let most = Nrf51Settings::MOST_RTS_BYTES;
                if !(1..=most).contains(&rts_bytes) {
                    return Err(Refusal::RtsBytes { most, value: rts_bytes });
                }
                if ble_shutdown_us > 1_000_000 {
                    return Err(Refusal::BleShutdown(ble_shutdown_us));
                }
                let ble_shutdown = Time::from_micros(ble_shutdown_us);
                let knows_ready = ready;
                self.set_nrf51(Nrf51Settings { knows_ready, rts_bytes, ble_shutdown, ble_masks });
            }
            Command::RadioRestart => self.restart_nrf51(),
            Command::FlowControl { full } => self.set_flow_control(full),
            Command::Battery { volts, charging, usb_powered } => {
                self.set_battery(Battery { volts, charging, usb_powered });
            }
            Command::Shutdown => self.request_shutdown(),
            Command::Chip { lsi_hz, crystal, memory, seed, debugger } => {
                let lsi_hz = lsi(17_000..=47_000, lsi_hz)?;
                let memory = self::memory(memory, seed);
                let (has_crystal, is_debugged) = (crystal, debugger);
                self.set_chip(Chip { lsi_hz, has_crystal, memory, is_debugged });
            }
            Command::Otp { bytes } if bytes.len() > OTP => return Err(Refusal::Otp(bytes.len())),
            Command::Otp { bytes } => self.set_otp(bytes),
            Command::Reset { cause } => self.request_reset(match cause {
                message::ResetCause::PowerOn => ResetCause::PowerOn,
                message::ResetCause::BrownOut => ResetCause::BrownOut,
                message::ResetCause::Pin => ResetCause::Pin,
                message::ResetCause::Software => ResetCause::Software,
            }),
            _ => return Err(Refusal::OtherRobot(Self::NAME)),
        }
        Ok(())
    }

    fn counted(&self) -> BoardStatistics {
        BoardStatistics::Crazyflie(self.statistics().into())
    }
}

impl Control for Zooid {
    const NAME: &'static str = "Zooid";

    fn obey(&mut self, command: Command) -> Result<(), Refusal> {
        match command {
            Command::Place { x_mm, y_mm, heading_degrees, vx_mm_s, vy_mm_s, turn_degrees_s } => {
                self.place(Some(TablePose {
                    x_mm: finite("x_mm", x_mm)?,
                    y_mm: finite("y_mm", y_mm)?,
                    heading_degrees: finite("heading_degrees", heading_degrees)?,
                    velocity_mm_s: [finite("vx_mm_s", vx_mm_s)?, finite("vy_mm_s", vy_mm_s)?],
                    turn_degrees_s: finite("turn_degrees_s", turn_degrees_s)?,
                }));
            }
            Command::Remove => self.place(None),
            Command::Light { lose, jitter_us, glitches_per_s, seed } => {
                let lose = probability(lose)?;
                if !(0.0..=Light::MOST_JITTER_US).contains(&jitter_us) {
                    let most = Light::MOST_JITTER_US;
                    return Err(Refusal::Jitter { most, value: jitter_us });
                }
                if !(0.0..=Light::MOST_GLITCHES_PER_S).contains(&glitches_per_s) {
                    let most = Light::MOST_GLITCHES_PER_S;
                    return Err(Refusal::Glitches { most, value: glitches_per_s });
                }
                self.set_light(Light { lose, jitter_us, glitches_per_s, seed });
            }
            Command::PowerDetector { reading } => self.set_power_detector(reading.into()),
            Command::Touch { keys } => self.press(keys),
            Command::Chip { lsi_hz, crystal, memory, seed, debugger: false } => {
                let (lsi_hz, memory) = (lsi(30_000..=50_000, lsi_hz)?, self::memory(memory, seed));
                self.set_chip(Chip { lsi_hz, has_crystal: crystal, memory, is_debugged: false });
            }
            // Power-on is the command `power`.
            Command::Reset { cause: message::ResetCause::BrownOut } => {
                self.request_reset(ResetCause::BrownOut);
            }
            Command::Power { on } => self.set_power(on),
            // The air sees to it.
            Command::Deaf { .. } => {}
            Command::Battery { volts, charging, .. } => {
                self.set_battery(f64::from(volts), charging);
            }
            _ => return Err(Refusal::OtherRobot(Self::NAME)),
        }
        Ok(())
    }

    fn counted(&self) -> BoardStatistics {
        BoardStatistics::Zooid(self.statistics().into())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn refusal<B: Control>(line: &str) -> String {
        let command = crate::message::parse(line.as_bytes()).expect("a command");
        match B::power_on(0).obey(command) {
            Ok(()) => "obeyed".into(),
            Err(refusal) => refusal.to_string(),
        }
    }

    #[test]
    fn a_zooid_obeys_what_it_has_and_refuses_the_rest() {
        for (line, answer) in [
            (r#"{"command":"place","x_mm":1,"y_mm":2,"heading_degrees":-3.5}"#, "obeyed"),
            (r#"{"command":"place","x_mm":1e300,"y_mm":2,"heading_degrees":0}"#, "obeyed"),
            (r#"{"command":"remove"}"#, "obeyed"),
            (r#"{"command":"touch","keys":255}"#, "obeyed"),
            (r#"{"command":"power","on":false}"#, "obeyed"),
            (r#"{"command":"deaf","to":[3,1]}"#, "obeyed"),
            (r#"{"command":"light","lose":1,"jitter_us":300,"seed":0}"#, "obeyed"),
            (
                r#"{"command":"light","lose":-0.1,"jitter_us":0,"seed":0}"#,
                "between 0 and 1, not -0.1",
            ),
            (
                r#"{"command":"light","lose":0,"jitter_us":0,"glitches_per_s":10000,"seed":0}"#,
                "obeyed",
            ),
            (
                r#"{"command":"light","lose":0,"jitter_us":0,"glitches_per_s":-1,"seed":0}"#,
                "between 0 and 10000, not -1",
            ),
            (
                r#"{"command":"light","lose":0,"jitter_us":301,"seed":0}"#,
                "between 0 and 300, not 301",
            ),
            (
                r#"{"command":"light","lose":0,"jitter_us":-1,"seed":0}"#,
                "between 0 and 300, not -1",
            ),
            (r#"{"command":"power_detector","reading":"live"}"#, "obeyed"),
            (r#"{"command":"chip","lsi_hz":50000,"crystal":false}"#, "obeyed"),
            (r#"{"command":"chip","lsi_hz":29999}"#, "between 30000 and 50000, not 29999"),
            (r#"{"command":"chip","lsi_hz":40000,"memory":"noise","seed":3}"#, "obeyed"),
            (r#"{"command":"chip","debugger":true}"#, "has no such thing"),
            (r#"{"command":"reset","cause":"brown_out"}"#, "obeyed"),
            (r#"{"command":"reset","cause":"pin"}"#, "a Zooid has no such thing"),
            (r#"{"command":"shutdown"}"#, "a Zooid has no such thing"),
            (r#"{"command":"send","type":1,"payload":""}"#, "a Zooid has no such thing"),
        ] {
            let answered = refusal::<Zooid>(line);
            assert!(answered.contains(answer), "{line}: {answered}");
        }
        for line in [
            r#"{"command":"touch","keys":1}"#,
            r#"{"command":"power_detector","reading":"latched"}"#,
            r#"{"command":"power","on":false}"#,
            r#"{"command":"deaf","to":[]}"#,
        ] {
            let refused = refusal::<Crazyflie>(line);
            assert!(refused.contains("a Crazyflie has no such thing"), "{refused}");
        }
        for (line, answer) in [
            (r#"{"command":"chip"}"#, "obeyed"),
            (
                r#"{"command":"chip","lsi_hz":17000,"crystal":false,"memory":"noise","seed":3}"#,
                "obeyed",
            ),
            (r#"{"command":"chip","lsi_hz":47001}"#, "between 17000 and 47000, not 47001"),
            (r#"{"command":"reset","cause":"brown_out"}"#, "obeyed"),
            (r#"{"command":"otp","bytes":"303b43463231"}"#, "obeyed"),
            (&format!(r#"{{"command":"otp","bytes":"{}"}}"#, "00".repeat(513)), "has 512"),
            (r#"{"command":"radio_processor"}"#, "obeyed"),
            (
                r#"{"command":"radio_processor","ready":false,"rts_bytes":4,"ble_shutdown_us":0,"ble_masks":true}"#,
                "obeyed",
            ),
            (r#"{"command":"radio_processor","rts_bytes":5}"#, "between 1 and 4, not 5"),
            (
                r#"{"command":"radio_processor","ble_shutdown_us":1000001}"#,
                "at most 1000000, not 1000001",
            ),
            (r#"{"command":"radio_restart"}"#, "obeyed"),
        ] {
            let answered = refusal::<Crazyflie>(line);
            assert!(answered.contains(answer), "{line}: {answered}");
        }
    }
}
