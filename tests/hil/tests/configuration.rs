//! The configuration in a Crazyflie's EEPROM. Its bytes are those that Bitcraze's cflib writes (i2c_element.py).

use bittybuzz_hil::{Command, Core, DeviceFault, EepromFault, Robot, TraceLog, frames, resets};

const IDLE: &str = "function step() { }";

/// Channel 60, 1 Mbit/s, pitch 1.5°, roll -0.25°, address E7E7E7E701.
const OTHER: &str = "30784243013c010000c03f000080bee701e7e7e745";

/// Types of frames: channel, data rate and address.
const CHANNEL: u8 = 0x01;
const DATA_RATE: u8 = 0x02;
const ADDRESS: u8 = 0x05;

fn hex(digits: &str) -> Vec<u8> {
    let byte = |at| u8::from_str_radix(&digits[at..at + 2], 16).expect("hexadecimal");
    (0..digits.len()).step_by(2).map(byte).collect()
}

/// Runs a robot with this EEPROM, and returns its channel, data rate and address, and its log.
fn set_up(bytes: &str, fault: Option<EepromFault>) -> ([Vec<u8>; 3], Vec<String>) {
    let mut robot = Robot::crazyflie(Core::Unicorn, IDLE);
    robot.execute(&Command::Eeprom { bytes: hex(bytes) });
    robot.execute(&Command::DeviceFault { fault: DeviceFault::Eeprom(fault) });
    robot.run_ms(1_000);
    assert_eq!(resets(&robot.events), []);
    let log = TraceLog::of_events(&robot.events).firmware;
    assert!(log.iter().any(|line| line == "radio ready"), "{log:?}");
    let settings = [CHANNEL, DATA_RATE, ADDRESS].map(|kind| {
        let (_, payload) = frames(&robot.events, kind).next().expect("a setting");
        payload.to_vec()
    });
    (settings, log)
}

#[test]
fn the_radio_has_the_settings_of_the_eeprom() {
    let (settings, log) = set_up(OTHER, None);
    assert_eq!(settings, [vec![60], vec![1], vec![0x01, 0xe7, 0xe7, 0xe7, 0xe7]]);
    let line =
        "radio channel 60, data rate 1, address [e7, e7, e7, e7, 01], trim 1.5 and -0.25 degrees";
    assert!(log.iter().any(|found| found == line), "{log:?}");
    assert!(!log.iter().any(|line| line.contains("default configuration")), "{log:?}");
}

#[test]
fn without_a_valid_configuration_the_radio_has_its_defaults() {
    let damaged = OTHER.replace("3c", "3d");
    for (bytes, fault, reason) in [
        ("", None, "the memory has none"),
        (&damaged, None, "its checksum is wrong"),
        ("3078424309", None, "it has version 9"),
        (OTHER, Some(EepromFault::NoAcknowledge), "the memory does not answer: NoAcknowledge"),
        (OTHER, Some(EepromFault::SdaLow(u32::MAX)), "the memory does not answer: SdaLow"),
    ] {
        let (settings, log) = set_up(bytes, fault);
        assert_eq!(settings, [vec![80], vec![2], vec![0xe7; 5]]);
        let line = format!("default configuration: {reason}");
        assert!(log.contains(&line), "{log:?}");
    }
}

/// A chip that holds SDA from before the start is freed by clock pulses.
#[test]
fn a_held_bus_is_freed_at_the_start() {
    let (settings, _) = set_up(OTHER, Some(EepromFault::SdaLow(9)));
    assert_eq!(settings[0], [60]);
}
