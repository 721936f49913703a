//! Runs a session or a recording in the caller's thread, controlled by the page.

use std::time::{Duration, Instant};

use bittybuzz_live::{Defect, DefectEvent, PageEvent, Source};
use tokio::sync::mpsc::UnboundedSender;

use crate::server::{Batch, ClientEvent, LINGER, Page, ToClient, Unanswered};

/// The longest time that a run advances before requests are read.
const TURN: Duration = Duration::from_millis(12);

/// The longest wait for an event: at most 66 samples per second, and less than 1 % of a core at
/// rest.
const PULSE: Duration = Duration::from_millis(15);

/// The greatest number of events of clients in a turn.
const EVENTS_MAX: usize = 64;

/// A connected page.
struct Client {
    number: u64,
    messages: UnboundedSender<ToClient>,
    /// The number of batches that the client has not taken yet.
    untaken: u64,
    /// The requests that the next batch answers.
    answered: Vec<Unanswered>,
    /// The tick of the client's last sample; `None` if the next sample is due at any tick.
    sampled: Option<u64>,
}

impl Client {
    /// Returns a client that has received nothing.
    fn new(number: u64, messages: UnboundedSender<ToClient>) -> Self {
        Client { number, messages, untaken: 0, answered: Vec::new(), sampled: None }
    }

    /// Sends a message. This fails after the client disconnected; its `Disconnected` event follows.
    fn send(&self, message: ToClient) {
        let _ = self.messages.send(message);
    }
}

/// The connected pages. One of them controls the session: the last one that connected or asked for it.
#[derive(Default)]
struct Clients {
    current: Option<Client>,
    /// The others, those that had the session last at the end.
    waiting: Vec<Client>,
}

impl Clients {
    /// Gives the session to a client.
    fn serve(&mut self, source: &mut dyn Source, number: u64, messages: UnboundedSender<ToClient>) {
        if let Some(mut before) = self.current.replace(Client::new(number, messages)) {
            before.send(ToClient::Wait);
            // No answers follow.
            before.answered.clear();
            self.waiting.push(before);
        }
        source.begin();
    }

    /// Removes a client from those that wait.
    fn take_waiting(&mut self, number: u64) -> Option<Client> {
        let place = self.waiting.iter().position(|client| client.number == number)?;
        Some(self.waiting.remove(place))
    }

    /// Removes a client that has disconnected. If it had the session, the one before has it again.
    fn remove(&mut self, source: &mut dyn Source, number: u64) {
        self.take_waiting(number);
        if self.current.as_ref().is_some_and(|client| client.number == number) {
            self.current = None;
            if let Some(next) = self.waiting.pop() {
                self.serve(source, next.number, next.messages);
            }
        }
    }

    /// Handles an event of a client.
    fn handle(&mut self, source: &mut dyn Source, number: u64, event: ClientEvent, now: Duration) {
        let is_current = |client: &&mut Client| client.number == number;
        match event {
            ClientEvent::Connected(messages) => self.serve(source, number, messages),
            ClientEvent::Disconnected => self.remove(source, number),
            ClientEvent::TakeOver(place) => {
                drop(place);
                if let Some(client) = self.take_waiting(number) {
                    self.serve(source, number, client.messages);
                }
            }
            ClientEvent::Ping(place) => {
                let mut all = self.current.iter().chain(&self.waiting);
                if let Some(client) = all.find(|client| client.number == number) {
                    client.send(ToClient::Pong(place));
                }
            }
            // A client that waits knows that its requests have no effect.
            ClientEvent::Request(text, place) => {
                if let Some(client) = self.current.as_mut().filter(is_current) {
                    source.request(&text, now);
                    client.sampled = None;
                    client.answered.push(place);
                }
            }
            ClientEvent::Taken => {
                if let Some(client) = self.current.as_mut().filter(is_current) {
                    // A batch from before the client waited has no number here.
                    client.untaken = client.untaken.saturating_sub(1);
                }
            }
        }
    }
}

impl Page {
    /// Shows a session or a recording until the page has been closed for some seconds or
    /// `is_interrupted` returns true. Waits without limit for a page that was never opened, and for
    /// frames. A defect
    /// ends the session, and the page shows it with `help`; texts that were edited stay there.
    pub fn show(
        &self,
        source: &mut dyn Source,
        is_interrupted: impl FnMut() -> bool,
        help: &str,
    ) -> Result<(), Defect> {
        let mut clients = Clients::default();
        let shown = Defect::catch(|| self.serve_clients(source, is_interrupted, &mut clients));
        if let (Err(defect), Some(client)) = (&shown, clients.current) {
            self.report(defect, help, client);
        }
        shown
    }

    fn serve_clients(
        &self,
        source: &mut dyn Source,
        mut is_interrupted: impl FnMut() -> bool,
        clients: &mut Clients,
    ) {
        let start = Instant::now();
        let mut closed_at: Option<Instant> = None;
        let is_closed = |closed_at: Option<Instant>| {
            closed_at.zip(self.linger).is_some_and(|(at, linger)| at.elapsed() >= linger)
        };
        while !is_interrupted() && !is_closed(closed_at) {
            let now = start.elapsed();
            let turn = Instant::now();
            let is_late = source.advance(now, &mut || turn.elapsed() < TURN);
            send_changes(source, clients.current.as_mut());
            let wait = if is_late { Duration::ZERO } else { PULSE };
            let mut next = self.events.recv_timeout(wait).ok();
            let mut left = EVENTS_MAX;
            while let Some((number, event)) = next {
                clients.handle(source, number, event, start.elapsed());
                // The first event is a connection, so this is not the time before it.
                closed_at = clients.current.is_none().then(Instant::now);
                left -= 1;
                next = if left > 0 { self.events.try_recv().ok() } else { None };
            }
        }
        send_changes(source, clients.current.as_mut());
    }

    /// Sends a defect as the last event to a client, and waits until the client has received it.
    fn report(&self, defect: &Defect, help: &str, client: Client) {
        let event = DefectEvent { text: defect.to_string(), help: help.to_owned() };
        let events = vec![PageEvent::Defect(event).to_json()];
        client.send(ToClient::Batch(Batch { events, ..Batch::default() }));
        // The server closes the connection after the last message of this channel.
        drop(client.messages);
        let deadline = Instant::now() + LINGER;
        let wait = || self.events.recv_timeout(deadline.saturating_duration_since(Instant::now()));
        while let Ok((number, event)) = wait() {
            if number == client.number && matches!(event, ClientEvent::Disconnected) {
                return;
            }
        }
    }
}

/// Sends all new events and a new sample if the client has taken the last ones, and answers in any case. Without a client
/// the events wait for the next one.
fn send_changes(source: &mut dyn Source, client: Option<&mut Client>) {
    let Some(client) = client else { return };
    let is_ready = client.untaken == 0;
    if !is_ready && client.answered.is_empty() {
        return;
    }
    let tick = source.tick();
    let sample = (is_ready && client.sampled != Some(tick)).then(|| source.take_sample());
    let events: Vec<String> = source.take_events().iter().map(PageEvent::to_json).collect();
    let answered = std::mem::take(&mut client.answered);
    if events.is_empty() && sample.is_none() {
        return;
    }
    if sample.is_some() {
        client.sampled = Some(tick);
    }
    client.untaken += 1;
    client.send(ToClient::Batch(Batch { events, answered, sample }));
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;
    use std::sync::mpsc::channel;
    use std::thread;

    use tokio::sync::Semaphore;
    use tokio::sync::mpsc::unbounded_channel;

    use super::*;

    /// A source whose requests find a broken invariant.
    struct BrokenSource;

    impl Source for BrokenSource {
        fn begin(&mut self) {}

        fn request(&mut self, _: &str, _: Duration) {
            panic!("robot 7 is missing");
        }

        fn advance(&mut self, _: Duration, _: &mut dyn FnMut() -> bool) -> bool {
            false
        }

        fn tick(&self) -> u64 {
            0
        }

        fn take_events(&mut self) -> Vec<PageEvent> {
            Vec::new()
        }

        fn take_sample(&mut self) -> Vec<u8> {
            Vec::new()
        }
    }

    #[test]
    fn a_defect_ends_the_session_and_the_page_shows_it() {
        let (sender, events) = channel();
        let page = Page::without_server(events);
        let (to_client, mut messages) = unbounded_channel();
        sender.send((0, ClientEvent::Connected(to_client))).unwrap();
        let place = Arc::new(Semaphore::new(1)).try_acquire_owned().unwrap();
        sender.send((0, ClientEvent::Request("\"pause\"".to_owned(), place))).unwrap();
        let client = thread::spawn(move || {
            let mut received = Vec::new();
            while let Some(message) = messages.blocking_recv() {
                if let ToClient::Batch(batch) = message {
                    received.extend(
                        batch.events.iter().map(|text| serde_json::from_str(text).unwrap()),
                    );
                }
            }
            sender.send((0, ClientEvent::Disconnected)).unwrap();
            received
        });
        let shown = page.show(&mut BrokenSource, || false, "run `bbz sim s.toml --view`");
        let received: Vec<serde_json::Value> = client.join().unwrap();
        let [event] = &received[..] else { panic!("{received:?}") };
        assert_eq!(event["event"], "defect");
        assert_eq!(event["help"], "run `bbz sim s.toml --view`");
        let text = event["text"].as_str().unwrap();
        assert_eq!(text, shown.unwrap_err().to_string());
        let version = env!("CARGO_PKG_VERSION");
        assert!(text.contains(version) && text.contains("show.rs:"), "{text}");
        assert!(text.ends_with("robot 7 is missing"), "{text}");
    }
}
