//! Makes the file that cfclient sends to a Crazyflie: it takes no raw binary, but a release of
//! Bitcraze, which is a zip with a manifest (cflib 0.1.34, cflib/bootloader/__init__.py).

use crate::zip::zip;

/// The name of the raw binary in the zip.
const BINARY: &str = "bittybuzz-crazyflie.bin";

/// The list of the files in the zip, and the processor of each.
const MANIFEST: &str = "manifest.json";

/// Returns a release with this raw binary for the STM32.
pub fn release(binary: &[u8]) -> Vec<u8> {
    let manifest = serde_json::json!({
        "version": 1,
        "files": { BINARY: {
            "platform": "cf2", "target": "stm32", "type": "fw", "release": env!("CARGO_PKG_VERSION"),
        } },
    });
    zip(&[(MANIFEST, manifest.to_string().as_bytes()), (BINARY, binary)])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// tests/hil flashes a release with cflib, which reads zips with Python's library.
    #[test]
    fn a_release_has_the_binary_as_it_is() {
        let release = release(b"binary");
        assert!(release.windows(6).any(|part| part == b"binary"));
        assert_eq!(release[..4], *b"PK\x03\x04");
        assert_eq!(release[release.len() - 22..][..4], *b"PK\x05\x06");
    }
}
