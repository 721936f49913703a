//! A minimal ELF file with a segment and symbols.

/// Address of a function, without the Thumb bit.
pub const FUNCTION: u32 = 0x0800_0010;

/// The content of the file.
pub struct Elf<'a> {
    /// Processor; ARM is 40.
    pub machine: u16,
    /// Physical address of the only segment.
    pub address: u32,
    /// Name and address of each symbol, and true for a function.
    pub symbols: &'a [(&'a str, u32, bool)],
}

impl Default for Elf<'_> {
    fn default() -> Self {
        Elf { machine: 40, address: 0x0800_0000, symbols: &[] }
    }
}

impl Elf<'_> {
    /// Returns the file: header, program header, the segment's 32 bytes, symbols, their names,
    /// section headers.
    pub fn bytes(&self) -> Vec<u8> {
        const HEADER: u32 = 52;
        const PROGRAM_HEADER: u32 = 32;
        const SEGMENT: u32 = 32;
        const SYMBOL: u32 = 16;
        const SECTION_HEADER: u16 = 40;

        let mut names = vec![0_u8];
        let mut symbols = vec![0_u8; SYMBOL as usize];
        for (name, address, function) in self.symbols {
            symbols.extend((names.len() as u32).to_le_bytes());
            symbols.extend(address.to_le_bytes());
            symbols.extend(4_u32.to_le_bytes());
            // Each symbol is a global function or object, with an absolute address.
            symbols.extend([if *function { 0x12 } else { 0x11 }, 0, 0xf1, 0xff]);
            names.extend(name.bytes());
            names.push(0);
        }
        // Headers are aligned to 4 bytes.
        names.resize(names.len().next_multiple_of(4), 0);
        let segment = HEADER + PROGRAM_HEADER;
        let symbols_at = segment + SEGMENT;
        let names_at = symbols_at + symbols.len() as u32;
        let sections_at = names_at + names.len() as u32;

        let mut file = b"\x7fELF\x01\x01\x01".to_vec();
        file.resize(16, 0);
        for half in [2, self.machine] {
            file.extend(half.to_le_bytes());
        }
        for word in [1, self.address, HEADER, sections_at, 0] {
            file.extend(word.to_le_bytes());
        }
        for half in [HEADER as u16, PROGRAM_HEADER as u16, 1, SECTION_HEADER, 3, 2] {
            file.extend(half.to_le_bytes());
        }
        for word in [1, segment, self.address, self.address, SEGMENT, SEGMENT, 5, 4] {
            file.extend(word.to_le_bytes());
        }
        file.extend([0; SEGMENT as usize]);
        let (symbols_size, names_size) = (symbols.len() as u32, names.len() as u32);
        file.extend(symbols);
        file.extend(names);
        // Sections: the null section, the symbol table with its names in section 2, the names.
        for section in [
            [0; 10],
            [0, 2, 0, 0, symbols_at, symbols_size, 2, 1, 4, SYMBOL],
            [0, 3, 0, 0, names_at, names_size, 0, 0, 1, 0],
        ] {
            for word in section {
                file.extend(word.to_le_bytes());
            }
        }
        file
    }
}
