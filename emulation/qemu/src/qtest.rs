//! A client of QEMU's qtest protocol, which runs beside the emulated core: unlike a debugger it reaches
//! peripherals, and it moves interrupt lines.

use std::io::{self, BufRead, BufReader, Write};
use std::os::unix::net::UnixStream;

/// A connection to the qtest port. The core must be stopped, or the outcome depends on the host's speed.
pub struct Qtest {
    stream: BufReader<UnixStream>,
}

/// Why a request failed.
#[derive(Debug, thiserror::Error)]
pub enum QtestError {
    /// The connection broke.
    #[error("no answer from QEMU's qtest port: {0}")]
    Connection(#[from] io::Error),
    /// A request that QEMU does not accept.
    #[error("QEMU answered \"{reply}\" to the qtest request \"{request}\"")]
    Refused {
        /// What was asked.
        request: String,
        /// What it said; empty if QEMU ended.
        reply: String,
    },
}

impl Qtest {
    /// Uses `stream`; there is no greeting.
    pub fn new(stream: UnixStream) -> Self {
        Qtest { stream: BufReader::new(stream) }
    }

    /// Reads a 32-bit register.
    pub fn read_word(&mut self, address: u32) -> Result<u32, QtestError> {
        let request = format!("readl {address:#x}");
        self.send(std::slice::from_ref(&request))?;
        let reply = self.reply(&request)?;
        let digits = reply.trim().trim_start_matches("0x");
        u32::from_str_radix(digits, 16).map_err(|_| QtestError::Refused { request, reply })
    }

    /// Writes 32-bit registers: from each address on, the words beside it, in ascending order.
    pub fn write_words(&mut self, writes: &[(u32, &[u32])]) -> Result<(), QtestError> {
        self.requests(writes.iter().map(|(address, words)| {
            let bytes = words.iter().flat_map(|word| word.to_le_bytes());
            let digits: String = bytes.map(|byte| format!("{byte:02x}")).collect();
            format!("write {address:#x} {:#x} 0x{digits}", 4 * words.len())
        }))
    }

    /// Moves interrupt lines of the device at `path` (QEMU's object model).
    pub fn set_lines(
        &mut self,
        path: &str,
        levels: impl Iterator<Item = (u8, bool)>,
    ) -> Result<(), QtestError> {
        self.requests(levels.map(|(line, high)| {
            format!("set_irq_in {path} unnamed-gpio-in {line} {}", u8::from(high))
        }))
    }

    fn requests(&mut self, requests: impl Iterator<Item = String>) -> Result<(), QtestError> {
        let requests: Vec<String> = requests.collect();
        self.send(&requests)?;
        requests.iter().try_for_each(|request| self.reply(request).map(drop))
    }

    fn send(&mut self, requests: &[String]) -> Result<(), QtestError> {
        let lines: String = requests.iter().map(|request| format!("{request}\n")).collect();
        Ok(self.stream.get_mut().write_all(lines.as_bytes())?)
    }

    fn reply(&mut self, request: &str) -> Result<String, QtestError> {
        let mut line = String::new();
        self.stream.read_line(&mut line)?;
        match line.strip_prefix("OK") {
            Some(rest) => Ok(rest.trim().into()),
            None => Err(QtestError::Refused { request: request.into(), reply: line.trim().into() }),
        }
    }
}
