//! The memory of a robot, as a description for clients.

use std::collections::BTreeMap;

use bittybuzz_inspect::{
    FrameFunction, Handler, HandlerTrigger, InspectedEntry, InspectedNeighbor, InspectedQueue,
    Inspection, Named, Object, QueuedMessage, ScriptFrame, ScriptValue, Stigmergy,
};
use bittybuzz_vm_core::inspect::Activity;
use serde::Serialize;

/// The whole state of a machine.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct MemoryDescription {
    pub activity: ActivityName,
    pub globals: Vec<NamedValue>,
    /// The active functions, innermost first.
    pub frames: Vec<FrameDescription>,
    pub neighbors: Vec<NeighborDescription>,
    pub swarms: Vec<SwarmDescription>,
    pub stigmergies: Vec<StigmergyDescription>,
    pub handlers: Vec<HandlerDescription>,
    pub queues: Option<QueuesDescription>,
    pub slots: SlotsDescription,
    /// The tables and closures to which values refer by their numbers.
    pub objects: BTreeMap<u16, ObjectDescription>,
}

/// The state of a machine.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(rename_all = "snake_case")]
pub enum ActivityName {
    Empty,
    Idle,
    Running,
    Waiting,
    Faulted,
    Resting,
}

/// A name and its value; an array in JSON.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct NamedValue(pub String, pub ValueDescription);

/// A value of a script: `null`, a number, a string, or an object for all others.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(untagged)]
pub enum ValueDescription {
    Nil,
    Int(i32),
    Float(f64),
    String(String),
    Other(OtherValue),
}

/// A value that JSON has no form for. In JSON, the only key has the name of the variant.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(rename_all = "snake_case")]
pub enum OtherValue {
    /// An argument that was not passed.
    Unset(bool),
    /// A float that JSON has no number for.
    Float(String),
    /// A string of which only the number is known.
    String(u16),
    /// The number of an object.
    Table(u16),
    /// The number of an object.
    Closure(u16),
    Function(String),
    Builtin(String),
    RobotFunction(String),
    Library(String),
    Swarm(u16),
    Stigmergy(u16),
}

#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct FrameDescription {
    /// The name of the function.
    pub function: String,
    /// The place of the current instruction; `None` if it is not known.
    pub source: Option<FrameSource>,
    pub locals: Vec<NamedValue>,
}

#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct FrameSource {
    pub file: String,
    pub line: u32,
    pub column: u32,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct NeighborDescription {
    pub id: u16,
    /// The distance in mm; `None` if the link did not measure the place.
    pub distance: Option<f64>,
    /// The azimuth in radians.
    pub azimuth: Option<f64>,
    /// The elevation in radians.
    pub elevation: Option<f64>,
    /// The number of steps after which the neighbor is removed if nothing more is received from it.
    pub steps_left: u8,
    pub swarms: Vec<u16>,
}

#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct SwarmDescription {
    pub number: u16,
    pub is_member: bool,
    pub is_unsent: bool,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct StigmergyDescription {
    pub number: u16,
    pub entries: Vec<EntryDescription>,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct EntryDescription {
    pub key: ValueDescription,
    pub value: ValueDescription,
    /// The id of the robot that wrote the value.
    pub owner: u16,
    /// The Lamport clock of the write.
    pub clock: u32,
    pub is_own: bool,
    pub is_unsent: bool,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct HandlerDescription {
    pub trigger: TriggerDescription,
    pub function: ValueDescription,
}

/// The event for which a handler is called. In JSON, the only key has the name of the variant.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(rename_all = "snake_case")]
pub enum TriggerDescription {
    /// A message on this topic.
    Topic(ValueDescription),
    /// A conflict in the stigmergy with this number.
    Conflict(u16),
    /// A conflict that this robot lost.
    LostConflict(u16),
}

#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct QueuesDescription {
    pub inbox: QueueDescription,
    pub outbox: QueueDescription,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct QueueDescription {
    /// The number of frames that the queue can hold.
    pub capacity: usize,
    pub messages: Vec<QueuedMessage<ValueDescription>>,
}

/// The use of a machine's memory, in slots.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct SlotsDescription {
    pub stack: usize,
    pub heap: usize,
    pub free: usize,
}

/// The contents of a table or closure.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(untagged)]
pub enum ObjectDescription {
    Table {
        /// Keys and values.
        entries: Vec<(ValueDescription, ValueDescription)>,
        /// The number of further entries.
        left_out: usize,
    },
    Closure {
        function: String,
        #[serde(rename = "self")]
        self_value: ValueDescription,
        captures: Vec<NamedValue>,
    },
    /// A function that was read from a table, which becomes its `self`.
    Bound {
        function: ValueDescription,
        #[serde(rename = "self")]
        self_value: ValueDescription,
    },
}

/// Describes the whole state of a machine.
pub fn describe(memory: &Inspection) -> MemoryDescription {
    let swarms = memory.swarms.iter().map(|swarm| SwarmDescription {
        number: swarm.number,
        is_member: swarm.is_member,
        is_unsent: swarm.is_unsent,
    });
    let queues = memory.queues.as_ref().map(|queues| QueuesDescription {
        inbox: queue(&queues.inbox),
        outbox: queue(&queues.outbox),
    });
    let slots = &memory.slots;
    MemoryDescription {
        activity: activity(memory.activity),
        globals: named(&memory.globals),
        frames: memory.frames.iter().map(frame).collect(),
        neighbors: memory.neighbors.iter().map(neighbor).collect(),
        swarms: swarms.collect(),
        stigmergies: memory.stigmergies.iter().map(stigmergy).collect(),
        handlers: memory.handlers.iter().map(handler).collect(),
        queues,
        slots: SlotsDescription { stack: slots.stack, heap: slots.heap, free: slots.free },
        objects: memory.objects.iter().map(|(id, known)| (id.0, object(known))).collect(),
    }
}

fn activity(activity: Activity) -> ActivityName {
    match activity {
        Activity::Empty => ActivityName::Empty,
        Activity::Idle => ActivityName::Idle,
        Activity::Running => ActivityName::Running,
        Activity::Waiting => ActivityName::Waiting,
        Activity::Faulted(_) => ActivityName::Faulted,
        Activity::Resting => ActivityName::Resting,
    }
}

fn value(value: &ScriptValue) -> ValueDescription {
    let other = match value {
        ScriptValue::Nil => return ValueDescription::Nil,
        ScriptValue::Int(number) => return ValueDescription::Int(*number),
        ScriptValue::Float(number) if number.is_finite() => {
            return ValueDescription::Float((*number).into());
        }
        ScriptValue::String(text) => return ValueDescription::String(text.clone()),
        ScriptValue::Unset => OtherValue::Unset(true),
        ScriptValue::Float(number) => OtherValue::Float(number.to_string()),
        ScriptValue::UnknownString(number) => OtherValue::String(*number),
        ScriptValue::Table(id) => OtherValue::Table(id.0),
        ScriptValue::Closure(id) => OtherValue::Closure(id.0),
        ScriptValue::Function(name) => OtherValue::Function(name.clone()),
        ScriptValue::Builtin(name) => OtherValue::Builtin(name.clone()),
        ScriptValue::RobotFunction(name) => OtherValue::RobotFunction(name.clone()),
        ScriptValue::Library(name) => OtherValue::Library((*name).to_owned()),
        ScriptValue::Swarm(number) => OtherValue::Swarm(*number),
        ScriptValue::Stigmergy(number) => OtherValue::Stigmergy(*number),
    };
    ValueDescription::Other(other)
}

fn named(all: &[Named]) -> Vec<NamedValue> {
    all.iter().map(|one| NamedValue(one.name.clone(), value(&one.value))).collect()
}

fn frame(frame: &ScriptFrame) -> FrameDescription {
    let (name, source) = match &frame.function {
        FrameFunction::Script { name, source, .. } => (name.as_str(), source.as_ref()),
        FrameFunction::Builtin(name) | FrameFunction::RobotFunction(name) => (name.as_str(), None),
        FrameFunction::Messages => ("messages", None),
        FrameFunction::Entry => ("entry", None),
        FrameFunction::LibraryCopy => ("copy of a library", None),
    };
    let source = source.map(|at| FrameSource {
        file: at.file.clone(),
        line: at.place.line,
        column: at.place.column,
    });
    FrameDescription { function: name.to_owned(), source, locals: named(&frame.locals) }
}

fn object(object: &Object) -> ObjectDescription {
    match object {
        Object::Table { entries, left_out } => ObjectDescription::Table {
            entries: entries.iter().map(|(key, held)| (value(key), value(held))).collect(),
            left_out: *left_out,
        },
        Object::Closure { function, self_value, captures } => ObjectDescription::Closure {
            function: function.clone(),
            self_value: value(self_value),
            captures: named(captures),
        },
        Object::Bound { function, self_value } => {
            ObjectDescription::Bound { function: value(function), self_value: value(self_value) }
        }
    }
}

fn neighbor(neighbor: &InspectedNeighbor) -> NeighborDescription {
    let [distance, azimuth, elevation] = match neighbor.place {
        Some(place) => place.map(|number| Some(number.into())),
        None => [None; 3],
    };
    NeighborDescription {
        id: neighbor.id,
        distance,
        azimuth,
        elevation,
        steps_left: neighbor.steps_left,
        swarms: neighbor.swarms.clone(),
    }
}

fn stigmergy(stigmergy: &Stigmergy) -> StigmergyDescription {
    let entry = |entry: &InspectedEntry| EntryDescription {
        key: value(&entry.key),
        value: value(&entry.value),
        owner: entry.owner,
        clock: entry.clock,
        is_own: entry.is_own,
        is_unsent: entry.is_unsent,
    };
    let entries = stigmergy.entries.iter().map(entry).collect();
    StigmergyDescription { number: stigmergy.number, entries }
}

fn handler(handler: &Handler) -> HandlerDescription {
    let trigger = match &handler.trigger {
        HandlerTrigger::Message(topic) => TriggerDescription::Topic(value(topic)),
        HandlerTrigger::Conflict(number) => TriggerDescription::Conflict(*number),
        HandlerTrigger::LostConflict(number) => TriggerDescription::LostConflict(*number),
    };
    HandlerDescription { trigger, function: value(&handler.function) }
}

fn queue(queue: &InspectedQueue) -> QueueDescription {
    let messages = queue.messages.iter().map(|message| message.map(value)).collect();
    QueueDescription { capacity: queue.capacity, messages }
}
