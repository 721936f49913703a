//! Tests of QEMU as a core, with a firmware that covers the relevant features (image/firmware.rs).
//! Expected results are from the manuals. Needs qemu-system-arm, and the target
//! thumbv7em-none-eabihf of rust-toolchain.toml.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::OnceLock;
use std::time::Duration;

use bittybuzz_emulation::message::{self, EmulatorEvent};
use bittybuzz_emulation::{ClientError, Emulator, Pause, RunResult};

const PROGRAM: &str = env!("CARGO_BIN_EXE_bbz-emulate-qemu");
/// Addresses as in image/firmware.rs.
const CASE: u32 = 0x0802_0000;
const RESULTS: u32 = 0x2000_5000;

/// Returns the path of the firmware, which is built once.
fn image() -> &'static Path {
    static IMAGE: OnceLock<PathBuf> = OnceLock::new();
    IMAGE.get_or_init(|| {
        let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/image");
        let image = Path::new(env!("CARGO_TARGET_TMPDIR")).join("core-image");
        let mut script = std::ffi::OsString::from("link-arg=-T");
        script.push(source.join("link.x"));
        let status = Command::new(std::env::var_os("RUSTC").unwrap_or("rustc".into()))
            .args(["--edition=2024", "--crate-type=bin", "--target=thumbv7em-none-eabihf"])
            // Without --nmagic the ELF header is loaded too, before the vector table.
            .args(["-Copt-level=2", "-Cpanic=abort", "-Clink-arg=--nmagic", "-C"])
            .arg(script)
            .arg("-o")
            .arg(&image)
            .arg(source.join("firmware.rs"))
            .status()
            .expect("rustc starts");
        assert!(status.success(), "is the target thumbv7em-none-eabihf installed?");
        image
    })
}

/// Starts a robot that will run `case`.
fn robot(case: u32) -> Emulator {
    let mut robot = Emulator::spawn(Path::new(PROGRAM)).expect("the program starts");
    robot.load(image()).expect("the image is loaded");
    robot.write(CASE, &case.to_le_bytes()).expect("flash can be written");
    robot
}

fn run(robot: &mut Emulator, millis: u64) -> RunResult {
    robot.run(Duration::from_millis(millis)).expect("the core runs")
}

fn results(robot: &mut Emulator) -> Vec<u32> {
    let bytes = robot.read(RESULTS, 64).expect("RAM can be read");
    bytes.chunks_exact(4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect()
}

/// Returns the results of `case` after `millis`.
fn play(case: u32, millis: u64) -> Vec<u32> {
    let mut robot = robot(case);
    run(&mut robot, millis);
    results(&mut robot)
}

/// Returns the times and causes of resets.
fn resets(run: &RunResult) -> Vec<(Duration, String)> {
    let cause = |event: &EmulatorEvent| match event {
        EmulatorEvent::Reset { cause } => Some(cause.clone()),
        _ => None,
    };
    run.events.iter().filter_map(|event| Some((event.at, cause(&event.event)?))).collect()
}

#[test]
fn loads_and_stores_reach_the_registers() {
    let results = play(0, 1);
    let expected = [
        0x8182_8384, // word
        0x84,        // byte
        0xffff_ff84, // signed byte
        0xffff_8384, // signed half-word
        0x8182_8384, // word with write-back,
        0x34,        // which moved the base
        0x1234_5678, // two words,
        0x8182_8384,
        0x1234_5678, // and as a list
        0x8182_8384,
        0x8182_8384, // the first half of an IT block, not the second
        1,
    ];
    assert_eq!(results[..12], expected, "{results:#x?}");
}

#[test]
fn wfe_waits_for_the_manuals_events() {
    let results = play(1, 5);
    // Interrupts at 1, 2, 3 and 4 ms of TIM5; it was started some microseconds after power-on.
    assert_eq!(results[0], 4);
    for (index, &micros) in results[1..=4].iter().enumerate() {
        let compare = 1000 * (index as u32 + 1);
        assert!((compare..compare + 10).contains(&micros), "{micros}");
    }
    assert!(results[9] < 20, "an event from the past does not wait: {}", results[9]);
    // An exception's return sets the event register too (B1.5.18), so each interrupt ends one WFE or two.
    assert!((4..=8).contains(&results[10]), "{}", results[10]);
}

#[test]
fn a_busy_core_is_interrupted_on_time() {
    let results = play(2, 5);
    assert_eq!(results[0], 4);
    for (index, &micros) in results[1..=4].iter().enumerate() {
        let compare = 1000 * (index as u32 + 1);
        // Some ten instructions of 62.5 ns until the handler reads the counter.
        assert!((compare..compare + 5).contains(&micros), "{micros}");
    }
    // 16 000 instructions in a millisecond, three in the loop; before the last interrupt four of them, less
    // some handlers and the start.
    assert!((21_000..=21_334).contains(&results[14]), "{}", results[14]);
    assert_eq!(play(2, 5), results, "a run repeats exactly");
}

#[test]
fn software_resets_the_chip() {
    let mut robot = robot(3);
    let run = run(&mut robot, 5);
    let causes: Vec<_> = resets(&run).into_iter().map(|(_, cause)| cause).collect();
    assert_eq!(causes, ["software", "software"]);
    let results = results(&mut robot);
    assert_eq!(results[1], 3, "RAM keeps its content");
    assert_ne!(results[2] & 1 << 28, 0, "RCC_CSR.SFTRSTF (RM0090 6.3.21)");
}

#[test]
fn the_watchdog_resets_a_core_that_masks_interrupts() {
    let mut robot = robot(4);
    let run = run(&mut robot, 150);
    let [(at, cause)] = &resets(&run)[..] else { panic!("{:?}", run.events) };
    assert_eq!(cause, "independent_watchdog");
    // 800 periods of 32 kHz / 4 (RM0090 21.3.3), from some microseconds after power-on.
    let at = at.as_micros();
    assert!((100_000..100_200).contains(&at), "{at}");
    let results = results(&mut robot);
    assert_eq!(results[1], 2);
    assert_ne!(results[2] & 1 << 29, 0, "RCC_CSR.IWDGRSTF (RM0090 6.3.21)");
}

#[test]
fn a_fault_in_the_fault_handler_locks_up() {
    for case in [5, 6] {
        let mut robot = robot(case);
        let run = run(&mut robot, 10);
        assert!(
            matches!(
                run.events.last().map(|event| &event.event),
                Some(EmulatorEvent::Lockup { .. })
            ),
            "{:?}",
            run.events
        );
        assert_eq!(run.reason, Pause::Lockup);
        // A newly loaded image starts from the beginning.
        robot.load(image()).unwrap();
        robot.write(CASE, &2u32.to_le_bytes()).unwrap();
        assert_eq!(self::run(&mut robot, 2).reason, Pause::Time);
        assert_eq!(results(&mut robot)[0], 1);
    }
}

#[test]
fn core_coupled_memory_is_there() {
    let mut robot = robot(7);
    robot.write(0x1000_0100, b"buzz").unwrap();
    run(&mut robot, 1);
    assert_eq!(results(&mut robot)[1..5], [0x0123_4567, 0x01ff_4567, 3, 0x1111]);
    assert_eq!(robot.read(0x1000_0000, 4).unwrap(), [0x67, 0x45, 0xff, 0x01]);
    assert_eq!(robot.read(0x1000_0100, 4).unwrap(), b"buzz");
}

#[test]
fn missing_features_of_the_bridge_are_reported() {
    let mut robot = robot(8);
    let run = run(&mut robot, 1);
    let [event] = &run.events[..] else { panic!("{:?}", run.events) };
    assert!(
        matches!(&event.event, EmulatorEvent::HardwareError { text } if text.contains("SysTick"))
    );

    let mut robot = self::robot(9);
    match robot.run(Duration::from_millis(1)) {
        Err(ClientError::Refused(text)) => assert!(text.contains("floating-point"), "{text}"),
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_skipped_function_returns_at_once() {
    assert_eq!(play(10, 1)[1..3], [2, 1]);
    let mut robot = robot(10);
    robot.execute(&message::Command::Skip { symbol: "change_result".into() }).unwrap();
    run(&mut robot, 1);
    assert_eq!(results(&mut robot)[1..3], [1, 1]);
}

#[test]
fn wfi_ends_with_a_masked_interrupt() {
    let results = play(11, 3);
    assert!((1000..1010).contains(&results[9]), "{}", results[9]);
    assert_eq!(results[10..12], [0, 1], "the handler runs when it is allowed to");
}

#[test]
fn memory_that_is_not_there_is_an_error() {
    let mut robot = robot(0);
    for address in [0x2002_0000, 0x1001_0000, 0x0810_0000, 0x4000_0000] {
        assert!(matches!(robot.read(address, 4), Err(ClientError::Refused(_))), "{address:#x}");
        assert!(matches!(robot.write(address, &[0]), Err(ClientError::Refused(_))), "{address:#x}");
    }
}

#[test]
fn without_qemu_the_reply_names_the_package() {
    let mut program = Command::new(PROGRAM)
        .env("PATH", "")
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .expect("the program starts");
    let load = message::Command::Load { elf: image().into() };
    let line = serde_json::to_string(&load).expect("a command is JSON") + "\n";
    let mut input = program.stdin.take().expect("a pipe");
    input.write_all(line.as_bytes()).expect("the program reads");
    drop(input);
    let output = program.wait_with_output().expect("the program ends");
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(text.contains("install the package qemu-system-arm"), "{text}");
}
