//! Small functions that copy and clear memory. The compiler's own functions are made for speed and
//! take 1.1 kB here. The arguments follow the run-time ABI (Run-time ABI for the Arm Architecture,
//! 5.3.4): destination, source and number of bytes, or destination and number.
//!
//! The functions work from the last byte to the first. If the name ends in 4 or 8, the addresses
//! are aligned, and whole words are used as soon as the rest is a number of words.

use core::arch::global_asm;

global_asm!(
    r#"
    .syntax unified
    .section .text.memory, "ax", %progbits
    .macro function name
    .global \name
    .thumb_func
\name:
    .endm

    function __aeabi_memcpy4
    function __aeabi_memcpy8
0:  lsls r3, r2, #30
    beq 1f
    subs r2, #1
    ldrb r3, [r1, r2]
    strb r3, [r0, r2]
    b 0b
1:  subs r2, #4
    blo 3f
    ldr r3, [r1, r2]
    str r3, [r0, r2]
    b 1b

    function memcpy
    function __aeabi_memcpy
2:  subs r2, #1
    blo 3f
    ldrb r3, [r1, r2]
    strb r3, [r0, r2]
    b 2b

    function __aeabi_memclr4
    function __aeabi_memclr8
    movs r2, #0
0:  lsls r3, r1, #30
    beq 1f
    subs r1, #1
    strb r2, [r0, r1]
    b 0b
1:  subs r1, #4
    blo 3f
    str r2, [r0, r1]
    b 1b

    function __aeabi_memclr
    movs r2, #0
2:  subs r1, #1
    blo 3f
    strb r2, [r0, r1]
    b 2b
3:  bx lr
    "#
);
