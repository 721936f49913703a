//! A Crazyflie whose supply falls for a moment: whatever it does then, its motors stop and stay off, it reports a brown-out, and
//! after power-on it has its script and its id.
//!
//! The chip tells a brown-out from power-on only while its brown-out detector is on, which option bytes decide (RM0090 5.2.2 and
//! 3.9.1). That is assumed here. As delivered it is off: then the detector of power-down resets the chip, with the flags of power-on.

use std::time::Duration;

use bittybuzz_chips::Random;
use bittybuzz_emulation::message::{Memory, ResetCause};
use bittybuzz_hil::flash::{Reading, Writing};
use bittybuzz_hil::safety::{
    assert_locked, assert_motors_off, assert_runs, is_in_loader, reset, since,
};
use bittybuzz_hil::supply::Doing;
use bittybuzz_hil::{
    Command, Core, ECHO_HEADER, RADIO_RAW, Robot, TraceLog, image, layout, motors, resets,
};
use bittybuzz_robot_spec::Layout;

/// The script that the robot has; the one that is written over it differs in the number that it logs.
const OLD: &str = "\
function step() {
  log(1)
  neighbors.broadcast(\"x\", 1)
  set_motor(0, 40) set_motor(1, 40) set_motor(2, 40) set_motor(3, 40)
}
";

const OLD_ID: u16 = 0x0107;
const NEW_ID: u16 = 0x3258;

/// Bytes of a sector of scripts or of the id, and of what is programmed at once at 2.7 to 3.6 V (RM0090 3.3 and 3.6.2).
const SECTOR: usize = 128 * 1024;
const WORD: usize = 4;

fn chip(memory: Memory, seed: u64, crystal: bool) -> Command {
    Command::Chip { lsi_hz: 32_000, crystal, memory, seed, debugger: false }
}

/// Messages of the firmware since the reset at `at`.
fn messages(robot: &Robot, at: Duration) -> Vec<String> {
    TraceLog::of_events(since(robot, at)).firmware
}

/// A probe writes `new` at the beginning of a sector that holds `old`, and is cut short.
fn cut_short(robot: &mut Robot, address: u32, new: &[u8], random: &mut Random) {
    let old = robot.read(address, SECTOR as u32);
    let writing = Writing { old: &old, new, sector: SECTOR, unit: WORD };
    // Most words of a place stay erased: in those nothing can go wrong.
    let words = new.chunks(WORD).enumerate().filter(|(_, word)| *word != [u8::MAX; WORD]);
    let programmed: Vec<usize> = words.map(|(number, _)| 1 + number).collect();
    let programmed = programmed[random.bits() as usize % programmed.len()];
    let operation = if random.chance(0.2) { 0 } else { programmed };
    assert!(operation < writing.operations());
    let reading = [Reading::Partial, Reading::Anything][random.bits() as usize % 2];
    robot.write(address, &writing.cut_at(operation, reading, random));
}

/// Lets the supply fall at a random moment and looks at the robot. Returns true if the bootloader found the line of the radio's
/// processor low and chose another program, which is safe and mute.
fn survives(number: u64) -> bool {
    let doing = Doing::of(number);
    let memory = [Memory::Kept, Memory::Zeroed, Memory::Noise][(number / 7 % 3) as usize];
    let mut random = Random::for_item(2027, number);
    let seed = random.bits();
    println!("number {number}, {doing:?}, {memory:?}");

    let mut robot = Robot::crazyflie(Core::Unicorn, OLD);
    let [first, second] = layout().script_addresses()[..] else { panic!("a log has two sectors") };
    robot.write(second, &layout().script_section(&image(OLD)).unwrap());
    robot.assign_id(OLD_ID);
    robot.execute(&chip(memory, seed, doing != Doing::WaitingForTheCrystal));
    reset(&mut robot, ResetCause::PowerOn);
    match doing {
        // The firmware is ready after 3 ms or so, with the radio after 10.
        Doing::Starting => drop(robot.run_us(random.bits() % 10_000)),
        // Less than the watchdog waits.
        Doing::WaitingForTheCrystal => {
            robot.run_us(random.bits() % 200_000);
            assert_eq!(resets(&robot.events).len(), 1);
            robot.execute(&chip(memory, seed, true));
        }
        _ => {
            robot.run_us(500_000 + random.bits() % 200_000);
            assert!(motors(&robot.events).iter().all(|duty| *duty > 0.05));
        }
    }
    let packet = [&[ECHO_HEADER][..], &[0x55; 29]].concat();
    match doing {
        // The packet takes 360 us, and its echo as long.
        Doing::Sending => {
            robot.send(RADIO_RAW, &packet);
            robot.run_us(370 + random.bits() % 350);
        }
        Doing::Receiving => {
            (0..3).for_each(|_| robot.send(RADIO_RAW, &packet));
            robot.run_us(random.bits() % 1_080);
        }
        Doing::TakingAScript => {
            let new = OLD.replace("log(1)", "log(2)");
            let section = layout().script_section(&image(&new)).unwrap();
            let address = if random.chance(0.5) {
                first
            } else {
                robot.write(first, &section);
                second
            };
            cut_short(&mut robot, address, &section, &mut random);
        }
        Doing::TakingAnId => {
            let address = layout().id.unwrap().address;
            cut_short(&mut robot, address, &Layout::id_section(NEW_ID), &mut random);
        }
        _ => {}
    }

    let at = reset(&mut robot, ResetCause::BrownOut);
    let is_mute = is_in_loader(&robot, at);
    if is_mute {
        robot.run_ms(700);
        assert_motors_off(&robot, at);
    } else {
        // A supply that is too weak falls again and again.
        robot.run_us(random.bits() % 10_000);
        let again = reset(&mut robot, ResetCause::BrownOut);
        if !is_in_loader(&robot, again) {
            assert_locked(&mut robot, at);
            let printed = messages(&robot, again);
            assert!(printed.iter().any(|line| line.contains("after a brown-out")), "{printed:?}");
        }
    }

    let mut at = reset(&mut robot, ResetCause::PowerOn);
    // The radio's processor goes on here, so its line may be low again.
    while is_in_loader(&robot, at) {
        robot.run_us(777);
        at = reset(&mut robot, ResetCause::PowerOn);
    }
    assert_runs(&mut robot);
    let trace_log = TraceLog::of_events(since(&robot, at));
    assert!(
        !trace_log.firmware.iter().any(|line| line.contains("restarted")),
        "{:?}",
        trace_log.firmware
    );
    let logged: Vec<&str> = trace_log.log.iter().map(|(_, values)| values[0].as_str()).collect();
    let expected = if doing == Doing::TakingAScript { &["1", "2"][..] } else { &["1"] };
    assert!(logged.len() >= 5, "{logged:?}");
    let same = |script: &&&str| logged.iter().all(|value| value == *script);
    assert!(expected.iter().any(|script| same(&script)), "no script runs in parts: {logged:?}");
    let says = |text: &str| trace_log.firmware.iter().any(|line| line.contains(text));
    let known = [OLD_ID, NEW_ID].map(|id| says(&format!("robot id {id}")) && !says("unique id"));
    match doing {
        Doing::TakingAnId => {
            assert!(
                known[0] || known[1] || says("from the chip's unique id"),
                "{:?}",
                trace_log.firmware
            );
        }
        _ => assert!(known[0], "{:?}", trace_log.firmware),
    }
    is_mute
}

#[test]
fn a_brown_out_at_any_moment_locks_the_robot_until_power_on() {
    for number in 0..42 {
        survives(number);
    }
}

#[test]
#[ignore = "soak"]
fn a_brown_out_at_a_thousand_moments_locks_the_robot_until_power_on() {
    let mute = (0..1_000).filter(|number| survives(*number)).count();
    println!("{mute} of 1,000 restarts ended in a loader");
}
