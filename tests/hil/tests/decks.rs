//! The decks of a Crazyflie: the firmware reads their memories through the radio's processor, and arms only with decks that
//! it knows. Contents of memories are those that Bitcraze's cflib writes (ow_element.py).

use std::time::Duration;

use bittybuzz_hil::{Command, Core, Deck, DeckMemoryFault, DeviceFault, Robot, TraceLog, resets};

const IDLE: &str = "function step() { }";

/// The search ends before this time, and the first line of counters comes after it.
const FOUND_MS: u64 = 1_000;
const STATUS_MS: u64 = 3_000;

fn hex(digits: &str) -> Vec<u8> {
    let byte = |at| u8::from_str_radix(&digits[at..at + 2], 16).expect("hexadecimal");
    (0..digits.len()).step_by(2).map(byte).collect()
}

/// Returns a robot with these decks.
fn robot(decks: Vec<Deck>) -> Robot {
    let mut robot = Robot::crazyflie(Core::Unicorn, IDLE);
    robot.execute(&Command::Decks { decks });
    robot
}

fn log(robot: &Robot) -> Vec<String> {
    TraceLog::of_events(&robot.events).firmware
}

fn set_memory_fault(robot: &mut Robot, fault: DeckMemoryFault) {
    robot.execute(&Command::DeviceFault { fault: DeviceFault::DeckMemories(Some(fault)) });
}

/// The log names the decks, and gives no reason not to arm that concerns them.
#[test]
fn supported_decks_are_found() {
    for (decks, lines) in [
        (vec![], vec!["no decks"]),
        (vec![Deck::FlowV2], vec!["deck bcFlow2"]),
        (vec![Deck::MultiRanger, Deck::ZRangerV2], vec!["deck bcZRanger2", "deck bcMultiranger"]),
    ] {
        let mut robot = robot(decks);
        robot.run_ms(FOUND_MS);
        let found = log(&robot);
        let found: Vec<_> = found.iter().filter(|line| line.contains("deck")).collect();
        assert_eq!(found, lines);
        robot.run_ms(STATUS_MS);
        let log = log(&robot);
        assert!(!log.iter().any(|line| line.starts_with("the robot does not arm")), "{log:?}");
        assert_eq!(resets(&robot.events), []);
    }
}

/// Each reason stands in the log when it is found, and again with the counters.
#[test]
fn other_decks_are_refused() {
    let memory = |digits: &str| Deck::Memory(hex(digits));
    for (decks, reason) in [
        (
            vec![memory("eb00000000bc10430012010d62634c69676874686f75736534020144ac")],
            "deck bcLighthouse4 (0xbc:0x10) is not supported",
        ),
        (
            vec![Deck::FlowV2, memory("eb00000000bc0612000b010662634c6f636f0201449d")],
            "deck bcLoco (0xbc:0x6) is not supported",
        ),
        (
            vec![memory("eb00000000bc01b1000e010962634c656452696e6702016255")],
            "deck bcLedRing (0xbc:0x1) is not supported",
        ),
        (
            vec![Deck::ZRangerV2, Deck::FlowV2],
            "decks bcZRanger2 and bcFlow2 both use the I2C address 0x29",
        ),
        (vec![Deck::FlowV2, Deck::FlowV2], "decks bcFlow2 and bcFlow2 drive pin 6 of the port"),
        (vec![memory("")], "the memory of deck 0 is empty"),
        (vec![Deck::MultiRanger; 5], "5 decks are too many"),
    ] {
        let mut robot = robot(decks);
        robot.run_ms(FOUND_MS);
        let found = log(&robot);
        assert!(found.iter().any(|line| line == reason), "{reason}: {found:?}");
        robot.run_ms(STATUS_MS);
        let found = log(&robot);
        let arming = format!("the robot does not arm: {reason}");
        assert!(found.contains(&arming), "{reason}: {found:?}");
    }
}

#[test]
fn memories_that_cannot_be_read_are_refused() {
    for (fault, reason) in [
        (DeckMemoryFault::Unreadable, "the memory of deck 0 cannot be read"),
        (DeckMemoryFault::WrongBit(6), "the memory of deck 0 is damaged"),
        (DeckMemoryFault::WrongBit(8), "the memory of deck 0 has version 1"),
    ] {
        let mut robot = robot(vec![Deck::FlowV2]);
        set_memory_fault(&mut robot, fault);
        robot.run_ms(FOUND_MS);
        let log = log(&robot);
        assert!(log.iter().any(|line| line == reason), "{reason}: {log:?}");
    }
}

/// The radio's processor ignores the requests. Other frames wait for it, but no longer than half a second each time.
#[test]
fn a_search_without_answers_ends() {
    let mut robot = robot(vec![Deck::FlowV2]);
    set_memory_fault(&mut robot, DeckMemoryFault::NoAnswer);
    robot.run_ms(FOUND_MS);
    assert!(robot.ping(1, 600).is_some());
    robot.run_ms(10_000);
    let found = log(&robot);
    let line = "the nRF51 does not read memories of decks";
    assert_eq!(found.iter().filter(|found| *found == line).count(), 1, "{found:?}");
    assert!(robot.ping(2, 10).is_some_and(|span| span < Duration::from_millis(5)));
    assert_eq!(resets(&robot.events), []);
}

/// A request or its answer is lost from time to time.
#[test]
fn lost_frames_are_asked_for_again() {
    for seed in 0..4 {
        let mut robot = robot(vec![Deck::FlowV2, Deck::MultiRanger]);
        robot.run_ms(150);
        // A frame of 38 bytes and its request are lost with a probability of a third.
        robot.execute(&Command::Link { lose: 0.005, corrupt: 0.0, seed });
        let count = |robot: &Robot, line| log(robot).iter().filter(|found| *found == line).count();
        let lines = ["deck bcFlow2", "deck bcMultiranger"];
        while lines.iter().any(|line| count(&robot, *line) == 0) {
            assert!(robot.now() < Duration::from_secs(20), "{:?}", log(&robot));
            robot.run_ms(200);
        }
        // A late answer to a repeated request does not start the search again.
        robot.run_ms(1_000);
        for line in lines {
            assert_eq!(count(&robot, line), 1, "{:?}", log(&robot));
        }
    }
}
