//! The radio nRF24L01+ (Nordic's product specification, version 1.0), at the level of its pins:
//! SPI, CE, IRQ, and the air.
//!
//! The analog part is modeled by its timing only: the radio settles for 130 µs before it transmits
//! or receives, and reception itself is exact. Between two packets this model settles again even
//! when CE stays high, which the chip does not do.

#[cfg(test)]
mod driver_tests;
mod packet;
mod port;
mod radio;
mod registers;
#[cfg(test)]
mod tests;

use std::collections::VecDeque;

pub use self::packet::{Nrf24Packet, PAYLOAD_MAX, Transmission};
use self::port::Exchange;
use self::radio::RadioState;
use self::registers::{
    CONFIG, CONFIG_PRIM_RX, CONFIG_PWR_UP, FIFO_STATUS, INTERRUPTS, Nrf24Registers, OBSERVE_TX,
    PIPES, RPD, STATUS,
};
use crate::Time;

/// The capacity of each FIFO in payloads.
const FIFO: usize = 3;
/// The specification's limit for the frequency of SCK.
pub const SPI_LIMIT_HZ: u64 = 10_000_000;
/// The frequency that the radio needs at XC1.
pub const CLOCK_HZ: u64 = 16_000_000;
/// The time from power-on until SPI works (6.1.7, Tpor: 100 ms for the supply, the reset included).
const POWER_ON: Time = Time::from_millis(100);

/// A packet that waits to be sent.
#[derive(Clone, Debug, PartialEq, Eq)]
enum Outgoing {
    Payload {
        bytes: Vec<u8>,
        no_ack: bool,
    },
    /// A payload for the next acknowledgement on this pipe. `sent` is true once it was transmitted.
    Acknowledgement {
        pipe: usize,
        bytes: Vec<u8>,
        sent: bool,
    },
}

/// The two interpretations of the specification's sentence "the RPD status is latched when a valid
/// packet is received" (6.4). The sentence does not define when the bit is released while CE stays
/// high, so firmware has to work with both.
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
    /// Packets for this radio that arrived damaged.
    pub damaged: u64,
    /// Packets that arrived while the radio did not listen.
    pub unheard: u64,
    /// Packets for which the receive FIFO had no room.
    pub overflown: u64,
    /// Bytes on SPI before the radio's power-on reset ended.
    pub too_early: u64,
    /// Writes to registers other than STATUS while the radio transmitted or received, which work
    /// only by chance.
    pub written_while_active: u64,
    /// CE pulses that were too short to start a transmission.
    pub short_pulses: u64,
}

/// The radio, controlled through its pins SPI, CE and IRQ.
pub struct Nrf24 {
    registers: Nrf24Registers,
    /// RX_DR, TX_DS and MAX_RT.
    raised: u8,
    /// The fields of OBSERVE_TX: packets lost, and retransmissions of the current packet.
    lost: u8,
    retries: u8,
    transmit: VecDeque<Outgoing>,
    receive: VecDeque<(usize, Vec<u8>)>,
    /// REUSE_TX_PL is active.
    reuses: bool,
    /// The command on SPI, while CSN is low.
    exchange: Option<Exchange>,
    has_clock: bool,
    /// The level of CE.
    enabled: bool,
    state: RadioState,
    /// Identifier of the packet that is sent, 0 to 3.
    id: u8,
    /// The last packet of each pipe, to drop repetitions.
    last: [Option<(u8, Vec<u8>)>; PIPES],
    /// The signals on the air that have not ended: channel, begin and end.
    carriers: Vec<(u8, Time, Time)>,
    /// Packets on their way to this radio; true if they arrive undamaged.
    arriving: Vec<(Transmission, bool)>,
    /// The value of RPD while the radio does not listen.
    power_detected: bool,
    /// A valid packet was received since CE went high.
    has_received: bool,
    power_detector: PowerDetector,
    transmissions: Vec<Transmission>,
    /// The end of the last transmission.
    transmissions_end: Time,
    /// The time of power-on.
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
    /// Creates a radio at the moment of its power-on.
    pub fn new() -> Self {
        Nrf24 {
            registers: Nrf24Registers::new(),
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

    /// Switches the radio's power off and on. Packets on the air and the counters are kept.
    pub fn restart(&mut self, now: Time) {
        let statistics = std::mem::take(&mut self.statistics);
        let carriers = std::mem::take(&mut self.carriers);
        let power_detector = self.power_detector;
        *self = Nrf24 { powered_at: now, carriers, statistics, power_detector, ..Nrf24::new() };
    }

    /// Selects the interpretation of RPD.
    pub fn set_power_detector(&mut self, power_detector: PowerDetector) {
        self.power_detector = power_detector;
    }

    /// Returns the level of pin IRQ: low while an unmasked flag is set.
    pub fn irq(&self) -> bool {
        self.raised & !self.registers.get(CONFIG) & INTERRUPTS == 0
    }

    /// Returns the packets that the radio begins to transmit soon. Each is announced 120 µs before
    /// its first bit.
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
