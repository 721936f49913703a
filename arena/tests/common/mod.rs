//! A brain for tests, which follows its settings and stores the frames that it receives.

pub mod robots;

use bittybuzz_arena::engine::{
    Area, Brain, FrameSighting, Io, LinkSettings, Loss, Pose, RobotId, Side,
};
use bittybuzz_crazyflie_model::{Flight, Positioning, Velocity};
use bittybuzz_kilobot_model::KilobotMotors;
use bittybuzz_motion::drive::Wheels;
use bittybuzz_zooids_model::Drive;
use robots::{RobotKind, Settings, World};

/// A received frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Said {
    pub tick: u64,
    pub bytes: Vec<u8>,
    pub sighting: FrameSighting,
}

impl Said {
    /// The sender's id, which [`Probe`] puts into its frames.
    pub fn from(&self) -> u16 {
        u16::from_le_bytes([self.bytes[1], self.bytes[2]])
    }

    /// The frame's number.
    pub fn number(&self) -> u32 {
        u32::from_le_bytes(self.bytes[3..7].try_into().unwrap())
    }

    /// The sender's ticks when the frame began.
    pub fn written(&self) -> u64 {
        u64::from(u16::from_le_bytes([self.bytes[7], self.bytes[8]]))
    }

    pub fn distance(&self) -> f32 {
        self.sighting.place().unwrap()[0]
    }
}

/// A brain that follows these settings.
#[derive(Clone, Debug, Default)]
pub struct Probe {
    /// Duties of both motors or wheels.
    pub motors: (i16, i16),
    /// For Crazyflies.
    pub fly: Option<Velocity>,
    /// Whether it always has frames to send: a Kilobot one in a tick, others three.
    pub talks: bool,
    /// Frames that wait.
    pub waiting: u32,
    /// Frames given to the link.
    pub given: u32,
    pub id: u16,
    pub received: Vec<Said>,
    pub light: u16,
    /// Front, left, back, right.
    pub ranges: [Option<f32>; 4],
    pub ticks: u64,
}

impl Probe {
    pub fn talking() -> Self {
        Probe { talks: true, ..Probe::default() }
    }

    pub fn driving(left: i16, right: i16) -> Self {
        Probe { motors: (left, right), ..Probe::default() }
    }

    pub fn flying(forward: f32, left: f32, up: f32) -> Self {
        Probe { fly: Some(Velocity { forward, left, up, turn: 0.0 }), ..Probe::default() }
    }

    /// Returns the number of frames received from that robot.
    pub fn received_from(&self, id: RobotId) -> usize {
        self.received.iter().filter(|frame| frame.from() == id.0).count()
    }
}

impl Brain for Probe {
    fn tick(&mut self, io: &mut Io<'_>) {
        self.ticks += 1;
        self.light = io.sensors.light();
        self.ranges =
            [Side::Front, Side::Left, Side::Back, Side::Right].map(|side| io.sensors.range(side));
        self.received.extend(io.inbox.iter().map(|frame| Said {
            tick: io.now,
            bytes: frame.bytes.to_vec(),
            sighting: frame.sighting,
        }));
        self.id = io.id.0;
        if self.talks {
            self.waiting = if io.controls::<KilobotMotors>().is_some() { 1 } else { 3 };
        }
        let (left, right) = self.motors;
        if let Some(motors) = io.controls::<KilobotMotors>() {
            (motors.left, motors.right) = (left as u8, right as u8);
        } else if let Some(drive) = io.controls::<Drive>() {
            *drive = Drive::Wheels(Wheels { left: left as i8, right: right as i8 });
        } else if let Some(flight) = io.controls::<Flight>() {
            *flight = self.fly.map_or(Flight::Off, Flight::Velocity);
        }
        *io.led = (self.received.len() % 8) as u8;
    }

    fn has_frame(&self) -> bool {
        self.waiting > 0
    }

    fn next_frame(&mut self, frame: &mut [u8]) -> usize {
        frame[0] = 5;
        frame[1..3].copy_from_slice(&self.id.to_le_bytes());
        frame[3..7].copy_from_slice(&self.given.to_le_bytes());
        frame[7..9].copy_from_slice(&(self.ticks as u16).to_le_bytes());
        self.given += 1;
        self.waiting -= 1;
        9
    }
}

/// Settings without any chance: equal robots, no loss, no noise, exact clocks. Infrared ends sharply 70 mm from rim to rim.
pub fn exact() -> Settings {
    let mut settings =
        Settings { area: Area { width: 4000.0, height: 4000.0 }, ..Settings::default() };
    settings.kilobot.speed_sigma = 0.0;
    settings.kilobot.turn_sigma = 0.0;
    settings.kilobot.bias_sigma = 0.0;
    settings.kilobot.noise_sigma = 0.0;
    settings.zooid.gain_sigma = 0.0;
    settings.crazyflie.positioning =
        Positioning::Absolute { sigma: 0.0, yaw_sigma: 0.0, period_ms: 20 };
    for link in links(&mut settings) {
        link.loss = Loss::even(0.0);
    }
    settings.infrared.link.range = Some(70.0);
    settings.infrared.link.edge = 0.0;
    settings.infrared.distance_sigma = 0.0;
    settings.infrared.clock_sigma = 0.0;
    settings
}

pub fn links(settings: &mut Settings) -> [&mut LinkSettings; 3] {
    [&mut settings.infrared.link, &mut settings.nrf24.link, &mut settings.p2p.link]
}

pub fn kilobot(world: &mut World<Probe>, x: f32, y: f32, heading: f32, brain: Probe) -> RobotId {
    world.add(RobotKind::Kilobot, Pose::new(x, y, heading), brain).unwrap()
}

pub fn run(world: &mut World<Probe>, ticks: u64) {
    for _ in 0..ticks {
        world.tick();
    }
}

pub fn pose(world: &World<Probe>, id: RobotId) -> Pose {
    world.robot(id).unwrap().pose
}

pub fn probe(world: &World<Probe>, id: RobotId) -> &Probe {
    world.brain(id).unwrap()
}

/// Lets everything arrive that was given to a link.
pub fn drain(world: &mut World<Probe>) {
    for id in world.ids() {
        world.brain_mut(id).unwrap().talks = false;
    }
    run(world, 20);
}

/// Mean and standard deviation.
pub fn moments(values: &[f32]) -> (f32, f32) {
    let count = values.len() as f32;
    let mean = values.iter().sum::<f32>() / count;
    let variance = values.iter().map(|value| (value - mean).powi(2)).sum::<f32>() / (count - 1.0);
    (mean, variance.sqrt())
}

#[track_caller]
pub fn close(found: f32, expected: f32, tolerance: f32) {
    assert!((found - expected).abs() <= tolerance, "{found} instead of {expected} +- {tolerance}");
}

pub fn crazyflie(world: &mut World<Probe>, x: f32, y: f32, brain: Probe) -> RobotId {
    world.add(RobotKind::Crazyflie, Pose::new(x, y, 0.0), brain).unwrap()
}

/// Kilobots with unlike clocks that send at every fourth timer interrupt (131 ms).
pub fn busy(seed: u64) -> Settings {
    let mut settings = Settings { seed, ..exact() };
    settings.infrared.clock_sigma = 0.01;
    settings.infrared.tx_period = 781;
    settings
}
