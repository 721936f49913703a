//! Operations on integers for which a Cortex-M0 has no instruction. The compiler's own functions are
//! made for speed and take 0.6 kB here.
//!
//! * Division (Run-time ABI for the Arm Architecture, 5.3.1): numerator and denominator, quotient and
//!   remainder. It takes about 300 cycles, one bit of the quotient after the other. The virtual
//!   machine divides the numbers of scripts by code of its own.
//! * The number of leading zeros, `__clzsi2` of LLVM.

use core::arch::global_asm;

global_asm!(
    r#"
    .syntax unified
    .section .text.division, "ax", %progbits
    .macro operation name
    .global \name
    .thumb_func
\name:
    .endm

    @ r0: numerator, later quotient; r1: denominator; r2: remainder; r3: bits that are left.
    operation __aeabi_uidiv
    operation __aeabi_uidivmod
    movs r2, #0
    movs r3, #32
0:  adds r0, r0, r0
    adcs r2, r2
    bcs 1f
    cmp r2, r1
    blo 2f
1:  subs r2, r2, r1
    adds r0, #1
2:  subs r3, #1
    bne 0b
    mov r1, r2
    bx lr

    @ The remainder has the sign of the numerator.
    operation __aeabi_idiv
    operation __aeabi_idivmod
    push {{r3, r4, r5, lr}}
    asrs r4, r0, #31
    asrs r5, r1, #31
    eors r0, r4
    subs r0, r0, r4
    eors r1, r5
    subs r1, r1, r5
    bl __aeabi_uidivmod
    eors r5, r4
    eors r0, r5
    subs r0, r0, r5
    eors r1, r4
    subs r1, r1, r4
    pop {{r3, r4, r5, pc}}

    @ r0: number, later the zeros; r1: zeros that are certain; r2: the least number with fewer.
    operation __clzsi2
    movs r1, #28
    movs r2, #1
    lsls r2, r2, #16
    cmp r0, r2
    blo 3f
    lsrs r0, r0, #16
    subs r1, #16
3:  lsrs r2, r2, #8
    cmp r0, r2
    blo 4f
    lsrs r0, r0, #8
    subs r1, #8
4:  lsrs r2, r2, #4
    cmp r0, r2
    blo 5f
    lsrs r0, r0, #4
    subs r1, #4
5:  adr r2, 6f
    ldrb r0, [r2, r0]
    adds r0, r0, r1
    bx lr
    .balign 4
6:  .byte 4, 3, 2, 2, 1, 1, 1, 1, 0, 0, 0, 0, 0, 0, 0, 0
    "#
);
