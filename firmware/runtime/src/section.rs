//! The script's section of flash on robots without a log of scripts: a header and the image.
//!
//! | bytes | |
//! |---|---|
//! | 0 and 1 | length of the image, least significant byte first |
//! | 2 and 3 | CRC-16/MCRF4XX of the image |
//! | from 4 on | the image |
//!
//! If power fails while the section is written, a part of a script is left, whose last word may
//! hold anything. Such a part is often a valid script, but a different one. The checksum detects
//! all but one case in 65,536. `bittybuzz_robot_spec::Layout` writes sections.

use bittybuzz_vm_core::message::crc16;

/// The length of the header before the image, in bytes.
pub const HEADER: usize = 4;

/// Returns the length of the image after this header; `None` if the section was not written
/// completely.
pub fn length(header: [u8; HEADER], bytes: &[u8]) -> Option<usize> {
    let [low, high, check @ ..] = header;
    let length = usize::from(u16::from_le_bytes([low, high]));
    let found = bytes.get(..length)?.iter().fold(0xffff, |found, byte| crc16(found, *byte));
    (found == u16::from_le_bytes(check)).then_some(length)
}

#[cfg(test)]
mod tests {
    extern crate std;

    use std::vec::Vec;

    use super::*;

    fn section(image: &[u8]) -> Vec<u8> {
        let robot = bittybuzz_robot_files::find("zooids").expect("a shipped robot");
        robot.layout.expect("it has a layout").script_section(image).expect("it fits")
    }

    fn length_in(section: &[u8]) -> Option<usize> {
        let (header, bytes) = section.split_first_chunk()?;
        length(*header, bytes)
    }

    #[test]
    fn a_whole_section_is_accepted_whatever_follows() {
        assert_eq!(length_in(&[&section(b"a script")[..], &[0xff; 100]].concat()), Some(8));
        assert_eq!(length_in(&section(b"a script")[..11]), None, "longer than there is room");
    }

    #[test]
    fn erased_cleared_or_damaged_sections_hold_no_script() {
        assert_eq!(length_in(&[0xff; 3072]), None);
        assert_eq!(length_in(&[0; 3072]), None);
        let whole = section(b"a script");
        for at in 0..whole.len() {
            for bit in 0..8 {
                let mut damaged = whole.clone();
                damaged[at] ^= 1 << bit;
                assert_eq!(length_in(&damaged), None, "bit {bit} of byte {at}");
            }
        }
    }
}
