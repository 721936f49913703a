//! Which robot this is: a number that people have written to its flash, else one made of its chip's unique id.

/// Which robot this is, and how that is known.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Id {
    /// `bbz flash --id` has assigned it.
    Assigned(u16),
    /// A hash of the chip's unique id: some other robot may have the same.
    OfChip(u16),
}

impl Id {
    /// Returns the id of a robot with these words in the flash of its id, on a chip whose unique id has this hash.
    pub const fn new(in_flash: [u16; 2], chip: u32) -> Self {
        match written(in_flash) {
            Some(id) => Id::Assigned(id),
            None => Id::OfChip((chip >> 16) as u16 ^ chip as u16),
        }
    }

    /// The number.
    pub const fn number(self) -> u16 {
        match self {
            Id::Assigned(number) | Id::OfChip(number) => number,
        }
    }
}

/// The number of which this is the flash: the number and its complement, as `bittybuzz_robot_spec::Layout::id_section` says. `None` if
/// none was written since it was erased.
pub const fn written([number, complement]: [u16; 2]) -> Option<u16> {
    if number == !complement { Some(number) } else { None }
}

#[cfg(test)]
mod tests {
    use super::{Id, written};

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
}
