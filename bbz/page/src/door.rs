//! Access to the server: requests need the secret and must not come from another site.

use std::net::SocketAddr;

use axum::http::HeaderMap;
use axum::http::header::{HOST, HeaderName, ORIGIN};

/// The length of the secret in bytes.
const BYTES: usize = 16;

/// The secret of a server, and the hosts by which it is known.
pub struct Door {
    secret: String,
    hosts: [String; 2],
}

impl Door {
    /// Draws a secret for a server at that address.
    pub fn new(address: SocketAddr) -> Result<Self, getrandom::Error> {
        let mut bytes = [0; BYTES];
        getrandom::fill(&mut bytes)?;
        let secret = bytes.iter().map(|byte| format!("{byte:02x}")).collect();
        let port = address.port();
        Ok(Door { secret, hosts: [format!("127.0.0.1:{port}"), format!("localhost:{port}")] })
    }

    /// Returns the address of the page.
    pub fn url(&self) -> String {
        format!("http://{}/{}/", self.hosts[0], self.secret)
    }

    /// Returns true for a request that has the secret, names this server as `Host` and, if it has
    /// an `Origin`, comes from the server's own page. The check of `Host` is needed because a site
    /// can let its name resolve to this computer; its requests then carry that name as `Host`.
    /// Several values of a header are refused: programs may read different ones of them.
    pub fn admits(&self, secret: &str, headers: &HeaderMap) -> bool {
        let is_own = |host: &str| self.hosts.iter().any(|own| own == host);
        let comes_from = |origin: &str| origin.strip_prefix("http://").is_some_and(is_own);
        let is_origin = match texts(headers, ORIGIN).as_slice() {
            [] => true,
            [origin] => comes_from(origin),
            _ => false,
        };
        secret == self.secret
            && matches!(texts(headers, HOST).as_slice(), [host] if is_own(host))
            && is_origin
    }
}

/// Returns all values of a header. One that is not text is empty, which names no host.
fn texts(headers: &HeaderMap, name: HeaderName) -> Vec<&str> {
    headers.get_all(name).iter().map(|value| value.to_str().unwrap_or_default()).collect()
}
