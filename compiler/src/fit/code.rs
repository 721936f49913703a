//! Decodes the instructions of an image. An unknown opcode ends a function.

use bittybuzz_vm_core::image::ImageHeader;
use bittybuzz_vm_core::opcode::{self, OpcodeInfo};

/// An instruction.
#[derive(Debug, Clone, Copy)]
pub struct DecodedInstruction {
    /// The position, counted from the start of the code.
    pub at: usize,
    /// The position of the next instruction.
    pub next: usize,
    pub info: &'static OpcodeInfo,
    pub operand: i16,
    /// The first byte after the operand, if there is one.
    pub trailer: u8,
}

/// Returns the two bytes of a function's header: flags and parameters, and number of slots. They
/// are 0 if the image is too short.
pub fn head(image: &[u8], header: &ImageHeader, function: u16) -> [u8; 2] {
    let at = usize::from(header.code_at()) + start(image, header, function);
    [byte(image, at), byte(image, at + 1)]
}

/// Returns the instructions of a function, in order.
pub fn instructions(
    image: &[u8],
    header: &ImageHeader,
    function: u16,
) -> impl Iterator<Item = DecodedInstruction> {
    let code_at = usize::from(header.code_at());
    let is_last = function + 1 >= header.functions();
    let length = image.len().saturating_sub(code_at);
    let end = if is_last { length } else { start(image, header, function + 1).min(length) };
    let word = if header.is_full() { 4 } else { 2 };
    let mut at = start(image, header, function) + 2;
    std::iter::from_fn(move || {
        if at >= end {
            return None;
        }
        let bytes = [0, 1, 2].map(|ahead| byte(image, code_at + at + ahead));
        let decoded = opcode::decode(bytes);
        let info = opcode::info(decoded.opcode)?;
        let trailer = at + usize::from(decoded.length);
        let next = trailer + info.trailer.length(word);
        let trailer = byte(image, code_at + trailer);
        let instruction = DecodedInstruction { at, next, info, operand: decoded.operand, trailer };
        at = next;
        Some(instruction)
    })
}

fn start(image: &[u8], header: &ImageHeader, function: u16) -> usize {
    let row = usize::from(header.functions_at()) + 2 * usize::from(function);
    usize::from(u16::from_le_bytes([byte(image, row), byte(image, row + 1)]))
}

fn byte(image: &[u8], at: usize) -> u8 {
    image.get(at).copied().unwrap_or(0)
}
