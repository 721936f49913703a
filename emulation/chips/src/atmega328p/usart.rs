//! The transmitter of USART0 (chapter 20), in asynchronous mode. The receiver is not modeled,
//! because a Kilobot has no serial input.

/// UCSR0A.
const TXC: u8 = 1 << 6;
const UDRE: u8 = 1 << 5;
const U2X: u8 = 1 << 1;
/// UCSR0B.
const TXCIE: u8 = 1 << 6;
const UDRIE: u8 = 1 << 5;
const TXEN: u8 = 1 << 3;

/// A byte on the line, with the format that the registers set.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sent {
    /// The eight data bits.
    pub byte: u8,
    /// Cycles per bit.
    pub bit: u32,
    /// True for eight data bits without parity.
    pub is_plain: bool,
}

/// The transmitter.
#[derive(Clone, Debug)]
pub struct Usart {
    status: u8,
    control: u8,
    format: u8,
    divisor: u16,
    /// The waiting byte.
    buffer: Option<u8>,
    /// The byte that is being sent, and the cycle at which its last bit ends.
    shifting: Option<(u8, u64)>,
}

impl Usart {
    pub fn new() -> Self {
        Usart { status: 0, control: 0, format: 6, divisor: 0, buffer: None, shifting: None }
    }

    fn bit(&self) -> u32 {
        // Table 20-1.
        let samples = if self.status & U2X != 0 { 8 } else { 16 };
        samples * (u32::from(self.divisor) + 1)
    }

    fn bits(&self) -> u64 {
        let data = if self.format >> 1 & 3 == 3 { 8 } else { 5 + u64::from(self.format >> 1 & 3) };
        2 + data + u64::from(self.format >> 3 & 1) + u64::from(self.format >> 5 & 1)
    }

    fn shift(&mut self, now: u64) {
        if self.shifting.is_none()
            && let Some(byte) = self.buffer.take()
        {
            self.shifting = Some((byte, now + self.bits() * u64::from(self.bit())));
        }
    }

    pub fn next_event(&self) -> Option<u64> {
        self.shifting.map(|(_, end)| end)
    }

    /// Returns the byte whose last bit ended until `now`.
    pub fn advance(&mut self, now: u64) -> Option<Sent> {
        let (byte, end) = self.shifting.filter(|(_, end)| *end <= now)?;
        self.shifting = None;
        self.shift(end);
        if self.shifting.is_none() {
            self.status |= TXC;
        }
        let is_plain = self.format & 0x36 == 0x06 && self.control & 4 == 0;
        Some(Sent { byte, bit: self.bit(), is_plain })
    }

    pub fn is_empty_interrupt(&self) -> bool {
        self.control & UDRIE != 0 && self.buffer.is_none()
    }

    pub fn is_complete_interrupt(&self) -> bool {
        self.control & TXCIE != 0 && self.status & TXC != 0
    }

    pub fn acknowledge_complete(&mut self) {
        self.status &= !TXC;
    }

    pub fn status(&self) -> u8 {
        self.status | if self.buffer.is_none() { UDRE } else { 0 }
    }

    pub fn set_status(&mut self, value: u8) {
        let complete = self.status & TXC & !value;
        self.status = complete | value & U2X;
    }

    pub fn control(&self) -> u8 {
        self.control
    }

    pub fn set_control(&mut self, value: u8) {
        self.control = value;
    }

    pub fn format(&self) -> u8 {
        self.format
    }

    pub fn set_format(&mut self, value: u8) {
        self.format = value;
    }

    pub fn divisor(&self) -> [u8; 2] {
        self.divisor.to_le_bytes()
    }

    pub fn set_divisor(&mut self, byte: usize, value: u8) {
        let mut bytes = self.divisor();
        bytes[byte] = value;
        self.divisor = u16::from_le_bytes(bytes) & 0xfff;
    }

    /// Writes UDR0.
    pub fn send(&mut self, byte: u8, now: u64) {
        if self.control & TXEN != 0 && self.buffer.is_none() {
            self.buffer = Some(byte);
            self.shift(now);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_go_out_back_to_back_at_the_rate_of_the_divisor() {
        let mut usart = Usart::new();
        usart.set_control(TXEN);
        // Table 20-9: 38400 at 8 MHz is UBRR 12.
        usart.set_divisor(0, 12);
        usart.send(b'o', 100);
        assert_ne!(usart.status() & UDRE, 0, "the buffer is free once the byte is being sent");
        usart.send(b'k', 101);
        usart.send(b'!', 102);
        assert_eq!(usart.status() & UDRE, 0);
        assert_eq!(usart.next_event(), Some(100 + 2080));
        let sent = |byte| Some(Sent { byte, bit: 208, is_plain: true });
        assert_eq!(usart.advance(2180), sent(b'o'));
        assert_eq!(usart.status() & TXC, 0);
        assert_eq!(usart.advance(4259), None);
        assert_eq!(usart.advance(4260), sent(b'k'));
        assert_ne!(usart.status() & TXC, 0);
        assert_eq!(usart.advance(9999), None, "bytes that did not fit were lost");
    }
}
