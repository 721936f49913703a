//! Kilobots in one emulator program, which see each other's light, and the overhead controller above them.

use std::path::{Path, PathBuf};
use std::time::Duration;

use bittybuzz_emulation::Emulator;
use bittybuzz_tests::bbz;
use tempfile::TempDir;

use crate::{Command, Core, EmulatorEvent, TimedEvent};

/// Types of the controller's messages (kilolib, `message.h`).
pub mod kind {
    pub const BOOT: u8 = 0x80;
    pub const RESET: u8 = 0x83;
    pub const SLEEP: u8 = 0x84;
    pub const WAKEUP: u8 = 0x85;
    pub const CHARGE: u8 = 0x86;
    pub const VOLTAGE: u8 = 0x87;
    pub const RUN: u8 = 0x88;
    pub const READUID: u8 = 0x89;
    pub const CALIB: u8 = 0x8a;
}

/// The Kilobot's image. `BITTYBUZZ_KILOBOT` names another one than the one in its folder.
pub fn kilobot() -> PathBuf {
    if let Some(path) = std::env::var_os("BITTYBUZZ_KILOBOT") {
        return PathBuf::from(path);
    }
    let path =
        bbz::root().join("firmware/kilobot-avr/target/avr-none/release/bittybuzz-kilobot-avr.elf");
    assert!(path.exists(), "no firmware: run `cargo xtask build kilobot` first");
    path
}

/// The image of a Kilobot that listens, built beside the other one. `BITTYBUZZ_EAR` names another one.
pub fn ear() -> PathBuf {
    std::env::var_os("BITTYBUZZ_EAR")
        .map_or_else(|| kilobot().with_file_name("bittybuzz-kilobot-ear.elf"), PathBuf::from)
}

/// The image of a behavior of `examples/kilobot`, or of a script in `tests/hil/scripts`. `BITTYBUZZ_BEHAVIORS` names another folder
/// than the one where `cargo xtask build behaviors` puts them.
pub fn behavior(name: &str) -> PathBuf {
    let folder = match std::env::var_os("BITTYBUZZ_BEHAVIORS") {
        Some(folder) => PathBuf::from(folder),
        None => bbz::root().join("firmware/kilobot-avr/target/behaviors"),
    };
    let path = folder.join(name).with_extension("elf");
    assert!(path.exists(), "no {}: run `cargo xtask build behaviors` first", path.display());
    path
}

/// Files of a script and its firmware, deleted in the end.
struct Files(TempDir);

impl Files {
    /// Puts the script into an image as people do.
    fn build(script: &str, image: &Path) -> Self {
        let files = Files(tempfile::tempdir().expect("the folder for temporary files is writable"));
        let path = files.0.path().join("script.bzz");
        std::fs::write(&path, script).expect("a file");
        let [path, image] = [&path, image].map(|path| path.display().to_string());
        let build = ["build", &path, "--robot", "kilobot", "--firmware", &image];
        let built = bbz::run(&build, &[]);
        assert_eq!(built.status, Some(0), "{}", built.stderr);
        files
    }
}

/// Kilobots.
pub struct Kilobots {
    emulator: Emulator,
    /// What happened on each.
    pub events: Vec<Vec<TimedEvent>>,
    now: Duration,
    /// The program was loaded from them, if it was built here.
    files: Option<Files>,
}

impl Kilobots {
    /// So many with this script, switched on. Their ids are their numbers.
    pub fn new(script: &str, count: usize) -> Self {
        Self::in_image(script, &kilobot(), count)
    }

    /// So many with this script in that image, switched on.
    pub fn in_image(script: &str, image: &Path, count: usize) -> Self {
        let files = Files::build(script, image);
        let mut robots = Kilobots::with_program(&files.0.path().join("script.hex"), count);
        robots.files = Some(files);
        robots
    }

    /// So many with this program, switched on.
    pub fn with_program(program: &Path, count: usize) -> Self {
        Self::on_chip("atmega328p", program, count)
    }

    /// So many with this program, switched on, with another chip of the emulator's.
    pub fn on_chip(chip: &str, program: &Path, count: usize) -> Self {
        let arguments = ["--count", &count.to_string(), "--threads", "1", "--chip", chip];
        let mut emulator =
            Emulator::spawn_with(Core::Avr.program(), &arguments).expect("it starts");
        emulator.load(program).expect("it loads");
        Kilobots { emulator, events: vec![Vec::new(); count], now: Duration::ZERO, files: None }
    }

    /// Since power-on.
    pub fn now(&self) -> Duration {
        self.now
    }

    /// The script's symbols.
    pub fn symbols(&self) -> String {
        let files = self.files.as_ref().expect("it has a script");
        std::fs::read_to_string(files.0.path().join("script.sym")).expect("it was built")
    }

    /// Gives the emulator a command for a robot.
    pub fn execute_on(&mut self, robot: usize, command: &Command) {
        let reply = self.emulator.execute_on(robot, command);
        reply.unwrap_or_else(|error| panic!("{command:?}: {error}"));
    }

    /// The controller says something to all of them, and is done in 10 ms.
    pub fn command(&mut self, kind: u8, data: [u8; 9]) {
        let payload = [&data[..], &[kind]].concat();
        self.execute_on(0, &Command::Radio { at: self.now, payload });
        self.run_ms(10);
    }

    /// The controller starts the scripts, at the time that is returned.
    pub fn start(&mut self) -> Duration {
        self.run_ms(100);
        let at = self.now;
        self.command(kind::RUN, [0; 9]);
        at
    }

    /// Runs for so many ms.
    pub fn run_ms(&mut self, ms: u64) {
        self.run_for(Duration::from_millis(ms));
    }

    /// Runs for so long.
    pub fn run_for(&mut self, time: Duration) {
        self.now += time;
        let events = &mut self.events;
        let run = self.emulator.run_all(self.now, |event| events[event.robot].push(event.timed));
        run.expect("it runs");
    }

    /// Bytes of a robot's memory: flash at 0, RAM at 0x800100, EEPROM at 0x810000.
    pub fn memory(&mut self, robot: usize, address: u32, length: u32) -> Vec<u8> {
        self.emulator.read_of(robot, address, length).expect("it is there")
    }

    /// The longest time that an interrupt had to wait on a robot.
    pub fn longest_wait(&mut self, robot: usize) -> Duration {
        self.emulator.statistics_of(robot).expect("it counts").core.longest_masked
    }

    /// Cycles of the longest turn of a robot's loop since the last call.
    pub fn longest_turn(&mut self, robot: usize) -> u64 {
        self.emulator.statistics_of(robot).expect("it counts").core.longest_turn
    }

    /// The colors that a robot has shown since a time, each with its time.
    pub fn colors(&self, robot: usize, since: Duration) -> Vec<(Duration, [u8; 3])> {
        let later = self.events[robot].iter().filter(|event| event.at >= since);
        later
            .filter_map(|event| match event.event {
                EmulatorEvent::Color { red, green, blue } => Some((event.at, [red, green, blue])),
                _ => None,
            })
            .collect()
    }

    /// The color that a robot shows now.
    pub fn color(&self, robot: usize) -> [u8; 3] {
        self.colors(robot, Duration::ZERO).last().map_or([0; 3], |(_, color)| *color)
    }

    /// Duties of a robot's left and right motor now, 0 to 255.
    pub fn motors(&self, robot: usize) -> [u8; 2] {
        let mut duties = [0; 2];
        for event in &self.events[robot] {
            if let EmulatorEvent::Motor { number, duty, .. } = event.event {
                duties[usize::from(number) - 1] = (duty * 255.0).round() as u8;
            }
        }
        duties
    }

    /// The messages that a robot has sent, each with the time of its end.
    pub fn sent(&self, robot: usize) -> Vec<(Duration, [u8; 12])> {
        let events = self.events[robot].iter();
        events
            .filter_map(|event| match &event.event {
                EmulatorEvent::Infrared { payload, .. } => {
                    Some((event.at, payload.as_slice().try_into().expect("12 bytes")))
                }
                _ => None,
            })
            .collect()
    }
}
