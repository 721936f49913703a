//! Faults, and the flights in which they occur.

use bittybuzz_crazyflie_physics::DVec3;
use bittybuzz_random::Random;

/// A kind of fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FaultKind {
    ImuStuck,
    ImuNoisy,
    ImuSilent,
    FlowStuck,
    FlowNoisy,
    FlowSilent,
    RangeStuck,
    RangeNoisy,
    RangeSilent,
    CaptureStuck,
    CaptureNoisy,
    CaptureSilent,
    PosesLost,
    PoseJump,
    CommandsLost,
    WeakMotor,
    EmptyBattery,
    ScriptFault,
    StuckScript,
}

impl FaultKind {
    /// All kinds.
    pub const ALL: [FaultKind; 19] = [
        FaultKind::ImuStuck,
        FaultKind::ImuNoisy,
        FaultKind::ImuSilent,
        FaultKind::FlowStuck,
        FaultKind::FlowNoisy,
        FaultKind::FlowSilent,
        FaultKind::RangeStuck,
        FaultKind::RangeNoisy,
        FaultKind::RangeSilent,
        FaultKind::CaptureStuck,
        FaultKind::CaptureNoisy,
        FaultKind::CaptureSilent,
        FaultKind::PosesLost,
        FaultKind::PoseJump,
        FaultKind::CommandsLost,
        FaultKind::WeakMotor,
        FaultKind::EmptyBattery,
        FaultKind::ScriptFault,
        FaultKind::StuckScript,
    ];

    /// Returns true for a fault of the inertial sensors, after which the motors stop.
    pub fn is_imu_fault(self) -> bool {
        matches!(self, FaultKind::ImuStuck | FaultKind::ImuNoisy | FaultKind::ImuSilent)
    }

    /// Returns the source of position that the fault concerns, `None` for any.
    fn source(self) -> Option<PositionSource> {
        match self {
            FaultKind::FlowStuck
            | FaultKind::FlowNoisy
            | FaultKind::FlowSilent
            | FaultKind::RangeStuck
            | FaultKind::RangeNoisy
            | FaultKind::RangeSilent => Some(PositionSource::FlowDeck),
            FaultKind::CaptureStuck
            | FaultKind::CaptureNoisy
            | FaultKind::CaptureSilent
            | FaultKind::PosesLost
            | FaultKind::PoseJump => Some(PositionSource::MotionCapture),
            _ => None,
        }
    }
}

/// The sensors that give the position.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PositionSource {
    MotionCapture,
    FlowDeck,
}

/// One flight: everything that differs between flights.
#[derive(Clone, Debug)]
pub struct Scenario {
    pub number: usize,
    pub seed: u64,
    pub kind: FaultKind,
    pub source: PositionSource,
    /// Time of the fault after take-off, in seconds.
    pub fault_after_s: f64,
    /// Factor on the noise of a noisy sensor.
    pub noise_factor: f64,
    /// Probability that a pose is lost.
    pub loss: f64,
    /// The motor that loses thrust.
    pub motor: usize,
    /// The remaining charge of an empty battery, or its constant voltage in V.
    pub charge: f64,
    pub volts: Option<f64>,
    /// The offset of poses in m.
    pub jump_m: DVec3,
    /// Random numbers of the pilot.
    pub pilot: Random,
}

impl Scenario {
    /// Returns the flight of this number. Consecutive numbers have different kinds of faults.
    pub fn new(number: usize) -> Self {
        let kinds = FaultKind::ALL.len();
        let (kind, round) = (FaultKind::ALL[number % kinds], number / kinds);
        // Faults of a source are 5 kinds for motion capture and 6 for the deck. With 9 of 16 of the
        // other kinds, motion capture has half of all flights.
        let drawn = if (round * 9 + number) % 16 < 9 {
            PositionSource::MotionCapture
        } else {
            PositionSource::FlowDeck
        };
        let seed = 0x5eed_0000 + number as u64;
        let mut random = Random::new(seed);
        let mut between = |least: f64, most: f64| {
            let unit = random.unit();
            least + (most - least) * unit
        };
        let (is_imu, logarithm) = (kind.is_imu_fault(), between(0.0, 1.0));
        let (least, most): (f64, f64) = if is_imu { (1000.0, 5000.0) } else { (5.0, 50.0) };
        let direction = DVec3::new(between(-1.0, 1.0), between(-1.0, 1.0), between(-0.3, 0.3));
        let is_constant = between(0.0, 1.0) < 0.5;
        Scenario {
            number,
            seed,
            kind,
            source: kind.source().unwrap_or(drawn),
            fault_after_s: between(3.0, 8.0),
            noise_factor: least * (most / least).powf(logarithm),
            loss: between(0.5, 1.0),
            motor: (between(0.0, 4.0) as usize).min(3),
            charge: between(0.0, 0.04),
            volts: is_constant.then(|| between(2.7, 2.95)),
            jump_m: direction.normalize() * between(0.3, 3.0),
            pilot: Random::new(seed ^ 0x0070_110f),
        }
    }
}
