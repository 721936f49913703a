//! Runs a session or a recording in the caller's thread, controlled by the page.

use std::sync::mpsc::RecvTimeoutError;
use std::time::{Duration, Instant};

use bittybuzz_live::Source;
use tokio::sync::mpsc::UnboundedSender;

use crate::server::{ClientEvent, Page, ToClient};

/// The longest time that a run advances before requests are read.
const TURN: Duration = Duration::from_millis(12);

/// The longest wait for an event: at most 66 samples per second, and less than 1 % of a core at
/// rest.
const PULSE: Duration = Duration::from_millis(15);

/// The time that a session waits for its page to connect again, for example after a reload.
const LINGER: Duration = Duration::from_secs(5);

/// The client that controls the session.
struct Client {
    number: u64,
    messages: UnboundedSender<ToClient>,
    /// True once the last sample was sent, so that the next one may be taken.
    is_ready: bool,
    /// The tick of the client's last sample; `None` if the next sample is due at any tick.
    sampled: Option<u64>,
}

impl Page {
    /// Shows a session or a recording until the page has been closed for some seconds or
    /// `is_interrupted` returns true. Waits without limit for a page that was never opened.
    pub fn show(&self, source: &mut dyn Source, mut is_interrupted: impl FnMut() -> bool) {
        let start = Instant::now();
        let mut client: Option<Client> = None;
        let mut closed_at: Option<Instant> = None;
        while !is_interrupted() && closed_at.is_none_or(|closed| closed.elapsed() < LINGER) {
            let now = start.elapsed();
            let turn = Instant::now();
            let is_late = source.advance(now, &mut || turn.elapsed() < TURN);
            send_news(source, client.as_mut());
            let wait = if is_late { Duration::ZERO } else { PULSE };
            let mut next = self.events.recv_timeout(wait);
            while let Ok((number, event)) = next {
                let current = client.as_mut().filter(|client| client.number == number);
                match (event, current) {
                    (ClientEvent::Connected(messages), _) => {
                        source.begin();
                        client = Some(Client { number, messages, is_ready: true, sampled: None });
                        closed_at = None;
                    }
                    (ClientEvent::Request(text), Some(client)) => {
                        source.request(&text, start.elapsed());
                        client.sampled = None;
                    }
                    (ClientEvent::SampleSent, Some(client)) => client.is_ready = true,
                    (ClientEvent::Disconnected, Some(_)) => {
                        client = None;
                        closed_at = Some(Instant::now());
                    }
                    // The event comes from a client that was replaced.
                    (_, None) => {}
                }
                next = self.events.try_recv().map_err(|_| RecvTimeoutError::Timeout);
            }
        }
        send_news(source, client.as_mut());
    }
}

/// Sends all new events, and a sample if the last one was sent. Without a client the events wait for the next one.
fn send_news(source: &mut dyn Source, client: Option<&mut Client>) {
    let Some(client) = client else { return };
    let tick = source.tick();
    let sample = (client.is_ready && client.sampled != Some(tick)).then(|| source.take_sample());
    // Sending fails after a client disconnected; its `Disconnected` event follows.
    for event in source.take_events() {
        let _ = client.messages.send(ToClient::Event(event.to_json()));
    }
    if let Some(sample) = sample {
        client.is_ready = false;
        client.sampled = Some(tick);
        let _ = client.messages.send(ToClient::Sample(sample));
    }
}
