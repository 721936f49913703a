//! The server, in a thread of its own.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::time::Duration;

use axum::Router;
use axum::extract::ws::{Message, WebSocket, WebSocketUpgrade};
use axum::extract::{Path, State};
use axum::http::{HeaderMap, StatusCode, header};
use axum::response::{IntoResponse, Response};
use axum::routing::get;
use tokio::sync::mpsc::{UnboundedReceiver, UnboundedSender, unbounded_channel};
use tokio::sync::{OwnedSemaphorePermit, Semaphore};

use crate::assets;
use crate::door::Door;
use crate::listener::{self, PageError};

/// Bytes of the longest request: the largest script that the compiler reads, 1 MiB, with each of its lines written as `\n`.
const REQUEST_BYTES_MAX: usize = 2 * 1024 * 1024;

/// A message to a client that another one was connected later: this one waits until the other has gone.
const WAIT: &str = "wait";

/// A message of a waiting client that asks to take the session over.
pub(crate) const TAKE_OVER: &str = "take over";

/// A message by which a client asks for an answer of the session, which is the same. Without an answer the session
/// does not handle requests.
pub(crate) const PING: &str = "ping";

/// A message of a client that has handled a batch. Before it, the session sends no other sample, and no other events than
/// the answers of requests.
pub(crate) const TAKEN: &str = "taken";

/// The time that a session waits for its page to connect again, for example after a reload.
pub(crate) const LINGER: Duration = Duration::from_secs(5);

/// The greatest number of requests of a client that have no answer yet. The server reads no further ones: the system
/// then lets the client wait.
const UNANSWERED_MAX: usize = 8;

/// The greatest number of connected clients.
const CLIENTS_MAX: usize = 16;

/// The page may run its own scripts and connect to its own server, and nothing else.
const POLICY: &str = "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; img-src 'self' data:; \
    base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

/// The place of a request among those of its client that have no answer yet, which becomes free when this value is dropped.
pub type Unanswered = OwnedSemaphorePermit;

/// An event of a client, which is one opened page.
pub enum ClientEvent {
    /// The client has connected; it receives messages from this channel.
    Connected(UnboundedSender<ToClient>),
    Request(String, Unanswered),
    /// The client asks for a [`ToClient::Pong`].
    Ping(Unanswered),
    /// The client, which waits, asks for the session.
    TakeOver(Unanswered),
    /// The client has handled a batch.
    Taken,
    Disconnected,
}

/// A message to a client.
pub enum ToClient {
    Batch(Batch),
    /// The session handles requests.
    Pong(Unanswered),
    /// Another client has the session now.
    Wait,
}

/// Events, and a sample if there is a new one. The client answers with [`TAKEN`].
#[derive(Default)]
pub struct Batch {
    /// The events as JSON, which answer these requests.
    pub events: Vec<String>,
    pub answered: Vec<Unanswered>,
    pub sample: Option<Vec<u8>>,
}

impl Batch {
    /// Returns the text that a client receives, before the sample if there is one.
    fn text(&self) -> String {
        let (events, has_sample) = (self.events.join(","), self.sample.is_some());
        format!("{{\"events\":[{events}],\"has_sample\":{has_sample}}}")
    }
}

/// A page that is being served.
pub struct Page {
    pub(crate) url: String,
    /// The events of all clients, each with the client's number.
    pub(crate) events: Receiver<(u64, ClientEvent)>,
    /// The number of clients that have connected.
    pub(crate) count: Arc<AtomicU64>,
    /// The time for which a session goes on without a client; `None` if it does so for good.
    pub(crate) linger: Option<Duration>,
}

/// State that all requests share.
struct Shared {
    door: Door,
    events: Sender<(u64, ClientEvent)>,
    /// The number of clients that have connected.
    count: Arc<AtomicU64>,
    /// The places for clients.
    places: Arc<Semaphore>,
}

impl Page {
    /// Binds a free port of the loopback address and serves from a thread of its own, for as long as the process lives.
    pub fn open() -> Result<Self, PageError> {
        let (sender, events) = channel();
        let count = Arc::default();
        let url = listener::serve(|door| {
            let places = Arc::new(Semaphore::new(CLIENTS_MAX));
            let shared = Shared { door, events: sender, count: Arc::clone(&count), places };
            Router::new()
                .route("/{secret}/", get(index))
                .route("/{secret}/socket", get(socket))
                .route("/{secret}/{name}", get(file))
                .with_state(Arc::new(shared))
        })?;
        Ok(Page { url, events, count, linger: Some(LINGER) })
    }

    /// Returns a page that takes events from a channel. Its session goes on without clients.
    pub(crate) fn without_server(events: Receiver<(u64, ClientEvent)>) -> Self {
        Page { url: String::new(), events, count: Arc::default(), linger: None }
    }

    /// Returns the address of the page, with its secret.
    pub fn url(&self) -> &str {
        &self.url
    }

    /// Returns true once a browser has connected.
    pub fn was_opened(&self) -> bool {
        self.count.load(Ordering::Relaxed) > 0
    }
}

async fn index(
    State(shared): State<Arc<Shared>>,
    Path(secret): Path<String>,
    headers: HeaderMap,
) -> Response {
    asset(&shared, &secret, "", &headers)
}

async fn file(
    State(shared): State<Arc<Shared>>,
    Path((secret, name)): Path<(String, String)>,
    headers: HeaderMap,
) -> Response {
    asset(&shared, &secret, &name, &headers)
}

fn asset(shared: &Shared, secret: &str, name: &str, headers: &HeaderMap) -> Response {
    match assets::find(name).filter(|_| shared.door.admits(secret, headers)) {
        None => StatusCode::NOT_FOUND.into_response(),
        Some(asset) => {
            let headers = [
                (header::CONTENT_TYPE, asset.media_type),
                (header::CONTENT_SECURITY_POLICY, POLICY),
                (header::REFERRER_POLICY, "no-referrer"),
                (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
                (header::CACHE_CONTROL, "no-store"),
            ];
            (headers, asset.bytes).into_response()
        }
    }
}

async fn socket(
    State(shared): State<Arc<Shared>>,
    Path(secret): Path<String>,
    headers: HeaderMap,
    upgrade: WebSocketUpgrade,
) -> Response {
    if !shared.door.admits(&secret, &headers) {
        return StatusCode::NOT_FOUND.into_response();
    }
    let Ok(place) = Arc::clone(&shared.places).try_acquire_owned() else {
        return StatusCode::SERVICE_UNAVAILABLE.into_response();
    };
    let upgrade = upgrade.max_message_size(REQUEST_BYTES_MAX).max_frame_size(REQUEST_BYTES_MAX);
    upgrade.on_upgrade(async move |socket| {
        serve(socket, shared).await;
        drop(place);
    })
}

/// Serves one client until it disconnects or the session is over.
async fn serve(mut socket: WebSocket, shared: Arc<Shared>) {
    let number = shared.count.fetch_add(1, Ordering::Relaxed);
    // Returns false once the session is over.
    let report = |event| shared.events.send((number, event)).is_ok();
    // The session puts one batch into this channel, and more for answers alone.
    let (sender, messages) = unbounded_channel();
    if report(ClientEvent::Connected(sender)) {
        exchange(&mut socket, messages, report).await;
        report(ClientEvent::Disconnected);
    }
}

/// Passes requests and messages on until the client disconnects.
async fn exchange(
    socket: &mut WebSocket,
    mut messages: UnboundedReceiver<ToClient>,
    report: impl Fn(ClientEvent) -> bool,
) {
    let unanswered = Arc::new(Semaphore::new(UNANSWERED_MAX));
    // A message that waits until the session has room for it.
    let mut request: Option<String> = None;
    // The number of batches that the client has not taken.
    let mut untaken = 0_u64;
    loop {
        tokio::select! {
            received = socket.recv(), if request.is_none() => match received {
                // This needs no room, because there is one for each batch.
                Some(Ok(Message::Text(text))) if text.as_str() == TAKEN => {
                    if untaken > 0 {
                        untaken -= 1;
                        if !report(ClientEvent::Taken) {
                            return;
                        }
                    }
                }
                Some(Ok(Message::Text(text))) => request = Some(text.to_string()),
                Some(Ok(Message::Close(_)) | Err(_)) | None => return,
                // Axum answers pings; no other message is a request.
                Some(Ok(_)) => {}
            },
            place = Arc::clone(&unanswered).acquire_owned(), if request.is_some() => {
                let place = place.expect("this semaphore is never closed");
                let text = request.take().unwrap_or_default();
                let event = match text.as_str() {
                    PING => ClientEvent::Ping(place),
                    TAKE_OVER => ClientEvent::TakeOver(place),
                    _ => ClientEvent::Request(text, place),
                };
                if !report(event) {
                    return;
                }
            }
            message = messages.recv() => {
                // Sending waits until a slow client has room.
                let is_sent = match message {
                    // The session is over.
                    None => return,
                    Some(ToClient::Pong(place)) => {
                        let is_sent = socket.send(Message::Text(PING.into())).await;
                        drop(place);
                        is_sent
                    }
                    Some(ToClient::Wait) => socket.send(Message::Text(WAIT.into())).await,
                    Some(ToClient::Batch(batch)) => {
                        untaken += 1;
                        send(socket, batch).await
                    }
                };
                if is_sent.is_err() {
                    return;
                }
            }
        }
    }
}

/// Sends a batch: a text with its events, and its sample.
async fn send(socket: &mut WebSocket, batch: Batch) -> Result<(), axum::Error> {
    socket.send(Message::Text(batch.text().into())).await?;
    if let Some(bytes) = batch.sample {
        socket.send(Message::Binary(bytes.into())).await?;
    }
    drop(batch.answered);
    Ok(())
}
