//! Scripts that lie right behind the program in flash, where nobody can say beforehand how long the program is: a mark tells where.
//!
//! ```text
//! mark (4) | features of the machine (1) | length of the rest (u16, least significant byte first) | image with its seal
//! ```

use bittybuzz_vm_core::builtin::Feature;

use crate::Robot;

/// What such a section begins with.
pub const SCRIPT_MARK: [u8; 4] = *b"bbz\x01";

/// Bytes before the image.
const HEADER: usize = SCRIPT_MARK.len() + 3;

/// Why there is no place for a script in a program.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NoSection {
    /// There is no mark.
    Missing,
    /// There are several marks, or something stands behind the script.
    Ambiguous,
}

/// The section with a sealed image, for a machine with these features; `None` if the image is too long.
pub fn script_section(features: u8, sealed: &[u8]) -> Option<Vec<u8>> {
    let [low, high] = u16::try_from(sealed.len()).ok()?.to_le_bytes();
    Some([&SCRIPT_MARK[..], &[features, low, high], sealed].concat())
}

/// Where in a program the section begins, and the features of the program's machine.
pub fn find_script_section(program: &[u8]) -> Result<(usize, u8), NoSection> {
    let mut found = Err(NoSection::Missing);
    for (at, bytes) in program.windows(HEADER).enumerate() {
        let Some([features, low, high]) = bytes.strip_prefix(&SCRIPT_MARK) else { continue };
        if found.is_ok()
            || at + HEADER + usize::from(u16::from_le_bytes([*low, *high])) != program.len()
        {
            return Err(NoSection::Ambiguous);
        }
        found = Ok((at, *features));
    }
    found
}

impl Robot {
    /// This robot with firmware whose machine has only these features.
    pub fn limited_to(mut self, features: u8) -> Robot {
        let has = |feature: Feature| features & feature as u8 != 0;
        self.vm.maths &= has(Feature::Maths);
        for (feature, size) in [
            (Feature::Neighbors, &mut self.vm.neighbors),
            (Feature::Swarm, &mut self.vm.swarms),
            (Feature::Stigmergy, &mut self.vm.stigmergy_entries),
        ] {
            if !has(feature) {
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
    fn a_section_is_found_behind_any_program() {
        let section = script_section(5, b"an image").unwrap();
        assert_eq!(section, b"bbz\x01\x05\x08\x00an image");
        for length in 0..40 {
            let program = [&vec![b'b'; length][..], &section].concat();
            assert_eq!(find_script_section(&program), Ok((length, 5)));
        }
        assert_eq!(script_section(0, &[0; 0x1_0000]), None);
    }

    #[test]
    fn what_is_no_program_with_one_script_is_refused() {
        let section = script_section(0, b"an image").unwrap();
        assert_eq!(find_script_section(b"bbz"), Err(NoSection::Missing));
        assert_eq!(find_script_section(&[]), Err(NoSection::Missing));
        let twice = [&section[..], &section].concat();
        assert_eq!(find_script_section(&twice), Err(NoSection::Ambiguous));
        let behind = [&section[..], b"more"].concat();
        assert_eq!(find_script_section(&behind), Err(NoSection::Ambiguous));
        assert_eq!(find_script_section(&section[..10]), Err(NoSection::Ambiguous));
    }
}
