//! How an image names the functions of a robot: by a hash of the name, so that an image depends neither on the
//! order nor on the number of functions that a robot offers.

/// The number by which images and robots know a robot function: the 32-bit FNV-1a hash of the name, folded to
/// 16 bits by xor of its halves.
///
/// ```
/// use bittybuzz_vm_core::link::name_hash;
/// const LED: u16 = name_hash("led");
/// assert_eq!(LED, 0xaaa0);
/// ```
pub const fn name_hash(name: &str) -> u16 {
    let bytes = name.as_bytes();
    let mut hash: u32 = 0x811c_9dc5;
    let mut i = 0;
    while i < bytes.len() {
        hash ^= bytes[i] as u32;
        hash = hash.wrapping_mul(0x0100_0193);
        i += 1;
    }
    (hash >> 16) as u16 ^ hash as u16
}

#[cfg(test)]
mod tests {
    use super::name_hash;

    /// The 32-bit hashes that the FNV authors publish for these texts, folded by hand.
    #[test]
    fn published_vectors() {
        assert_eq!(name_hash(""), 0x811c ^ 0x9dc5);
        assert_eq!(name_hash("a"), 0xe40c ^ 0x292c);
        assert_eq!(name_hash("foobar"), 0xbf9c ^ 0xf968);
    }
}
