//! Scripts that directly follow the program in flash. The length of the program is not known
//! beforehand, so a mark shows where the script begins.
//!
//! ```text
//! mark (4) | parts of the machine (u16, see [`Parts`]) | length of the rest (u16, least significant byte first) | image with its seal
//! ```

use bittybuzz_vm_core::image::{MAGIC, VERSION, VERSION_BITS};
use bittybuzz_vm_core::{Part, Parts};

use crate::Robot;

/// The first bytes of the section of a script.
pub const SCRIPT_MARK: [u8; 4] = *b"bbz\x02";

/// Bytes before the image.
const HEADER: usize = SCRIPT_MARK.len() + 4;

/// A reason why a program has no place for a script.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NoSection {
    /// There is no mark.
    Missing,
    /// There are several marks, or bytes follow the script.
    Ambiguous,
    /// The program was built by another version of the toolchain: its own script is an image of
    /// this version.
    Version(u8),
}

/// Returns the section with a sealed image for a machine with these parts; `None` if the image is
/// too long.
pub fn script_section(parts: Parts, sealed: &[u8]) -> Option<Vec<u8>> {
    let length = u16::try_from(sealed.len()).ok()?.to_le_bytes();
    Some([&SCRIPT_MARK[..], &parts.bits().to_le_bytes(), &length, sealed].concat())
}

/// Returns the start of the section in a program, and the parts of the program's machine.
pub fn find_script_section(program: &[u8]) -> Result<(usize, Parts), NoSection> {
    let mut found = Err(NoSection::Missing);
    for (at, bytes) in program.windows(HEADER).enumerate() {
        let Some([few, more, low, high]) = bytes.strip_prefix(&SCRIPT_MARK) else { continue };
        if found.is_ok()
            || at + HEADER + usize::from(u16::from_le_bytes([*low, *high])) != program.len()
        {
            return Err(NoSection::Ambiguous);
        }
        found = Ok((at, Parts::from_bits(u16::from_le_bytes([*few, *more]))));
    }
    let (at, parts) = found?;
    match program.get(at + HEADER..) {
        Some([MAGIC, form, ..]) if form & VERSION_BITS != VERSION => {
            Err(NoSection::Version(form & VERSION_BITS))
        }
        _ => Ok((at, parts)),
    }
}

impl Robot {
    /// Returns this robot with firmware whose machine has only these parts.
    pub fn limited_to(mut self, parts: Parts) -> Robot {
        self.parts = parts;
        self.vm.maths &= parts.has(Part::Maths);
        for (part, size) in [
            (Part::Neighbors, &mut self.vm.neighbors),
            (Part::Swarms, &mut self.vm.swarms),
            (Part::Stigmergy, &mut self.vm.stigmergy_entries),
            (Part::LongMessages, &mut self.vm.in_long),
            (Part::LongMessages, &mut self.vm.out_long),
        ] {
            if !parts.has(part) {
                *size = 0;
            }
        }
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_section_is_found_after_any_program() {
        let section = script_section(Parts::from_bits(0x105), b"an image").unwrap();
        assert_eq!(section, b"bbz\x02\x05\x01\x08\x00an image");
        for length in 0..40 {
            let program = [&vec![b'b'; length][..], &section].concat();
            assert_eq!(find_script_section(&program), Ok((length, Parts::from_bits(0x105))));
        }
        assert_eq!(script_section(Parts::NONE, &[0; 0x1_0000]), None);
    }

    #[test]
    fn programs_without_exactly_one_script_are_refused() {
        let section = script_section(Parts::NONE, b"an image").unwrap();
        assert_eq!(find_script_section(b"bbz"), Err(NoSection::Missing));
        assert_eq!(find_script_section(&[]), Err(NoSection::Missing));
        let twice = [&section[..], &section].concat();
        assert_eq!(find_script_section(&twice), Err(NoSection::Ambiguous));
        let behind = [&section[..], b"more"].concat();
        assert_eq!(find_script_section(&behind), Err(NoSection::Ambiguous));
        assert_eq!(find_script_section(&section[..10]), Err(NoSection::Ambiguous));
        // The program's own script is an image of version 1.
        let old = script_section(Parts::NONE, &[MAGIC, 0x81, 0, 1, 2, 3, 4]).unwrap();
        let program = [&[7; 30][..], &old].concat();
        assert_eq!(find_script_section(&program), Err(NoSection::Version(1)));
        let own = script_section(Parts::NONE, &[MAGIC, 0x80 | VERSION]).unwrap();
        assert_eq!(find_script_section(&own), Ok((0, Parts::NONE)));
    }
}
