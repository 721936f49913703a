//! The three A/D converters (RM0090 13): conversions of one regular channel, started by software.
//!
//! The pins of the expansion port have no model and convert to 0. The internal channels have the
//! typical values of the data sheet. Scans, injected channels, triggers, the watchdog and DMA have
//! no model.

use crate::Time;
use crate::stm32::Write;

const SR: u32 = 0x00;
const CR1: u32 = 0x04;
const CR2: u32 = 0x08;
const SMPR1: u32 = 0x0c;
const SQR1: u32 = 0x2c;
const SQR3: u32 = 0x34;
const DR: u32 = 0x4c;
const REGISTERS: usize = 0x50 / 4;
/// The size of a converter's address range; the common registers follow the third.
const UNIT: u32 = 0x100;
const UNITS: usize = 3;
/// Offset of CCR from the first common register.
const CCR: u32 = 0x04;

const SR_EOC: u32 = 1 << 1;
const SR_STRT: u32 = 1 << 4;
const CR1_EOCIE: u32 = 1 << 5;
/// Analog watchdogs, injected channels, scan and discontinuous mode.
const CR1_UNMODELED: u32 = 3 << 22 | 0x7f << 6 | 1 << 8;
const CR2_ADON: u32 = 1 << 0;
/// Continuous conversion, DMA, left alignment, injected channels and triggers.
const CR2_UNMODELED: u32 = 1 << 1 | 1 << 8 | 1 << 11 | 7 << 20 | 3 << 28;
const CR2_SWSTART: u32 = 1 << 30;
const SQR1_LENGTH: u32 = 0xf << 20;

/// Cycles of a sample by SMPx (13.13.4).
const SAMPLE_CYCLES: [u64; 8] = [3, 15, 28, 56, 84, 112, 144, 480];
/// Values at the Crazyflie's supply of 3.0 V: the temperature sensor with 0.76 V at 25 degrees, and
/// the reference with 1.21 V (DS8626, tables 71 and 73). They are connected to ADC1 only.
const INTERNAL: [(u32, u32); 2] = [(16, 760 * 4095 / 3000), (17, 1210 * 4095 / 3000)];

#[derive(Clone, Copy)]
struct Converter {
    registers: [u32; REGISTERS],
    /// The end of the conversion, and its result.
    busy: Option<(Time, u32)>,
}

impl Converter {
    const OFF: Converter = Converter { registers: [0; REGISTERS], busy: None };

    fn register(&self, offset: u32) -> u32 {
        self.registers[offset as usize / 4]
    }

    /// Returns the cycles of the converter's clock for a conversion of `channel` (13.5): the sample
    /// and one cycle per bit.
    fn cycles(&self, channel: u32) -> u64 {
        // SMPR1 has channels 10 to 18, SMPR2 has 0 to 9.
        let (register, field) =
            if channel >= 10 { (SMPR1, channel - 10) } else { (SMPR1 + 4, channel) };
        let sample = self.register(register) >> (3 * field) & 7;
        SAMPLE_CYCLES[sample as usize] + u64::from(self.bits())
    }

    /// Returns the resolution in bits (13.13.2, RES).
    fn bits(&self) -> u32 {
        12 - 2 * (self.register(CR1) >> 24 & 3)
    }

    fn settle(&mut self, now: Time) {
        if let Some((_, value)) = self.busy.take_if(|(end, _)| *end <= now) {
            self.registers[DR as usize / 4] = value;
            self.registers[SR as usize / 4] |= SR_EOC;
        }
    }
}

pub(crate) struct Adc {
    converters: [Converter; UNITS],
    ccr: u32,
    hz: u64,
}

impl Adc {
    pub fn new(hz: u64) -> Self {
        Adc { converters: [Converter::OFF; UNITS], ccr: 0, hz }
    }

    pub fn set_clock(&mut self, hz: u64) {
        self.hz = hz;
    }

    /// Returns the time at which a conversion ends that raises the interrupt.
    pub fn next_event(&self) -> Option<Time> {
        let watched = self.converters.iter().filter(|one| one.register(CR1) & CR1_EOCIE != 0);
        watched.filter_map(|converter| converter.busy.map(|(end, _)| end)).min()
    }

    pub fn advance(&mut self, now: Time) {
        self.converters.iter_mut().for_each(|converter| converter.settle(now));
    }

    pub fn interrupt(&self) -> bool {
        self.converters
            .iter()
            .any(|one| one.register(SR) & SR_EOC != 0 && one.register(CR1) & CR1_EOCIE != 0)
    }

    pub fn read(&mut self, offset: u32, now: Time) -> u32 {
        let Some(converter) = self.converters.get_mut((offset / UNIT) as usize) else {
            return if offset % UNIT == CCR { self.ccr } else { 0 };
        };
        converter.settle(now);
        let register = offset % UNIT;
        if register == DR {
            // A read of the result clears EOC (13.13.1).
            converter.registers[SR as usize / 4] &= !SR_EOC;
        }
        converter.registers.get(register as usize / 4).copied().unwrap_or(0)
    }

    /// Writes a register; returns false if that enables a function without a model.
    pub fn write(&mut self, offset: u32, write: Write, now: Time) -> bool {
        let unit = (offset / UNIT) as usize;
        // Two bits of CCR divide the clock, by 2, 4, 6 or 8 (13.13.16).
        let hz = self.hz / (2 * (u64::from(self.ccr >> 16 & 3) + 1));
        let Some(converter) = self.converters.get_mut(unit) else {
            if offset % UNIT == CCR {
                self.ccr = write.merge(self.ccr);
            }
            return true;
        };
        converter.settle(now);
        let register = offset % UNIT;
        let Some(value) = converter.registers.get_mut(register as usize / 4) else { return true };
        match register {
            SR => *value &= !write.zeros(),
            DR => {}
            CR2 => {
                let new = write.merge(*value);
                *value = new & !CR2_SWSTART;
                if new & (CR2_SWSTART | CR2_ADON) == CR2_SWSTART | CR2_ADON {
                    let channel = converter.register(SQR3) & 0x1f;
                    let volts = INTERNAL.iter().find(|(one, _)| unit == 0 && *one == channel);
                    let value = volts.map_or(0, |(_, value)| *value) >> (12 - converter.bits());
                    let end = now + Time::of_ticks(converter.cycles(channel), hz);
                    converter.busy = Some((end, value));
                    converter.registers[SR as usize / 4] |= SR_STRT;
                }
                return new & CR2_UNMODELED == 0;
            }
            _ => {
                *value = write.merge(*value);
                let new = *value;
                return match register {
                    CR1 => new & CR1_UNMODELED == 0,
                    SQR1 => new & SQR1_LENGTH == 0,
                    _ => true,
                };
            }
        }
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Width;

    const ADC2: u32 = UNIT;

    fn write(adc: &mut Adc, offset: u32, value: u32, now: Time) {
        assert!(adc.write(offset, Write::new(offset, Width::Word, value), now));
    }

    #[test]
    fn a_conversion_takes_the_manuals_time() {
        // RM0090 13.5: with ADCCLK at 30 MHz and 3 cycles of sampling, 15 cycles are 0.5 us.
        let mut adc = Adc::new(60_000_000);
        write(&mut adc, ADC2 + CR2, CR2_ADON, Time::ZERO);
        write(&mut adc, ADC2 + CR2, CR2_ADON | CR2_SWSTART, Time::ZERO);
        assert_eq!(adc.read(ADC2 + SR, Time::from_nanos(499)), SR_STRT);
        let now = Time::from_nanos(500);
        assert_eq!(adc.read(ADC2 + SR, now), SR_STRT | SR_EOC);
        assert_eq!(adc.read(ADC2 + DR, now), 0);
        assert_eq!(adc.read(ADC2 + SR, now), SR_STRT, "reading DR clears EOC");
        assert_eq!(adc.read(ADC2 + CR2, now), CR2_ADON, "the hardware clears SWSTART");
    }

    #[test]
    fn the_reference_is_1_21_volts() {
        let mut adc = Adc::new(84_000_000);
        write(&mut adc, SQR3, 17, Time::ZERO);
        write(&mut adc, CR1, CR1_EOCIE, Time::ZERO);
        write(&mut adc, SMPR1, 7 << 21, Time::ZERO);
        write(&mut adc, CR2, CR2_ADON | CR2_SWSTART, Time::ZERO);
        // 492 cycles of 42 MHz.
        let end = adc.next_event().unwrap();
        assert_eq!(end, Time::of_ticks(492, 42_000_000));
        adc.advance(end);
        assert!(adc.interrupt());
        let volts = f64::from(adc.read(DR, end)) * 3.0 / 4095.0;
        assert!((volts - 1.21).abs() < 0.001, "{volts}");
        assert!(!adc.interrupt());
    }
}
