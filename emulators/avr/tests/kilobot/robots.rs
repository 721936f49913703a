//! Programs for an ATmega328P, assembled by avr-gcc, in emulated Kilobots.

use std::path::{Path, PathBuf};
use std::process::Command as Process;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

use bittybuzz_emulation::message::{
    BoardStatistics, Command, EmulatorEvent, KilobotStatistics, RobotEvent,
};
use bittybuzz_emulation::{ClientError, Emulator};

pub const RAM: u32 = 0x80_0000;
pub const EEPROM: u32 = 0x81_0000;

/// Assembles `programs/NAME.S` and returns the path of the program. Each call writes a file of its
/// own, because tests run at the same time.
pub fn assemble(program: &str, settings: &[&str]) -> PathBuf {
    static CALLS: AtomicUsize = AtomicUsize::new(0);
    let call = CALLS.fetch_add(1, Ordering::Relaxed);
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("tests/programs/{program}.S"));
    let elf = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("{program}-{call}.elf"));
    let output = Process::new("avr-gcc")
        .args(["-mmcu=atmega328p", "-nostdlib", "-Wl,--section-start=.boot=0x7000"])
        .args(settings)
        .arg("-o")
        .args([&elf, &source])
        .output()
        .expect("avr-gcc runs: `cargo xtask setup`");
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{}: {said}", source.display());
    elf
}

/// Emulated robots, and their events.
pub struct Robots {
    pub emulator: Emulator,
    pub events: Vec<RobotEvent>,
    now: Duration,
}

impl Robots {
    /// Creates `count` robots with a program loaded.
    pub fn new(count: usize, image: &Path) -> Self {
        Self::on_threads(count, image, 2)
    }

    pub fn on_threads(count: usize, image: &Path, threads: usize) -> Self {
        let (count, threads) = (count.to_string(), threads.to_string());
        let program = Path::new(env!("CARGO_BIN_EXE_bbz-emulate-avr"));
        let arguments = ["--count", &count, "--threads", &threads];
        let mut emulator = Emulator::spawn_with(program, &arguments).expect("it starts");
        emulator.load(image).expect("the image is loaded");
        Robots { emulator, events: Vec::new(), now: Duration::ZERO }
    }

    pub fn execute(&mut self, robot: usize, command: &Command) {
        self.emulator.execute_on(robot, command).expect("it obeys");
    }

    pub fn place(&mut self, robot: usize, x_mm: f64) {
        self.execute(robot, &place(x_mm));
    }

    /// Runs for some further microseconds.
    pub fn run(&mut self, micros: u64) {
        self.now += Duration::from_micros(micros);
        let events = &mut self.events;
        self.emulator.run_all(self.now, |event| events.push(event)).expect("it runs");
    }

    pub fn bytes(&mut self, robot: usize, address: u32, length: u32) -> Vec<u8> {
        self.emulator.read_of(robot, address, length).expect("there is memory")
    }

    pub fn byte(&mut self, robot: usize, address: u32) -> u8 {
        self.bytes(robot, address, 1)[0]
    }

    /// Reads little-endian words.
    pub fn words(&mut self, robot: usize, address: u32, count: u32) -> Vec<u16> {
        let bytes = self.bytes(robot, address, 2 * count);
        bytes.chunks_exact(2).map(|word| u16::from_le_bytes([word[0], word[1]])).collect()
    }

    pub fn word(&mut self, robot: usize, address: u32) -> u16 {
        self.words(robot, address, 1)[0]
    }

    pub fn set_id(&mut self, robot: usize, id: u8) {
        self.execute(robot, &Command::Write { address: EEPROM + 0xb0, bytes: vec![id] });
    }

    pub fn counted(&mut self, robot: usize) -> KilobotStatistics {
        match self.emulator.statistics_of(robot).expect("it counts").board {
            BoardStatistics::Kilobot(counted) => counted,
            other => panic!("not a Kilobot's: {other:?}"),
        }
    }

    /// Returns the events of the first robot, in order.
    pub fn seen(&self) -> Vec<&EmulatorEvent> {
        self.events.iter().filter(|e| e.robot == 0).map(|e| &e.timed.event).collect()
    }

    /// Returns the hardware errors of the first robot.
    pub fn errors(&self) -> Vec<&str> {
        let errors = self.seen().into_iter().filter_map(|event| match event {
            EmulatorEvent::HardwareError { text } => Some(text.as_str()),
            _ => None,
        });
        errors.collect()
    }

    /// Returns the reason why the emulator refuses a command.
    pub fn refusal(&mut self, command: &Command) -> String {
        match self.emulator.execute(command) {
            Err(ClientError::Refused(why)) => why,
            other => panic!("not refused: {other:?}"),
        }
    }
}

pub fn place(x_mm: f64) -> Command {
    Command::Place {
        x_mm,
        y_mm: 0.0,
        heading_degrees: 0.0,
        vx_mm_s: 0.0,
        vy_mm_s: 0.0,
        turn_degrees_s: 0.0,
    }
}
