//! A Crazyflie that is flashed by radio: the raw binary of `cargo xtask build crazyflie --bin`, sent with cfloader's packets to a
//! model of Bitcraze's loader. Then the flash is exactly the file, and the robot runs it. Not tried on hardware.

use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::process::Command as Program;
use std::thread;
use std::time::Duration;

use bittybuzz_builds::raw_binary::Individual;
use bittybuzz_builds::{raw_binary, release_zip};
use bittybuzz_chips::Random;
use bittybuzz_emulation::message::ResetCause;
use bittybuzz_hil::cfloader::{Cfloader, FlashedRobot, Radio, RadioFlashError};
use bittybuzz_hil::loader::{FLASH_BYTES, FlashOperation, PAGE, PROGRAM_PAGE, StartedProgram};
use bittybuzz_hil::safety::{is_in_loader, reset};
use bittybuzz_hil::{Core, Robot, TraceLog, crazyflie, image, is_lit, layout, motors};
use bittybuzz_tests::bbz;

const START: usize = PROGRAM_PAGE * PAGE;
const ID: u16 = 0x3258;

/// The script of the new file, and that of an older one.
const NEW: &str = "function step() { set_motor(0, 60) }";
const OLD: &str = "function step() { set_motor(0, 20) }";

/// Returns the raw binary of the firmware with this script, as `cargo xtask build crazyflie --bin` makes it with the script.
fn file(script: &str) -> Vec<u8> {
    let elf = std::fs::read(crazyflie()).unwrap();
    let layout = layout();
    let mut file =
        raw_binary::content(&elf, &layout, &Individual { id: Some(ID), settings: None }).unwrap();
    let section = layout.script_section(&image(script)).unwrap();
    for address in layout.script_addresses() {
        let start = (address - raw_binary::PROGRAM) as usize;
        file[start..start + section.len()].copy_from_slice(&section);
    }
    file
}

/// Returns the content of a flash with random bytes in place of the bootloader, and after it this file and random bytes.
fn flash_with(file: &[u8]) -> Vec<u8> {
    let mut random = Random::new(7);
    let mut flash: Vec<u8> = (0..FLASH_BYTES).map(|_| random.bits() as u8).collect();
    flash[START..START + file.len()].copy_from_slice(file);
    flash
}

/// Flashes a robot that runs its firmware or is in its loader, and restarts it in its firmware.
fn flash(robot: &mut FlashedRobot, radio: &mut Radio, file: &[u8]) -> Result<(), RadioFlashError> {
    let mut station = Cfloader { robot, radio, recorded: None };
    station.enter_loader()?;
    station.flash(file)?;
    station.leave_loader()
}

fn assert_flashed(robot: &FlashedRobot, file: &[u8], what: &str) {
    assert!(robot.loader.flash()[START..][..file.len()] == *file, "{what}: not the file");
    assert!(robot.loader.flash()[..START] == flash_with(&[])[..START], "{what}: loader changed");
    assert_eq!(robot.started, StartedProgram::Firmware, "{what}");
}

/// Switches on an emulated Crazyflie with the flash of a robot.
fn emulated(robot: &FlashedRobot) -> Robot {
    let mut emulated = Robot::crazyflie(Core::Unicorn, "function step() { }");
    emulated.write(raw_binary::PROGRAM, &robot.loader.flash()[START..]);
    let mut at = reset(&mut emulated, ResetCause::PowerOn);
    // The radio's processor keeps its line busy in some of the moments of a reset.
    while is_in_loader(&emulated, at) {
        at = reset(&mut emulated, ResetCause::PowerOn);
    }
    emulated
}

#[test]
fn a_flashed_file_is_the_flash_and_runs() {
    let file = file(NEW);
    let mut robot = FlashedRobot::new(flash_with(&self::file(OLD)));
    flash(&mut robot, &mut Radio::new(0.0, 0), &file).unwrap();
    assert_flashed(&robot, &file, "no loss");
    let mut emulated = emulated(&robot);
    emulated.run_ms(500);
    let duty = motors(&emulated.events)[0];
    assert!((duty - 60.0 / 256.0).abs() < 0.01, "{duty}");
    let messages = TraceLog::of_events(&emulated.events).firmware;
    assert!(messages.iter().any(|message| message == &format!("robot id {ID}")), "{messages:?}");
    let vectors = emulated.read(raw_binary::PROGRAM, 8);
    assert_eq!(vectors, file[..8]);
}

/// The radio sends lost packets again, so some arrive twice, and replies get lost.
#[test]
fn lost_and_doubled_packets_change_nothing() {
    let (old, new) = (flash_with(&file(OLD)), file(NEW));
    for (seed, loss) in [0.05, 0.1, 0.2].into_iter().enumerate() {
        let mut robot = FlashedRobot::new(old.clone());
        flash(&mut robot, &mut Radio::new(loss, seed as u64), &new).unwrap();
        assert_flashed(&robot, &new, &format!("loss {loss}"));
        let programmed = |op: &&FlashOperation| matches!(op, FlashOperation::Program(_));
        let words = robot.loader.operations.iter().filter(programmed).count();
        assert!(words > new.len().div_ceil(PAGE) * PAGE / 4, "no page was written twice");
    }
}

/// The loader starts a part of a file as it starts a whole one, and the robot can be flashed again in each state.
#[test]
fn after_a_power_cut_the_robot_can_be_flashed_again() {
    let (old, new) = (flash_with(&file(OLD)), file(NEW));
    let operations = {
        let mut robot = FlashedRobot::new(old.clone());
        flash(&mut robot, &mut Radio::new(0.0, 0), &new).unwrap();
        robot.loader.operations.len()
    };
    let mut random = Random::new(47);
    // The erasing of the first sector, its first two words, and moments anywhere.
    let moments = (0..5).map(|_| 1 + random.bits() as usize % operations);
    let moments: Vec<usize> = [1, 2, 3].into_iter().chain(moments).chain([operations]).collect();
    for (number, operation) in moments.into_iter().enumerate() {
        let what = format!("cut at operation {operation} of {operations}");
        let mut radio = Radio::new(0.1, number as u64);
        let mut robot = FlashedRobot::new(old.clone());
        let mut station = Cfloader { robot: &mut robot, radio: &mut radio, recorded: None };
        station.enter_loader().unwrap();
        station.robot.loader.cut_power_at(operation);
        assert_eq!(station.flash(&new), Err(RadioFlashError::NoRobot), "{what}");
        let is_erased = operation == 2;
        robot.switch_on(false);
        let started = if is_erased { StartedProgram::Loader } else { StartedProgram::Firmware };
        assert_eq!(robot.started, started, "{what}");
        // A warm boot by the radio's processor, or a press of three seconds: cfloader enters the loader in both ways.
        if number % 2 == 0 {
            robot.switch_on(true);
        }
        flash(&mut robot, &mut radio, &new).unwrap_or_else(|error| panic!("{what}: {error}"));
        assert_flashed(&robot, &new, &what);
    }
}

/// Switches on an emulated robot whose firmware is not complete: no motor turns, and the right red LED lights if the check of the
/// firmware is itself in flash.
fn assert_stopped(robot: &FlashedRobot, has_check: bool, what: &str) {
    let mut emulated = emulated(robot);
    let events = emulated.run_ms(300);
    assert_eq!(motors(&events), [0.0; 4], "{what}");
    assert_eq!(is_lit(&emulated.events, "red_right"), has_check, "{what}");
    assert!(TraceLog::of_events(&events).firmware.is_empty(), "{what}");
}

/// The loader starts a part of the file, but the firmware in it checks itself before it does anything.
#[test]
fn a_part_of_the_firmware_does_not_run() {
    let (old, new) = (flash_with(&[]), file(NEW));
    let words = |bytes: usize| bytes / 4;
    // The table of vectors has the number of words that the check reads, and they begin after the check's own.
    let firmware = 40 + 4 * u32::from_le_bytes(new[28..32].try_into().unwrap()) as usize;
    let mut random = Random::new(31);
    let somewhere = (0..4).map(|_| 0x400 + 4 * (random.bits() as usize % words(firmware - 0x400)));
    let lengths = [4, 8, 0x188, 0x400, firmware - 4].into_iter().chain(somewhere);
    for length in lengths {
        let what = format!("{length} of {firmware} bytes");
        let mut robot = FlashedRobot::new(old.clone());
        robot.switch_on(true);
        // The erasing of sectors counts, too: three of 16 KiB, one of 64 KiB, and then such of 128 KiB.
        let sectors = [0, 0x4000, 0x8000, 0xc000, 0x1_c000, 0x3_c000];
        let erased = sectors.into_iter().filter(|start| *start < length.next_multiple_of(10_240));
        robot.loader.cut_power_at(words(length) + erased.count() + 1);
        let mut station =
            Cfloader { robot: &mut robot, radio: &mut Radio::new(0.0, 0), recorded: None };
        assert_eq!(station.flash(&new), Err(RadioFlashError::NoRobot), "{what}");
        let flash = &robot.loader.flash()[START..];
        assert!(flash[..length] == new[..length] && flash[length..] != new[length..], "{what}");
        robot.switch_on(false);
        assert_eq!(robot.started, StartedProgram::Firmware, "{what}");
        assert_stopped(&robot, length >= 0x400, &what);
    }
}

/// Between the robot's two processors nothing is sent again, and the loader has no checksum. Only reading the flash shows it.
#[test]
fn a_packet_lost_in_the_robot_is_found_by_reading() {
    let (old, new) = (flash_with(&file(OLD)), file(NEW));
    let mut robot = FlashedRobot::new(old);
    let mut radio = Radio::new(0.1, 3);
    let mut station = Cfloader { robot: &mut robot, radio: &mut radio, recorded: None };
    station.enter_loader().unwrap();
    station.radio.line_loss = 0.001;
    assert_eq!(station.flash(&new), Ok(()));
    station.radio.line_loss = 0.0;
    assert!(station.read_back(new.len()).unwrap() != new);
    robot.switch_on(false);
    assert_stopped(&robot, true, "a page misses packets");
    let mut station = Cfloader { robot: &mut robot, radio: &mut radio, recorded: None };
    station.enter_loader().unwrap();
    assert_eq!(station.flash(&new), Ok(()));
    assert!(station.read_back(new.len()).unwrap() == new);
}

/// A file that ends in the middle of a page: the rest of that page has what was in the buffer before.
#[test]
fn a_file_needs_no_whole_pages() {
    let file: Vec<u8> = (0..11 * PAGE + 100).map(|number| number as u8).collect();
    let mut robot = FlashedRobot::new(flash_with(&[]));
    flash(&mut robot, &mut Radio::new(0.0, 0), &file).unwrap();
    assert_flashed(&robot, &file, "odd file");
    assert_eq!(robot.loader.flash()[START + 11 * PAGE..][..PAGE][100..], file[PAGE..][100..PAGE]);
}

#[test]
fn a_file_that_does_not_fit_is_refused() {
    let file = vec![0; FLASH_BYTES - START + 1];
    let mut robot = FlashedRobot::new(flash_with(&[]));
    let refused = flash(&mut robot, &mut Radio::new(0.0, 0), &file);
    assert_eq!(refused, Err(RadioFlashError::Refused(1)));
}

/// cflib 0.1.34 flashes a file of 1,030 bytes, in which each byte is its own number, with 50 packets: the first and the last, and
/// those at the ends of pages.
#[test]
fn the_packets_are_those_of_cflib() {
    let file: Vec<u8> = (0..1030).map(|number| number as u8).collect();
    let mut robot = FlashedRobot::new(flash_with(&[]));
    let mut radio = Radio::new(0.0, 0);
    let mut station = Cfloader { robot: &mut robot, radio: &mut radio, recorded: Some(Vec::new()) };
    station.enter_loader().unwrap();
    station.flash(&file).unwrap();
    station.leave_loader().unwrap();
    let packets = station.recorded.unwrap();
    let hex =
        |packet: &Vec<u8>| packet.iter().map(|byte| format!("{byte:02x}")).collect::<String>();
    let packets: Vec<String> = packets.iter().map(hex).collect();
    for (number, packet) in CFLIB {
        assert_eq!(packets[number], packet, "packet {number}");
    }
    assert_eq!(packets.len(), 50);
}

const CFLIB: [(usize, &str); 13] = [
    (0, "fffeff"),
    (1, "fffef000"),
    (2, "ffff10"),
    (3, "ffff12"),
    (4, "fffe10"),
    (5, "ffff1400000000000102030405060708090a0b0c0d0e0f101112131415161718"),
    (6, "ffff1400001900191a1b1c1d1e1f202122232425262728292a2b2c2d2e2f3031"),
    (44, "ffff140000cf03cfd0d1d2d3d4d5d6d7d8d9dadbdcdddedfe0e1e2e3e4e5e6e7"),
    (45, "ffff140000e803e8e9eaebecedeeeff0f1f2f3f4f5f6f7f8f9fafbfcfdfeff"),
    (46, "ffff1401000000000102030405"),
    (47, "ffff18000010000200"),
    (48, "fffeff"),
    (49, "fffef001"),
];

/// Runs cflib's own bootloader classes against the model: a raw binary, stopped on the way, then a release. `cargo xtask ci` installs them; without them the test is skipped.
#[test]
fn cflib_flashes_the_robot() {
    let Some(python) = std::env::var_os("BITTYBUZZ_CFLIB") else {
        eprintln!("skipped: BITTYBUZZ_CFLIB names no Python with tests/hil/cflib/requirements.txt");
        return;
    };
    let file = file(NEW);
    let folder = tempfile::tempdir().unwrap();
    let [binary, release] = ["crazyflie.bin", "crazyflie.zip"].map(|name| folder.path().join(name));
    std::fs::write(&binary, &file).unwrap();
    std::fs::write(&release, release_zip::release(&file)).unwrap();
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = listener.local_addr().unwrap().port().to_string();
    let script: PathBuf = bbz::root().join("tests/hil/cflib/flash.py");
    let cflib = |path: &Path, more: &[&str]| {
        let mut cflib = Program::new(&python);
        cflib.arg(&script).arg(path).arg(&port).args(more).env("PYTHONDONTWRITEBYTECODE", "1");
        let output = cflib.output().unwrap();
        let text = String::from_utf8_lossy(&output.stdout).into_owned();
        assert!(output.status.success(), "{text}{}", String::from_utf8_lossy(&output.stderr));
        text
    };
    let mut robot = FlashedRobot::new(flash_with(&self::file(OLD)));
    let end = |robot: &mut FlashedRobot, path: &Path, more: &[&str]| {
        thread::scope(|scope| {
            let station = scope.spawn(|| cflib(path, more));
            serve(&listener, robot, || station.is_finished());
            station.join().unwrap()
        })
    };
    assert!(end(&mut robot, &binary, &["100"]).ends_with("stopped\n"));
    assert_eq!(robot.started, StartedProgram::Loader);
    robot.switch_on(false);
    assert_eq!(robot.started, StartedProgram::Firmware);
    assert!(end(&mut robot, &release, &[]).ends_with("flashed\n"));
    assert_flashed(&robot, &file, "cflib");
}

/// Lets a robot answer the packets of connections until `is_over`. Each packet arrives twice with a probability of 10 %, and one
/// reply to a write gets lost.
fn serve(listener: &TcpListener, robot: &mut FlashedRobot, is_over: impl Fn() -> bool) {
    let mut random = Random::new(34);
    let mut writes = 0;
    listener.set_nonblocking(true).unwrap();
    while !is_over() {
        let Ok((mut stream, _)) = listener.accept() else {
            thread::sleep(Duration::from_millis(5));
            continue;
        };
        stream.set_nonblocking(false).unwrap();
        stream.set_nodelay(true).unwrap();
        while let Some(packet) = packet(&mut stream) {
            for _ in 0..1 + u32::from(random.chance(0.1)) {
                let Some(reply) = robot.receive(&packet) else { continue };
                writes += u32::from(packet.get(2) == Some(&0x18));
                if writes == 5 {
                    writes += 1;
                    continue;
                }
                let length = u8::try_from(reply.len()).unwrap();
                if stream.write_all(&[&[length], &reply[..]].concat()).is_err() {
                    break;
                }
            }
        }
    }
}

/// Reads a packet, or returns `None` at the end of the connection.
fn packet(stream: &mut TcpStream) -> Option<Vec<u8>> {
    let mut length = [0];
    stream.read_exact(&mut length).ok()?;
    let mut packet = vec![0; length[0].into()];
    stream.read_exact(&mut packet).ok()?;
    Some(packet)
}
