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
    /// Of a robot with this in the flash of its id, and a chip of this hash.
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

/// A hash of a chip's unique id: 32-bit FNV-1a.
pub fn hash(unique_id: &[u8]) -> u32 {
    let of_byte = |hash: u32, byte: &u8| (hash ^ u32::from(*byte)).wrapping_mul(0x0100_0193);
    unique_id.iter().fold(0x811c_9dc5, of_byte)
}

#[cfg(test)]
mod tests {
    use super::{Id, hash, written};

    /// Vectors of the hash's authors.
    #[test]
    fn fnv_1a() {
        assert_eq!(hash(b""), 0x811c_9dc5);
        assert_eq!(hash(b"a"), 0xe40c_292c);
        assert_eq!(hash(b"foobar"), 0xbf9c_f968);
    }

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
