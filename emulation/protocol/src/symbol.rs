//! The symbols of an ELF file.

use std::ops::Range;

use object::read::elf::ElfFile32;
use object::{Endianness, Object, ObjectSection, ObjectSymbol, SymbolKind};

/// A function or a variable of a linked program.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ElfSymbol {
    pub name: String,
    /// The address, without the bit that marks a function as Thumb code.
    pub address: u32,
    pub is_function: bool,
    /// The position of its content in the file; `None` if the file does not hold it.
    pub file_range: Option<Range<usize>>,
}

impl ElfSymbol {
    /// Returns the first symbol with a name that is wanted; `None` if there is none, or if the bytes
    /// are no ELF file of a chip.
    pub fn find(elf: &[u8], is_wanted: impl Fn(&str) -> bool) -> Option<Self> {
        let elf = ElfFile32::<Endianness>::parse(elf).ok()?;
        let symbol = elf.symbols().find(|symbol| symbol.name().is_ok_and(&is_wanted))?;
        ElfSymbol::new(&elf, &symbol)
    }

    /// Returns all named symbols.
    pub(crate) fn all(elf: &ElfFile32<'_, Endianness>) -> Vec<Self> {
        elf.symbols().filter_map(|symbol| ElfSymbol::new(elf, &symbol)).collect()
    }

    /// Returns `None` for a symbol without a name.
    fn new<'data>(
        elf: &ElfFile32<'data, Endianness>,
        symbol: &impl ObjectSymbol<'data>,
    ) -> Option<Self> {
        let name = symbol.name().ok().filter(|name| !name.is_empty())?;
        let is_function = symbol.kind() == SymbolKind::Text;
        let thumb = u64::from(is_function);
        Some(ElfSymbol {
            name: name.to_owned(),
            // The addresses of a 32-bit file have 32 bits.
            address: (symbol.address() & !thumb) as u32,
            is_function,
            file_range: file_range(elf, symbol),
        })
    }
}

fn file_range<'data>(
    elf: &ElfFile32<'data, Endianness>,
    symbol: &impl ObjectSymbol<'data>,
) -> Option<Range<usize>> {
    let section = elf.section_by_index(symbol.section_index()?).ok()?;
    let (start, _) = section.file_range()?;
    let start = start + symbol.address().checked_sub(section.address())?;
    Some(usize::try_from(start).ok()?..usize::try_from(start + symbol.size()).ok()?)
}

#[cfg(test)]
mod tests {
    use super::ElfSymbol;
    use object::write::{Object, Symbol, SymbolSection};
    use object::{
        Architecture, BinaryFormat, Endianness, SectionKind, SymbolFlags, SymbolKind, SymbolScope,
    };

    #[test]
    fn a_symbol_has_its_address_and_its_place_in_the_file() {
        let mut object = Object::new(BinaryFormat::Elf, Architecture::Arm, Endianness::Little);
        let mut add = |name: &str, kind, symbol_kind, content: Option<&[u8]>, thumb| {
            let section = object.add_section(Vec::new(), format!(".{name}").into(), kind);
            let value = match content {
                Some(content) => {
                    object.append_section_data(section, b"before", 1);
                    object.append_section_data(section, content, 1)
                }
                None => object.append_section_bss(section, 6, 1),
            };
            object.add_symbol(Symbol {
                name: name.into(),
                value: value | thumb,
                size: 6,
                kind: symbol_kind,
                scope: SymbolScope::Linkage,
                weak: false,
                section: SymbolSection::Section(section),
                flags: SymbolFlags::None,
            });
        };
        add("script", SectionKind::ReadOnlyData, SymbolKind::Data, Some(b"script"), 0);
        add("mark", SectionKind::Text, SymbolKind::Text, Some(b"mark()"), 1);
        add("count", SectionKind::UninitializedData, SymbolKind::Data, None, 0);
        let elf = object.write().expect("a small object");

        let find = |name: &str| ElfSymbol::find(&elf, |known| known == name);
        let script = find("script").expect("a symbol");
        let place = script.file_range.clone().expect("the file holds it");
        assert_eq!((&elf[place], script.address, script.is_function), (&b"script"[..], 6, false));
        let mark = find("mark").expect("a symbol");
        assert_eq!((mark.address, mark.is_function), (6, true));
        assert_eq!(find("count").map(|count| count.file_range), Some(None));
        assert_eq!(find("another"), None);
        assert_eq!(ElfSymbol::find(b"no ELF file", |_| true), None);
    }
}
