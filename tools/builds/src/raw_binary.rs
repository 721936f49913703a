//! Makes the file that cfloader sends to a Crazyflie by radio: the content of the flash from the
//! vector table on, without addresses. [`release_zip`](crate::release_zip) wraps it for cfclient.
//!
//! Bitcraze's bootloader writes the file from page 16 on and knows nothing of its parts
//! (crazyflie2-stm-bootloader, commit c79feab). So the file also covers the space between firmware,
//! scripts and id, as erased flash. It covers both sectors of the scripts' log: with an old script
//! in the second sector the robot could run that one.
//!
//! A file with an id covers the settings, which it erases if none are given: they lie before it.
//!
//! The bootloader does not check the pages that it writes, so the file has a checksum that the
//! firmware checks at its start (firmware/crazyflie/src/complete.rs). Scripts and id have checks of
//! their own.

use std::path::PathBuf;

use bittybuzz_robot_spec::Layout;
use object::Endianness;
use object::elf::{EM_ARM, FileHeader32, PT_LOAD};
use object::read::elf::{FileHeader, ProgramHeader};

/// First address of the flash, where Bitcraze's bootloader is.
const FLASH: u32 = 0x0800_0000;

/// The address at which the bootloader starts a program (crazyflie2-stm-bootloader, config.h).
pub const PROGRAM: u32 = 0x0800_4000;

/// Address after the last byte of an STM32F405RG's flash.
pub const FLASH_END: u32 = 0x0810_0000;

/// Bytes of the bootloader's pages.
pub const PAGE_BYTES: usize = 1024;

/// Offset in the vector table of the number of words that the checksum covers. Two sums follow.
const CHECKED_WORDS: usize = 28;

/// Offset of the first word that the checksum covers.
const CHECKED: usize = 40;

/// A reason why there is no file for the bootloader.
#[derive(Debug, PartialEq, Eq, thiserror::Error)]
pub enum RawBinaryError {
    /// The robot is flashed in another way.
    #[error("the {0} has no bootloader that takes a raw binary: build it without --bin")]
    NoBootloader(String),
    /// The script has errors, which have been printed.
    #[error("`{}` has errors, see above: mend them, `bbz check` finds them too", .0.display())]
    Script(PathBuf),
    /// The program is not an ELF file for a 32-bit ARM.
    #[error("the program is no ELF file for a 32-bit ARM: build it for thumbv7em-none-eabihf")]
    NotArm,
    /// The program lies at the beginning of the flash.
    #[error(
        "the program was built for 0x08000000, the place of Bitcraze's bootloader, which cannot replace itself: \
         build it without the feature `no-bootloader`"
    )]
    PlaceOfBootloader,
    /// No segment lies at the address at which the bootloader starts a program.
    #[error(
        "the program has no vector table at 0x08004000, where Bitcraze's bootloader starts it: \
         build it with the [layout] of the robot file"
    )]
    WrongStart,
    /// A segment reaches out of the flash after the bootloader.
    #[error(
        "the program has bytes for {start:#010x} to {end:#010x}, but its flash is 0x08004000 to 0x08100000: \
         shorten firmware and script, or mend the [layout] of the robot file"
    )]
    TooLong {
        /// Address of the first byte.
        start: u32,
        /// Address after the last byte.
        end: u64,
    },
    /// The robot's layout has no region for an id.
    #[error("the robot file has no `id` in its [layout]: build without --id")]
    NoId,
}

/// The data of the individual robot.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Individual {
    /// The address of the settings and their bytes.
    pub settings: Option<(u32, Vec<u8>)>,
    pub id: Option<u16>,
}

/// Returns the content of the flash from [`PROGRAM`] on, up to the last byte of an ELF file's
/// segments and of the robot's data. Bytes that belong to neither are erased.
pub fn content(elf: &[u8], layout: &Layout, robot: &Individual) -> Result<Vec<u8>, RawBinaryError> {
    let mut flash = Vec::new();
    let mut starts_at_program = false;
    let mut end = PROGRAM;
    for (address, bytes) in segments(elf)? {
        if (FLASH..PROGRAM).contains(&address) {
            return Err(RawBinaryError::PlaceOfBootloader);
        }
        starts_at_program |= address == PROGRAM && bytes.len() > CHECKED;
        put(&mut flash, address, bytes)?;
        if address < layout.application.end() {
            end = end.max(address + bytes.len() as u32);
        }
    }
    if !starts_at_program {
        return Err(RawBinaryError::WrongStart);
    }
    add_checksum(&mut flash, (end - PROGRAM) as usize);
    if let Some((address, bytes)) = &robot.settings {
        put(&mut flash, *address, bytes)?;
    }
    if let Some(id) = robot.id {
        let region = layout.id.ok_or(RawBinaryError::NoId)?;
        put(&mut flash, region.address, &Layout::id_section(id))?;
    }
    Ok(flash)
}

/// Returns the bytes of an ELF file that are flashed, with their addresses in flash.
fn segments(elf: &[u8]) -> Result<Vec<(u32, &[u8])>, RawBinaryError> {
    let refused = |_| RawBinaryError::NotArm;
    let header = FileHeader32::<Endianness>::parse(elf).map_err(refused)?;
    let endian = header.endian().map_err(refused)?;
    if header.e_machine(endian) != EM_ARM {
        return Err(RawBinaryError::NotArm);
    }
    let mut segments = Vec::new();
    for segment in header.program_headers(endian, elf).map_err(refused)? {
        if segment.p_type(endian) == PT_LOAD && segment.p_filesz(endian) > 0 {
            let bytes = segment.data(endian, elf).map_err(|()| RawBinaryError::NotArm)?;
            segments.push((segment.p_paddr(endian), bytes));
        }
    }
    Ok(segments)
}

/// Writes the checksum of the firmware, which ends at `end`, to reserved places of the vector table.
fn add_checksum(flash: &mut Vec<u8>, end: usize) {
    let end = end.next_multiple_of(size_of::<u32>());
    flash.resize(flash.len().max(end), u8::MAX);
    let (words, _) = flash[CHECKED..end].as_chunks();
    let (mut sum, mut sum_of_sums) = (0_u32, 0_u32);
    for word in words {
        sum = sum.wrapping_add(u32::from_le_bytes(*word));
        sum_of_sums = sum_of_sums.wrapping_add(sum);
    }
    let checksum = [words.len() as u32, sum, sum_of_sums].map(u32::to_le_bytes);
    flash[CHECKED_WORDS..CHECKED].copy_from_slice(&checksum.concat());
}

/// Copies bytes to an address of the flash, which grows as far as necessary.
fn put(flash: &mut Vec<u8>, address: u32, bytes: &[u8]) -> Result<(), RawBinaryError> {
    let end = u64::from(address) + bytes.len() as u64;
    if address < PROGRAM || end > u64::from(FLASH_END) {
        return Err(RawBinaryError::TooLong { start: address, end });
    }
    let start = (address - PROGRAM) as usize;
    let end = start + bytes.len();
    flash.resize(flash.len().max(end), u8::MAX);
    flash[start..end].copy_from_slice(bytes);
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use object::elf;
    use object::write::elf::{FileHeader, ProgramHeader, Writer};

    /// Returns an ELF file with these segments: address and bytes.
    fn elf(machine: u16, segments: &[(u32, &[u8])]) -> Vec<u8> {
        let mut file = Vec::new();
        let mut writer = Writer::new(Endianness::Little, false, &mut file);
        writer.reserve_file_header();
        writer.reserve_program_headers(segments.len() as u32);
        let offsets: Vec<usize> =
            segments.iter().map(|(_, bytes)| writer.reserve(bytes.len(), 4)).collect();
        let header = FileHeader {
            os_abi: elf::ELFOSABI_NONE,
            abi_version: 0,
            e_type: elf::ET_EXEC,
            e_machine: machine,
            e_entry: 0,
            e_flags: 0,
        };
        writer.write_file_header(&header).unwrap();
        writer.write_align_program_headers();
        for ((address, bytes), offset) in segments.iter().zip(&offsets) {
            writer.write_program_header(&ProgramHeader {
                p_type: elf::PT_LOAD,
                p_flags: elf::PF_R,
                p_offset: *offset as u64,
                p_vaddr: 0x2000_0000,
                p_paddr: u64::from(*address),
                p_filesz: bytes.len() as u64,
                p_memsz: bytes.len() as u64 + 4,
                p_align: 4,
            });
        }
        for (_, bytes) in segments {
            writer.write_align(4);
            writer.write(bytes);
        }
        file
    }

    fn layout() -> Layout {
        bittybuzz_robot_files::find("crazyflie").unwrap().layout.unwrap()
    }

    fn made(segments: &[(u32, &[u8])], id: Option<u16>) -> Result<Vec<u8>, RawBinaryError> {
        content(&elf(elf::EM_ARM, segments), &layout(), &Individual { settings: None, id })
    }

    const VECTORS: (u32, &[u8]) = (PROGRAM, &[1; 44]);

    #[test]
    fn the_file_is_the_flash_from_the_vector_table_on() {
        let flash = made(&[(PROGRAM + 46, &[7]), VECTORS], None).unwrap();
        assert_eq!(flash[..28], [1; 28]);
        assert_eq!(flash[40..], [1, 1, 1, 1, 0xff, 0xff, 7, 0xff]);
        // 2 words: 0x01010101 and 0xff07ffff.
        let sums = [[2, 0, 0, 0], [0, 1, 9, 0], [1, 2, 10, 1]];
        assert_eq!(flash[28..40], sums.concat());
    }

    #[test]
    fn scripts_are_not_part_of_the_checksum() {
        let script: (u32, &[u8]) = (layout().script.address, &[5; 8]);
        let [with, without] =
            [&[VECTORS, script][..], &[VECTORS]].map(|segments| made(segments, None).unwrap());
        assert_eq!(with[..44], without);
    }

    #[test]
    fn an_id_is_at_its_address_and_only_if_one_is_given() {
        let flash = made(&[VECTORS], Some(7)).unwrap();
        let start = (layout().id.unwrap().address - PROGRAM) as usize;
        assert_eq!(flash[start..], Layout::id_section(7));
        assert!(flash[44..start].iter().all(|byte| *byte == 0xff));
        assert_eq!(made(&[VECTORS], None).unwrap().len(), 44);
        let layout = Layout { id: None, ..layout() };
        let refused = content(
            &elf(elf::EM_ARM, &[VECTORS]),
            &layout,
            &Individual { id: Some(7), settings: None },
        );
        assert_eq!(refused, Err(RawBinaryError::NoId));
    }

    /// A file without them leaves the sectors of settings and id as they are.
    #[test]
    fn settings_are_at_their_address_and_only_if_some_are_given() {
        let robot = bittybuzz_robot_files::find("crazyflie").unwrap();
        let settings = robot.settings_content(&["height_mm=2000".to_owned()]).unwrap();
        let elf = elf(elf::EM_ARM, &[VECTORS, (layout().script.address, &[5; 8])]);
        let made = |settings, id| content(&elf, &layout(), &Individual { settings, id }).unwrap();
        let start = (layout().settings.unwrap().address - PROGRAM) as usize;
        assert!(made(None, None).len() < start);
        let flash = made(settings.clone(), None);
        let [[a, b], [c, d]] = [2000_u16.to_le_bytes(), (!2000_u16).to_le_bytes()];
        assert_eq!(flash[start..][8..12], [a, b, c, d]);
        assert_eq!(flash.len(), start + 7 * 4);
        assert!(made(settings, Some(7)).starts_with(&flash));
    }

    #[test]
    fn a_program_must_lie_between_bootloader_and_end_of_flash() {
        let refused = |segments: &[(u32, &[u8])]| made(segments, None).unwrap_err();
        let place_of_bootloader: (u32, &[u8]) = (FLASH, &[1; 0x5000]);
        assert_eq!(refused(&[place_of_bootloader]), RawBinaryError::PlaceOfBootloader);
        assert_eq!(refused(&[(PROGRAM + 4, &[1])]), RawBinaryError::WrongStart);
        assert_eq!(refused(&[]), RawBinaryError::WrongStart);
        assert!(made(&[VECTORS, (FLASH_END - 1, &[1])], None).is_ok());
        let (start, end) = (FLASH_END - 1, u64::from(FLASH_END) + 1);
        assert_eq!(refused(&[VECTORS, (start, &[1, 2])]), RawBinaryError::TooLong { start, end });
        let in_ram = RawBinaryError::TooLong { start: 0x2000_0000, end: 0x2000_0001 };
        assert_eq!(refused(&[VECTORS, (0x2000_0000, &[1])]), in_ram);
    }

    #[test]
    fn other_files_are_refused() {
        let refused = |file: &[u8]| content(file, &layout(), &Individual::default()).unwrap_err();
        assert_eq!(refused(b":00000001FF"), RawBinaryError::NotArm);
        assert_eq!(refused(&elf(elf::EM_AVR, &[VECTORS])), RawBinaryError::NotArm);
    }
}
