//! CRC-16/MCRF4XX, one byte after the other: the check of Kilobots' frames (from 0xffff) and of contents.

/// The check of what was checked before, and one more byte.
// A loop over bits: a table would take more flash than the rest of the messages.
#[inline(never)]
pub const fn crc16(check: u16, byte: u8) -> u16 {
    let mut check = check ^ byte as u16;
    let mut bit = 0;
    while bit < 8 {
        check = if check & 1 != 0 { check >> 1 ^ 0x8408 } else { check >> 1 };
        bit += 1;
    }
    check
}
