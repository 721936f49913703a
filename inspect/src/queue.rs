//! The messages that wait in a robot's queues.

use bittybuzz_compiler::symbols::Symbols;
use bittybuzz_vm_core::message::{Ignored, Message};
use bittybuzz_vm_core::number::Profile;
use bittybuzz_vm_core::{ByteCode, Value, Vm};

use crate::object::Limits;
use crate::reader::MachineReader;
use crate::value::ScriptValue;

/// Both queues of a robot.
#[derive(Debug, Clone, PartialEq)]
pub struct Queues {
    /// Frames that were heard and wait for the script's next step.
    pub inbox: Queue,
    /// Frames that wait for the link.
    pub outbox: Queue,
}

/// A queue of frames.
#[derive(Debug, Clone, PartialEq)]
pub struct Queue {
    /// Frames that fit.
    pub capacity: usize,
    /// Frames that wait, oldest first.
    pub messages: Vec<QueuedMessage>,
}

/// A frame that waits.
#[derive(Debug, Clone, PartialEq)]
pub enum QueuedMessage {
    /// `neighbors.broadcast`
    Broadcast {
        /// The sender.
        robot: u16,
        /// Its topic, a string.
        topic: ScriptValue,
        /// Its value.
        value: ScriptValue,
    },
    /// An entry of a stigmergy, or the question for it.
    Entry {
        /// Number of the stigmergy.
        stigmergy: u16,
        /// The robot that put the value, or that asks.
        owner: u16,
        /// The time of the put, on Lamport's clock; 0 is the question for the key.
        clock: u32,
        /// The key.
        key: ScriptValue,
        /// The value.
        value: ScriptValue,
    },
    /// A robot announces that it is there.
    Beacon {
        /// The sender.
        robot: u16,
    },
    /// A beacon with the digest of the sender's stigmergies.
    Digest {
        /// The sender.
        robot: u16,
        /// The sum over its entries.
        digest: u32,
    },
    /// Swarms that a robot knows.
    Swarms {
        /// The sender.
        robot: u16,
        /// Numbers of swarms; true if the sender is in the swarm.
        swarms: Vec<(u16, bool)>,
    },
    /// A part of a longer message.
    Fragment {
        /// The sender.
        robot: u16,
        /// The message's number.
        number: u8,
        /// Which part.
        index: u8,
        /// None follows.
        is_last: bool,
    },
    /// The frame of a robot with another script.
    Foreign,
    /// A frame that makes no sense.
    Malformed,
}

impl Queue {
    /// Decodes the frames in a queue of a robot with that machine. Symbols of another script are ignored.
    pub fn of<P: Profile, C: ByteCode, const SLOTS: usize, F: AsRef<[u8]>>(
        vm: &Vm<P, C, SLOTS>,
        symbols: Option<&Symbols>,
        capacity: usize,
        frames: impl IntoIterator<Item = F>,
    ) -> Queue {
        let mut reader = MachineReader::new(vm, symbols, Limits { depth: 0, values: 0 });
        let decoded = frames.into_iter().map(|frame| message(&mut reader, frame.as_ref()));
        Queue { capacity, messages: decoded.collect() }
    }
}

fn message<P: Profile, C: ByteCode, const SLOTS: usize>(
    reader: &mut MachineReader<'_, P, C, SLOTS>,
    frame: &[u8],
) -> QueuedMessage {
    let Some(script) = reader.vm.message_script() else { return QueuedMessage::Foreign };
    match Message::<P>::decode(frame, script) {
        Ok(Message::Broadcast { robot, topic, value }) => {
            let (topic, value) = (reader.value(Value::string(topic)), reader.value(value));
            QueuedMessage::Broadcast { robot, topic, value }
        }
        Ok(Message::Entry(entry)) => QueuedMessage::Entry {
            stigmergy: entry.stigmergy,
            owner: entry.owner,
            clock: entry.clock,
            key: reader.value(entry.key),
            value: reader.value(entry.value),
        },
        Ok(Message::Beacon { robot }) => QueuedMessage::Beacon { robot },
        Ok(Message::Digest { robot, digest }) => QueuedMessage::Digest { robot, digest },
        Ok(Message::Swarms { robot, swarms }) => {
            QueuedMessage::Swarms { robot, swarms: swarms.iter().collect() }
        }
        Ok(Message::Fragment(fragment)) => QueuedMessage::Fragment {
            robot: fragment.robot,
            number: fragment.number,
            index: fragment.index,
            is_last: fragment.last,
        },
        Err(Ignored::Foreign) => QueuedMessage::Foreign,
        Err(Ignored::Malformed) => QueuedMessage::Malformed,
    }
}
