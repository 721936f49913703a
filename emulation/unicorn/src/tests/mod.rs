//! Tests of the core against the ARMv7-M Architecture Reference Manual, with programs that test one
//! feature each.

mod programs;

use std::time::Duration;

use bittybuzz_core_tests::{
    CODE, FLASH, PRIORITIES, PRIORITIES_LOG, Program, STACK, bytes, robot_at, run, words_at,
};
use bittybuzz_crazyflie_board::CrazyflieBoard;
use bittybuzz_emulation::message::EmulatorEvent;
use bittybuzz_emulation::{EmulatedRobot, Pause};

use crate::UnicornCore;

type Robot = EmulatedRobot<UnicornCore<'static, CrazyflieBoard>>;

const APPLICATION: u32 = FLASH + 0x4000;

fn robot(program: &Program<'_>) -> Robot {
    robot_at(FLASH, program)
}

#[test]
fn an_interrupt_preserves_registers_flags_and_floats() {
    let mut robot = robot(&programs::FLOAT);
    assert_eq!(run(&mut robot, 100), Pause::Time);
    let floats = [1.0_f32, 2.0, 3.0, 4.0].map(f32::to_bits);
    assert_eq!(words_at(&mut robot, 0, 4), floats);
    assert_eq!(words_at(&mut robot, 16, 4), [0x11, 0x22, 0x33, 0xcc]);
    assert_eq!(words_at(&mut robot, 32, 1), [0x6000_0000], "Z and C of the comparison");
    assert_eq!(words_at(&mut robot, 0x100, 1), [0xffff_ffe9], "thread, main stack, extended frame");
}

#[test]
fn more_urgent_interrupts_nest_and_equal_ones_wait() {
    let mut robot = robot(&PRIORITIES);
    run(&mut robot, 100);
    assert_eq!(bytes(&mut robot, 0, 4), PRIORITIES_LOG);
    assert_eq!(robot.statistics().exceptions, 3);
}

#[test]
fn primask_and_basepri_hold_interrupts_back() {
    let mut robot = robot(&programs::MASKS);
    run(&mut robot, 100);
    assert_eq!(bytes(&mut robot, 0, 8), [9, 1, 9, 9, 1, 9, 1, 9]);
    // The core runs at 16 MHz. The longer of the two spans is from MSR to MSR: STR, BL, MOVS, STRB,
    // ADDS, BX, MOVS, MSR.
    assert_eq!(robot.statistics().longest_masked, Duration::from_nanos(8 * 1000 / 16));
}

#[test]
fn a_bad_access_is_a_hard_fault() {
    let mut robot = robot(&programs::BAD_ACCESS);
    assert_eq!(run(&mut robot, 100), Pause::Time);
    let load = FLASH + CODE + 4;
    // CFSR: PRECISERR and BFARVALID; HFSR: FORCED.
    assert_eq!(words_at(&mut robot, 0, 5), [load, 0x8200, 0x4000_0000, 0x6000_0010, 3]);
}

#[test]
fn a_bad_store_stops_at_its_instruction() {
    let mut robot = robot(&programs::BAD_STORES);
    assert_eq!(run(&mut robot, 100), Pause::Time);
    let first = words_at(&mut robot, 4, 1)[0];
    // Each entry has the address, the return address, and the number of the other instructions that
    // were executed.
    let logged = words_at(&mut robot, 0, 9);
    assert_eq!(logged[..3], [0x1fff_7a13, first, 0]);
    assert_eq!(logged[3..6], [0x7000_0008, first + 4, 1]);
    assert_eq!(logged[6..], [0x5007_0004, first + 8, 2]);
    assert_eq!(words_at(&mut robot, 36, 1), [3]);
}

#[test]
fn a_store_to_the_flash_is_reported_and_ignored() {
    let mut robot = robot(&programs::FLASH_STORES);
    assert_eq!(run(&mut robot, 100), Pause::Time);
    // PGSERR is bit 7 of FLASH_SR.
    assert_eq!(words_at(&mut robot, 0, 4), [0x0800_010c, 0, 0, 0x80]);
    let events: Vec<EmulatorEvent> =
        robot.take_events().into_iter().map(|event| event.event).collect();
    let is_report = |event: &EmulatorEvent| matches!(event, EmulatorEvent::HardwareError { text } if text.contains("0x0000001a"));
    assert_eq!(events.iter().filter(|event| is_report(event)).count(), 1, "{events:?}");
    assert_eq!(robot.statistics().exceptions, 0);
}

#[test]
fn bad_jumps_set_the_fault_bit_of_their_cause() {
    let mut robot = robot(&programs::BAD_JUMPS);
    assert_eq!(run(&mut robot, 100), Pause::Time);
    let logged = words_at(&mut robot, 0, 6);
    // CFSR: IBUSERR, IACCVIOL, INVSTATE.
    assert_eq!(logged, [0x3000_0000, 1 << 8, 0x4002_0000, 1 << 0, 0x0800_0400, 1 << 17]);
}

#[test]
fn a_fault_in_the_hard_fault_handler_locks_up() {
    let mut robot = robot(&programs::LOCKUP);
    assert_eq!(run(&mut robot, 100), Pause::Lockup);
    assert_eq!(words_at(&mut robot, 0, 1), [FLASH + CODE]);
    let events = robot.take_events();
    // UDF, then MOV.W, LDR and STR of the handler.
    let lockup = EmulatorEvent::Lockup { pc: FLASH + CODE + 2 + 4 + 2 + 2 };
    assert!(matches!(&events[..], [event] if event.event == lockup), "{events:?}");
}

#[test]
fn an_exception_without_a_vector_table_locks_up() {
    // No bootloader starts the program there, and VTOR is 0: the flash below the program is erased.
    let mut robot: Robot = robot_at(APPLICATION + 0x4000, &PRIORITIES);
    assert_eq!(run(&mut robot, 100), Pause::Lockup);
}

#[test]
fn the_bootloader_sets_the_vector_table_and_overwrites_memory() {
    let mut robot: Robot = robot_at(APPLICATION, &PRIORITIES);
    // The bootloader's .bss, and the two ends of the RAM that it may use.
    let cleared = bytes(&mut robot, 0x14, 0x2864);
    assert!(cleared.iter().all(|&byte| byte == 0));
    let kept = bytes(&mut robot, 0x5000, 0x100);
    assert!(kept.iter().any(|&byte| byte != 0));
    run(&mut robot, 100);
    assert_eq!(bytes(&mut robot, 0, 4), PRIORITIES_LOG);
}

#[test]
fn a_stack_that_overflows_memory_is_a_hard_fault() {
    let mut robot = robot(&programs::OVERFLOW);
    assert_eq!(run(&mut robot, 100), Pause::Time);
    assert_eq!(words_at(&mut robot, 0, 1), [0x1000], "CFSR: STKERR");
}

#[test]
fn a_full_stack_is_a_hard_fault_that_may_take_another_stack() {
    let mut robot = robot(&programs::PUSH_OVERFLOW);
    assert_eq!(run(&mut robot, 100), Pause::Time);
    // CFSR: BFARVALID and PRECISERR of PUSH, STKERR of the frame.
    assert_eq!(words_at(&mut robot, 0, 1), [0x9200]);
}

#[test]
fn waiting_for_events_and_interrupts() {
    let mut robot = robot(&programs::EVENTS);
    // A tick is 1600 cycles of 16 MHz: 100 µs. The first WFE finds the event of SEV, the third one
    // that of the first tick's exception. WFI under PRIMASK wakes without a handler.
    run(&mut robot, 99);
    assert_eq!(bytes(&mut robot, 0, 1), [0]);
    run(&mut robot, 150);
    assert_eq!(bytes(&mut robot, 0, 3), [0, 1, 1]);
    run(&mut robot, 350);
    assert_eq!(bytes(&mut robot, 0, 6), [0, 1, 1, 2, 2, 3]);
    run(&mut robot, 1_000_000);
    // There are 10 000 ticks with the two instructions of the handler, B, and WFI.
    let instructions = robot.statistics().instructions;
    assert!((40_000..40_050).contains(&instructions), "{instructions}");
}

#[test]
fn thread_mode_has_a_stack_of_its_own() {
    let mut robot = robot(&programs::STACKS);
    run(&mut robot, 100);
    // The thread's stack pointer was 0x20000ffc; the frame is aligned to eight bytes and has eight
    // words.
    assert_eq!(words_at(&mut robot, 0, 3), [0x2000_0fd8, STACK, 0xffff_fffd]);
    assert_eq!(words_at(&mut robot, 12, 3), [14, 0x5b, 0x2000_0ffc]);
}

#[test]
fn a_reset_restarts_and_keeps_ram() {
    let mut robot = robot(&programs::RESET);
    run(&mut robot, 100);
    assert_eq!(words_at(&mut robot, 0, 1), [2]);
    let events = robot.take_events();
    let software = EmulatorEvent::Reset { cause: "software".into() };
    assert!(matches!(&events[..], [event] if event.event == software), "{events:?}");
}

#[test]
fn the_watchdog_ends_a_lockup() {
    let mut robot = robot(&programs::WATCHDOG);
    assert_eq!(run(&mut robot, 3_000), Pause::Time);
    assert_eq!(run(&mut robot, 5_000), Pause::Time);
    // RCC_CSR has the flags of the pin and the independent watchdog, and those of power-on.
    assert_eq!(words_at(&mut robot, 0, 1), [0x2e00_0000]);
    let reset = EmulatorEvent::Reset { cause: "independent_watchdog".into() };
    let events = robot.take_events();
    let event = events.iter().find(|event| event.event == reset).unwrap();
    // The watchdog expires after (RLR + 1) * 4 / 32 kHz, counted from its start after a few
    // instructions.
    assert_eq!(event.at.as_micros() / 100, 40);
}

#[test]
fn the_first_access_to_a_page_leaves_no_trace() {
    let mut robot = robot(&programs::IF_THEN);
    run(&mut robot, 1_000);
    assert_eq!(words_at(&mut robot, 0, 1), [8]);
}

#[test]
fn an_instruction_is_a_cycle() {
    let mut robot = robot(&programs::LOOP);
    run(&mut robot, 1_000);
    assert_eq!(robot.statistics().instructions, 1 + 4 * 1000 + 1);
}

#[test]
fn the_same_run_twice_is_the_same() {
    let outcome = || {
        let mut robot = robot(&programs::EVENTS);
        run(&mut robot, 12_345);
        (bytes(&mut robot, 0, 0x1_0000), robot.statistics())
    };
    assert_eq!(outcome(), outcome());
}
