//! The nRF24L01+ on SPI1 and two pins, with the functions that broadcasts need. Sections are those
//! of its product specification 1.0.
//!
//! The driver is written for this robot. The crate rf24-rs 0.3.1 takes 2.4 kB of flash, which is
//! three times as much and more than is free, and it blocks all tasks until the end of a
//! transmission. Here a task waits for that end. Only an SPI transfer of at most 33 bytes blocks,
//! since it takes 44 µs.
//!
//! Such a transfer writes each byte to the registers before the previous one has arrived. `Spi` of
//! embassy-stm32 0.6.0 waits for each byte: receiving eight messages then takes 56,200 cycles
//! instead of 36,200, and 0.7 kB more.

use bittybuzz_comms::nrf24::{ADDRESS, CHANNEL, PAYLOAD_MAX};
use embassy_stm32::Peri;
use embassy_stm32::gpio::{Level, Output, Speed};
use embassy_stm32::pac::SPI1;
use embassy_stm32::pac::spi::vals::{Br, Ds, Frxth, Mstr};
use embassy_stm32::peripherals::{PA4, PB0};
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use embassy_time::{Duration, Instant, Timer, with_timeout};

/// Signaled when the radio's interrupt line goes low.
pub static IRQ: Signal<CriticalSectionRawMutex, ()> = Signal::new();

// Commands (8.3.1).
const W_REGISTER: u8 = 0x20;
const R_RX_PL_WID: u8 = 0x60;
const R_RX_PAYLOAD: u8 = 0x61;
const W_TX_PAYLOAD_NOACK: u8 = 0xb0;
const FLUSH_TX: u8 = 0xe1;
const FLUSH_RX: u8 = 0xe2;

// Registers (9.1).
const CONFIG: u8 = 0x00;
const EN_AA: u8 = 0x01;
const EN_RXADDR: u8 = 0x02;
const SETUP_AW: u8 = 0x03;
const SETUP_RETR: u8 = 0x04;
const RF_CH: u8 = 0x05;
const RF_SETUP: u8 = 0x06;
const STATUS: u8 = 0x07;
const RPD: u8 = 0x09;
const RX_ADDR_P0: u8 = 0x0a;
const TX_ADDR: u8 = 0x10;
const DYNPD: u8 = 0x1c;
const FEATURE: u8 = 0x1d;

/// CONFIG of the powered-down radio, with a checksum of two bytes.
const ASLEEP: u8 = 0b0000_1100;
/// CONFIG of the radio that sends or is in standby.
const SENDER: u8 = ASLEEP | 0b10;
/// CONFIG of the radio that receives.
const RECEIVER: u8 = SENDER | 0b1;

/// The value in the status, in place of a pipe number, if nothing was received.
const RX_NONE: u8 = 0b1110;
const RX_DR: u8 = 1 << 6;
const TX_DS: u8 = 1 << 5;

/// The values of all registers that differ from those after power-on (9.1), or that may have been
/// changed before a reset of this processor alone.
const SETUP: [(u8, u8); 9] = [
    (CONFIG, ASLEEP),
    // Only pipe 0 is used. Payloads can have dynamic length only with acknowledgements enabled,
    // although the sender requests none.
    (EN_AA, 1),
    (EN_RXADDR, 1),
    (SETUP_AW, ADDRESS.len() as u8 - 2),
    (SETUP_RETR, 0),
    (RF_CH, CHANNEL),
    // 2 Mbit/s at 0 dBm.
    (RF_SETUP, 0b0000_1110),
    (DYNPD, 1),
    // EN_DPL, EN_DYN_ACK
    (FEATURE, 0b101),
];

/// The time after power-on before the radio answers (6.1.7, table 16).
const POWER_ON: Duration = Duration::from_millis(100);
/// The time from power-down to standby, with a large margin for the external clock (table 16).
const START_UP: Duration = Duration::from_millis(5);
/// The time from standby to a valid RPD: 130 µs to settle and 40 µs of signal (6.4), and a margin
/// for the clock.
const DETECTION: Duration = Duration::from_micros(180);
/// The timeout of a transmission. A payload takes 130 µs to start and 0.2 ms on the air.
const SENT: Duration = Duration::from_millis(2);

/// The radio.
pub struct Nrf24 {
    /// The chip select line; low selects the radio.
    csn: Output<'static>,
    /// The radio sends or receives while this is high.
    ce: Output<'static>,
}

impl Nrf24 {
    /// Sets SPI up. The state of the radio does not change.
    pub fn new(csn: Peri<'static, PA4>, ce: Peri<'static, PB0>) -> Self {
        // SPI mode 0 with bytes, the most significant bit first (RM0091 28.9). The clock is an
        // eighth of 48 MHz; the radio allows 10 MHz (table 20).
        SPI1.cr2().write(|w| {
            w.set_ds(Ds::BITS8);
            w.set_frxth(Frxth::QUARTER);
        });
        SPI1.cr1().write(|w| {
            w.set_mstr(Mstr::MASTER);
            w.set_br(Br::DIV8);
            w.set_ssm(true);
            w.set_ssi(true);
            w.set_spe(true);
        });
        Nrf24 {
            csn: Output::new(csn, Level::High, Speed::Low),
            ce: Output::new(ce, Level::Low, Speed::Low),
        }
    }

    /// Sets the radio up and starts to receive.
    pub async fn start(&mut self) {
        Timer::at(Instant::MIN + POWER_ON).await;
        self.ce.set_low();
        for (register, value) in SETUP {
            self.write(register, &[value]);
        }
        self.write(RX_ADDR_P0, &ADDRESS);
        self.write(TX_ADDR, &ADDRESS);
        self.command(FLUSH_TX);
        self.command(FLUSH_RX);
        self.write(STATUS, &[RX_DR | TX_DS]);
        self.write(CONFIG, &[SENDER]);
        Timer::after(START_UP).await;
        self.listen();
    }

    /// Powers the radio down.
    pub fn sleep(&mut self) {
        self.ce.set_low();
        self.write(CONFIG, &[ASLEEP]);
    }

    fn listen(&mut self) {
        self.write(CONFIG, &[RECEIVER]);
        self.ce.set_high();
    }

    /// Clears the cause of the interrupt. Call this function before the payload is read, so that a
    /// later payload pulls the line low again.
    pub fn acknowledge(&mut self) {
        self.write(STATUS, &[RX_DR]);
    }

    /// Copies the oldest received payload and returns its length.
    pub fn receive(&mut self, payload: &mut [u8; PAYLOAD_MAX]) -> Option<usize> {
        let mut length = [0];
        if self.transfer(R_RX_PL_WID, &mut length) & RX_NONE == RX_NONE {
            return None;
        }
        let [length] = length;
        let Some(room) = payload.get_mut(..length.into()) else {
            // The payload is damaged, and the specification requires a flush (8.3.1).
            self.command(FLUSH_RX);
            return Some(0);
        };
        self.transfer(R_RX_PAYLOAD, room);
        Some(length.into())
    }

    /// Returns true if another sender uses the channel: more than -64 dBm for 40 µs (6.4).
    ///
    /// A received packet latches RPD, and the specification does not state for how long while CE
    /// stays high. Therefore CE goes low before each check.
    pub async fn is_busy(&mut self) -> bool {
        self.ce.set_low();
        self.listen();
        Timer::after(DETECTION).await;
        self.read(RPD) & 1 != 0
    }

    /// Sends a payload to all receivers. Payloads that arrive meanwhile are lost.
    pub async fn send(&mut self, payload: &mut [u8]) {
        self.ce.set_low();
        self.write(CONFIG, &[SENDER]);
        self.transfer(W_TX_PAYLOAD_NOACK, payload);
        // A payload that arrived just before waits in the FIFO. Its interrupt is cleared, because
        // no edge occurs while it holds the line low.
        self.write(STATUS, &[RX_DR]);
        IRQ.reset();
        self.ce.set_high();
        if with_timeout(SENT, IRQ.wait()).await.is_err() {
            self.command(FLUSH_TX);
        }
        self.ce.set_low();
        self.write(STATUS, &[TX_DS]);
        self.listen();
    }

    /// Reads a register, or the reply to a command.
    fn read(&mut self, command: u8) -> u8 {
        let mut value = [0];
        self.transfer(command, &mut value);
        let [value] = value;
        value
    }

    fn write(&mut self, register: u8, value: &[u8]) {
        let mut bytes = [0; ADDRESS.len()];
        bytes.iter_mut().zip(value).for_each(|(to, from)| *to = *from);
        if let Some(bytes) = bytes.get_mut(..value.len()) {
            self.transfer(W_REGISTER | register, bytes);
        }
    }

    fn command(&mut self, command: u8) {
        self.transfer(command, &mut []);
    }

    /// Sends a command and exchanges bytes. Returns the status, which is the radio's first byte
    /// (8.3.1).
    fn transfer(&mut self, command: u8, bytes: &mut [u8]) -> u8 {
        self.csn.set_low();
        SPI1.dr8().write_value(command);
        let mut answer = 0;
        let mut place = &mut answer;
        for byte in bytes.iter_mut() {
            // The next byte is written one byte ahead, so that the bus never pauses.
            SPI1.dr8().write_value(*byte);
            *place = answered();
            place = byte;
        }
        *place = answered();
        self.csn.set_high();
        answer
    }
}

/// Waits for the next received byte.
fn answered() -> u8 {
    while !SPI1.sr().read().rxne() {}
    SPI1.dr8().read()
}
