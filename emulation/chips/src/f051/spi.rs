//! SPI with FIFOs (RM0091 28): master, frames of eight bits, full duplex.

use std::collections::VecDeque;

use crate::Time;
use crate::stm32::Write;

const CR1: u32 = 0x00;
const CR2: u32 = 0x04;
const SR: u32 = 0x08;
const DR: u32 = 0x0c;

const CR1_MSTR: u32 = 1 << 2;
const CR1_SPE: u32 = 1 << 6;
/// Bits of CR1 for modes without a model: clock idle high, data at the second edge, least
/// significant bit first, bidirectional, receive only, CRC.
const CR1_UNMODELED: u32 = 3 | 1 << 7 | 1 << 10 | 1 << 13 | 1 << 15;
const CR2_RXDMAEN: u32 = 1 << 0;
const CR2_TXDMAEN: u32 = 1 << 1;
const CR2_ERRIE: u32 = 1 << 5;
const CR2_RXNEIE: u32 = 1 << 6;
const CR2_TXEIE: u32 = 1 << 7;
const CR2_FRXTH: u32 = 1 << 12;
const SR_RXNE: u32 = 1 << 0;
const SR_TXE: u32 = 1 << 1;
const SR_OVR: u32 = 1 << 6;
const SR_BSY: u32 = 1 << 7;
/// The capacity of each FIFO in bytes.
const FIFO: usize = 4;
const FRAME_BITS: u64 = 8;

pub(crate) struct Spi {
    hz: u64,
    cr1: u32,
    cr2: u32,
    overrun: bool,
    /// True if the next read of SR clears OVR, because DR was read before.
    read_data: bool,
    transmit: VecDeque<u8>,
    receive: VecDeque<u8>,
    /// The byte on the wire, and the time of the end of its last bit.
    shifting: Option<(Time, u8)>,
}

impl Spi {
    pub fn new(hz: u64) -> Self {
        Spi {
            hz,
            cr1: 0,
            cr2: 0x0700,
            overrun: false,
            read_data: false,
            transmit: VecDeque::new(),
            receive: VecDeque::new(),
            shifting: None,
        }
    }

    pub fn set_clock(&mut self, hz: u64) {
        self.hz = hz;
    }

    /// Returns the bits per second: PCLK / 2^(BR + 1) (28.9.1).
    pub fn bit_rate(&self) -> u64 {
        self.hz >> ((self.cr1 >> 3 & 7) + 1)
    }

    /// Returns the time at which a byte on the wire is complete.
    pub fn next_event(&self) -> Option<Time> {
        self.shifting.map(|(end, _)| end)
    }

    /// Returns the byte that was sent until `now`, at most one. The byte in exchange must be passed
    /// to [`Self::received`].
    pub fn advance(&mut self, now: Time) -> Option<(Time, u8)> {
        self.shifting.take_if(|(end, _)| *end <= now)
    }

    /// Receives the byte that came in exchange for the one that ended at `end`.
    pub fn received(&mut self, byte: u8, end: Time) {
        if self.receive.len() == FIFO {
            self.overrun = true;
        } else {
            self.receive.push_back(byte);
        }
        self.shift(end);
    }

    fn shift(&mut self, now: Time) {
        if self.shifting.is_none()
            && self.cr1 & (CR1_SPE | CR1_MSTR) == CR1_SPE | CR1_MSTR
            && let Some(byte) = self.transmit.pop_front()
        {
            self.shifting = Some((now + Time::of_ticks(FRAME_BITS, self.bit_rate()), byte));
        }
    }

    fn status(&self) -> u32 {
        let threshold = if self.cr2 & CR2_FRXTH != 0 { 1 } else { 2 };
        let mut status = level(self.receive.len()) << 9 | level(self.transmit.len()) << 11;
        for (condition, bit) in [
            (self.receive.len() >= threshold, SR_RXNE),
            // TXE is set while the FIFO is at most half full (28.5.9).
            (self.transmit.len() <= FIFO / 2, SR_TXE),
            (self.overrun, SR_OVR),
            (self.shifting.is_some() || !self.transmit.is_empty(), SR_BSY),
        ] {
            if condition {
                status |= bit;
            }
        }
        status
    }

    pub fn interrupt(&self) -> bool {
        let status = self.status();
        status & SR_RXNE != 0 && self.cr2 & CR2_RXNEIE != 0
            || status & SR_TXE != 0 && self.cr2 & CR2_TXEIE != 0
            || self.overrun && self.cr2 & CR2_ERRIE != 0
    }

    /// Returns true if the SPI may cause interrupts or DMA transfers.
    pub fn is_watched(&self) -> bool {
        let interrupts = CR2_RXNEIE | CR2_TXEIE | CR2_ERRIE;
        self.cr2 & (interrupts | CR2_RXDMAEN | CR2_TXDMAEN) != 0
    }

    /// Returns the requests for DMA transfers: to the SPI, and from it.
    pub fn dma_requests(&self) -> [bool; 2] {
        let status = self.status();
        let enabled = self.cr1 & CR1_SPE != 0;
        [
            enabled && self.cr2 & CR2_TXDMAEN != 0 && status & SR_TXE != 0,
            enabled && self.cr2 & CR2_RXDMAEN != 0 && status & SR_RXNE != 0,
        ]
    }

    /// Reads a register. With `wide` the access has more than eight bits, and so takes two bytes at
    /// once (28.5.9).
    pub fn read(&mut self, offset: u32, wide: bool) -> u32 {
        match offset {
            CR1 => self.cr1,
            CR2 => self.cr2,
            SR => {
                let status = self.status();
                if std::mem::take(&mut self.read_data) {
                    self.overrun = false;
                }
                status
            }
            DR => {
                self.read_data = self.overrun;
                let low = self.receive.pop_front().unwrap_or(0);
                let high = if wide { self.receive.pop_front().unwrap_or(0) } else { 0 };
                u32::from(u16::from_le_bytes([low, high]))
            }
            // CRCPR: the reset value of the CRC's polynomial.
            0x10 => 7,
            _ => 0,
        }
    }

    /// Writes a register; returns false if that enables a function without a model.
    pub fn write(&mut self, offset: u32, write: Write, wide: bool, now: Time) -> bool {
        match offset {
            CR1 => {
                self.cr1 = write.merge(self.cr1);
                if self.cr1 & CR1_SPE == 0 {
                    self.transmit.clear();
                }
                self.shift(now);
                return self.cr1 & CR1_UNMODELED == 0;
            }
            CR2 => {
                self.cr2 = write.merge(self.cr2);
                return self.cr2 >> 8 & 0xf == 7;
            }
            DR => {
                let bytes = (write.ones() as u16).to_le_bytes();
                for byte in &bytes[..if wide { 2 } else { 1 }] {
                    if self.transmit.len() < FIFO {
                        self.transmit.push_back(*byte);
                    }
                }
                self.shift(now);
            }
            _ => {}
        }
        true
    }
}

/// Returns the level of a FIFO as SR encodes it: empty, a quarter, half, full.
fn level(bytes: usize) -> u32 {
    [0, 1, 2, 2, 3][bytes.min(FIFO)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Width;

    fn write(spi: &mut Spi, offset: u32, value: u32) -> bool {
        spi.write(offset, Write::new(offset, Width::Half, value), false, Time::ZERO)
    }

    /// An enabled SPI at 48 MHz / 8 that sets RXNE with every byte.
    fn spi() -> Spi {
        let mut spi = Spi::new(48_000_000);
        assert_eq!(spi.read(CR2, true), 0x0700);
        assert_eq!(spi.read(SR, true), SR_TXE);
        assert!(write(&mut spi, CR2, 0x0700 | CR2_FRXTH));
        assert!(write(&mut spi, CR1, CR1_MSTR | 2 << 3 | CR1_SPE | 3 << 8));
        spi
    }

    #[test]
    fn a_byte_takes_eight_bits() {
        let mut spi = spi();
        assert_eq!(spi.bit_rate(), 6_000_000);
        write(&mut spi, DR, 0x61);
        let end = Time::of_ticks(8, 6_000_000);
        assert_eq!(spi.next_event(), Some(end));
        assert_ne!(spi.read(SR, true) & SR_BSY, 0);
        assert_eq!(spi.advance(end - Time::from_picos(1)), None);
        assert_eq!(spi.advance(end), Some((end, 0x61)));
        spi.received(0x0e, end);
        assert_eq!(spi.read(SR, true) & 0xff, SR_RXNE | SR_TXE);
        assert_eq!(spi.read(DR, false), 0x0e);
        assert_eq!(spi.read(SR, true) & 0xff, SR_TXE);
    }

    #[test]
    fn halfwords_are_two_bytes() {
        let mut spi = spi();
        spi.write(DR, Write::new(DR, Width::Half, 0x2211), true, Time::ZERO);
        let mut end = Time::ZERO;
        for byte in [0x11, 0x22] {
            end = spi.next_event().unwrap();
            assert_eq!(spi.advance(end), Some((end, byte)));
            spi.received(byte + 1, end);
        }
        assert_eq!(end, Time::of_ticks(8, 6_000_000) + Time::of_ticks(8, 6_000_000));
        assert_eq!(spi.read(DR, true), 0x2312);
    }

    #[test]
    fn a_full_fifo_overruns() {
        let mut spi = spi();
        for byte in 0..5 {
            write(&mut spi, DR, byte);
            let end = spi.next_event().unwrap();
            spi.advance(end);
            spi.received(byte as u8, end);
        }
        assert_ne!(spi.read(SR, true) & SR_OVR, 0);
        for byte in 0..4 {
            assert_eq!(spi.read(DR, false), byte);
        }
        assert_ne!(spi.read(SR, true) & SR_OVR, 0);
        assert_eq!(spi.read(SR, true) & SR_OVR, 0, "DR, then SR");
    }

    #[test]
    fn modes_without_a_model_are_refused() {
        let mut spi = spi();
        assert!(!write(&mut spi, CR1, CR1_MSTR | 1));
        assert!(!write(&mut spi, CR2, 0x0f00));
    }
}
