//! Sessions of the live page, whose frames are in a notebook.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::Duration;

use bittybuzz_arena::run::{Session, Simulation as Run};
use bittybuzz_live::{Live, PageEvent, ScenarioFiles, Shelf, Source};
use bittybuzz_page::{FrameMessage, Frames, Page};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};

use crate::error::{Error, border};
use crate::scenario::ScenarioText;
use crate::simulation::Simulation;
use crate::state::State;

/// The most copies of the run for going back in time.
const COPIES: usize = 32;

/// The command that repeats a session that ended by a defect.
const HELP: &str = "run the cell of the notebook again";

/// A run that pages in frames of a notebook show and control, in a thread of its own.
#[pyclass(frozen, module = "bittybuzz._bittybuzz")]
pub struct LiveSession {
    /// `None` once the session was ended.
    frames: Mutex<Option<Frames>>,
    messages: Mutex<Receiver<(u64, FrameMessage)>>,
    /// Asks for a copy of the run.
    wanted: Mutex<Sender<Sender<Run>>>,
    is_over: Arc<AtomicBool>,
}

/// A session that also gives copies of its run.
struct Copied {
    live: Live,
    wanted: Receiver<Sender<Run>>,
}

impl Source for Copied {
    fn begin(&mut self) {
        self.live.begin();
    }

    fn request(&mut self, text: &str, now: Duration) {
        self.live.request(text, now);
    }

    fn advance(&mut self, now: Duration, has_time: &mut dyn FnMut() -> bool) -> bool {
        for wanted in self.wanted.try_iter() {
            if let Some(copy) = self.live.session().run().snapshot() {
                // A caller that was interrupted needs none.
                let _ = wanted.send(copy);
            }
        }
        self.live.advance(now, has_time)
    }

    fn tick(&self) -> u64 {
        self.live.tick()
    }

    fn take_events(&mut self) -> Vec<PageEvent> {
        self.live.take_events()
    }

    fn take_sample(&mut self) -> Vec<u8> {
        self.live.take_sample()
    }
}

impl LiveSession {
    /// Begins a session with the state of a run.
    pub fn new(run: Run, scenario: ScenarioText) -> Self {
        let (frames, page, messages) = Frames::new();
        let (wanted, wishes) = channel();
        let is_over = Arc::new(AtomicBool::new(false));
        let ended = is_over.clone();
        thread::spawn(move || show(run, scenario, wishes, &page, &ended));
        LiveSession {
            frames: Mutex::new(Some(frames)),
            messages: Mutex::new(messages),
            wanted: Mutex::new(wanted),
            is_over,
        }
    }
}

/// Runs a session until it is ended or finds a defect, which its page shows.
fn show(
    run: Run,
    scenario: ScenarioText,
    wanted: Receiver<Sender<Run>>,
    page: &Page,
    is_over: &AtomicBool,
) {
    let shelf = Shelf::new(ScenarioFiles::on_disk(), scenario.path);
    let live = Live::new(Session::new(run, COPIES), scenario.text).with_workshop(shelf);
    let mut source = Copied { live, wanted };
    // The page has shown the defect, and the session ends in any case.
    let _ = page.show(&mut source, || is_over.load(Ordering::Relaxed), HELP);
}

/// Locks a value that is complete even after a panic of another thread.
fn lock<T>(value: &Mutex<T>) -> MutexGuard<'_, T> {
    value.lock().unwrap_or_else(PoisonError::into_inner)
}

#[pymethods]
impl LiveSession {
    /// Takes a message of the frame with that number.
    fn receive(&self, view: u64, text: String) {
        if let Some(frames) = &mut *lock(&self.frames) {
            frames.receive(view, text);
        }
    }

    /// Removes a frame.
    fn close(&self, view: u64) {
        if let Some(frames) = &mut *lock(&self.frames) {
            frames.close(view);
        }
    }

    /// Waits for the next message for a frame: its number, the message, and a sample if it has one.
    ///
    /// Returns None once the session was ended.
    fn next<'py>(&self, py: Python<'py>) -> PyResult<Option<Message<'py>>> {
        let message = py.detach(|| lock(&self.messages).recv());
        let Ok((view, message)) = message else { return Ok(None) };
        let content = PyDict::new(py);
        let mut bytes = None;
        match message {
            FrameMessage::Batch { events, sample } => {
                content.set_item("events", events)?;
                bytes = sample.map(|sample| PyBytes::new(py, &sample));
            }
            FrameMessage::Alive => content.set_item("isAlive", true)?,
            FrameMessage::Elsewhere => content.set_item("isElsewhere", true)?,
            FrameMessage::Ended => content.set_item("hasEnded", true)?,
        }
        Ok(Some((view, content, bytes)))
    }

    /// Ends the session.
    fn end(&self) {
        self.is_over.store(true, Ordering::Relaxed);
        // The session's thread drops the other ends of the messages.
        *lock(&self.frames) = None;
    }

    /// Returns a copy of the run.
    fn simulation(&self, py: Python<'_>) -> PyResult<Simulation> {
        border(|| {
            let (sender, copy) = channel();
            let run = py.detach(move || {
                // The thread of the session may still answer for a moment after its end.
                lock(&self.frames).as_ref()?;
                lock(&self.wanted).send(sender).ok()?;
                copy.recv().ok()
            });
            let run = run.ok_or_else(|| Error::new_err("this session has ended"))?;
            Ok(Simulation::new(State::new(run, None)))
        })
    }
}

/// A message for a frame.
type Message<'py> = (u64, Bound<'py, PyDict>, Option<Bound<'py, PyBytes>>);

/// Returns the page for a frame as HTML.
#[pyfunction]
pub fn single_page() -> String {
    bittybuzz_page::single_page()
}
