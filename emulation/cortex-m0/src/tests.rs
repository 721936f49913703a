//! Tests of every instruction without memory against another core, and programs that test one
//! feature each.

mod recorded;

use std::time::Duration;

use bittybuzz_chips::{Board, CoreKind, Random, Width};
use bittybuzz_cortex_m::Nvic;
use bittybuzz_emulation::{EmulatedRobot, FirmwareImage, Pause};
use bittybuzz_zooids_board::ZooidBoard;

use crate::CortexM0;
use crate::bus::{Bus, FLASH, RAM};
use crate::exception::Lockup;
use crate::execute::CoreStop;
use crate::registers::{Processor, SP};

fn next(random: &mut Random) -> u32 {
    (random.bits() >> 32) as u32
}

/// Returns a random word. Values at which carries and overflows begin are as probable as all
/// others together.
fn word(random: &mut Random) -> u32 {
    let edges = [0, 1, 31, 32, 33, 0x7fff_ffff, 0x8000_0000, 0xffff_ffff];
    match next(random) % 16 {
        index @ 0..8 => edges[index as usize],
        _ => next(random),
    }
}

/// Returns true for instructions that access no memory and cause no exception.
fn is_plain(first: u16) -> bool {
    match first {
        // Shifts to data processing; high registers except BX, BLX and those that ARMv6-M calls
        // unpredictable.
        0x0000..=0x43ff => true,
        0x4400..=0x46ff => {
            let (d, b) = (first & 7 | first >> 4 & 8, first >> 3 & 0xf);
            !(first >> 8 == 0x45 && (d < 8 && b < 8 || d == 15 || b == 15))
                && !(first >> 8 == 0x44 && d == 15 && b == 15)
                // The recorded core updates its two stack pointers only at exceptions.
                && d != 13
        }
        // ADR, ADD SP; SP up and down; extensions, reversals.
        0xa000..=0xafff | 0xb000..=0xb0ff | 0xb200..=0xb2ff => true,
        0xba00..=0xba7f | 0xbac0..=0xbaff => true,
        // Branches, without UDF and SVC.
        0xd000..=0xddff | 0xe000..=0xe7ff => true,
        _ => false,
    }
}

/// Returns the digest of `words` after those of `digest` (FNV-1a with 32 bits).
fn digest_of(digest: u32, words: impl IntoIterator<Item = u32>) -> u32 {
    words
        .into_iter()
        .flat_map(u32::to_le_bytes)
        .fold(digest, |digest, byte| (digest ^ u32::from(byte)).wrapping_mul(0x0100_0193))
}

#[test]
fn plain_instructions_do_what_another_core_does() {
    let mut random = Random::new(0x2f6e_2b1d);
    let mut bus: Bus<ZooidBoard> = Bus::new(0);
    let mut digests = Vec::<(u16, u32)>::new();
    for first in (0..=0xffff).filter(|first| is_plain(*first)) {
        bus.write_memory(FLASH + 0x100, &first.to_le_bytes()).unwrap();
        if digests.last().is_none_or(|(upper, _)| *upper != first >> 8) {
            digests.push((first >> 8, 0x811c_9dc5));
        }
        for _ in 0..6 {
            let mut core = Processor::new(RAM + 0x1000, FLASH + 0x100);
            for register in 0..15 {
                core.r[register] = if register == SP { RAM + 0x1000 } else { word(&mut random) };
            }
            // N and Z are never both set.
            let flags =
                [0, 1 << 31, 1 << 30][next(&mut random) as usize % 3] | next(&mut random) & 3 << 28;
            core.set_flags(flags);
            bus.deadline = bus.cycles + 1;
            core.run(&mut bus).unwrap();
            let words = core.r.into_iter().chain([core.xpsr(&bus) >> 28]);
            let (_, digest) = digests.last_mut().unwrap();
            *digest = digest_of(*digest, words);
        }
    }
    assert_eq!(digests.len(), recorded::DIGESTS.len());
    for ((upper, digest), recorded) in digests.into_iter().zip(recorded::DIGESTS) {
        assert_eq!((upper, digest), recorded, "instructions {upper:#04x}00 to {upper:#04x}ff");
    }
}

/// Returns any halfword, but most of them access memory or branch.
fn instruction(random: &mut Random) -> u16 {
    let half = next(random) as u16;
    match next(random) % 16 {
        // LDR and STR of all widths; the base is r4 (in the RAM) or r5 (a timer).
        0..4 => 0x6000 | half & 0x1fc7 | (4 + (half >> 15)) << 3,
        // A load of the timer's count.
        4 => 0x6a68 | half & 7,
        5 => 0xb400 | half & 0x9ff,
        6 => 0xc400 | half & 0x8ff,
        // Conditional branches over a few instructions.
        7 | 8 => 0xd000 | half & 0x0d07,
        // Loads of literals.
        9 => 0x4800 | half & 0x71f,
        10 | 11 => half,
        _ => half & 0x3fff,
    }
}

/// Runs for `cycles` cycles, with a deadline every `step` cycles.
fn run_for(
    core: &mut Processor,
    bus: &mut Bus<ZooidBoard>,
    cycles: u64,
    step: u64,
) -> Result<CoreStop, Lockup> {
    let end = bus.cycles + cycles;
    while bus.cycles < end {
        bus.deadline = end.min(bus.cycles + step);
        match core.run(bus) {
            Ok(CoreStop::Deadline) => {}
            stop => return stop,
        }
    }
    Ok(CoreStop::Deadline)
}

#[test]
fn straight_lines_do_what_their_instructions_do_one_by_one() {
    const PROGRAM: u32 = FLASH + 0x100;
    let mut random = Random::new(0x9b1c_77a1);
    let mut buses = [0; 2].map(|_| {
        let mut bus: Bus<ZooidBoard> = Bus::new(0);
        // The HardFault handler is the program itself.
        bus.write_memory(FLASH + 12, &(PROGRAM + 1).to_le_bytes()).unwrap();
        // TIM2 has its clock and counts.
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
            _ => word(&mut random),
        });
        let after = [0, 1].map(|way| {
            let bus = &mut buses[way];
            bus.write_memory(PROGRAM, &code).unwrap();
            bus.nvic = Nvic::new(CoreKind::CortexM0);
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

type Robot = EmulatedRobot<CortexM0<ZooidBoard>>;

/// Offset of the programs in the flash.
const CODE: usize = 0xc0;
const STACK: u32 = RAM + 0x1000;

/// Returns a robot that is about to run `code`. `vectors` are exceptions and the offsets of their
/// handlers from the code.
fn robot(vectors: &[(usize, u32)], code: &[u16]) -> Robot {
    let mut table = vec![0_u8; CODE];
    table[..4].copy_from_slice(&STACK.to_le_bytes());
    for (exception, handler) in vectors {
        let address = (FLASH + CODE as u32 + handler) | 1;
        table[4 * exception..4 * exception + 4].copy_from_slice(&address.to_le_bytes());
    }
    table.extend(code.iter().flat_map(|half| half.to_le_bytes()));
    Robot::load(0, &FirmwareImage::of_flash(FLASH, table)).unwrap()
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
    // 1000 turns of subs and bne take 1 + 3 cycles each; the last branch takes 1.
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
    // The time until the store is 2 + 4 * 1000 - 2 + 3 cycles of 8 MHz, and the store's two.
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
