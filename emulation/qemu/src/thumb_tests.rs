//! The encodings are those that the GNU assembler 2.40 produces for the text next to them.

use super::*;
use Width::{Byte, Half, Word};

/// Register n holds 0x1000 * (n + 1).
fn registers() -> CoreRegisters {
    let mut registers = CoreRegisters::default();
    for (n, value) in registers.r.iter_mut().enumerate() {
        *value = 0x1000 * (n as u32 + 1);
    }
    registers
}

fn decoded(encoding: u32) -> Result<Access, DecodeError> {
    // Half-words as the assembler lists them: the first one on the left.
    let (first, second) =
        if encoding > 0xffff { (encoding >> 16, encoding & 0xffff) } else { (encoding, 0) };
    decode(first as u16, second as u16, &registers())
}

const LOAD: bool = true;
const STORE: bool = false;

#[test]
fn single_elements() {
    #[rustfmt::skip]
    let cases = [
        ("str r0, [r1, r2]",            0x5088,      STORE, Word, false, 0, 0x5000, None),
        ("strh r3, [r4, r5]",           0x5363,      STORE, Half, false, 3, 0xb000, None),
        ("strb r6, [r7, r0]",           0x543e,      STORE, Byte, false, 6, 0x9000, None),
        ("ldrsb r0, [r1, r2]",          0x5688,      LOAD,  Byte, true,  0, 0x5000, None),
        ("ldr r0, [r1, r2]",            0x5888,      LOAD,  Word, false, 0, 0x5000, None),
        ("ldrh r0, [r1, r2]",           0x5a88,      LOAD,  Half, false, 0, 0x5000, None),
        ("ldrb r0, [r1, r2]",           0x5c88,      LOAD,  Byte, false, 0, 0x5000, None),
        ("ldrsh r0, [r1, r2]",          0x5e88,      LOAD,  Half, true,  0, 0x5000, None),
        ("str r2, [r3, #124]",          0x67da,      STORE, Word, false, 2, 0x407c, None),
        ("ldr r2, [r3, #4]",            0x685a,      LOAD,  Word, false, 2, 0x4004, None),
        ("strb r2, [r3, #31]",          0x77da,      STORE, Byte, false, 2, 0x401f, None),
        ("ldrb r2, [r3, #1]",           0x785a,      LOAD,  Byte, false, 2, 0x4001, None),
        ("strh r2, [r3, #62]",          0x87da,      STORE, Half, false, 2, 0x403e, None),
        ("ldrh r2, [r3, #2]",           0x885a,      LOAD,  Half, false, 2, 0x4002, None),
        ("str r4, [sp, #1020]",         0x94ff,      STORE, Word, false, 4, 0xe3fc, None),
        ("ldr r4, [sp, #8]",            0x9c02,      LOAD,  Word, false, 4, 0xe008, None),
        ("str.w r9, [r10, #4095]",      0xf8ca_9fff, STORE, Word, false, 9, 0xbfff, None),
        ("ldr.w r9, [r10]",             0xf8da_9000, LOAD,  Word, false, 9, 0xb000, None),
        ("ldrb.w r9, [r10, #77]",       0xf89a_904d, LOAD,  Byte, false, 9, 0xb04d, None),
        ("ldrh.w r9, [r10, #78]",       0xf8ba_904e, LOAD,  Half, false, 9, 0xb04e, None),
        ("ldrsb.w r9, [r10, #79]",      0xf99a_904f, LOAD,  Byte, true,  9, 0xb04f, None),
        ("ldrsh.w r9, [r10, #80]",      0xf9ba_9050, LOAD,  Half, true,  9, 0xb050, None),
        ("strb.w r9, [r10, #81]",       0xf88a_9051, STORE, Byte, false, 9, 0xb051, None),
        ("strh.w r9, [r10, #82]",       0xf8aa_9052, STORE, Half, false, 9, 0xb052, None),
        ("ldr.w r1, [r2, #-4]",         0xf852_1c04, LOAD,  Word, false, 1, 0x2ffc, None),
        ("str.w r1, [r2, #-255]",       0xf842_1cff, STORE, Word, false, 1, 0x2f01, None),
        ("ldr.w r1, [r2, #8]!",         0xf852_1f08, LOAD,  Word, false, 1, 0x3008, Some((2, 0x3008))),
        ("ldr.w r1, [r2, #-8]!",        0xf852_1d08, LOAD,  Word, false, 1, 0x2ff8, Some((2, 0x2ff8))),
        ("str.w r1, [r2], #12",         0xf842_1b0c, STORE, Word, false, 1, 0x3000, Some((2, 0x300c))),
        ("str.w r1, [r2], #-12",        0xf842_190c, STORE, Word, false, 1, 0x3000, Some((2, 0x2ff4))),
        ("strh.w r1, [r2], #2",         0xf822_1b02, STORE, Half, false, 1, 0x3000, Some((2, 0x3002))),
        ("ldrsh.w r1, [r2], #2",        0xf932_1b02, LOAD,  Half, true,  1, 0x3000, Some((2, 0x3002))),
        ("ldrt r1, [r2, #16]",          0xf852_1e10, LOAD,  Word, false, 1, 0x3010, None),
        ("ldr.w r1, [r8, r2, lsl #3]",  0xf858_1032, LOAD,  Word, false, 1, 0x2_1000, None),
        ("strb.w r1, [r8, r2]",         0xf808_1002, STORE, Byte, false, 1, 0xc000, None),
        ("ldrsh.w r1, [r8, r2, lsl #1]",0xf938_1012, LOAD,  Half, true,  1, 0xf000, None),
        ("ldrex r1, [r2, #16]",         0xe852_1f04, LOAD,  Word, false, 1, 0x3010, None),
        ("ldrexb r1, [r2]",             0xe8d2_1f4f, LOAD,  Byte, false, 1, 0x3000, None),
        ("ldrexh r1, [r2]",             0xe8d2_1f5f, LOAD,  Half, false, 1, 0x3000, None),
    ];
    for (text, encoding, load, width, signed, register, address, writeback) in cases {
        let length = if encoding > 0xffff { 4 } else { 2 };
        let expected =
            Access { signed, writeback, ..Access::single(load, width, register, address, length) };
        assert_eq!(decoded(encoding), Ok(expected), "{text}");
    }
}

#[test]
fn store_exclusive_returns_its_status() {
    #[rustfmt::skip]
    let cases = [
        ("strex r0, r1, [r2, #16]", 0xe842_1004, Word, 0x3010),
        ("strexb r0, r1, [r2]",     0xe8c2_1f40, Byte, 0x3000),
        ("strexh r0, r1, [r2]",     0xe8c2_1f50, Half, 0x3000),
    ];
    for (text, encoding, width, address) in cases {
        let expected = Access { status: Some(0), ..Access::single(STORE, width, 1, address, 4) };
        assert_eq!(decoded(encoding), Ok(expected), "{text}");
    }
}

#[test]
fn several_elements() {
    #[rustfmt::skip]
    let cases = [
        ("ldrd r1, r9, [r2, #1020]", 0xe9d2_19ff, LOAD,  vec![1, 9],     0x33fc, None),
        ("ldrd r1, r9, [r2, #-8]",   0xe952_1902, LOAD,  vec![1, 9],     0x2ff8, None),
        ("strd r1, r9, [r2]",        0xe9c2_1900, STORE, vec![1, 9],     0x3000, None),
        ("strd r1, r9, [r2, #16]!",  0xe9e2_1904, STORE, vec![1, 9],     0x3010, Some((2, 0x3010))),
        ("ldrd r1, r9, [r2], #-16",  0xe872_1904, LOAD,  vec![1, 9],     0x3000, Some((2, 0x2ff0))),
        ("ldmia.w r9, {r1, r10}",    0xe899_0402, LOAD,  vec![1, 10],    0xa000, None),
        ("ldmia.w r9!, {r1, r10}",   0xe8b9_0402, LOAD,  vec![1, 10],    0xa000, Some((9, 0xa008))),
        ("stmdb r9!, {r1, r10}",     0xe929_0402, STORE, vec![1, 10],    0x9ff8, Some((9, 0x9ff8))),
        ("ldmdb r9, {r1, r10}",      0xe919_0402, LOAD,  vec![1, 10],    0x9ff8, None),
        ("push {r0, r7, lr}",        0xb581,      STORE, vec![0, 7, 14], 0xdff4, Some((13, 0xdff4))),
        ("pop {r0, r1}",             0xbc03,      LOAD,  vec![0, 1],     0xe000, Some((13, 0xe008))),
        ("stmia r3!, {r0, r1}",      0xc303,      STORE, vec![0, 1],     0x4000, Some((3, 0x4008))),
        ("ldmia r3!, {r0, r1}",      0xcb03,      LOAD,  vec![0, 1],     0x4000, Some((3, 0x4008))),
        ("ldmia r3, {r1, r3}",       0xcb0a,      LOAD,  vec![1, 3],     0x4000, None),
    ];
    for (text, encoding, load, list, address, writeback) in cases {
        let length = if encoding > 0xffff { 4 } else { 2 };
        let single = Access::single(load, Word, 0, address, length);
        let expected = Access { registers: list, writeback, ..single };
        assert_eq!(decoded(encoding), Ok(expected), "{text}");
    }
}

#[test]
fn undecodable_instructions_state_the_reason() {
    #[rustfmt::skip]
    let cases = [
        ("vldr s0, [r2]",      0xed92_0a00, DecodeError::FloatingPoint),
        ("vstr d1, [r2, #8]",  0xed82_1b02, DecodeError::FloatingPoint),
        ("vldmia r2!, {s0-s3}",0xecb2_0a04, DecodeError::FloatingPoint),
        ("vpush {d8}",         0xed2d_8b02, DecodeError::FloatingPoint),
        ("pop {r4, pc}",       0xbd10,      DecodeError::Jump),
        ("ldr.w pc, [r2, #4]", 0xf8d2_f004, DecodeError::Jump),
        ("tbb [r2, r3]",       0xe8d2_f003, DecodeError::Other),
        ("adds r0, r1, r2",    0x1888,      DecodeError::Other),
        ("bl .",               0xf7ff_fffe, DecodeError::Other),
        ("udf #0",             0xde00,      DecodeError::Other),
    ];
    for (text, encoding, error) in cases {
        assert_eq!(decoded(encoding), Err(error), "{text}");
    }
}

#[test]
fn loads_extend_as_they_are_named() {
    // A7.7.47 LDRB, A7.7.60 LDRSB, A7.7.56 LDRH, A7.7.64 LDRSH.
    assert_eq!(decoded(0xf89a_904d).unwrap().extended(0xffff_ff80), 0x80);
    assert_eq!(decoded(0xf99a_904f).unwrap().extended(0x80), 0xffff_ff80);
    assert_eq!(decoded(0xf8ba_904e).unwrap().extended(0xffff_8000), 0x8000);
    assert_eq!(decoded(0xf9ba_9050).unwrap().extended(0x8000), 0xffff_8000);
}

#[test]
fn no_encoding_panics() {
    for first in 0..=u16::MAX {
        for second in [0, 0x0fff, 0xf000, 0xffff, 0x1f4f, 0x0c00] {
            // The result is checked by other tests.
            let _ = decode(first, second, &registers());
        }
    }
}
