//! Every instruction without memory against another core, and programs that try one thing each.

use std::time::Duration;

use bittybuzz_chips::{Board, Width};
use bittybuzz_emulation::message::Event;
use bittybuzz_emulation::{EmulatedRobot, Image, Pause};
use bittybuzz_zooids_board::Zooid;
use rp2040_emu::CortexM0Plus;

use crate::CortexM0;
use crate::bus::{Bus, FLASH, RAM};
use crate::exception::Lockup;
use crate::execute::Stop;
use crate::nvic::Nvic;
use crate::registers::{PC, Processor, SP};

/// Xorshift.
struct Random(u32);

impl Random {
    fn next(&mut self) -> u32 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 17;
        self.0 ^= self.0 << 5;
        self.0
    }

    /// Numbers at which carries and overflows begin are as probable as all others together.
    fn word(&mut self) -> u32 {
        let edges = [0, 1, 31, 32, 33, 0x7fff_ffff, 0x8000_0000, 0xffff_ffff];
        match self.next() % 16 {
            index @ 0..8 => edges[index as usize],
            _ => self.next(),
        }
    }
}

/// Instructions that touch no memory and cause no exception.
fn is_plain(first: u16) -> bool {
    match first {
        // Shifts to data processing; high registers but BX, BLX and what ARMv6-M calls unpredictable.
        0x0000..=0x43ff => true,
        0x4400..=0x46ff => {
            let (d, b) = (first & 7 | first >> 4 & 8, first >> 3 & 0xf);
            !(first >> 8 == 0x45 && (d < 8 && b < 8 || d == 15 || b == 15))
                && !(first >> 8 == 0x44 && d == 15 && b == 15)
                // The other core keeps two stack pointers in step only at exceptions.
                && d != 13
        }
        // ADR, ADD SP; SP up and down; extensions, reversals.
        0xa000..=0xafff | 0xb000..=0xb0ff | 0xb200..=0xb2ff => true,
        0xba00..=0xba7f | 0xbac0..=0xbaff => true,
        // Branches but UDF and SVC.
        0xd000..=0xddff | 0xe000..=0xe7ff => true,
        _ => false,
    }
}

#[test]
fn plain_instructions_do_what_another_core_does() {
    let mut random = Random(0x2f6e_2b1d);
    let mut bus: Bus<Zooid> = Bus::new(0);
    let mut other = CortexM0Plus::new();
    for first in (0..=0xffff).filter(|first| is_plain(*first)) {
        bus.write_memory(FLASH + 0x100, &first.to_le_bytes()).unwrap();
        for _ in 0..6 {
            let mut core = Processor::new(RAM + 0x1000, FLASH + 0x100);
            for register in 0..15 {
                core.r[register] = if register == SP { RAM + 0x1000 } else { random.word() };
                other.set_reg(register, core.r[register]);
            }
            // Not both N and Z.
            let flags = [0, 1 << 31, 1 << 30][random.next() as usize % 3] | random.next() & 3 << 28;
            core.set_flags(flags);
            other.regs.xpsr = flags | 1 << 24;
            other.regs.msp = RAM + 0x1000;
            other.set_reg(PC, FLASH + 0x100);
            bus.deadline = bus.cycles + 1;
            let before = (core.r, flags);
            core.run(&mut bus).unwrap();
            other.execute_one(first);
            for register in 0..16 {
                let (here, there) = (core.r[register], other.reg(register));
                assert_eq!(here, there, "{first:#06x}: r{register}, from {before:x?}");
            }
            let psr = core.xpsr(&bus);
            assert_eq!(psr >> 28, other.regs.xpsr >> 28, "{first:#06x}: flags, from {before:x?}");
        }
    }
}

/// Any halfword, but most access memory or branch.
fn instruction(random: &mut Random) -> u16 {
    let half = random.next() as u16;
    match random.next() % 16 {
        // LDR and STR of all widths by r4, in the RAM, or r5, a timer.
        0..4 => 0x6000 | half & 0x1fc7 | (4 + (half >> 15)) << 3,
        // The timer's count.
        4 => 0x6a68 | half & 7,
        5 => 0xb400 | half & 0x9ff,
        6 => 0xc400 | half & 0x8ff,
        // Conditional branches over a few.
        7 | 8 => 0xd000 | half & 0x0d07,
        // Literals.
        9 => 0x4800 | half & 0x71f,
        10 | 11 => half,
        _ => half & 0x3fff,
    }
}

/// Runs for `cycles`, up to each deadline that `step` gives.
fn run_for(
    core: &mut Processor,
    bus: &mut Bus<Zooid>,
    cycles: u64,
    step: u64,
) -> Result<Stop, Lockup> {
    let end = bus.cycles + cycles;
    while bus.cycles < end {
        bus.deadline = end.min(bus.cycles + step);
        match core.run(bus) {
            Ok(Stop::Deadline) => {}
            stop => return stop,
        }
    }
    Ok(Stop::Deadline)
}

#[test]
fn straight_lines_do_what_their_instructions_do_one_by_one() {
    const PROGRAM: u32 = FLASH + 0x100;
    let mut random = Random(0x9b1c_77a1);
    let mut buses = [0; 2].map(|_| {
        let mut bus: Bus<Zooid> = Bus::new(0);
        // A HardFault goes on in the program.
        bus.write_memory(FLASH + 12, &(PROGRAM + 1).to_le_bytes()).unwrap();
        // TIM2 has a clock and counts.
        bus.write_word(0x4002_101c, 1).unwrap();
        bus.write_word(0x4000_0000, 1).unwrap();
        bus
    });
    let mut executed = 0;
    for number in 0..4000 {
        let mut code: Vec<u8> =
            (0..40).flat_map(|_| instruction(&mut random).to_le_bytes()).collect();
        code.extend(0xe7d6_u16.to_le_bytes());
        let registers: [u32; 15] = std::array::from_fn(|register| match register {
            4 => RAM + 0x800,
            5 => 0x4000_0000,
            SP => RAM + 0x1000,
            _ => random.word(),
        });
        let after = [0, 1].map(|way| {
            let bus = &mut buses[way];
            bus.write_memory(PROGRAM, &code).unwrap();
            bus.nvic = Nvic::new();
            let mut core = Processor::new(RAM + 0x1000, PROGRAM);
            core.r[..15].copy_from_slice(&registers);
            let stop = run_for(&mut core, bus, 150, [150, 1][way]);
            let (timer, flags) = (bus.board.read(0x4000_0024, Width::Word), core.xpsr(bus));
            (stop, core.r, flags, core.primask, core.instructions, bus.cycles, timer)
        });
        executed += after[0].4;
        assert_eq!(after[0], after[1], "program {number}: {code:x?}");
        assert!(buses[0].ram == buses[1].ram, "program {number}: {code:x?}");
    }
    assert!(executed > 40_000, "{executed}");
}

type Robot = EmulatedRobot<CortexM0<Zooid>>;

/// Where programs begin.
const CODE: usize = 0xc0;
const STACK: u32 = RAM + 0x1000;

/// A robot about to run `code`; exceptions and where their handlers are, counted from the code.
fn robot(vectors: &[(usize, u32)], code: &[u16]) -> Robot {
    let mut table = vec![0_u8; CODE];
    table[..4].copy_from_slice(&STACK.to_le_bytes());
    for (exception, handler) in vectors {
        let address = (FLASH + CODE as u32 + handler) | 1;
        table[4 * exception..4 * exception + 4].copy_from_slice(&address.to_le_bytes());
    }
    table.extend(code.iter().flat_map(|half| half.to_le_bytes()));
    Robot::load(0, &Image::of_flash(FLASH, table)).unwrap()
}

fn run(robot: &mut Robot, micros: u64) -> Pause {
    robot.run(Duration::from_micros(micros)).unwrap()
}

fn words(robot: &mut Robot, count: usize) -> Vec<u32> {
    let mut bytes = vec![0; 4 * count];
    robot.read_memory(RAM, &mut bytes).unwrap();
    bytes.chunks_exact(4).map(|word| u32::from_le_bytes(word.try_into().unwrap())).collect()
}

#[test]
fn instructions_take_the_manuals_cycles() {
    // 1000 times subs, bne: 1 + 3 cycles; the last branch 1.
    let mut robot = robot(
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
    // Until the store: 2 + 4 * 1000 - 2 + 3 cycles of 8 MHz, and the store's two.
    run(&mut robot, 500);
    assert_ne!(words(&mut robot, 1), [1]);
    run(&mut robot, 501);
    assert_eq!(words(&mut robot, 1), [1]);
}

#[test]
fn a_line_that_is_longer_than_any_budget_is_executed_too() {
    let mut code = vec![0xbf00; 20_000]; // nop
    // movs r0, #1; movs r1, #0x20; lsls r1, r1, #24; str r0, [r1]; b .
    code.extend([0x2001, 0x2120, 0x0609, 0x6008, 0xe7fe]);
    let mut robot = robot(&[(1, 0)], &code);
    // 20,005 cycles of 8 MHz.
    run(&mut robot, 2_500);
    assert_eq!(robot.statistics().instructions, 20_000);
    assert_ne!(words(&mut robot, 1), [1]);
    run(&mut robot, 2_501);
    assert_eq!(words(&mut robot, 1), [1]);
}

#[test]
fn several_registers_go_to_memory_and_come_back() {
    let mut robot = robot(
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
    let mut stacked = [0; 12];
    robot.read_memory(STACK - 12, &mut stacked).unwrap();
    let stacked: Vec<_> =
        stacked.chunks_exact(4).map(|word| u32::from_le_bytes(word.try_into().unwrap())).collect();
    assert_eq!(stacked, [0x11, 0x22, FLASH + CODE as u32 + 13]);
    assert_eq!(robot.core().processor.r[SP], STACK);
    assert_eq!(robot.core().processor.r[7], RAM + 24);
}

#[test]
fn more_urgent_interrupts_nest_and_equal_ones_wait() {
    // Interrupt 0 (priority 0x80) pends 1 (0x40) and 2 (0x80); each appends its number, 0 before and after.
    let mut robot = robot(
        &[(1, 0), (16, 0x1a), (17, 0x2e), (18, 0x36)],
        &[
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
            0xbf00, // nop
            0xe7fe, // b .
            // 0x1a: interrupt 0
            0x200a, // movs r0, #10
            0x7038, // strb r0, [r7]
            0x3701, // adds r7, #1
            0x2006, // movs r0, #6
            0x6030, // str r0, [r6]
            0xbf00, // nop
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
    );
    run(&mut robot, 100);
    let mut bytes = [0; 4];
    robot.read_memory(RAM, &mut bytes).unwrap();
    assert_eq!(bytes, [10, 1, 11, 2]);
    assert_eq!(robot.statistics().exceptions, 3);
    assert_eq!(robot.core().processor.r[SP], STACK);
}

#[test]
fn what_is_not_allowed_is_a_hard_fault_and_one_within_a_lockup() {
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
    let mut robot = robot(&[(1, 0), (3, 6)], &code);
    assert_eq!(run(&mut robot, 100), Pause::Lockup);
    assert_eq!(words(&mut robot, 1), [FLASH + CODE as u32 + 2]);
    let events = robot.take_events();
    assert!(matches!(events[..], [ref event] if matches!(event.event, Event::Lockup { .. })));
}

#[test]
fn a_full_stack_is_a_hard_fault() {
    // A push below the RAM, and a handler that takes another stack.
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
    let mut robot = robot(&[(1, 0), (3, 0xa)], &code);
    assert_eq!(run(&mut robot, 100), Pause::Time);
    assert_eq!(words(&mut robot, 1), [RAM + 0x800]);
}

#[test]
fn the_watchdog_ends_a_lockup() {
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
    let mut robot = robot(&[(1, 0), (3, 8)], &code);
    assert_eq!(run(&mut robot, 409_000), Pause::Time);
    assert_eq!(run(&mut robot, 420_000), Pause::Time);
    let reset = Event::Reset { cause: "independent_watchdog".into() };
    assert!(robot.take_events().iter().any(|event| event.event == reset));
}

#[test]
fn a_page_is_erased_and_programmed() {
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
    let mut robot = robot(&[(1, 0)], &code);
    robot.write_memory(0x0800_fc00, &[1, 2, 3, 4]).unwrap();
    run(&mut robot, 29_000);
    assert_ne!(words(&mut robot, 1), [0x005a_ffff], "erasing takes 30 ms");
    run(&mut robot, 31_000);
    // SR: EOP.
    assert_eq!(words(&mut robot, 2), [0x005a_ffff, 1 << 5]);
}

#[test]
fn a_program_that_changes_itself_does_what_it_then_is() {
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
    let mut robot = robot(&[(1, 0)], &code);
    robot.write_memory(0x0800_fc00, &[0x07, 0x20, 0x70, 0x47]).unwrap();
    run(&mut robot, 1_000);
    assert_eq!(words(&mut robot, 2), [7, 5]);
}
