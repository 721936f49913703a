//! The tests of this crate, as one program, so that they are linked once.

#![allow(clippy::unwrap_used, reason = "a failure here fails the test")]

use std::time::Duration;

use bittybuzz_live::{Live, PageEvent, Source};
use serde_json::{Value, json};

mod by_hand;
mod changes;
mod editor;
mod faults;
mod live;
mod questions;
mod recorded;
mod series;
mod stepping;
mod trials;
mod watched;

/// Takes the events of a source, as its client parses them.
fn taken(source: &mut impl Source) -> Vec<Value> {
    let texts = source.take_events();
    let texts = texts.iter().map(PageEvent::to_json);
    texts.map(|text| serde_json::from_str(&text).unwrap()).collect()
}

/// Sends a session to a tick, which it reaches before this function returns.
fn go_to(live: &mut Live, tick: u64) {
    live.request(&json!({ "go_to": { "tick": tick } }).to_string(), Duration::ZERO);
    while live.advance(Duration::ZERO, &mut || true) {}
}
