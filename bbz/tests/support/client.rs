//! A page of `bbz`, from the side of a client.

use std::collections::VecDeque;
use std::io::{self, ErrorKind};
use std::net::TcpStream;
use std::thread;
use std::time::Duration;

use serde_json::Value;
use tungstenite::{Error, Message, WebSocket};

/// The longest wait for an answer, which takes milliseconds otherwise.
const WAIT_MAX: Duration = Duration::from_secs(60);

/// A connection to a page's server.
pub struct Client {
    socket: WebSocket<TcpStream>,
    /// Events that were received and not yet returned.
    waiting: VecDeque<Value>,
}

impl Client {
    /// Connects to the page with an address.
    pub fn connect(url: &str) -> Self {
        let authority = url.strip_prefix("http://").unwrap().split('/').next().unwrap();
        let stream = TcpStream::connect(authority).unwrap();
        // A missing event fails the test instead of blocking it.
        stream.set_read_timeout(Some(WAIT_MAX)).unwrap();
        let address = format!("{}socket", url.replacen("http", "ws", 1));
        let (socket, _) = tungstenite::client(address, stream).unwrap();
        Client { socket, waiting: VecDeque::new() }
    }

    /// Sends a request.
    pub fn send(&mut self, request: Value) {
        self.socket.send(Message::text(request.to_string())).unwrap();
    }

    /// Throws away all that comes from now on, in a thread that ends with the connection.
    pub fn drain(&self) {
        let mut stream = self.socket.get_ref().try_clone().unwrap();
        thread::spawn(move || io::copy(&mut stream, &mut io::sink()));
    }

    /// Sends a message as it is. Fails after the end of the connection.
    pub fn send_text(&mut self, text: &str) -> Result<(), Error> {
        self.socket.send(Message::text(text))
    }

    /// Returns the next event.
    pub fn next(&mut self) -> Value {
        loop {
            if let Some(event) = self.waiting.pop_front() {
                return event;
            }
            match self.socket.read() {
                // A stop of the process and its continuation end a read that has a timeout.
                Err(Error::Io(error)) if error.kind() == ErrorKind::Interrupted => {}
                Ok(Message::Text(text)) => {
                    let mut batch: Value = serde_json::from_str(&text).unwrap();
                    let Value::Array(events) = batch["events"].take() else { panic!("{text}") };
                    self.waiting.extend(events);
                    self.socket.send(Message::text("taken")).unwrap();
                }
                message => drop(message.unwrap()),
            }
        }
    }

    /// Returns the next event of a kind.
    pub fn event(&mut self, kind: &str) -> Value {
        loop {
            let event = self.next();
            if event["event"] == kind {
                return event;
            }
        }
    }
}
