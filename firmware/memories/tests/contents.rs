//! Contents of memories. Bitcraze's cflib (0417fba, ow_element.py) wrote them; that of the LED ring
//! is the example of deck_memory_format.md from its elements on.

use bittybuzz_memories::{Deck, DeckDescription, MEMORY_BYTES, MemoryFault};

/// Names, and the bytes that cflib writes for them. The rest of a memory is erased.
pub const FLOW_2: &str = "eb00000000bc0fb6000c01076263466c6f773202014378";
pub const Z_RANGER_2: &str = "eb00000000bc0e20000f010a62635a52616e676572320201418c";
pub const MULTI_RANGER: &str = "eb00000000bc0c0c0012010d62634d756c746972616e67657202014387";
pub const LIGHTHOUSE: &str = "eb00000000bc10430012010d62634c69676874686f75736534020144ac";
pub const LOCO: &str = "eb00000000bc0612000b010662634c6f636f0201449d";
pub const LED_RING: &str = "eb00000000bc01b1000e010962634c656452696e6702016255";
/// A deck without a vendor, with the name of the Z-ranger, its I2C pins and IO_3 in use, and data
/// for its driver.
pub const NAMED_Z_RANGER_2: &str = "eb0c0040000000d50014010a62635a52616e67657232020178030300ff8083";
/// A Multi-ranger that drives PC11 low and high.
pub const DRIVING_MULTI_RANGER: &str = "eb01000100bc0ccc000f010d62634d756c746972616e67657251";
/// A Multi-ranger without elements.
pub const NAMELESS_MULTI_RANGER: &str = "eb00000000bc0c0c0000ff";
/// A deck of another vendor with a name of 90 letters.
pub const LONG_NAME: &str = "eb000000004217d3005c015a\
    787878787878787878787878787878787878787878787878787878787878787878787878787878787878787878\
    787878787878787878787878787878787878787878787878787878787878787878787878787878787878787878b7";

/// Returns the memory that begins with these bytes, in hexadecimal.
pub fn memory(digits: &str) -> [u8; MEMORY_BYTES] {
    let mut memory = [0xff; MEMORY_BYTES];
    for (at, byte) in memory.iter_mut().enumerate().take(digits.len() / 2) {
        *byte = u8::from_str_radix(&digits[2 * at..2 * at + 2], 16).expect("hexadecimal digits");
    }
    memory
}

#[test]
fn contents_of_cflib_are_decoded() {
    for (digits, pins, vendor, product, name, deck) in [
        (FLOW_2, 0, 0xbc, 0x0f, "bcFlow2", Some(Deck::Flow2)),
        (Z_RANGER_2, 0, 0xbc, 0x0e, "bcZRanger2", Some(Deck::ZRanger2)),
        (MULTI_RANGER, 0, 0xbc, 0x0c, "bcMultiranger", Some(Deck::MultiRanger)),
        (LIGHTHOUSE, 0, 0xbc, 0x10, "bcLighthouse4", None),
        (LOCO, 0, 0xbc, 0x06, "bcLoco", None),
        (LED_RING, 0, 0xbc, 0x01, "bcLedRing", None),
        (NAMED_Z_RANGER_2, 0x0040_000c, 0, 0, "bcZRanger2", Some(Deck::ZRanger2)),
        (DRIVING_MULTI_RANGER, 0x0001_0001, 0xbc, 0x0c, "bcMultiranger", Some(Deck::MultiRanger)),
        (NAMELESS_MULTI_RANGER, 0, 0xbc, 0x0c, "", Some(Deck::MultiRanger)),
        (LONG_NAME, 0, 0x42, 0x17, "xxxxxxxxxxxxxxxxxxxx", None),
    ] {
        let description = DeckDescription::decode(&memory(digits)).unwrap();
        let DeckDescription { pins: found_pins, vendor: found_vendor, .. } = description;
        assert_eq!((found_pins, found_vendor), (pins, vendor), "{digits}");
        assert_eq!((description.product, description.name.as_str()), (product, name), "{digits}");
        assert_eq!(Deck::of(&description), deck, "{digits}");
    }
}

/// Another maker's deck with the product number of the Flow deck is another deck, and so is a deck
/// without a vendor whose name is another one.
#[test]
fn product_numbers_belong_to_their_vendor() {
    let flow = DeckDescription::decode(&memory(FLOW_2)).unwrap();
    assert_eq!(Deck::of(&DeckDescription { vendor: 0x42, ..flow }), None);
    assert_eq!(Deck::of(&DeckDescription { vendor: 0, product: 0, ..flow }), Some(Deck::Flow2));
    let loco = DeckDescription::decode(&memory(LOCO)).unwrap();
    assert_eq!(Deck::of(&DeckDescription { vendor: 0, product: 0x0f, ..loco }), None);
}

/// The lowest byte of a CRC-32 detects every changed bit of so short a text.
#[test]
fn every_changed_bit_is_detected() {
    let intact = memory(FLOW_2);
    let length = FLOW_2.len() / 2;
    for bit in 0..8 * length {
        let mut damaged = intact;
        damaged[bit / 8] ^= 1 << (bit % 8);
        let expected = match bit / 8 {
            0 => MemoryFault::NoDescription,
            1..8 => MemoryFault::HeaderDamaged,
            8 => MemoryFault::UnknownVersion(1 << (bit % 8)),
            _ => MemoryFault::ElementsDamaged,
        };
        assert_eq!(DeckDescription::decode(&damaged), Err(expected), "bit {bit}");
    }
    for bit in 8 * length..8 * MEMORY_BYTES {
        let mut unused = intact;
        unused[bit / 8] ^= 1 << (bit % 8);
        assert!(DeckDescription::decode(&unused).is_ok(), "bit {bit}");
    }
}

#[test]
fn empty_memories_describe_nothing() {
    for byte in [0x00, 0xff] {
        let empty = [byte; MEMORY_BYTES];
        assert_eq!(DeckDescription::decode(&empty), Err(MemoryFault::NoDescription));
    }
}

/// An element claims more bytes than there are, with a correct checksum: the lowest byte of
/// Python's `zlib.crc32`.
#[test]
fn an_element_beyond_the_end_is_damage() {
    let mut bytes = memory(NAMELESS_MULTI_RANGER);
    bytes[8..14].copy_from_slice(&[0, 3, 1, 2, b'b', 0x32]);
    assert_eq!(DeckDescription::decode(&bytes), Err(MemoryFault::ElementsDamaged));
    // An identification without a length.
    bytes[8..12].copy_from_slice(&[0, 1, 1, 0xc5]);
    assert_eq!(DeckDescription::decode(&bytes), Err(MemoryFault::ElementsDamaged));
}

#[test]
fn letters_that_a_log_cannot_show_are_replaced() {
    let name = bittybuzz_memories::BoardName::new(b"a\n\xff\x00 z");
    assert_eq!(name.as_str(), "a????z");
}
