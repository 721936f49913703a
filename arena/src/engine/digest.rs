//! Digests: one number that stands for the state of a run, to compare runs across machines.

use core::fmt::{self, Debug, Write};
use core::hash::Hasher;

use super::geometry::Pose;

/// The bits that every NaN has in a digest. Processors and WebAssembly engines produce NaNs with
/// different bits for the same operation.
const NAN: u32 = 0x7fc0_0000;

/// A hash of the state, computed in words of 64 bits, that is the same number in every build. The
/// standard library guarantees neither that its own hasher stays the same nor that derived hashes
/// are independent of the width of `usize`.
#[derive(Clone, Debug)]
pub struct Digest(u64);

impl Digest {
    /// Returns an empty digest.
    pub(crate) fn new() -> Self {
        Digest(0xcbf2_9ce4_8422_2325)
    }

    /// Adds a float.
    pub(crate) fn float(&mut self, value: f32) {
        self.write_u32(if value.is_nan() { NAN } else { value.to_bits() });
    }

    /// Adds a place and a heading.
    pub(crate) fn pose(&mut self, Pose { x, y, z, heading }: &Pose) {
        [x, y, z, heading].into_iter().for_each(|part| self.float(*part));
    }

    /// Adds the `Debug` text of a state that is too varied to be hashed field by field. The text of a float is the same on every
    /// machine, and that of every NaN is `NaN`.
    pub(crate) fn text_of(&mut self, state: &dyn Debug) {
        write!(self, "{state:?}").expect("writing to a digest never fails");
    }
}

impl Hasher for Digest {
    fn finish(&self) -> u64 {
        let mixed = (self.0 ^ self.0 >> 32).wrapping_mul(0xd6e8_feb8_6659_fd93);
        mixed ^ mixed >> 32
    }

    fn write(&mut self, bytes: &[u8]) {
        for chunk in bytes.chunks(8) {
            let mut word = [0; 8];
            word.iter_mut().zip(chunk).for_each(|(to, byte)| *to = *byte);
            self.write_u64(u64::from_le_bytes(word));
        }
    }

    fn write_u8(&mut self, value: u8) {
        self.write_u64(value.into());
    }

    fn write_u16(&mut self, value: u16) {
        self.write_u64(value.into());
    }

    fn write_u32(&mut self, value: u32) {
        self.write_u64(value.into());
    }

    fn write_u64(&mut self, value: u64) {
        self.0 = (self.0.rotate_left(29) ^ value).wrapping_mul(0xd6e8_feb8_6659_fd93);
    }

    /// Adds a length as 64 bits, because the width of `usize` differs between machines.
    fn write_usize(&mut self, value: usize) {
        self.write_u64(value as u64);
    }

    /// Adds a signed number or the variant of an enum as 64 bits, because the width of `isize`
    /// differs between machines.
    fn write_isize(&mut self, value: isize) {
        self.write_u64(value as i64 as u64);
    }
}

impl Write for Digest {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        self.write(text.as_bytes());
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use core::hash::Hash;

    use super::*;

    fn digest(add: impl FnOnce(&mut Digest)) -> u64 {
        let mut digest = Digest::new();
        add(&mut digest);
        digest.finish()
    }

    /// Processors differ in the sign and the payload of the NaN that 0/0 gives.
    #[test]
    fn every_nan_has_the_same_digest() {
        let nans = [NAN, 0xffc0_0000, 0x7f80_0001].map(f32::from_bits);
        let [one, others @ ..] = nans.map(|nan| digest(|digest| digest.float(nan)));
        assert_eq!(others, [one; 2]);
        let [one, others @ ..] = nans.map(|nan| digest(|digest| digest.text_of(&[nan])));
        assert_eq!(others, [one; 2]);
        assert_ne!(digest(|digest| digest.float(0.0)), digest(|digest| digest.float(-0.0)));
    }

    /// Derived hashes of enums and lengths write `isize` and `usize`, which WebAssembly has in 32 bits.
    #[test]
    fn lengths_and_variants_are_hashed_in_64_bits() {
        let wide = digest(|digest| digest.write_u64(3));
        assert_eq!(digest(|digest| digest.write_usize(3)), wide);
        assert_eq!(digest(|digest| digest.write_isize(3)), wide);
        assert_eq!(digest(|digest| digest.write_isize(-1)), digest(|d| d.write_u64(u64::MAX)));
    }

    #[test]
    fn the_digest_depends_on_the_order() {
        let of = |one: u64, other: u64| digest(|digest| (one, other).hash(digest));
        assert_ne!(of(1, 2), of(2, 1));
        assert_ne!(of(0, 1), of(0, 0));
    }
}
