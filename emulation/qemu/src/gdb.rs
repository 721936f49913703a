//! A client of the GDB remote protocol, to the extent that QEMU's stub for Cortex-M needs it (GDB
//! manual, appendix E).
//!
//! Packets that do not depend on each other are sent together, because a round trip costs as much
//! as the work. The client sends no acknowledgements: the stub takes the next `$` as one, and while
//! the core runs it takes any byte, even `+`, for a request to stop.

use std::io::{self, Read, Write};
use std::os::unix::net::UnixStream;
use std::time::Duration;

use crate::registers::CoreRegisters;

/// Bytes of memory in one packet: QEMU accepts 4096 characters, two for each byte and some for the
/// request.
const MEMORY_MAX: usize = 1984;
/// Number of the program status register in QEMU's description of Cortex-M.
const XPSR: usize = 25;
/// Time for which the core may run before it is asked to stop.
const PATIENCE: Duration = Duration::from_secs(5);
/// Factor by which a reply may take longer than `PATIENCE`, on a busy host.
const TRIES: u32 = 12;
/// A byte outside of any packet that stops the core.
const INTERRUPT: u8 = 0x03;

/// A connection to the stub; the core is stopped, unless [`resume`](Gdb::resume) or
/// [`finish_system_call`](Gdb::finish_system_call) was the last call.
pub struct Gdb {
    stream: UnixStream,
    received: Vec<u8>,
}

/// A reason why a request failed.
#[derive(Debug, thiserror::Error)]
pub enum GdbError {
    /// The connection broke.
    #[error("the connection to QEMU's debugger port broke: {0}")]
    Connection(#[from] io::Error),
    /// No answer came for a long time.
    #[error("QEMU's debugger port does not answer")]
    Silent,
    /// QEMU ended.
    #[error("QEMU ended")]
    Closed,
    /// A packet arrived with a wrong checksum.
    #[error("QEMU's debugger port sent a packet with a wrong checksum")]
    Checksum,
    /// QEMU does not accept the request.
    #[error("QEMU answered \"{reply}\" to the debugger's request \"{request}\"")]
    Refused {
        /// The request that was sent.
        request: String,
        /// The reply of QEMU.
        reply: String,
    },
}

/// The reason why the core stopped.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GdbStop {
    /// The core is about to access a watched address.
    Watchpoint,
    /// The core is about to execute an instruction with a breakpoint.
    Breakpoint,
    /// [`Gdb::interrupt`] was called.
    Interrupted,
}

impl Gdb {
    /// Connects to the stub. The stub accepts writes of single registers only after it was asked to
    /// describe them.
    pub fn new(stream: UnixStream) -> Result<Self, GdbError> {
        stream.set_read_timeout(Some(PATIENCE))?;
        let mut gdb = Gdb { stream, received: Vec::new() };
        gdb.request("qSupported:xmlRegisters=arm")?;
        gdb.request("qXfer:features:read:target.xml:0,ffb")?;
        Ok(gdb)
    }

    /// Sets the registers that differ between `before` and `after`, and lets the core run.
    pub fn resume(
        &mut self,
        before: &CoreRegisters,
        after: &CoreRegisters,
    ) -> Result<(), GdbError> {
        let mut packets = register_packets(before, after);
        let replies = packets.len();
        packets.push("c".into());
        self.send(&packets)?;
        for packet in &packets[..replies] {
            self.expect_ok(packet)?;
        }
        Ok(())
    }

    /// Waits until the core stops; `None` if it still runs after some seconds.
    pub fn wait(&mut self) -> Result<Option<GdbStop>, GdbError> {
        let Some(reply) = self.receive()? else { return Ok(None) };
        match reply.get(..3) {
            Some("T05") if reply.contains("watch:") => Ok(Some(GdbStop::Watchpoint)),
            Some("T05") => Ok(Some(GdbStop::Breakpoint)),
            Some("T02") => Ok(Some(GdbStop::Interrupted)),
            _ => Err(GdbError::Refused { request: "c".into(), reply }),
        }
    }

    /// Waits until the program makes a system call, which QEMU forwards to the debugger if it was
    /// started with `-semihosting-config enable=on,target=gdb`; false if the core still runs after
    /// a minute. The core stands still until [`finish_system_call`](Gdb::finish_system_call).
    ///
    /// Such a stop is cheaper than one at a breakpoint or a watchpoint, after which QEMU 7.2
    /// translates all code again.
    pub fn wait_for_system_call(&mut self) -> Result<bool, GdbError> {
        match self.reply() {
            Ok(reply) if is_system_call(&reply) => Ok(true),
            Ok(reply) => Err(GdbError::Refused { request: "c".into(), reply }),
            Err(GdbError::Silent) => Ok(false),
            Err(error) => Err(error),
        }
    }

    /// Returns the registers, and the output of QEMU's monitor for `command`, and lets the core run
    /// with `result` as the result of its system call.
    pub fn finish_system_call(
        &mut self,
        command: &str,
        result: u32,
    ) -> Result<(CoreRegisters, String), GdbError> {
        self.send(&["g".into(), monitor_packet(command), system_call_reply(result)])?;
        self.read_registers_and_output(command)
    }

    /// Asks the running core to stop.
    pub fn interrupt(&mut self) -> Result<(), GdbError> {
        Ok(self.stream.write_all(&[INTERRUPT])?)
    }

    /// Returns the registers, and the output of QEMU's monitor for `command`.
    pub fn registers_and_monitor(
        &mut self,
        command: &str,
    ) -> Result<(CoreRegisters, String), GdbError> {
        self.send(&["g".into(), monitor_packet(command)])?;
        self.read_registers_and_output(command)
    }

    fn read_registers_and_output(
        &mut self,
        command: &str,
    ) -> Result<(CoreRegisters, String), GdbError> {
        let reply = self.reply()?;
        let bytes = from_hex(&reply).unwrap_or_default();
        let mut words = bytes.chunks_exact(4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]));
        let mut registers = CoreRegisters::default();
        for register in registers.r.iter_mut().chain([&mut registers.xpsr]) {
            *register = words
                .next()
                .ok_or_else(|| GdbError::Refused { request: "g".into(), reply: reply.clone() })?;
        }
        Ok((registers, self.printed(command)?))
    }

    /// Reads memory; returns false if there is none.
    pub fn read_memory(&mut self, address: u32, bytes: &mut [u8]) -> Result<bool, GdbError> {
        for (index, part) in bytes.chunks_mut(MEMORY_MAX).enumerate() {
            let at = address.wrapping_add((index * MEMORY_MAX) as u32);
            let reply = self.request(&format!("m{at:x},{:x}", part.len()))?;
            match from_hex(&reply) {
                Some(read) if read.len() == part.len() => part.copy_from_slice(&read),
                _ => return Ok(false),
            }
        }
        Ok(true)
    }

    /// Writes memory, flash included; returns false if there is none. Peripherals cannot be reached
    /// this way.
    pub fn write_memory(&mut self, address: u32, bytes: &[u8]) -> Result<bool, GdbError> {
        for (index, part) in bytes.chunks(MEMORY_MAX).enumerate() {
            let at = address.wrapping_add((index * MEMORY_MAX) as u32);
            let reply = self.request(&format!("M{at:x},{:x}:{}", part.len(), to_hex(part)))?;
            if reply != "OK" {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// Makes the core stop before it executes the instruction at `address`.
    pub fn set_breakpoint(&mut self, address: u32) -> Result<(), GdbError> {
        self.request_ok(&format!("Z0,{address:x},2"))
    }

    /// Removes the breakpoint at `address`.
    pub fn remove_breakpoint(&mut self, address: u32) -> Result<(), GdbError> {
        self.request_ok(&format!("z0,{address:x},2"))
    }

    /// Makes the core stop before it reads or writes any of `length` bytes at `address`.
    pub fn watch_accesses(&mut self, address: u32, length: u32) -> Result<(), GdbError> {
        self.request_ok(&format!("Z4,{address:x},{length:x}"))
    }

    /// Makes the core stop before it writes any of `length` bytes at `address`.
    pub fn watch_writes(&mut self, address: u32, length: u32) -> Result<(), GdbError> {
        self.request_ok(&format!("Z2,{address:x},{length:x}"))
    }

    /// Passes a command to QEMU's monitor and returns its output.
    pub fn monitor(&mut self, command: &str) -> Result<String, GdbError> {
        self.send(&[monitor_packet(command)])?;
        self.printed(command)
    }

    /// Reads the monitor's output for `command`.
    fn printed(&mut self, command: &str) -> Result<String, GdbError> {
        let mut printed = Vec::new();
        loop {
            let reply = self.reply()?;
            if reply == "OK" {
                return Ok(String::from_utf8_lossy(&printed).into_owned());
            }
            match reply.strip_prefix('O').and_then(from_hex) {
                Some(bytes) => printed.extend(bytes),
                None => return Err(GdbError::Refused { request: command.into(), reply }),
            }
        }
    }

    fn request(&mut self, packet: &str) -> Result<String, GdbError> {
        self.send(&[packet.into()])?;
        self.reply()
    }

    fn request_ok(&mut self, packet: &str) -> Result<(), GdbError> {
        self.send(&[packet.into()])?;
        self.expect_ok(packet)
    }

    fn expect_ok(&mut self, request: &str) -> Result<(), GdbError> {
        match self.reply()? {
            reply if reply == "OK" => Ok(()),
            reply => Err(GdbError::Refused { request: request.into(), reply }),
        }
    }

    fn send(&mut self, packets: &[String]) -> Result<(), GdbError> {
        let framed: String = packets
            .iter()
            .map(|packet| format!("${packet}#{:02x}", checksum(packet.as_bytes())))
            .collect();
        self.stream.write_all(framed.as_bytes()).map_err(closed)
    }

    /// Reads the next packet from the stub.
    fn reply(&mut self) -> Result<String, GdbError> {
        for _ in 0..TRIES {
            if let Some(reply) = self.receive()? {
                return Ok(reply);
            }
        }
        Err(GdbError::Silent)
    }

    /// Reads the next packet from the stub; `None` if it does not arrive in time.
    fn receive(&mut self) -> Result<Option<String>, GdbError> {
        loop {
            if let Some(packet) = take_packet(&mut self.received)? {
                return Ok(Some(packet));
            }
            let mut chunk = [0; 4096];
            match self.stream.read(&mut chunk) {
                Ok(0) => return Err(GdbError::Closed),
                Ok(count) => self.received.extend(&chunk[..count]),
                // A stop of the process and its continuation end a read that has a timeout.
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                Err(error) if is_timeout(&error) => return Ok(None),
                Err(error) => return Err(closed(error)),
            }
        }
    }
}

/// Removes the first complete packet from `received`, with everything before it.
fn take_packet(received: &mut Vec<u8>) -> Result<Option<String>, GdbError> {
    let Some(start) = received.iter().position(|&byte| byte == b'$') else {
        return Ok(None);
    };
    let Some(length) = received[start..].iter().position(|&byte| byte == b'#') else {
        return Ok(None);
    };
    let end = start + length;
    let Some(digits) = received.get(end + 1..end + 3) else {
        return Ok(None);
    };
    let sum =
        std::str::from_utf8(digits).ok().and_then(|digits| u8::from_str_radix(digits, 16).ok());
    let body = &received[start + 1..end];
    if sum != Some(checksum(body)) {
        return Err(GdbError::Checksum);
    }
    let packet = String::from_utf8_lossy(body).into_owned();
    received.drain(..end + 3);
    Ok(Some(packet))
}

fn register_packets(before: &CoreRegisters, after: &CoreRegisters) -> Vec<String> {
    let mut packets = Vec::new();
    for (number, (old, new)) in before.r.iter().zip(&after.r).enumerate() {
        if old != new {
            packets.push(format!("P{number:x}={}", to_hex(&new.to_le_bytes())));
        }
    }
    if before.xpsr != after.xpsr {
        packets.push(format!("P{XPSR:x}={}", to_hex(&after.xpsr.to_le_bytes())));
    }
    packets
}

/// Returns true for a request of GDB's file-I/O protocol: the name of a call with its arguments
/// (E.13.3).
fn is_system_call(packet: &str) -> bool {
    packet.starts_with('F')
}

/// Returns the reply to such a request (E.13.4).
fn system_call_reply(result: u32) -> String {
    format!("F{result:x}")
}

fn monitor_packet(command: &str) -> String {
    format!("qRcmd,{}", to_hex(command.as_bytes()))
}

fn checksum(bytes: &[u8]) -> u8 {
    bytes.iter().fold(0, |sum: u8, byte| sum.wrapping_add(*byte))
}

fn to_hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

fn from_hex(text: &str) -> Option<Vec<u8>> {
    let digits: Option<Vec<u8>> = text.chars().map(|c| Some(c.to_digit(16)? as u8)).collect();
    let digits = digits.filter(|digits| digits.len() % 2 == 0)?;
    Some(digits.chunks_exact(2).map(|pair| pair[0] << 4 | pair[1]).collect())
}

/// A broken connection means that QEMU ended.
fn closed(error: io::Error) -> GdbError {
    match error.kind() {
        io::ErrorKind::ConnectionReset | io::ErrorKind::BrokenPipe => GdbError::Closed,
        _ => error.into(),
    }
}

fn is_timeout(error: &io::Error) -> bool {
    matches!(error.kind(), io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn checksum_of_the_manual() {
        // GDB manual E.1: "$m0,4#fd" (the sum of the four characters).
        assert_eq!(checksum(b"m0,4"), 0xfd);
        assert_eq!(checksum(b"OK"), 0x9a);
    }

    #[test]
    fn packets_come_in_pieces() {
        let mut received = b"+$O".to_vec();
        assert_eq!(take_packet(&mut received).unwrap(), None);
        received.extend(b"K#9a$T05");
        assert_eq!(take_packet(&mut received).unwrap().as_deref(), Some("OK"));
        assert_eq!(take_packet(&mut received).unwrap(), None);
        received.extend(b"#b9");
        assert_eq!(take_packet(&mut received).unwrap().as_deref(), Some("T05"));
        assert_eq!(received, b"");
    }

    #[test]
    fn a_wrong_checksum_is_an_error() {
        let mut received = b"$OK#9b".to_vec();
        assert!(matches!(take_packet(&mut received), Err(GdbError::Checksum)));
        let mut received = b"$OK#zz".to_vec();
        assert!(matches!(take_packet(&mut received), Err(GdbError::Checksum)));
    }

    #[test]
    fn only_changed_registers_are_written() {
        let before = CoreRegisters::default();
        let mut after = before.clone();
        after.r[15] = 0x0800_0102;
        after.xpsr = 0x0100_0000;
        assert_eq!(register_packets(&before, &after), ["Pf=02010008", "P19=00000001"]);
    }

    #[test]
    fn system_call_of_the_manual() {
        // GDB manual E.13.2: "<- Fwrite,3,1234,6" and "-> F6".
        assert!(is_system_call("Fwrite,3,1234,6"));
        assert_eq!(system_call_reply(6), "F6");
        // A stop at a breakpoint, and the end of the program.
        assert!(!is_system_call("T05thread:01;"));
        assert!(!is_system_call("W00"));
    }

    #[test]
    fn hexadecimal() {
        assert_eq!(from_hex("00ff1A"), Some(vec![0, 0xff, 0x1a]));
        assert_eq!(from_hex("0"), None);
        assert_eq!(from_hex("0g"), None);
        assert_eq!(from_hex("é"), None);
    }
}
