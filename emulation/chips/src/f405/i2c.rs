//! I2C with separate status registers (RM0090 27), as a master with addresses of seven bits.
//!
//! The firmware drives every step: after each event the peripheral holds SCL low until the firmware
//! has answered it. The model is therefore a small state machine with at most one action on the
//! wire. It reports complete actions as [`BusAction`]s, which the connected devices answer.
//!
//! While a device holds SDA low, the master sends no start condition. Slave mode, SMBus, packet
//! error checking and the other faults of a real bus (lost arbitration, bus errors) have no model.

use crate::Time;
use crate::i2c_bus::{BusAction, BusRelease};
use crate::stm32::Write;

const CR1: u32 = 0x00;
const CR2: u32 = 0x04;
const OAR1: u32 = 0x08;
const OAR2: u32 = 0x0c;
const DR: u32 = 0x10;
const SR1: u32 = 0x14;
const SR2: u32 = 0x18;
const CCR: u32 = 0x1c;
const TRISE: u32 = 0x20;

const CR1_PE: u32 = 1 << 0;
/// SMBus, address resolution, packet error checking, general call and alert.
const CR1_UNMODELED: u32 = 1 << 1 | 1 << 4 | 1 << 5 | 1 << 6 | 1 << 12 | 1 << 13;
const CR1_START: u32 = 1 << 8;
const CR1_STOP: u32 = 1 << 9;
const CR1_ACK: u32 = 1 << 10;
const CR1_POS: u32 = 1 << 11;
const CR1_SWRST: u32 = 1 << 15;
const CR2_ITERREN: u32 = 1 << 8;
const CR2_ITEVTEN: u32 = 1 << 9;
const CR2_ITBUFEN: u32 = 1 << 10;
const CR2_DMAEN: u32 = 1 << 11;
const CR2_LAST: u32 = 1 << 12;
const SR1_SB: u32 = 1 << 0;
const SR1_ADDR: u32 = 1 << 1;
const SR1_BTF: u32 = 1 << 2;
const SR1_RXNE: u32 = 1 << 6;
const SR1_TXE: u32 = 1 << 7;
const SR1_AF: u32 = 1 << 10;
/// The flags that are cleared by writing 0: errors, time-out and alert.
const SR1_ERRORS: u32 = 0xdf00;
const SR2_MSL: u32 = 1 << 0;
const SR2_BUSY: u32 = 1 << 1;
const SR2_TRA: u32 = 1 << 2;
const CCR_DUTY: u32 = 1 << 14;
const CCR_FAST: u32 = 1 << 15;
/// The bits of a byte and its acknowledgement.
const BYTE_BITS: u64 = 9;

/// A part of a transfer on the wire.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Step {
    /// The start condition, before the firmware has given the address.
    StartCondition,
    /// An action that a device answers.
    Action(BusAction),
}

pub(crate) struct I2c {
    hz: u64,
    cr1: u32,
    cr2: u32,
    own_addresses: [u32; 2],
    ccr: u32,
    trise: u32,
    sr1: u32,
    /// The flags that the last read of SR1 has shown.
    shown: u32,
    is_master: bool,
    is_transmitter: bool,
    /// Requests of the firmware for a start and a stop condition. A request reads as 1 in CR1 until
    /// the condition was on the bus.
    wants_start: bool,
    wants_stop: bool,
    /// The data register, if it is full: the next byte to send, or the byte received.
    data: Option<u8>,
    /// A received byte in the shift register that waits for the data register.
    shift: Option<u8>,
    /// The device or the master has not acknowledged: only a stop or a start condition follows.
    is_ended: bool,
    /// The acknowledge bit of the byte in the shift register while POS is set.
    acknowledge_now: bool,
    /// The DMA controller has only one more byte to move (27.3.7, EOT_1).
    is_last_by_dma: bool,
    /// The part of a transfer on the wire, and the time when it is complete.
    busy: Option<(Time, Step)>,
    /// True while a device holds SDA low outside of a transfer.
    is_held: bool,
    /// The state of the bus when the firmware or a reset let it go.
    released: Option<BusRelease>,
}

impl I2c {
    pub fn new(hz: u64) -> Self {
        I2c {
            hz,
            cr1: 0,
            cr2: 0,
            own_addresses: [0; 2],
            ccr: 0,
            trise: 2,
            sr1: 0,
            shown: 0,
            is_master: false,
            is_transmitter: false,
            wants_start: false,
            wants_stop: false,
            data: None,
            shift: None,
            is_ended: false,
            acknowledge_now: false,
            is_last_by_dma: false,
            busy: None,
            is_held: false,
            released: None,
        }
    }

    /// Sets the registers to their reset values. A transfer ends where it is.
    pub fn reset(&mut self, now: Time) {
        self.release(now);
        *self = I2c { is_held: self.is_held, released: self.released, ..I2c::new(self.hz) };
    }

    fn release(&mut self, now: Time) {
        if self.is_master {
            let action = self.busy.and_then(|(end, step)| match step {
                Step::Action(action) => {
                    let left = (end - now).picos();
                    Some((action, left.div_ceil(self.bits(1).picos().max(1))))
                }
                Step::StartCondition => None,
            });
            self.released = Some(BusRelease(action));
        }
    }

    /// Returns the state of the bus if the firmware or a reset has let it go since the last call.
    pub fn take_release(&mut self) -> Option<BusRelease> {
        self.released.take()
    }

    pub fn set_clock(&mut self, hz: u64) {
        self.hz = hz;
    }

    /// Sets if a device holds SDA low. A start condition that waits for the bus is sent once it is
    /// free.
    pub fn set_held(&mut self, is_held: bool, now: Time) {
        self.is_held = is_held;
        self.proceed(now);
    }

    fn is_on(&self) -> bool {
        self.cr1 & CR1_PE != 0
    }

    /// Returns the duration of `bits` periods of SCL (27.6.8): 2 * CCR cycles of the clock in
    /// standard mode, 3 or 25 in fast mode.
    fn bits(&self, bits: u64) -> Time {
        let cycles = match self.ccr & (CCR_FAST | CCR_DUTY) {
            CCR_FAST => 3,
            both if both == CCR_FAST | CCR_DUTY => 25,
            _ => 2,
        };
        Time::of_ticks(bits * cycles * u64::from(self.ccr & 0xfff), self.hz)
    }

    pub fn next_event(&self) -> Option<Time> {
        self.busy.map(|(end, _)| end)
    }

    /// Completes what is on the wire at `now`. The answer to a returned action is
    /// [`Self::acknowledge`] or [`Self::receive`].
    pub fn advance(&mut self, now: Time) -> Option<(Time, BusAction)> {
        let (end, step) = self.busy.take_if(|(end, _)| *end <= now)?;
        match step {
            Step::StartCondition => {
                self.wants_start = false;
                self.is_master = true;
                if std::mem::take(&mut self.is_transmitter) {
                    self.data = None;
                }
                self.is_ended = true;
                self.sr1 = self.sr1 & !(SR1_BTF | SR1_TXE) | SR1_SB;
                self.proceed(end);
                None
            }
            Step::Action(BusAction::Stop) => {
                self.wants_stop = false;
                self.is_master = false;
                if std::mem::take(&mut self.is_transmitter) {
                    self.data = None;
                }
                self.sr1 &= !(SR1_SB | SR1_BTF | SR1_TXE);
                self.proceed(end);
                Some((end, BusAction::Stop))
            }
            Step::Action(action) => Some((end, action)),
        }
    }

    fn begin(&mut self, step: Step, bits: u64, now: Time) {
        self.busy = Some((now + self.bits(bits), step));
    }

    /// Begins the next part of the transfer, if the wire and the firmware allow it.
    fn proceed(&mut self, now: Time) {
        // The firmware must read SR1 and SR2 before anything follows the address.
        if self.busy.is_some() || !self.is_on() || self.sr1 & SR1_ADDR != 0 {
            return;
        }
        if self.is_master {
            let receives = !self.is_transmitter && !self.is_ended;
            // A stop or repeated start follows the byte that is received (27.6.1, STOP).
            let owes_byte = receives && self.data.is_none();
            if self.wants_stop && !owes_byte {
                self.begin(Step::Action(BusAction::Stop), 1, now);
            } else if self.wants_start && !owes_byte {
                self.begin(Step::StartCondition, 1, now);
            } else if receives && self.shift.is_none() {
                self.begin(Step::Action(BusAction::Read), BYTE_BITS, now);
            } else if self.is_transmitter
                && !self.is_ended
                && let Some(byte) = self.data.take()
            {
                self.sr1 = self.sr1 & !SR1_BTF | SR1_TXE;
                self.begin(Step::Action(BusAction::Write(byte)), BYTE_BITS, now);
            }
        } else if self.wants_start && !self.is_held {
            self.begin(Step::StartCondition, 1, now);
        }
    }

    /// Handles the answer to an address or a byte.
    pub fn acknowledge(&mut self, action: BusAction, acknowledged: bool, now: Time) {
        match action {
            _ if !acknowledged => {
                self.sr1 |= SR1_AF;
                self.is_ended = true;
            }
            BusAction::Start { read, .. } => {
                self.sr1 |= SR1_ADDR;
                self.is_transmitter = !read;
                self.is_ended = false;
                self.is_last_by_dma = false;
                self.acknowledge_now = self.cr1 & CR1_ACK != 0;
                if !read {
                    // Bytes that nobody has read make room for those to send.
                    (self.data, self.shift) = (None, None);
                    self.sr1 &= !SR1_RXNE;
                }
            }
            _ if self.data.is_none() => self.sr1 |= SR1_BTF,
            _ => {}
        }
        self.proceed(now);
    }

    /// Handles the byte that the device sent.
    pub fn receive(&mut self, byte: u8, now: Time) {
        let follows = self.cr1 & CR1_ACK != 0;
        // With POS the bit ACK is for the byte after this one (27.6.1).
        let acknowledged = if self.cr1 & CR1_POS != 0 {
            std::mem::replace(&mut self.acknowledge_now, follows)
        } else {
            follows
        };
        let is_last = self.is_last_by_dma && self.cr2 & CR2_LAST != 0;
        self.is_ended = !acknowledged || is_last;
        if self.data.is_none() {
            self.data = Some(byte);
            self.sr1 |= SR1_RXNE;
        } else {
            self.shift = Some(byte);
            self.sr1 |= SR1_BTF;
        }
        self.proceed(now);
    }

    /// Called when the DMA controller has moved all bytes but the last one.
    pub fn expect_last(&mut self) {
        self.is_last_by_dma = true;
    }

    /// Returns the levels of the two interrupt lines: events and errors (27.4).
    pub fn interrupts(&self) -> [bool; 2] {
        let buffer = if self.cr2 & CR2_ITBUFEN != 0 { SR1_RXNE | SR1_TXE } else { 0 };
        let events = SR1_SB | SR1_ADDR | SR1_BTF | buffer;
        [
            self.cr2 & CR2_ITEVTEN != 0 && self.sr1 & events != 0,
            self.cr2 & CR2_ITERREN != 0 && self.sr1 & SR1_ERRORS != 0,
        ]
    }

    /// Returns the requests for DMA transfers: to the I2C, and from it.
    pub fn dma_requests(&self) -> [bool; 2] {
        let is_on = self.cr2 & CR2_DMAEN != 0;
        [is_on && self.sr1 & SR1_TXE != 0, is_on && self.sr1 & SR1_RXNE != 0]
    }

    pub fn read(&mut self, offset: u32, now: Time) -> u32 {
        match offset {
            CR1 => {
                let bit = |is_set, bit| if is_set { bit } else { 0 };
                self.cr1 | bit(self.wants_start, CR1_START) | bit(self.wants_stop, CR1_STOP)
            }
            CR2 => self.cr2,
            OAR1 => self.own_addresses[0],
            OAR2 => self.own_addresses[1],
            DR => self.read_data(now),
            SR1 => {
                self.shown = self.sr1;
                self.sr1
            }
            SR2 => {
                let status = self.status_2();
                if self.shown & self.sr1 & SR1_ADDR != 0 {
                    self.sr1 &= !SR1_ADDR;
                    if self.is_transmitter {
                        self.sr1 |= SR1_TXE;
                    }
                    self.proceed(now);
                }
                status
            }
            CCR => self.ccr,
            TRISE => self.trise,
            _ => 0,
        }
    }

    fn status_2(&self) -> u32 {
        let is_busy = self.is_master || self.is_held || self.busy.is_some();
        [(self.is_master, SR2_MSL), (is_busy, SR2_BUSY), (self.is_transmitter, SR2_TRA)]
            .into_iter()
            .filter(|(is_set, _)| *is_set)
            .fold(0, |status, (_, bit)| status | bit)
    }

    fn read_data(&mut self, now: Time) -> u32 {
        if self.sr1 & SR1_RXNE == 0 {
            // Also in a transmitter a read of DR after one of SR1 clears BTF (27.6.6).
            if self.shown & SR1_BTF != 0 {
                self.sr1 &= !SR1_BTF;
            }
            return u32::from(self.data.unwrap_or(0));
        }
        let byte = self.data.take();
        self.data = self.shift.take();
        self.sr1 &= !SR1_BTF;
        if self.data.is_none() {
            self.sr1 &= !SR1_RXNE;
        }
        self.proceed(now);
        u32::from(byte.unwrap_or(0))
    }

    fn write_data(&mut self, byte: u8, now: Time) {
        if self.sr1 & SR1_SB != 0 {
            // SB is cleared by reading SR1 and then writing DR (27.6.6).
            if self.shown & SR1_SB != 0 {
                self.sr1 &= !SR1_SB;
                let start = BusAction::Start { address: byte >> 1, read: byte & 1 != 0 };
                self.begin(Step::Action(start), BYTE_BITS, now);
            }
        } else if self.is_master && self.is_transmitter {
            self.data = Some(byte);
            self.sr1 &= !(SR1_TXE | SR1_BTF);
            self.proceed(now);
        }
    }

    /// Writes a register; returns false if that enables a function without a model.
    pub fn write(&mut self, offset: u32, write: Write, now: Time) -> bool {
        match offset {
            CR1 => {
                let new = write.merge(self.read(CR1, now));
                if new & CR1_SWRST != 0 {
                    self.reset(now);
                    self.cr1 = CR1_SWRST;
                    return true;
                }
                self.cr1 = new & !(CR1_START | CR1_STOP);
                if !self.is_on() {
                    self.release(now);
                    self.turn_off();
                    return true;
                }
                // A condition that is on the wire already cannot be taken back.
                let on_wire = self.busy.map(|(_, step)| step);
                let starts = on_wire == Some(Step::StartCondition);
                let stops = on_wire == Some(Step::Action(BusAction::Stop));
                self.wants_start = starts || new & CR1_START != 0;
                self.wants_stop = stops || (self.is_master || starts) && new & CR1_STOP != 0;
                self.proceed(now);
                return new & CR1_UNMODELED == 0;
            }
            CR2 => self.cr2 = write.merge(self.cr2) & 0x1fff,
            OAR1 => self.own_addresses[0] = write.merge(self.own_addresses[0]),
            OAR2 => self.own_addresses[1] = write.merge(self.own_addresses[1]),
            DR => self.write_data(write.ones() as u8, now),
            SR1 => self.sr1 &= !(write.zeros() & SR1_ERRORS),
            CCR => self.ccr = write.merge(self.ccr),
            TRISE => self.trise = write.merge(self.trise),
            _ => {}
        }
        true
    }

    /// Clears the flags and the state machine, as clearing PE does (27.6.1).
    fn turn_off(&mut self) {
        *self = I2c {
            cr1: self.cr1 & !CR1_ACK,
            cr2: self.cr2,
            own_addresses: self.own_addresses,
            ccr: self.ccr,
            trise: self.trise,
            is_held: self.is_held,
            released: self.released,
            ..I2c::new(self.hz)
        };
    }
}

#[cfg(test)]
#[path = "i2c_tests.rs"]
mod tests;
