//! Images that are verified where they are built.
//!
//! The verifier takes two kilobytes of a small robot's flash. A robot whose image lies in flash and is replaced only by tools that
//! verify does not need it: the tool loads the image into a machine like the robot's and, if that accepts it, puts a **seal**
//! behind it ([`Vm::seal`](crate::Vm::seal)); the robot compares the seal ([`Vm::load_sealed`](crate::Vm::load_sealed)) and is spared the rest.
//!
//! # Who is trusted
//! Whoever writes the robot's flash, and so could write any program. A seal finds what goes wrong by mistake: an image that no tool
//! has verified, that was changed or written in part, that belongs to another robot, or to one with other functions or memory. It is a
//! CRC of 16 bits, no signature: bytes from strangers, by radio say, are for [`Vm::load`](crate::Vm::load) alone.
//!
//! # Layout
//! The image, the numbers of its header as 16-bit words (see [`Header`]), and the CRC over what the robot
//! [offers](robot), its slots, and all bytes before.

use crate::bytecode::ByteCode;
use crate::image::{Header, ImageError, VERSION, Verified, WORDS};
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
pub struct Sealed<C: ByteCode> {
    pub(crate) code: C,
}

/// Returns the robot's offer to scripts as one number: version, profile, those of its machine's
/// [`features`](crate::features) for
/// which it has room, the machine's parts, and the name hashes of its functions in their order.
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

impl<C: ByteCode> Sealed<C> {
    /// Any bytes.
    pub fn new(code: C) -> Self {
        Sealed { code }
    }

    /// Returns the image, if the seal is whole and was made for this robot and this number of
    /// slots.
    #[inline]
    pub(crate) fn open(
        &self,
        header: &mut Header,
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
        if check != self.code.word(end) {
            return Err(ImageError::Seal);
        }
        header.read_words(&self.code, words_at);
        Ok(())
    }
}

impl<C: ByteCode> Verified<'_, C> {
    /// Returns the bytes that follow its `length` bytes.
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
        [seal[at], seal[at + 1]] = check.to_le_bytes();
        seal
    }
}

const fn word(check: u16, word: u16) -> u16 {
    let [low, high] = word.to_le_bytes();
    crc16(crc16(check, low), high)
}
