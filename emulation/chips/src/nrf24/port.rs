//! SPI: commands and their data (product specification, 8.3).

use super::registers::{
    FEATURE_EN_ACK_PAY, FEATURE_EN_DPL, FEATURE_EN_DYN_ACK, INTERRUPTS, PIPES, RF_CH, STATUS,
};
use super::{FIFO, Nrf24, Outgoing, PAYLOAD_MAX, POWER_ON};
use crate::Time;

const R_RX_PL_WID: u8 = 0x60;
const R_RX_PAYLOAD: u8 = 0x61;
const W_TX_PAYLOAD: u8 = 0xa0;
const W_ACK_PAYLOAD: u8 = 0xa8;
const W_TX_PAYLOAD_NOACK: u8 = 0xb0;
const FLUSH_TX: u8 = 0xe1;
const FLUSH_RX: u8 = 0xe2;
const REUSE_TX_PL: u8 = 0xe3;

/// The exchange since CSN went low.
#[derive(Default)]
pub struct Exchange {
    command: Option<u8>,
    data: Vec<u8>,
}

impl Nrf24 {
    /// Sets the level of CSN; `selected` is true for low.
    pub fn select(&mut self, selected: bool, now: Time) {
        if selected {
            self.exchange.get_or_insert_default();
            return;
        }
        if let Some(Exchange { command: Some(command), data }) = self.exchange.take() {
            self.finish(command, data, now);
        }
    }

    /// Exchanges a byte: eight clocks of SCK, the last of which is at `now`. Returns the byte on
    /// MISO.
    pub fn transfer(&mut self, byte: u8, now: Time) -> u8 {
        if now < self.powered_at + POWER_ON {
            self.statistics.too_early += u64::from(self.exchange.is_some());
            return 0;
        }
        let status = self.status();
        let Some(exchange) = &mut self.exchange else { return 0 };
        let Some(command) = exchange.command else {
            exchange.command = Some(byte);
            return status;
        };
        let index = exchange.data.len();
        exchange.data.push(byte);
        match command {
            0x00..=0x1f => self.read_register(command, index, now),
            0x20..=0x3f => {
                self.write_register(command & 0x1f, index, byte, now);
                0
            }
            R_RX_PL_WID => self.receive.front().map_or(0, |(_, bytes)| bytes.len() as u8),
            R_RX_PAYLOAD => {
                let front = self.receive.front();
                front.and_then(|(_, bytes)| bytes.get(index)).copied().unwrap_or(0)
            }
            _ => 0,
        }
    }

    fn write_register(&mut self, register: u8, index: usize, value: u8, now: Time) {
        if register == STATUS {
            self.raised &= !(value & INTERRUPTS);
            self.proceed(now);
            return;
        }
        if self.is_active() {
            self.statistics.written_while_active += 1;
        }
        if register == RF_CH {
            self.lost = 0;
        }
        self.registers.write(register, index, value);
        self.control(now);
    }

    /// Handles the end of a command, when CSN goes high. Commands that take effect as a whole are
    /// executed here.
    fn finish(&mut self, command: u8, mut data: Vec<u8>, now: Time) {
        data.truncate(PAYLOAD_MAX);
        match command {
            // A payload that was not read completely stays in the FIFO.
            R_RX_PAYLOAD => {
                self.receive.pop_front_if(|(_, bytes)| data.len() >= bytes.len());
            }
            W_TX_PAYLOAD => self.push(Outgoing::Payload { bytes: data, no_ack: false }),
            W_TX_PAYLOAD_NOACK if self.registers.has_feature(FEATURE_EN_DYN_ACK) => {
                self.push(Outgoing::Payload { bytes: data, no_ack: true });
            }
            W_ACK_PAYLOAD..=0xaf
                if self.registers.has_feature(FEATURE_EN_ACK_PAY)
                    && self.registers.has_feature(FEATURE_EN_DPL) =>
            {
                let pipe = usize::from(command & 7);
                if pipe < PIPES {
                    self.push(Outgoing::Acknowledgement { pipe, bytes: data, sent: false });
                }
            }
            FLUSH_TX => {
                self.transmit.clear();
                self.reuses = false;
            }
            FLUSH_RX => self.receive.clear(),
            REUSE_TX_PL => self.reuses = true,
            _ => {}
        }
        self.proceed(now);
    }

    /// Adds a payload to the transmit FIFO; a full FIFO ignores it.
    fn push(&mut self, outgoing: Outgoing) {
        if self.transmit.len() < FIFO {
            self.transmit.push_back(outgoing);
        }
        self.reuses = false;
    }
}
