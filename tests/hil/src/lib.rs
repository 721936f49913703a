//! Robots for tests: a firmware image as it is flashed, a script, and an emulator around both.
//!
//! Four ways to look at a robot:
//! * [`trace`] runs `bbz trace`: what a person sees, log lines and faults as text, LEDs and motors on request;
//! * [`Robot`] holds the emulator's own line: frames to and from the radio's processor, dead tasks, damaged flash;
//!   [`standing`] is one that could fly;
//! * [`Swarm`] holds several of them, which hear each other;
//! * [`Table`] holds Zooids under their projector;
//! * [`Kilobots`] holds Kilobots and their overhead controller.
//!
//! [`loader`] is Bitcraze's loader, and [`cfloader`] a ground station that flashes a Crazyflie by radio.
//!
//! [`flash`] cuts the writing of flash short, [`safety`] resets Crazyflies, [`supply`] names moments of a brown-out.
//!
//! Images and emulators must have been built: `cargo xtask test` does that. `BITTYBUZZ_CRAZYFLIE` names another image of
//! the Crazyflie than the one in its folder, `BITTYBUZZ_ZOOIDS` another one of the Zooid, `BITTYBUZZ_KILOBOT` one of the
//! Kilobot.

mod body;
pub mod cfloader;
pub mod flash;
pub mod kilobots;
pub mod loader;
mod processor;
pub mod safety;
pub mod supply;
mod swarm;
pub mod table;
mod trace_log;

pub use body::{captured_body, standing};
pub use kilobots::{Kilobots, ear, kilobot};
pub use swarm::{Member, Pose, Swarm};
pub use table::{Place, Table};
pub use trace_log::TraceLog;

use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use std::time::Duration;

use bittybuzz_compiler::compile::{Compiled, Options, compile};
use bittybuzz_compiler::include::{DiskFiles, IncludeLoader};
pub use bittybuzz_emulation::message::{
    BarometerFault, BoardStatistics, BodySensor, Command, CrazyflieStatistics, Deck,
    DeckMemoryFault, DeviceFault, DistanceFault, EepromFault, EmulatorEvent, FlowFault, ImuFault,
    MeasurementFault, PoseErrors, PowerDetector, Powertrain, RobotEvent, RobotStatistics, Room,
    TimedEvent, ZooidStatistics,
};
use bittybuzz_emulation::{Emulator, FirmwareImage, RunResult};
use bittybuzz_robot_spec::Layout;
use bittybuzz_tests::bbz;

use serde_json::Value;
use tempfile::{Builder, NamedTempFile};

/// A core around which the chip models stand.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Core {
    /// Fast and the same every time.
    Unicorn,
    /// Independent of the other; slow.
    Qemu,
    /// Of the Zooid alone; the fastest.
    Own,
    /// Of the Kilobot.
    Avr,
}

impl Core {
    /// The emulator program, built on the first call. From then on the calling test stays on one processor.
    pub fn program(self) -> &'static Path {
        static PROGRAMS: [OnceLock<PathBuf>; 4] = [const { OnceLock::new() }; 4];
        let (number, package) = match self {
            Core::Unicorn => (0, "bittybuzz-emulate-stm32"),
            Core::Qemu => (1, "bittybuzz-emulate-qemu"),
            Core::Own => (2, "bittybuzz-emulate-m0"),
            Core::Avr => (3, "bittybuzz-emulate-avr"),
        };
        let program =
            PROGRAMS[number].get_or_init(|| build(package, package.replace("bittybuzz", "bbz")));
        processor::stay();
        program
    }
}

/// Builds a program, always optimized: it plays a processor of 168 MHz.
fn build(package: &str, program: String) -> PathBuf {
    let test = std::env::current_exe().expect("the running test has a path");
    // TARGET/PROFILE/deps/TEST
    let target = test.ancestors().nth(3).expect("cargo runs tests from its target folder");
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let status = std::process::Command::new(cargo)
        .args(["build", "--locked", "--quiet", "--release"])
        .args(["--package", package, "--target-dir"])
        .arg(target)
        .current_dir(bbz::root())
        .status()
        .expect("cargo starts");
    assert!(status.success(), "{package} does not build");
    target.join("release").join(program)
}

/// The Crazyflie's image.
pub fn crazyflie() -> PathBuf {
    if let Some(path) = std::env::var_os("BITTYBUZZ_CRAZYFLIE") {
        return PathBuf::from(path);
    }
    let path = bbz::root()
        .join("firmware/crazyflie/target/thumbv7em-none-eabihf/release/bittybuzz-crazyflie");
    assert!(
        path.exists(),
        "no firmware: run `cargo build --locked --release` in firmware/crazyflie first"
    );
    path
}

/// The image of a Crazyflie with the smallest robots' numbers. `BITTYBUZZ_CRAZYFLIE_TINY` names another one than the one in its
/// folder.
pub fn crazyflie_tiny() -> PathBuf {
    if let Some(path) = std::env::var_os("BITTYBUZZ_CRAZYFLIE_TINY") {
        return PathBuf::from(path);
    }
    let path = bbz::root()
        .join("firmware/crazyflie/target/tiny/thumbv7em-none-eabihf/release/bittybuzz-crazyflie");
    assert!(path.exists(), "no firmware: run `cargo xtask build crazyflie --profile tiny` first");
    path
}

/// Where the Crazyflie has its firmware, script and id.
pub fn layout() -> Layout {
    let robot = bittybuzz_robot_files::find("crazyflie").expect("a shipped robot");
    robot.layout.expect("it has a layout")
}

/// How long one run may take before it is killed: far above any test's need, also on a busy machine.
const PATIENCE: Duration = Duration::from_secs(600);

/// A script file for one test; removed with the value.
pub struct ScriptFile(NamedTempFile);

impl ScriptFile {
    /// With this text.
    pub fn new(test: &str, text: &str) -> Self {
        ScriptFile::named(&format!("-{test}.bzz"), text)
    }

    /// A scenario with this text.
    pub fn scenario(test: &str, text: &str) -> Self {
        ScriptFile::named(&format!("-{test}.toml"), text)
    }

    fn named(end: &str, text: &str) -> Self {
        let file = Builder::new().prefix("bittybuzz-hil-").suffix(end).tempfile();
        let mut file = file.expect("the folder for temporary files is writable");
        file.write_all(text.as_bytes()).expect("the file was created for writing");
        ScriptFile(file)
    }

    /// Where it is.
    pub fn path(&self) -> &str {
        self.0.path().to_str().expect("the name consists of text")
    }
}

/// The output of `bbz trace`: an object per line, and its exit status.
pub struct Trace {
    /// The lines.
    pub lines: Vec<Value>,
    /// Exit status.
    pub status: Option<i32>,
}

/// Runs a script on an emulated Crazyflie for so many seconds.
pub fn trace(core: Core, script: &str, seconds: f64) -> Trace {
    let arguments = [
        "trace",
        &crazyflie().display().to_string(),
        "--robot",
        "crazyflie",
        "--script",
        script,
        "--emulate",
        "--emulator",
        &core.program().display().to_string(),
        "--seconds",
        &seconds.to_string(),
        "--outputs",
        "--json",
    ];
    let outcome = bbz::run_patiently(&arguments, &[], PATIENCE);
    let lines = outcome
        .stdout
        .lines()
        .map(|line| serde_json::from_str(line).unwrap_or_else(|error| panic!("{error}: {line}")));
    let lines: Vec<Value> = lines.collect();
    assert!(!lines.is_empty(), "{outcome:?}");
    Trace { lines, status: outcome.status }
}

impl Trace {
    /// The lines of this kind.
    pub fn of<'a>(&'a self, kind: &'a str) -> impl Iterator<Item = &'a Value> {
        self.lines.iter().filter(move |line| line["kind"] == kind)
    }

    /// What an output did: seconds and state.
    pub fn output<'a>(&'a self, name: &'a str) -> Vec<(f64, &'a str)> {
        let lines = self.of("output").filter(|line| line["name"] == name);
        lines.map(|line| (time(line), text(&line["state"]))).collect()
    }

    /// The state of an output at a time: `off` before it did anything.
    pub fn output_at(&self, name: &str, seconds: f64) -> String {
        let before = self.output(name).into_iter().rfind(|(time, _)| *time <= seconds);
        before.map_or("off", |(_, state)| state).to_owned()
    }

    /// What the script logged, step and text.
    pub fn log(&self) -> Vec<(u64, &str)> {
        self.of("log")
            .map(|line| (line["step"].as_u64().unwrap_or(0), text(&line["text"])))
            .collect()
    }
}

/// Seconds since power-on of a line.
pub fn time(line: &Value) -> f64 {
    line["time"].as_f64().unwrap_or_else(|| panic!("no time: {line}"))
}

/// A text in a line.
pub fn text(value: &Value) -> &str {
    value.as_str().unwrap_or_else(|| panic!("no text: {value}"))
}

/// A robot on the emulator's own line.
pub struct Robot {
    emulator: Emulator,
    now: Duration,
    /// Everything that happened so far.
    pub events: Vec<TimedEvent>,
}

impl Robot {
    /// A Crazyflie with this script, switched on.
    pub fn crazyflie(core: Core, script: &str) -> Self {
        let mut emulator = Emulator::spawn(core.program()).expect("it starts");
        emulator.load(&crazyflie()).expect("it loads");
        let section = layout().script_section(&image(script)).expect("a short script");
        emulator.write(layout().script.address, &section).expect("it is written");
        Robot { emulator, now: Duration::ZERO, events: Vec::new() }
    }

    /// Gives it an id, which it takes at its start.
    pub fn assign_id(&mut self, id: u16) {
        let address = layout().id.expect("it has a place for an id").address;
        self.write(address, &Layout::id_section(id));
    }

    /// Runs for so many ms, and returns what happened.
    pub fn run_ms(&mut self, ms: u64) -> Vec<TimedEvent> {
        self.run_us(1000 * ms)
    }

    /// Runs for so many µs, and returns what happened.
    pub fn run_us(&mut self, us: u64) -> Vec<TimedEvent> {
        self.now += Duration::from_micros(us);
        let RunResult { events, at, .. } = self.emulator.run(self.now).expect("it runs");
        self.now = at.max(self.now);
        self.events.extend(events.iter().cloned());
        events
    }

    /// The emulator, which the caller runs until a time.
    pub(crate) fn emulator_until(&mut self, until: Duration) -> &mut Emulator {
        self.now = until;
        &mut self.emulator
    }

    /// Since power-on.
    pub fn now(&self) -> Duration {
        self.now
    }

    /// Gives the emulator a command.
    pub fn execute(&mut self, command: &Command) {
        self.emulator.execute(command).unwrap_or_else(|error| panic!("{command:?}: {error}"));
    }

    /// The radio's processor sends a frame.
    pub fn send(&mut self, kind: u8, payload: &[u8]) {
        self.execute(&Command::Send { kind, payload: payload.to_vec() });
    }

    /// Writes to flash or RAM.
    pub fn write(&mut self, address: u32, bytes: &[u8]) {
        self.emulator.write(address, bytes).expect("it is written");
    }

    /// Reads flash or RAM.
    pub fn read(&mut self, address: u32, length: u32) -> Vec<u8> {
        self.emulator.read(address, length).expect("it is read")
    }

    /// What a Crazyflie's board counted.
    pub fn board(&mut self) -> CrazyflieStatistics {
        match self.statistics().board {
            BoardStatistics::Crazyflie(statistics) => statistics,
            other => panic!("no Crazyflie: {other:?}"),
        }
    }

    /// The emulator's counters.
    pub fn statistics(&mut self) -> RobotStatistics {
        self.emulator.statistics().expect("it counts")
    }

    /// Sends a frame that the firmware echoes, and returns after how long the echo began to arrive.
    pub fn ping(&mut self, number: u8, patience_ms: u64) -> Option<Duration> {
        let packet = [ECHO_HEADER, number, 0x55, 0xaa];
        let sent = self.now;
        self.send(RADIO_RAW, &packet);
        for _ in 0..patience_ms * 10 {
            let events = self.run_us(100);
            let echo = frames(&events, RADIO_RAW).find(|(_, payload)| *payload == packet);
            if let Some((at, _)) = echo {
                return Some(at - sent);
            }
        }
        None
    }
}

/// Syslink: a CRTP packet.
pub const RADIO_RAW: u8 = 0x00;
/// CRTP header of a packet that the robot sends back: port 15, channel 0.
pub const ECHO_HEADER: u8 = 0xf0;

/// The intact frames of a kind that the firmware sent.
pub fn frames(events: &[TimedEvent], wanted: u8) -> impl Iterator<Item = (Duration, &[u8])> {
    events.iter().filter_map(move |event| match &event.event {
        EmulatorEvent::Syslink { kind, payload, intact: true } if *kind == wanted => {
            Some((event.at, payload.as_slice()))
        }
        _ => None,
    })
}

/// Whether each of the four motors turns after these events.
pub fn motors(events: &[TimedEvent]) -> [f64; 4] {
    let mut duties = [0.0; 4];
    for event in events {
        if let EmulatorEvent::Motor { number, duty, .. } = event.event {
            duties[usize::from(number) - 1] = duty;
        }
    }
    duties
}

/// Returns true if the LED of this name is on after these events.
pub fn is_lit(events: &[TimedEvent], led: &str) -> bool {
    let state = |event: &TimedEvent| match &event.event {
        EmulatorEvent::Led { name, on } if name == led => Some(*on),
        _ => None,
    };
    events.iter().rev().find_map(state) == Some(true)
}

/// Times at which the LED of this name went on since a time, and for how long.
pub fn flashes(events: &[TimedEvent], led: &str, since: Duration) -> Vec<(Duration, Duration)> {
    let mut flashes = Vec::new();
    let mut begun = None;
    for event in events.iter().filter(|event| event.at >= since) {
        match &event.event {
            EmulatorEvent::Led { name, on: true } if name == led => begun = Some(event.at),
            EmulatorEvent::Led { name, on: false } if name == led => {
                flashes.extend(begun.take().map(|at| (at, event.at - at)));
            }
            _ => {}
        }
    }
    flashes
}

/// `movw` and `movt` of `value` to this register, 0 to 7 (ARMv7-M A7.7.76, A7.7.79).
pub fn load_register(register: u16, value: u32) -> [u16; 4] {
    let half = |opcode: u16, value: u32| {
        let (imm4, i) = ((value >> 12) as u16, (value >> 11 & 1) as u16);
        let (imm3, imm8) = ((value >> 8 & 7) as u16, (value & 0xff) as u16);
        [opcode | i << 10 | imm4, imm3 << 12 | register << 8 | imm8]
    };
    let ([a, b], [c, d]) = (half(0xf240, value & 0xffff), half(0xf2c0, value >> 16));
    [a, b, c, d]
}

/// The resets among events: time and cause.
pub fn resets(events: &[TimedEvent]) -> Vec<(Duration, &str)> {
    let resets = events.iter().filter_map(|event| match &event.event {
        EmulatorEvent::Reset { cause } => Some((event.at, cause.as_str())),
        _ => None,
    });
    resets.collect()
}

/// The image of a script for the Crazyflie.
pub fn image(script: &str) -> Vec<u8> {
    image_for("crazyflie", script)
}

/// The image of a script for a robot.
pub fn image_for(robot: &str, script: &str) -> Vec<u8> {
    let compiled = compiled_for(robot, script);
    compiled.image.unwrap_or_else(|| panic!("{:?}", compiled.diagnostics))
}

/// The image of a script for a robot, with so many bytes: an `init()` fills it.
pub fn image_of(robot: &str, script: &str, bytes: usize) -> Vec<u8> {
    // The first statement has two bytes, the second three.
    let image = |two: usize, three: usize| {
        let statements = "x = 1\n".repeat(two) + &"x = 100\n".repeat(three);
        image_for(robot, &format!("{script}\nfunction init() {{\n{statements}}}"))
    };
    let more = bytes - image(1, 1).len();
    let filled = image(1 + more / 2 - more % 2, 1 + more % 2);
    assert_eq!(filled.len(), bytes);
    filled
}

/// A script, compiled for a robot.
pub fn compiled_for(robot: &str, script: &str) -> Compiled {
    let robot = bittybuzz_robot_files::find(robot).expect("a shipped robot");
    let options = Options { robots: vec![robot.clone()], robot: Some(robot), ..Options::default() };
    compile(Path::new("test.bzz"), script.to_owned(), &IncludeLoader::new(&DiskFiles), &options)
}

/// Returns the address of a function in the Crazyflie's image; see [`FirmwareImage::function`].
pub fn address_of(function: &str) -> u32 {
    address_in(&crazyflie(), function)
}

/// Returns the address of a function in another image of a Cortex-M.
pub fn address_in(image: &Path, function: &str) -> u32 {
    let image = FirmwareImage::open(image).expect("the image is there");
    image.function(function).unwrap_or_else(|error| panic!("{error}"))
}

/// Returns the path of the function that polls a task of an embassy robot's firmware.
pub fn poll_of(task: &str) -> String {
    format!("__{task}_task_inner_function::{{closure#0}}>>::poll")
}
