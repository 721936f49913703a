//! A table of Zooids under their projector, in one emulator program: they hear each other's radio.
//!
//! Places are as scripts know them: mm from the middle of the picture, x to the right, y up; directions in degrees,
//! anticlockwise from x.

use std::path::PathBuf;
use std::time::Duration;

use bittybuzz_compiler::fit;
use bittybuzz_emulation::Emulator;
use bittybuzz_emulation::message::{AirStatistics, PowerDetector};
use bittybuzz_robot_spec::{Layout, Robot};
use bittybuzz_tests::bbz;
use bittybuzz_zooids_board::STEP_MM;

use crate::trace_log::TraceLog;
use crate::{
    BoardStatistics, Command, Core, EmulatorEvent, RobotStatistics, TimedEvent, ZooidStatistics,
    image_for,
};

/// Column and row of the picture's middle: 56 to 967 and 227 to 796 are projected.
const MIDDLE: [f64; 2] = [511.5, 511.5];

/// From wheel to wheel, mm (SwarmUI's readme).
const TRACK_MM: f64 = 20.0;
/// A wheel's speed at the highest duty that the makers use, and the duty below which it stands (arena's model).
const FULL_MM_S: f64 = 500.0;
const FULL_DUTY: f64 = 0.60;
const DEAD_DUTY: f64 = 0.22;
/// Between two looks at the motors of robots that drive.
const DRIVE_STEP: Duration = Duration::from_millis(2);

/// The Zooid's image. `BITTYBUZZ_ZOOIDS` names another one than the one in its folder.
pub fn zooids() -> PathBuf {
    if let Some(path) = std::env::var_os("BITTYBUZZ_ZOOIDS") {
        return PathBuf::from(path);
    }
    let path =
        bbz::root().join("firmware/zooids/target/thumbv6m-none-eabi/release/bittybuzz-zooids");
    assert!(
        path.exists(),
        "no firmware: run `cargo build --locked --release` in firmware/zooids first"
    );
    path
}

/// The file of the Zooid.
pub fn robot() -> Robot {
    bittybuzz_robot_files::find("zooids").expect("a shipped robot")
}

/// The memory of a Zooid.
pub fn layout() -> Layout {
    robot().layout.expect("it has a layout")
}

/// The content of a Zooid's script region with this script, whose image is sealed.
pub fn script_section(script: &str) -> Vec<u8> {
    let sealed = fit::sealed(&image_for("zooids", script), &robot()).expect("a sound image");
    layout().script_section(&sealed).expect("a short script")
}

/// Where a Zooid is and how it moves.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Place {
    /// mm.
    pub x: f64,
    /// mm.
    pub y: f64,
    /// Degrees.
    pub heading: f64,
    /// mm/s ahead.
    pub speed: f64,
    /// Degrees per second, anticlockwise.
    pub turn: f64,
}

impl Place {
    /// It stands there.
    pub fn at(x: f64, y: f64, heading: f64) -> Self {
        Place { x, y, heading, ..Place::default() }
    }

    /// After so long, on an arc.
    pub fn after(&self, span: Duration) -> Self {
        let (seconds, half) = (span.as_secs_f64(), self.turn * span.as_secs_f64() / 2.0);
        let middle = (self.heading + half).to_radians();
        // The chord of an arc is shorter than the arc.
        let shorter = if half == 0.0 { 1.0 } else { half.to_radians().sin() / half.to_radians() };
        let chord = self.speed * seconds * shorter;
        Place {
            x: self.x + chord * middle.cos(),
            y: self.y + chord * middle.sin(),
            heading: self.heading + 2.0 * half,
            ..*self
        }
    }

    /// In the projector's frame, whose y and headings go the other way.
    fn command(&self) -> Command {
        let (sin, cos) = self.heading.to_radians().sin_cos();
        Command::Place {
            x_mm: MIDDLE[0] * STEP_MM[0] + self.x,
            y_mm: MIDDLE[1] * STEP_MM[1] - self.y,
            heading_degrees: -self.heading,
            vx_mm_s: self.speed * cos,
            vy_mm_s: -self.speed * sin,
            turn_degrees_s: -self.turn,
        }
    }
}

/// A robot of the table.
pub struct Zooid {
    /// The messages of its firmware and its script.
    pub trace_log: TraceLog,
    /// Its events, except those of its log.
    pub events: Vec<TimedEvent>,
    /// Duties of IN1 to IN4.
    inputs: [f64; 4],
    place: Option<Place>,
}

impl Zooid {
    /// Duty of each motor, -1 to 1: one input of its bridge is high while the other is low.
    pub fn motors(&self) -> [f64; 2] {
        let [a, b, c, d] = self.inputs;
        [b - a, d - c]
    }

    /// Whether the bridges brake: both inputs of both are high.
    pub fn brakes(&self) -> bool {
        self.inputs == [1.0; 4]
    }

    /// The values that the script logged last.
    pub fn last_logged(&self) -> Option<&[String]> {
        self.trace_log.log.last().map(|(_, values)| values.as_slice())
    }

    /// Handles an event.
    fn note(&mut self, event: TimedEvent) {
        match event.event {
            EmulatorEvent::Rtt { bytes } => self.trace_log.read(&bytes),
            _ => {
                match &event.event {
                    EmulatorEvent::Motor { number, duty, .. } => {
                        self.inputs[usize::from(*number) - 1] = *duty;
                    }
                    EmulatorEvent::Reset { cause }
                        if cause == "power_on" || cause == "brown_out" =>
                    {
                        self.trace_log.restart();
                    }
                    _ => {}
                }
                self.events.push(event);
            }
        }
    }
}

/// Zooids that hear each other.
pub struct Table {
    emulator: Emulator,
    zooids: Vec<Zooid>,
    now: Duration,
}

impl Table {
    /// Zooids with this script and these ids, switched on, and in the dark.
    pub fn new(script: &str, ids: &[u16]) -> Self {
        Self::on(Core::Own, script, ids)
    }

    /// The same with this core.
    pub fn on(core: Core, script: &str, ids: &[u16]) -> Self {
        let count = ids.len().to_string();
        let mut arguments = vec!["--robot", "zooids"];
        // Not all of them can play several.
        if ids.len() > 1 {
            arguments.extend(["--count", &count]);
        }
        let mut emulator = Emulator::spawn_with(core.program(), &arguments).expect("it starts");
        emulator.load(&zooids()).expect("it loads");
        let layout = layout();
        let section = script_section(script);
        let id_section = layout.id.expect("it has a place for an id").address;
        for (robot, id) in ids.iter().enumerate() {
            for (address, bytes) in [
                (layout.script.address, section.clone()),
                (id_section, Layout::id_section(*id).to_vec()),
            ] {
                emulator
                    .execute_on(robot, &Command::Write { address, bytes })
                    .expect("it is written");
            }
        }
        let zooid = || Zooid {
            trace_log: TraceLog::of_zooid(),
            events: Vec::new(),
            inputs: [0.0; 4],
            place: None,
        };
        let zooids = ids.iter().map(|_| zooid()).collect();
        Table { emulator, zooids, now: Duration::ZERO }
    }

    /// Since power-on.
    pub fn now(&self) -> Duration {
        self.now
    }

    /// The robots.
    pub fn zooids(&self) -> &[Zooid] {
        &self.zooids
    }

    /// Gives the emulator a command for a robot.
    pub fn execute_on(&mut self, robot: usize, command: &Command) {
        let reply = self.emulator.execute_on(robot, command);
        reply.unwrap_or_else(|error| panic!("{command:?}: {error}"));
    }

    /// Puts a robot somewhere.
    pub fn put(&mut self, robot: usize, place: Place) {
        self.zooids[robot].place = Some(place);
        self.execute_on(robot, &place.command());
    }

    /// Where a robot is.
    pub fn place(&self, robot: usize) -> Option<Place> {
        self.zooids[robot].place
    }

    /// A robot's light is as bad as this.
    pub fn light(&mut self, robot: usize, lose: f64, jitter_us: f64, seed: u64) {
        self.execute_on(robot, &Command::Light { lose, jitter_us, glitches_per_s: 0.0, seed });
    }

    /// The radios of all robots detect power on the channel in this way.
    pub fn power_detector(&mut self, reading: PowerDetector) {
        for robot in 0..self.zooids.len() {
            self.execute_on(robot, &Command::PowerDetector { reading });
        }
    }

    /// Packets are lost with this probability from now on.
    pub fn lose(&mut self, lose: f64, seed: u64) {
        self.execute_on(0, &Command::Air { lose, seed });
    }

    /// Somebody sends a packet at a time.
    pub fn radio(&mut self, at: Duration, payload: &[u8]) {
        self.execute_on(0, &Command::Radio { at, payload: payload.to_vec() });
    }

    /// Runs for so many ms; robots that move go on as they do.
    pub fn run_ms(&mut self, ms: u64) {
        self.run(Duration::from_millis(ms));
    }

    /// Runs for so long; robots that move go on as they do.
    pub fn run(&mut self, span: Duration) {
        self.now += span;
        let zooids = &mut self.zooids;
        let run = self.emulator.run_all(self.now, |event| zooids[event.robot].note(event.timed));
        run.expect("it runs");
        for zooid in zooids {
            zooid.place = zooid.place.map(|place| place.after(span));
        }
    }

    /// Runs for so many ms; robots move as their motors make them.
    pub fn drive_ms(&mut self, ms: u64) {
        let end = self.now + Duration::from_millis(ms);
        while self.now < end {
            self.run(DRIVE_STEP.min(end - self.now));
            for robot in 0..self.zooids.len() {
                let Some(place) = self.zooids[robot].place else { continue };
                let [left, right] = self.zooids[robot].motors().map(wheel_speed);
                let speed = (left + right) / 2.0;
                let turn = ((right - left) / TRACK_MM).to_degrees();
                if (speed, turn) != (place.speed, place.turn) {
                    self.put(robot, Place { speed, turn, ..place });
                }
            }
        }
    }

    /// The counters of a robot.
    pub fn statistics(&mut self, robot: usize) -> RobotStatistics {
        self.emulator.statistics_of(robot).expect("it counts")
    }

    /// What a robot's board counted.
    pub fn board(&mut self, robot: usize) -> ZooidStatistics {
        match self.statistics(robot).board {
            BoardStatistics::Zooid(statistics) => statistics,
            other => panic!("no Zooid: {other:?}"),
        }
    }

    /// What the air did.
    pub fn air(&mut self) -> AirStatistics {
        self.statistics(0).air
    }

    /// Reads a robot's flash or RAM.
    pub fn read(&mut self, robot: usize, address: u32, length: u32) -> Vec<u8> {
        self.emulator.read_of(robot, address, length).expect("it is read")
    }

    /// Writes to a robot's flash or RAM.
    pub fn write(&mut self, robot: usize, address: u32, bytes: &[u8]) {
        self.execute_on(robot, &Command::Write { address, bytes: bytes.to_vec() });
    }
}

/// mm/s of a wheel at a duty, -1 to 1.
fn wheel_speed(duty: f64) -> f64 {
    let effective = (duty.abs().min(FULL_DUTY) - DEAD_DUTY).max(0.0);
    (FULL_MM_S * effective / (FULL_DUTY - DEAD_DUTY)).copysign(duty)
}
