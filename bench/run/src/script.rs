//! The script in a linked program: a header and the image replace [`ROOM`] bytes.

/// The symbol of these bytes.
pub const SYMBOL: &str = "BENCH_SCRIPT";

/// The number of bytes for header and image.
pub const ROOM: usize = 4096;

/// The number of bytes before the image: two `u16`, least significant byte first. They are the
/// number of the global that holds the result, and the length of the image.
pub const HEADER: usize = 4;

/// The bit of the global's number by which the script may use all slots of the machine.
pub const ALL_SLOTS: u16 = 0x8000;

/// Returns the header.
pub fn header(global: u16, length: u16) -> [u8; HEADER] {
    let ([g0, g1], [l0, l1]) = (global.to_le_bytes(), length.to_le_bytes());
    [g0, g1, l0, l1]
}

/// Splits bytes into the number of the global and the image.
pub fn split(bytes: &[u8]) -> (u16, &[u8]) {
    match bytes {
        [g0, g1, l0, l1, rest @ ..] => {
            let length = usize::from(u16::from_le_bytes([*l0, *l1]));
            (u16::from_le_bytes([*g0, *g1]), rest.get(..length).unwrap_or(rest))
        }
        _ => (0, &[]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn header_and_image_are_split_again() {
        let mut bytes = [7; 20];
        bytes[..HEADER].copy_from_slice(&header(0x0102, 3));
        assert_eq!(split(&bytes), (0x0102, &[7, 7, 7][..]));
        // Damaged: no more than there is.
        bytes[..HEADER].copy_from_slice(&header(1, 17));
        assert_eq!(split(&bytes).1.len(), 16);
        assert_eq!(split(&bytes[..3]), (0, &[][..]));
    }
}
