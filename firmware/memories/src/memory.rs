//! The content of a memory: a header with the identity of the deck, and elements with texts. Each
//! part has a checksum.
//!
//! ```text
//! eb | pins, 4 bytes | vendor | product | check || version 0 | length | elements | check
//! element: id | length | data
//! ```

/// The number of bytes of a memory.
pub const MEMORY_BYTES: usize = 112;

const START: u8 = 0xeb;
const VERSION: u8 = 0;
/// The bytes of the header, without its checksum.
const HEADER_BYTES: usize = 7;
/// The location of the version, with which the second part begins.
const VERSION_AT: usize = 8;
/// The element with the name of the board.
const NAME: u8 = 1;

/// The longest name that is kept. Bitcraze's longest has 17 bytes.
const NAME_BYTES: usize = 20;

/// A reason why a memory describes no deck.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MemoryFault {
    /// The first byte is not that of a description: the memory is empty, or of another maker.
    NoDescription,
    /// The checksum of the header is wrong.
    HeaderDamaged,
    /// The elements have a version that this crate does not know.
    UnknownVersion(u8),
    /// The checksum of the elements is wrong, or an element goes beyond their end.
    ElementsDamaged,
}

/// The name of a board, cut after 20 bytes. It is ASCII; other bytes became `?`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BoardName {
    bytes: [u8; NAME_BYTES],
    length: usize,
}

impl BoardName {
    /// Returns the name that begins with these bytes.
    pub fn new(bytes: &[u8]) -> Self {
        let mut name = BoardName::default();
        for (to, from) in name.bytes.iter_mut().zip(bytes) {
            *to = if from.is_ascii_graphic() { *from } else { b'?' };
            name.length += 1;
        }
        name
    }

    /// Returns the name; empty if the memory has none.
    pub fn as_str(&self) -> &str {
        let bytes = self.bytes.get(..self.length).unwrap_or_default();
        core::str::from_utf8(bytes).unwrap_or_default()
    }
}

/// The description of a deck.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DeckDescription {
    /// The pins of the expansion port that the deck drives: bits 0 to 15 for those that it drives
    /// low, and bits 16 to 31 for the same pins driven high.
    pub pins: u32,
    /// The vendor: 0xbc for Bitcraze, 0 for a deck that only its name identifies.
    pub vendor: u8,
    pub product: u8,
    pub name: BoardName,
}

impl DeckDescription {
    /// Decodes the content of a memory.
    ///
    /// # Errors
    /// Returns the reason why the content describes no deck.
    pub fn decode(memory: &[u8; MEMORY_BYTES]) -> Result<Self, MemoryFault> {
        let (header, rest) = memory.split_at(HEADER_BYTES);
        let [START, p0, p1, p2, p3, vendor, product] = header else {
            return Err(MemoryFault::NoDescription);
        };
        if rest.first() != Some(&check(header)) {
            return Err(MemoryFault::HeaderDamaged);
        }
        let pins = u32::from_le_bytes([*p0, *p1, *p2, *p3]);
        let elements = elements(memory.get(VERSION_AT..).unwrap_or_default())?;
        let name = find_name(elements).ok_or(MemoryFault::ElementsDamaged)?;
        Ok(DeckDescription { pins, vendor: *vendor, product: *product, name })
    }
}

/// Returns the elements after the version and their length, once their checksum is correct.
fn elements(bytes: &[u8]) -> Result<&[u8], MemoryFault> {
    let damaged = MemoryFault::ElementsDamaged;
    let [version, length, ..] = bytes else { return Err(damaged) };
    if *version != VERSION {
        return Err(MemoryFault::UnknownVersion(*version));
    }
    let end = 2 + usize::from(*length);
    let covered = bytes.get(..end).ok_or(damaged)?;
    if bytes.get(end) != Some(&check(covered)) {
        return Err(damaged);
    }
    Ok(covered.get(2..).unwrap_or_default())
}

/// Returns the name among these elements, which is empty if there is none. Returns `None` if an
/// element goes beyond their end.
fn find_name(mut elements: &[u8]) -> Option<BoardName> {
    let mut name = BoardName::default();
    while let [id, length, rest @ ..] = elements {
        let (data, next) = rest.split_at_checked(usize::from(*length))?;
        if *id == NAME {
            name = BoardName::new(data);
        }
        elements = next;
    }
    elements.is_empty().then_some(name)
}

/// Returns the checksum: the lowest byte of the CRC-32 of Ethernet.
fn check(bytes: &[u8]) -> u8 {
    let crc = bytes.iter().fold(u32::MAX, |crc, byte| {
        (0..8).fold(crc ^ u32::from(*byte), |crc, _| {
            crc >> 1 ^ if crc & 1 != 0 { 0xedb8_8320 } else { 0 }
        })
    });
    !crc as u8
}
