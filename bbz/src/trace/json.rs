//! Counts as JSON objects.

use bittybuzz_comms::trace::Unused;
use serde_json::{Value, json};

/// Returns the object for discarded messages.
pub fn unused(unused: &Unused) -> Value {
    let Unused { dropped: [unread, unsent], messages } = unused;
    json!({
        "kind": "unused",
        "unread": unread,
        "unsent": unsent,
        "foreign": messages.foreign,
        "malformed": messages.malformed,
        "own_id": messages.own_id,
        "not_kept": messages.not_kept,
        "incomplete": messages.incomplete,
        "undecided": messages.undecided,
        "failed": messages.failed,
    })
}
