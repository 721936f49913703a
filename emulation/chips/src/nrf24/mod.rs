//! nRF24L01+ (Nordic's product specification, version 1.0), at the level of its pins: SPI, CE, IRQ, and the air.
//!
//! What follows from the analog part is reduced to time: it settles for 130 µs before it sends or receives, and it hears
//! what others say exactly. Between two packets it settles anew even when CE stays high, which the chip does not.

#[cfg(test)]
mod driver_tests;
mod packet;
mod port;
mod radio;
mod registers;
#[cfg(test)]
mod tests;

use std::collections::VecDeque;

pub use self::packet::{MAX_PAYLOAD, Packet, Transmission};
use self::port::Exchange;
use self::radio::RadioState;
use self::registers::{
    CONFIG, CONFIG_PRIM_RX, CONFIG_PWR_UP, FIFO_STATUS, INTERRUPTS, OBSERVE_TX, PIPES, RPD,
    Registers, STATUS,
};
use crate::Time;

/// Payloads that each FIFO holds.
const FIFO: usize = 3;
/// The specification's limit for SCK.
pub const SPI_LIMIT_HZ: u64 = 10_000_000;
/// The frequency at XC1.
pub const CLOCK_HZ: u64 = 16_000_000;
/// From power-on until SPI works (6.1.7, Tpor: 100 ms for the supply, the reset included).
const POWER_ON: Time = Time::from_millis(100);

/// A packet that waits to be sent.
#[derive(Clone, Debug, PartialEq, Eq)]
enum Outgoing {
    Payload {
        bytes: Vec<u8>,
        no_ack: bool,
    },
    /// With the next acknowledgement on this pipe; `sent` once it was.
    Acknowledgement {
        pipe: usize,
        bytes: Vec<u8>,
        sent: bool,
    },
}

/// The two readings of the specification's sentence "the RPD status is latched when a valid packet is received" (6.4). It does not
/// say when the bit is released while CE stays high, so that firmware has to work with both.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum PowerDetector {
    /// A packet sets the bit until CE goes low.
    #[default]
    Latched,
    /// The bit follows the signal on the channel as long as the radio receives.
    Live,
}

/// The radio's counters since power-on.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct RadioStatistics {
    /// Packets sent, acknowledgements and repetitions included.
    pub sent: u64,
    /// Packets that reached the receive FIFO.
    pub received: u64,
    /// Packets for it that were damaged.
    pub damaged: u64,
    /// Packets that came while it did not listen.
    pub unheard: u64,
    /// Packets for which the receive FIFO had no room.
    pub overflown: u64,
    /// Bytes on SPI before the radio's power-on reset was over.
    pub too_early: u64,
    /// Registers other than STATUS written while it sent or received, which only works by chance.
    pub written_while_active: u64,
    /// CE pulses that were too short to send.
    pub short_pulses: u64,
}

/// The radio by its pins: SPI, CE and IRQ.
pub struct Nrf24 {
    registers: Registers,
    /// RX_DR, TX_DS and MAX_RT.
    raised: u8,
    /// OBSERVE_TX: packets lost, retransmissions of the current one.
    lost: u8,
    retries: u8,
    transmit: VecDeque<Outgoing>,
    receive: VecDeque<(usize, Vec<u8>)>,
    /// REUSE_TX_PL is active.
    reuses: bool,
    /// The command on SPI, while CSN is low.
    exchange: Option<Exchange>,
    has_clock: bool,
    /// CE.
    enabled: bool,
    state: RadioState,
    /// Number of the next packet.
    id: u8,
    /// The last packet of each pipe, to drop repetitions.
    last: [Option<(u8, Vec<u8>)>; PIPES],
    /// Signals on the air: those that have not ended, and when each is audible.
    carriers: Vec<(u8, Time, Time)>,
    /// Packets on their way here, and whether they arrive undamaged.
    arriving: Vec<(Transmission, bool)>,
    /// RPD, when the radio does not listen.
    power_detected: bool,
    /// A valid packet was received since CE went high.
    has_received: bool,
    power_detector: PowerDetector,
    transmissions: Vec<Transmission>,
    /// The end of the last of them.
    transmissions_end: Time,
    /// The time at which its power came.
    powered_at: Time,
    /// Counters since power-on.
    pub statistics: RadioStatistics,
}

impl Default for Nrf24 {
    fn default() -> Self {
        Self::new()
    }
}

impl Nrf24 {
    /// One whose power has just come.
    pub fn new() -> Self {
        Nrf24 {
            registers: Registers::new(),
            raised: 0,
            lost: 0,
            retries: 0,
            transmit: VecDeque::new(),
            receive: VecDeque::new(),
            reuses: false,
            exchange: None,
            has_clock: false,
            enabled: false,
            state: RadioState::PoweredDown,
            id: 0,
            last: Default::default(),
            carriers: Vec::new(),
            arriving: Vec::new(),
            power_detected: false,
            has_received: false,
            power_detector: PowerDetector::default(),
            transmissions: Vec::new(),
            transmissions_end: Time::ZERO,
            powered_at: Time::ZERO,
            statistics: RadioStatistics::default(),
        }
    }

    /// Its power goes and comes: packets on the air and the counters stay.
    pub fn restart(&mut self, now: Time) {
        let statistics = std::mem::take(&mut self.statistics);
        let carriers = std::mem::take(&mut self.carriers);
        let power_detector = self.power_detector;
        *self = Nrf24 { powered_at: now, carriers, statistics, power_detector, ..Nrf24::new() };
    }

    /// From now on RPD is read this way.
    pub fn set_power_detector(&mut self, power_detector: PowerDetector) {
        self.power_detector = power_detector;
    }

    /// The level of its pin IRQ: low while an unmasked flag is raised.
    pub fn irq(&self) -> bool {
        self.raised & !self.registers.get(CONFIG) & INTERRUPTS == 0
    }

    /// Returns the packets that it begins to send soon: announced 120 µs before the first bit.
    pub fn take_transmissions(&mut self) -> Vec<Transmission> {
        std::mem::take(&mut self.transmissions)
    }

    fn status(&self) -> u8 {
        let pipe = self.receive.front().map_or(7, |(pipe, _)| *pipe as u8);
        self.raised | pipe << 1 | u8::from(self.transmit.len() == FIFO)
    }

    fn fifo_status(&self) -> u8 {
        let bits = [
            self.receive.is_empty(),
            self.receive.len() == FIFO,
            false,
            false,
            self.transmit.is_empty(),
            self.transmit.len() == FIFO,
            self.reuses,
        ];
        bits.iter().enumerate().fold(0, |byte, (bit, set)| byte | u8::from(*set) << bit)
    }

    fn read_register(&self, register: u8, index: usize, now: Time) -> u8 {
        match register {
            STATUS => self.status(),
            OBSERVE_TX => self.lost << 4 | self.retries,
            RPD => u8::from(self.detects_power(now)),
            FIFO_STATUS => self.fifo_status(),
            _ => self.registers.read(register, index),
        }
    }

    fn is_powered_up(&self) -> bool {
        self.registers.get(CONFIG) & CONFIG_PWR_UP != 0
    }

    fn is_receiver(&self) -> bool {
        self.registers.get(CONFIG) & CONFIG_PRIM_RX != 0
    }
}
