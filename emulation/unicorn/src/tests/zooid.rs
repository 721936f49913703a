//! What is different for a Zooid's Cortex-M0.

use std::time::Duration;

use bittybuzz_emulation::{EmulatedRobot, Image};
use bittybuzz_zooids_board::Zooid;

use crate::UnicornCore;
use crate::core::{FLASH, SRAM};

type Robot = EmulatedRobot<UnicornCore<'static, Zooid>>;

/// Where code begins, counted from the vectors.
const CODE: u32 = 0xc0;

/// A robot about to run `code`; exceptions and where their handlers are, counted from the code.
fn robot(vectors: &[(usize, u32)], code: &[u16]) -> Robot {
    let mut table = vec![0_u8; CODE as usize];
    table[..4].copy_from_slice(&(SRAM + 0x1000).to_le_bytes());
    for (exception, handler) in vectors {
        let address = (FLASH + CODE + handler) | 1;
        table[4 * exception..4 * exception + 4].copy_from_slice(&address.to_le_bytes());
    }
    table.extend(code.iter().flat_map(|half| half.to_le_bytes()));
    Robot::load(0, &Image::of_flash(FLASH, table)).unwrap()
}

fn words(robot: &mut Robot, count: usize) -> Vec<u32> {
    let mut bytes = vec![0; 4 * count];
    robot.read_memory(SRAM, &mut bytes).unwrap();
    bytes.chunks_exact(4).map(|word| u32::from_le_bytes(word.try_into().unwrap())).collect()
}

/// Stores the marker 0x77 from HardFault.
const HANDLER: [u16; 5] = [
    0x2077, // movs r0, #0x77
    0x2120, // movs r1, #0x20
    0x0609, // lsls r1, r1, #24
    0x6008, // str r0, [r1]
    0xe7fe, // b .
];

#[test]
fn instructions_that_armv6m_lacks_are_hard_faults() {
    for lacking in [
        [0xb108, 0xbf00], // cbz
        [0xbf08, 0xbf00], // it eq
        [0xf240, 0x0001], // movw
        [0xfbb0, 0xf0f1], // udiv
        [0xf3af, 0x8002], // wfe.w
    ] {
        let code = [&lacking[..], &[0xe7fe], &HANDLER].concat();
        let mut robot = robot(&[(1, 0), (3, 6)], &code);
        robot.run(Duration::from_micros(100)).unwrap();
        assert_eq!(words(&mut robot, 1), [0x77], "{lacking:x?}");
    }
}

#[test]
fn a_push_below_the_ram_is_a_hard_fault() {
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
    robot.run(Duration::from_micros(100)).unwrap();
    assert_eq!(words(&mut robot, 1), [SRAM + 0x800]);
}

#[test]
fn priorities_have_two_bits_and_vtor_does_not_exist() {
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
    let mut robot = robot(&[(1, 0)], &code);
    robot.run(Duration::from_micros(100)).unwrap();
    assert_eq!(words(&mut robot, 3), [0xc0c0_c0c0, 0x410c_c200, 0]);
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
    robot.run(Duration::from_millis(29)).unwrap();
    assert_ne!(words(&mut robot, 1), [0x005a_ffff], "erasing takes 30 ms");
    robot.run(Duration::from_millis(31)).unwrap();
    // SR: EOP.
    assert_eq!(words(&mut robot, 2), [0x005a_ffff, 1 << 5]);
}
