//! Sealing and opening: the script's hash is put on a frame, or taken off, in place.
//!
//! Both differ in direction only, so on the AVR there is one function for all kinds and both ways. An open frame has its fields
//! where they travel, with strings as their numbers, the whole clock in one place, and zero for the hash.

use core::marker::PhantomData;

use super::{FRAGMENT_HEAD, Ignored, Kind, PLAIN_MAX, Script, Swarms};
use crate::number::{Profile, Word};
use crate::value::{Tag, Value};

/// A frame in a buffer for the longest, so that no position in it needs a check.
pub(super) struct Frame<P: Profile> {
    pub(super) kind: Kind,
    pub(super) bytes: [u8; PLAIN_MAX],
    profile: PhantomData<P>,
}

/// Entry: bits 20 and 21 of the clock.
const CLOCK: u8 = 0x18;
/// Broadcast and entry: the tag of the value.
const VALUE: u8 = 0x03;
/// Bytes of two words and the hash.
const BODY_MAX: usize = PLAIN_MAX - 6;

impl<P: Profile> Frame<P> {
    pub(super) const EMPTY: Self =
        Frame { kind: Kind::Beacon, bytes: [0; PLAIN_MAX], profile: PhantomData };
    pub(super) const ROBOT: usize = 1;
    pub(super) const TOPIC: usize = 3;
    pub(super) const KEY: usize = 6;
    /// Entry: the key is a string.
    pub(super) const STRING_KEY: u8 = 0x04;

    /// Opens the frame of that length that is in the buffer.
    #[inline]
    pub(super) fn open(&mut self, length: usize, script: &Script) -> Result<(), Ignored> {
        self.kind = Kind::of(self.bytes[0]).ok_or(Ignored::Malformed)?;
        let content = usize::from(self.kind == Kind::Fragment);
        if self.length().is_none_or(|needed| needed + content > length) {
            return Err(Ignored::Malformed);
        }
        if self.translate(script, false) { Ok(()) } else { Err(Ignored::Foreign) }
    }

    /// Seals the open frame.
    pub(super) fn seal(&mut self, script: &Script) {
        self.translate(script, true);
    }

    /// How many bytes travel, of a fragment without its content; `None` if there is no such frame.
    #[inline]
    pub(super) fn length(&self) -> Option<usize> {
        let length = match self.kind {
            Kind::Broadcast => 3 + 2 * P::WORD_BYTES as u8 + 3,
            Kind::Entry => 6 + 2 * P::WORD_BYTES as u8 + if P::FULL { 3 } else { 0 },
            Kind::Swarms => {
                let count = self.bytes[5] & 0x0f;
                if count.wrapping_sub(1) >= Swarms::capacity::<P>() {
                    return None;
                }
                6 + 2 * count
            }
            Kind::Beacon => 7,
            Kind::Fragment => FRAGMENT_HEAD as u8,
        };
        Some(usize::from(length))
    }

    /// Puts the script's hash on it or takes it off; `false` if it was that of another script.
    #[inline(never)]
    fn translate(&mut self, script: &Script, out: bool) -> bool {
        let mut foreign = 0;
        let [first, _, _, _, _, high, ..] = &mut self.bytes;
        let value = Tag::of(*first & VALUE);
        let mut key = Tag::STRING;
        let script_hash = script.hash.to_le_bytes();
        if self.kind == Kind::Entry {
            if *first & Self::STRING_KEY == 0 {
                key = Tag::INT;
            }
            let [.., hash] = script_hash;
            if out {
                *first |= *high >> 1 & CLOCK;
                *high = *high & 0x0f | hash & 0xf0;
            } else {
                foreign = (*high ^ hash) & 0xf0;
                *high = *high & 0x0f | (*first & CLOCK) << 1;
            }
        }
        let body: &mut [u8; BODY_MAX] = if self.kind == Kind::Entry {
            let [_, _, _, _, _, _, body @ ..] = &mut self.bytes;
            body
        } else {
            let [_, _, _, body @ .., _, _, _] = &mut self.bytes;
            body
        };
        let mut hash: &mut [u8] = body;
        let mut hash_bytes = match self.kind {
            Kind::Beacon => 4,
            Kind::Fragment => 0,
            _ => 2,
        };
        if matches!(self.kind, Kind::Entry | Kind::Broadcast) {
            hash_bytes = if P::FULL || self.kind == Kind::Broadcast { 3 } else { 0 };
            let (words, rest) = hash.split_at_mut(2 * P::WORD_BYTES);
            let (first_word, second_word) = words.split_at_mut(P::WORD_BYTES);
            foreign |= translate_word(first_word, key, script, out);
            foreign |= translate_word(second_word, value, script, out);
            hash = rest;
        }
        for (byte, hash) in hash.iter_mut().zip(&script_hash).take(hash_bytes) {
            *byte ^= *hash;
            foreign |= *byte;
        }
        foreign == 0
    }

    #[inline(always)]
    pub(super) fn number(&self, at: usize) -> u16 {
        u16::from_le_bytes([self.bytes[at], self.bytes[at + 1]])
    }

    #[inline(always)]
    pub(super) fn set_number(&mut self, at: usize, number: u16) {
        [self.bytes[at], self.bytes[at + 1]] = number.to_le_bytes();
    }

    #[inline(always)]
    pub(super) fn key(&self) -> Value<P> {
        let tag = if self.bytes[0] & Self::STRING_KEY != 0 { Tag::STRING } else { Tag::INT };
        self.word(tag, Self::KEY)
    }

    #[inline(always)]
    pub(super) fn value(&self, at: usize) -> Value<P> {
        self.word(Tag::of(self.bytes[0] & VALUE), at)
    }

    #[inline(always)]
    fn word(&self, tag: Tag, at: usize) -> Value<P> {
        let low = self.number(at).to_le_bytes();
        let high = if P::FULL { self.number(at + 2).to_le_bytes() } else { [0; 2] };
        Value::new(tag, P::literal_from_le([low[0], low[1], high[0], high[1]]))
    }

    #[inline(always)]
    pub(super) fn set_value(&mut self, at: usize, value: Value<P>) {
        let word = value.raw().to_u32();
        self.set_number(at, word as u16);
        if P::FULL {
            self.set_number(at + 2, (word >> 16) as u16);
        }
    }
}

/// Adds the low bits of the script's hash to a string's number, or takes them off; not 0 if it then is no string of the script.
///
/// Strings of another script are hardly ever strings of this one.
#[inline(never)]
fn translate_word(word: &mut [u8], tag: Tag, script: &Script, out: bool) -> u8 {
    if tag == Tag::NIL {
        word.fill(0);
    }
    if tag != Tag::STRING {
        return 0;
    }
    let Some((bytes, high)) = word.split_first_chunk_mut() else {
        return 1;
    };
    let mut number = u16::from_le_bytes(*bytes);
    if out {
        number = number.wrapping_add(script.hash as u16);
    } else {
        number = number.wrapping_sub(script.hash as u16);
        if number >= script.strings || high.iter().any(|byte| *byte != 0) {
            return 1;
        }
    }
    *bytes = number.to_le_bytes();
    0
}
