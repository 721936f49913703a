//! The ground station: packets of Bitcraze's protocol that come by the radio, and the answers to them.
//!
//! The ports and the order of the sources of commands are those of `firmware/station`. A packet waits
//! here for its task, which the flight executor interrupts, so that a plan delays no sample. The stops of
//! a person do not wait: they reach the flight task with the packet.
//!
//! **Not tried on hardware.**

use core::cell::RefCell;
use core::sync::atomic::Ordering;

use bittybuzz_board::log;
use bittybuzz_comms::syslink::SyslinkPacket;
use bittybuzz_crtp::{
    ArmingRequest, Command, Localization, MeasuredPose, Packet, Parameter, ParameterChange,
    Parameters, Value,
};
use bittybuzz_flight::arbiter::CommandSource;
use bittybuzz_flight::ekf::{PoseMeasurement, PositionMeasurement};
use bittybuzz_flight::{FlightState, Quat, Vec3};
use bittybuzz_memories::Deck;
use bittybuzz_runtime::pose::Pose;
use bittybuzz_station::{Outcome, Station, StationMoment};
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::channel::Channel;
use embassy_time::{Duration, Instant, with_timeout};
use heapless::Vec;

use super::send::{self, send};
use super::{FLIGHT_POSE, FlightPose, POSE, log_values};
use crate::decks;
use crate::flight::pilot_desk::{self, ADOPTED, DISARM, EMERGENCY_STOP};
use crate::pilot::{self, PersonRequest};
use crate::readiness;

/// The name that stations show.
pub const FIRMWARE: &str = concat!("BittyBuzz ", env!("CARGO_PKG_VERSION"));

/// Bytes that are kept of a packet: one more than the longest has, so that longer ones are refused.
const PACKET_BYTES: usize = 32;
/// The bits between port and channel, which belong to the link; an answer repeats those of the packet.
const LINK_BITS: u8 = 0x0c;
/// The time between two looks at the logs and the flight, and that without a station.
const BUSY: Duration = Duration::from_millis(10);
const IDLE: Duration = Duration::from_millis(50);
/// The number of looks at the logs for each at the flight, which has to be renewed ten times per second.
const LOOKS: u32 = 3;
/// The assumed age of a pose that arrives. The filter finds its mean by itself.
const POSE_AGE_S: f32 = 0.01;

/// The packets that wait.
static PACKETS: Channel<CriticalSectionRawMutex, Vec<u8, PACKET_BYTES>, 8> = Channel::new();

/// Queues a packet of the radio. If there is no room, the packet is dropped and counted.
pub fn receive(packet: &[u8]) {
    let kept = packet.get(..packet.len().min(PACKET_BYTES)).unwrap_or_default();
    let kept = Vec::from_slice(kept).unwrap_or_default();
    if PACKETS.try_send(kept).is_err() {
        send::count_dropped();
    }
}

/// Runs the task that executes the packets, and sends what stations log. `may_fly` is false after a
/// failure that keeps the motors off until power-on.
#[embassy_executor::task]
pub async fn serve(station: &'static RefCell<Station>, may_fly: bool) -> ! {
    let mut looked_at = Instant::MIN;
    let mut looks: u32 = 0;
    loop {
        let is_there = station.borrow().is_there(Instant::now().as_millis());
        let pause = if is_there { BUSY } else { IDLE };
        if let Ok(packet) = with_timeout(pause, PACKETS.receive()).await {
            process(&packet, &mut station.borrow_mut(), may_fly);
        }
        let now = Instant::now();
        if now.saturating_duration_since(looked_at) < BUSY {
            continue;
        }
        looked_at = now;
        looks = looks.wrapping_add(1);
        let station = &mut *station.borrow_mut();
        if !is_there || looks.is_multiple_of(LOOKS) {
            watch(station, moment(may_fly));
        }
        send_logs(station, now.as_millis());
    }
}

fn moment(may_fly: bool) -> StationMoment {
    let may_arm = may_fly && readiness::refusal().is_none();
    StationMoment { now_ms: Instant::now().as_millis(), may_arm }
}

fn process(packet: &[u8], station: &mut Station, may_fly: bool) {
    if !station.is_there(Instant::now().as_millis()) {
        describe(station.parameters_mut());
    }
    let reaction = station.receive(packet, Instant::now().as_millis());
    let link_bits = packet.first().map_or(0, |header| header & LINK_BITS);
    if let Some(packet) = &reaction.answer {
        answer(packet, link_bits);
    }
    match reaction.command {
        None => {}
        Some(Command::Localization(localization)) => locate(&localization, station.parameters()),
        Some(Command::Notification { is_success }) => {
            log::info!(
                "a ground station reports {=str}",
                if is_success { "success" } else { "failure" }
            );
        }
        Some(command) => {
            if let Some(packet) = execute(&command, station, moment(may_fly)) {
                answer(&packet, link_bits);
            }
        }
    }
}

/// Executes a command of the flight, and returns its answer.
fn execute(command: &Command, station: &mut Station, moment: StationMoment) -> Option<Packet> {
    match command {
        Command::EmergencyStop => {
            EMERGENCY_STOP.store(true, Ordering::Relaxed);
            pilot::REQUEST.signal(PersonRequest::Disarm);
        }
        Command::Arming(ArmingRequest::Disarm, _) => {
            DISARM.store(true, Ordering::Relaxed);
            pilot::REQUEST.signal(PersonRequest::Disarm);
        }
        Command::Parameter(ParameterChange {
            parameter: Parameter::KalmanResetEstimation,
            value: Value::Unsigned(1),
        }) => adopt(station.parameters()),
        _ => {}
    }
    let (outcome, answer) = pilot_desk::command(|stack| station.execute(command, stack, moment))?;
    if let Command::Arming(ArmingRequest::Arm, _) = command {
        match (outcome, readiness::refusal()) {
            (Outcome::Done, _) => pilot::REQUEST.signal(PersonRequest::Arm),
            (_, Some(refusal)) => log::warning!("the robot does not arm: {}", refusal),
            (_, None) => log::warning!("the robot does not arm: its motors are locked"),
        }
    }
    answer
}

/// Looks at the flight.
fn watch(station: &mut Station, moment: StationMoment) {
    let source = pilot_desk::look(|stack| station.poll(stack, moment));
    if source == Some(CommandSource::EmergencyStop) {
        EMERGENCY_STOP.store(true, Ordering::Relaxed);
    }
}

/// Sends the log packets that are due.
fn send_logs(station: &mut Station, now_ms: u64) {
    let info = *station.info();
    while send::has_room()
        && let Some(packet) =
            station.poll_log(now_ms, |variable| log_values::value(variable, &info))
    {
        answer(&packet, 0);
    }
}

/// Sends a packet to the station.
fn answer(packet: &Packet, link_bits: u8) {
    let mut bytes: Vec<u8, PACKET_BYTES> = Vec::from_slice(packet.bytes()).unwrap_or_default();
    if let Some(header) = bytes.first_mut() {
        *header |= link_bits;
    }
    send(&SyslinkPacket::Raw(&bytes));
}

/// Passes measured places on.
fn locate(localization: &Localization, parameters: &Parameters) {
    if let Some(MeasuredPose { position_m, quaternion }) = localization.own {
        let sigma_m = parameters.get(Parameter::LocSrvExtPosStdDev).as_f32();
        let sigma_rad = parameters.get(Parameter::LocSrvExtQuatStdDev).as_f32();
        let (place_m, age_s) = (Vec3::from_array(position_m), POSE_AGE_S);
        let pose = match quaternion {
            Some(quaternion) => {
                POSE.set(Pose::new(position_m, quaternion));
                let [x, y, z, w] = quaternion;
                let attitude = Quat::from_xyzw(x, y, z, w);
                FlightPose::Pose(PoseMeasurement {
                    position_m: place_m,
                    attitude,
                    sigma_m,
                    sigma_rad,
                    age_s,
                })
            }
            None => {
                FlightPose::Position(PositionMeasurement { position_m: place_m, sigma_m, age_s })
            }
        };
        FLIGHT_POSE.signal(pose);
    }
    if !localization.peers.is_empty() {
        let peers = localization.peers.iter();
        pilot_desk::command(|stack| {
            peers.for_each(|peer| stack.hear_peer(Vec3::from_array(peer.position_m)));
        });
    }
}

/// Lets a robot on the ground stand at the place in the parameters.
fn adopt(parameters: &Parameters) {
    let number = |parameter| parameters.get(parameter).as_f32();
    let position_m = Vec3::new(
        number(Parameter::KalmanInitialX),
        number(Parameter::KalmanInitialY),
        number(Parameter::KalmanInitialZ),
    );
    let (sine, cosine) = libm::sincosf(0.5 * number(Parameter::KalmanInitialYaw));
    let attitude = Quat::from_xyzw(0.0, 0.0, sine, cosine);
    ADOPTED.signal(FlightState { position_m, attitude, ..FlightState::default() });
}

/// Sets the parameters that describe the robot.
fn describe(parameters: &mut Parameters) {
    let decks = decks::result().and_then(Result::ok);
    let has = |deck| Value::Unsigned(decks.is_some_and(|decks| decks.has(deck)).into());
    parameters.set(Parameter::DeckBcFlow2, has(Deck::Flow2));
    parameters.set(Parameter::DeckBcZRanger2, has(Deck::ZRanger2));
    parameters.set(Parameter::DeckBcMultiranger, has(Deck::MultiRanger));
    parameters.set(Parameter::ImuSensorsBmp3xx, Value::Unsigned(1));
    parameters
        .set(Parameter::SystemSelftestPassed, Value::Signed(readiness::refusal().is_none().into()));
}
