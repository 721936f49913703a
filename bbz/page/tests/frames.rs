//! Pages in frames, whose windows pass messages on.

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
}

impl Shown {
    fn new() -> Self {
        let (frames, page, messages) = Frames::new();
        let is_over = Arc::new(AtomicBool::new(false));
        let flag = is_over.clone();
        let session = thread::spawn(move || {
            page.show(&mut live(), || flag.load(Ordering::Relaxed), "").unwrap();
        });
        Shown { frames, messages, is_over, session }
    }

    fn send(&mut self, view: u64, text: &str) {
        self.frames.receive(view, text.to_owned());
    }

    fn next(&self) -> (u64, FrameMessage) {
        self.messages.recv_timeout(WAIT_MAX).unwrap()
    }

    /// Takes batches for a frame, and says so, until one has an event of that name. Returns the
    /// event, and true if any batch had a sample.
    fn event(&mut self, view: u64, name: &str) -> (Value, bool) {
        let mut had_sample = false;
        loop {
            let (receiver, FrameMessage::Batch { events, sample }) = self.next() else {
                panic!("no batch")
            };
            assert_eq!(receiver, view);
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
    assert!(matches!(shown.next(), (7, FrameMessage::Alive)));
    shown.send(7, "nonsense");
    let (refused, _) = shown.event(7, "refused");
    assert!(refused["text"].as_str().unwrap().contains("makes no sense"), "{refused}");
    let (mut frames, messages) = shown.end();
    assert!(matches!(messages.recv_timeout(WAIT_MAX).unwrap(), (7, FrameMessage::Ended)));
    // Whatever a frame sends to a session that is over, it is told so.
    for text in ["ping", "begin", GO] {
        frames.receive(7, text.to_owned());
        assert!(matches!(messages.recv_timeout(WAIT_MAX).unwrap(), (7, FrameMessage::Ended)));
    }
}

#[test]
fn the_last_frame_has_the_session() {
    let mut shown = Shown::new();
    shown.send(1, "begin");
    shown.event(1, "begin");
    shown.send(2, "begin");
    assert!(matches!(shown.next(), (1, FrameMessage::Elsewhere)));
    shown.event(2, "begin");
    // A frame that waits cannot do that, but may take the session over.
    shown.send(1, GO);
    shown.send(1, "take over");
    assert!(matches!(shown.next(), (2, FrameMessage::Elsewhere)));
    let (begin, _) = shown.event(1, "begin");
    assert_eq!(begin["event"], "begin");
    shown.frames.close(1);
    shown.event(2, "begin");
    // Closed twice, and one that never began.
    shown.frames.close(1);
    shown.frames.close(3);
    shown.send(3, "ping");
    assert!(matches!(shown.next(), (3, FrameMessage::Ended)));
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
