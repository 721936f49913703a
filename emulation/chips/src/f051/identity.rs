//! The identity of the chip: read-only bytes of the system memory (RM0091 33, DS8668) and the
//! option bytes.

/// The unique identifier of three words (33.1).
const UNIQUE_ID: u32 = 0x1fff_f7ac;
/// The size of the flash in KiB, in the lower halfword (33.2).
const FLASH_SIZE: u32 = 0x1fff_f7cc;
/// The reference's conversion at 3.3 V and 30 °C, in the upper halfword of this word (DS8668, table "Internal reference
/// voltage calibration values"): 1.23 V / 3.3 V * 4096.
const VREFINT_CAL: u32 = 0x1fff_f7b8;
/// The option bytes RDP and USER, each with its complement, as delivered (4.1).
const OPTIONS: u32 = 0x1fff_f800;

pub(crate) struct Identity {
    unique_id: [u8; 12],
}

impl Identity {
    pub fn new(unique_id: [u8; 12]) -> Self {
        Identity { unique_id }
    }

    /// Returns the word at `address`, if it is in this area.
    pub fn read(&self, address: u32) -> Option<u32> {
        if !(0x1fff_e000..0x2000_0000).contains(&address) {
            return None;
        }
        let unique_word = address.checked_sub(UNIQUE_ID).map(|at| at as usize);
        Some(match (address, unique_word) {
            (VREFINT_CAL, _) => 1527 << 16,
            (FLASH_SIZE, _) => 0xffff_0040,
            (OPTIONS, _) => 0x00ff_55aa,
            (_, Some(at)) if at + 4 <= self.unique_id.len() => {
                let bytes = &self.unique_id[at..at + 4];
                u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]])
            }
            _ => 0xffff_ffff,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn identity_has_the_manuals_address() {
        let identity = Identity::new(*b"0123456789ab");
        assert_eq!(identity.read(0x1fff_f7ac), Some(u32::from_le_bytes(*b"0123")));
        assert_eq!(identity.read(0x1fff_f7b4), Some(u32::from_le_bytes(*b"89ab")));
        assert_eq!(identity.read(0x1fff_f7cc).map(|word| word & 0xffff), Some(64));
        assert_eq!(identity.read(0x4000_0000), None);
    }
}
