//! Tests of the server loop, with a core that only writes to the log.

#![allow(clippy::unwrap_used, reason = "what fails here fails the test")]

mod elf;

use std::net::UdpSocket;
use std::path::{Path, PathBuf};
use std::time::Duration;

use bittybuzz_chips::{Board, ResetCause, Time};
use bittybuzz_crazyflie_board::{CrazyflieBoard, CrazyflieVariation};
use bittybuzz_emulation::message::{
    self, CoreStatistics, EmulatorEvent, OutputLine, Reply, RobotEvent, TimedEvent,
};
use bittybuzz_emulation::{Core, CoreState, FirmwareImage, MachineError, Pause, serve};

use self::elf::{Elf, FUNCTION};

const RAM: u32 = 0x2000_0000;
/// Addresses of the log's control block, and of its ring buffer of 16 bytes.
const CONTROL_BLOCK: u32 = RAM + 0x100;
const RING: u32 = RAM + 0x200;
const RING_SIZE: u32 = 16;

/// A core that logs five bytes in each turn; the server's turns take a millisecond.
struct Logger {
    board: CrazyflieBoard,
    now: Time,
    ram: Vec<u8>,
    logged: u8,
}

impl Logger {
    fn new() -> Self {
        let mut ram = vec![0; 0x1000];
        ram[0x100..0x10a].copy_from_slice(b"SEGGER RTT");
        let board = CrazyflieBoard::new(CrazyflieVariation::default());
        let mut logger = Logger { board, now: Time::ZERO, ram, logged: 0 };
        // The control block has one up channel: name, buffer, size.
        logger.set(CONTROL_BLOCK + 16, 1);
        logger.set(CONTROL_BLOCK + 28, RING);
        logger.set(CONTROL_BLOCK + 32, RING_SIZE);
        logger
    }

    fn word(&self, address: u32) -> u32 {
        let at = (address - RAM) as usize;
        u32::from_le_bytes(self.ram[at..at + 4].try_into().unwrap())
    }

    fn set(&mut self, address: u32, value: u32) {
        let at = (address - RAM) as usize;
        self.ram[at..at + 4].copy_from_slice(&value.to_le_bytes());
    }

    fn slice(&self, address: u32, length: usize) -> Result<std::ops::Range<usize>, MachineError> {
        let start = address.wrapping_sub(RAM) as usize;
        let end = start.saturating_add(length);
        if end <= self.ram.len() {
            Ok(start..end)
        } else {
            Err(MachineError::NoMemory { address, length })
        }
    }
}

impl Core for Logger {
    type Board = CrazyflieBoard;

    fn load(_: usize, _: &FirmwareImage) -> Result<Self, MachineError> {
        Ok(Logger::new())
    }

    fn reset(&mut self, _: Option<ResetCause>, _: u32) -> Result<CoreState, MachineError> {
        Ok(CoreState::Running)
    }

    fn restart(&mut self, _: u32, _: u32) -> Result<(), MachineError> {
        Ok(())
    }

    fn board(&self) -> &CrazyflieBoard {
        &self.board
    }

    fn board_mut(&mut self) -> &mut CrazyflieBoard {
        &mut self.board
    }

    fn now(&self) -> Time {
        self.now
    }

    fn clock_hz(&self) -> u64 {
        self.board.core_clock_hz()
    }

    fn catch_up(&mut self) {
        self.board.advance(self.now);
    }

    fn take_reset_request(&mut self) -> Option<ResetCause> {
        None
    }

    /// Logs five bytes if the turn ends at a full millisecond; otherwise only time passes.
    fn execute(&mut self, until: Time) -> Result<CoreState, MachineError> {
        self.now = until;
        if !until.nanos().is_multiple_of(1_000_000) {
            return Ok(CoreState::Running);
        }
        for _ in 0..5 {
            let (write, read) = (self.word(CONTROL_BLOCK + 36), self.word(CONTROL_BLOCK + 40));
            assert_ne!((write + 1) % RING_SIZE, read, "the log was not read in time");
            self.ram[(RING - RAM + write) as usize] = self.logged;
            self.logged = self.logged.wrapping_add(1);
            self.set(CONTROL_BLOCK + 36, (write + 1) % RING_SIZE);
        }
        Ok(CoreState::Running)
    }

    fn wakes(&mut self, _: CoreState) -> Result<bool, MachineError> {
        Ok(true)
    }

    fn may_wake(&self) -> bool {
        true
    }

    fn sleep(&mut self, until: Time) -> Result<(), MachineError> {
        self.now = until;
        Ok(())
    }

    fn write_memory(&mut self, address: u32, bytes: &[u8]) -> Result<(), MachineError> {
        let range = self.slice(address, bytes.len())?;
        self.ram[range].copy_from_slice(bytes);
        Ok(())
    }

    fn read_memory(&mut self, address: u32, bytes: &mut [u8]) -> Result<(), MachineError> {
        let range = self.slice(address, bytes.len())?;
        bytes.copy_from_slice(&self.ram[range]);
        Ok(())
    }

    fn skip(&mut self, address: u32) -> Result<(), MachineError> {
        assert_eq!(address, FUNCTION);
        Ok(())
    }

    fn statistics(&self) -> CoreStatistics {
        CoreStatistics { instructions: u64::from(self.logged), ..CoreStatistics::default() }
    }
}

/// Returns the server's output for the commands in `lines`.
fn answers(lines: &[&str]) -> Vec<OutputLine> {
    let mut output = Vec::new();
    serve::<Logger>(1, lines.join("\n").as_bytes(), &mut output).unwrap();
    let output = String::from_utf8(output).unwrap();
    output.lines().map(|line| message::parse(line.as_bytes()).unwrap()).collect()
}

/// Writes an ELF file for this test and returns its path.
fn file(name: &str, bytes: &[u8]) -> PathBuf {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    std::fs::write(&path, bytes).unwrap();
    path
}

fn load(path: &Path) -> String {
    serde_json::json!({ "command": "load", "elf": path }).to_string()
}

fn good_image(name: &str) -> String {
    let symbols = [("_SEGGER_RTT", CONTROL_BLOCK, false), ("task_poll", FUNCTION, true)];
    load(&file(name, &Elf { symbols: &symbols, ..Elf::default() }.bytes()))
}

/// Returns the error message in `output`, and panics if it is no error.
fn error(output: &OutputLine) -> &str {
    match output {
        OutputLine::Reply(Reply::Error { message }) => message,
        output => panic!("no error: {output:?}"),
    }
}

#[test]
fn the_log_is_read_around_the_end_of_its_ring() {
    let outputs = answers(&[
        &good_image("log.elf"),
        r#"{"command":"run","until_ns":20000000}"#,
        r#"{"command":"statistics"}"#,
    ]);
    let mut log: Vec<u8> = Vec::new();
    for output in &outputs {
        if let OutputLine::Event(RobotEvent {
            timed: TimedEvent { event: EmulatorEvent::Rtt { bytes }, at },
            ..
        }) = output
        {
            log.extend(bytes);
            assert_eq!(at.as_nanos() % 1_000_000, 0);
        }
    }
    assert_eq!(log, (0..100).collect::<Vec<u8>>());
    let [.., OutputLine::Reply(paused), OutputLine::Reply(Reply::Statistics(statistics))] =
        &outputs[..]
    else {
        panic!("{outputs:?}");
    };
    assert!(
        matches!(paused, Reply::Paused { at, reason: Pause::Time, .. } if *at == Duration::from_millis(20))
    );
    assert_eq!(statistics.core.instructions, 100);
}

#[test]
fn every_command_is_answered_once() {
    let outputs = answers(&[
        &good_image("commands.elf"),
        r#"{"command":"write","address":536870912,"bytes":"00ffA5"}"#,
        r#"{"command":"read","address":536870912,"length":3}"#,
        r#"{"command":"read","address":536836642,"length":2}"#,
        r#"{"command":"send","type":10,"payload":"00"}"#,
        r#"{"command":"p2p","at_ns":5000,"port":3,"rssi":60,"payload":"0102"}"#,
        r#"{"command":"pose","x_mm":1500,"y_mm":-20.5,"z_mm":0,"yaw_degrees":90}"#,
        r#"{"command":"link","lose":0.5,"corrupt":0,"seed":1}"#,
        r#"{"command":"flow_control","full":true}"#,
        r#"{"command":"battery","volts":3.7,"charging":false,"usb_powered":false}"#,
        r#"{"command":"skip","symbol":"task_poll"}"#,
        "",
        r#"{"command":"shutdown"}"#,
        r#"{"command":"quit"}"#,
        r#"{"command":"statistics"}"#,
    ]);
    let ok = OutputLine::Reply(Reply::Ok);
    let mut expected = vec![ok.clone(); 13];
    expected[2] = OutputLine::Reply(Reply::Bytes { bytes: vec![0x00, 0xff, 0xa5] });
    // 0x1fff7a22 holds the size of the flash: 1024 KiB.
    expected[3] = OutputLine::Reply(Reply::Bytes { bytes: vec![0x00, 0x04] });
    assert_eq!(outputs, expected, "and nothing after quit");
}

#[test]
fn errors_of_bad_input_state_the_remedy() {
    let long = format!(r#"{{"command":"send","type":1,"payload":"{}"}}"#, "00".repeat(65));
    let p2p = format!(
        r#"{{"command":"p2p","at_ns":0,"port":1,"rssi":1,"payload":"{}"}}"#,
        "00".repeat(61)
    );
    let good = good_image("bad_input.elf");
    for (line, part) in [
        ("garbage", "docs/emulation.md"),
        ("\u{0}\u{1}", "docs/emulation.md"),
        (r#"{"command":"fly"}"#, "unknown variant `fly`"),
        (r#"{"command":"run"}"#, "missing field `until_ns`"),
        (r#"{"command":"run","until_ns":-1}"#, "invalid value"),
        (r#"{"command":"bytes","bytes":"0g"}"#, "hexadecimal"),
        (r#"{"command":"bytes","bytes":"012"}"#, "hexadecimal"),
        (r#"{"command":"read","address":0,"length":4}"#, "are not all in memory"),
        (r#"{"command":"read","address":536870912,"length":4294967295}"#, "at most 1048576 bytes"),
        (r#"{"command":"write","address":536875007,"bytes":"0000"}"#, "are not all in memory"),
        (r#"{"command":"link","lose":1.5,"corrupt":0,"seed":0}"#, "between 0 and 1"),
        (r#"{"command":"skip","symbol":"nobody"}"#, "no function is called \"nobody\""),
        (&long, "at most 64 bytes, this one has 65"),
        (&p2p, "at most 60 bytes, this one has 61"),
        (r#"{"command":"touch","keys":1}"#, "a Crazyflie does not handle this command"),
        (
            r#"{"command":"radio","at_ns":0,"payload":"00"}"#,
            "a Crazyflie does not handle this command",
        ),
        (r#"{"robot":1,"command":"statistics"}"#, "there is no robot 1"),
        (r#"{"robot":-1,"command":"statistics"}"#, "not a command: invalid"),
        (r#"{"command":"p2p","at_ns":0,"port":300,"rssi":1,"payload":""}"#, "invalid value"),
    ] {
        let outputs = answers(&[&good, line, r#"{"command":"statistics"}"#]);
        assert_eq!(outputs.len(), 3, "{line}: {outputs:?}");
        let message = error(&outputs[1]);
        assert!(message.contains(part), "{line}: {message}");
        assert!(matches!(outputs[2], OutputLine::Reply(Reply::Statistics(_))), "{line}");
    }
}

#[test]
fn a_robot_has_one_door() {
    // The system gives a port that nobody uses.
    let free = UdpSocket::bind("127.0.0.1:0").unwrap();
    let port = free.local_addr().unwrap().port();
    let (good, door) =
        (good_image("door.elf"), |port: u32| format!(r#"{{"command":"door","port":{port}}}"#));
    let outputs = answers(&[&good, &door(port.into()), &door(0), &door(65536)]);
    let taken = error(&outputs[1]);
    assert!(taken.starts_with(&format!("no door can be opened at port {port}: ")), "{taken}");
    assert!(error(&outputs[2]).contains("1 to 65535"), "{outputs:?}");
    assert!(error(&outputs[3]).contains("not a command"), "{outputs:?}");
    drop(free);
    let own = door(port.into());
    let outputs = answers(&[&good, &own, &own, &door(1), &good, &own]);
    assert_eq!(outputs[1], OutputLine::Reply(Reply::Ok));
    for second in &outputs[2..4] {
        let message = format!("robot 0 has a door at port {port} already");
        assert!(error(second).starts_with(&message), "{outputs:?}");
    }
    assert_eq!(outputs[5], OutputLine::Reply(Reply::Ok), "a new image closes doors");
}

#[test]
fn nothing_runs_before_an_image_is_loaded() {
    for line in [r#"{"command":"run","until_ns":1}"#, r#"{"command":"statistics"}"#] {
        assert!(error(&answers(&[line])[0]).contains("nothing is loaded"));
    }
}

#[test]
fn files_that_are_no_image() {
    let elsewhere = Elf { address: 0x0800_8000, ..Elf::default() }.bytes();
    let in_ram = Elf { address: 0x2000_0000, ..Elf::default() }.bytes();
    let foreign = Elf { machine: 62, ..Elf::default() }.bytes();
    let truncated = &Elf::default().bytes()[..90];
    for (name, bytes, part) in [
        ("text.elf", &b"hello"[..], "not a 32-bit ELF file"),
        ("truncated.elf", truncated, "not a 32-bit ELF file"),
        ("foreign.elf", &foreign, "not for a little-endian ARM"),
        ("elsewhere.elf", &elsewhere, "starts at 0x08008000"),
        ("in_ram.elf", &in_ram, "nothing for the flash"),
    ] {
        let outputs = answers(&[&load(&file(name, bytes))]);
        let message = error(&outputs[0]);
        assert!(message.contains(part), "{name}: {message}");
    }
    let outputs = answers(&[&load(Path::new("nowhere.elf"))]);
    assert!(error(&outputs[0]).starts_with("cannot read nowhere.elf"));
}

#[test]
fn a_function_is_found_by_a_unique_part_of_its_path() {
    let symbols = [
        ("_ZN5robot4link4poll17h0123456789abcdefE", 0x0800_0101, true),
        ("_ZN5robot6script4poll17h0123456789abcdefE", 0x0800_0201, true),
        ("_ZN5robot6script4DATA17h0123456789abcdefE", 0x2000_0000, false),
    ];
    let image = FirmwareImage::parse(&Elf { symbols: &symbols, ..Elf::default() }.bytes()).unwrap();
    assert_eq!(image.function("robot::link::poll").unwrap(), 0x0800_0100);
    assert_eq!(image.function("script").unwrap(), 0x0800_0200);
    let many = image.function("poll").unwrap_err().to_string();
    assert!(many.contains("robot::link::poll, robot::script::poll"), "{many}");
    assert!(image.function("DATA").is_err(), "not a function");
}
