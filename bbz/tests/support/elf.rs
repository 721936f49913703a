//! Makes ELF files like those of a linker for a Cortex-M.

use object::elf;
use object::write::elf::{FileHeader, ProgramHeader, SectionHeader, Writer};
use object::write::{Object, Symbol, SymbolSection};
use object::{
    Architecture, BinaryFormat, Endianness, SectionKind, SymbolFlags, SymbolKind, SymbolScope,
};

/// A segment that is loaded.
#[derive(Clone)]
pub struct Segment<'a> {
    /// The address in flash.
    pub at: u32,
    /// The address when the firmware runs.
    pub runs_at: u32,
    pub bytes: &'a [u8],
}

/// Returns an executable for ARM with these segments, and a section for each, because probe-rs
/// reads sections.
pub fn arm(segments: &[Segment<'_>]) -> Vec<u8> {
    let mut file = Vec::new();
    let mut writer = Writer::new(Endianness::Little, false, &mut file);
    writer.reserve_file_header();
    writer.reserve_program_headers(u32::try_from(segments.len()).unwrap());
    let offsets: Vec<usize> =
        segments.iter().map(|segment| writer.reserve(segment.bytes.len(), 4)).collect();
    writer.reserve_null_section_index();
    let name = writer.add_section_name(b".part");
    for _ in segments {
        writer.reserve_section_index();
    }
    writer.reserve_shstrtab_section_index();
    writer.reserve_shstrtab();
    writer.reserve_section_headers();
    writer
        .write_file_header(&FileHeader {
            os_abi: elf::ELFOSABI_NONE,
            abi_version: 0,
            e_type: elf::ET_EXEC,
            e_machine: elf::EM_ARM,
            e_entry: 0,
            e_flags: 0,
        })
        .unwrap();
    writer.write_align_program_headers();
    for (segment, offset) in segments.iter().zip(&offsets) {
        let size = u64::try_from(segment.bytes.len()).unwrap();
        writer.write_program_header(&ProgramHeader {
            p_type: elf::PT_LOAD,
            p_flags: elf::PF_R,
            p_offset: u64::try_from(*offset).unwrap(),
            p_vaddr: segment.runs_at.into(),
            p_paddr: segment.at.into(),
            p_filesz: size,
            p_memsz: size,
            p_align: 4,
        });
    }
    for segment in segments {
        writer.write_align(4);
        writer.write(segment.bytes);
    }
    writer.write_shstrtab();
    writer.write_null_section_header();
    for (segment, offset) in segments.iter().zip(&offsets) {
        writer.write_section_header(&SectionHeader {
            name: Some(name),
            sh_type: elf::SHT_PROGBITS,
            sh_flags: elf::SHF_ALLOC.into(),
            sh_addr: segment.runs_at.into(),
            sh_offset: u64::try_from(*offset).unwrap(),
            sh_size: u64::try_from(segment.bytes.len()).unwrap(),
            sh_link: 0,
            sh_info: 0,
            sh_addralign: 4,
            sh_entsize: 0,
        });
    }
    writer.write_shstrtab_section_header();
    file
}

/// Returns a file with the texts of defmt messages in an encoding, `raw` or `rzcobs`: number, tag and
/// text of each.
pub fn with_messages(encoding: &str, messages: &[(u16, &str, &str)]) -> Vec<u8> {
    let mut file = Object::new(BinaryFormat::Elf, Architecture::Arm, Endianness::Little);
    let section = file.add_section(vec![], b".defmt".to_vec(), SectionKind::Data);
    file.append_section_data(section, &[0; 64], 1);
    let mut symbol = |name: String, value: u16, section: SymbolSection| {
        file.add_symbol(Symbol {
            name: name.into_bytes(),
            value: value.into(),
            size: 1,
            kind: SymbolKind::Data,
            scope: SymbolScope::Linkage,
            weak: false,
            section,
            flags: SymbolFlags::None,
        });
    };
    symbol("_defmt_version_ = 4".to_owned(), 0, SymbolSection::Absolute);
    symbol(format!("_defmt_encoding_ = {encoding}"), 0, SymbolSection::Absolute);
    for (number, tag, text) in messages {
        let name = serde_json::json!({
            "package": "robot", "disambiguator": number.to_string(), "tag": tag, "data": text,
            "crate_name": "robot",
        });
        symbol(name.to_string(), *number, SymbolSection::Section(section));
    }
    file.write().unwrap()
}
