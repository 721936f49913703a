//! The chip's registers as the core reads and writes them.

use super::{ACI, ACIC, ACO, Atmega328p, B, CLKPCE, IVCE, IVSEL, UNLOCKED, WATCHDOG_RESET};

/// Addresses in the data space.
mod at {
    pub const PINB: u16 = 0x23;
    pub const PORTD: u16 = 0x2b;
    pub const TIFR0: u16 = 0x35;
    pub const TIFR2: u16 = 0x37;
    pub const EECR: u16 = 0x3f;
    pub const EEDR: u16 = 0x40;
    pub const EEARL: u16 = 0x41;
    pub const EEARH: u16 = 0x42;
    pub const GTCCR: u16 = 0x43;
    pub const ACSR: u16 = 0x50;
    pub const SMCR: u16 = 0x53;
    pub const MCUSR: u16 = 0x54;
    pub const MCUCR: u16 = 0x55;
    pub const SPMCSR: u16 = 0x57;
    pub const WDTCSR: u16 = 0x60;
    pub const CLKPR: u16 = 0x61;
    pub const OSCCAL: u16 = 0x66;
    pub const TIMSK0: u16 = 0x6e;
    pub const TIMSK2: u16 = 0x70;
    pub const ADCL: u16 = 0x78;
    pub const ADCH: u16 = 0x79;
    pub const ADCSRA: u16 = 0x7a;
    pub const ADCSRB: u16 = 0x7b;
    pub const ADMUX: u16 = 0x7c;
    pub const TCCR1A: u16 = 0x80;
    pub const TCCR1B: u16 = 0x81;
    pub const TCNT1L: u16 = 0x84;
    pub const TCNT1H: u16 = 0x85;
    pub const ICR1L: u16 = 0x86;
    pub const ICR1H: u16 = 0x87;
    pub const OCR1AL: u16 = 0x88;
    pub const OCR1BH: u16 = 0x8b;
    pub const UCSR0A: u16 = 0xc0;
    pub const UCSR0B: u16 = 0xc1;
    pub const UCSR0C: u16 = 0xc2;
    pub const UBRR0L: u16 = 0xc4;
    pub const UBRR0H: u16 = 0xc5;
    pub const UDR0: u16 = 0xc6;
}

/// Registers that are storage on the chip, too, or whose function no robot here needs: DIDR0,
/// DIDR1, PRR, GPIOR0 to GPIOR2.
const STORAGE: [u16; 6] = [0x7e, 0x7f, 0x64, 0x3e, 0x4a, 0x4b];

impl Atmega328p {
    fn plain(&mut self, address: u16) -> &mut u8 {
        let at = usize::from(address) % 0x100;
        if !STORAGE.contains(&address) {
            self.unknown[at / 64] |= 1 << (at % 64);
        }
        &mut self.storage[at]
    }

    /// Performs a read of a register by the core, at the cycle that [`advance`](Self::advance) has
    /// reached.
    pub fn read(&mut self, address: u16) -> u8 {
        match address {
            at::PINB..=at::PORTD => {
                let port = self.ports[usize::from(address - at::PINB) / 3];
                match (address - at::PINB) % 3 {
                    0 => port.pins(),
                    1 => port.direction,
                    _ => port.port,
                }
            }
            at::TIFR0..=at::TIFR2 => {
                self.compute_timers();
                self.timers[usize::from(address - at::TIFR0)].flags
            }
            at::TIMSK0..=at::TIMSK2 => self.timers[usize::from(address - at::TIMSK0)].enabled,
            0x44..=0x48 => self.read_timer(0, address - 0x44),
            0xb0..=0xb4 => self.read_timer(2, address - 0xb0),
            at::TCCR1A => self.timers[1].tccra,
            at::TCCR1B => self.timers[1].tccrb,
            at::TCNT1L => {
                self.compute_timers();
                let [low, high] = self.timers[1].count().to_le_bytes();
                self.temporary = high;
                low
            }
            at::ICR1L => {
                let [low, high] = self.timers[1].icr.to_le_bytes();
                self.temporary = high;
                low
            }
            at::TCNT1H | at::ICR1H => self.temporary,
            at::OCR1AL..=at::OCR1BH => {
                let of = usize::from(address - at::OCR1AL);
                self.timers[1].ocr[of / 2].to_le_bytes()[of % 2]
            }
            at::ADCL => self.adc.low(),
            at::ADCH => self.adc.high(),
            at::ADCSRA => self.adc.adcsra(),
            at::ADCSRB => self.adc.adcsrb(),
            at::ADMUX => self.adc.admux(),
            at::ACSR => self.acsr,
            at::EECR => self.eeprom.control(),
            at::EEDR => self.eeprom.data(),
            at::EEARL | at::EEARH => self.eeprom.address()[usize::from(address - at::EEARL)],
            at::SMCR => self.smcr,
            at::MCUSR => self.mcusr,
            at::MCUCR => self.mcucr,
            at::SPMCSR => {
                let io = self.io(self.now);
                self.flash.control(io)
            }
            at::WDTCSR => self.watchdog.control(),
            at::CLKPR => self.clkpr,
            at::OSCCAL => self.clock.osccal(),
            at::GTCCR => 0,
            at::UCSR0A => self.usart.status(),
            at::UCSR0B => self.usart.control(),
            at::UCSR0C => self.usart.format(),
            at::UBRR0L | at::UBRR0H => self.usart.divisor()[usize::from(address - at::UBRR0L)],
            at::UDR0 => 0,
            _ => *self.plain(address),
        }
    }

    fn read_timer(&mut self, timer: usize, register: u16) -> u8 {
        self.compute_timers();
        let timer = &self.timers[timer];
        match register {
            0 => timer.tccra,
            1 => timer.tccrb,
            2 => timer.count() as u8,
            3 => timer.ocr[0] as u8,
            _ => timer.ocr[1] as u8,
        }
    }

    fn write_timer(&mut self, timer: usize, register: u16, value: u8) {
        let timer = &mut self.timers[timer];
        match register {
            0 => timer.configure(value, timer.tccrb),
            1 => timer.configure(timer.tccra, value),
            2 => timer.set_count(value.into()),
            3 => timer.ocr[0] = value.into(),
            _ => timer.ocr[1] = value.into(),
        }
    }

    /// Performs a write of a register by the core. Flags are cleared by ones.
    pub fn write(&mut self, address: u16, value: u8) {
        if (at::PINB..=at::PORTD).contains(&address) {
            // Ports affect no computed register except through the pin of input capture.
            let index = usize::from(address - at::PINB) / 3;
            let before = self.ports[index].pins();
            let port = &mut self.ports[index];
            match (address - at::PINB) % 3 {
                // Writing a one to PINx toggles the output (14.2.2).
                0 => port.port ^= value,
                1 => port.direction = value,
                _ => port.port = value,
            }
            let changed = before ^ port.pins();
            if index == B && changed & 1 != 0 && self.acsr & ACIC == 0 {
                let rises = self.ports[B].pins() & 1 != 0;
                self.capture(rises);
            }
            return;
        }
        self.outlook = None;
        self.compute_timers();
        let io = self.io(self.now);
        match address {
            at::TIFR0..=at::TIFR2 => self.timers[usize::from(address - at::TIFR0)].flags &= !value,
            at::TIMSK0..=at::TIMSK2 => {
                self.timers[usize::from(address - at::TIMSK0)].enabled = value;
            }
            0x44..=0x48 => self.write_timer(0, address - 0x44, value),
            0xb0..=0xb4 => self.write_timer(2, address - 0xb0, value),
            at::TCCR1A => {
                let tccrb = self.timers[1].tccrb;
                self.timers[1].configure(value, tccrb);
            }
            at::TCCR1B => {
                let tccra = self.timers[1].tccra;
                self.timers[1].configure(tccra, value);
            }
            at::TCNT1L => {
                let count = u16::from_le_bytes([value, self.temporary]);
                self.timers[1].set_count(count);
            }
            at::ICR1L => self.timers[1].icr = u16::from_le_bytes([value, self.temporary]),
            at::TCNT1H | at::ICR1H | 0x89 | at::OCR1BH => self.temporary = value,
            at::OCR1AL..at::OCR1BH => {
                let of = usize::from(address - at::OCR1AL) / 2;
                self.timers[1].ocr[of] = u16::from_le_bytes([value, self.temporary]);
            }
            at::GTCCR => {
                // PSRSYNC and PSRASY. TSM, which keeps them set, is not modeled.
                if value & 1 != 0 {
                    self.timers[0].reset_prescaler(io);
                    self.timers[1].reset_prescaler(io);
                }
                if value & 2 != 0 {
                    self.timers[2].reset_prescaler(io);
                }
            }
            at::ADCL | at::ADCH => {}
            at::ADCSRA => self.adc.set_adcsra(value, io),
            at::ADCSRB => self.adc.set_adcsrb(value),
            at::ADMUX => self.adc.set_admux(value),
            at::ACSR => {
                let flag = self.acsr & ACI & !value;
                self.acsr = value & !(ACI | ACO) | self.acsr & ACO | flag;
                self.settle_comparator();
            }
            at::EECR => {
                self.halt += self.eeprom.set_control(value, io, self.flash.is_busy());
            }
            at::EEDR => self.eeprom.set_data(value),
            at::EEARL | at::EEARH => {
                self.eeprom.set_address(usize::from(address - at::EEARL), value);
            }
            at::SMCR => self.smcr = value & 0xf,
            at::MCUSR => self.mcusr &= value,
            at::MCUCR => {
                // IVSEL must be written within four cycles after IVCE (12.4.1).
                if value & IVCE != 0 {
                    self.unlocked_until[0] = self.now + UNLOCKED;
                    self.mcucr = self.mcucr & IVSEL | value & !IVSEL;
                } else {
                    let may = self.mcucr & IVCE != 0 && self.now <= self.unlocked_until[0];
                    let select = if may { value } else { self.mcucr } & IVSEL;
                    self.mcucr = value & !(IVSEL | IVCE) | select;
                }
            }
            at::SPMCSR => self.flash.set_control(value, io),
            at::WDTCSR => {
                let now = self.clock.time(self.now);
                let is_forced = self.mcusr & WATCHDOG_RESET != 0;
                self.watchdog.set_control(value, self.now, now, is_forced);
            }
            at::CLKPR => {
                if value == CLKPCE {
                    self.clkpr |= CLKPCE;
                    self.unlocked_until[1] = self.now + UNLOCKED;
                } else {
                    if self.clkpr & CLKPCE != 0 && self.now <= self.unlocked_until[1] {
                        self.clkpr = value & 0xf;
                        self.clock.set_divider(self.now, self.clkpr);
                    }
                    self.clkpr &= !CLKPCE;
                }
            }
            at::OSCCAL => self.clock.set_osccal(self.now, value),
            at::UCSR0A => self.usart.set_status(value),
            at::UCSR0B => self.usart.set_control(value),
            at::UCSR0C => self.usart.set_format(value),
            at::UBRR0L | at::UBRR0H => {
                self.usart.set_divisor(usize::from(address - at::UBRR0L), value);
            }
            at::UDR0 => self.usart.send(value, io),
            _ => *self.plain(address) = value,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ResetCause;
    use crate::atmega328p::EEPROM_SIZE;

    /// MCUSR collects the causes (11.9.1).
    #[test]
    fn causes_of_resets_are_collected_until_power_on() {
        let mut chip = Atmega328p::new(0x9c, 0x9d, [0xff; EEPROM_SIZE]);
        assert_eq!(chip.read(at::MCUSR), 1 << 0);
        chip.write(at::MCUSR, 0);
        chip.reset(0x9d, ResetCause::BrownOut);
        assert_eq!(chip.read(at::MCUSR), 1 << 2);
        chip.reset(0x9d, ResetCause::IndependentWatchdog);
        assert_eq!(chip.read(at::MCUSR), 1 << 2 | 1 << 3);
        chip.reset(0x9d, ResetCause::PowerOn);
        assert_eq!(chip.read(at::MCUSR), 1 << 0);
    }
}
