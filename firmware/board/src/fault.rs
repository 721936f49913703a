//! The place of a hard fault in the program.

use core::ops::Range;

/// The words of an exception frame: r0 to r3, r12, lr, pc, xPSR (ARMv6-M B1.5.6, ARMv7-M B1.5.6).
const FRAME_WORDS: usize = 8;
const LR: usize = 5;
const PC: usize = 6;

/// Returns the address of the instruction that caused a hard fault, and the return address of its
/// caller. Both are 0 if the frame is not inside the stack's memory, for example because the stack
/// is full.
///
/// # Safety
/// `frame` is the stack pointer at the fault, and the whole of `stack` is memory.
#[inline(always)] // -48 bytes on the Zooid
pub unsafe fn fault_place(frame: *const u32, stack: Range<usize>) -> [u32; 2] {
    let end = stack.end - (FRAME_WORDS - 1) * size_of::<u32>();
    if !(stack.start..end).contains(&(frame as usize)) || !(frame as usize).is_multiple_of(4) {
        return [0; 2];
    }
    // SAFETY: the words from here on lie within the stack's memory, and the exception wrote them.
    unsafe { [frame.add(PC).read_volatile(), frame.add(LR).read_volatile()] }
}
