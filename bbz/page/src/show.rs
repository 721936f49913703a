//! A session or a recording in the caller's thread, steered by the page.

use std::sync::mpsc::RecvTimeoutError;
use std::time::{Duration, Instant};

use bittybuzz_live::Source;
use tokio::sync::mpsc::UnboundedSender;

use crate::server::{ClientEvent, Page, ToClient};

/// The time that the run goes on between two looks at requests.
const TURN: Duration = Duration::from_millis(12);

/// The time between two looks at the clock: 66 samples per second at most, and below 1 % of a core at rest.
const PULSE: Duration = Duration::from_millis(15);

/// The time that a session waits for its page to come back, for example because it is loaded again.
const LINGER: Duration = Duration::from_secs(5);

/// The client that steers.
struct Client {
    number: u64,
    messages: UnboundedSender<ToClient>,
    /// The last sample was sent.
    is_ready: bool,
    /// The tick of its last sample; `None` if the next sample is due whatever the tick.
    sampled: Option<u64>,
}

impl Page {
    /// Shows a session or a recording until the page was closed for some seconds, or `is_interrupted` returns true. A page that was never opened is
    /// waited for.
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
                    // Of a client that another one has replaced.
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
    // A client that has disconnected reports it by an event.
    for event in source.take_events() {
        let _ = client.messages.send(ToClient::Event(event.to_string()));
    }
    if let Some(sample) = sample {
        client.is_ready = false;
        client.sampled = Some(tick);
        let _ = client.messages.send(ToClient::Sample(sample));
    }
}
