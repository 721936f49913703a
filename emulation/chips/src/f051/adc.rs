//! Analog-to-digital converter (RM0091 13): single conversions started by software.

use crate::Time;
use crate::stm32::Write;

const ISR: u32 = 0x00;
const IER: u32 = 0x04;
const CR: u32 = 0x08;
const CFGR1: u32 = 0x0c;
const CFGR2: u32 = 0x10;
const SMPR: u32 = 0x14;
const CHSELR: u32 = 0x28;
const DR: u32 = 0x40;
const CCR: u32 = 0x308;

const ISR_ADRDY: u32 = 1 << 0;
const ISR_EOSMP: u32 = 1 << 1;
const ISR_EOC: u32 = 1 << 2;
const ISR_EOSEQ: u32 = 1 << 3;
const ISR_OVR: u32 = 1 << 4;
const CR_ADEN: u32 = 1 << 0;
const CR_ADDIS: u32 = 1 << 1;
const CR_ADSTART: u32 = 1 << 2;
const CR_ADSTP: u32 = 1 << 4;
const CR_ADCAL: u32 = 1 << 31;
const CFGR1_DMAEN: u32 = 1 << 0;
/// Bits of CFGR1 for modes without a model: backward scans, external triggers, continuous and
/// discontinuous mode, automatic power.
const CFGR1_UNMODELED: u32 = 1 << 2 | 3 << 10 | 1 << 13 | 1 << 15 | 1 << 16;
const CCR_VREFEN: u32 = 1 << 22;
const CCR_VBATEN: u32 = 1 << 24;

/// Channels connected to sources inside the chip (13.3.8, 13.9, 13.10).
const VREFINT: u8 = 17;
const VBAT: u8 = 18;
const CHANNELS: u8 = 19;
/// The analog supply in volts from the Zooid's regulator, unless the battery has less.
const REGULATED_VOLTS: f64 = 3.3;
/// Typical voltage of the internal reference (DS8668).
const VREFINT_VOLTS: f64 = 1.23;
/// The sampling times in half cycles (13.12.6).
const SAMPLING: [u64; 8] = [3, 15, 27, 57, 83, 111, 143, 479];
/// The durations of a conversion in half cycles, for 12, 10, 8 and 6 bits (13.3.12).
const CONVERSION: [u64; 4] = [25, 22, 18, 14];

pub(crate) struct Adc {
    pclk: u64,
    hsi14: u64,
    isr: u32,
    ier: u32,
    cr: u32,
    cfgr1: u32,
    cfgr2: u32,
    smpr: u32,
    chselr: u32,
    ccr: u32,
    data: u32,
    /// The channel that is being converted, and the end of the conversion.
    converting: Option<(Time, u8)>,
    /// The voltage at the pin VBAT.
    pub battery_volts: f64,
}

impl Adc {
    pub fn new(pclk: u64, hsi14: u64, battery_volts: f64) -> Self {
        Adc {
            pclk,
            hsi14,
            isr: 0,
            ier: 0,
            cr: 0,
            cfgr1: 0,
            cfgr2: 0,
            smpr: 0,
            chselr: 0,
            ccr: 0,
            data: 0,
            converting: None,
            battery_volts,
        }
    }

    pub fn set_clock(&mut self, pclk: u64, hsi14: u64) {
        (self.pclk, self.hsi14) = (pclk, hsi14);
    }

    /// Returns the frequency of the converter's clock. On the chip a conversion starts the
    /// oscillator HSI14, unless that is forbidden (6.2.5); this model requires that RCC_CR2 turns
    /// it on.
    fn clock_hz(&self) -> u64 {
        match self.cfgr2 >> 30 {
            0 => self.hsi14,
            1 => self.pclk / 2,
            _ => self.pclk / 4,
        }
    }

    pub fn next_event(&self) -> Option<Time> {
        self.converting.map(|(end, _)| end)
    }

    pub fn advance(&mut self, now: Time) {
        let Some((end, channel)) = self.converting.take_if(|(end, _)| *end <= now) else {
            return;
        };
        if self.isr & ISR_EOC != 0 {
            self.isr |= ISR_OVR;
        }
        self.data = self.convert(channel);
        self.isr |= ISR_EOSMP | ISR_EOC;
        match (channel + 1..CHANNELS).find(|next| self.chselr >> next & 1 != 0) {
            Some(next) => self.begin(next, end),
            None => {
                self.isr |= ISR_EOSEQ;
                self.cr &= !CR_ADSTART;
            }
        }
    }

    fn begin(&mut self, channel: u8, now: Time) {
        let resolution = (self.cfgr1 >> 3 & 3) as usize;
        let halves = SAMPLING[(self.smpr & 7) as usize] + CONVERSION[resolution];
        self.converting = Some((now + Time::of_ticks(halves, 2 * self.clock_hz()), channel));
    }

    /// Converts a channel. External channels have no model and read as 0.
    fn convert(&self, channel: u8) -> u32 {
        let volts = match channel {
            VBAT if self.ccr & CCR_VBATEN != 0 => self.battery_volts / 2.0,
            VREFINT if self.ccr & CCR_VREFEN != 0 => VREFINT_VOLTS,
            _ => 0.0,
        };
        let vdda = REGULATED_VOLTS.min(self.battery_volts);
        let code = (volts / vdda * 4096.0).clamp(0.0, 4095.0) as u32;
        let resolution = self.cfgr1 >> 3 & 3;
        code >> (2 * resolution)
    }

    pub fn interrupt(&self) -> bool {
        self.isr & self.ier != 0
    }

    /// Returns true if the converter may cause interrupts or DMA transfers.
    pub fn is_watched(&self) -> bool {
        self.ier != 0 || self.cfgr1 & CFGR1_DMAEN != 0
    }

    /// Returns true if the converter requests a DMA transfer.
    pub fn dma_request(&self) -> bool {
        self.cfgr1 & CFGR1_DMAEN != 0 && self.isr & ISR_EOC != 0
    }

    pub fn read(&mut self, offset: u32) -> u32 {
        match offset {
            ISR => self.isr,
            IER => self.ier,
            CR => self.cr,
            CFGR1 => self.cfgr1,
            CFGR2 => self.cfgr2,
            SMPR => self.smpr,
            CHSELR => self.chselr,
            DR => {
                self.isr &= !ISR_EOC;
                self.data
            }
            CCR => self.ccr,
            _ => 0,
        }
    }

    /// Writes a register; returns false if that enables a function without a model.
    pub fn write(&mut self, offset: u32, write: Write, now: Time) -> bool {
        match offset {
            ISR => self.isr &= !write.ones(),
            IER => self.ier = write.merge(self.ier),
            CR => {
                let ones = write.ones();
                // Calibration takes no time here. The program sets ADEN, ADSTART and their
                // opposites; the converter clears them.
                if ones & CR_ADEN != 0 && ones & CR_ADCAL == 0 {
                    self.cr |= CR_ADEN;
                    if self.clock_hz() > 0 {
                        self.isr |= ISR_ADRDY;
                    }
                }
                if ones & CR_ADDIS != 0 {
                    self.cr = 0;
                    self.converting = None;
                }
                if ones & CR_ADSTP != 0 {
                    self.cr &= !CR_ADSTART;
                    self.converting = None;
                }
                let first = (0..CHANNELS).find(|channel| self.chselr >> channel & 1 != 0);
                if ones & CR_ADSTART != 0
                    && self.cr & (CR_ADEN | CR_ADSTART) == CR_ADEN
                    && let Some(first) = first
                {
                    self.cr |= CR_ADSTART;
                    self.begin(first, now);
                }
            }
            CFGR1 => {
                self.cfgr1 = write.merge(self.cfgr1);
                return self.cfgr1 & CFGR1_UNMODELED == 0;
            }
            CFGR2 => self.cfgr2 = write.merge(self.cfgr2),
            SMPR => self.smpr = write.merge(self.smpr),
            CHSELR => self.chselr = write.merge(self.chselr) & ((1 << CHANNELS) - 1),
            CCR => self.ccr = write.merge(self.ccr),
            _ => {}
        }
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Width;

    fn write(adc: &mut Adc, offset: u32, value: u32) {
        assert!(adc.write(offset, Write::new(offset, Width::Word, value), Time::ZERO));
    }

    #[test]
    fn measures_half_of_the_battery() {
        let mut adc = Adc::new(48_000_000, 14_000_000, 3.42);
        write(&mut adc, CR, CR_ADEN);
        assert_eq!(adc.read(ISR), ISR_ADRDY);
        write(&mut adc, CCR, CCR_VBATEN);
        write(&mut adc, CHSELR, 1 << 18);
        // 10 bits, 239.5 cycles of sampling: with 11 of conversion 250.5 at 14 MHz.
        write(&mut adc, CFGR1, 1 << 3);
        write(&mut adc, SMPR, 7);
        write(&mut adc, CR, CR_ADSTART);
        let end = adc.next_event().unwrap();
        assert_eq!(end, Time::of_ticks(501, 28_000_000));
        adc.advance(end);
        assert_eq!(adc.read(ISR), ISR_ADRDY | ISR_EOSMP | ISR_EOC | ISR_EOSEQ);
        // SwarmUI reports less than 530 counts as "low".
        assert_eq!(adc.read(DR), 530);
        assert_eq!(adc.read(ISR) & ISR_EOC, 0);
    }

    /// Channels are scanned upwards (13.4.3). Their full scale is the supply, which is not higher
    /// than the battery's voltage.
    #[test]
    fn a_low_battery_is_measured_after_the_reference() {
        let mut adc = Adc::new(48_000_000, 14_000_000, 3.0);
        write(&mut adc, CR, CR_ADEN);
        write(&mut adc, CCR, CCR_VBATEN | CCR_VREFEN);
        write(&mut adc, CHSELR, 1 << 17 | 1 << 18);
        write(&mut adc, CR, CR_ADSTART);
        let mut next = || {
            let end = adc.next_event().unwrap();
            adc.advance(end);
            adc.read(DR)
        };
        // 1.23 V of 3.0 V, then half of 3.0 V.
        assert_eq!([next(), next()], [1679, 2048]);
        assert_eq!(adc.next_event(), None);
    }

    #[test]
    fn without_its_clock_it_does_not_get_ready() {
        let mut adc = Adc::new(48_000_000, 0, 3.7);
        write(&mut adc, CR, CR_ADEN);
        assert_eq!(adc.read(ISR), 0);
        write(&mut adc, CFGR2, 2 << 30);
        write(&mut adc, CR, CR_ADEN);
        assert_eq!(adc.read(ISR), ISR_ADRDY);
    }

    #[test]
    fn the_divider_must_be_connected() {
        let mut adc = Adc::new(48_000_000, 14_000_000, 4.0);
        write(&mut adc, CR, CR_ADEN);
        write(&mut adc, CHSELR, 1 << 18);
        write(&mut adc, CR, CR_ADSTART);
        let end = adc.next_event().unwrap();
        adc.advance(end);
        assert_eq!(adc.read(DR), 0);
    }
}
