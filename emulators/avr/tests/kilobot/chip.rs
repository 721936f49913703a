//! Tests with one robot: peripherals, sleep, flash, and mistakes of programs.

use std::path::Path;

use bittybuzz_emulation::message::{Command, EmulatorEvent};

use crate::robots::{EEPROM, RAM, Robots, assemble};

#[test]
fn timers_have_the_data_sheets_interrupt_rates() {
    let mut robots = Robots::new(1, &assemble("timers", &[]));
    robots.run(1_000_000);
    // Overflows of the timers: 8 MHz / 1024 / 256, and 8 MHz / 8 / 510.
    assert_eq!(robots.words(0, RAM + 0x100, 2), [30, 1960]);
    // The flag is set one count after 100. Then follow at most one NOP, four cycles of entry, three
    // of the jump in the vector table, and the cycles of LDS until the reading.
    let entered = robots.word(0, RAM + 0x104);
    assert!((101 + 4 + 3..=101 + 4 + 3 + 2).contains(&entered), "{entered}");
    // Both compare flags of timer 1 were set, and SBI cleared one.
    assert_eq!(robots.byte(0, RAM + 0x106), 1 << 2);
}

#[test]
fn a_cell_of_the_eeprom_is_written_in_its_time() {
    let mut robots = Robots::new(1, &assemble("eeprom", &[]));
    robots.run(2_000);
    assert_eq!(robots.byte(0, RAM + 0x102), 0, "it is not done yet");
    robots.run(2_000);
    // Table 8-2: a write takes 26,368 cycles; the loop that waits takes three.
    let took = robots.word(0, RAM + 0x100);
    assert!((26_360..26_380).contains(&took), "{took}");
    assert_eq!((robots.byte(0, RAM + 0x102), robots.byte(0, EEPROM + 0xb0)), (0x5a, 0x5a));
}

#[test]
fn deep_sleep_stops_the_timers_and_light_sleep_does_not() {
    let mut robots = Robots::new(1, &assemble("sleep", &[]));
    robots.run(63_000);
    assert_eq!(robots.byte(0, RAM + 0x100), 0, "64 ms of the watchdog");
    robots.run(2_000);
    assert_eq!(robots.byte(0, RAM + 0x100), 1);
    // The core was awake for less than a count of 128 us.
    assert_eq!(robots.word(0, RAM + 0x101), 0);
    robots.run(6_000);
    assert_eq!(robots.byte(0, RAM + 0x103), 2, "ticks of 2.048 ms wake it from idle");
    robots.run(50_000);
    let events = robots.seen();
    assert_eq!(events[0], &EmulatorEvent::Reset { cause: "watchdog".into() });
    // The program sees WDRF, then sleeps with interrupts off and without a source that could wake
    // it.
    assert!(matches!(events[1..], [EmulatorEvent::Lockup { .. }]), "{events:?}");
    assert_eq!(robots.byte(0, RAM + 0x104), 1 << 3);
    let cycles = robots.emulator.statistics().unwrap().core.cycles;
    // The core was awake only during the start, and the 12 ms until the watchdog expired.
    assert!((80_000..110_000).contains(&cycles), "{cycles}");
}

#[test]
fn only_the_boot_loader_writes_flash() {
    let mut robots = Robots::new(1, &assemble("boot", &[]));
    let page = vec![0; 128];
    robots.execute(0, &Command::Write { address: 0x1000, bytes: page });
    robots.run(1_000);
    assert_eq!(robots.errors().len(), 1);
    assert!(robots.errors()[0].contains("works in the boot loader's section only"));
    robots.run(12_000);
    let mut expected: Vec<u16> = (0..63).map(|n| 0x1234 + n).collect();
    expected.push(0x9508);
    assert_eq!(robots.words(0, 0x1000, 64), expected);
    assert_eq!(robots.byte(0, RAM + 0x101), 1, "what was written was called");
    // The timer interrupts every 256 us, also while a page is erased and written, by the vectors in
    // the boot loader.
    let ticks = robots.byte(0, RAM + 0x100);
    assert!((49..=51).contains(&ticks), "{ticks}");
    assert_eq!(robots.errors().len(), 1);
}

#[test]
fn the_board_is_seen_and_measured() {
    let mut robots = Robots::new(1, &assemble("board", &["-DBAUD=12"]));
    robots.execute(0, &Command::Battery { volts: 3.6, charging: true, usb_powered: false });
    robots.execute(0, &Command::Surroundings { light: 512, celsius: 85.0 });
    robots.run(3_000);
    let motor = |number, duty, frequency_hz| EmulatorEvent::Motor { number, duty, frequency_hz };
    let color = |red, green, blue| EmulatorEvent::Color { red, green, blue };
    // 18.7.4: 8 MHz / (8 * 510).
    let frequency = 8e6 / (8.0 * 510.0);
    let expected = [
        color(2, 0, 0),
        color(2, 1, 0),
        color(2, 1, 2),
        color(2, 1, 3),
        color(2, 0, 3),
        motor(1, 75.0 / 255.0, frequency),
        motor(2, 1.0, 0.0),
        motor(1, 0.0, 0.0),
        motor(2, 0.0, 0.0),
    ];
    let seen = robots.seen();
    let is_visible = |event: &&&EmulatorEvent| !matches!(event, EmulatorEvent::Serial { .. });
    let visible: Vec<_> = seen.iter().filter(is_visible).map(|event| rounded(event)).collect();
    assert_eq!(visible, expected.iter().map(rounded).collect::<Vec<_>>());
    let text: Vec<u8> = seen
        .iter()
        .filter_map(|event| match event {
            EmulatorEvent::Serial { bytes } => Some(bytes.clone()),
            _ => None,
        })
        .flatten()
        .collect();
    assert_eq!(text, b"ok");
    // Expected: kilolib's level for 3.6 V; half of the range; table 24-2: 380 mV of 1.1 V at 85 °C;
    // 1.1 V of 3 V. The noise is two units.
    let readings = robots.words(0, RAM + 0x100, 4);
    for (reading, expected) in readings.iter().zip([614_u16, 512, 353, 375]) {
        assert!(reading.abs_diff(expected) <= 2, "{readings:?}");
    }
    let pins = robots.bytes(0, RAM + 0x120, 2);
    assert_eq!((pins[0] & 1, pins[1]), (0, 0x80));
}

/// Rounds numbers, whose last digit may change in the transfer as text.
fn rounded(event: &EmulatorEvent) -> String {
    match event {
        EmulatorEvent::Motor { number, duty, frequency_hz } => {
            format!("motor {number}: {duty:.6}, {frequency_hz:.3} Hz")
        }
        event => format!("{event:?}"),
    }
}

#[test]
fn a_wrong_baud_rate_is_noticed() {
    let mut robots = Robots::new(1, &assemble("board", &["-DBAUD=10"]));
    robots.run(3_000);
    assert!(robots.errors()[0].contains("45454 baud"), "{:?}", robots.errors());
}

#[test]
fn hardware_errors_are_reported_once() {
    for (fault, text) in [
        (1, "no instruction"),
        (2, "beyond all memory"),
        (3, "below the RAM"),
        (4, "shines for more than 100 us"),
    ] {
        let elf = assemble("faults", &[&format!("-DFAULT={fault}")]);
        let mut robots = Robots::new(1, &elf);
        robots.run(5_000);
        let errors = robots.errors();
        assert!(errors.iter().any(|error| error.contains(text)), "{fault}: {errors:?}");
        assert!(errors.len() <= 2, "{errors:?}");
    }
}

#[test]
fn intel_hex_is_the_same_image() {
    let elf = assemble("timers", &[]);
    let hex = elf.with_extension("hex");
    let status = std::process::Command::new("avr-objcopy")
        .args(["-O", "ihex"])
        .args([&elf, &hex])
        .status()
        .unwrap();
    assert!(status.success());
    let [mut from_elf, mut from_hex] = [&elf, &hex].map(|image| Robots::new(1, image));
    assert_eq!(from_elf.bytes(0, 0, 0x8000), from_hex.bytes(0, 0, 0x8000));
    assert_ne!(from_hex.word(0, 0), 0xffff);
}

#[test]
fn refused_commands_state_the_reason() {
    let image = assemble("timers", &[]);
    let mut robots = Robots::new(1, &image);
    for (command, why) in [
        (Command::Touch { keys: 1 }, "a Kilobot does not handle this command"),
        (Command::Clock { error_ppm: 2e5 }, "between -100000 and 100000"),
        (Command::Read { address: 0x7fff, length: 2 }, "A Kilobot has flash at 0"),
        (Command::Read { address: RAM + 0x8ff, length: 2 }, "A Kilobot has flash at 0"),
        (Command::Write { address: EEPROM + 0x400, bytes: vec![1] }, "A Kilobot has flash at 0"),
        (Command::Load { elf: "nowhere.elf".into() }, "cannot read nowhere.elf"),
        (Command::Load { elf: file("text", b"hello") }, "not a 32-bit ELF file"),
        (Command::Load { elf: file("bad.hex", b":00000001FF\n:01000000FE\n") }, "line 2"),
        (Command::Load { elf: file("none.hex", b":00000001FF\n") }, "nothing for the flash"),
        (Command::Load { elf: file("long.hex", b":018000000778\n") }, "the image ends at 0x8001"),
    ] {
        let said = robots.refusal(&command);
        assert!(said.contains(why), "{command:?}: {said}");
    }
}

fn file(name: &str, bytes: &[u8]) -> std::path::PathBuf {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    std::fs::write(&path, bytes).unwrap();
    path
}

#[test]
fn steps_are_counted_without_the_image_doing_anything_for_it() {
    let mut robots = Robots::new(2, &assemble("phase", &[]));
    robots.run(1_000);
    assert_eq!(robots.seen(), [&EmulatorEvent::Step; 3]);
    assert_eq!(robots.events.len(), 6, "each has its own");
    // The program restarts in the middle of a step.
    robots.execute(0, &Command::Power { on: false });
    robots.execute(0, &Command::Power { on: true });
    robots.run(1_000);
    assert_eq!(robots.seen(), [&EmulatorEvent::Step; 6]);
}
