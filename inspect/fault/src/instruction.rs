//! Finds an instruction in an image: the one at which the machine stopped.

use bittybuzz_vm_core::Image;
use bittybuzz_vm_core::opcode::{self, Trailer, WIDE};

/// An instruction with its operand.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ByteCodeInstruction {
    /// The plain or narrow opcode.
    pub opcode: u8,
    /// Operand, 0 if there is none.
    pub operand: i16,
}

/// Returns the instruction of an image whose last byte is at `position`, counted from the start of
/// the code. A trace may name an image that was not verified, or a position of another image: then
/// the result is `None`.
pub fn ending_at(image: &[u8], position: u16) -> Option<ByteCodeInstruction> {
    let header = Image::new(image).header().ok()?;
    let word_bytes = if header.is_full() { 4 } else { 2 };
    let table = image.get(usize::from(header.functions_at())..)?.chunks_exact(2);
    let starts =
        table.take(usize::from(header.functions())).map(|row| u16::from_le_bytes([row[0], row[1]]));
    let code = image.get(usize::from(header.code_at())..)?;
    let position = usize::from(position);
    // The function's header of two bytes comes first.
    let mut at = usize::from(starts.filter(|start| usize::from(*start) <= position).max()?) + 2;
    while at <= position {
        // The operands of the last instruction may be shorter than the three bytes that are decoded.
        let byte = |offset: usize| code.get(at + offset).copied().unwrap_or(0);
        let decoded = opcode::decode([byte(0), byte(1), byte(2)]);
        let trailer = opcode::info(decoded.opcode)?.trailer;
        let behind = byte(usize::from(decoded.length));
        at += usize::from(decoded.length) + trailer.length(word_bytes);
        if at == position + 1 {
            // Decoding has turned the wide form into the narrow one.
            debug_assert!(decoded.opcode & WIDE == 0);
            let opcode = match trailer {
                Trailer::LocalImmediate => opcode::relation_of_local(behind).0,
                _ => decoded.opcode,
            };
            return Some(ByteCodeInstruction { opcode, operand: decoded.operand });
        }
    }
    None
}
