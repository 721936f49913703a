//! Symbols of ELF files.

use crate::error::BenchError;
use anyhow::Result;
use fs_err as fs;
use object::{Object, ObjectSection, ObjectSymbol};
use std::path::Path;

/// Returns the place of a symbol's bytes in an ELF file.
pub fn file_offset(elf: &[u8], symbol: &str) -> Option<usize> {
    let file = object::File::parse(elf).ok()?;
    let symbol = file.symbols().find(|known| known.name() == Ok(symbol))?;
    let section = file.section_by_index(symbol.section_index()?).ok()?;
    let (start, _) = section.file_range()?;
    usize::try_from(start + symbol.address().checked_sub(section.address())?).ok()
}

/// Returns the address of a function of an ELF file, without the bit that marks Thumb code.
pub fn address(path: &Path, symbol: &'static str) -> Result<u32> {
    let bytes = fs::read(path)?;
    let file = object::File::parse(bytes.as_slice());
    let address = file.ok().and_then(|file| {
        let symbol = file.symbols().find(|known| known.name() == Ok(symbol))?;
        u32::try_from(symbol.address() & !1).ok()
    });
    address.ok_or_else(|| BenchError::NoSymbol { program: path.into(), symbol }.into())
}

#[cfg(test)]
mod tests {
    use super::*;
    use bittybuzz_bench::SYMBOL;
    use object::write::{self, Symbol, SymbolSection};
    use object::{
        Architecture, BinaryFormat, Endianness, SectionKind, SymbolFlags, SymbolKind, SymbolScope,
    };

    #[test]
    fn a_symbol_is_found_in_the_file() {
        let mut elf = write::Object::new(BinaryFormat::Elf, Architecture::Arm, Endianness::Little);
        let section = elf.add_section(Vec::new(), b".rodata".to_vec(), SectionKind::ReadOnlyData);
        elf.append_section_data(section, b"before", 1);
        let value = elf.append_section_data(section, b"script", 1);
        elf.add_symbol(Symbol {
            name: SYMBOL.into(),
            value,
            size: 6,
            kind: SymbolKind::Data,
            scope: SymbolScope::Linkage,
            weak: false,
            section: SymbolSection::Section(section),
            flags: SymbolFlags::None,
        });
        let elf = elf.write().unwrap();
        let at = file_offset(&elf, SYMBOL).unwrap();
        assert_eq!(&elf[at..at + 6], b"script");
        assert_eq!(file_offset(&elf, "another"), None);
        assert_eq!(file_offset(b"no ELF file", SYMBOL), None);
    }
}
