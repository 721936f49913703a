//! Messages that an unknown robot forges for a script: on each topic and key a value of each class.

use bittybuzz_vm_core::Value;
use bittybuzz_vm_core::builtin::{self, string};
use bittybuzz_vm_core::message::content::{ContentItem, Head};
use bittybuzz_vm_core::message::{Message, ScriptIdentity, StigmergyEntry};
use bittybuzz_vm_core::number::Profile;

use crate::hostile::FORGER;
use crate::{fragments, frame};

/// The part of a script that a forged message reaches.
#[derive(Debug, Clone, Copy)]
pub enum Target<P: Profile> {
    /// The listener to the topic with this string number.
    Topic(u16),
    /// An entry of a stigmergy.
    Entry {
        /// The number of the stigmergy.
        stigmergy: u16,
        /// The key.
        key: Value<P>,
        /// The clock of the forged entry.
        clock: u32,
    },
}

/// Returns a value of each class with its name, as items of a message of several frames. All but tables and functions fit
/// a single frame, too.
pub fn values<P: Profile>() -> Vec<(&'static str, Vec<ContentItem<P>>)> {
    let plain = [
        ("nil", Value::nil()),
        ("string", Value::string(string::COUNT)),
        ("NaN", Value::float(f32::NAN)),
        ("inf", Value::float(f32::INFINITY)),
        ("32767", Value::int(32767)),
        ("-32767", Value::int(-32767)),
        ("-1", Value::int(-1)),
        ("0", Value::int(0)),
    ];
    let mut values: Vec<(&str, Vec<ContentItem<P>>)> =
        plain.into_iter().map(|(name, value)| (name, vec![ContentItem::Plain(value)])).collect();
    let pair = [ContentItem::Plain(Value::string(0)), ContentItem::Plain(Value::int(1))];
    values.push(("an empty table", vec![ContentItem::Table(0)]));
    values.push(("a table", [&[ContentItem::Table(1)], &pair[..]].concat()));
    values.push(("a function", vec![ContentItem::Function(0)]));
    values
}

/// Returns the topics that a script listens to, and possible keys of its stigmergies, each with its name. `own_strings`
/// are those of its symbols.
///
/// # Panics
/// If a topic is no constant.
pub fn targets<P: Profile>(text: &str, own_strings: &[String]) -> Vec<(String, Target<P>)> {
    let mut targets = Vec::new();
    for listen in text.split("neighbors.listen(\"").skip(1) {
        let (topic, _) = listen.split_once('"').expect("a topic is a constant");
        let own = own_strings.iter().position(|string| string == topic);
        let number = match own {
            Some(own) => string::COUNT + own as u16,
            None => {
                let known = builtin::STRINGS.iter().position(|known| *known == topic);
                known.expect("a topic is a string of the script or of the machine") as u16
            }
        };
        targets.push((format!("topic {topic}"), Target::Topic(number)));
    }
    for create in text.split("stigmergy.create(").skip(1) {
        // Comments write `n`.
        let number = create.split(')').next().and_then(|number| number.parse().ok());
        let Some(stigmergy) = number else { continue };
        let strings = own_strings
            .iter()
            .enumerate()
            .map(|(own, name)| (format!("key {name}"), Value::string(string::COUNT + own as u16)));
        let integers = (-1..=8).map(|key| (format!("key {key}"), Value::int(key)));
        for (name, key) in strings.chain(integers) {
            for clock in [1, 1000] {
                let target = Target::Entry { stigmergy, key, clock };
                targets.push((format!("{name} with clock {clock}"), target));
            }
        }
    }
    targets
}

/// Returns the frames that bring these items to a target: one if they fit, else fragments.
///
/// # Panics
/// If the items are too long for a message.
pub fn frames<P: Profile>(
    script: ScriptIdentity,
    target: Target<P>,
    items: &[ContentItem<P>],
) -> Vec<Vec<u8>> {
    let whole = match (target, items) {
        (Target::Topic(topic), [ContentItem::Plain(value)]) => {
            Some(Message::Broadcast { robot: FORGER, topic, value: *value })
        }
        (Target::Entry { stigmergy, key, clock }, [ContentItem::Plain(value)]) => {
            Some(Message::Entry(StigmergyEntry {
                stigmergy,
                owner: FORGER,
                clock,
                key,
                value: *value,
            }))
        }
        _ => None,
    };
    if let Some(message) = whole {
        return vec![frame(script, &message)];
    }
    let (head, first) = match target {
        Target::Topic(topic) => (Head::Broadcast, Value::string(topic)),
        Target::Entry { stigmergy, key, clock } => {
            (Head::Entry { stigmergy, owner: FORGER, clock, digest: 0 }, key)
        }
    };
    fragments(script, FORGER, head, &[&[ContentItem::Plain(first)], items].concat())
}
