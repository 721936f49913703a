//! Changes to an image that know what its bytes mean, so that many of the results still verify.

use bittybuzz_vm_core::Image;
use bittybuzz_vm_core::image::ImageHeader;
use bittybuzz_vm_core::opcode::{self, Operand, SHORTS, TABLE, WIDE};

/// An instruction of an image.
#[derive(Clone, Copy)]
struct Instruction {
    at: usize,
    opcode: u8,
    operand: i16,
    /// Bytes of opcode and operand.
    length: usize,
    /// The number of bytes after opcode and operand.
    trailer: usize,
    function: usize,
}

impl Instruction {
    fn end(&self) -> usize {
        self.at + self.length + self.trailer
    }

    fn is_jump(&self) -> bool {
        opcode::info(self.opcode).is_some_and(|info| info.operand == Operand::Jump)
    }

    /// Returns the number of values that it adds to the stack, arguments not counted.
    fn gain(&self) -> i16 {
        opcode::info(self.opcode).map_or(0, |info| i16::from(info.pushes) - i16::from(info.pops))
    }

    fn target(&self) -> usize {
        self.end().wrapping_add_signed(isize::from(self.operand))
    }
}

/// An image taken apart.
struct Parts {
    header: ImageHeader,
    instructions: Vec<Instruction>,
}

impl Parts {
    /// Reads an image; `None` if the bytes are not an image.
    fn of(image: &[u8]) -> Option<Parts> {
        let header = Image::new(image).header().ok()?;
        let mut instructions = Vec::new();
        for function in 0..usize::from(header.functions()) {
            let mut at = start(image, &header, function)? + 2;
            let end = start(image, &header, function + 1).unwrap_or(image.len());
            while at < end {
                let byte = |offset| image.get(at + offset).copied().unwrap_or(0);
                let decoded = opcode::decode([byte(0), byte(1), byte(2)]);
                let trailer = opcode::info(decoded.opcode)?.trailer.length(if header.is_full() {
                    4
                } else {
                    2
                });
                let instruction = Instruction {
                    at,
                    opcode: decoded.opcode,
                    operand: decoded.operand,
                    length: usize::from(decoded.length),
                    trailer,
                    function,
                };
                at = instruction.end();
                if at > image.len() {
                    return None;
                }
                instructions.push(instruction);
            }
        }
        Some(Parts { header, instructions })
    }

    fn pick(&self, number: u16) -> Option<Instruction> {
        let count = self.instructions.len();
        self.instructions.get(usize::from(number).checked_rem(count)?).copied()
    }
}

/// Where a function starts.
fn start(image: &[u8], header: &ImageHeader, function: usize) -> Option<usize> {
    if function >= usize::from(header.functions()) {
        return None;
    }
    let row = usize::from(header.functions_at()) + 2 * function;
    let offset = u16::from_le_bytes([*image.get(row)?, *image.get(row + 1)?]);
    Some(usize::from(offset) + usize::from(header.code_at()))
}

/// Makes one change: `kind` says which, `number` mostly the instruction.
pub fn change(image: &mut Vec<u8>, kind: u8, number: u16, value: u8) {
    if image.is_empty() {
        return;
    }
    let at = usize::from(number) % image.len();
    match kind % 32 {
        0 => image[at] = value,
        1 => image[at] = image[at].wrapping_add(value),
        2 => image.insert(at, value),
        3 => {
            image.remove(at);
        }
        kind => {
            // Several changes may have left no image at all.
            if let Some(parts) = Parts::of(image) {
                let _ = change_instruction(image, &parts, kind, number, value);
            }
        }
    }
}

fn change_instruction(
    image: &mut Vec<u8>,
    parts: &Parts,
    kind: u8,
    number: u16,
    value: u8,
) -> Option<()> {
    let chosen = parts.pick(number)?;
    let other = parts.pick(number.wrapping_add(u16::from(value)))?;
    match kind {
        4..11 => set_operand(image, &chosen, value),
        11..16 => replace_opcode(image, &chosen, value),
        16..19 if chosen.length == other.length && chosen.trailer == other.trailer => {
            let bytes = image.get(other.at..other.end())?.to_vec();
            image.get_mut(chosen.at..chosen.end())?.copy_from_slice(&bytes);
        }
        19 => *image.get_mut(chosen.end().checked_sub(1)?)? = value,
        20 => {
            // Parameters and flags, or depth, of a function.
            let head = start(image, &parts.header, chosen.function)?;
            *image.get_mut(head + usize::from(value & 1))? ^= 1 << (value >> 1 & 7);
        }
        21 => {
            // Entries, globals, functions, imports, strings.
            *image.get_mut(7 + usize::from(number) % 8)? = value;
        }
        22..25 => {
            let jumps: Vec<&Instruction> =
                parts.instructions.iter().filter(|jump| jump.is_jump()).collect();
            let jump = jumps.get(usize::from(number).checked_rem(jumps.len())?)?;
            let near = parts.instructions.iter().filter(|to| to.function == jump.function);
            let near: Vec<&Instruction> = near.collect();
            let to = near.get(usize::from(value).checked_rem(near.len())?)?;
            write_operand(image, jump, to.at as isize - jump.end() as isize);
        }
        25 | 26 => {
            let instead: &[u8] = match chosen.gain() {
                ..=-1 => &[opcode::POP],
                0 => &[],
                1.. => &[opcode::NIL],
            };
            resize(image, parts, chosen.at..chosen.end(), instead);
        }
        27.. => {
            let mut bytes = image.get(other.at..other.end())?.to_vec();
            if other.gain() > 0 {
                bytes.push(opcode::POP);
            }
            resize(image, parts, chosen.at..chosen.at, &bytes);
        }
        _ => {}
    }
    Some(())
}

/// Another operand of the same length.
fn set_operand(image: &mut [u8], chosen: &Instruction, value: u8) {
    let short = SHORTS.iter().find(|short| {
        image[chosen.at] >= short.first && image[chosen.at] - short.first < short.count
    });
    match short {
        Some(short) => image[chosen.at] = short.first + value % short.count,
        None => write_operand(image, chosen, isize::from(value as i8)),
    }
}

/// Writes an operand where its form has room for it.
fn write_operand(image: &mut [u8], chosen: &Instruction, value: isize) {
    match (chosen.length, i8::try_from(value), i16::try_from(value)) {
        (2, Ok(narrow), _) => image[chosen.at + 1] = narrow as u8,
        (3, _, Ok(wide)) => {
            image[chosen.at + 1..chosen.at + 3].copy_from_slice(&wide.to_le_bytes());
        }
        _ => {}
    }
}

/// Another instruction that takes and leaves as many values.
fn replace_opcode(image: &mut [u8], chosen: &Instruction, value: u8) {
    let Some(old) = opcode::info(chosen.opcode) else { return };
    let like: Vec<u8> = TABLE
        .iter()
        .filter(|info| {
            (info.pops, info.pushes, info.trailer) == (old.pops, old.pushes, old.trailer)
        })
        .filter(|info| (info.byte < 0x40) == (chosen.opcode < 0x40))
        .map(|info| info.byte)
        .collect();
    let new = like[usize::from(value) % like.len()];
    match image[chosen.at] {
        0x00..0x80 => image[chosen.at] = new,
        0xc0.. => image[chosen.at] = new | WIDE,
        // A short form names its own opcode.
        _ => {}
    }
}

/// Puts other bytes in the place of some; what jumps over them still leads where it led.
fn resize(image: &mut Vec<u8>, parts: &Parts, range: std::ops::Range<usize>, bytes: &[u8]) {
    let by = bytes.len() as isize - range.len() as isize;
    let jumps = parts.instructions.iter().filter(|jump| jump.is_jump());
    for jump in jumps {
        let (at, target) = (jump.at, jump.target());
        if at < range.start && target >= range.end && target != range.start {
            write_operand(image, jump, isize::from(jump.operand) + by);
        } else if at >= range.end && target <= range.start {
            write_operand(image, jump, isize::from(jump.operand) - by);
        }
    }
    for function in 0..usize::from(parts.header.functions()) {
        let row = usize::from(parts.header.functions_at()) + 2 * function;
        if start(image, &parts.header, function).is_some_and(|start| start > range.start) {
            let offset = u16::from_le_bytes([image[row], image[row + 1]]);
            let moved = offset.wrapping_add_signed(by as i16);
            image[row..row + 2].copy_from_slice(&moved.to_le_bytes());
        }
    }
    image.splice(range, bytes.iter().copied());
}
