//! A page in frames of other windows, such as the outputs of a notebook, which pass its messages on.
//!
//! [`Frames`] takes the messages of the frames and returns those for them; [`Page::show`] runs the
//! session in another thread. Views of one session follow the rule of the server: the last one that
//! was opened has the session, and the others wait.

use std::collections::HashMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread;

use tokio::sync::Semaphore;
use tokio::sync::mpsc::{UnboundedReceiver, unbounded_channel};

use crate::server::{ClientEvent, PING, Page, TAKE_OVER, TAKEN, ToClient};

/// The first message of a frame.
const BEGIN: &str = "begin";

/// A message for a frame.
#[derive(Debug)]
pub enum FrameMessage {
    /// Events as a JSON array, and a sample if there is a new one.
    Batch { events: String, sample: Option<Vec<u8>> },
    /// The session has handled the messages before the frame's question.
    Alive,
    /// Another frame has the session now.
    Elsewhere,
    /// The session is over.
    Ended,
}

/// The frames of a page.
///
/// A frame is known by a number that its window chooses. A window may vanish without a message, for
/// example when a notebook is loaded again, so a session goes on without frames.
pub struct Frames {
    events: Sender<(u64, ClientEvent)>,
    to_frames: Sender<(u64, FrameMessage)>,
    /// The frames that have begun, by their numbers.
    views: HashMap<u64, View>,
}

/// A frame that has begun.
struct View {
    /// The places of its requests that have no answer yet.
    places: Arc<Semaphore>,
    /// True once the frame was closed.
    is_closed: Arc<AtomicBool>,
}

impl Frames {
    /// Returns frames, their page, and the messages for the frames.
    #[must_use]
    pub fn new() -> (Frames, Page, Receiver<(u64, FrameMessage)>) {
        let (events, from_frames) = channel();
        let (to_frames, messages) = channel();
        let page = Page::without_server(from_frames);
        (Frames { events, to_frames, views: HashMap::new() }, page, messages)
    }

    /// Takes a message of a frame. One that has not begun, for example because it belongs to an
    /// earlier session, gets the answer that the session is over.
    pub fn receive(&mut self, view: u64, text: String) {
        if text == BEGIN {
            return self.begin(view);
        }
        let Some(View { places, .. }) = self.views.get(&view) else {
            return self.answer(view, FrameMessage::Ended);
        };
        // The window belongs to the user of this process, so its requests are not limited.
        let place =
            || Arc::clone(places).try_acquire_owned().expect("there are more places than memory");
        let event = match text.as_str() {
            TAKEN => ClientEvent::Taken,
            PING => ClientEvent::Ping(place()),
            TAKE_OVER => ClientEvent::TakeOver(place()),
            _ => ClientEvent::Request(text, place()),
        };
        if self.events.send((view, event)).is_err() {
            self.answer(view, FrameMessage::Ended);
        }
    }

    /// Removes a frame that was closed. The one before it has the session again.
    pub fn close(&mut self, view: u64) {
        if let Some(View { is_closed, .. }) = self.views.remove(&view) {
            is_closed.store(true, Ordering::Relaxed);
            // A session that is over needs no message.
            let _ = self.events.send((view, ClientEvent::Disconnected));
        }
    }

    /// Gives the session to a frame, which may have been loaded again.
    fn begin(&mut self, view: u64) {
        self.close(view);
        let (sender, messages) = unbounded_channel();
        if self.events.send((view, ClientEvent::Connected(sender))).is_err() {
            return self.answer(view, FrameMessage::Ended);
        }
        let places = Arc::new(Semaphore::new(Semaphore::MAX_PERMITS));
        let is_closed = Arc::new(AtomicBool::new(false));
        self.views.insert(view, View { places, is_closed: is_closed.clone() });
        let to_frames = self.to_frames.clone();
        thread::spawn(move || {
            pass_on(view, messages, &to_frames);
            // A frame that was closed may have begun again.
            if !is_closed.load(Ordering::Relaxed) {
                let _ = to_frames.send((view, FrameMessage::Ended));
            }
        });
    }

    /// Sends a message to a frame. It is lost after the receiver was dropped.
    fn answer(&self, view: u64, message: FrameMessage) {
        let _ = self.to_frames.send((view, message));
    }
}

/// Passes the messages of a session to a frame, until the session has no more for it.
fn pass_on(
    view: u64,
    mut messages: UnboundedReceiver<ToClient>,
    to_frames: &Sender<(u64, FrameMessage)>,
) {
    while let Some(message) = messages.blocking_recv() {
        let message = match message {
            ToClient::Batch(batch) => {
                let events = format!("[{}]", batch.events.join(","));
                FrameMessage::Batch { events, sample: batch.sample }
            }
            ToClient::Pong(_) => FrameMessage::Alive,
            ToClient::Wait => FrameMessage::Elsewhere,
        };
        if to_frames.send((view, message)).is_err() {
            return;
        }
    }
}
