//! Images that are verified where they are built.
//!
//! The verifier takes two kilobytes of a small robot's flash. A robot does not need it if its image
//! lies in flash and is replaced only by tools that verify. Such a tool loads the image into a
//! machine like the robot's. If that machine accepts the image, the tool appends a **seal**
//! ([`Vm::seal`](crate::Vm::seal)). The robot checks the seal
//! ([`Vm::load_sealed`](crate::Vm::load_sealed)) instead of the code.
//!
//! # Who is trusted
//! A seal trusts everyone who can write the robot's flash, and so could write any program. It finds
//! mistakes: an image that no tool has verified, that was changed or written in part, or that
//! belongs to another robot, or to one with other functions or memory. It is a CRC of 16 bits and
//! no signature: bytes from strangers, by radio for example, must pass
//! [`Vm::load`](crate::Vm::load).
//!
//! # Layout
//! A sealed image consists of the image, the numbers of its header as 16-bit words (see
//! [`ImageHeader`]), and the complement of the CRC over the robot's [offer](robot), the number of its
//! slots, and all bytes before. The CRC itself would also be found in an image with a zero after it.

use crate::bytecode::ByteCode;
use crate::image::{ImageError, ImageHeader, VERSION, Verified, WORDS};
use crate::message::crc16;
use crate::network::Sizes;
use crate::number::Profile;
use crate::part::Parts;
use crate::verify::within;

/// Bytes that a seal adds to an image.
pub const LENGTH: usize = 2 * WORDS + CHECK;
const CHECK: usize = 2;

/// Bytes that may be an image with its seal.
#[derive(Debug, Clone, Copy)]
pub struct SealedImage<C: ByteCode> {
    pub(crate) code: C,
}

/// Returns the robot's offer to scripts as one number. It covers the version, the profile, the
/// machine's [`features`](crate::features) for which it has room, the machine's parts, and the name
/// hashes of its functions in their order.
pub const fn robot<P: Profile>(features: u8, sizes: Sizes, parts: Parts, functions: &[u16]) -> u16 {
    let mut check = crc16(crc16(crc16(0xffff, VERSION), P::FULL as u8), within(features, sizes));
    check = word(check, parts.bits());
    let mut number = 0;
    while number < functions.len() {
        check = word(check, functions[number]);
        number += 1;
    }
    check
}

impl<C: ByteCode> SealedImage<C> {
    /// Takes any bytes; they are checked when a machine loads them.
    pub fn new(code: C) -> Self {
        SealedImage { code }
    }

    /// Reads the header if the seal is intact and was made for this robot and this number of slots.
    /// Fails otherwise.
    #[inline]
    pub(crate) fn open(
        &self,
        header: &mut ImageHeader,
        robot: u16,
        slots: u16,
    ) -> Result<(), ImageError> {
        let Some(end) = self.code.len().checked_sub(CHECK) else { return Err(ImageError::Seal) };
        let Some(words_at) = self.code.len().checked_sub(LENGTH) else {
            return Err(ImageError::Seal);
        };
        let mut check = word(robot, slots);
        for at in 0..end {
            check = crc16(check, self.code.byte(at));
        }
        if !check != self.code.word(end) {
            return Err(ImageError::Seal);
        }
        header.read_words(&self.code, words_at);
        Ok(())
    }
}

impl<C: ByteCode> Verified<'_, C> {
    /// Returns the seal of the image, which is appended to its bytes.
    pub(crate) fn seal(self, robot: u16, slots: u16) -> [u8; LENGTH] {
        let mut check = word(robot, slots);
        for at in 0..self.code.len() {
            check = crc16(check, self.code.byte(at));
        }
        let mut seal = [0; LENGTH];
        let mut at = 0;
        for number in self.header.words() {
            check = word(check, number);
            [seal[at], seal[at + 1]] = number.to_le_bytes();
            at += 2;
        }
        [seal[at], seal[at + 1]] = (!check).to_le_bytes();
        seal
    }
}

const fn word(check: u16, word: u16) -> u16 {
    let [low, high] = word.to_le_bytes();
    crc16(crc16(check, low), high)
}
