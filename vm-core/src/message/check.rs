//! CRC-16/MCRF4XX, computed byte by byte. It is the check of Kilobots' frames (from 0xffff) and of
//! contents.

/// Extends a check by one more byte.
// All eight bits are computed at once, as by `_crc_ccitt_update` of avr-libc. A table would take
// more flash than the rest of the messages. An AVR calculates with bytes, all other processors with
// words.
#[cfg_attr(target_arch = "avr", one_copy)]
#[cfg_attr(not(target_arch = "avr"), hot)]
pub const fn crc16(check: u16, byte: u8) -> u16 {
    if cfg!(target_arch = "avr") {
        let [low, high] = check.to_le_bytes();
        let mut quotient = byte ^ low;
        quotient ^= quotient << 4;
        u16::from_le_bytes([high, quotient]) ^ (quotient >> 4) as u16 ^ (quotient as u16) << 3
    } else {
        let check = check as u32;
        let mut quotient = (check ^ byte as u32) & 0xff;
        quotient = (quotient ^ quotient << 4) & 0xff;
        (check >> 8 ^ quotient << 8 ^ quotient >> 4 ^ quotient << 3) as u16
    }
}

/// For each byte, the check of this byte followed by no, one, two ... seven zeros, starting from 0.
static CHECKS: [[u16; 256]; 8] = {
    let mut checks = [[0; 256]; 8];
    let mut at = 0;
    while at < 8 * 256 {
        let (zeros, byte) = (at / 256, at % 256);
        checks[zeros][byte] = match zeros {
            0 => crc16(0, byte as u8),
            _ => crc16(checks[zeros - 1][byte], 0),
        };
        at += 1;
    }
    checks
};

/// Continues a check with more bytes. Computers take eight bytes at once from a table.
pub(super) fn wide_crc16(check: u16, bytes: &[u8]) -> u16 {
    let [c0, c1, c2, c3, c4, c5, c6, c7] = &CHECKS;
    let of = |table: &[u16; 256], byte: &u8| table[usize::from(*byte)];
    let (eights, rest) = bytes.as_chunks();
    let check = eights.iter().fold(check, |check, [a, b, c, d, e, f, g, h]| {
        let [low, high] = check.to_le_bytes();
        let later = of(c5, c) ^ of(c4, d) ^ of(c3, e) ^ of(c2, f) ^ of(c1, g) ^ of(c0, h);
        of(c7, &(low ^ a)) ^ of(c6, &(high ^ b)) ^ later
    });
    rest.iter().fold(check, |check, byte| check >> 8 ^ of(c0, &(check as u8 ^ byte)))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Computes the check bit by bit, as it is defined.
    fn by_bits(check: u16, byte: u8) -> u16 {
        let mut check = check ^ u16::from(byte);
        for _ in 0..8 {
            check = if check & 1 != 0 { check >> 1 ^ 0x8408 } else { check >> 1 };
        }
        check
    }

    #[test]
    fn all_bits_at_once_are_the_same_as_one_by_one() {
        for check in 0..=u16::MAX {
            assert_eq!(crc16(check, 0), by_bits(check, 0));
            assert_eq!(crc16(check, check as u8 ^ 0x5a), by_bits(check, check as u8 ^ 0x5a));
        }
    }

    #[test]
    fn eight_bytes_at_once_are_the_same_as_one_after_the_other() {
        let bytes: [u8; 19] = core::array::from_fn(|at| (at as u8).wrapping_mul(151) ^ 0x5a);
        for length in 0..=bytes.len() {
            let bytes = &bytes[..length];
            for check in 0..=u16::MAX {
                assert_eq!(wide_crc16(check, bytes), bytes.iter().fold(check, |c, b| crc16(c, *b)));
            }
        }
    }

    /// The check value that catalogues of CRCs give for CRC-16/MCRF4XX.
    #[test]
    fn the_check_is_the_standard_one() {
        assert_eq!(b"123456789".iter().fold(0xffff, |check, byte| crc16(check, *byte)), 0x6f91);
    }
}
