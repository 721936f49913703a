//! The linked program of a chip, with a batch in it.

use bittybuzz_emulation::ElfSymbol;
use bittybuzz_on_chip::SYMBOL;
use object::Endianness;
use object::read::elf::{ElfFile32, ProgramHeader};
use std::ops::Range;

/// A linked program.
pub struct Linked {
    bytes: Vec<u8>,
    /// Where the batch is in the file.
    room: Range<usize>,
}

impl Linked {
    /// # Panics
    /// If it is not such a program.
    pub fn new(bytes: Vec<u8>) -> Linked {
        let symbol = ElfSymbol::find(&bytes, |name| name == SYMBOL);
        let room = symbol.and_then(|symbol| symbol.file_range);
        let room = room.expect("an ELF file with room for a batch");
        Linked { bytes, room }
    }

    /// Bytes of a batch.
    pub fn room(&self) -> usize {
        self.room.len()
    }

    /// The file with a batch in it.
    pub fn with(&self, batch: &[u8]) -> Vec<u8> {
        let mut bytes = self.bytes.clone();
        bytes[self.room.clone()][..batch.len()].copy_from_slice(batch);
        bytes
    }
}

/// What is written to the flash for an ELF file, from address 0.
pub fn flash(elf: &[u8]) -> Vec<u8> {
    let file = ElfFile32::<Endianness>::parse(elf).expect("an ELF file");
    let mut flash = Vec::new();
    for segment in file.elf_program_headers() {
        let data = segment.data(file.endian(), elf).expect("a segment lies in its file");
        if data.is_empty() {
            continue;
        }
        let start = segment.p_paddr(file.endian()) as usize;
        let end = start + data.len();
        flash.resize(flash.len().max(end), 0);
        flash[start..end].copy_from_slice(data);
    }
    flash
}
