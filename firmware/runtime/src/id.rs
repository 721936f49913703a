//! The robot's id: a number that `bbz flash --id` wrote to flash, or else a hash of the chip's
//! unique id.

/// The robot's id and its origin.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Id {
    /// The id that `bbz flash --id` assigned.
    Assigned(u16),
    /// A hash of the chip's unique id. Another robot may have the same one.
    OfChip(u16),
}

impl Id {
    /// Returns the id of a robot. `in_flash` is the content of its id section, and `chip` is a hash
    /// of the chip's unique id.
    pub const fn new(in_flash: [u16; 2], chip: u32) -> Self {
        match written(in_flash) {
            Some(id) => Id::Assigned(id),
            None => Id::OfChip((chip >> 16) as u16 ^ chip as u16),
        }
    }

    /// Returns the number.
    pub const fn number(self) -> u16 {
        match self {
            Id::Assigned(number) | Id::OfChip(number) => number,
        }
    }
}

/// Returns the number in an id section, which is the number and its complement
/// (`bittybuzz_robot_spec::Layout::id_section`). Returns `None` if no number was written since the
/// section was erased, or if it is damaged.
pub const fn written([number, complement]: [u16; 2]) -> Option<u16> {
    if number == !complement { Some(number) } else { None }
}

/// Returns true if a section holds no number and is not erased either: power failed while it was written,
/// or the flash lost a bit.
pub const fn is_damaged(section: [u16; 2]) -> bool {
    written(section).is_none() && !matches!(section, [0xffff, 0xffff])
}

#[cfg(test)]
mod tests {
    use super::{Id, is_damaged, written};

    #[test]
    fn erased_flash_holds_no_number() {
        assert_eq!(written([0xffff, 0xffff]), None);
        assert_eq!(written([0, 0]), None);
        for id in [0, 1, 7, 0x1234, 0xfffe, 0xffff] {
            assert_eq!(written([id, !id]), Some(id));
            assert_eq!(Id::new([id, !id], 5), Id::Assigned(id));
            assert_eq!(Id::new([id, !id ^ 0x10], 0x1234_0005), Id::OfChip(0x1231));
        }
    }
    #[test]
    fn a_section_that_is_neither_erased_nor_written_is_damaged() {
        assert!(!is_damaged([0xffff, 0xffff]));
        for number in [0, 1, 700, 0xfffe, 0xffff] {
            assert!(!is_damaged([number, !number]));
            for bit in 0..16 {
                assert!(is_damaged([number ^ 1 << bit, !number]));
                assert!(is_damaged([number, !number ^ 1 << bit]));
            }
        }
        // The complement is written last, and zero is written over whatever the flash held.
        assert!(is_damaged([700, 0xffff]));
        assert!(is_damaged([0, 0]));
    }
}
