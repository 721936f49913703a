//! `bbz flash` for Kilobots: the real avrdude on a simulated programmer. Not tried on hardware.
#![cfg(target_os = "linux")]

use crate::support::stk500::{Chip, Programmer};
use crate::support::{Folder, Outcome};
use bittybuzz_robot_spec::{find_script_section, script_section};
use bittybuzz_vm_core::Parts;

const SCRIPT: &str = "function step() { led(1) }\n";
/// The address of the boot loader.
const BOOT: usize = 0x7000;

/// A program with a script, as `bbz build --firmware` accepts it; a Kilobot could not run it.
fn program(content: u8) -> Vec<u8> {
    [&[content; 5000][..], &script_section(Parts::NONE, b"some script").unwrap()].concat()
}

/// Converts a program to Intel hex.
fn hex(program: &[u8]) -> String {
    let mut text = String::new();
    for (line, bytes) in program.chunks(16).enumerate() {
        let [high, low] = u16::try_from(16 * line).unwrap().to_be_bytes();
        let head = [u8::try_from(bytes.len()).unwrap(), high, low, 0];
        let sum = head.iter().chain(bytes).fold(0_u8, |sum, byte| sum.wrapping_sub(*byte));
        text.push(':');
        for byte in head.iter().chain(bytes).chain([&sum]) {
            text += &format!("{byte:02X}");
        }
        text.push('\n');
    }
    text + ":00000001FF\n"
}

/// A used Kilobot: program, boot loader, and calibration.
fn used() -> Chip {
    let mut chip = Chip::erased();
    let program = program(3);
    chip.flash[..program.len()].copy_from_slice(&program);
    chip.flash[BOOT..BOOT + 1000].fill(0x42);
    for (at, duty) in [(0x05, 70), (0x09, 71), (0x0c, 65), (0x14, 66)] {
        chip.eeprom[at] = duty;
    }
    chip.eeprom[0xb0..0xb2].copy_from_slice(&[9, 0]);
    chip.eeprom[0x3ff] = 7;
    chip
}

fn flash(folder: &Folder, programmer: &Programmer, options: &[&str]) -> Outcome {
    let robot = ["flash", "s.bzz", "--robot", "kilobot"];
    let port = ["--programmer", "stk500v1", "--port", &programmer.port];
    folder.bbz(&[&robot[..], &port, options].concat())
}

/// Asserts that the flash begins with such a program and the script of the folder. Returns the
/// bytes after them.
fn check(folder: &Folder, flash: &[u8], content: u8) -> Vec<u8> {
    folder.write("whole.hex", hex(&program(content)));
    let build = ["build", "s.bzz", "--robot", "kilobot", "--firmware", "whole.hex", "-o", "x"];
    assert_eq!(folder.bbz(&build).status, Some(0));
    let text = String::from_utf8(folder.read("x.hex")).unwrap();
    let bytes: Vec<u8> = text
        .lines()
        .filter(|line| &line[7..9] == "00")
        .flat_map(|line| {
            let data = &line[9..line.len() - 2];
            (0..data.len()).step_by(2).map(|at| u8::from_str_radix(&data[at..at + 2], 16).unwrap())
        })
        .collect();
    assert!(find_script_section(&bytes).is_ok());
    assert_eq!(flash[..bytes.len()], bytes);
    flash[bytes.len()..].to_vec()
}

#[test]
fn firmware_and_script_are_written_and_the_rest_is_kept() {
    let folder = Folder::with("avrdude_firmware", "s.bzz", SCRIPT);
    folder.write("k.hex", hex(&program(5)));
    let programmer = Programmer::with(used());
    let outcome = flash(&folder, &programmer, &["--firmware", "k.hex"]);
    assert_eq!(outcome.status, Some(0), "{}", outcome.stderr);
    assert!(outcome.stdout.ends_with("is on the Kilobot, which restarts\n"));
    let chip = programmer.chip.lock().unwrap();
    let behind = check(&folder, &chip.flash, 5);
    let gap = behind.len() - (0x8000 - BOOT);
    assert!(behind[..gap].iter().all(|byte| *byte == 0xff));
    assert_eq!(behind[gap..], used().flash[BOOT..], "the boot loader");
    assert_eq!(chip.eeprom, used().eeprom);
}

#[test]
fn the_script_is_exchanged_in_the_program_that_is_there() {
    let folder = Folder::with("avrdude_script", "s.bzz", SCRIPT);
    let programmer = Programmer::with(used());
    for script in [SCRIPT, "function step() { led(2) x = 3 }\n", SCRIPT] {
        folder.write("s.bzz", script);
        let outcome = flash(&folder, &programmer, &["--id", "4660"]);
        assert_eq!(outcome.status, Some(0), "{}", outcome.stderr);
        let chip = programmer.chip.lock().unwrap();
        check(&folder, &chip.flash, 3);
        let mut cells = used().eeprom;
        cells[0xb0..0xb2].copy_from_slice(&[0x34, 0x12]);
        assert_eq!(chip.eeprom, cells);
    }
}

#[test]
fn a_robot_without_program_or_boot_loader() {
    let folder = Folder::with("avrdude_erased", "s.bzz", SCRIPT);
    let programmer = Programmer::with(Chip::erased());
    let outcome = flash(&folder, &programmer, &[]);
    assert_eq!(outcome.status, Some(3));
    let message = "error: `the robot's flash` has no place for a script\n";
    assert!(outcome.stderr.contains(message), "{}", outcome.stderr);
    assert_eq!(programmer.chip.lock().unwrap().flash, vec![0xff; 0x8000]);
    folder.write("k.hex", hex(&program(5)));
    let outcome = flash(&folder, &programmer, &["--firmware", "k.hex"]);
    assert_eq!(outcome.status, Some(0), "{}", outcome.stderr);
    assert!(outcome.stderr.contains("warning: the Kilobot has no boot loader"));
    check(&folder, &programmer.chip.lock().unwrap().flash, 5);
}

/// The firmware runs no script on a robot with an erased id or duty.
#[test]
fn an_erased_id_or_duty_is_reported() {
    let folder = Folder::with("avrdude_uncalibrated", "s.bzz", SCRIPT);
    let erased: [(&[usize], &[&str], &str); 4] = [
        (&[0xb0, 0xb1], &[], "no id: it shows magenta"),
        (&[0x0c], &[], "no motor duties: it shows magenta"),
        (&[0xb0, 0xb1, 0x14], &[], "no id and motor duties: it shows magenta"),
        (&[0xb0, 0xb1], &["--id", "255"], ""),
    ];
    for (addresses, options, message) in erased {
        let mut chip = used();
        for at in addresses {
            chip.eeprom[*at] = 0xff;
        }
        let outcome = flash(&folder, &Programmer::with(chip), options);
        assert_eq!(outcome.status, Some(0), "{}", outcome.stderr);
        assert!(outcome.stderr.contains(message), "{}", outcome.stderr);
        assert_ne!(outcome.stderr.contains("magenta"), message.is_empty(), "{}", outcome.stderr);
    }
    let programmer = Programmer::with(used());
    let outcome = flash(&folder, &programmer, &["--id", "65535"]);
    assert_eq!(outcome.status, Some(3));
    let message = "error: the Kilobot cannot have the id 65535\n";
    assert!(outcome.stderr.starts_with(message), "{}", outcome.stderr);
    assert_eq!(programmer.chip.lock().unwrap().eeprom, used().eeprom);
}

#[test]
fn a_robot_that_cannot_be_read_is_not_erased() {
    let folder = Folder::with("avrdude_locked", "s.bzz", SCRIPT);
    let programmer = Programmer::with(Chip { lock: 0xfc, ..used() });
    let outcome = flash(&folder, &programmer, &[]);
    assert_eq!(outcome.status, Some(3));
    assert!(outcome.stderr.contains("error: the lock bits of the Kilobot"), "{}", outcome.stderr);
    assert_eq!(programmer.chip.lock().unwrap().flash, used().flash);
}

#[test]
fn a_failed_write_keeps_the_earlier_content() {
    let folder = Folder::with("avrdude_broken", "s.bzz", SCRIPT);
    let programmer = Programmer::with(Chip { pages_left: 5, ..used() });
    let outcome = flash(&folder, &programmer, &[]);
    assert_eq!(outcome.status, Some(3));
    assert!(outcome.stderr.contains("may be without a program now"), "{}", outcome.stderr);
    // Runs the command as a user would.
    let (_, command) = outcome.stderr.split_once("this writes it: avrdude ").unwrap();
    programmer.chip.lock().unwrap().pages_left = 1000;
    let words: Vec<&str> = command.split_whitespace().collect();
    let restored = std::process::Command::new("avrdude").args(&words).status().unwrap();
    assert!(restored.success());
    let chip = programmer.chip.lock().unwrap();
    assert_eq!((&chip.flash, &chip.eeprom), (&used().flash, &used().eeprom));
    for word in words {
        if let Some((path, "r")) = word.rsplit_once(':') {
            std::fs::remove_file(path.rsplit_once(':').unwrap().1).unwrap();
        }
    }
}

#[test]
fn wrong_command_lines_are_reported() {
    let folder = Folder::with("avrdude_wrong", "s.bzz", SCRIPT);
    folder.write("k.hex", "no hex file");
    let robot = ["flash", "s.bzz", "--robot", "kilobot"];
    for (options, message) in [
        (&["--firmware", "k.hex"][..], "`k.hex` is neither an ELF nor an Intel hex file"),
        (&["--set", "x=1"], "the Kilobot does not take the setting `x=1`: it has no settings"),
    ] {
        let outcome = folder.bbz(&[&robot[..], options].concat());
        assert_eq!(outcome.status, Some(3));
        assert!(outcome.stderr.contains(message), "{}", outcome.stderr);
    }
    let outcome = folder.bbz(&["flash", "s.bzz", "--robot", "crazyflie", "--port", "usb"]);
    assert!(outcome.stderr.contains("not through a programmer"), "{}", outcome.stderr);
    // A dry run prints the calls.
    let outcome = folder.bbz(&[&robot[..], &["--dry-run", "--programmer", "usbasp"]].concat());
    let calls: Vec<&str> = outcome.stdout.lines().collect();
    assert_eq!(calls.len(), 2, "{}", outcome.stderr);
    assert!(calls.iter().all(|call| call.starts_with("avrdude -q -p ATmega328P -c usbasp -U ")));
}
