//! The memory of a robot, as a JSON object for clients.
//!
//! A value is `null`, a number, a string, or an object with one key that names its kind: `float` (a
//! float that JSON has no number for), `table` and `closure` (the number of an object in
//! `objects`), `function`, `builtin`, `robot_function`, `library`, `swarm`, `stigmergy`, `string`
//! (a string of which only the number is known), `unset` (an argument that was not passed).

use bittybuzz_inspect::{
    FrameFunction, Handler, HandlerTrigger, InspectedNeighbor, InspectedQueue, Inspection, Named,
    Object, QueuedMessage, ScriptFrame, ScriptValue, Stigmergy,
};
use bittybuzz_vm_core::inspect::Activity;
use serde_json::{Map, Value, json};

/// Returns the whole state of a machine.
pub fn json(memory: &Inspection) -> Value {
    let objects: Map<String, Value> =
        memory.objects.iter().map(|(id, known)| (id.0.to_string(), object(known))).collect();
    json!({
        "activity": activity(memory.activity),
        "globals": named(&memory.globals),
        "frames": memory.frames.iter().map(frame).collect::<Vec<_>>(),
        "neighbors": memory.neighbors.iter().map(neighbor).collect::<Vec<_>>(),
        "swarms": memory.swarms.iter().map(|swarm| json!({
            "number": swarm.number, "is_member": swarm.is_member, "is_unsent": swarm.is_unsent,
        })).collect::<Vec<_>>(),
        "stigmergies": memory.stigmergies.iter().map(stigmergy).collect::<Vec<_>>(),
        "handlers": memory.handlers.iter().map(handler).collect::<Vec<_>>(),
        "queues": memory.queues.as_ref().map(|queues| json!({
            "inbox": queue(&queues.inbox), "outbox": queue(&queues.outbox),
        })),
        "slots": {
            "stack": memory.slots.stack, "heap": memory.slots.heap, "free": memory.slots.free,
        },
        "objects": objects,
    })
}

fn activity(activity: Activity) -> &'static str {
    match activity {
        Activity::Empty => "empty",
        Activity::Idle => "idle",
        Activity::Running => "running",
        Activity::Waiting => "waiting",
        Activity::Faulted(_) => "faulted",
        Activity::Resting => "resting",
    }
}

fn value(value: &ScriptValue) -> Value {
    match value {
        ScriptValue::Nil => Value::Null,
        ScriptValue::Unset => json!({ "unset": true }),
        ScriptValue::Int(number) => json!(number),
        ScriptValue::Float(number) if number.is_finite() => json!(number),
        ScriptValue::Float(number) => json!({ "float": number.to_string() }),
        ScriptValue::String(text) => json!(text),
        ScriptValue::UnknownString(number) => json!({ "string": number }),
        ScriptValue::Table(id) => json!({ "table": id.0 }),
        ScriptValue::Closure(id) => json!({ "closure": id.0 }),
        ScriptValue::Function(name) => json!({ "function": name }),
        ScriptValue::Builtin(name) => json!({ "builtin": name }),
        ScriptValue::RobotFunction(name) => json!({ "robot_function": name }),
        ScriptValue::Library(name) => json!({ "library": name }),
        ScriptValue::Swarm(number) => json!({ "swarm": number }),
        ScriptValue::Stigmergy(number) => json!({ "stigmergy": number }),
    }
}

/// Returns names and values in their order, as an array of pairs.
fn named(all: &[Named]) -> Value {
    all.iter().map(|one| json!([one.name, value(&one.value)])).collect()
}

fn frame(frame: &ScriptFrame) -> Value {
    let (name, source) = match &frame.function {
        FrameFunction::Script { name, source, .. } => (name.as_str(), source.as_ref()),
        FrameFunction::Builtin(name) | FrameFunction::RobotFunction(name) => (name.as_str(), None),
        FrameFunction::Messages => ("messages", None),
        FrameFunction::Entry => ("entry", None),
        FrameFunction::LibraryCopy => ("copy of a library", None),
    };
    let source = source
        .map(|at| json!({ "file": at.file, "line": at.place.line, "column": at.place.column }));
    json!({ "function": name, "source": source, "locals": named(&frame.locals) })
}

fn object(object: &Object) -> Value {
    match object {
        Object::Table { entries, left_out } => {
            let entries: Vec<Value> =
                entries.iter().map(|(key, held)| json!([value(key), value(held)])).collect();
            json!({ "entries": entries, "left_out": left_out })
        }
        Object::Closure { function, self_value, captures } => json!({
            "function": function, "self": value(self_value), "captures": named(captures),
        }),
        Object::Bound { function, self_value } => {
            json!({ "function": value(function), "self": value(self_value) })
        }
    }
}

fn neighbor(neighbor: &InspectedNeighbor) -> Value {
    let [distance, azimuth, elevation] = match neighbor.place {
        Some(place) => place.map(Some),
        None => [None; 3],
    };
    json!({
        "id": neighbor.id,
        "distance": distance,
        "azimuth": azimuth,
        "elevation": elevation,
        "steps_left": neighbor.steps_left,
        "swarms": neighbor.swarms,
    })
}

fn stigmergy(stigmergy: &Stigmergy) -> Value {
    let entries = stigmergy.entries.iter().map(|entry| {
        json!({
            "key": value(&entry.key),
            "value": value(&entry.value),
            "owner": entry.owner,
            "clock": entry.clock,
            "is_own": entry.is_own,
            "is_unsent": entry.is_unsent,
        })
    });
    json!({ "number": stigmergy.number, "entries": entries.collect::<Vec<_>>() })
}

fn handler(handler: &Handler) -> Value {
    let trigger = match &handler.trigger {
        HandlerTrigger::Message(topic) => json!({ "topic": value(topic) }),
        HandlerTrigger::Conflict(number) => json!({ "conflict": number }),
        HandlerTrigger::LostConflict(number) => json!({ "lost_conflict": number }),
    };
    json!({ "trigger": trigger, "function": value(&handler.function) })
}

fn queue(queue: &InspectedQueue) -> Value {
    let messages: Vec<Value> = queue.messages.iter().map(message).collect();
    json!({ "capacity": queue.capacity, "messages": messages })
}

fn message(message: &QueuedMessage) -> Value {
    match message {
        QueuedMessage::Broadcast { robot, topic, value: sent } => json!({
            "kind": "broadcast", "robot": robot, "topic": value(topic), "value": value(sent),
        }),
        QueuedMessage::Entry { stigmergy, owner, clock, key, value: stored } => json!({
            "kind": "entry", "stigmergy": stigmergy, "owner": owner, "clock": clock,
            "key": value(key), "value": value(stored),
        }),
        QueuedMessage::Beacon { robot } => json!({ "kind": "beacon", "robot": robot }),
        QueuedMessage::Digest { robot, digest } => {
            json!({ "kind": "digest", "robot": robot, "digest": digest })
        }
        QueuedMessage::Swarms { robot, swarms } => {
            json!({ "kind": "swarms", "robot": robot, "swarms": swarms })
        }
        QueuedMessage::Fragment { robot, number, index, is_last } => json!({
            "kind": "fragment", "robot": robot, "number": number, "index": index,
            "is_last": is_last,
        }),
        QueuedMessage::Foreign => json!({ "kind": "foreign" }),
        QueuedMessage::Malformed => json!({ "kind": "malformed" }),
    }
}
