//! I2C with a timing register (RM0091 26), as a master with addresses of seven bits.
//!
//! The model reports its actions on the bus as [`BusAction`]s, which the connected device answers.
//! While a device holds SDA low, the master sends no start condition. Slave mode, SMBus, and the
//! other faults of a real bus (lost arbitration, bus errors) have no model.

use crate::Time;
use crate::i2c_bus::{BusAction, BusRelease};
use crate::stm32::Write;

const CR1: u32 = 0x00;
const CR2: u32 = 0x04;
const TIMINGR: u32 = 0x10;
const ISR: u32 = 0x18;
const ICR: u32 = 0x1c;
const RXDR: u32 = 0x24;
const TXDR: u32 = 0x28;
const REGISTERS: usize = TXDR as usize / 4 + 1;

const CR1_PE: u32 = 1 << 0;
/// The interrupt enable bits TXIE to ERRIE.
const CR1_INTERRUPTS: u32 = 0xfe;
const CR1_TXDMAEN: u32 = 1 << 14;
const CR1_RXDMAEN: u32 = 1 << 15;
const CR2_RD_WRN: u32 = 1 << 10;
const CR2_ADD10: u32 = 1 << 11;
const CR2_START: u32 = 1 << 13;
const CR2_STOP: u32 = 1 << 14;
const CR2_NBYTES: u32 = 0xff << 16;
const CR2_RELOAD: u32 = 1 << 24;
const CR2_AUTOEND: u32 = 1 << 25;
const ISR_TXE: u32 = 1 << 0;
const ISR_TXIS: u32 = 1 << 1;
const ISR_RXNE: u32 = 1 << 2;
const ISR_NACKF: u32 = 1 << 4;
const ISR_STOPF: u32 = 1 << 5;
const ISR_TC: u32 = 1 << 6;
const ISR_TCR: u32 = 1 << 7;
const ISR_BUSY: u32 = 1 << 15;
/// The bits of a byte and its acknowledgement.
const BYTE_BITS: u64 = 9;

pub(crate) struct I2c {
    hz: u64,
    registers: [u32; REGISTERS],
    isr: u32,
    received: u8,
    /// The bytes left in this transfer, until RELOAD or the end.
    left: u32,
    reading: bool,
    /// The action on the wire, and the time when it is complete.
    busy: Option<(Time, BusAction)>,
    /// True while a device holds SDA low outside of a transfer.
    is_held: bool,
}

impl I2c {
    pub fn new(hz: u64) -> Self {
        I2c {
            hz,
            registers: [0; REGISTERS],
            isr: ISR_TXE,
            received: 0,
            left: 0,
            reading: false,
            busy: None,
            is_held: false,
        }
    }

    /// Sets if a device holds SDA low. A start condition that waits for the bus is sent once it is
    /// free.
    pub fn set_held(&mut self, is_held: bool, now: Time) {
        self.is_held = is_held;
        if !is_held && self.busy.is_none() && self.register(CR2) & CR2_START != 0 {
            self.start(now);
        }
    }

    /// Returns what is on the wire if the master lets the bus go now.
    pub fn release(&self, now: Time) -> BusRelease {
        BusRelease(self.busy.map(|(end, action)| {
            let left = end.picos().saturating_sub(now.picos());
            (action, left.div_ceil(self.bits(1).picos().max(1)))
        }))
    }

    /// Returns true if the peripheral is on.
    pub fn is_on(&self) -> bool {
        self.register(CR1) & CR1_PE != 0
    }

    pub fn set_clock(&mut self, hz: u64) {
        self.hz = hz;
    }

    fn register(&self, offset: u32) -> u32 {
        self.registers[offset as usize / 4]
    }

    /// Returns the duration of `bits` periods of SCL. A period is (SCLL + 1 + SCLH + 1) * (PRESC +
    /// 1) cycles of the clock, without the edges (26.4.8).
    fn bits(&self, bits: u64) -> Time {
        let timing = u64::from(self.register(TIMINGR));
        let cycles = ((timing & 0xff) + 1 + (timing >> 8 & 0xff) + 1) * ((timing >> 28) + 1);
        Time::of_ticks(bits * cycles, self.hz)
    }

    fn begin(&mut self, action: BusAction, bits: u64, now: Time) {
        self.busy = Some((now + self.bits(bits), action));
    }

    pub fn next_event(&self) -> Option<Time> {
        self.busy.map(|(end, _)| end)
    }

    /// Returns the action that is complete at `now`; the answer is [`Self::acknowledge`] or
    /// [`Self::receive`].
    pub fn advance(&mut self, now: Time) -> Option<(Time, BusAction)> {
        let (end, action) = self.busy.take_if(|(end, _)| *end <= now)?;
        if action == BusAction::Stop {
            self.isr = self.isr & !(ISR_BUSY | ISR_TC | ISR_TCR | ISR_TXIS) | ISR_STOPF;
            self.registers[CR2 as usize / 4] &= !CR2_STOP;
        }
        Some((end, action))
    }

    /// Handles the answer to a start or a byte.
    pub fn acknowledge(&mut self, acknowledged: bool, now: Time) {
        self.registers[CR2 as usize / 4] &= !CR2_START;
        if !acknowledged {
            self.isr |= ISR_NACKF;
            if self.register(CR2) & CR2_AUTOEND != 0 {
                self.begin(BusAction::Stop, 1, now);
            } else {
                self.isr |= ISR_TC;
            }
            return;
        }
        self.proceed(now);
    }

    /// Handles the byte that the device sent.
    pub fn receive(&mut self, byte: u8, now: Time) {
        self.received = byte;
        self.isr |= ISR_RXNE;
        self.left -= 1;
        if self.left == 0 {
            self.finish(now);
        }
    }

    /// Begins the next byte, or the action after the last one.
    fn proceed(&mut self, now: Time) {
        if self.left == 0 {
            self.finish(now);
        } else if !self.reading {
            self.isr |= ISR_TXIS;
        } else if self.isr & ISR_RXNE == 0 {
            self.begin(BusAction::Read, BYTE_BITS, now);
        }
    }

    fn finish(&mut self, now: Time) {
        let cr2 = self.register(CR2);
        if cr2 & CR2_RELOAD != 0 {
            self.isr |= ISR_TCR;
        } else if cr2 & CR2_AUTOEND != 0 {
            self.begin(BusAction::Stop, 1, now);
        } else {
            self.isr |= ISR_TC;
        }
    }

    pub fn interrupt(&self) -> bool {
        let cr1 = self.register(CR1);
        // TXIE, RXIE, ADDRIE, NACKIE and STOPIE have the positions of their flags; TCIE enables two
        // flags.
        let transfer = if cr1 & ISR_TC != 0 { ISR_TC | ISR_TCR } else { 0 };
        let enabled = cr1 & (ISR_TXIS | ISR_RXNE | ISR_NACKF | ISR_STOPF) | transfer;
        self.isr & enabled != 0
    }

    /// Returns true if the I2C may cause interrupts or DMA transfers.
    pub fn is_watched(&self) -> bool {
        self.register(CR1) & (CR1_INTERRUPTS | CR1_TXDMAEN | CR1_RXDMAEN) != 0
    }

    /// Returns the requests for DMA transfers: to the I2C, and from it.
    pub fn dma_requests(&self) -> [bool; 2] {
        let cr1 = self.register(CR1);
        [
            cr1 & CR1_TXDMAEN != 0 && self.isr & ISR_TXIS != 0,
            cr1 & CR1_RXDMAEN != 0 && self.isr & ISR_RXNE != 0,
        ]
    }

    pub fn read(&mut self, offset: u32, now: Time) -> u32 {
        match offset {
            ISR => self.isr,
            RXDR => {
                let was_full = self.isr & ISR_RXNE != 0;
                self.isr &= !ISR_RXNE;
                // SCL was held low until RXDR had been read.
                if was_full && self.left > 0 && self.busy.is_none() {
                    self.begin(BusAction::Read, BYTE_BITS, now);
                }
                u32::from(self.received)
            }
            _ => self.registers.get(offset as usize / 4).copied().unwrap_or(0),
        }
    }

    /// Writes a register; returns false if that enables a function without a model.
    pub fn write(&mut self, offset: u32, write: Write, now: Time) -> bool {
        match offset {
            CR1 => {
                self.registers[0] = write.merge(self.registers[0]);
                if !self.is_on() {
                    // Without PE the state machine and the flags are as after a reset (26.4.5).
                    self.isr = ISR_TXE;
                    self.busy = None;
                    self.left = 0;
                    self.registers[CR2 as usize / 4] &= !(CR2_START | CR2_STOP);
                }
            }
            CR2 => {
                let old = self.register(CR2);
                // The program sets START and STOP, and the bus clears them.
                let new = write.merge(old) | old & (CR2_START | CR2_STOP);
                self.registers[CR2 as usize / 4] = new;
                return self.control(old, new, now) && new & CR2_ADD10 == 0;
            }
            ICR => self.isr &= !(write.ones() & (ISR_NACKF | ISR_STOPF)),
            ISR => self.isr |= write.ones() & ISR_TXE,
            TXDR if self.isr & ISR_TXIS != 0 => {
                self.isr &= !ISR_TXIS;
                self.left -= 1;
                self.begin(BusAction::Write(write.ones() as u8), BYTE_BITS, now);
            }
            _ => {
                if let Some(register) = self.registers.get_mut(offset as usize / 4) {
                    *register = write.merge(*register);
                }
            }
        }
        true
    }

    fn start(&mut self, now: Time) {
        let cr2 = self.register(CR2);
        self.left = (cr2 & CR2_NBYTES) >> 16;
        self.reading = cr2 & CR2_RD_WRN != 0;
        self.isr = self.isr & !(ISR_TC | ISR_TCR) | ISR_BUSY;
        let address = (cr2 >> 1 & 0x7f) as u8;
        // The start condition, and the address.
        self.begin(BusAction::Start { address, read: self.reading }, 1 + BYTE_BITS, now);
    }

    fn control(&mut self, old: u32, new: u32, now: Time) -> bool {
        if !self.is_on() {
            return true;
        }
        let risen = new & !old;
        if risen & CR2_START != 0 {
            if !self.is_held {
                self.start(now);
            }
        } else if risen & CR2_STOP != 0 && self.isr & ISR_BUSY != 0 {
            self.begin(BusAction::Stop, 1, now);
        } else if self.isr & ISR_TCR != 0 && new & CR2_NBYTES != 0 {
            // Writing NBYTES clears TCR, and the transfer goes on (26.4.6).
            self.isr &= !ISR_TCR;
            self.left = (new & CR2_NBYTES) >> 16;
            self.proceed(now);
        }
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Width;

    fn write(i2c: &mut I2c, offset: u32, value: u32, now: Time) {
        assert!(i2c.write(offset, Write::new(offset, Width::Word, value), now));
    }

    /// An enabled I2C at 48 MHz / 480 = 100 kHz.
    fn i2c() -> I2c {
        let mut i2c = I2c::new(48_000_000);
        write(&mut i2c, TIMINGR, 1 << 28 | 119 << 8 | 119, Time::ZERO);
        write(&mut i2c, CR1, CR1_PE, Time::ZERO);
        i2c
    }

    /// Returns the next action, and the time at which it is complete.
    fn next(i2c: &mut I2c) -> (Time, BusAction) {
        let at = i2c.next_event().expect("something is on the wire");
        i2c.advance(at).unwrap()
    }

    #[test]
    fn writes_a_register_and_reads_from_it() {
        let mut i2c = i2c();
        let cr2 = 0x1b << 1 | 1 << 16 | CR2_START;
        write(&mut i2c, CR2, cr2, Time::ZERO);
        let (now, action) = next(&mut i2c);
        assert_eq!(now, Time::from_micros(100));
        assert_eq!(action, BusAction::Start { address: 0x1b, read: false });
        i2c.acknowledge(true, now);
        assert_eq!(i2c.read(ISR, now), ISR_BUSY | ISR_TXIS | ISR_TXE);
        write(&mut i2c, TXDR, 0x02, now);
        let (now, action) = next(&mut i2c);
        assert_eq!((now, action), (Time::from_micros(190), BusAction::Write(2)));
        i2c.acknowledge(true, now);
        assert_eq!(i2c.read(ISR, now), ISR_BUSY | ISR_TC | ISR_TXE);
        // A repeated start.
        let cr2 = 0x1b << 1 | 2 << 16 | CR2_RD_WRN | CR2_AUTOEND | CR2_START;
        write(&mut i2c, CR2, cr2, now);
        let (now, _) = next(&mut i2c);
        i2c.acknowledge(true, now);
        for byte in [0x12, 0x34] {
            let (now, action) = next(&mut i2c);
            assert_eq!(action, BusAction::Read);
            i2c.receive(byte, now);
            assert_ne!(i2c.read(ISR, now) & ISR_RXNE, 0);
            assert_eq!(i2c.read(RXDR, now), u32::from(byte));
        }
        let (now, action) = next(&mut i2c);
        assert_eq!(action, BusAction::Stop);
        assert_eq!(i2c.read(ISR, now), ISR_STOPF | ISR_TXE);
        write(&mut i2c, ICR, ISR_STOPF, now);
        assert_eq!(i2c.read(ISR, now), ISR_TXE);
    }

    #[test]
    fn requests_without_device_are_not_acknowledged() {
        let mut i2c = i2c();
        write(&mut i2c, CR2, 0x42 << 1 | 1 << 16 | CR2_AUTOEND | CR2_START, Time::ZERO);
        let (now, _) = next(&mut i2c);
        i2c.acknowledge(false, now);
        assert_ne!(i2c.read(ISR, now) & ISR_NACKF, 0);
        assert_eq!(next(&mut i2c).1, BusAction::Stop);
    }

    #[test]
    fn an_unread_byte_holds_the_clock() {
        let mut i2c = i2c();
        let cr2 = 0x1b << 1 | 2 << 16 | CR2_RD_WRN | CR2_AUTOEND | CR2_START;
        write(&mut i2c, CR2, cr2, Time::ZERO);
        let (now, _) = next(&mut i2c);
        i2c.acknowledge(true, now);
        let (now, _) = next(&mut i2c);
        i2c.receive(1, now);
        assert_eq!(i2c.next_event(), None);
        let later = now + Time::from_millis(1);
        i2c.read(RXDR, later);
        assert_eq!(i2c.next_event(), Some(later + Time::from_micros(90)));
    }

    #[test]
    fn a_start_waits_until_the_bus_is_free() {
        let mut i2c = i2c();
        i2c.set_held(true, Time::ZERO);
        write(&mut i2c, CR2, 0x1b << 1 | 1 << 16 | CR2_START, Time::ZERO);
        assert_eq!((i2c.next_event(), i2c.read(CR2, Time::ZERO) & CR2_START), (None, CR2_START));
        // A second of waiting, then a start condition and an address of ten bits.
        let later = Time::from_millis(1000);
        i2c.set_held(false, later);
        assert_eq!(i2c.next_event(), Some(later + Time::from_micros(100)));
        // Bits of 10 us, of which the fifth is not complete.
        let action = BusAction::Start { address: 0x1b, read: false };
        assert_eq!(i2c.release(later + Time::from_micros(41)), BusRelease(Some((action, 6))));
    }

    #[test]
    fn a_long_transfer_is_reloaded() {
        let mut i2c = i2c();
        write(&mut i2c, CR2, 0x1b << 1 | 1 << 16 | CR2_RELOAD | CR2_START, Time::ZERO);
        let (now, _) = next(&mut i2c);
        i2c.acknowledge(true, now);
        write(&mut i2c, TXDR, 1, now);
        let (now, _) = next(&mut i2c);
        i2c.acknowledge(true, now);
        assert_ne!(i2c.read(ISR, now) & ISR_TCR, 0);
        write(&mut i2c, CR2, 0x1b << 1 | 1 << 16 | CR2_AUTOEND, now);
        assert_eq!(i2c.read(ISR, now) & (ISR_TCR | ISR_TXIS), ISR_TXIS);
    }
}
