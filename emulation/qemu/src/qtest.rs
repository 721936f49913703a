//! A client of QEMU's qtest protocol. Unlike a debugger, qtest reaches peripherals and sets
//! interrupt lines.

use std::io::{self, BufRead, BufReader, Write};
use std::os::unix::net::UnixStream;

/// A connection to the qtest port. The core must be stopped, otherwise the outcome depends on the
/// host's speed.
///
/// Requests without an answer are queued until [`flush`](Qtest::flush) or the next read, because an
/// exchange costs as much as ten requests.
pub struct Qtest {
    stream: BufReader<UnixStream>,
    waiting: Vec<String>,
}

/// A reason why a request failed.
#[derive(Debug, thiserror::Error)]
pub enum QtestError {
    /// The connection broke.
    #[error("the connection to QEMU's qtest port broke: {0}")]
    Connection(#[from] io::Error),
    /// QEMU ended.
    #[error("QEMU ended")]
    Closed,
    /// QEMU does not accept the request.
    #[error("QEMU answered \"{reply}\" to the qtest request \"{request}\"")]
    Refused {
        /// The request that was sent.
        request: String,
        /// The reply of QEMU.
        reply: String,
    },
}

impl Qtest {
    /// Creates a client on `stream`; the protocol has no greeting.
    pub fn new(stream: UnixStream) -> Self {
        Qtest { stream: BufReader::new(stream), waiting: Vec::new() }
    }

    /// Queues a write of 32-bit registers from `address` on, in ascending order.
    pub fn write_words(&mut self, address: u32, words: &[u32]) {
        let bytes = words.iter().flat_map(|word| word.to_le_bytes());
        let digits: String = bytes.map(|byte| format!("{byte:02x}")).collect();
        self.waiting.push(format!("write {address:#x} {:#x} 0x{digits}", 4 * words.len()));
    }

    /// Queues a change of an interrupt line of the device at `path` in QEMU's object model.
    pub fn set_line(&mut self, path: &str, line: u8, high: bool) {
        let level = u8::from(high);
        self.waiting.push(format!("set_irq_in {path} unnamed-gpio-in {line} {level}"));
    }

    /// Executes the queued requests.
    pub fn flush(&mut self) -> Result<(), QtestError> {
        self.exchange().map(drop)
    }

    /// Executes the queued requests, then reads a 32-bit register.
    pub fn read_word(&mut self, address: u32) -> Result<u32, QtestError> {
        let request = format!("readl {address:#x}");
        self.waiting.push(request.clone());
        let reply = self.exchange()?;
        let digits = reply.trim_start_matches("0x");
        u32::from_str_radix(digits, 16).map_err(|_| QtestError::Refused { request, reply })
    }

    /// Sends all queued requests and returns the answer to the last one.
    fn exchange(&mut self) -> Result<String, QtestError> {
        let requests = std::mem::take(&mut self.waiting);
        let lines: String = requests.iter().map(|request| format!("{request}\n")).collect();
        self.stream.get_mut().write_all(lines.as_bytes()).map_err(closed)?;
        let mut answer = String::new();
        for request in requests {
            let mut line = String::new();
            if self.stream.read_line(&mut line).map_err(closed)? == 0 {
                return Err(QtestError::Closed);
            }
            match line.strip_prefix("OK") {
                Some(rest) => answer = rest.trim().into(),
                None => return Err(QtestError::Refused { request, reply: line.trim().into() }),
            }
        }
        Ok(answer)
    }
}

/// A broken connection means that QEMU ended.
fn closed(error: io::Error) -> QtestError {
    match error.kind() {
        io::ErrorKind::ConnectionReset | io::ErrorKind::BrokenPipe => QtestError::Closed,
        _ => error.into(),
    }
}
