//! The search among the memories of the emulated nRF51. Its answers are those that its firmware
//! gives (memory.c); Bitcraze's firmware finds the same decks there.

use bittybuzz_chips::devices::one_wire::{DeckMemories, DeckMemory, OneWireFault};
use bittybuzz_memories::{
    BoardName, Deck, DeckConflict, DeckRefusal, DeckScan, DeckSet, MemoryFault, OneWireRequest,
    kind,
};

use crate::contents::*;

const SERIAL: [u8; 6] = [1, 2, 3, 4, 5, 6];

/// Returns memories with these contents, in hexadecimal.
fn memories(contents: &[&str]) -> DeckMemories {
    let memory = |digits: &&str| DeckMemory::with_content(SERIAL, memory(digits));
    DeckMemories::new(contents.iter().map(memory).collect())
}

/// Returns the result of the search, and the number of requests.
fn scan(memories: &mut DeckMemories) -> (Result<DeckSet, DeckRefusal>, usize) {
    let mut scan = DeckScan::new();
    let mut requests = 0;
    while let Some(request) = scan.request() {
        requests += 1;
        let mut buffer = [0; OneWireRequest::BYTES_MAX];
        let (kind, payload) = request.write(&mut buffer);
        match memories.answer(kind, payload) {
            Some(answer) => assert!(scan.process(kind, &answer), "{request:?}"),
            None => scan.give_up(),
        }
    }
    (scan.result().expect("the search has ended"), requests)
}

fn decks(expected: &[Deck]) -> Result<DeckSet, DeckRefusal> {
    let mut decks = DeckSet::default();
    expected.iter().for_each(|deck| decks.insert(*deck));
    assert_eq!(decks.iter().count(), expected.len());
    Ok(decks)
}

/// Four requests read a memory.
#[test]
fn supported_decks_are_found() {
    for (contents, expected) in [
        (&[][..], &[][..]),
        (&[FLOW_2], &[Deck::Flow2]),
        (&[MULTI_RANGER, FLOW_2], &[Deck::Flow2, Deck::MultiRanger]),
        (&[NAMED_Z_RANGER_2, NAMELESS_MULTI_RANGER], &[Deck::ZRanger2, Deck::MultiRanger]),
    ] {
        let mut memories = memories(contents);
        for has_bluetooth in [false, true] {
            memories.set_bluetooth(has_bluetooth);
            let found = scan(&mut memories);
            assert_eq!(found, (decks(expected), 1 + 4 * contents.len()), "{contents:?}");
        }
    }
}

#[test]
fn other_decks_are_refused_by_name() {
    for (digits, vendor, product, name) in [
        (LIGHTHOUSE, 0xbc, 0x10, "bcLighthouse4"),
        (LOCO, 0xbc, 0x06, "bcLoco"),
        (LED_RING, 0xbc, 0x01, "bcLedRing"),
        (LONG_NAME, 0x42, 0x17, "xxxxxxxxxxxxxxxxxxxx"),
    ] {
        let name = BoardName::new(name.as_bytes());
        let refusal = DeckRefusal::Unsupported { vendor, product, name };
        assert_eq!(scan(&mut memories(&[MULTI_RANGER, digits])).0, Err(refusal));
    }
}

/// Flow deck and Z-ranger have a range finder at the same address. Pins count as driven if their
/// memory or the deck's driver says so: IO_3 selects the flow sensor.
#[test]
fn decks_that_disturb_each_other_are_refused() {
    for (contents, first, second, conflict) in [
        ([FLOW_2, Z_RANGER_2], Deck::Flow2, Deck::ZRanger2, DeckConflict::Address(0x29)),
        ([Z_RANGER_2, FLOW_2], Deck::ZRanger2, Deck::Flow2, DeckConflict::Address(0x29)),
        ([FLOW_2, FLOW_2], Deck::Flow2, Deck::Flow2, DeckConflict::Pin(6)),
        ([NAMED_Z_RANGER_2, FLOW_2], Deck::ZRanger2, Deck::Flow2, DeckConflict::Pin(6)),
        (
            [DRIVING_MULTI_RANGER, DRIVING_MULTI_RANGER],
            Deck::MultiRanger,
            Deck::MultiRanger,
            DeckConflict::Pin(0),
        ),
        (
            [MULTI_RANGER, NAMELESS_MULTI_RANGER],
            Deck::MultiRanger,
            Deck::MultiRanger,
            DeckConflict::Address(0x20),
        ),
    ] {
        let refusal = DeckRefusal::Conflict { first, second, conflict };
        assert_eq!(scan(&mut memories(&contents)).0, Err(refusal), "{contents:?}");
    }
    // Both memories name the pins of the I2C bus, which are driven low only.
    let i2c = "eb0c000000bc0c77000f010d62634d756c746972616e67657251";
    let found = scan(&mut memories(&[NAMED_Z_RANGER_2, i2c])).0;
    assert_eq!(found, decks(&[Deck::ZRanger2, Deck::MultiRanger]));
}

#[test]
fn memories_that_cannot_be_read_are_refused() {
    let mut found = memories(&[MULTI_RANGER, FLOW_2]);
    for (fault, expected) in [
        (OneWireFault::NoAnswer, Err(DeckRefusal::NoAnswer)),
        (OneWireFault::NoMemory, decks(&[])),
        (OneWireFault::Unreadable, Err(DeckRefusal::Unreadable { number: 0 })),
        (
            OneWireFault::WrongBit(6),
            Err(DeckRefusal::Damaged { number: 0, fault: MemoryFault::HeaderDamaged }),
        ),
        (
            OneWireFault::WrongBit(15),
            Err(DeckRefusal::Damaged { number: 0, fault: MemoryFault::ElementsDamaged }),
        ),
    ] {
        found.set_fault(Some(fault));
        assert_eq!(scan(&mut found).0, expected, "{fault:?}");
    }
    let erased = DeckMemories::new(vec![DeckMemory::erased(SERIAL)]);
    let fault = MemoryFault::NoDescription;
    assert_eq!(scan(&mut erased.clone()).0, Err(DeckRefusal::Damaged { number: 0, fault }));
    assert_eq!(scan(&mut memories(&[FLOW_2; 5])).0, Err(DeckRefusal::TooMany(5)));
}

/// A request may be repeated, and both answers may come.
#[test]
fn late_answers_are_ignored() {
    let mut scan = DeckScan::new();
    let part = |location: u8| [&[0, location, 0][..], &[0xff; 29]].concat();
    for (kind, answer, counts) in [
        (kind::READ, part(0), false),
        (kind::SCAN, vec![], false),
        (kind::SCAN, vec![1], true),
        (kind::SCAN, vec![1], false),
        (kind::READ, part(29), false),
        (kind::READ, part(0)[..31].to_vec(), false),
        (kind::READ, part(0), true),
        (kind::READ, part(0), false),
        (kind::READ, part(29), true),
    ] {
        assert_eq!(scan.process(kind, &answer), counts, "{kind:#x} {answer:?}");
    }
    let expected = OneWireRequest::Read { number: 0, location: 58 };
    assert_eq!((scan.request(), scan.result()), (Some(expected), None));
}
