//! The check that the whole firmware is in flash, before any other code runs.
//!
//! Bitcraze's bootloader starts whatever begins at 0x08004000. After a power cut while firmware is
//! sent by radio that may be a part of the new firmware next to a part of the old one, and the
//! bootloader also accepts pages that miss a packet. Such a mixture could turn motors. Here the
//! robot stops with its right red LED on instead. The radio's processor still takes firmware.
//!
//! `cargo xtask build crazyflie --bin` (`bittybuzz_builds::raw_binary`) writes three words to
//! reserved places of the vector table (ARMv7-M B1.5.3):
//!
//! | offset | |
//! |---|---|
//! | 28 | number of words that are checked, from offset 40 on; 0 if nothing is checked, as after a flash by a debug probe, which verifies it |
//! | 32 | sum of these words |
//! | 36 | sum of the sums after each word |
//!
//! This is assembly, because variables have no values yet. The section `.Reset` is in the first
//! sector, right after the vector table: flash that was written in order has this code before any
//! code that it checks. If it is missing itself, the processor locks up, with all pins as inputs.

use core::arch::global_asm;

global_asm!(
    ".section .Reset, \"ax\"",
    ".global __pre_init",
    ".type __pre_init, %function",
    ".thumb_func",
    "__pre_init:",
    "movw r0, #:lower16:__vector_table",
    "movt r0, #:upper16:__vector_table",
    "ldr r1, [r0, #28]",
    "cbz r1, 3f",
    // Erased flash is a larger number than the flash has words.
    "cmp r1, #0x3c000",
    "bhi 4f",
    "add r2, r0, #40",
    "movs r3, #0",
    "movs r4, #0",
    "2:",
    "ldr r5, [r2], #4",
    "adds r3, r3, r5",
    "adds r4, r4, r3",
    "subs r1, r1, #1",
    "bne 2b",
    "ldr r5, [r0, #32]",
    "cmp r3, r5",
    "bne 4f",
    "ldr r5, [r0, #36]",
    "cmp r4, r5",
    "bne 4f",
    "3:",
    "bx lr",
    // The right red LED, PC3, is lit by a low level: RCC_AHB1ENR, GPIOC_BSRR, GPIOC_MODER.
    "4:",
    "movw r0, #0x3830",
    "movt r0, #0x4002",
    "ldr r1, [r0]",
    "orr r1, r1, #4",
    "str r1, [r0]",
    "ldr r1, [r0]",
    "movw r0, #0x0800",
    "movt r0, #0x4002",
    "mov r1, #0x80000",
    "str r1, [r0, #0x18]",
    "ldr r1, [r0]",
    "bic r1, r1, #0xc0",
    "orr r1, r1, #0x40",
    "str r1, [r0]",
    "5:",
    "b 5b",
    ".size __pre_init, . - __pre_init",
);
