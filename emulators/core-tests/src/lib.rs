//! Thumb programs that try one thing each, with results from the manuals: the same for every core that plays a Cortex-M0.
//!
//! A function is a test of a core; `tests/cores.rs` says which core passes which. They run under a Zooid's board.

#![allow(clippy::missing_panics_doc, reason = "tests panic when they fail")]

use std::time::Duration;

use bittybuzz_emulation::message::EmulatorEvent;
use bittybuzz_emulation::{Core, EmulatedRobot, FirmwareImage, Pause};
use bittybuzz_zooids_board::ZooidBoard;

/// A core under a Zooid's board.
pub trait ZooidCore: Core<Board = ZooidBoard> {}

impl<C: Core<Board = ZooidBoard>> ZooidCore for C {}

/// First address of the flash of every STM32.
pub const FLASH: u32 = 0x0800_0000;
/// First address of the RAM.
pub const RAM: u32 = 0x2000_0000;
/// Offset of a program's code from its vector table, which has room for all interrupts of an STM32F405.
pub const CODE: u32 = 0x400;
/// The stack pointer of a program at its start.
pub const STACK: u32 = RAM + 0x1800;

/// A position-independent program.
#[derive(Clone, Copy, Debug)]
pub struct Program<'a> {
    /// Exceptions and the offsets of their handlers from [`CODE`].
    pub vectors: &'a [(usize, u32)],
    /// The halfwords of the machine code.
    pub code: &'a [u16],
}

/// Returns a robot that is about to run `program`, whose vector table is at `vectors`.
pub fn robot_at<C: Core>(vectors: u32, program: &Program<'_>) -> EmulatedRobot<C> {
    let mut table = vec![0_u8; CODE as usize];
    table[..4].copy_from_slice(&STACK.to_le_bytes());
    for (exception, handler) in program.vectors {
        let address = (vectors + CODE + handler) | 1;
        table[4 * exception..4 * exception + 4].copy_from_slice(&address.to_le_bytes());
    }
    table.extend(program.code.iter().flat_map(|half| half.to_le_bytes()));
    EmulatedRobot::load(0, &FirmwareImage::of_flash(vectors, table)).expect("the core starts")
}

fn robot<C: Core>(vectors: &[(usize, u32)], code: &[u16]) -> EmulatedRobot<C> {
    robot_at(FLASH, &Program { vectors, code })
}

/// Runs until this number of microseconds since power-on.
pub fn run<C: Core>(robot: &mut EmulatedRobot<C>, micros: u64) -> Pause {
    robot.run(Duration::from_micros(micros)).expect("the core works")
}

/// Returns bytes of the RAM from this offset on.
pub fn bytes<C: Core>(robot: &mut EmulatedRobot<C>, offset: u32, count: usize) -> Vec<u8> {
    let mut bytes = vec![0; count];
    robot.read_memory(RAM + offset, &mut bytes).expect("there is RAM");
    bytes
}

/// Returns words of the RAM from this offset on.
pub fn words_at<C: Core>(robot: &mut EmulatedRobot<C>, offset: u32, count: usize) -> Vec<u32> {
    let bytes = bytes(robot, offset, 4 * count);
    bytes.as_chunks().0.iter().copied().map(u32::from_le_bytes).collect()
}

fn words<C: Core>(robot: &mut EmulatedRobot<C>, count: usize) -> Vec<u32> {
    words_at(robot, 0, count)
}

/// STM, LDM, PUSH and POP.
pub fn several_registers_go_to_memory_and_come_back<C: ZooidCore>() {
    let mut robot = robot::<C>(
        &[(1, 0)],
        &[
            0x2720, // movs r7, #0x20
            0x063f, // lsls r7, r7, #24: 0x20000000
            0x2411, // movs r4, #0x11
            0x2522, // movs r5, #0x22
            0xf000, 0xf802, // bl 1f
            0xc7b0, // stm r7!, {r4, r5, r7}
            0xe7fe, // b .
            0xb530, // 1: push {r4, r5, lr}
            0x2433, // movs r4, #0x33
            0x2544, // movs r5, #0x44
            0xc730, // stm r7!, {r4, r5}
            0x3f04, // subs r7, #4
            0xcf04, // ldm r7!, {r2}
            0x603a, // str r2, [r7]
            0x3704, // adds r7, #4
            0xbd30, // pop {r4, r5, pc}
        ],
    );
    run(&mut robot, 100);
    assert_eq!(words(&mut robot, 6), [0x33, 0x44, 0x44, 0x11, 0x22, RAM + 12]);
    let stacked = words_at(&mut robot, STACK - 12 - RAM, 3);
    assert_eq!(stacked, [0x11, 0x22, FLASH + CODE + 13]);
}

/// Interrupt 0 (priority 0x80) pends interrupts 1 (0x40) and 2 (0x80). Each handler appends its number
/// to the log at the beginning of the RAM; that of interrupt 0 appends 10 before and 11 after.
pub const PRIORITIES: Program<'_> = Program {
    vectors: &[(1, 0), (16, 0x1a), (17, 0x2e), (18, 0x36)],
    code: &[
        0x2720, // movs r7, #0x20
        0x063f, // lsls r7, r7, #24: 0x20000000
        0x4810, // ldr r0, =0xe000e100
        0x2107, // movs r1, #7
        0x6001, // str r1, [r0]
        0x4810, // ldr r0, =0xe000e400
        0x4910, // ldr r1, =0x00804080
        0x6001, // str r1, [r0]
        0x4e10, // ldr r6, =0xe000e200
        0x2001, // movs r0, #1
        0x6030, // str r0, [r6]
        0xe7ff, // b 1f: interrupts are seen between Unicorn's blocks; 1:
        0xe7fe, // b .
        // 0x1a: interrupt 0
        0x200a, // movs r0, #10
        0x7038, // strb r0, [r7]
        0x3701, // adds r7, #1
        0x2006, // movs r0, #6
        0x6030, // str r0, [r6]
        0xe7ff, // b 1f: interrupts are seen between Unicorn's blocks; 1:
        0x200b, // movs r0, #11
        0x7038, // strb r0, [r7]
        0x3701, // adds r7, #1
        0x4770, // bx lr
        // 0x2e: interrupt 1
        0x2001, // movs r0, #1
        0x7038, // strb r0, [r7]
        0x3701, // adds r7, #1
        0x4770, // bx lr
        // 0x36: interrupt 2
        0x2002, // movs r0, #2
        0x7038, // strb r0, [r7]
        0x3701, // adds r7, #1
        0x4770, // bx lr
        0xbf00, 0xbf00, 0xbf00, 0xbf00, 0xbf00, // 0x3e to 0x47
        0xe100, 0xe000, // 0x48
        0xe400, 0xe000, // 0x4c
        0x4080, 0x0080, // 0x50
        0xe200, 0xe000, // 0x54
    ],
};
/// Content of the log after [`PRIORITIES`].
pub const PRIORITIES_LOG: [u8; 4] = [10, 1, 11, 2];

/// Priorities of interrupts that the program pends itself.
pub fn more_urgent_interrupts_nest_and_equal_ones_wait<C: ZooidCore>() {
    let mut robot = robot_at::<C>(FLASH, &PRIORITIES);
    run(&mut robot, 100);
    assert_eq!(bytes(&mut robot, 0, 4), PRIORITIES_LOG);
}

/// An access that is not aligned, which a Cortex-M0 does not allow.
pub fn an_unaligned_access_is_a_hard_fault_and_a_second_fault_a_lockup<C: ZooidCore>() {
    // ldr from 2 * 0x10000001, which is not aligned; the handler stores the stacked PC and executes UDF.
    let code = [
        0x4804, // ldr r0, =0x20000001
        0x6801, // ldr r1, [r0]
        0xe7fe, // b .
        0x9806, // 6: ldr r0, [sp, #24]
        0x2120, // movs r1, #0x20
        0x0609, // lsls r1, r1, #24
        0x6008, // str r0, [r1]
        0xde00, // udf
        0xbf00, 0xbf00, // 0x10
        0x0001, 0x2000, // 0x14
    ];
    let mut robot = robot::<C>(&[(1, 0), (3, 6)], &code);
    assert_eq!(run(&mut robot, 100), Pause::Lockup);
    assert_eq!(words(&mut robot, 1), [FLASH + CODE + 2]);
    let events = robot.take_events();
    assert!(
        matches!(events[..], [ref event] if matches!(event.event, EmulatorEvent::Lockup { .. }))
    );
}

/// PUSH below the RAM, and a handler that takes another stack.
pub fn a_full_stack_is_a_hard_fault<C: ZooidCore>() {
    let code = [
        0x2020, // movs r0, #0x20
        0x0600, // lsls r0, r0, #24
        0x4685, // mov sp, r0
        0xb501, // push {r0, lr}
        0xe7fe, // b .
        0x4902, // 0xa: ldr r1, =0x20000800
        0x468d, // mov sp, r1
        0x6001, // str r1, [r0]
        0xe7fe, // b .
        0xbf00, // 0x12
        0x0800, 0x2000, // 0x14
    ];
    let mut robot = robot::<C>(&[(1, 0), (3, 0xa)], &code);
    assert_eq!(run(&mut robot, 100), Pause::Time);
    assert_eq!(words(&mut robot, 1), [RAM + 0x800]);
}

/// The watchdog resets a core that is locked up.
pub fn the_watchdog_ends_a_lockup<C: ZooidCore>() {
    let code = [
        0x4803, // ldr r0, =0x40003000
        0x4904, // ldr r1, =0x0000cccc
        0x6001, // str r1, [r0]
        0xde00, // udf
        0xde00, // 8: udf
        0xbf00, 0xbf00, 0xbf00, // 0xa
        0x3000, 0x4000, // 0x10
        0xcccc, 0x0000, // 0x14
    ];
    let mut robot = robot::<C>(&[(1, 0), (3, 8)], &code);
    assert_eq!(run(&mut robot, 409_000), Pause::Time);
    assert_eq!(run(&mut robot, 420_000), Pause::Time);
    let reset = EmulatorEvent::Reset { cause: "independent_watchdog".into() };
    assert!(robot.take_events().iter().any(|event| event.event == reset));
}

/// The flash interface: 30 ms for a page, and a halfword.
pub fn a_page_is_erased_and_programmed<C: ZooidCore>() {
    // Unlocks the flash, erases the page at 0x0800fc00, programs a halfword, and reads it back.
    let code = [
        0x4c0d, // ldr r4, =0x40022000
        0x480e, // ldr r0, =0x45670123
        0x6060, // str r0, [r4, #4]
        0x480e, // ldr r0, =0xcdef89ab
        0x6060, // str r0, [r4, #4]
        0x2002, // movs r0, #2 (PER)
        0x6120, // str r0, [r4, #16]
        0x4d0d, // ldr r5, =0x0800fc00
        0x6165, // str r5, [r4, #20]
        0x2042, // movs r0, #0x42 (PER, STRT)
        0x6120, // str r0, [r4, #16]
        0x2001, // movs r0, #1 (PG)
        0x6120, // str r0, [r4, #16]
        0x205a, // movs r0, #0x5a
        0x8068, // strh r0, [r5, #2]
        0x6829, // ldr r1, [r5]
        0x2620, // movs r6, #0x20
        0x0636, // lsls r6, r6, #24
        0x6031, // str r1, [r6]
        0x68e1, // ldr r1, [r4, #12]
        0x6071, // str r1, [r6, #4]
        0xe7fe, // b .
        0xbf00, 0xbf00, 0xbf00, 0xbf00, 0xbf00, 0xbf00, // 0x2c
        0x2000, 0x4002, // 0x38
        0x0123, 0x4567, // 0x3c
        0x89ab, 0xcdef, // 0x40
        0xfc00, 0x0800, // 0x44
    ];
    let mut robot = robot::<C>(&[(1, 0)], &code);
    robot.write_memory(0x0800_fc00, &[1, 2, 3, 4]).expect("the core works");
    run(&mut robot, 29_000);
    assert_ne!(words(&mut robot, 1), [0x005a_ffff], "erasing takes 30 ms");
    run(&mut robot, 31_000);
    // SR: EOP.
    assert_eq!(words(&mut robot, 2), [0x005a_ffff, 1 << 5]);
}

/// Code in flash that the program changes after it was executed.
pub fn self_modified_code_is_executed<C: ZooidCore>() {
    // Calls 0x0800fc00 (movs r0, #7; bx lr), makes 0 of its first halfword (movs r0, r0) and calls it with 5.
    let code = [
        0x4c09, // ldr r4, =0x40022000
        0x480a, // ldr r0, =0x45670123
        0x6060, // str r0, [r4, #4]
        0x480a, // ldr r0, =0xcdef89ab
        0x6060, // str r0, [r4, #4]
        0x2001, // movs r0, #1 (PG)
        0x6120, // str r0, [r4, #16]
        0x4d09, // ldr r5, =0x0800fc01
        0x2620, // movs r6, #0x20
        0x0636, // lsls r6, r6, #24
        0x47a8, // blx r5
        0x6030, // str r0, [r6]
        0x1e69, // subs r1, r5, #1
        0x2000, // movs r0, #0
        0x8008, // strh r0, [r1]
        0x2005, // movs r0, #5
        0x47a8, // blx r5
        0x6070, // str r0, [r6, #4]
        0xe7fe, // b .
        0xbf00, // 0x26
        0x2000, 0x4002, // 0x28
        0x0123, 0x4567, // 0x2c
        0x89ab, 0xcdef, // 0x30
        0xfc01, 0x0800, // 0x34
    ];
    let mut robot = robot::<C>(&[(1, 0)], &code);
    robot.write_memory(0x0800_fc00, &[0x07, 0x20, 0x70, 0x47]).expect("the core works");
    run(&mut robot, 1_000);
    assert_eq!(words(&mut robot, 2), [7, 5]);
}

/// Stores the marker 0x77 from HardFault.
const HANDLER: [u16; 5] = [
    0x2077, // movs r0, #0x77
    0x2120, // movs r1, #0x20
    0x0609, // lsls r1, r1, #24
    0x6008, // str r0, [r1]
    0xe7fe, // b .
];

/// Instructions of ARMv7-M.
pub fn instructions_that_armv6m_lacks_are_hard_faults<C: ZooidCore>() {
    for lacking in [
        [0xb108, 0xbf00], // cbz
        [0xbf08, 0xbf00], // it eq
        [0xf240, 0x0001], // movw
        [0xfbb0, 0xf0f1], // udiv
        [0xf3af, 0x8002], // wfe.w
    ] {
        let code = [&lacking[..], &[0xe7fe], &HANDLER].concat();
        let mut robot = robot::<C>(&[(1, 0), (3, 6)], &code);
        run(&mut robot, 100);
        assert_eq!(words(&mut robot, 1), [0x77], "{lacking:x?}");
    }
}

/// Registers that differ from those of ARMv7-M.
pub fn priorities_have_two_bits_and_vtor_does_not_exist<C: ZooidCore>() {
    let code = [
        0x4806, // ldr r0, =0xe000e400
        0x4907, // ldr r1, =0xffffffff
        0x6001, // str r1, [r0]
        0x6802, // ldr r2, [r0]
        0x4807, // ldr r0, =0xe000ed00
        0x6803, // ldr r3, [r0]
        0x6081, // str r1, [r0, #8]
        0x6884, // ldr r4, [r0, #8]
        0x2520, // movs r5, #0x20
        0x062d, // lsls r5, r5, #24
        0xc51c, // stmia r5!, {r2, r3, r4}
        0xe7fe, // b .
        0xbf00, 0xbf00, // 0x18
        0xe400, 0xe000, // 0x1c
        0xffff, 0xffff, // 0x20
        0xbf00, 0xbf00, // 0x24
        0xed00, 0xe000, // 0x28
    ];
    let mut robot = robot::<C>(&[(1, 0)], &code);
    run(&mut robot, 100);
    assert_eq!(words(&mut robot, 3), [0xc0c0_c0c0, 0x410c_c200, 0]);
}

/// UDF, and UDF in the handler of HardFault.
pub fn a_fault_in_the_hard_fault_handler_locks_up<C: ZooidCore>() {
    let mut robot = robot::<C>(&[(1, 0), (3, 2)], &[0xde00, 0xde00]);
    assert_eq!(run(&mut robot, 100), Pause::Lockup);
    let events = robot.take_events();
    assert!(
        matches!(events[..], [ref event] if matches!(event.event, EmulatorEvent::Lockup { .. }))
    );
}

/// The cycles of instructions (Cortex-M0 Technical Reference Manual, table 3-1).
pub fn instructions_take_the_manuals_cycles<C: ZooidCore>() {
    // 1000 turns of subs and bne take 1 + 3 cycles each; the last branch takes 1.
    let mut robot = robot::<C>(
        &[(1, 0)],
        &[
            0x20fa, // movs r0, #250
            0x0080, // lsls r0, r0, #2
            0x3801, // 1: subs r0, #1
            0xd1fd, // bne 1b
            0x2001, // movs r0, #1
            0x2120, // movs r1, #0x20
            0x0609, // lsls r1, r1, #24
            0x6008, // str r0, [r1]
            0xe7fe, // b .
        ],
    );
    // The time until the store is 2 + 4 * 1000 - 2 + 3 cycles of 8 MHz, and the store's two.
    run(&mut robot, 500);
    assert_ne!(words(&mut robot, 1), [1]);
    run(&mut robot, 501);
    assert_eq!(words(&mut robot, 1), [1]);
}

/// Code without branches for longer than a turn of the core.
pub fn a_line_that_is_longer_than_any_budget_is_executed_too<C: ZooidCore>() {
    let mut code = vec![0xbf00; 20_000]; // nop
    // movs r0, #1; movs r1, #0x20; lsls r1, r1, #24; str r0, [r1]; b .
    code.extend([0x2001, 0x2120, 0x0609, 0x6008, 0xe7fe]);
    let mut robot = robot::<C>(&[(1, 0)], &code);
    // 20,005 cycles of 8 MHz.
    run(&mut robot, 2_500);
    assert_eq!(robot.statistics().instructions, 20_000);
    assert_ne!(words(&mut robot, 1), [1]);
    run(&mut robot, 2_501);
    assert_eq!(words(&mut robot, 1), [1]);
}
