//! A document with links that open pages, such as those of the runs of a study.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::time::Duration;

use axum::Router;
use axum::extract::{Path, State};
use axum::http::{HeaderMap, StatusCode, header};
use axum::response::{Html, IntoResponse, Redirect, Response};
use axum::routing::get;
use tokio::sync::oneshot;

use crate::door::Door;
use crate::listener::{self, PageError};

/// The document may have pictures and a style of its own, and nothing else.
const POLICY: &str = "default-src 'none'; style-src 'unsafe-inline'; base-uri 'none'; form-action 'none'; \
    frame-ancestors 'none'";

/// A document that is being served. Its links `run/NUMBER` ask for pages.
pub struct LinkedDocument {
    url: String,
    asked: Receiver<AskedPage>,
    was_opened: Arc<AtomicBool>,
}

/// A page that a link asks for.
pub struct AskedPage {
    /// The number in the link.
    pub number: usize,
    answer: oneshot::Sender<Result<String, String>>,
}

impl AskedPage {
    /// Leads the browser to the address of the page, or shows the reason why there is none.
    pub fn answer(self, address: Result<String, String>) {
        // A browser that has left needs no answer.
        let _ = self.answer.send(address);
    }
}

/// State that all requests share.
struct Shared {
    door: Door,
    html: String,
    asked: Sender<AskedPage>,
    was_opened: Arc<AtomicBool>,
}

impl LinkedDocument {
    /// Serves a document for as long as the process lives.
    pub fn open(html: String) -> Result<Self, PageError> {
        let (sender, asked) = channel();
        let was_opened = Arc::new(AtomicBool::new(false));
        let shared =
            |door| Shared { door, html, asked: sender, was_opened: Arc::clone(&was_opened) };
        let url = listener::serve(|door| {
            Router::new()
                .route("/{secret}/", get(document))
                .route("/{secret}/run/{number}", get(run))
                .with_state(Arc::new(shared(door)))
        })?;
        Ok(LinkedDocument { url, asked, was_opened })
    }

    /// Returns the address of the document, with its secret.
    pub fn url(&self) -> &str {
        &self.url
    }

    /// Returns true once a browser has the document.
    pub fn was_opened(&self) -> bool {
        self.was_opened.load(Ordering::Relaxed)
    }

    /// Returns a page that a link asks for within this time.
    pub fn asked(&self, time: Duration) -> Option<AskedPage> {
        self.asked.recv_timeout(time).ok()
    }
}

async fn document(
    State(shared): State<Arc<Shared>>,
    Path(secret): Path<String>,
    headers: HeaderMap,
) -> Response {
    match shared.door.admits(&secret, &headers) {
        true => {
            shared.was_opened.store(true, Ordering::Relaxed);
            safe(Html(shared.html.clone()))
        }
        false => StatusCode::NOT_FOUND.into_response(),
    }
}

async fn run(
    State(shared): State<Arc<Shared>>,
    Path((secret, number)): Path<(String, usize)>,
    headers: HeaderMap,
) -> Response {
    if !shared.door.admits(&secret, &headers) {
        return StatusCode::NOT_FOUND.into_response();
    }
    let (answer, answered) = oneshot::channel();
    // Without a receiver of this channel, there is no answer.
    let _ = shared.asked.send(AskedPage { number, answer });
    match answered.await {
        Ok(Ok(address)) => safe(Redirect::to(&address)),
        Ok(Err(reason)) => safe((StatusCode::CONFLICT, reason)),
        Err(_) => safe((StatusCode::CONFLICT, "the command that showed the report has ended")),
    }
}

fn safe(response: impl IntoResponse) -> Response {
    let headers = [
        (header::CONTENT_SECURITY_POLICY, POLICY),
        (header::REFERRER_POLICY, "no-referrer"),
        (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
        (header::CACHE_CONTROL, "no-store"),
    ];
    (headers, response).into_response()
}
