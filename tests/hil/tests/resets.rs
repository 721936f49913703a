//! Resets as they are on a Crazyflie: Bitcraze's bootloader runs first, memory may hold anything, the watchdog's clock is
//! inexact and the crystal may be dead. Whatever happens, the motors stay off unless the cause is known and harmless.

use std::time::Duration;

use bittybuzz_chips::Random;
use bittybuzz_emulation::message::{Memory, ResetCause};
use bittybuzz_hil::safety::{assert_locked, assert_motors_off, assert_runs, is_in_loader, reset};
use bittybuzz_hil::{
    Command, Core, EmulatorEvent, Robot, address_of, is_lit, load_register, motors, poll_of, resets,
};

/// All motors turn, and every LED of the script changes.
const DRIVE: &str = "\
function init() { n = 0 }
function step() {
  n = n + 1
  led(n % 8)
  set_motor(0, 20 + n % 2) set_motor(1, 30 + n % 2) set_motor(2, 40 + n % 2) set_motor(3, 50 + n % 2)
}
";

/// The chip of the data sheet's typical values.
fn chip() -> Command {
    Command::Chip { lsi_hz: 32_000, crystal: true, memory: Memory::Kept, seed: 0, debugger: false }
}

/// The kinds of failure: code that fails, and why the chip restarts then.
fn failures() -> Vec<(&'static str, Vec<u16>, &'static str)> {
    let panic = [&load_register(0, address_of("rust_begin_unwind") | 1)[..], &[0x4700]].concat();
    // NVIC_ISPR0 and NVIC_ISER0: interrupt 6, EXTI0, which has no handler. `str r1, [r0]`, `bx lr`
    let set = |address| [&load_register(0, address)[..], &[0x6001]].concat();
    let stray =
        [&load_register(1, 1 << 6)[..], &set(0xe000_e200), &set(0xe000_e100), &[0x4770]].concat();
    vec![
        ("panic", panic, "software"),
        // `udf #0`
        ("hard fault", vec![0xde00], "software"),
        // `push {r0-r7, lr}; b .-2`
        ("full stack", vec![0xb5ff, 0xe7fd], "software"),
        ("stray interrupt", stray, "software"),
        // `cpsid i; b .`
        ("watchdog", vec![0xb672, 0xe7fe], "independent_watchdog"),
    ]
}

/// Where the code fails: in a task, and in the interrupt that answers each byte of the radio's processor.
fn sites() -> [u32; 2] {
    [address_of(&poll_of("show_status")), address_of("USART6")]
}

/// Fails at a random moment, restores the code, and looks at the robot. Returns true if the bootloader found the line of
/// the radio's processor low and chose another program, which is safe and mute.
fn fails_safely(number: u64) -> bool {
    let failures = failures();
    let mut random = Random::for_item(2026, number);
    let mut below = |bound: u64| random.bits() % bound;
    let (name, code, cause) = &failures[below(failures.len() as u64) as usize];
    // In an interrupt that never reads its byte no other interrupt would have its turn.
    let site = sites()[if *name == "stray interrupt" { 0 } else { below(2) as usize }];
    let memory = [Memory::Kept, Memory::Zeroed, Memory::Noise][below(3) as usize];
    // The nRF51 reports by then, so that the link's interrupt is executed.
    let moment = 1_000_000 + below(400_000);
    let seed = below(u64::MAX);
    let what = format!("number {number}, {name}, {memory:?}, at {moment} µs, {site:#x}");

    let mut robot = Robot::crazyflie(Core::Unicorn, DRIVE);
    robot.execute(&Command::Chip { lsi_hz: 32_000, crystal: true, memory, seed, debugger: false });
    robot.run_us(moment);
    assert_eq!(resets(&robot.events), [], "{what}");
    let code: Vec<u8> = code.iter().flat_map(|half| half.to_le_bytes()).collect();
    let original = robot.read(site, code.len() as u32);
    robot.write(site, &code);
    for _ in 0..2_000 {
        robot.run_us(200);
        if !resets(&robot.events).is_empty() {
            break;
        }
    }
    let (at, found) = *resets(&robot.events).first().unwrap_or_else(|| panic!("{what}: no reset"));
    assert_eq!(found, *cause, "{what}");
    robot.write(site, &original);
    // The script ran, so each motor turned; each was off before the reset that would turn it off anyway.
    if *cause == "software" {
        for motor in 1..=4 {
            let last = |is_on: bool| {
                let before = robot.events.iter().rev().filter(|event| event.at < at);
                let mut changes = before.filter_map(|event| match event.event {
                    EmulatorEvent::Motor { number, duty, .. } if number == motor => {
                        Some((event.at, duty))
                    }
                    _ => None,
                });
                changes.find(|(_, duty)| (*duty > 0.0) == is_on).map(|(at, _)| at)
            };
            let (off, on) = (last(false), last(true));
            assert!(on.is_some() && off > on, "{what}: motor {motor} on {on:?}, off {off:?}");
        }
    }
    if is_in_loader(&robot, at) {
        robot.run_ms(700);
        assert_motors_off(&robot, at);
        return true;
    }
    // Code that was executed again before it was restored fails again, and is as safe.
    let at = resets(&robot.events).last().unwrap().0;
    assert_locked(&mut robot, at);
    // Not even the reset button of a debug probe ends the lock, but power-on does.
    let at = reset(&mut robot, ResetCause::Pin);
    if !is_in_loader(&robot, at) {
        assert_locked(&mut robot, at);
    }
    false
}

#[test]
fn after_any_failure_the_robot_is_locked() {
    for number in 0..20 {
        fails_safely(number);
    }
}

#[test]
#[ignore = "soak"]
fn after_any_failure_the_robot_is_locked_at_a_thousand_moments() {
    let mute = (0..1_000).filter(|number| fails_safely(*number)).count();
    println!("{mute} of 1,000 restarts ended in a loader");
}

/// Power-on ends the lock, whatever the backup registers hold then.
#[test]
fn power_on_ends_the_lock() {
    for memory in [Memory::Kept, Memory::Zeroed, Memory::Noise] {
        let mut robot = Robot::crazyflie(Core::Unicorn, DRIVE);
        robot.execute(&Command::Chip {
            lsi_hz: 32_000,
            crystal: true,
            memory,
            seed: 7,
            debugger: false,
        });
        robot.run_ms(500);
        let at = reset(&mut robot, ResetCause::BrownOut);
        assert_locked(&mut robot, at);
        reset(&mut robot, ResetCause::PowerOn);
        assert_runs(&mut robot);
    }
}

/// A reset by pin alone is a person's.
#[test]
fn the_reset_pin_alone_starts_the_script() {
    let mut robot = Robot::crazyflie(Core::Unicorn, DRIVE);
    robot.run_ms(500);
    reset(&mut robot, ResetCause::Pin);
    assert_runs(&mut robot);
}

/// A software reset that the firmware did not note is a failure, unless a debugger may have done it.
#[test]
fn a_software_reset_needs_a_note_or_a_debugger() {
    for debugger in [false, true] {
        let mut robot = Robot::crazyflie(Core::Unicorn, DRIVE);
        robot.execute(&Command::Chip {
            lsi_hz: 32_000,
            crystal: true,
            memory: Memory::Kept,
            seed: 0,
            debugger,
        });
        robot.run_ms(500);
        let at = reset(&mut robot, ResetCause::Software);
        if debugger {
            assert_runs(&mut robot);
        } else {
            assert_locked(&mut robot, at);
        }
    }
}

/// Half a note is a failure, too: code that sets one bit of the backup registers, and waits.
#[test]
fn a_damaged_note_locks_the_robot() {
    let mut robot = Robot::crazyflie(Core::Unicorn, DRIVE);
    robot.run_ms(500);
    let site = sites()[0];
    // `str r1, [r0]`, `bx lr`
    let code =
        [&load_register(0, 0x4000_2854)[..], &load_register(1, 1 << 7), &[0x6001, 0x4770]].concat();
    let code: Vec<u8> = code.iter().flat_map(|half| half.to_le_bytes()).collect();
    let original = robot.read(site, code.len() as u32);
    robot.write(site, &code);
    robot.run_ms(60);
    robot.write(site, &original);
    assert_eq!(resets(&robot.events), []);
    let at = reset(&mut robot, ResetCause::Pin);
    assert_locked(&mut robot, at);
}

/// The watchdog's oscillator at both ends of its range: it never ends a program that runs, and always one that hangs, in time.
#[test]
fn the_watchdog_does_its_work_at_any_frequency() {
    for (lsi_hz, latest_ms) in [(17_000, 471), (32_000, 251), (47_000, 171)] {
        let mut robot = Robot::crazyflie(Core::Unicorn, DRIVE);
        robot.execute(&Command::Chip {
            lsi_hz,
            crystal: true,
            memory: Memory::Kept,
            seed: 0,
            debugger: false,
        });
        reset(&mut robot, ResetCause::PowerOn);
        robot.run_ms(5_000);
        assert_eq!(resets(&robot.events).len(), 1, "{lsi_hz} Hz: {:?}", resets(&robot.events));
        assert!(motors(&robot.events).iter().all(|duty| *duty > 0.05));
        // `cpsid i; b .`
        robot.write(sites()[0], &[0x72, 0xb6, 0xfe, 0xe7]);
        let hangs = robot.now();
        robot.run_ms(50 + latest_ms + 1);
        let reset = resets(&robot.events)[1];
        assert_eq!(reset.1, "independent_watchdog");
        let span = reset.0 - hangs;
        assert!(span <= Duration::from_millis(50 + latest_ms), "{lsi_hz} Hz: {span:?}");
    }
}

/// Without a crystal the firmware waits for ever: the watchdog restarts it again and again, the motors stay off, and from the
/// second time on the red LED says that something is wrong.
#[test]
fn a_dead_crystal_ends_in_resets_with_the_motors_off() {
    let mut robot = Robot::crazyflie(Core::Unicorn, DRIVE);
    robot.execute(&Command::Chip {
        lsi_hz: 32_000,
        crystal: false,
        memory: Memory::Kept,
        seed: 0,
        debugger: false,
    });
    let at = reset(&mut robot, ResetCause::PowerOn);
    robot.run_ms(2_000);
    let resets = resets(&robot.events);
    let by_watchdog = resets.iter().filter(|(_, cause)| *cause == "independent_watchdog").count();
    assert!((7..=8).contains(&by_watchdog), "{resets:?}");
    assert_motors_off(&robot, at);
    assert!(is_lit(&robot.events, "red_right"));
}

/// The bootloader starts another program if the pins say so: mute, with the motors off.
#[test]
fn a_loader_in_the_firmwares_place_is_mute_and_safe() {
    let mut robot = Robot::crazyflie(Core::Unicorn, DRIVE);
    robot.execute(&chip());
    robot.run_ms(500);
    // The radio's processor has no room: PA4 is high.
    robot.execute(&Command::FlowControl { full: true });
    let at = reset(&mut robot, ResetCause::Pin);
    robot.run_ms(1_000);
    assert_motors_off(&robot, at);
    assert!(
        robot
            .events
            .iter()
            .any(|event| event.event == EmulatorEvent::Loader { name: "crtp".into() })
    );
    robot.execute(&Command::FlowControl { full: false });
    assert!(robot.ping(1, 10).is_none());
    reset(&mut robot, ResetCause::PowerOn);
    assert_runs(&mut robot);
}
