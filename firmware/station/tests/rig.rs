//! A robot in a room with motion capture, and a ground station that sends it packets.

use bittybuzz_crazyflie_physics::sensors::{
    Imu, ImuSettings, MotionCapture, MotionCaptureSettings,
};
use bittybuzz_crazyflie_physics::{Airframe, Drone, DroneSurroundings, STEP_S};
use bittybuzz_crtp::{Command, Identity, Packet};
use bittybuzz_flight::arbiter::CommandSource;
use bittybuzz_flight::ekf::PoseMeasurement;
use bittybuzz_flight::pilot::{Pilot, PilotMoment, PilotSettings};
use bittybuzz_flight::stack::{FlightStack, StackSettings};
use bittybuzz_flight::{FlightState, ImuSample, MotorDuties, Vec3};
use bittybuzz_station::{Outcome, OwnerLimit, ScriptRank, Station, StationMoment};

/// Ticks between two looks of the station at the flight.
const POLL_MS: u64 = 30;

/// Returns the bytes of hexadecimal digits.
pub fn bytes(digits: &str) -> Vec<u8> {
    let pairs = digits.as_bytes().chunks(2);
    pairs.map(|pair| u8::from_str_radix(str::from_utf8(pair).unwrap(), 16).unwrap()).collect()
}

/// A robot that a script or a station flies.
pub struct Rig {
    pub stack: FlightStack,
    pub station: Station,
    pub pilot: Pilot,
    pub now_ms: u64,
    pub source: CommandSource,
    /// The pilot of a script that runs acts ten times per second.
    pub has_script: bool,
    /// Voltage that the robot measures instead of its battery's.
    pub battery_v: Option<f32>,
    /// The air and the ground around the body.
    pub surroundings: DroneSurroundings,
    drone: Drone,
    imu: Imu,
    capture: MotionCapture,
    duties: MotorDuties,
}

impl Rig {
    /// A robot that stood for two seconds.
    pub fn new(seed: u64) -> Self {
        Rig::with_limits(seed, &[])
    }

    /// A robot with limits of its owner that stood for two seconds.
    pub fn with_limits(seed: u64, owner: &[(OwnerLimit, f32)]) -> Self {
        let mut station = Station::new(Identity { id: 0xe7, firmware: "", device: "" });
        for (limit, number) in owner {
            station.limit(*limit, *number);
        }
        let (limits, fence) = station.limits().unwrap();
        let mut drone = Drone::nominal(Airframe::CRAZYFLIE_2_1_PLUS);
        drone.stand(0.0, 0.0, 0.0, 0.0);
        let settings = StackSettings { limits, fence, ..StackSettings::CRAZYFLIE_2_1_PLUS };
        let mut rig = Rig {
            stack: FlightStack::new(settings, &FlightState::default()),
            station,
            pilot: Pilot::new(PilotSettings::CRAZYFLIE),
            now_ms: 0,
            source: CommandSource::Script,
            has_script: false,
            battery_v: None,
            surroundings: DroneSurroundings::default(),
            drone,
            imu: Imu::new(&Airframe::CRAZYFLIE_2_1_PLUS, ImuSettings::BMI088, seed),
            capture: MotionCapture::new(MotionCaptureSettings::ROOM, seed),
            duties: MotorDuties::default(),
        };
        rig.run(2000);
        rig
    }

    /// Returns the place of the body in m.
    pub fn place_m(&self) -> Vec3 {
        self.drone.state().position_m.as_vec3()
    }

    pub fn are_motors_off(&self) -> bool {
        self.duties == MotorDuties::default()
    }

    pub fn assert_whole(&self) {
        assert!(!self.drone.has_crashed() && self.place_m().z < 0.03, "{}", self.place_m());
    }

    fn moment(&self) -> StationMoment {
        StationMoment { now_ms: self.now_ms, may_arm: true }
    }

    /// Lets so many milliseconds pass.
    pub fn run(&mut self, ms: u64) {
        for _ in 0..ms {
            self.now_ms += 1;
            self.drone.step(self.duties.0.map(f64::from), &self.surroundings);
            let state = *self.drone.state();
            if let Some(pose) = self.capture.sample(&state) {
                self.stack.receive_pose(&PoseMeasurement {
                    position_m: pose.position_m.as_vec3(),
                    attitude: pose.attitude.as_quat(),
                    sigma_m: 0.001,
                    sigma_rad: 0.005,
                    age_s: ((state.steps - pose.steps) as f64 * STEP_S) as f32,
                });
            }
            if let Some(counts) = self.imu.sample(&state) {
                let sample = ImuSample {
                    gyro_rad_s: counts.gyro_rad_s().as_vec3(),
                    accel_m_s2: counts.accel_m_s2().as_vec3(),
                };
                let volts = self.battery_v.unwrap_or(self.drone.battery_volts() as f32);
                self.duties = self.stack.tick(Some(&sample), volts);
            }
            if self.now_ms.is_multiple_of(POLL_MS) {
                let moment = self.moment();
                (self.source, _) = self.station.poll(&mut self.stack, moment);
            }
            if self.has_script && self.now_ms.is_multiple_of(100) {
                let moment = PilotMoment { now_ms: self.now_ms, battery_mv: 4000 };
                let rank = ScriptRank::Usual;
                let mut aircraft = self.station.script_aircraft(&mut self.stack, rank, self.now_ms);
                self.pilot.tick(&mut aircraft, moment);
            }
        }
    }

    /// Sends a packet, and returns the outcome of its command and the answer to it.
    pub fn send(&mut self, packet: &[u8]) -> (Option<Outcome>, Option<Packet>) {
        let reaction = self.station.receive(packet, self.now_ms);
        match reaction.command {
            None => (None, reaction.answer),
            Some(command) => {
                let moment = self.moment();
                let (outcome, answer) = self.station.execute(&command, &mut self.stack, moment);
                if let Command::Arming(..) = command
                    && outcome == Outcome::Done
                {
                    self.pilot.permit(self.now_ms);
                }
                (Some(outcome), answer.or(reaction.answer))
            }
        }
    }

    /// Sends a packet that has to be executed.
    pub fn command(&mut self, digits: &str) {
        let (outcome, _) = self.send(&bytes(digits));
        assert_eq!(outcome, Some(Outcome::Done), "{digits} at {} ms", self.now_ms);
    }

    /// Sends a packet ten times per second.
    pub fn stream(&mut self, digits: &str, ms: u64) {
        for _ in 0..ms / 100 {
            self.send(&bytes(digits));
            self.run(100);
        }
    }

    /// Stays in touch with the station, without a command: an echo twice per second.
    pub fn stay(&mut self, ms: u64) {
        for _ in 0..ms / 500 {
            self.send(&[0xf0, 1]);
            self.run(500);
        }
    }

    /// Runs until the motors are off, and a second more.
    pub fn run_until_off(&mut self, patience_ms: u64) {
        let until_ms = self.now_ms + patience_ms;
        while !self.are_motors_off() {
            assert!(self.now_ms < until_ms, "{:?} at {}", self.stack.stage(), self.place_m());
            self.run(20);
        }
        self.run(1000);
    }
}
