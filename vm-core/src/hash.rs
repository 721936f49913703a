//! FNV-1a with 32 bits, the only hash for names, scripts, messages and chips.
//!
//! The hash needs no table and is `const`, so firmware compares the numbers of names that the
//! compiler has computed.

/// The offset basis, which is the hash of no bytes.
const BASIS: u32 = 0x811c_9dc5;
const PRIME: u32 = 0x0100_0193;

/// Returns the hash of these bytes.
#[inline]
pub const fn fnv_1a(bytes: &[u8]) -> u32 {
    fnv_1a_from(BASIS, bytes)
}

/// Returns the hash of a sequence whose first bytes have this `hash` and whose remaining bytes are
/// `bytes`.
#[inline]
pub const fn fnv_1a_from(mut hash: u32, mut bytes: &[u8]) -> u32 {
    while let [first, rest @ ..] = bytes {
        hash = (hash ^ *first as u32).wrapping_mul(PRIME);
        bytes = rest;
    }
    hash
}

/// Returns the number by which images and robots identify a robot function: the hash of the name,
/// folded to 16 bits by xor of its halves. An image therefore depends neither on the order nor on
/// the number of functions that a robot offers.
///
/// ```
/// use bittybuzz_vm_core::hash::name_hash;
/// const LED: u16 = name_hash("led");
/// assert_eq!(LED, 0xaaa0);
/// ```
pub const fn name_hash(name: &str) -> u16 {
    let hash = fnv_1a(name.as_bytes());
    (hash >> 16) as u16 ^ hash as u16
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The hashes that the FNV authors publish for these texts.
    const PUBLISHED: [(&str, u32); 3] =
        [("", 0x811c_9dc5), ("a", 0xe40c_292c), ("foobar", 0xbf9c_f968)];

    #[test]
    fn hashes_are_the_published_ones() {
        for (text, hash) in PUBLISHED {
            assert_eq!(fnv_1a(text.as_bytes()), hash, "{text:?}");
            assert_eq!(u32::from(name_hash(text)), hash >> 16 ^ hash & 0xffff, "{text:?}");
        }
    }

    #[test]
    fn a_hash_can_be_continued() {
        assert_eq!(fnv_1a_from(fnv_1a(b"foo"), b"bar"), fnv_1a(b"foobar"));
    }
}
