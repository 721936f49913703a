//! The two decoders of the interpreter's loop, of which a chip has one.
//!
//! [`forms`] asks for the form of an instruction first, then the loop's jump table for its opcode. [`table`] leaves the short and
//! wide forms to the jump table, too: one indirect jump for most instructions, and more arms.

pub(super) mod forms;
pub(super) mod table;

use super::Vm;
use crate::bytecode::ByteCode;
use crate::number::Profile;

impl<P: Profile, C: ByteCode, const SLOTS: usize> Vm<P, C, SLOTS> {
    /// The decoder is [`table`]. It pays where slots need no check, being a power of two: elsewhere steps would take
    /// some percent more. The AVR, with its little flash and without jump tables, has [`forms`].
    pub(super) const DIRECT: bool = cfg!(not(target_arch = "avr")) && SLOTS.is_power_of_two();
}
