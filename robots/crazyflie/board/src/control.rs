//! The commands that a Crazyflie handles, and its counters in the protocol's messages.

use std::ops::RangeInclusive;
use std::time::Duration;

use bittybuzz_chips::devices::eeprom_24aa64;
use bittybuzz_chips::devices::one_wire::CAPACITY;
use bittybuzz_chips::f405::OTP;
use bittybuzz_chips::{
    Battery, ChipProperties, ExternalPose, LineQuality, LinkFrame, Nrf51Settings, P2pFrame,
    ResetCause, Time,
};
use bittybuzz_emulation::message::{
    self, BoardStatistics, Command, CrazyflieStatistics, DeviceFault, MeasurementFault, PoseErrors,
    Room,
};
use bittybuzz_emulation::{CommandRefusal, Control, lsi, probability, within};

use crate::{AttachedDeck, BodySettings, CrazyflieBoard, PoseSource, RangesMm, Statistics};

/// Coordinates of a body in mm: 1 km, as far as poses in single precision are exact to 0.1 mm.
const PLACE_MM: RangeInclusive<f64> = -1e6..=1e6;
/// Directions in degrees.
const YAW_DEGREES: RangeInclusive<f64> = -360.0..=360.0;
/// Noise of poses in mm and in degrees.
const NOISE_MM: RangeInclusive<f64> = 0.0..=1000.0;
const NOISE_DEGREES: RangeInclusive<f64> = 0.0..=180.0;
/// Shares of thrust and charge, and factors on the noise of a sensor.
const SHARES: RangeInclusive<f64> = 0.0..=1.0;
const NOISE_FACTORS: RangeInclusive<f64> = 0.0..=1e6;
/// Coordinates of a wind in m/s, of a force in N, and times of gusts in s: more than any room has.
const WIND_M_S: RangeInclusive<f64> = -100.0..=100.0;
const GUSTS_M_S: RangeInclusive<f64> = 0.0..=100.0;
const GUST_S: RangeInclusive<f64> = 0.001..=1e3;
const FORCE_N: RangeInclusive<f64> = -100.0..=100.0;

/// Returns a room whose numbers are in their ranges.
fn checked_room(room: Room) -> Result<Room, CommandRefusal> {
    for (wind_m_s, force_n) in room.wind_m_s.into_iter().zip(room.force_n) {
        within("wind_m_s", WIND_M_S, wind_m_s)?;
        within("force_n", FORCE_N, force_n)?;
    }
    within("gusts_m_s", GUSTS_M_S, room.gusts_m_s)?;
    within("gust_s", GUST_S, room.gust_s)?;
    within("floor_mm", PLACE_MM, room.floor_mm)?;
    Ok(room)
}

/// Returns errors of poses whose numbers are in their ranges.
fn checked_errors(errors: PoseErrors) -> Result<PoseErrors, CommandRefusal> {
    probability(errors.lose)?;
    for (jump_mm, degrees) in errors.jump_mm.into_iter().zip(errors.marker_turn_degrees) {
        within("jump_mm", PLACE_MM, jump_mm)?;
        within("marker_turn_degrees", YAW_DEGREES, degrees)?;
    }
    within("turn_degrees", YAW_DEGREES, errors.turn_degrees)?;
    Ok(errors)
}

impl Control for CrazyflieBoard {
    const NAME: &'static str = "Crazyflie";

    fn execute(&mut self, command: Command) -> Result<(), CommandRefusal> {
        match command {
            Command::Send { kind, payload } => {
                let length = payload.len();
                let frame =
                    LinkFrame::new(kind, payload).ok_or(CommandRefusal::FrameTooLong(length))?;
                self.send(&frame);
            }
            Command::P2p { at, port, rssi, payload } => {
                let length = payload.len();
                let frame = P2pFrame::new(port, rssi, payload);
                let frame = frame.ok_or(CommandRefusal::P2pTooLong(length))?;
                let end = Time::from_nanos(u64::try_from(at.as_nanos()).unwrap_or(u64::MAX));
                self.add_frame(&frame, end);
            }
            Command::Pose { x_mm, y_mm, z_mm, yaw_degrees } => {
                self.send_pose(ExternalPose::upright([x_mm, y_mm, z_mm], yaw_degrees));
            }
            Command::Bytes { bytes } => self.send_bytes(&bytes),
            Command::Link { lose, corrupt, seed } => {
                let (lose, corrupt) = (probability(lose)?, probability(corrupt)?);
                self.set_link(LineQuality { lose, corrupt, seed });
            }
            Command::RadioProcessor { ready, rts_bytes, ble_shutdown_us, ble_masks } => {
                let most = Nrf51Settings::RTS_BYTES_MAX;
                if !(1..=most).contains(&rts_bytes) {
                    return Err(CommandRefusal::RtsBytes { most, value: rts_bytes });
                }
                if ble_shutdown_us > 1_000_000 {
                    return Err(CommandRefusal::BleShutdown(ble_shutdown_us));
                }
                let ble_shutdown = Time::from_micros(ble_shutdown_us);
                let knows_ready = ready;
                self.set_nrf51(Nrf51Settings { knows_ready, rts_bytes, ble_shutdown, ble_masks });
            }
            Command::RadioRestart => self.restart_nrf51(),
            Command::FlowControl { full } => self.set_flow_control(full),
            Command::DeviceFault { fault } => {
                let is_of_deck = matches!(fault, DeviceFault::Flow(_) | DeviceFault::Distance(_));
                if is_of_deck && !self.has_flow_deck() {
                    return Err(CommandRefusal::NoFlowDeck);
                }
                self.set_fault(fault);
            }
            Command::Eeprom { bytes } if bytes.len() > eeprom_24aa64::CAPACITY => {
                return Err(CommandRefusal::Eeprom(bytes.len()));
            }
            Command::Eeprom { bytes } => self.set_eeprom(&bytes),
            Command::Ranges { down_mm, front_mm, back_mm, left_mm, right_mm, up_mm } => {
                self.set_ranges(RangesMm {
                    down: down_mm,
                    front: front_mm,
                    back: back_mm,
                    left: left_mm,
                    right: right_mm,
                    up: up_mm,
                });
            }
            Command::Decks { decks } => {
                let decks = decks.into_iter().map(attached);
                self.set_decks(decks.collect::<Result<_, _>>()?);
            }
            Command::Battery { volts, charging, usb_powered } => {
                self.set_battery(Battery { volts, charging, usb_powered });
            }
            Command::Shutdown => self.request_shutdown(),
            Command::Body {
                seed,
                x_mm,
                y_mm,
                yaw_degrees,
                pose_ms,
                pose_noise_mm,
                pose_noise_degrees,
            } => {
                let place_mm = [within("x_mm", PLACE_MM, x_mm)?, within("y_mm", PLACE_MM, y_mm)?];
                let noise_degrees =
                    within("pose_noise_degrees", NOISE_DEGREES, pose_noise_degrees)?;
                let poses = PoseSource {
                    period_ms: pose_ms,
                    position_sigma_m: within("pose_noise_mm", NOISE_MM, pose_noise_mm)? / 1000.0,
                    attitude_sigma_rad: noise_degrees.to_radians(),
                };
                self.set_body(&BodySettings {
                    seed,
                    place_m: place_mm.map(|mm| mm / 1000.0),
                    yaw_rad: within("yaw_degrees", YAW_DEGREES, yaw_degrees)?.to_radians(),
                    poses: (pose_ms > 0).then_some(poses),
                });
            }
            Command::Room(room) => {
                let room = checked_room(room)?;
                self.body_mut().ok_or(CommandRefusal::NoBody)?.set_room(&room);
            }
            Command::PoseErrors(errors) => {
                let errors = checked_errors(errors)?;
                self.body_mut().ok_or(CommandRefusal::NoBody)?.set_pose_errors(&errors);
            }
            Command::Powertrain(powertrain) => {
                for share in powertrain.thrust_shares.into_iter().chain(powertrain.charge) {
                    within("a share", SHARES, share)?;
                }
                self.body_mut().ok_or(CommandRefusal::NoBody)?.set_powertrain(&powertrain);
            }
            Command::BodyFault { sensor, fault } => {
                if let Some(MeasurementFault::Noisy(factor)) = fault {
                    within("noisy", NOISE_FACTORS, factor)?;
                }
                self.body_mut().ok_or(CommandRefusal::NoBody)?.set_fault(sensor, fault);
            }
            // The server opens it, and passes packets on as link frames.
            Command::Door { .. } => {}
            Command::Chip { lsi_hz, crystal, memory, seed, debugger } => {
                let lsi_hz = lsi(17_000..=47_000, lsi_hz)?;
                let memory = bittybuzz_emulation::memory(memory, seed);
                let (has_crystal, is_debugged) = (crystal, debugger);
                self.set_chip(ChipProperties { lsi_hz, has_crystal, memory, is_debugged });
            }
            Command::Otp { bytes } if bytes.len() > OTP => {
                return Err(CommandRefusal::Otp(bytes.len()));
            }
            Command::Otp { bytes } => self.set_otp(bytes),
            Command::Reset { cause } => self.request_reset(match cause {
                message::ResetCause::PowerOn => ResetCause::PowerOn,
                message::ResetCause::BrownOut => ResetCause::BrownOut,
                message::ResetCause::Pin => ResetCause::Pin,
                message::ResetCause::Software => ResetCause::Software,
            }),
            _ => return Err(CommandRefusal::OtherRobot(Self::NAME)),
        }
        Ok(())
    }

    fn counted(&self) -> BoardStatistics {
        BoardStatistics::Crazyflie(self.statistics().into())
    }
}

/// Returns the deck of a command.
fn attached(deck: message::Deck) -> Result<AttachedDeck, CommandRefusal> {
    Ok(match deck {
        message::Deck::FlowV2 => AttachedDeck::FlowV2,
        message::Deck::ZRangerV2 => AttachedDeck::ZRangerV2,
        message::Deck::MultiRanger => AttachedDeck::MultiRanger,
        message::Deck::Memory(bytes) => {
            let mut content = [0xff; CAPACITY];
            let begin = content.get_mut(..bytes.len());
            begin.ok_or(CommandRefusal::DeckMemory(bytes.len()))?.copy_from_slice(&bytes);
            AttachedDeck::Memory(content)
        }
    })
}

impl From<Statistics> for CrazyflieStatistics {
    fn from(s: Statistics) -> Self {
        CrazyflieStatistics {
            receive_latency: Duration::from_nanos(s.receive_latency.nanos()),
            overruns: s.overruns,
            framing_errors: s.framing_errors,
            peer_received: s.peer_received,
            peer_framing_errors: s.peer_framing_errors,
            peer_bad_checksums: s.peer_bad_checksums,
            peer_dropped: s.peer_dropped,
            peer_overruns: s.peer_overruns,
            peer_unsent: s.peer_unsent,
            radio_unheard: s.radio_unheard,
            radio_overflown: s.radio_overflown,
            radio_cut: s.radio_cut,
            link_lost: s.link_lost,
            link_corrupted: s.link_corrupted,
            clocks_hz: s.clocks_hz,
            accesses_without_clock: s.accesses_without_clock,
            unknown: s.unknown,
        }
    }
}

#[cfg(test)]
mod tests {
    use bittybuzz_chips::Board;

    use super::*;

    fn refusal(line: &str) -> String {
        let command = message::parse(line.as_bytes()).expect("a command");
        match CrazyflieBoard::power_on(0).execute(command) {
            Ok(()) => "obeyed".into(),
            Err(refusal) => refusal.to_string(),
        }
    }

    #[test]
    fn a_crazyflie_executes_its_commands_and_refuses_others() {
        for line in [
            r#"{"command":"touch","keys":1}"#,
            r#"{"command":"power_detector","reading":"latched"}"#,
            r#"{"command":"power","on":false}"#,
            r#"{"command":"deaf","to":[]}"#,
        ] {
            let refused = refusal(line);
            assert!(refused.contains("a Crazyflie does not handle this command"), "{refused}");
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
            (r#"{"command":"device_fault","fault":{"imu":{"sda_low":9}}}"#, "obeyed"),
            (r#"{"command":"device_fault","fault":{"imu":null}}"#, "obeyed"),
            (r#"{"command":"device_fault","fault":{"barometer":"frozen_data"}}"#, "obeyed"),
            (r#"{"command":"device_fault","fault":{"eeprom":{"slow_writes_ms":20}}}"#, "obeyed"),
            (r#"{"command":"device_fault","fault":{"flow":"no_answer"}}"#, "no Flow deck"),
            (r#"{"command":"device_fault","fault":{"distance":null}}"#, "no Flow deck"),
            (r#"{"command":"device_fault","fault":{"deck_memories":{"wrong_bit":6}}}"#, "obeyed"),
            (r#"{"command":"eeprom","bytes":"30784243"}"#, "obeyed"),
            (&format!(r#"{{"command":"eeprom","bytes":"{}"}}"#, "00".repeat(8193)), "not 8193"),
            (r#"{"command":"ranges","front_mm":700}"#, "obeyed"),
            (r#"{"command":"decks","decks":["flow_v2","multi_ranger"]}"#, "obeyed"),
            (r#"{"command":"decks","decks":["z_ranger_v2",{"memory":"eb00"}]}"#, "obeyed"),
            (
                &format!(r#"{{"command":"decks","decks":[{{"memory":"{}"}}]}}"#, "00".repeat(113)),
                "has at most 112 bytes, this one has 113",
            ),
            (
                r#"{"command":"body","seed":1,"x_mm":1000000,"y_mm":-1000000,"yaw_degrees":360}"#,
                "obeyed",
            ),
            (
                r#"{"command":"body","seed":1,"x_mm":1e308}"#,
                "x_mm is between -1000000 and 1000000, not 1000000000000",
            ),
            (r#"{"command":"body","seed":1,"y_mm":-1000000.5}"#, "y_mm is between"),
            (r#"{"command":"room","force_n":[0,0,-101]}"#, "force_n is between -100 and 100"),
            (r#"{"command":"room","gust_s":0}"#, "gust_s is between 0.001 and 1000, not 0"),
            (r#"{"command":"room","wind_m_s":[2,0,0],"gusts_m_s":1}"#, "the robot has no body"),
            (r#"{"command":"pose_errors","lose":1.5}"#, "a probability is between 0 and 1"),
            (r#"{"command":"pose_errors","jump_mm":[0,0,10000000]}"#, "jump_mm is between"),
            (r#"{"command":"powertrain","thrust_shares":[1,1,2,1]}"#, "between 0 and 1, not 2"),
            (r#"{"command":"powertrain","charge":-1}"#, "between 0 and 1, not -1"),
            (
                r#"{"command":"body_fault","sensor":"flow","fault":{"noisy":-1}}"#,
                "noisy is between 0 and 1000000, not -1",
            ),
            (r#"{"command":"body_fault","sensor":"inertial"}"#, "the robot has no body"),
            (r#"{"command":"body","seed":1,"yaw_degrees":361}"#, "between -360 and 360, not 361"),
            (r#"{"command":"body","seed":1,"pose_noise_mm":-1}"#, "between 0 and 1000, not -1"),
            (r#"{"command":"body","seed":1,"pose_noise_degrees":181}"#, "between 0 and 180"),
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
            let answered = refusal(line);
            assert!(answered.contains(answer), "{line}: {answered}");
        }
    }
}
