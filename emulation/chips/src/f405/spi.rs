//! SPI with one buffer for each direction (RM0090 28): master, frames of eight bits, full duplex.
//!
//! The phase and polarity of the clock have no effect here. Frames of 16 bits, the other directions,
//! CRC and I2S have no model.

use crate::Time;
use crate::stm32::Write;

const CR1: u32 = 0x00;
const CR2: u32 = 0x04;
const SR: u32 = 0x08;
const DR: u32 = 0x0c;
const CRCPR: u32 = 0x10;

const CR1_MSTR: u32 = 1 << 2;
const CR1_SPE: u32 = 1 << 6;
/// Bits of CR1 for modes without a model: least significant bit first, receive only, 16 bits, CRC,
/// bidirectional.
const CR1_UNMODELED: u32 = 1 << 7 | 1 << 10 | 1 << 11 | 3 << 12 | 3 << 14;
const CR1_SSI: u32 = 1 << 8;
const CR1_SSM: u32 = 1 << 9;
const CR2_RXDMAEN: u32 = 1 << 0;
const CR2_TXDMAEN: u32 = 1 << 1;
const CR2_ERRIE: u32 = 1 << 5;
const CR2_RXNEIE: u32 = 1 << 6;
const CR2_TXEIE: u32 = 1 << 7;
const SR_RXNE: u32 = 1 << 0;
const SR_TXE: u32 = 1 << 1;
const SR_MODF: u32 = 1 << 5;
const SR_OVR: u32 = 1 << 6;
const SR_BSY: u32 = 1 << 7;
const FRAME_BITS: u64 = 8;

pub(crate) struct Spi {
    hz: u64,
    cr1: u32,
    cr2: u32,
    crc_polynomial: u32,
    transmit: Option<u8>,
    /// The received byte stays readable after RXNE is cleared.
    received: u8,
    is_full: bool,
    overrun: bool,
    /// The chip is told that another master selects it (28.3.10).
    mode_fault: bool,
    /// DR was read since the overrun, so that a read of SR clears it (28.3.10).
    has_read_data: bool,
    /// SR was read since the mode fault, so that a write of CR1 clears it.
    has_read_status: bool,
    /// The byte on the wire, and the time of the end of its last bit.
    shifting: Option<(Time, u8)>,
}

impl Spi {
    pub fn new(hz: u64) -> Self {
        Spi {
            hz,
            cr1: 0,
            cr2: 0,
            crc_polynomial: 7,
            transmit: None,
            received: 0,
            is_full: false,
            overrun: false,
            mode_fault: false,
            has_read_data: false,
            has_read_status: false,
            shifting: None,
        }
    }

    pub fn set_clock(&mut self, hz: u64) {
        self.hz = hz;
    }

    /// Returns the bits per second: PCLK / 2^(BR + 1) (28.5.1).
    fn bit_rate(&self) -> u64 {
        self.hz >> ((self.cr1 >> 3 & 7) + 1)
    }

    /// Returns the time at which a byte on the wire is complete.
    pub fn next_event(&self) -> Option<Time> {
        self.shifting.map(|(end, _)| end)
    }

    /// Returns the byte that was sent until `now`. The byte in exchange must be passed to
    /// [`Self::received`].
    pub fn advance(&mut self, now: Time) -> Option<(Time, u8)> {
        self.shifting.take_if(|(end, _)| *end <= now)
    }

    /// Receives the byte that came in exchange for the one that ended at `end`.
    pub fn received(&mut self, byte: u8, end: Time) {
        if self.is_full {
            // The byte in DR stays, and the new one is lost.
            self.overrun = true;
            self.has_read_data = false;
        } else {
            self.received = byte;
            self.is_full = true;
        }
        self.shift(end);
    }

    fn shift(&mut self, now: Time) {
        if self.shifting.is_none()
            && self.cr1 & (CR1_SPE | CR1_MSTR) == CR1_SPE | CR1_MSTR
            && let Some(byte) = self.transmit.take()
        {
            self.shifting = Some((now + Time::of_ticks(FRAME_BITS, self.bit_rate()), byte));
        }
    }

    fn status(&self) -> u32 {
        [
            (self.is_full, SR_RXNE),
            (self.transmit.is_none(), SR_TXE),
            (self.mode_fault, SR_MODF),
            (self.overrun, SR_OVR),
            (self.shifting.is_some(), SR_BSY),
        ]
        .into_iter()
        .filter(|(is_set, _)| *is_set)
        .fold(0, |status, (_, bit)| status | bit)
    }

    pub fn interrupt(&self) -> bool {
        self.is_full && self.cr2 & CR2_RXNEIE != 0
            || self.transmit.is_none() && self.cr2 & CR2_TXEIE != 0
            || (self.overrun || self.mode_fault) && self.cr2 & CR2_ERRIE != 0
    }

    /// Returns the requests for DMA transfers: to the SPI, and from it. A request to it comes with
    /// TXE, whether SPE is set or not (28.3.9).
    pub fn dma_requests(&self) -> [bool; 2] {
        [
            self.cr2 & CR2_TXDMAEN != 0 && self.transmit.is_none(),
            self.cr2 & CR2_RXDMAEN != 0 && self.is_full,
        ]
    }

    pub fn read(&mut self, offset: u32) -> u32 {
        match offset {
            CR1 => self.cr1,
            CR2 => self.cr2,
            SR => {
                let status = self.status();
                self.overrun &= !self.has_read_data;
                self.has_read_status = self.mode_fault;
                status
            }
            DR => {
                self.is_full = false;
                self.has_read_data = self.overrun;
                u32::from(self.received)
            }
            CRCPR => self.crc_polynomial,
            _ => 0,
        }
    }

    /// Writes a register; returns false if that enables a function without a model.
    pub fn write(&mut self, offset: u32, write: Write, now: Time) -> bool {
        match offset {
            CR1 => {
                self.cr1 = write.merge(self.cr1) & 0xffff;
                self.mode_fault &= !std::mem::take(&mut self.has_read_status);
                // A master that NSS selects, here by SSI, loses its mode and is turned off.
                if self.cr1 & (CR1_MSTR | CR1_SSM | CR1_SSI) == CR1_MSTR | CR1_SSM {
                    self.mode_fault = true;
                    self.cr1 &= !(CR1_MSTR | CR1_SPE);
                }
                if self.cr1 & CR1_SPE == 0 {
                    self.shifting = None;
                }
                self.shift(now);
                return self.cr1 & CR1_SPE == 0 || self.cr1 & CR1_UNMODELED == 0;
            }
            CR2 => self.cr2 = write.merge(self.cr2) & 0xf7,
            DR => {
                self.transmit = Some(write.ones() as u8);
                self.shift(now);
            }
            CRCPR => self.crc_polynomial = write.merge(self.crc_polynomial) & 0xffff,
            _ => {}
        }
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Width;

    /// A byte at 84 MHz / 64.
    const BYTE: Time = Time::from_picos(6_095_239);

    fn write(spi: &mut Spi, offset: u32, value: u32, now: Time) -> bool {
        spi.write(offset, Write::new(offset, Width::Half, value), now)
    }

    /// An enabled master at 84 MHz / 64, with software control of NSS.
    fn spi() -> Spi {
        let mut spi = Spi::new(84_000_000);
        let cr1 = CR1_MSTR | 5 << 3 | CR1_SSM | CR1_SSI | CR1_SPE;
        assert!(write(&mut spi, CR1, cr1, Time::ZERO));
        spi
    }

    #[test]
    fn reset_values_are_the_manuals() {
        // RM0090 28.5: CR1 0, CR2 0, SR 0x0002, CRCPR 0x0007.
        let mut spi = Spi::new(84_000_000);
        assert_eq!([CR1, CR2, SR, CRCPR].map(|register| spi.read(register)), [0, 0, 2, 7]);
    }

    #[test]
    fn exchanges_two_bytes_back_to_back() {
        let mut spi = spi();
        assert_eq!(spi.bit_rate(), 1_312_500);
        write(&mut spi, DR, 0x16, Time::ZERO);
        assert_eq!(spi.read(SR), SR_TXE | SR_BSY, "the shift register took it");
        write(&mut spi, DR, 0x17, Time::ZERO);
        assert_eq!(spi.read(SR), SR_BSY);
        assert_eq!(spi.next_event(), Some(BYTE));
        assert_eq!(spi.advance(BYTE), Some((BYTE, 0x16)));
        spi.received(0xb0, BYTE);
        assert_eq!(spi.read(SR), SR_RXNE | SR_TXE | SR_BSY);
        assert_eq!(spi.read(DR), 0xb0);
        let end = spi.next_event().unwrap();
        assert_eq!(spi.advance(end), Some((end, 0x17)));
        spi.received(0xb1, end);
        assert_eq!((spi.read(SR), spi.read(DR)), (SR_RXNE | SR_TXE, 0xb1));
    }

    #[test]
    fn an_unread_byte_makes_the_next_one_overrun() {
        let mut spi = spi();
        write(&mut spi, CR2, CR2_ERRIE, Time::ZERO);
        spi.received(1, Time::ZERO);
        spi.received(2, Time::ZERO);
        assert!(spi.interrupt());
        assert_ne!(spi.read(SR) & SR_OVR, 0);
        assert_ne!(spi.read(SR) & SR_OVR, 0, "DR was not read");
        assert_eq!(spi.read(DR), 1);
        assert_ne!(spi.read(SR) & SR_OVR, 0, "this read clears it");
        assert_eq!(spi.read(SR), SR_TXE);
    }

    #[test]
    fn requests_of_interrupts_and_dma() {
        let mut spi = spi();
        assert_eq!((spi.dma_requests(), spi.interrupt()), ([false; 2], false));
        write(&mut spi, CR2, CR2_TXDMAEN | CR2_RXDMAEN, Time::ZERO);
        assert_eq!(spi.dma_requests(), [true, false]);
        write(&mut spi, DR, 1, Time::ZERO);
        write(&mut spi, DR, 2, Time::ZERO);
        spi.advance(BYTE);
        spi.received(3, BYTE);
        assert_eq!(spi.dma_requests(), [true, true]);
        write(&mut spi, CR2, CR2_RXNEIE, Time::ZERO);
        assert!(spi.interrupt());
        spi.read(DR);
        assert!(!spi.interrupt());
    }

    #[test]
    fn a_selected_master_has_a_mode_fault() {
        let mut spi = Spi::new(84_000_000);
        write(&mut spi, CR1, CR1_MSTR | CR1_SSM | CR1_SPE, Time::ZERO);
        assert_eq!(spi.read(CR1), CR1_SSM);
        assert_eq!(spi.read(SR) & SR_MODF, SR_MODF);
        write(&mut spi, CR1, CR1_SSM | CR1_SSI, Time::ZERO);
        assert_eq!(spi.read(SR) & SR_MODF, 0);
        assert!(!write(&mut spi, CR1, CR1_SPE | 1 << 11, Time::ZERO), "16 bits have no model");
    }
}
