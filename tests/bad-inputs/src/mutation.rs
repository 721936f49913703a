//! Changes of bytes and texts.

use bittybuzz_random::Random;

/// Returns a number below `end`, and 0 if there is none.
pub fn below(random: &mut Random, end: usize) -> usize {
    random.below(u32::try_from(end).unwrap_or(u32::MAX)) as usize
}

/// Returns one of several values.
pub fn one<'a, T: ?Sized>(random: &mut Random, values: &[&'a T]) -> &'a T {
    values[below(random, values.len())]
}

/// Returns one of several byte strings.
pub fn any<'a>(random: &mut Random, values: &'a [Vec<u8>]) -> &'a [u8] {
    &values[below(random, values.len())]
}

/// Returns a part of one of several byte strings, from its start.
pub fn any_truncated(random: &mut Random, values: &[Vec<u8>]) -> Vec<u8> {
    let bytes = any(random, values);
    truncated(random, bytes)
}

/// Returns one of several byte strings with changes.
pub fn any_mutated(random: &mut Random, values: &[Vec<u8>]) -> Vec<u8> {
    let bytes = any(random, values);
    mutated(random, bytes)
}

/// Returns the bytes up to a random place.
pub fn truncated(random: &mut Random, bytes: &[u8]) -> Vec<u8> {
    bytes[..below(random, bytes.len())].to_vec()
}

/// Returns random bytes, at most `most`.
pub fn noise(random: &mut Random, most: usize) -> Vec<u8> {
    (0..below(random, most)).map(|_| random.bits() as u8).collect()
}

/// Numbers at which widths end.
const EDGES: [u64; 9] = [0, 1, 0x7f, 0x80, 0xff, 0x7fff, 0xffff, 0x7fff_ffff, u64::MAX];

/// Returns a number of changes, half of the time 1.
fn changes(random: &mut Random) -> usize {
    [1, 1, 1, 2, 3, 8][below(random, 6)]
}

/// Returns the bytes with 1 to 8 changes: other bits, other bytes, numbers at which widths end, and
/// parts that are removed, doubled or moved.
pub fn mutated(random: &mut Random, bytes: &[u8]) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    for _ in 0..changes(random) {
        if bytes.is_empty() {
            return noise(random, 64);
        }
        let at = below(random, bytes.len());
        let end = (at + 1 + below(random, 16)).min(bytes.len());
        match random.below(7) {
            0 => bytes[at] ^= 1 << random.below(8),
            1 => bytes[at] = random.bits() as u8,
            2 => {
                let edge = EDGES[below(random, EDGES.len())].to_le_bytes();
                let width = [1, 2, 4, 8][below(random, 4)].min(bytes.len() - at);
                bytes[at..at + width].copy_from_slice(&edge[..width]);
            }
            3 => drop(bytes.drain(at..end)),
            4 => {
                let part = bytes[at..end].to_vec();
                bytes.splice(at..at, part);
            }
            5 => {
                let part = bytes[at..end].to_vec();
                let to = below(random, bytes.len());
                bytes.splice(to..to, part);
            }
            _ => {
                let part = noise(random, 16);
                bytes.splice(at..at, part);
            }
        }
    }
    bytes
}

/// Returns the text with 1 to 8 lines or words that are exchanged, doubled, removed or replaced by
/// `words`.
pub fn changed_text(random: &mut Random, text: &str, words: &[&str]) -> String {
    let mut parts: Vec<&str> = text.split_inclusive([' ', '\n', '(', ')', ',', '=']).collect();
    for _ in 0..changes(random) {
        if parts.is_empty() {
            break;
        }
        let at = below(random, parts.len());
        let other = below(random, parts.len());
        match random.below(5) {
            0 => parts.swap(at, other),
            1 => parts.insert(at, parts[other]),
            2 => drop(parts.remove(at)),
            3 => parts[at] = one(random, words),
            _ => parts.insert(at, one(random, words)),
        }
    }
    parts.concat()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A seed repeats its input on any computer.
    #[test]
    fn equal_seeds_give_equal_inputs() {
        let input = |seed| mutated(&mut Random::new(seed), b"some bytes that are long enough");
        assert_eq!(input(7), input(7));
        assert_ne!(input(7), input(8));
        assert_eq!(mutated(&mut Random::new(1), b"").len() / 64, 0);
    }
}
