//! The two decoders of the interpreter's loop. Each chip uses one of them.
//!
//! [`forms`] tests the form of an instruction first, and then uses the loop's jump table for its
//! opcode. [`table`] leaves the short and wide forms to the jump table, too: most instructions take
//! one indirect jump, at the price of more arms.

pub(super) mod forms;
pub(super) mod table;

use super::Vm;
use crate::bytecode::ByteCode;
use crate::number::Profile;

impl<P: Profile, C: ByteCode, const SLOTS: usize> Vm<P, C, SLOTS> {
    /// True if the decoder is [`table`]. It pays where the number of slots is a power of two, so
    /// that slots need no check; elsewhere steps would take some percent longer. The AVR, which has
    /// little flash and no jump tables, uses [`forms`].
    pub(super) const DIRECT: bool = cfg!(not(target_arch = "avr")) && SLOTS.is_power_of_two();
}
