//! The tests of this crate, as one program, so that they are linked once.

#![allow(clippy::unwrap_used, reason = "a failure here fails the test")]

use std::time::Duration;

use bittybuzz_arena::run::Session;
use bittybuzz_live::{Live, PageEvent, SharedFiles, Shelf, Source};
use serde_json::{Value, json};

mod by_hand;
mod changes;
mod editor;
mod faults;
mod live;
mod measures;
mod messages;
mod questions;
mod recorded;
mod series;
mod stepping;
mod trials;
mod watched;

/// Returns a session of a scenario `x/s.toml` with a script of the name.
fn session(scenario: &str, (name, script): (&str, &str)) -> Live {
    let files = SharedFiles::default();
    files.add("x/s.toml", scenario);
    files.add(format!("x/{name}"), script);
    let shelf = Shelf::new(files, "x/s.toml".into());
    let (run, text) = shelf.open(1).unwrap();
    Live::new(Session::new(run, 5), text).with_workshop(shelf)
}

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
