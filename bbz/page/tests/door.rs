//! Access to the server, and its answers to invalid requests.

use std::collections::VecDeque;
use std::io::{ErrorKind, Read, Write};
use std::net::TcpStream;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;

use bittybuzz_page::Page;
use bittybuzz_random::Random;
use serde_json::Value;
use tungstenite::client::IntoClientRequest;
use tungstenite::http::HeaderValue;
use tungstenite::{Message, WebSocket};

use crate::session::live;

/// The longest wait for an answer, which takes milliseconds otherwise.
const WAIT_MAX: Duration = Duration::from_secs(60);

/// Bytes of the longest request that the server reads.
const REQUEST_BYTES_MAX: usize = 2 * 1024 * 1024;

/// Serves a session while `visit` uses its address.
fn serve(visit: impl FnOnce(&str)) {
    let page = Page::open().unwrap();
    let url = page.url().to_owned();
    let is_over = Arc::new(AtomicBool::new(false));
    let flag = is_over.clone();
    let server = thread::spawn(move || page.show(&mut live(), || flag.load(Ordering::Relaxed), ""));
    visit(&url);
    is_over.store(true, Ordering::Relaxed);
    server.join().unwrap().unwrap();
}

/// Returns the status and the whole text of an answer.
fn get(url: &str, path: &str, host: &str, more: &str) -> (u16, String) {
    let authority = url.strip_prefix("http://").unwrap().split('/').next().unwrap();
    let host = if host.is_empty() { authority } else { host };
    let mut stream = TcpStream::connect(authority).unwrap();
    stream.set_read_timeout(Some(WAIT_MAX)).unwrap();
    write!(stream, "GET {path} HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n{more}\r\n")
        .unwrap();
    let mut answer = String::new();
    stream.read_to_string(&mut answer).unwrap();
    (answer.split(' ').nth(1).unwrap().parse().unwrap(), answer)
}

fn connect(url: &str, origin: Option<&str>) -> Result<WebSocket<TcpStream>, String> {
    let authority = url.strip_prefix("http://").unwrap().split('/').next().unwrap();
    let address = format!("{}socket", url.replacen("http", "ws", 1));
    let mut request = address.into_client_request().unwrap();
    if let Some(origin) = origin {
        request.headers_mut().insert("Origin", HeaderValue::from_str(origin).unwrap());
    }
    let stream = TcpStream::connect(authority).unwrap();
    // A missing answer fails the test instead of blocking it.
    stream.set_read_timeout(Some(WAIT_MAX)).unwrap();
    let connected = tungstenite::client(request, stream);
    connected.map(|(socket, _)| socket).map_err(|error| error.to_string())
}

/// Reads the next message. A stop of the process and its continuation end a read that has a timeout, so it is repeated.
fn read(socket: &mut WebSocket<TcpStream>) -> Result<Message, tungstenite::Error> {
    loop {
        match socket.read() {
            Err(tungstenite::Error::Io(error)) if error.kind() == ErrorKind::Interrupted => {}
            message => return message,
        }
    }
}

/// Reads until the socket ends.
fn end(socket: &mut WebSocket<TcpStream>) -> tungstenite::Error {
    loop {
        if let Err(error) = read(socket) {
            return error;
        }
    }
}

fn is_timeout(error: &tungstenite::Error) -> bool {
    matches!(error, tungstenite::Error::Io(error) if error.kind() == ErrorKind::WouldBlock)
}

/// A connection and the events that it has received and not yet returned.
struct Client {
    socket: WebSocket<TcpStream>,
    waiting: VecDeque<Value>,
}

impl Client {
    fn connect(url: &str) -> Self {
        Client { socket: connect(url, None).unwrap(), waiting: VecDeque::new() }
    }

    fn send(&mut self, text: &str) {
        self.socket.send(Message::text(text)).unwrap();
    }

    /// Returns the next event of that kind.
    fn event(&mut self, kind: &str) -> Value {
        loop {
            while let Some(event) = self.waiting.pop_front() {
                if event["event"] == kind {
                    return event;
                }
            }
            self.receive();
        }
    }

    /// Receives a message, and returns true for a sample.
    fn receive(&mut self) -> bool {
        let message = read(&mut self.socket).unwrap();
        if let Message::Text(text) = &message
            && text.starts_with('{')
        {
            let mut batch: Value = serde_json::from_str(text).unwrap();
            let Value::Array(events) = batch["events"].take() else { panic!("{text}") };
            self.waiting.extend(events);
            self.send("taken");
        }
        message.is_binary()
    }
}

#[test]
fn only_requests_with_the_secret_are_answered() {
    serve(|url| {
        let (_, path) = url.strip_prefix("http://").unwrap().split_once('/').unwrap();
        let path = format!("/{path}");
        assert_eq!(path.len(), 34, "128 bits: {path}");
        let (status, page) = get(url, &path, "", "");
        assert_eq!(status, 200);
        for part in ["content-security-policy: default-src 'none'", "cache-control: no-store"] {
            assert!(page.contains(part), "{page}");
        }
        let script = format!("{path}main.js");
        assert_eq!(get(url, &script, "", "").0, 200);
        let wrong = path.replace(|c: char| c.is_ascii_digit(), "f");
        for path in ["/", "/main.js", wrong.as_str(), "/..%2f..%2fetc%2fpasswd/", "//"] {
            assert_eq!(get(url, path, "", "").0, 404, "{path}");
        }
        for name in ["missing.js", "../Cargo.toml", "..%2fCargo.toml", "%2e%2e/x", ""] {
            let found = get(url, &format!("{path}x/{name}"), "", "").0;
            assert_eq!(found, 404, "{name}");
        }
        // Another site can make its name resolve to this server.
        assert_eq!(get(url, &path, "evil.example", "").0, 404);
        assert_eq!(get(url, &path, "", "Origin: http://evil.example\r\n").0, 404);
        assert_eq!(get(url, &path, "", "Origin: null\r\n").0, 404);
    });
}

#[test]
fn a_socket_of_another_site_is_refused() {
    serve(|url| {
        for origin in ["http://evil.example", "null", "http://127.0.0.1", "https://127.0.0.1:1"] {
            assert!(connect(url, Some(origin)).unwrap_err().contains("404"), "{origin}");
        }
        let own = url.rsplitn(3, '/').nth(2).unwrap();
        let socket = connect(url, Some(own)).unwrap();
        let mut client = Client { socket, waiting: VecDeque::new() };
        assert_eq!(client.event("begin")["size"], serde_json::json!([500.0, 500.0]));
        let wrong = url.replace(|c: char| ('a'..='f').contains(&c), "0");
        assert!(connect(&wrong, None).is_err() || wrong == url);
    });
}

#[test]
fn a_client_controls_the_run_and_receives_samples() {
    serve(|url| {
        let mut client = Client::connect(url);
        client.event("begin");
        let request = "{\"go_to\":{\"tick\":50}}";
        client.send(request);
        while client.event("state")["tick"] != 50 {}
        client.send("{\"play\":{\"rate\":50}}");
        let mut samples = 0;
        while samples < 5 {
            samples += usize::from(client.receive());
        }
        client.send("\"pause\"");
        let state = std::iter::repeat_with(|| client.event("state"));
        let paused = state.filter(|state| state["plays"] == false).take(1).next().unwrap();
        assert!(paused["tick"].as_u64().unwrap() > 50);
    });
}

/// Waits for a message that is no event.
fn note(socket: &mut WebSocket<TcpStream>, note: &str) {
    while read(socket).unwrap() != Message::text(note) {}
}

#[test]
fn the_last_page_has_the_session_and_the_others_wait() {
    serve(|url| {
        let mut first = Client::connect(url);
        first.event("begin");
        let mut second = Client::connect(url);
        assert_eq!(second.event("begin")["end"], 10_000);
        note(&mut first.socket, "wait");
        // Requests of a page that waits have no effect.
        first.send("{\"go_to\":{\"tick\":50}}");
        first.send("ping");
        note(&mut first.socket, "ping");
        second.send("{\"step\":{\"ticks\":1}}");
        while second.event("state")["tick"] != 1 {}
        // It asks for the session.
        first.send("take over");
        first.event("begin");
        assert_eq!(first.event("state")["tick"], 1);
        note(&mut second.socket, "wait");
        // The page before has it again when the last one has gone, and a third one that has gone does not matter.
        let mut third = Client::connect(url);
        third.event("begin");
        note(&mut first.socket, "wait");
        drop(second);
        drop(third);
        first.event("begin");
        first.send("\"commands\"");
        assert_eq!(first.event("commands")["text"], "");
    });
}

/// More pages than a person opens are refused, until others have gone.
#[test]
fn the_number_of_pages_has_a_limit() {
    serve(|url| {
        let mut open: Vec<WebSocket<TcpStream>> = Vec::new();
        let refusal = loop {
            match connect(url, None) {
                Ok(socket) => open.push(socket),
                Err(refusal) => break refusal,
            }
            assert!(open.len() < 100, "no limit");
        };
        assert!(refusal.contains("503"), "{refusal}");
        assert_eq!(open.len(), 16);
        open.truncate(8);
        // The server notices the end of a connection a little later.
        let mut client = loop {
            if let Ok(socket) = connect(url, None) {
                break Client { socket, waiting: VecDeque::new() };
            }
        };
        client.event("begin");
    });
}

/// Programs between a client and the server may read different ones of two headers.
#[test]
fn a_request_with_two_hosts_or_origins_is_refused() {
    serve(|url| {
        let (authority, path) = url.strip_prefix("http://").unwrap().split_once('/').unwrap();
        let path = format!("/{path}");
        let own = format!("Origin: http://{authority}\r\n");
        assert_eq!(get(url, &path, "", &own).0, 200);
        for more in ["Host: evil.example\r\n", &format!("Host: {authority}\r\n"), &own.repeat(2)] {
            assert_eq!(get(url, &path, "", more).0, 404, "{more}");
        }
        assert_eq!(get(url, &path, "evil.example", &format!("Host: {authority}\r\n")).0, 404);
    });
}

/// A connection without a request does not stay open.
#[test]
fn half_open_connections_end() {
    serve(|url| {
        let authority = url.strip_prefix("http://").unwrap().split('/').next().unwrap();
        let starts = ["", "G", "GET / HTTP/1.1\r\n", "GET / HTTP/1.1\r\nHost: 127.0.0.1\r\nA: "];
        let open = starts.map(|start| {
            let mut stream = TcpStream::connect(authority).unwrap();
            stream.set_read_timeout(Some(WAIT_MAX)).unwrap();
            stream.write_all(start.as_bytes()).unwrap();
            stream
        });
        for mut stream in open {
            let mut answer = Vec::new();
            // The end of the connection ends the read; a time-out would be an error.
            stream.read_to_end(&mut answer).unwrap();
            assert!(!String::from_utf8_lossy(&answer).contains("200"), "{answer:?}");
        }
        // A page stays connected.
        let mut client = Client::connect(url);
        client.event("begin");
        let mut idle = TcpStream::connect(authority).unwrap();
        idle.set_read_timeout(Some(WAIT_MAX)).unwrap();
        idle.read_to_end(&mut Vec::new()).unwrap();
        client.send("\"commands\"");
        client.event("commands");
    });
}

/// The session answers the next request after any input.
#[test]
fn invalid_requests_do_not_end_the_session() {
    serve(|url| {
        let mut random = Random::new(1);
        let words = [
            "{",
            "}",
            "\"do\"",
            ":",
            "\"go_to\"",
            "\"tick\"",
            "1e400",
            "-1",
            "[",
            "]",
            ",",
            "\u{0}",
            "null",
        ];
        for _ in 0..20 {
            let mut client = Client::connect(url);
            client.event("begin");
            for _ in 0..20 {
                let text: String = (0..random.below(8))
                    .map(|_| words[random.below(words.len() as u32) as usize])
                    .collect();
                let bytes: Vec<u8> =
                    (0..random.below(300)).map(|_| random.below(256) as u8).collect();
                let message =
                    if random.chance(0.5) { Message::text(text) } else { Message::binary(bytes) };
                client.socket.send(message).unwrap();
            }
            client.send("\"commands\"");
            client.event("commands");
        }
        let mut client = Client::connect(url);
        let request = "\"commands\"";
        let longest = format!("{}{request}", " ".repeat(REQUEST_BYTES_MAX - request.len()));
        client.send(&longest);
        client.event("commands");
        // After a request that is too long, the socket is closed and the session continues.
        let mut client = Client::connect(url);
        let _ = client.socket.send(Message::text("x".repeat(REQUEST_BYTES_MAX + 1)));
        assert!(!is_timeout(&end(&mut client.socket)), "the server keeps the socket");
        let mut client = Client::connect(url);
        assert_eq!(client.event("begin")["end"], 10_000);
    });
}
