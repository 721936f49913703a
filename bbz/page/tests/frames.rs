//! Pages in frames, whose windows pass messages on.

use std::iter;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::Receiver;
use std::thread::{self, JoinHandle};
use std::time::Duration;

use bittybuzz_page::{FrameMessage, Frames};
use serde_json::Value;

use crate::session::live;

/// The longest wait for a message, which takes milliseconds otherwise.
const WAIT_MAX: Duration = Duration::from_secs(60);

/// A request.
const GO: &str = r#"{"go_to":{"tick":3}}"#;

/// A session with frames.
struct Shown {
    frames: Frames,
    messages: Receiver<(u64, FrameMessage)>,
    is_over: Arc<AtomicBool>,
    session: JoinHandle<()>,
    /// Messages for other frames than the one whose message was awaited.
    kept: Vec<(u64, FrameMessage)>,
}

impl Shown {
    fn new() -> Self {
        let (frames, page, messages) = Frames::new();
        let is_over = Arc::new(AtomicBool::new(false));
        let flag = is_over.clone();
        let session = thread::spawn(move || {
            page.show(&mut live(), || flag.load(Ordering::Relaxed), "").unwrap();
        });
        Shown { frames, messages, is_over, session, kept: Vec::new() }
    }

    fn send(&mut self, view: u64, text: &str) {
        self.frames.receive(view, text.to_owned());
    }

    /// Returns the next message for a frame. Messages for different frames have no order.
    fn next(&mut self, view: u64) -> FrameMessage {
        if let Some(place) = self.kept.iter().position(|(receiver, _)| *receiver == view) {
            return self.kept.remove(place).1;
        }
        loop {
            let (receiver, message) = self.messages.recv_timeout(WAIT_MAX).unwrap();
            if receiver == view {
                return message;
            }
            self.kept.push((receiver, message));
        }
    }

    /// Returns the next message for a frame that is no batch.
    fn answer(&mut self, view: u64) -> FrameMessage {
        loop {
            let message = self.next(view);
            if !matches!(message, FrameMessage::Batch { .. }) {
                return message;
            }
        }
    }

    /// Takes batches for a frame, and says so, until one has an event of that name. Returns the
    /// event, and true if any batch had a sample.
    fn event(&mut self, view: u64, name: &str) -> (Value, bool) {
        let mut had_sample = false;
        loop {
            let FrameMessage::Batch { events, sample } = self.next(view) else {
                panic!("no batch")
            };
            had_sample |= sample.is_some();
            self.send(view, "taken");
            let events: Vec<Value> = serde_json::from_str(&events).unwrap();
            if let Some(event) = events.into_iter().find(|event| event["event"] == name) {
                return (event, had_sample);
            }
        }
    }

    /// Ends the session. Returns the frames, and the messages.
    fn end(self) -> (Frames, Receiver<(u64, FrameMessage)>) {
        self.is_over.store(true, Ordering::Relaxed);
        self.session.join().unwrap();
        (self.frames, self.messages)
    }
}

#[test]
fn a_frame_has_the_session() {
    let mut shown = Shown::new();
    shown.send(7, "begin");
    let (begin, had_sample) = shown.event(7, "begin");
    assert_eq!(begin["groups"][0]["robot"], "kilobot");
    assert!(had_sample);
    shown.send(7, GO);
    while shown.event(7, "state").0["tick"] != 3 {}
    shown.send(7, "ping");
    assert!(matches!(shown.answer(7), FrameMessage::Alive));
    shown.send(7, "nonsense");
    let (refused, _) = shown.event(7, "refused");
    assert!(refused["text"].as_str().unwrap().contains("makes no sense"), "{refused}");
    let (mut frames, messages) = shown.end();
    let ended = |messages: &Receiver<(u64, FrameMessage)>| {
        let mut rest = iter::from_fn(|| messages.recv_timeout(WAIT_MAX).ok());
        rest.any(|(_, message)| matches!(message, FrameMessage::Ended))
    };
    assert!(ended(&messages));
    // Whatever a frame sends to a session that is over, it is told so.
    for text in ["ping", "begin", GO] {
        frames.receive(7, text.to_owned());
        assert!(ended(&messages));
    }
}

#[test]
fn the_last_frame_has_the_session() {
    let mut shown = Shown::new();
    shown.send(1, "begin");
    shown.event(1, "begin");
    shown.send(2, "begin");
    assert!(matches!(shown.answer(1), FrameMessage::Elsewhere));
    shown.event(2, "begin");
    // A frame that waits cannot do that, but may take the session over.
    shown.send(1, GO);
    shown.send(1, "take over");
    assert!(matches!(shown.answer(2), FrameMessage::Elsewhere));
    let (begin, _) = shown.event(1, "begin");
    assert_eq!(begin["event"], "begin");
    shown.frames.close(1);
    shown.event(2, "begin");
    // Closed twice, and one that never began.
    shown.frames.close(1);
    shown.frames.close(3);
    shown.send(3, "ping");
    assert!(matches!(shown.answer(3), FrameMessage::Ended));
    shown.end();
}

#[test]
fn a_frame_that_is_loaded_again_begins_again() {
    let mut shown = Shown::new();
    shown.send(5, "begin");
    shown.event(5, "begin");
    shown.send(5, GO);
    while shown.event(5, "state").0["tick"] != 3 {}
    shown.send(5, "begin");
    shown.event(5, "begin");
    let (frames, messages) = shown.end();
    drop(frames);
    let rest: Vec<_> = messages.iter().collect();
    let ends = rest.iter().filter(|(_, message)| matches!(message, FrameMessage::Ended));
    assert_eq!(ends.count(), 1, "{rest:?}");
}
