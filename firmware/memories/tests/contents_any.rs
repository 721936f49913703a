//! No content of a memory panics the decoder, and no sequence of answers the search.

use bittybuzz_memories::{Configuration, DeckDescription, DeckScan, MEMORY_BYTES, kind};
use proptest::prelude::*;

proptest! {
    #[test]
    fn no_content_panics(
        bytes in prop::collection::vec(any::<u8>(), MEMORY_BYTES),
    ) {
        let memory: [u8; MEMORY_BYTES] = bytes.try_into().unwrap();
        let _ = DeckDescription::decode(&memory);
        let _ = Configuration::decode(memory.first_chunk().unwrap());
    }

    #[test]
    fn no_answers_panic(
        answers in prop::collection::vec(
            (prop::sample::select(vec![kind::SCAN, 0x21, kind::READ]),
             prop::collection::vec(0_u8..5, 0..64)),
            0..40,
        ),
    ) {
        let mut scan = DeckScan::new();
        for (kind, answer) in answers {
            let was_done = scan.request().is_none();
            assert!(!(scan.process(kind, &answer) && was_done));
        }
        scan.give_up();
        assert!(scan.result().is_some());
    }
}
