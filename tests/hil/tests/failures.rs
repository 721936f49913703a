//! What the firmware does when it fails itself: the motors stop, the chip restarts, and no script runs after that.

use std::time::Duration;

use bittybuzz_hil::{
    Command, Core, EmulatorEvent, Robot, TimedEvent, TraceLog, address_of, is_lit, load_register,
    motors, poll_of, resets, text, trace,
};

use crate::figures::{self, TOLERANCE};

/// Motors and LEDs change with every step.
const DRIVE: &str = "\
function init() { n = 0 }
function step() {
  n = n + 1 led(n % 8)
  set_motor(0, 20 + n % 2) set_motor(1, 30 + n % 2) set_motor(2, 40 + n % 2) set_motor(3, 50 + n % 2)
}
";

/// The tasks with their names in the log. The watchdog's own task has none, and nothing observes the one that writes
/// the log of the sensors.
const TASKS: [(&str, Option<&str>); 9] = [
    ("run_script", Some("Script")),
    ("drive_motors", Some("Motors")),
    ("receive_frames", Some("Receive")),
    ("send_frames", Some("Send")),
    ("broadcast_messages", Some("Swarm")),
    ("watch_battery", Some("Battery")),
    ("show_status", Some("Leds")),
    ("read_sensors", Some("Sensors")),
    ("feed_watchdog", None),
];

/// Nothing that a script does, and the sign of a robot that has locked itself.
fn is_locked(events: &[TimedEvent]) -> bool {
    let script_leds = ["red_left", "green_left", "blue_left"];
    let shines = |led: &&str| is_lit(events, led);
    motors(events) == [0.0; 4] && shines(&"red_right") && !script_leds.iter().any(shines)
}

/// Returns the longest time to the reset.
fn a_dead_task_restarts_the_robot(core: Core, tasks: &[(&str, Option<&str>)]) -> Duration {
    let mut longest = Duration::ZERO;
    for (task, name) in tasks {
        let mut robot = Robot::crazyflie(core, DRIVE);
        robot.run_ms(1000);
        assert_eq!(resets(&robot.events), []);
        assert!(motors(&robot.events).iter().all(|duty| *duty > 0.05));
        let killed = robot.now();
        let symbol = poll_of(task);
        robot.execute(&Command::Skip { symbol });
        robot.run_ms(600);
        let resets = resets(&robot.events);
        let (at, cause) = *resets.first().unwrap_or_else(|| panic!("{task}: no reset"));
        assert_eq!(cause, "independent_watchdog", "{task}");
        // Nominal time of the watchdog and one look before it.
        assert!((at - killed).as_millis() <= 351, "{task}: {:?}", at - killed);
        longest = longest.max(at - killed);
        let after: Vec<TimedEvent> =
            robot.events.iter().filter(|event| event.at >= at).cloned().collect();
        assert_eq!(motors(&after), [0.0; 4], "{task}");
        let log = TraceLog::of_events(&robot.events).firmware;
        let named: Vec<&str> =
            log.iter().filter_map(|line| line.strip_prefix("no sign of life from task ")).collect();
        assert!(named.iter().all(|named| Some(named) == name.as_ref()), "{task}: {log:?}");
        assert_eq!(named.is_empty(), name.is_none(), "{task}: {log:?}");
    }
    longest
}

#[test]
fn a_dead_task_restarts_the_robot_on_unicorn() {
    let longest = a_dead_task_restarts_the_robot(Core::Unicorn, &TASKS);
    let figures = [("longest", longest.as_millis() as u64)];
    figures::check("crazyflie", "dead_task_ms", &figures, TOLERANCE);
}

#[test]
#[ignore = "soak"]
fn a_dead_task_restarts_the_robot_on_qemu() {
    a_dead_task_restarts_the_robot(Core::Qemu, &TASKS[..1]);
}

/// Replaces the code of the status LEDs' task, which runs every 50 ms.
fn with_code(core: Core, code: &[u16]) -> (Robot, Vec<TimedEvent>) {
    let mut robot = Robot::crazyflie(core, DRIVE);
    robot.run_ms(1000);
    let code: Vec<u8> = code.iter().flat_map(|half| half.to_le_bytes()).collect();
    robot.write(address_of(&poll_of("show_status")), &code);
    let events = robot.run_ms(60);
    (robot, events)
}

/// After a failure: motors first, then the restart; told once, and locked.
fn the_failure_is_safe(core: Core, code: &[u16]) {
    let (mut robot, events) = with_code(core, code);
    let resets = resets(&events);
    assert_eq!(resets.first().map(|(_, cause)| *cause), Some("software"), "{events:?}");
    let reset = resets[0].0;
    // Before the reset, which would stop them anyway.
    for motor in 1..=4 {
        let stopped = events.iter().find(|event| {
            matches!(event.event, EmulatorEvent::Motor { number, duty, .. } if number == motor && duty == 0.0)
        });
        let stopped = stopped.unwrap_or_else(|| panic!("motor {motor} does not stop"));
        assert!(stopped.at < reset, "motor {motor}: {:?}, reset at {reset:?}", stopped.at);
    }
    // The program would fail again and again; the motors stay where they are.
    robot.run_ms(if core == Core::Qemu { 60 } else { 500 });
    assert_eq!(motors(&robot.events), [0.0; 4]);
}

/// An undefined instruction (`udf #0`).
#[test]
fn an_undefined_instruction_stops_the_robot() {
    the_failure_is_safe(Core::Unicorn, &[0xde00]);
}

#[test]
fn an_undefined_instruction_stops_the_robot_on_qemu() {
    the_failure_is_safe(Core::Qemu, &[0xde00]);
}

/// `movs r0, #0; mvns r0, r0; ldr r0, [r0]`: an address where nothing is.
#[test]
fn a_wild_read_stops_the_robot() {
    the_failure_is_safe(Core::Unicorn, &[0x2000, 0x43c0, 0x6800]);
}

/// `push {r0-r7, lr}; b .-2`: until the stack is full. The stack pointer is then of no use to anybody.
#[test]
fn a_full_stack_stops_the_robot() {
    the_failure_is_safe(Core::Unicorn, &[0xb5ff, 0xe7fd]);
}

#[test]
#[ignore = "soak"]
fn a_full_stack_stops_the_robot_on_qemu() {
    the_failure_is_safe(Core::Qemu, &[0xb5ff, 0xe7fd]);
}

/// A mistake that the program finds itself: a jump to its panic handler, with `bx r0`.
#[test]
fn a_panic_stops_the_robot() {
    let handler = address_of("rust_begin_unwind") | 1;
    let jump = [&load_register(0, handler)[..], &[0x4700]].concat();
    the_failure_is_safe(Core::Unicorn, &jump);
}

/// Interrupts off and no way on: only the watchdog helps. `cpsid i; b .`
#[test]
fn a_stuck_program_is_restarted() {
    let (mut robot, _) = with_code(Core::Unicorn, &[0xb672, 0xe7fe]);
    robot.run_ms(600);
    let resets = resets(&robot.events);
    assert_eq!(resets.first().map(|(_, cause)| *cause), Some("independent_watchdog"));
    assert_eq!(motors(&robot.events), [0.0; 4]);
}

/// A passing failure, as by a particle: the code is right again after the restart. The robot tells what happened, keeps its
/// radio, and stays locked.
#[test]
fn after_a_failure_the_robot_is_locked_and_reports_it() {
    let mut robot = Robot::crazyflie(Core::Unicorn, DRIVE);
    robot.run_ms(1000);
    let address = address_of(&poll_of("show_status"));
    let original = robot.read(address, 2);
    robot.write(address, &0xde00_u16.to_le_bytes());
    while resets(&robot.events).is_empty() {
        robot.run_us(100);
    }
    robot.write(address, &original);
    let before = robot.events.len();
    robot.run_ms(2000);
    let after = &robot.events[before..];
    assert_eq!(resets(after), []);
    assert!(is_locked(after), "{after:?}");
    assert!(robot.ping(1, 10).is_some());
    // Off and on again: the script runs.
    let mut robot = Robot::crazyflie(Core::Unicorn, DRIVE);
    robot.run_ms(500);
    assert!(motors(&robot.events).iter().all(|duty| *duty > 0.05));
}

/// The distances of a Multi-ranger are functions that this image does not have.
#[test]
fn the_start_reports_what_the_firmware_cannot_do() {
    let script = bittybuzz_hil::ScriptFile::new("start", "function step() { get_front() }");
    let trace = trace(Core::Unicorn, script.path(), 0.3);
    let said: Vec<&str> = trace.of("firmware").map(|line| text(&line["text"])).collect();
    assert!(said.iter().any(|line| line.contains("at most 76 of 255")), "{said:?}");
    assert!(said.iter().any(|line| line.contains("not tried on hardware")), "{said:?}");
    let fault = trace.of("fault").next().expect("get_front is refused");
    assert_eq!(text(&fault["message"]), "`get_front` is not built into this firmware");
}
