//! A server on the loopback address, in a thread of its own.

use std::fmt;
use std::io;
use std::net::Ipv4Addr;
use std::thread;
use std::time::Duration;

use axum::Router;
use hyper::server::conn::http1;
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use tokio::net::TcpListener;
use tokio::runtime::Builder;

use crate::door::Door;

/// The longest time for the headers of a request. A connection that has no request within this time is closed.
const HEADERS_MAX: Duration = Duration::from_secs(5);

/// The pause after a connection could not be accepted, for example because too many are open.
const ACCEPT_AGAIN: Duration = Duration::from_millis(200);

/// A reason why a page cannot be served.
#[derive(Debug)]
pub enum PageError {
    /// The operating system gives no port or no thread.
    Server(io::Error),
    /// The operating system gives no random numbers.
    Secret(getrandom::Error),
}

impl fmt::Display for PageError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            PageError::Server(error) => write!(f, "the page cannot be served: {error}"),
            PageError::Secret(error) => write!(f, "the page's address has no secret: {error}"),
        }
    }
}

impl std::error::Error for PageError {}

/// Binds a free port of the loopback address and serves from a thread of its own, for as long as the process lives.
/// Returns the address, with the secret of its door.
pub fn serve(router: impl FnOnce(Door) -> Router) -> Result<String, PageError> {
    let runtime = Builder::new_current_thread().enable_io().enable_time().build();
    let runtime = runtime.map_err(PageError::Server)?;
    let listener = runtime.block_on(TcpListener::bind((Ipv4Addr::LOCALHOST, 0)));
    let listener = listener.map_err(PageError::Server)?;
    let address = listener.local_addr().map_err(PageError::Server)?;
    let door = Door::new(address).map_err(PageError::Secret)?;
    let url = door.url();
    let thread = thread::Builder::new().name("page".to_owned());
    let serve = accept(listener, router(door));
    thread.spawn(move || runtime.block_on(serve)).map_err(PageError::Server)?;
    Ok(url)
}

/// Serves connections. `axum::serve` would do the same, but wait for requests without end.
async fn accept(listener: TcpListener, router: Router) {
    let mut http = http1::Builder::new();
    http.timer(TokioTimer::new()).header_read_timeout(HEADERS_MAX);
    loop {
        let Ok((stream, _)) = listener.accept().await else {
            tokio::time::sleep(ACCEPT_AGAIN).await;
            continue;
        };
        let service = TowerToHyperService::new(router.clone());
        let connection = http.serve_connection(TokioIo::new(stream), service).with_upgrades();
        // An error concerns this connection alone, and its client knows it.
        tokio::spawn(async move {
            let _ = connection.await;
        });
    }
}
