//! The messages in a robot's queues.

use bittybuzz_compiler::symbols::Symbols;
use bittybuzz_vm_core::message::{Ignored, Message};
use bittybuzz_vm_core::number::Profile;
use bittybuzz_vm_core::{ByteCode, Value, Vm};
use serde::Serialize;

use crate::object::Limits;
use crate::reader::MachineReader;
use crate::value::ScriptValue;

/// Both queues of a robot.
#[derive(Debug, Clone, PartialEq)]
pub struct Queues {
    /// Received frames, which wait for the script's next step.
    pub inbox: InspectedQueue,
    /// Frames to be sent, which wait for the link.
    pub outbox: InspectedQueue,
}

/// A queue of frames.
#[derive(Debug, Clone, PartialEq)]
pub struct InspectedQueue {
    /// The number of frames that the queue can hold.
    pub capacity: usize,
    /// The frames in the queue, oldest first.
    pub messages: Vec<QueuedMessage<ScriptValue>>,
}

/// A decoded frame in a queue, with values of the type `V`. In JSON, the key `kind` has the name of
/// the variant.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(feature = "declarations", derive(ts_rs::TS), ts(rename = "MessageDescription"))]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum QueuedMessage<V> {
    /// A broadcast of `neighbors.broadcast`.
    Broadcast {
        /// The id of the sender.
        robot: u16,
        /// The topic, a string.
        topic: V,
        value: V,
    },
    /// An entry of a stigmergy, or a query for it.
    Entry {
        /// The number of the stigmergy in the script.
        stigmergy: u16,
        /// The id of the robot that wrote the value or that sends the query.
        owner: u16,
        /// The Lamport clock of the write; 0 for a query.
        clock: u32,
        key: V,
        value: V,
    },
    /// A message by which a robot announces its presence.
    Beacon {
        /// The id of the sender.
        robot: u16,
    },
    /// A beacon with the digest of the sender's stigmergies.
    Digest {
        /// The id of the sender.
        robot: u16,
        /// The sum over the sender's entries.
        digest: u32,
        /// The latest clock of a deletion that the sender has forgotten.
        floor: u32,
    },
    /// The swarms that a robot knows.
    Swarms {
        /// The id of the sender.
        robot: u16,
        /// The numbers of swarms; true if the sender is a member.
        swarms: Vec<(u16, bool)>,
    },
    /// A part of a longer message.
    Fragment {
        /// The id of the sender.
        robot: u16,
        /// The number of the message.
        number: u8,
        /// The index of the part.
        index: u8,
        /// True for the last part.
        is_last: bool,
    },
    /// A frame of a robot with another script.
    Foreign,
    /// A frame that cannot be decoded.
    Malformed,
}

impl InspectedQueue {
    /// Decodes the frames in a queue of the robot with this machine. Symbols of another script are
    /// ignored.
    pub fn of<P: Profile, C: ByteCode, const SLOTS: usize, F: AsRef<[u8]>>(
        vm: &Vm<P, C, SLOTS>,
        symbols: Option<&Symbols>,
        capacity: usize,
        frames: impl IntoIterator<Item = F>,
    ) -> InspectedQueue {
        let mut reader = MachineReader::new(vm, symbols, Limits { depth: 0, values: 0 });
        let decoded = frames.into_iter().map(|frame| message(&mut reader, frame.as_ref()));
        InspectedQueue { capacity, messages: decoded.collect() }
    }
}

impl<V> QueuedMessage<V> {
    /// Returns the message with other values.
    pub fn map<W>(&self, convert: impl Fn(&V) -> W) -> QueuedMessage<W> {
        match self {
            QueuedMessage::Broadcast { robot, topic, value } => QueuedMessage::Broadcast {
                robot: *robot,
                topic: convert(topic),
                value: convert(value),
            },
            QueuedMessage::Entry { stigmergy, owner, clock, key, value } => QueuedMessage::Entry {
                stigmergy: *stigmergy,
                owner: *owner,
                clock: *clock,
                key: convert(key),
                value: convert(value),
            },
            QueuedMessage::Beacon { robot } => QueuedMessage::Beacon { robot: *robot },
            QueuedMessage::Digest { robot, digest, floor } => {
                QueuedMessage::Digest { robot: *robot, digest: *digest, floor: *floor }
            }
            QueuedMessage::Swarms { robot, swarms } => {
                QueuedMessage::Swarms { robot: *robot, swarms: swarms.clone() }
            }
            QueuedMessage::Fragment { robot, number, index, is_last } => QueuedMessage::Fragment {
                robot: *robot,
                number: *number,
                index: *index,
                is_last: *is_last,
            },
            QueuedMessage::Foreign => QueuedMessage::Foreign,
            QueuedMessage::Malformed => QueuedMessage::Malformed,
        }
    }
}

fn message<P: Profile, C: ByteCode, const SLOTS: usize>(
    reader: &mut MachineReader<'_, P, C, SLOTS>,
    frame: &[u8],
) -> QueuedMessage<ScriptValue> {
    let Some(script) = reader.vm.message_script() else { return QueuedMessage::Foreign };
    match Message::<P>::decode(frame, script) {
        Ok(Message::Broadcast { robot, topic, value }) => {
            let (topic, value) = (reader.value(Value::string(topic)), reader.value(value));
            QueuedMessage::Broadcast { robot, topic, value }
        }
        Ok(Message::Entry(entry)) => QueuedMessage::Entry {
            stigmergy: reader.vm.other_stigmergy_number(entry.stigmergy),
            owner: entry.owner,
            clock: entry.clock,
            key: reader.value(entry.key),
            value: reader.value(entry.value),
        },
        Ok(Message::Beacon { robot }) => QueuedMessage::Beacon { robot },
        Ok(Message::Digest { robot, digest, floor }) => {
            QueuedMessage::Digest { robot, digest, floor }
        }
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
