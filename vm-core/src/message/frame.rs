//! Frames in place: fields at their positions in the frame, and the mixing with the script's hash.
//!
//! An open frame holds strings as their numbers, the whole clock of an entry in one place, and zero
//! in place of the hash. Sealing adds the hash for sending; opening removes it. The two differ only
//! in direction, so one function does both for all kinds.

use super::{
    FRAGMENT_HEAD, FrameKind, Ignored, STIGMERGIES, ScriptIdentity, StigmergyEntry, Swarms,
};
use crate::network::Buffer;
use crate::number::{Profile, Word};
use crate::value::{Tag, Value};

const BROADCAST: u8 = 0x04;
const BEACON: u8 = 0x08;
const SWARMS: u8 = 0x09;
const DIGEST: u8 = 0x0a;
/// Entry: the unit of the field that holds the stigmergy's number plus one.
const STIGMERGY: u8 = 0x20;
/// Entry: the key is a string.
const STRING_KEY: u8 = 0x04;
/// Entry: bits 20 and 21 of the clock.
const CLOCK: u8 = 0x18;
/// Broadcast and entry: the tag of the value.
const VALUE: u8 = 0x03;

// The offsets of fields.
const ROBOT: usize = 1;
/// Broadcast: the topic, then the value.
const TOPIC: usize = 3;
/// Entry: the key, then the value.
const KEY: usize = 6;
/// Swarms: the number of them, and a bit for each that is set if the robot is in it.
const INFO: usize = 5;
/// Swarms: their numbers.
const IDS: usize = 6;
/// Digest: the lower bits of the clock floor. The next byte has its upper bits, and [`FLOOR_HASH`].
const FLOOR: usize = 4;
/// Digest: the bits of the script's hash next to the upper bits of the floor.
const FLOOR_HASH: u8 = 0xc0;
/// Digest: the sum of 24 bits, then in `full` bits of the script's hash.
const SUM: usize = 7;

/// A frame in a buffer that holds the longest frame of its profile, so that no position in it needs
/// a check.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Frame<P: Profile>(P::Frame);

impl<P: Profile> Frame<P> {
    pub(crate) const EMPTY: Self = Frame(P::Frame::ZERO);

    /// Returns the whole buffer.
    #[hot]
    pub(crate) fn bytes_mut(&mut self) -> &mut [u8] {
        self.0.as_mut()
    }

    /// Returns the first `length` bytes.
    #[hot]
    pub(crate) fn bytes(&self, length: usize) -> &[u8] {
        self.0.as_ref().get(..length).unwrap_or(&[])
    }

    /// Opens the frame of that length in the buffer, and returns its kind. A fragment needs no
    /// content: it stands for a whole message, whose content the host has.
    #[hot]
    pub(crate) fn open(
        &mut self,
        length: usize,
        script: &ScriptIdentity,
    ) -> Result<FrameKind, Ignored> {
        let kind = FrameKind::of_quickly(self.byte(0)).ok_or(Ignored::Malformed)?;
        if self.length(kind).is_none_or(|needed| needed > length) {
            return Err(Ignored::Malformed);
        }
        if self.translate(kind, script, false) { Ok(kind) } else { Err(Ignored::Foreign) }
    }

    /// Seals an open frame and returns its length. Returns `None` if there is no such frame.
    #[one_copy]
    pub(crate) fn seal(&mut self, script: &ScriptIdentity) -> Option<usize> {
        let first = self.byte(0);
        let is_avr = cfg!(target_arch = "avr");
        let kind = if is_avr { FrameKind::of(first)? } else { FrameKind::of_quickly(first)? };
        self.translate(kind, script, true);
        self.length(kind)
    }

    /// Returns the number of bytes that are sent, for a fragment without its content; `None` if
    /// there is no such frame.
    #[hot]
    fn length(&self, kind: FrameKind) -> Option<usize> {
        let length = match kind {
            FrameKind::Broadcast => 3 + 2 * P::WORD_BYTES as u8 + 3,
            FrameKind::Entry => 6 + 2 * P::WORD_BYTES as u8 + if P::FULL { 3 } else { 0 },
            FrameKind::Swarms => {
                let count = self.byte(INFO) & 0x0f;
                if count.wrapping_sub(1) >= Swarms::capacity::<P>() {
                    return None;
                }
                6 + 2 * count
            }
            FrameKind::Beacon => 7,
            FrameKind::Digest => 10 + if P::FULL { 3 } else { 0 },
            FrameKind::Fragment => FRAGMENT_HEAD as u8,
        };
        Some(usize::from(length))
    }

    /// Adds the script's hash to the frame, or removes it if `out` is false. Returns false if the
    /// frame is of another script.
    #[one_copy]
    fn translate(&mut self, kind: FrameKind, script: &ScriptIdentity, out: bool) -> bool {
        let hash = script.hash.to_le_bytes();
        let [h0, h1, _, h3] = hash;
        let first = self.byte(0);
        let foreign = match kind {
            FrameKind::Fragment => 0,
            FrameKind::Beacon => self.mix_three(3, hash) | self.mix(6, h3),
            FrameKind::Digest => {
                let mut foreign = self.mix(3, h0) | self.mix(6, h3 & FLOOR_HASH) & FLOOR_HASH;
                if P::FULL {
                    foreign |= self.mix_three(SUM + 3, hash);
                }
                foreign
            }
            FrameKind::Swarms => self.mix(3, h0) | self.mix(4, h1),
            FrameKind::Broadcast => {
                self.mix_three(TOPIC + 2 * P::WORD_BYTES, hash)
                    | self.translate_words(TOPIC, Tag::STRING, script, out)
            }
            FrameKind::Entry => {
                let key = if first & STRING_KEY == 0 { Tag::INT } else { Tag::STRING };
                let high = self.byte(5);
                let mut clock = high & 0x0f;
                let mut foreign = 0;
                if out {
                    self.set_byte(0, first | high >> 1 & CLOCK);
                    clock |= h3 & 0xf0;
                } else {
                    foreign = (high ^ h3) & 0xf0;
                    clock |= (first & CLOCK) << 1;
                }
                self.set_byte(5, clock);
                if P::FULL {
                    foreign |= self.mix_three(KEY + 2 * P::WORD_BYTES, hash);
                }
                foreign | self.translate_words(KEY, key, script, out)
            }
        };
        foreign == 0
    }

    /// Adds or removes a byte of the hash. The result after a removal is zero if the byte is that
    /// of this script.
    #[hot]
    fn mix(&mut self, at: usize, hash: u8) -> u8 {
        let byte = self.byte(at) ^ hash;
        self.set_byte(at, byte);
        byte
    }

    /// Adds or removes the three lower bytes of the hash, see [`Frame::mix`].
    #[hot]
    fn mix_three(&mut self, at: usize, [h0, h1, h2, _]: [u8; 4]) -> u8 {
        self.mix(at, h0) | self.mix(at + 1, h1) | self.mix(at + 2, h2)
    }

    /// Translates topic or key, and value, if they are strings. The result is not 0 if one of them
    /// is no string of this script.
    #[hot]
    fn translate_words(&mut self, at: usize, first: Tag, script: &ScriptIdentity, out: bool) -> u8 {
        let value = Tag::of(self.byte(0) & VALUE);
        let bytes = self.0.as_mut();
        let mut foreign = 0;
        if first == Tag::STRING
            && let Some(word) = bytes.get_mut(at..at + P::WORD_BYTES)
        {
            foreign |= translate_string(word, script, out);
        }
        if value == Tag::STRING
            && let Some(word) = bytes.get_mut(at + P::WORD_BYTES..at + 2 * P::WORD_BYTES)
        {
            foreign |= translate_string(word, script, out);
        }
        foreign
    }

    #[hot]
    fn byte(&self, at: usize) -> u8 {
        self.0.as_ref()[at]
    }

    #[hot]
    fn set_byte(&mut self, at: usize, byte: u8) {
        self.0.as_mut()[at] = byte;
    }

    #[hot]
    fn number(&self, at: usize) -> u16 {
        u16::from_le_bytes([self.byte(at), self.byte(at + 1)])
    }

    #[hot]
    fn set_number(&mut self, at: usize, number: u16) {
        let [low, high] = number.to_le_bytes();
        self.set_byte(at, low);
        self.set_byte(at + 1, high);
    }

    #[hot]
    fn word(&self, tag: Tag, at: usize) -> Value<P> {
        let low = self.number(at).to_le_bytes();
        let high = if P::FULL { self.number(at + 2).to_le_bytes() } else { [0; 2] };
        Value::new(tag, P::literal_from_le([low[0], low[1], high[0], high[1]]))
    }

    #[hot]
    fn set_word(&mut self, at: usize, value: Value<P>) {
        let word = value.raw().to_u32();
        self.set_number(at, word as u16);
        if P::FULL {
            self.set_number(at + 2, (word >> 16) as u16);
        }
    }

    /// Returns the value of a broadcast or an entry.
    #[hot]
    fn value(&self, at: usize) -> Value<P> {
        let tag = Tag::of(self.byte(0) & VALUE);
        // nil has no word, so the bytes there are ignored.
        if tag == Tag::NIL { Value::nil() } else { self.word(tag, at) }
    }

    /// Returns the sender; for an entry, its owner.
    #[hot]
    pub(crate) fn robot(&self) -> u16 {
        self.number(ROBOT)
    }

    /// Returns topic and value of a broadcast.
    #[hot]
    pub(crate) fn broadcast(&self) -> (u16, Value<P>) {
        (self.number(TOPIC), self.value(TOPIC + P::WORD_BYTES))
    }

    /// Returns the entry.
    #[hot]
    pub(crate) fn entry(&self) -> StigmergyEntry<P> {
        let first = self.byte(0);
        let key = if first & STRING_KEY != 0 { Tag::STRING } else { Tag::INT };
        StigmergyEntry {
            stigmergy: u16::from((first / STIGMERGY).wrapping_sub(1)),
            owner: self.robot(),
            clock: self.three(3),
            key: self.word(key, KEY),
            value: self.value(KEY + P::WORD_BYTES),
        }
    }

    /// Returns the swarms of a robot.
    #[hot]
    pub(crate) fn swarms(&self) -> Swarms {
        let info = self.byte(INFO);
        let mut ids = [self.number(IDS), self.number(IDS + 2), 0, 0];
        if P::FULL {
            ids[2] = self.number(IDS + 4);
            ids[3] = self.number(IDS + 6);
        }
        Swarms { count: info & 0x0f, joined: info >> 4, ids }
    }

    /// Makes an empty frame an open beacon.
    #[hot]
    pub(crate) fn put_beacon(&mut self, robot: u16) {
        self.set_byte(0, BEACON);
        self.set_number(ROBOT, robot);
    }

    /// Returns the digest of the sender's stigmergies, and its clock floor.
    #[hot]
    pub(crate) fn digest(&self) -> (u32, u32) {
        (self.three(SUM), self.three(FLOOR))
    }

    /// Makes an empty frame an open beacon with a digest of 24 bits and a clock.
    #[hot]
    pub(crate) fn put_digest(&mut self, robot: u16, digest: u32, floor: u32) {
        self.put_beacon(robot);
        self.set_byte(0, DIGEST);
        self.set_three(FLOOR, floor);
        self.set_three(SUM, digest);
    }

    /// Returns a number of 24 bits.
    #[hot]
    fn three(&self, at: usize) -> u32 {
        u32::from_le_bytes([self.byte(at), self.byte(at + 1), self.byte(at + 2), 0])
    }

    #[hot]
    fn set_three(&mut self, at: usize, number: u32) {
        self.set_number(at, number as u16);
        self.set_byte(at + 2, (number >> 16) as u8);
    }

    /// Makes an empty frame an open broadcast; `None` if the value does not fit.
    #[hot]
    pub(crate) fn put_broadcast(&mut self, robot: u16, topic: u16, value: Value<P>) -> Option<()> {
        self.set_byte(0, BROADCAST | plain_tag(value)?);
        self.set_number(ROBOT, robot);
        self.set_word(TOPIC, Value::string(topic));
        self.set_word(TOPIC + P::WORD_BYTES, value);
        Some(())
    }

    /// Makes an empty frame an open entry. Returns `None` if the entry does not fit. Then the frame
    /// has no type, but owner, clock, stigmergy and digest, which distinguish the entry from
    /// others.
    #[one_copy]
    pub(crate) fn put_entry(&mut self, entry: &StigmergyEntry<P>, digest: u16) -> Option<()> {
        self.set_number(ROBOT, entry.owner);
        self.set_three(3, entry.clock);
        self.set_number(KEY, entry.stigmergy);
        self.set_number(KEY + 2, digest);
        let string = match entry.key.tag() {
            Tag::INT => 0,
            Tag::STRING => STRING_KEY,
            _ => return None,
        };
        if entry.stigmergy >= STIGMERGIES {
            return None;
        }
        let stigmergy = (entry.stigmergy as u8 + 1).wrapping_mul(STIGMERGY);
        self.set_byte(0, stigmergy | string | plain_tag(entry.value)?);
        self.set_word(KEY, entry.key);
        self.set_word(KEY + P::WORD_BYTES, entry.value);
        Some(())
    }

    /// Makes an empty frame an open list of swarms.
    #[hot]
    pub(crate) fn put_swarms(&mut self, robot: u16, swarms: &Swarms) {
        self.set_byte(0, SWARMS);
        self.set_number(ROBOT, robot);
        self.set_byte(INFO, swarms.count | swarms.joined << 4);
        let [a, b, c, d] = swarms.ids;
        self.set_number(IDS, a);
        self.set_number(IDS + 2, b);
        if P::FULL {
            self.set_number(IDS + 4, c);
            self.set_number(IDS + 6, d);
        }
    }
}

/// Returns the tag of a value that fits a frame.
#[hot]
fn plain_tag<P: Profile>(value: Value<P>) -> Option<u8> {
    if value.is_plain() { Some(value.tag().byte()) } else { None }
}

/// Adds the low bits of the script's hash to a string's number, or removes them. After a removal
/// the result is not 0 if the number is no string of the script.
///
/// The string of another script is very rarely one of this script after the removal.
#[one_copy]
fn translate_string(word: &mut [u8], script: &ScriptIdentity, out: bool) -> u8 {
    let Some((bytes, high)) = word.split_first_chunk_mut() else { return 1 };
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
