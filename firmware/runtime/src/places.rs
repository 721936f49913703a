//! The log of scripts in flash. The robot runs the newest complete script: after a loss of power
//! during a write it has the old script or the new one.
//!
//! The log is a row of places of 4 KiB, with one script in each:
//!
//! | bytes | |
//! |---|---|
//! | 0 to 3 | length of the image, least significant byte first |
//! | from 4 on | the image |
//! | 4088 to 4091 | sequence number: the greatest is the newest script; of equals, the first |
//! | 4092 to 4095 | CRC-16/MCRF4XX of length, image and sequence number, and its complement |
//!
//! The last eight bytes, the mark, are written last. The checksum also detects a place that was
//! written in another order, or whose bytes are damaged. `bittybuzz_robot_spec::Layout` writes
//! places, and this module reads them.

use bittybuzz_vm_core::message::crc16;

/// The size of a place, in bytes.
pub const PLACE: usize = 4096;

/// The bytes of a place for an image. The longest one is shorter: see
/// [`FlashArea`](bittybuzz_vm_core::FlashArea).
pub const IMAGE_AREA: usize = PLACE - LENGTH - MARK;

const LENGTH: usize = size_of::<u32>();
const MARK: usize = 8;

/// A script in its place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StoredScript<'a> {
    /// The part of the place for the image. Bytes beyond the length have no meaning.
    pub bytes: &'a [u8; IMAGE_AREA],
    /// The length of the image, in bytes.
    pub length: usize,
    sequence: u32,
}

impl<'a> StoredScript<'a> {
    /// Returns the script in a place, if it is complete and newer than `known`. The sequence number
    /// is compared first, because the checksum reads every byte.
    fn read(place: &'a [u8; PLACE], known: Option<StoredScript<'_>>) -> Option<Self> {
        let (length, rest) = place.split_first_chunk::<LENGTH>()?;
        let (bytes, mark) = rest.split_first_chunk::<IMAGE_AREA>()?;
        let (sequence, check) = mark.split_first_chunk::<4>()?;
        let [low, high, not_low, not_high] = *check.first_chunk::<4>()?;
        let stored = StoredScript {
            bytes,
            length: usize::try_from(u32::from_le_bytes(*length)).ok()?,
            sequence: u32::from_le_bytes(*sequence),
        };
        if known.is_some_and(|known| known.sequence >= stored.sequence) {
            return None;
        }
        let content = length.iter().chain(bytes.get(..stored.length)?).chain(sequence);
        let expected = content.fold(0xffff, |check, byte| crc16(check, *byte));
        let is_whole = u16::from_le_bytes([low, high]) == expected
            && u16::from_le_bytes([not_low, not_high]) == !expected;
        is_whole.then_some(stored)
    }
}

/// Returns the newest complete script; `None` if there is none.
pub fn newest(places: &[[u8; PLACE]]) -> Option<StoredScript<'_>> {
    let mut newest = None;
    for place in places {
        newest = StoredScript::read(place, newest).or(newest);
    }
    newest
}

#[cfg(test)]
mod tests {
    extern crate std;

    use std::vec;
    use std::vec::Vec;

    use bittybuzz_robot_spec::Layout;
    use bittybuzz_vm_core::FlashArea;

    use super::*;

    /// Two sectors with one place each are enough, since the other places are erased.
    type Flash = [[u8; PLACE]; 2];

    fn layout() -> Layout {
        let robot = bittybuzz_robot_files::find("crazyflie").expect("a shipped robot");
        robot.layout.expect("it has a layout")
    }

    fn place(image: &[u8]) -> [u8; PLACE] {
        layout().script_section(image).expect("it fits").try_into().expect("a whole place")
    }

    fn image(flash: &Flash) -> Option<Vec<u8>> {
        newest(flash).map(|stored| stored.bytes[..stored.length].to_vec())
    }

    #[test]
    fn an_erased_or_cleared_log_has_no_script() {
        assert_eq!(image(&[[0xff; PLACE]; 2]), None);
        assert_eq!(image(&[[0; PLACE]; 2]), None);
    }

    #[test]
    fn the_longest_image_fits() {
        let most = layout().most_script() as usize;
        let long = vec![7; most];
        assert_eq!(image(&[[0xff; PLACE], place(&long)]), Some(long));
        assert_eq!(layout().script_section(&vec![7; most + 1]), None);
        assert_eq!(most, FlashArea::<IMAGE_AREA>::LENGTH_MAX);
    }

    #[test]
    fn the_greater_number_is_newer_and_of_equal_ones_the_first() {
        let numbered = |image: &[u8], sequence: u32| {
            let mut place = place(image);
            place[4088..4092].copy_from_slice(&sequence.to_le_bytes());
            let content = [&place[..4 + image.len()], &place[4088..4092]].concat();
            let check = content.iter().fold(0xffff, |check, byte| crc16(check, *byte));
            place[4092..4094].copy_from_slice(&check.to_le_bytes());
            place[4094..].copy_from_slice(&(!check).to_le_bytes());
            place
        };
        for (first, second, expected) in
            [(1, 2, b"new"), (2, 1, b"old"), (1, 1, b"old"), (u32::MAX, 0, b"old")]
        {
            let flash = [numbered(b"old", first), numbered(b"new", second)];
            assert_eq!(image(&flash).as_deref(), Some(&expected[..]), "{first} {second}");
        }
    }

    #[test]
    fn any_damaged_byte_is_noticed() {
        let whole = place(b"a script");
        let used = (0..12).chain(4088..PLACE);
        for at in used {
            for bit in 0..8 {
                let mut damaged = whole;
                damaged[at] ^= 1 << bit;
                assert_eq!(image(&[damaged, [0xff; PLACE]]), None, "bit {bit} of byte {at}");
            }
        }
    }

    /// `bbz flash` writes both sectors, one after the other: it erases the sector and writes it
    /// word by word. At any loss of power the robot has the old script or the new one.
    #[test]
    fn a_power_failure_leaves_the_old_or_the_new_script() {
        let (old, new) = (place(b"the old script"), place(b"a new, longer script"));
        let mut flash = [old, old];
        let mut seen_new = false;
        for sector in 0..2 {
            // A sector may hold anything if power fails while it is erased.
            let noise = |at: usize| (at as u8).wrapping_mul(167) ^ 0x5a;
            flash[sector] = core::array::from_fn(noise);
            let after_noise = image(&flash);
            flash[sector] = [0xff; PLACE];
            let after_erasing = image(&flash);
            assert_eq!(after_noise, after_erasing);
            for word in (0..PLACE).step_by(4) {
                let now = image(&flash).expect("a script");
                seen_new |= now == b"a new, longer script";
                assert!(now == b"the old script" || seen_new, "{sector} {word}");
                assert!(!seen_new || now == b"a new, longer script", "back to the old one");
                flash[sector][word..word + 4].copy_from_slice(&new[word..word + 4]);
            }
        }
        assert_eq!(image(&flash).as_deref(), Some(&b"a new, longer script"[..]));
    }
}
