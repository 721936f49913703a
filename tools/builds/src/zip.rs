//! Writes zips, which store their files without compression (APPNOTE.TXT 6.3.9 of PKWARE): radios
//! are slower than any disk, and pages for browsers are compressed already.

/// 1 January 1980, the earliest date of the format. Equal binaries give equal zips.
const DATE: u16 = 1 << 5 | 1;

/// The version of the format in which files are stored.
const VERSION: u16 = 10;

/// Returns a zip with these files.
pub fn zip(files: &[(&str, &[u8])]) -> Vec<u8> {
    let (mut zip, mut directory) = (Vec::new(), Vec::new());
    for (name, content) in files {
        let start = zip.len() as u32;
        let size = content.len() as u32;
        // Version, flags, method, time, date; checksum, size stored and original, length of the name.
        let short: Vec<u8> =
            [VERSION, 0, 0, 0, DATE].into_iter().flat_map(u16::to_le_bytes).collect();
        let long: Vec<u8> =
            [crc32(content), size, size].into_iter().flat_map(u32::to_le_bytes).collect();
        let name_bytes = (name.len() as u16).to_le_bytes();
        let header = [&short[..], &long, &name_bytes, &[0; 2]].concat();
        zip.extend([b"PK\x03\x04", &header[..], name.as_bytes(), content].concat());
        let made_by = VERSION.to_le_bytes();
        // No comment, first disk, no attributes.
        let end = [&[0; 10], &start.to_le_bytes()[..], name.as_bytes()].concat();
        directory.extend([b"PK\x01\x02", &made_by[..], &header, &end].concat());
    }
    let count = (files.len() as u16).to_le_bytes();
    let (start, size) = (zip.len() as u32, directory.len() as u32);
    let places = [size, start].map(u32::to_le_bytes).concat();
    let end = [b"PK\x05\x06", &[0; 4][..], &count, &count, &places, &[0; 2]].concat();
    [zip, directory, end].concat()
}

/// Returns the checksum of the format (APPNOTE.TXT 4.4.7).
fn crc32(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(u32::MAX, |check, byte| {
        (0..8).fold(check ^ u32::from(*byte), |check, _| {
            check >> 1 ^ if check & 1 == 1 { 0xedb8_8320 } else { 0 }
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The check value of CRC-32/ISO-HDLC in the catalog of parametrised CRC algorithms.
    #[test]
    fn the_checksum_is_that_of_the_format() {
        assert_eq!(crc32(b"123456789"), 0xcbf4_3926);
    }
}
