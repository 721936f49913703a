//! Tests of every instruction without memory against another core, and of straight lines against
//! single steps. emulators/core-tests has programs that test one feature each.

mod recorded;

use bittybuzz_chips::{Board, CoreKind, Random, Width};
use bittybuzz_cortex_m::Nvic;
use bittybuzz_zooids_board::ZooidBoard;

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
fn plain_instructions_equal_another_core() {
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
fn straight_lines_equal_single_steps() {
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
