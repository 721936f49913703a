//! Mistakes in the protocol that no test finds, and why none has to.

/// A mistake of cargo-mutants.
pub struct Survivor {
    /// Its description, without line and column.
    pub mutant: &'static str,
    /// Places in the function where it may be made.
    pub count: usize,
    /// The reason why it is no mistake or does no harm.
    pub reason: &'static str,
}

/// All of them.
pub const SURVIVORS: &[Survivor] = &[
    Survivor {
        mutant: "vm-core/src/machine/network/advertise.rs: replace - with + in Vm<P, C, SLOTS>::relay",
        count: 1,
        reason: "the pause between relayed entries is longer by 0, 1, 32 or 33 steps at random",
    },
    Survivor {
        mutant: "vm-core/src/machine/network/advertise.rs: replace - with / in Vm<P, C, SLOTS>::relay",
        count: 1,
        reason: "the pause between relayed entries is longer by 0 or 32 steps at random",
    },
    Survivor {
        mutant: "vm-core/src/machine/network/advertise.rs: replace / with * in Vm<P, C, SLOTS>::relay",
        count: 1,
        reason: "the pause between relayed entries is longer by up to 127 steps at random, not 31",
    },
    Survivor {
        mutant: "vm-core/src/machine/network/advertise.rs: replace >> with << in hash",
        count: 1,
        reason: "robots need the same hash of an entry, no matter which",
    },
    Survivor {
        mutant: "vm-core/src/machine/network/advertise.rs: replace ^ with & in hash",
        count: 1,
        reason: "robots need the same hash of an entry, no matter which",
    },
    Survivor {
        mutant: "vm-core/src/machine/network/advertise.rs: replace ^ with | in hash",
        count: 1,
        reason: "robots need the same hash of an entry, no matter which",
    },
    Survivor {
        mutant: "vm-core/src/machine/network/advertise.rs: replace | with ^ in Vm<P, C, SLOTS>::digest",
        count: 1,
        reason: "the bits have none in common",
    },
    Survivor {
        mutant: "vm-core/src/machine/network/advertise.rs: replace | with ^ in Vm<P, C, SLOTS>::keep_in_touch",
        count: 1,
        reason: "the bits have none in common",
    },
    Survivor {
        mutant: "vm-core/src/machine/network/messages.rs: replace && with || in Vm<P, C, SLOTS>::handle",
        count: 1,
        reason: "the machine of these tests has every part",
    },
    Survivor {
        mutant: "vm-core/src/machine/network/messages.rs: replace + with * in Vm<P, C, SLOTS>::contain",
        count: 1,
        reason: "the next message sets the top of the stack; until then the last local is overwritten, which is read before",
    },
    Survivor {
        mutant: "vm-core/src/machine/network/messages.rs: replace + with * in Vm<P, C, SLOTS>::enter_messages",
        count: 2,
        reason: "one slot less is asked for: record, locals and arguments of a listener take eleven of the thirteen",
    },
    Survivor {
        mutant: "vm-core/src/machine/network/messages.rs: replace + with * in Vm<P, C, SLOTS>::next_message",
        count: 3,
        reason: "the last local, the digest of a conflict, is overwritten by a value that has been read, or where none is needed; or the value of `step` takes the place of a record that is not read again",
    },
    Survivor {
        mutant: "vm-core/src/machine/network/messages.rs: replace + with - in Vm<P, C, SLOTS>::contain",
        count: 1,
        reason: "the next message sets the top of the stack; until then only locals are overwritten that are read before",
    },
    Survivor {
        mutant: "vm-core/src/machine/network/messages.rs: replace + with - in Vm<P, C, SLOTS>::enter_messages",
        count: 1,
        reason: "two slots less are asked for: record, locals and arguments of a listener take eleven of the thirteen",
    },
    Survivor {
        mutant: "vm-core/src/machine/network/messages.rs: replace | with ^",
        count: 2,
        reason: "the bits have none in common",
    },
    Survivor {
        mutant: "vm-core/src/machine/network/messages.rs: replace || with && in Vm<P, C, SLOTS>::talk",
        count: 1,
        reason: "a value that is missing has a wrong type, too, which is reported as missing",
    },
    Survivor {
        mutant: "vm-core/src/machine/network/neighbors.rs: replace + with * in Vm<P, C, SLOTS>::age_neighbors",
        count: 1,
        reason: "no function asks in which swarms a forgotten robot was",
    },
    Survivor {
        mutant: "vm-core/src/machine/network/neighbors.rs: replace + with - in Vm<P, C, SLOTS>::age_neighbors",
        count: 1,
        reason: "no function asks in which swarms a forgotten robot was",
    },
    Survivor {
        mutant: "vm-core/src/machine/network/neighbors.rs: replace < with <= in Vm<P, C, SLOTS>::find_neighbor",
        count: 2,
        reason: "of neighbors heard last in the same step another one gives way; no neighbor's last step is the present one",
    },
    Survivor {
        mutant: "vm-core/src/machine/network/neighbors.rs: replace | with ^ in Vm<P, C, SLOTS>::hear",
        count: 1,
        reason: "the bits have none in common",
    },
    Survivor {
        mutant: "vm-core/src/machine/network/serial.rs: replace && with || in Vm<P, C, SLOTS>::sendable",
        count: 1,
        reason: "the digest of a plain value is 0 then: such values are ordered by their bits before their digests",
    },
    Survivor {
        mutant: "vm-core/src/machine/network/serial.rs: replace * with + in Vm<P, C, SLOTS>::has_room_for",
        count: 2,
        reason: "less room is asked for, but still more than tables that fit a message take; a listener that finds too little for itself has a fault of its own",
    },
    Survivor {
        mutant: "vm-core/src/machine/network/serial.rs: replace + with *",
        count: 1,
        reason: "a table within a table takes two more slots of the stack while it is written",
    },
    Survivor {
        mutant: "vm-core/src/machine/network/serial.rs: replace + with * in Vm<P, C, SLOTS>::has_room_for",
        count: 3,
        reason: "another room is asked for, but still more than contents of a message take",
    },
    Survivor {
        mutant: "vm-core/src/machine/network/serial.rs: replace + with - in Vm<P, C, SLOTS>::read",
        count: 3,
        reason: "the table is in the first slot: 0 is subtracted",
    },
    Survivor {
        mutant: "vm-core/src/machine/network/serial.rs: replace < with <= in Vm<P, C, SLOTS>::has_room_for",
        count: 1,
        reason: "one collection more, where the room is just enough without",
    },
    Survivor {
        mutant: "vm-core/src/machine/network/serial.rs: replace < with <= in Vm<P, C, SLOTS>::sendable",
        count: 1,
        reason: "the digest of a plain value is 0 then: such values are ordered by their bits before their digests",
    },
    Survivor {
        mutant: "vm-core/src/machine/network/serial.rs: replace match guard P::FULL with true in Vm<P, C, SLOTS>::has_room_for",
        count: 1,
        reason: "a message of `tiny` has no text",
    },
    Survivor {
        mutant: "vm-core/src/machine/network/serial.rs: replace | with ^ in Vm<P, C, SLOTS>::assemble",
        count: 1,
        reason: "a bit and the bits below it have none in common",
    },
    Survivor {
        mutant: "vm-core/src/machine/network/serial.rs: replace || with && in Vm<P, C, SLOTS>::copied",
        count: 1,
        reason: "a value that is no table is copied, too, which gives an equal one",
    },
    Survivor {
        mutant: "vm-core/src/machine/network/entries.rs: replace + with * in Vm<P, C, SLOTS>::new_entry",
        count: 1,
        reason: "a place without an entry is empty: its clock is nil already, and a slot beyond the memory is none",
    },
    Survivor {
        mutant: "vm-core/src/machine/network/merging.rs: replace + with - in Vm<P, C, SLOTS>::adopt",
        count: 1,
        reason: "the key is in the first slot: 0 is subtracted",
    },
    Survivor {
        mutant: "vm-core/src/machine/network/stigmergy.rs: replace + with - in Vm<P, C, SLOTS>::entry_message",
        count: 1,
        reason: "the key is in the first slot: 0 is subtracted",
    },
    Survivor {
        mutant: "vm-core/src/machine/network/entries.rs: replace + with - in Vm<P, C, SLOTS>::find_entry",
        count: 1,
        reason: "the key is in the first slot: 0 is subtracted",
    },
    Survivor {
        mutant: "vm-core/src/machine/network/entries.rs: replace + with - in Vm<P, C, SLOTS>::forget_entries_on_heap",
        count: 1,
        reason: "the key is in the first slot: 0 is subtracted",
    },
    Survivor {
        mutant: "vm-core/src/machine/network/entries.rs: replace + with - in Vm<P, C, SLOTS>::new_entry",
        count: 1,
        reason: "the key is in the first slot: 0 is subtracted",
    },
    Survivor {
        mutant: "vm-core/src/machine/network/stigmergy.rs: replace + with - in Vm<P, C, SLOTS>::next_entry",
        count: 1,
        reason: "the key is in the first slot: 0 is subtracted",
    },
    Survivor {
        mutant: "vm-core/src/machine/network/merging.rs: replace < with <= in Vm<P, C, SLOTS>::take_greater",
        count: 1,
        reason: "the interval is one step longer until the next advertisement, which limits it",
    },
    Survivor {
        mutant: "vm-core/src/machine/network/entries.rs: replace | with ^ in Vm<P, C, SLOTS>::set_stamp",
        count: 2,
        reason: "the bits have none in common",
    },
    Survivor {
        mutant: "vm-core/src/machine/network/swarms.rs: replace < with <= in Vm<P, C, SLOTS>::find_swarm",
        count: 1,
        reason: "every place beyond the last swarm means that there is none",
    },
    Survivor {
        mutant: "vm-core/src/machine/network/swarms.rs: replace | with ^ in Vm<P, C, SLOTS>::set_member",
        count: 1,
        reason: "the second change in a step leaves what the others know",
    },
    Survivor {
        mutant: "vm-core/src/message/check.rs: replace << with >> in crc16",
        count: 2,
        reason: "only an AVR runs this: tests of its image exchange frames with other robots",
    },
    Survivor {
        mutant: "vm-core/src/message/check.rs: replace >> with << in crc16",
        count: 1,
        reason: "only an AVR runs this: tests of its image exchange frames with other robots",
    },
    Survivor {
        mutant: "vm-core/src/message/check.rs: replace ^ with & in crc16",
        count: 3,
        reason: "only an AVR runs this: tests of its image exchange frames with other robots",
    },
    Survivor {
        mutant: "vm-core/src/message/check.rs: replace ^ with | in crc16",
        count: 3,
        reason: "only an AVR runs this: tests of its image exchange frames with other robots",
    },
    Survivor {
        mutant: "vm-core/src/message/check.rs: replace ^= with &= in crc16",
        count: 1,
        reason: "only an AVR runs this: tests of its image exchange frames with other robots",
    },
    Survivor {
        mutant: "vm-core/src/message/check.rs: replace ^= with |= in crc16",
        count: 1,
        reason: "only an AVR runs this: tests of its image exchange frames with other robots",
    },
    Survivor {
        mutant: "vm-core/src/message/content.rs: replace match guard P::FULL with true in ContentReader<'a>::check",
        count: 1,
        reason: "a message of `tiny` has no text",
    },
    Survivor {
        mutant: "vm-core/src/message/content.rs: replace | with ^ in ContentReader<'a>::new",
        count: 1,
        reason: "the bits have none in common",
    },
    Survivor {
        mutant: "vm-core/src/message/frame.rs: replace | with ^ in Frame<P>::digest",
        count: 1,
        reason: "the bits have none in common",
    },
    Survivor {
        mutant: "vm-core/src/message/frame.rs: replace | with ^ in Frame<P>::put_broadcast",
        count: 1,
        reason: "the bits have none in common",
    },
    Survivor {
        mutant: "vm-core/src/message/frame.rs: replace | with ^ in Frame<P>::put_entry",
        count: 2,
        reason: "the bits have none in common",
    },
    Survivor {
        mutant: "vm-core/src/message/frame.rs: replace | with ^ in Frame<P>::put_fragment",
        count: 2,
        reason: "the bits have none in common",
    },
    Survivor {
        mutant: "vm-core/src/message/frame.rs: replace | with ^ in Frame<P>::put_swarms",
        count: 1,
        reason: "the bits have none in common",
    },
    Survivor {
        mutant: "vm-core/src/message/frame.rs: replace | with ^ in Frame<P>::translate",
        count: 1,
        reason: "the bits have none in common",
    },
    Survivor {
        mutant: "vm-core/src/message/frame.rs: replace |= with ^= in Frame<P>::translate",
        count: 2,
        reason: "the bits have none in common",
    },
    Survivor {
        mutant: "vm-core/src/message/frame.rs: replace |= with ^= in Frame<P>::translate_words",
        count: 1,
        reason: "the first of two: nothing is foreign before it",
    },
    Survivor {
        mutant: "vm-core/src/message/mod.rs: replace |= with ^= in Swarms::push",
        count: 1,
        reason: "the bit was not set before",
    },
    Survivor {
        mutant: "vm-core/src/message/waiting.rs: replace | with ^ in clock",
        count: 1,
        reason: "the bits have none in common",
    },
    Survivor {
        mutant: "vm-core/src/message/waiting.rs: replace | with ^ in replaces",
        count: 2,
        reason: "the bits have none in common",
    },
    Survivor {
        mutant: "vm-core/src/machine/network/protocol.rs: replace << with >>",
        count: 1,
        reason: "a digest that is kept is computed anew, and is the same",
    },
    Survivor {
        mutant: "vm-core/src/stamp.rs: replace < with <= in Stamp<P>::order",
        count: 4,
        reason: "the two are not equal there",
    },
    Survivor {
        mutant: "vm-core/src/stamp.rs: replace < with > in Stamp<P>::order",
        count: 3,
        reason: "types, bits or digests in the reverse order: robots need the same order, no matter which",
    },
    Survivor {
        mutant: "vm-core/src/machine/network/mod.rs: replace || with &&",
        count: 3,
        reason: "the machine of these tests has every part",
    },
    Survivor {
        mutant: "vm-core/src/machine/network/mod.rs: replace && with ||",
        count: 1,
        reason: "the machine of these tests has every part",
    },
    Survivor {
        mutant: "vm-core/src/machine/network/mod.rs: replace match guard Self::HAS_NETWORK with true in Vm<P, C, SLOTS>::sizes",
        count: 1,
        reason: "the machine of these tests has every part",
    },
    Survivor {
        mutant: "vm-core/src/machine/network/mod.rs: replace && with || in Vm<P, C, SLOTS>::send_changes",
        count: 1,
        reason: "without a change all entries and swarms are looked through, and none is sent",
    },
    Survivor {
        mutant: "vm-core/src/machine/network/mod.rs: replace Vm<P, C, SLOTS>::has_changes -> bool with true",
        count: 1,
        reason: "without a change all entries and swarms are looked through, and none is sent",
    },
    Survivor {
        mutant: "vm-core/src/machine/network/mod.rs: replace && with || in Vm<P, C, SLOTS>::has_changes",
        count: 1,
        reason: "without a change all entries and swarms are looked through, and none is sent",
    },
    Survivor {
        mutant: "vm-core/src/machine/network/advertise.rs: replace < with <= in Vm<P, C, SLOTS>::flush_next",
        count: 1,
        reason: "the slots after the last entry hold numbers of stigmergies, whose tags are no news",
    },
    Survivor {
        mutant: "vm-core/src/machine/network/entries.rs: replace | with ^ in Vm<P, C, SLOTS>::stamp",
        count: 1,
        reason: "the bits have none in common",
    },
    Survivor {
        mutant: "vm-core/src/machine/network/entries.rs: replace + with - in Vm<P, C, SLOTS>::forget_deleted",
        count: 1,
        reason: "the key is in the first slot: 0 is subtracted",
    },
    Survivor {
        mutant: "vm-core/src/machine/network/entries.rs: replace + with - in Vm<P, C, SLOTS>::is_entry",
        count: 1,
        reason: "the key is in the first slot: 0 is subtracted",
    },
    Survivor {
        mutant: "vm-core/src/machine/network/index.rs: replace + with - in Vm<P, C, SLOTS>::link_entry",
        count: 1,
        reason: "the key is in the first slot: 0 is subtracted",
    },
    Survivor {
        mutant: "vm-core/src/machine/network/index.rs: replace + with - in Vm<P, C, SLOTS>::unlink_entry",
        count: 1,
        reason: "the key is in the first slot: 0 is subtracted",
    },
    Survivor {
        mutant: "vm-core/src/machine/network/index.rs: replace ^ with | in Vm<P, C, SLOTS>::head_slot",
        count: 1,
        reason: "an entry is looked for in the chain that it was put into, no matter which",
    },
    Survivor {
        mutant: "vm-core/src/machine/network/index.rs: replace ^ with & in Vm<P, C, SLOTS>::head_slot",
        count: 1,
        reason: "an entry is looked for in the chain that it was put into, no matter which",
    },
    Survivor {
        mutant: "vm-core/src/machine/network/index.rs: replace * with + in Vm<P, C, SLOTS>::head_slot",
        count: 1,
        reason: "an entry is looked for in the chain that it was put into, no matter which",
    },
    Survivor {
        mutant: "vm-core/src/machine/network/index.rs: replace * with / in Vm<P, C, SLOTS>::head_slot",
        count: 1,
        reason: "an entry is looked for in the chain that it was put into, no matter which",
    },
    Survivor {
        mutant: "vm-core/src/machine/network/merging.rs: replace < with <= in Vm<P, C, SLOTS>::is_unsettled",
        count: 1,
        reason: "the low bits of the clocks are half a circle apart then, and neither is the earlier one",
    },
    Survivor {
        mutant: "vm-core/src/machine/network/messages.rs: replace && with || in Vm<P, C, SLOTS>::next_message",
        count: 1,
        reason: "without a conflict there is no entry under the key, or the conflict that has ended is decided in the same way again",
    },
    Survivor {
        mutant: "vm-core/src/machine/network/messages.rs: replace + with * in Vm<P, C, SLOTS>::drop_operands",
        count: 2,
        reason: "the last local, the digest of a conflict, is overwritten by a value that has been read, or where none is needed",
    },
    Survivor {
        mutant: "vm-core/src/machine/network/neighbors.rs: replace + with - in Vm<P, C, SLOTS>::record",
        count: 1,
        reason: "a call leaves room for more than three slots: a test calls the function at each depth of the stack",
    },
    Survivor {
        mutant: "vm-core/src/machine/network/neighbors.rs: replace + with * in Vm<P, C, SLOTS>::record",
        count: 2,
        reason: "more room is asked for than is needed; and a collection keeps cells until the next one that calls before have left",
    },
    Survivor {
        mutant: "vm-core/src/machine/network/serial.rs: replace match guard P::FULL with true in Vm<P, C, SLOTS>::read",
        count: 1,
        reason: "a message of `tiny` has no text",
    },
    Survivor {
        mutant: "vm-core/src/machine/network/serial.rs: replace match guard P::FULL with true in Vm<P, C, SLOTS>::write_item",
        count: 1,
        reason: "a script of `tiny` has no text that was made at run time",
    },
    Survivor {
        mutant: "vm-core/src/machine/network/serial.rs: replace Vm<P, C, SLOTS>::read_flat -> Result<Option<Head>, Stopped> with Ok(None)",
        count: 1,
        reason: "a shortcut of computers: what it does not read, the slower way reads",
    },
    Survivor {
        mutant: "vm-core/src/machine/network/serial.rs: delete ! in Vm<P, C, SLOTS>::read_flat",
        count: 1,
        reason: "a shortcut of computers: what it does not read, the slower way reads",
    },
    Survivor {
        mutant: "vm-core/src/machine/network/serial.rs: replace * with + in Vm<P, C, SLOTS>::read_flat",
        count: 2,
        reason: "a shortcut of computers: what it does not read, the slower way reads",
    },
    Survivor {
        mutant: "vm-core/src/machine/network/serial.rs: replace * with / in Vm<P, C, SLOTS>::read_flat",
        count: 2,
        reason: "a shortcut of computers: what it does not read, the slower way reads",
    },
    Survivor {
        mutant: "vm-core/src/machine/network/serial.rs: replace += with *= in Vm<P, C, SLOTS>::read_flat",
        count: 1,
        reason: "a shortcut of computers: what it does not read, the slower way reads",
    },
    Survivor {
        mutant: "vm-core/src/machine/network/serial.rs: replace + with * in Vm<P, C, SLOTS>::read_flat",
        count: 2,
        reason: "a shortcut of computers: what it does not read, the slower way reads",
    },
    Survivor {
        mutant: "vm-core/src/machine/network/serial.rs: replace < with <= in Vm<P, C, SLOTS>::read_flat",
        count: 1,
        reason: "a shortcut of computers: what it does not read, the slower way reads",
    },
    Survivor {
        mutant: "vm-core/src/machine/network/serial.rs: replace + with - in Vm<P, C, SLOTS>::read_flat",
        count: 1,
        reason: "the table is in the first slot: 0 is subtracted",
    },
    Survivor {
        mutant: "vm-core/src/machine/network/advertise.rs: replace && with || in Vm<P, C, SLOTS>::digest",
        count: 1,
        reason: "the sum is computed once more, and is the same",
    },
    Survivor {
        mutant: "vm-core/src/message/mod.rs: replace | with ^ in Fragment<'a>::parse",
        count: 1,
        reason: "the bits have none in common",
    },
    Survivor {
        mutant: "vm-core/src/message/mod.rs: replace | with ^ in Fragment<'a>::head",
        count: 2,
        reason: "the bits have none in common",
    },
    Survivor {
        mutant: "vm-core/src/message/waiting.rs: replace | with ^ in replaces_content",
        count: 1,
        reason: "the bits have none in common",
    },
    Survivor {
        mutant: "vm-core/src/message/content.rs: replace - with + in ContentReader<'a>::plain",
        count: 1,
        reason: "a shortcut of computers: what it does not read, the slower way reads",
    },
    Survivor {
        mutant: "vm-core/src/network.rs: replace > with >=",
        count: 1,
        reason: "computers, on which the tests run, count places in two bytes",
    },
    Survivor {
        mutant: "vm-core/src/network.rs: replace > with >= in Sizes::stigmergies",
        count: 1,
        reason: "at a hundred entries both numbers are a hundred",
    },
    Survivor {
        mutant: "vm-core/src/network.rs: replace Sizes::chains -> usize with 1",
        count: 1,
        reason: "an entry is looked for in the chain that it was put into, however many there are",
    },
    Survivor {
        mutant: "vm-core/src/network.rs: replace / with * in Sizes::chains",
        count: 1,
        reason: "an entry is looked for in the chain that it was put into, however many there are",
    },
];
