//! Measures the memory of a chip that a linked program takes.

use anyhow::{Context, Result};
use fs_err as fs;
use object::elf::{SHF_ALLOC, SHF_WRITE};
use object::{Object, ObjectSection, SectionFlags};
use std::path::Path;

/// The memory of a program in bytes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Footprint {
    /// Vector table, code, constants, initial values of variables, script.
    pub flash: u64,
    /// Variables; not the stack.
    pub ram: u64,
    /// The part that is in flash and in RAM: the initial values of variables that are not all zero.
    pub initial: u64,
}

/// Returns the footprint of an ELF file.
pub fn footprint(path: &Path) -> Result<Footprint> {
    let bytes = fs::read(path)?;
    let file = object::File::parse(bytes.as_slice());
    let file = file.with_context(|| format!("cannot read the program {}", path.display()))?;
    let mut footprint = Footprint::default();
    for section in file.sections() {
        let SectionFlags::Elf { sh_flags } = section.flags() else { continue };
        if sh_flags & u64::from(SHF_ALLOC) == 0 {
            continue;
        }
        // Sections with bytes in the file are flashed. Variables with an initial value are in flash
        // and in RAM.
        let is_flashed = section.file_range().is_some();
        let is_variable = sh_flags & u64::from(SHF_WRITE) != 0;
        let bytes = |counts: bool| if counts { section.size() } else { 0 };
        footprint.flash += bytes(is_flashed);
        footprint.ram += bytes(is_variable);
        footprint.initial += bytes(is_flashed && is_variable);
    }
    Ok(footprint)
}

#[cfg(test)]
mod tests {
    use super::*;
    use object::write;
    use object::{Architecture, BinaryFormat, Endianness, SectionKind};

    #[test]
    fn sections_count_where_they_are() {
        let mut object =
            write::Object::new(BinaryFormat::Elf, Architecture::Arm, Endianness::Little);
        let mut add = |name: &str, kind, size: usize| {
            let section = object.add_section(Vec::new(), name.into(), kind);
            match kind {
                SectionKind::UninitializedData => {
                    object.append_section_bss(section, size as u64, 4);
                }
                _ => {
                    object.append_section_data(section, &vec![1; size], 4);
                }
            }
        };
        add(".text", SectionKind::Text, 100);
        add(".rodata", SectionKind::ReadOnlyData, 20);
        add(".data", SectionKind::Data, 8);
        add(".bss", SectionKind::UninitializedData, 48);
        add(".comment", SectionKind::OtherString, 1000);
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("program");
        fs::write(&path, object.write().unwrap()).unwrap();
        assert_eq!(footprint(&path).unwrap(), Footprint { flash: 128, ram: 56, initial: 8 });
        fs::write(&path, "#!/bin/sh").unwrap();
        let failure = footprint(&path).unwrap_err().to_string();
        assert!(failure.starts_with("cannot read the program "), "{failure}");
        fs::remove_file(&path).unwrap();
        assert!(footprint(&path).is_err());
    }
}
