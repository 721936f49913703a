//! Small programs for a Cortex-M4, assembled by hand: their vectors and their code.

use bittybuzz_core_tests::Program;

/// Fills registers, pends interrupt 0, and stores the registers after its return. The handler
/// changes registers that the procedure call standard lets it change.
pub const FLOAT: Program<'_> = Program {
    vectors: &[(1, 0x0), (16, 0x6e)],
    code: &[
        0x4824, // ldr r0, =0xe000ed88
        0xf44f, 0x0170, // mov r1, #0xf00000
        0x6001, // str r1, [r0]
        0xf3bf, 0x8f4f, // dsb
        0xf3bf, 0x8f6f, // isb
        0x4821, // ldr r0, =0xe000e100
        0x2101, // movs r1, #1
        0x6001, // str r1, [r0]
        0xeeb7, 0x0a00, // vmov.f32 s0, #1.0
        0xeef0, 0x3a00, // vmov.f32 s7, #2.0
        0xeef0, 0x7a08, // vmov.f32 s15, #3.0
        0xeef1, 0xfa00, // vmov.f32 s31, #4.0
        0xf04f, 0x0111, // mov r1, #0x11
        0xf04f, 0x0222, // mov r2, #0x22
        0xf04f, 0x0333, // mov r3, #0x33
        0xf04f, 0x0ccc, // mov r12, #0xcc
        0x2444, // movs r4, #0x44
        0x2c44, // cmp r4, #0x44
        0x4818, // ldr r0, =0xe000e200
        0xf04f, 0x0501, // mov r5, #1
        0x6005, // str r5, [r0]
        0xf3bf, 0x8f4f, // dsb
        0xf3bf, 0x8f6f, // isb
        0xf04f, 0x5700, // ldr r7, =0x20000000
        0xed87, 0x0a00, // vstr s0, [r7]
        0xedc7, 0x3a01, // vstr s7, [r7, #4]
        0xedc7, 0x7a02, // vstr s15, [r7, #8]
        0xedc7, 0xfa03, // vstr s31, [r7, #12]
        0xf107, 0x0610, // add r6, r7, #16
        0xe886, 0x100e, // stmia r6, {r1, r2, r3, r12}
        0xf3ef, 0x8500, // mrs r5, apsr
        0x6135, // str r5, [r6, #16]
        0xe7fe, // 1: b 1b
        // isr:
        0x480c, // ldr r0, =0x20000100
        0xf8c0, 0xe000, // str lr, [r0]
        0xf04f, 0x0100, // mov r1, #0
        0xf04f, 0x0200, // mov r2, #0
        0xf04f, 0x0300, // mov r3, #0
        0xf04f, 0x0c00, // mov r12, #0
        0xeeb1, 0x0a04, // vmov.f32 s0, #5.0
        0xeef1, 0x3a08, // vmov.f32 s7, #6.0
        0xee70, 0x7a23, // vadd.f32 s15, s0, s7
        0x2201, // movs r2, #1
        0x4770, // bx lr
        0xed88, 0xe000, // .word 0xe000ed88
        0xe100, 0xe000, // .word 0xe000e100
        0xe200, 0xe000, // .word 0xe000e200
        0x0100, 0x2000, // .word 0x20000100
    ],
};

/// Pends interrupt 0 (priority 0x80) under PRIMASK, under BASEPRI 0x80 and under BASEPRI 0x90, and
/// writes to the log before and after.
pub const MASKS: Program<'_> = Program {
    vectors: &[(1, 0x0), (16, 0x5e)],
    code: &[
        0xf04f, 0x5700, // ldr r7, =0x20000000
        0x4818, // ldr r0, =0xe000e100
        0x2101, // movs r1, #1
        0x6001, // str r1, [r0]
        0x4818, // ldr r0, =0xe000e400
        0x2180, // movs r1, #0x80
        0x6001, // str r1, [r0]
        0x4e17, // ldr r6, =0xe000e200
        0x2501, // movs r5, #1
        0xb672, // cpsid i
        0x6035, // str r5, [r6]
        0xf000, 0xf81d, // bl note
        0xb662, // cpsie i
        0xf3bf, 0x8f6f, // isb
        0xf000, 0xf818, // bl note
        0x2180, // movs r1, #0x80
        0xf381, 0x8811, // msr basepri, r1
        0x6035, // str r5, [r6]
        0xf000, 0xf812, // bl note
        0x2100, // movs r1, #0
        0xf381, 0x8811, // msr basepri, r1
        0xf3bf, 0x8f6f, // isb
        0xf000, 0xf80b, // bl note
        0x2190, // movs r1, #0x90
        0xf381, 0x8811, // msr basepri, r1
        0x6035, // str r5, [r6]
        0xf3bf, 0x8f4f, // dsb
        0xf3bf, 0x8f6f, // isb
        0xf000, 0xf801, // bl note
        0xe7fe, // 1: b 1b
        // note:
        0x2009, // movs r0, #9
        0x7038, // strb r0, [r7]
        0x3701, // adds r7, #1
        0x4770, // bx lr
        // isr:
        0x2001, // movs r0, #1
        0x7038, // strb r0, [r7]
        0x3701, // adds r7, #1
        0x4770, // bx lr
        0x0000, // bx lr
        0xe100, 0xe000, // .word 0xe000e100
        0xe400, 0xe000, // .word 0xe000e400
        0xe200, 0xe000, // .word 0xe000e200
    ],
};

/// Reads from an address without memory. The handler stores the stacked return address and the
/// fault registers of SCB.
pub const BAD_ACCESS: Program<'_> = Program {
    vectors: &[(1, 0x0), (3, 0x8)],
    code: &[
        0x4909, // ldr r1, =0x60000010
        0xbf00, // nop
        0x6808, // ldr r0, [r1]
        0xe7fe, // 1: b 1b
        // hard:
        0xf04f, 0x5700, // ldr r7, =0x20000000
        0x9806, // ldr r0, [sp, #24]
        0x6038, // str r0, [r7]
        0x4906, // ldr r1, =0xe000ed28
        0x6808, // ldr r0, [r1]
        0x6078, // str r0, [r7, #4]
        0x6848, // ldr r0, [r1, #4]
        0x60b8, // str r0, [r7, #8]
        0x6908, // ldr r0, [r1, #16]
        0x60f8, // str r0, [r7, #12]
        0xf3ef, 0x8005, // mrs r0, ipsr
        0x6138, // str r0, [r7, #16]
        0xe7fe, // 2: b 2b
        0x0000, // 2: b 2b
        0x0010, 0x6000, // .word 0x60000010
        0xed28, 0xe000, // .word 0xe000ed28
    ],
};

/// Executes an undefined instruction, and another one in the HardFault handler.
pub const LOCKUP: Program<'_> = Program {
    vectors: &[(1, 0x0), (3, 0x2)],
    code: &[
        0xde01, // udf #1
        // hard:
        0xf04f, 0x5700, // ldr r7, =0x20000000
        0x9806, // ldr r0, [sp, #24]
        0x6038, // str r0, [r7]
        0xde02, // udf #2
    ],
};

/// Has a stack that ends at the beginning of RAM. The HardFault handler selects another stack
/// before it calls a function.
pub const OVERFLOW: Program<'_> = Program {
    vectors: &[(1, 0x0), (3, 0x18), (16, 0x30)],
    code: &[
        0x480c, // ldr r0, =0x10000010
        0x4685, // mov sp, r0
        0x480c, // ldr r0, =0xe000e100
        0x2101, // movs r1, #1
        0x6001, // str r1, [r0]
        0x480c, // ldr r0, =0xe000e200
        0x6001, // str r1, [r0]
        0xf3bf, 0x8f4f, // dsb
        0xf3bf, 0x8f6f, // isb
        0xe7fe, // 1: b 1b
        // hard:
        0x4809, // ldr r0, =0x20010000
        0x4685, // mov sp, r0
        0xf000, 0xf801, // bl store
        0xe7fe, // 2: b 2b
        // store:
        0xb510, // push {r4, lr}
        0xf04f, 0x5700, // ldr r7, =0x20000000
        0x4906, // ldr r1, =0xe000ed28
        0x6808, // ldr r0, [r1]
        0x6038, // str r0, [r7]
        0xbd10, // pop {r4, pc}
        // isr:
        0x4770, // bx lr
        0x0000, // bx lr
        0x0010, 0x1000, // .word 0x10000010
        0xe100, 0xe000, // .word 0xe000e100
        0xe200, 0xe000, // .word 0xe000e200
        0x0000, 0x2001, // .word 0x20010000
        0xed28, 0xe000, // .word 0xe000ed28
    ],
};

/// SysTick fires every 1600 cycles. The program waits for its own event, then twice for the timer,
/// and logs the number of ticks.
pub const EVENTS: Program<'_> = Program {
    vectors: &[(1, 0x0), (15, 0x38)],
    code: &[
        0xf04f, 0x5700, // ldr r7, =0x20000000
        0x2600, // movs r6, #0
        0x480d, // ldr r0, =0xe000e010
        0xf240, 0x613f, // ldr r1, =1599
        0x6041, // str r1, [r0, #4]
        0x6086, // str r6, [r0, #8]
        0x2107, // movs r1, #7
        0x6001, // str r1, [r0]
        0xbf40, // sev
        0xbf20, // wfe
        0x703e, // strb r6, [r7, #0]
        0xbf20, // wfe
        0x707e, // strb r6, [r7, #1]
        0xbf20, // wfe
        0x70be, // strb r6, [r7, #2]
        0xbf20, // wfe
        0x70fe, // strb r6, [r7, #3]
        0xb672, // cpsid i
        0xbf30, // wfi
        0x713e, // strb r6, [r7, #4]
        0xb662, // cpsie i
        0xf3bf, 0x8f6f, // isb
        0x717e, // strb r6, [r7, #5]
        0xbf30, // 1: wfi
        0xe7fd, // b 1b
        // tick:
        0x3601, // adds r6, #1
        0x4770, // bx lr
        0xe010, 0xe000, // .word 0xe000e010
    ],
};

/// Runs its thread on the process stack and executes SVC, whose handler stores both stack pointers.
pub const STACKS: Program<'_> = Program {
    vectors: &[(1, 0x0), (11, 0x22), (14, 0x42)],
    code: &[
        0xf04f, 0x5700, // ldr r7, =0x20000000
        0x4813, // ldr r0, =0x20001000
        0xf380, 0x8809, // msr psp, r0
        0x2002, // movs r0, #2
        0xf380, 0x8814, // msr control, r0
        0xf3bf, 0x8f6f, // isb
        0xb081, // sub sp, #4
        0x205a, // movs r0, #0x5a
        0xdf07, // svc #7
        0x6138, // str r0, [r7, #16]
        0x4668, // mov r0, sp
        0x6178, // str r0, [r7, #20]
        0xe7fe, // 1: b 1b
        // svc:
        0xf3ef, 0x8109, // mrs r1, psp
        0x6039, // str r1, [r7]
        0x4669, // mov r1, sp
        0x6079, // str r1, [r7, #4]
        0xf8c7, 0xe008, // str lr, [r7, #8]
        0x4a09, // ldr r2, =0xe000ed04
        0xf04f, 0x5180, // mov r1, #0x10000000
        0x6011, // str r1, [r2]
        0xf3bf, 0x8f4f, // dsb
        0xf3bf, 0x8f6f, // isb
        0x4770, // bx lr
        // pendsv:
        0xf3ef, 0x8105, // mrs r1, ipsr
        0x60f9, // str r1, [r7, #12]
        0xf3ef, 0x8109, // mrs r1, psp
        0x6808, // ldr r0, [r1]
        0x3001, // adds r0, #1
        0x6008, // str r0, [r1]
        0x4770, // bx lr
        0x1000, 0x2000, // .word 0x20001000
        0xed04, 0xe000, // .word 0xe000ed04
    ],
};

/// Counts its starts at 0x20000000. If RCC_CSR shows no software reset, the count is set to 1 and a
/// reset is requested; otherwise the count is incremented.
pub const RESET: Program<'_> = Program {
    vectors: &[(1, 0x0)],
    code: &[
        0xf04f, 0x5700, // ldr r7, =0x20000000
        0x4807, // ldr r0, =0x40023874
        0x6801, // ldr r1, [r0]
        0xf011, 0x5f80, // tst r1, #0x10000000
        0xd105, // bne 2f
        0x2201, // movs r2, #1
        0x603a, // str r2, [r7]
        0x4805, // ldr r0, =0xe000ed0c
        0x4905, // ldr r1, =0x05fa0004
        0x6001, // str r1, [r0]
        0xe7fe, // 1: b 1b
        0x683a, // ldr r2, [r7]
        0x3201, // adds r2, #1
        0x603a, // str r2, [r7]
        0xe7fe, // 3: b 3b
        0x0000, // 3: b 3b
        0x3874, 0x4002, // .word 0x40023874
        0xed0c, 0xe000, // .word 0xe000ed0c
        0x0004, 0x05fa, // .word 0x05fa0004
    ],
};

/// Executes a thousand turns of four instructions, then sleeps for ever.
pub const LOOP: Program<'_> = Program {
    vectors: &[(1, 0x0)],
    code: &[
        0xf44f, 0x707a, // mov r0, #1000
        0xf501, 0x3180, // 1: add r1, r1, #0x10000
        0x3201, // adds r2, #1
        0x3801, // subs r0, #1
        0xd1fa, // bne 1b
        0xbf30, // wfi
    ],
};

/// Starts the independent watchdog with a period of 4 ms and locks up; after the reset it stores RCC_CSR.
pub const WATCHDOG: Program<'_> = Program {
    vectors: &[(1, 0x0), (3, 0x22)],
    code: &[
        0xf04f, 0x5700, // ldr r7, =0x20000000
        0x4808, // ldr r0, =0x40023874
        0x6801, // ldr r1, [r0]
        0xf011, 0x5f00, // tst r1, #0x20000000
        0xd10a, // bne 2f
        0x4807, // ldr r0, =0x40003000
        0xf245, 0x5155, // ldr r1, =0x5555
        0x6001, // str r1, [r0]
        0x211f, // movs r1, #31
        0x6081, // str r1, [r0, #8]
        0xf64c, 0x41cc, // ldr r1, =0xcccc
        0x6001, // str r1, [r0]
        0xde01, // udf #1
        // hard:
        0xde02, // udf #2
        0x6039, // 2: str r1, [r7]
        0xe7fe, // 3: b 3b
        0x3874, 0x4002, // .word 0x40023874
        0x3000, 0x4000, // .word 0x40003000
    ],
};

/// Stores to the unique id, to an address without memory and to the device area. The handler logs the
/// address and the return address, and skips the instruction.
pub const BAD_STORES: Program<'_> = Program {
    vectors: &[(1, 0x0), (3, 0x1e)],
    code: &[
        0xf04f, 0x5700, // ldr r7, =0x20000000
        0x490b, // ldr r1, =0x1fff7a13
        0xf04f, 0x42e0, // ldr r2, =0x70000000
        0x4b0b, // ldr r3, =0x50070004
        0x2600, // movs r6, #0
        0x700e, // strb r6, [r1]
        0x3601, // adds r6, #1
        0x6096, // str r6, [r2, #8]
        0x3601, // adds r6, #1
        0x601e, // str r6, [r3]
        0x3601, // adds r6, #1
        0x603e, // str r6, [r7]
        0xe7fe, // 1: b 1b
        // hard:
        0x4807, // ldr r0, =0xe000ed38
        0x6800, // ldr r0, [r0]
        0x6038, // str r0, [r7]
        0x9806, // ldr r0, [sp, #24]
        0x6078, // str r0, [r7, #4]
        0x60be, // str r6, [r7, #8]
        0x370c, // adds r7, #12
        0x3002, // adds r0, #2
        0x9006, // str r0, [sp, #24]
        0x4770, // bx lr
        0x0000, // bx lr
        0x7a13, 0x1fff, // .word 0x1fff7a13
        0x0004, 0x5007, // .word 0x50070004
        0xed38, 0xe000, // .word 0xe000ed38
    ],
};

/// Stores to the flash: a halfword through the alias at 0, a word with a new value of its address,
/// and two words at once. Logs the new address, the content of the flash, and FLASH_SR.
pub const FLASH_STORES: Program<'_> = Program {
    vectors: &[(1, 0x0)],
    code: &[
        0xf04f, 0x5700, // ldr r7, =0x20000000
        0x211a, // movs r1, #0x1a
        0x2055, // movs r0, #0x55
        0x8008, // strh r0, [r1]
        0x4a07, // ldr r2, =0x08000100
        0xf842, 0x0b04, // str r0, [r2], #4
        0xc209, // stmia r2!, {r0, r3}
        0x603a, // str r2, [r7]
        0x4b04, // ldr r3, =0x08000100
        0x685b, // ldr r3, [r3, #4]
        0x607b, // str r3, [r7, #4]
        0x880b, // ldrh r3, [r1]
        0x60bb, // str r3, [r7, #8]
        0x4c03, // ldr r4, =0x40023c00
        0x68e5, // ldr r5, [r4, #12]
        0x60fd, // str r5, [r7, #12]
        0xe7fe, // 1: b 1b
        0x0000, // the end of the code
        0x0100, 0x0800, // .word 0x08000100
        0x3c00, 0x4002, // .word 0x40023c00
    ],
};

/// Jumps to an address without memory, to a peripheral, and to an even address. The handler logs
/// the address and CFSR and returns to the caller.
pub const BAD_JUMPS: Program<'_> = Program {
    vectors: &[(1, 0x0), (3, 0x12)],
    code: &[
        0xf04f, 0x5700, // ldr r7, =0x20000000
        0x490b, // ldr r1, =0x30000001
        0x4a0c, // ldr r2, =0x40020001
        0x4b0c, // ldr r3, =0x08000400
        0x4788, // blx r1
        0x4790, // blx r2
        0x4798, // blx r3
        0xe7fe, // 1: b 1b
        // hard:
        0x9806, // ldr r0, [sp, #24]
        0x6038, // str r0, [r7]
        0x490a, // ldr r1, =0xe000ed28
        0x6808, // ldr r0, [r1]
        0x6008, // str r0, [r1]
        0x6078, // str r0, [r7, #4]
        0x3708, // adds r7, #8
        0x9805, // ldr r0, [sp, #20]
        0xf020, 0x0001, // bic r0, #1
        0x9006, // str r0, [sp, #24]
        0x9807, // ldr r0, [sp, #28]
        0xf040, 0x7080, // orr r0, #0x1000000
        0x9007, // str r0, [sp, #28]
        0x4770, // bx lr
        0x0000, // bx lr
        0x0001, 0x3000, // .word 0x30000001
        0x0001, 0x4002, // .word 0x40020001
        0x0400, 0x0800, // .word 0x08000400
        0xed28, 0xe000, // .word 0xe000ed28
    ],
};

/// Stores to eight pages for the first time, each within an if-then block, and counts after each.
pub const IF_THEN: Program<'_> = Program {
    vectors: &[(1, 0x0)],
    code: &[
        0xf04f, 0x5700, // ldr r7, =0x20000000
        0x4c09, // ldr r4, =0x20001000
        0x2508, // movs r5, #8
        0x2600, // movs r6, #0
        0x4620, // 1: mov r0, r4
        0xf000, 0xf807, // bl store
        0x3601, // adds r6, #1
        0xf504, 0x5480, // add r4, r4, #0x1000
        0x3d01, // subs r5, #1
        0xd1f7, // bne 1b
        0x603e, // str r6, [r7]
        0xe7fe, // 2: b 2b
        // store:
        0x4280, // cmp r0, r0
        0xbf04, // itt eq
        0x6005, // streq r5, [r0]
        0x2101, // moveq r1, #1
        0x2900, // cmp r1, #0
        0x4770, // bx lr
        0x0000, // bx lr
        0x1000, 0x2000, // .word 0x20001000
    ],
};

/// Pushes until the stack leaves RAM. The HardFault handler selects another stack before it calls a
/// function.
pub const PUSH_OVERFLOW: Program<'_> = Program {
    vectors: &[(1, 0x0), (3, 0x8)],
    code: &[
        0x4807, // ldr r0, =0x10000008
        0x4685, // mov sp, r0
        0xb430, // 1: push {r4, r5}
        0xe7fd, // b 1b
        // hard:
        0x4806, // ldr r0, =0x20010000
        0x4685, // mov sp, r0
        0xf000, 0xf801, // bl store
        0xe7fe, // 2: b 2b
        // store:
        0xb510, // push {r4, lr}
        0xf04f, 0x5700, // ldr r7, =0x20000000
        0x4903, // ldr r1, =0xe000ed28
        0x6808, // ldr r0, [r1]
        0x6038, // str r0, [r7]
        0xbd10, // pop {r4, pc}
        0x0008, 0x1000, // .word 0x10000008
        0x0000, 0x2001, // .word 0x20010000
        0xed28, 0xe000, // .word 0xe000ed28
    ],
};
