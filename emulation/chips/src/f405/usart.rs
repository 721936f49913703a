//! The USART of the STM32F4 (RM0090 30): asynchronous, 8 data bits, no parity, one stop bit, by
//! interrupts or DMA.

use crate::Time;
use crate::serial::{self, FRAME_BITS, Received};
use crate::stm32::Write;

const SR: u32 = 0x00;
const DR: u32 = 0x04;
const BRR: u32 = 0x08;
const CR1: u32 = 0x0c;
const CR2: u32 = 0x10;
const CR3: u32 = 0x14;
const GTPR: u32 = 0x18;

const SR_FE: u32 = 1 << 1;
const SR_ORE: u32 = 1 << 3;
const SR_IDLE: u32 = 1 << 4;
const SR_RXNE: u32 = 1 << 5;
const SR_TC: u32 = 1 << 6;
const SR_TXE: u32 = 1 << 7;
/// Flags that are cleared by reading SR, then DR (30.6.1).
const SR_BY_READING: u32 = SR_FE | SR_ORE | SR_IDLE;
/// Flags that are cleared by writing 0: CTS, LBD, TC, RXNE.
const SR_BY_WRITING: u32 = 1 << 9 | 1 << 8 | SR_TC | SR_RXNE;

const CR1_RE: u32 = 1 << 2;
const CR1_TE: u32 = 1 << 3;
/// The interrupt enable bits of IDLE, RXNE, TC and TXE have the positions of their flags.
const CR1_INTERRUPTS: u32 = SR_IDLE | SR_RXNE | SR_TC | SR_TXE;
const CR1_RXNEIE: u32 = SR_RXNE;
const CR1_PCE: u32 = 1 << 10;
const CR1_M: u32 = 1 << 12;
const CR1_UE: u32 = 1 << 13;
const CR1_OVER8: u32 = 1 << 15;
const CR2_STOP: u32 = 3 << 12;
const CR3_EIE: u32 = 1 << 0;
const CR3_DMAR: u32 = 1 << 6;
const CR3_DMAT: u32 = 1 << 7;

/// A byte as the transmitter put it on the wire.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SentByte {
    /// The eight data bits.
    pub byte: u8,
    /// The rate at which they were sent.
    pub baud: u64,
}

/// A USART of the STM32F405 in asynchronous mode.
pub struct Usart {
    hz: u64,
    sr: u32,
    /// The flags that the last read of SR has shown, of those in `SR_BY_READING`.
    shown: u32,
    received: u8,
    brr: u32,
    cr1: u32,
    cr2: u32,
    cr3: u32,
    gtpr: u32,
    /// The byte in the shift register, and the time at which it will have left.
    shifting: Option<(Time, SentByte)>,
    waiting: Option<u8>,
    idle_at: Option<Time>,
    /// The time at which RXNE was set.
    received_at: Time,
    /// The longest time from a byte's arrival until it was read.
    pub longest_unread: Time,
    /// Bytes lost because the byte before had not been read.
    pub overruns: u64,
    /// Bytes with a wrong stop bit.
    pub framing_errors: u64,
}

impl Usart {
    pub(crate) fn new(hz: u64) -> Self {
        Usart {
            hz,
            sr: SR_TXE | SR_TC,
            shown: 0,
            received: 0,
            brr: 0,
            cr1: 0,
            cr2: 0,
            cr3: 0,
            gtpr: 0,
            shifting: None,
            waiting: None,
            idle_at: None,
            received_at: Time::ZERO,
            longest_unread: Time::ZERO,
            overruns: 0,
            framing_errors: 0,
        }
    }

    /// Sets the registers to their reset values; the counters stay.
    pub(crate) fn reset(&mut self) {
        *self = Usart {
            longest_unread: self.longest_unread,
            overruns: self.overruns,
            framing_errors: self.framing_errors,
            ..Usart::new(self.hz)
        };
    }

    pub(crate) fn set_clock(&mut self, hz: u64) {
        self.hz = hz;
    }

    /// Returns the bits per second: f / (8 * (2 - OVER8) * USARTDIV), 30.3.4. With 16 samples a
    /// bit, BRR is f / baud; with 8, its lowest three bits are eighths. The peer understands 8N1
    /// frames only; for other frames the result is 0.
    pub(crate) fn baud(&self) -> u64 {
        let divider = if self.cr1 & CR1_OVER8 == 0 {
            self.brr & 0xffff
        } else {
            (self.brr >> 4 & 0xfff) * 8 + (self.brr & 7)
        };
        if self.cr1 & (CR1_M | CR1_PCE) != 0 || self.cr2 & CR2_STOP != 0 {
            return 0;
        }
        self.hz.checked_div(u64::from(divider)).unwrap_or(0)
    }

    fn receives(&self) -> bool {
        self.cr1 & (CR1_UE | CR1_RE) == CR1_UE | CR1_RE
    }

    /// Handles the begin of a byte: the line is not idle.
    pub(crate) fn begin(&mut self) {
        self.idle_at = None;
    }

    /// Receives a byte that was sent at `peer_baud`.
    pub(crate) fn receive(&mut self, byte: u8, peer_baud: u64, now: Time) {
        if !self.receives() {
            return;
        }
        let Received { byte, framing_error } = serial::receive(byte, peer_baud, self.baud());
        if self.sr & SR_RXNE != 0 {
            // The new byte is lost, the old one stays in DR (30.3.3).
            self.sr |= SR_ORE;
            self.overruns += 1;
        } else {
            self.received = byte;
            self.sr |= SR_RXNE;
            self.received_at = now;
        }
        if framing_error {
            self.sr |= SR_FE;
            self.framing_errors += 1;
        }
        self.idle_at = Some(now + Time::of_ticks(FRAME_BITS, self.baud()));
    }

    /// Advances time to `now`, at which at most one byte has left.
    pub(crate) fn advance(&mut self, now: Time) -> Option<SentByte> {
        if self.idle_at.is_some_and(|at| at <= now) {
            self.idle_at = None;
            self.sr |= SR_IDLE;
        }
        let (end, sent) = self.shifting?;
        if end > now {
            return None;
        }
        self.shifting = None;
        match self.waiting.take() {
            Some(next) => self.shift(next, end),
            None => self.sr |= SR_TC,
        }
        Some(sent)
    }

    fn shift(&mut self, byte: u8, now: Time) {
        let baud = self.baud();
        self.shifting = Some((now + Time::of_ticks(FRAME_BITS, baud), SentByte { byte, baud }));
        self.sr |= SR_TXE;
    }

    pub(crate) fn next_event(&self) -> Option<Time> {
        let shifted = self.shifting.map(|(end, _)| end);
        self.idle_at.into_iter().chain(shifted).min()
    }

    /// Returns the end of the byte that is being sent, if one is.
    pub fn sent_at(&self) -> Option<Time> {
        self.shifting.map(|(end, _)| end)
    }

    pub(crate) fn interrupt(&self) -> bool {
        let overrun = self.sr & SR_ORE != 0 && self.cr1 & CR1_RXNEIE != 0;
        let error =
            self.sr & (SR_FE | SR_ORE) != 0 && self.cr3 & CR3_EIE != 0 && self.cr3 & CR3_DMAR != 0;
        self.sr & self.cr1 & CR1_INTERRUPTS != 0 || overrun || error
    }

    /// Returns the requests for DMA transfers: to the USART, and from it (30.3.13).
    pub(crate) fn dma_requests(&self) -> [bool; 2] {
        [
            self.cr3 & CR3_DMAT != 0 && self.sr & SR_TXE != 0 && self.cr1 & CR1_UE != 0,
            self.cr3 & CR3_DMAR != 0 && self.sr & SR_RXNE != 0,
        ]
    }

    pub(crate) fn read(&mut self, offset: u32, now: Time) -> u32 {
        match offset {
            SR => {
                self.shown = self.sr & SR_BY_READING;
                self.sr
            }
            DR => {
                if self.sr & SR_RXNE != 0 {
                    self.longest_unread = self.longest_unread.max(now - self.received_at);
                }
                self.sr &= !(SR_RXNE | self.shown);
                self.shown = 0;
                u32::from(self.received)
            }
            BRR => self.brr,
            CR1 => self.cr1,
            CR2 => self.cr2,
            CR3 => self.cr3,
            GTPR => self.gtpr,
            _ => 0,
        }
    }

    pub(crate) fn write(&mut self, offset: u32, write: Write, now: Time) {
        match offset {
            SR => self.sr &= !(write.zeros() & SR_BY_WRITING),
            DR => {
                if self.cr1 & (CR1_UE | CR1_TE) != CR1_UE | CR1_TE {
                    return;
                }
                let byte = write.ones() as u8;
                self.sr &= !SR_TC;
                if self.shifting.is_none() {
                    self.shift(byte, now);
                } else {
                    self.waiting = Some(byte);
                    self.sr &= !SR_TXE;
                }
            }
            BRR => self.brr = write.merge(self.brr) & 0xffff,
            CR1 => {
                self.cr1 = write.merge(self.cr1);
                if self.cr1 & CR1_UE == 0 {
                    self.shifting = None;
                    self.waiting = None;
                    self.sr |= SR_TXE | SR_TC;
                }
                if !self.receives() {
                    self.idle_at = None;
                }
            }
            CR2 => self.cr2 = write.merge(self.cr2),
            CR3 => self.cr3 = write.merge(self.cr3),
            GTPR => self.gtpr = write.merge(self.gtpr),
            _ => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Width;

    const BYTE: Time = Time::from_micros(10);

    fn write(usart: &mut Usart, offset: u32, value: u32, now: Time) {
        usart.write(offset, Write::new(offset, Width::Word, value), now);
    }

    /// An enabled USART with a clock of 84 MHz, at 1 Mbaud.
    fn usart() -> Usart {
        let mut usart = Usart::new(84_000_000);
        write(&mut usart, BRR, 84, Time::ZERO);
        write(&mut usart, CR1, CR1_UE | CR1_RE | CR1_TE, Time::ZERO);
        usart
    }

    #[test]
    fn baud_rates_are_the_manuals() {
        // RM0090 table 142, fPCLK 84 MHz: 9600 baud by 546.875, 230400 by 22.8125 (16 samples).
        let mut usart = usart();
        for (brr, baud) in [(546 << 4 | 14, 9_600), (22 << 4 | 13, 230_136)] {
            write(&mut usart, BRR, brr, Time::ZERO);
            assert_eq!(usart.baud(), baud);
        }
        // With 8 samples the rate doubles for the same divider: 1 Mbaud is 10.5.
        write(&mut usart, CR1, CR1_UE | CR1_OVER8, Time::ZERO);
        write(&mut usart, BRR, 10 << 4 | 4, Time::ZERO);
        assert_eq!(usart.baud(), 1_000_000);
    }

    #[test]
    fn transmits_two_bytes_back_to_back() {
        let mut usart = usart();
        write(&mut usart, DR, 0x55, Time::ZERO);
        assert_eq!(usart.read(SR, Time::ZERO), SR_TXE, "the shift register took it");
        write(&mut usart, DR, 0x66, Time::ZERO);
        assert_eq!(usart.read(SR, Time::ZERO), 0);
        assert_eq!(usart.next_event(), Some(BYTE));
        assert_eq!(usart.advance(BYTE), Some(SentByte { byte: 0x55, baud: 1_000_000 }));
        assert_eq!(usart.read(SR, BYTE), SR_TXE);
        let end = Time::from_micros(20);
        assert_eq!(usart.advance(end), Some(SentByte { byte: 0x66, baud: 1_000_000 }));
        assert_eq!(usart.read(SR, end), SR_TXE | SR_TC);
    }

    #[test]
    fn receives_and_measures_how_long_a_byte_waits() {
        let mut usart = usart();
        usart.receive(0xa5, 1_000_000, BYTE);
        assert!(!usart.interrupt());
        write(&mut usart, CR1, CR1_UE | CR1_RE | CR1_RXNEIE, BYTE);
        assert!(usart.interrupt());
        assert_eq!(usart.read(DR, BYTE + Time::from_micros(3)), 0xa5);
        assert!(!usart.interrupt());
        assert_eq!(usart.longest_unread, Time::from_micros(3));
    }

    #[test]
    fn an_unread_byte_makes_the_next_one_overrun() {
        let mut usart = usart();
        usart.receive(1, 1_000_000, BYTE);
        usart.receive(2, 1_000_000, Time::from_micros(20));
        let now = Time::from_micros(21);
        assert_eq!(usart.read(DR, now), 1);
        assert_eq!(
            usart.read(SR, now) & (SR_ORE | SR_RXNE),
            SR_ORE,
            "SR had not been read before DR"
        );
        usart.read(DR, now);
        assert_eq!(usart.read(SR, now) & SR_ORE, 0);
        assert_eq!(usart.overruns, 1);
    }

    #[test]
    fn idle_comes_once_a_frame_after_the_last_byte() {
        let mut usart = usart();
        usart.receive(1, 1_000_000, BYTE);
        usart.begin();
        assert_eq!(usart.next_event(), None, "another byte is on its way");
        usart.receive(2, 1_000_000, Time::from_micros(20));
        let idle = Time::from_micros(30);
        assert_eq!(usart.next_event(), Some(idle));
        usart.advance(idle);
        assert_ne!(usart.read(SR, idle) & SR_IDLE, 0);
        usart.read(DR, idle);
        assert_eq!(usart.read(SR, idle) & SR_IDLE, 0);
        assert_eq!(usart.next_event(), None);
    }

    #[test]
    fn dma_is_requested_by_txe_and_rxne() {
        let mut usart = usart();
        assert_eq!(usart.dma_requests(), [false, false]);
        write(&mut usart, CR3, CR3_DMAT | CR3_DMAR, Time::ZERO);
        assert_eq!(usart.dma_requests(), [true, false]);
        write(&mut usart, DR, 1, Time::ZERO);
        write(&mut usart, DR, 2, Time::ZERO);
        assert_eq!(usart.dma_requests(), [false, false], "both registers are full");
        usart.advance(BYTE);
        usart.receive(3, 1_000_000, BYTE);
        assert_eq!(usart.dma_requests(), [true, true]);
    }

    #[test]
    fn a_wrong_baud_rate_gives_framing_errors() {
        let mut usart = usart();
        write(&mut usart, BRR, 80, Time::ZERO);
        usart.receive(0x00, 1_000_000, BYTE);
        assert_ne!(usart.read(SR, BYTE) & SR_FE, 0);
    }
}
