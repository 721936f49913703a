//! The core's reads and writes of peripherals.

use super::rcc::ResetRegister;
use super::*;

impl F051 {
    fn has_clock(&mut self, base: u32) -> bool {
        self.errors.check_clock(base, self.rcc.is_clocked(base))
    }

    /// Reads a register, at an address that is aligned to `width`.
    pub fn read(&mut self, address: u32, width: Width) -> u32 {
        let word = address & !3;
        let value = if let Some(value) = self.identity.read(word) {
            value
        } else {
            let base = word & !(BLOCK - 1);
            if self.has_clock(base) { self.read_block(base, word, width) } else { 0 }
        };
        width.part(value, address)
    }

    fn read_block(&mut self, base: u32, address: u32, width: Width) -> u32 {
        let offset = address - base;
        let value = match base {
            WATCHDOG => self.watchdog.read(offset),
            I2C2 => self.i2c.read(offset, self.now),
            SYSCFG if (0x08..0x18).contains(&offset) => {
                self.exti.read_choice(offset as usize / 4 - 2)
            }
            EXTI => self.exti.read(offset),
            ADC => self.adc.read(offset),
            SPI1 => self.spi.read(offset, width != Width::Byte),
            DBGMCU if offset == 0 => DEBUG_ID,
            DMA1 => self.dma.read(offset),
            RCC => self.rcc.read(offset),
            FLASH => self.flash.read(offset),
            GPIO..=GPIO_LAST => match self.ports.get(((base - GPIO) / BLOCK) as usize) {
                Some(port) => port.read(offset),
                None => 0,
            },
            _ => match TIMERS.iter().position(|(timer, _, _)| *timer == base) {
                Some(number) => {
                    let seen = |timer: &Timer| (timer.next_event(), timer.interrupt());
                    let before = seen(&self.timers[number]);
                    let value = self.timers[number].read(offset, self.now);
                    if before != seen(&self.timers[number]) {
                        self.update_timer_line(number);
                    }
                    value
                }
                None => {
                    self.note_unknown(base, address);
                    self.storage.get(&address).copied().unwrap_or(0)
                }
            },
        };
        // A read of these peripherals has side effects.
        if matches!(base, I2C2 | ADC | SPI1) {
            self.update_lines();
        }
        value
    }

    fn note_unknown(&mut self, base: u32, address: u32) {
        // The other registers of SYSCFG, DBGMCU and the power controller are storage on the chip,
        // too.
        if ![SYSCFG, DBGMCU, PWR].contains(&base) {
            self.unknown.entry(base).or_insert(address);
        }
    }

    /// Writes a register, at an address that is aligned to `width`.
    pub fn write(&mut self, address: u32, width: Width, value: u32) {
        let word = address & !3;
        let base = word & !(BLOCK - 1);
        if self.identity.read(word).is_none() && self.has_clock(base) {
            self.write_block(base, word, Write::new(address, width, value), width);
        }
    }

    fn write_block(&mut self, base: u32, address: u32, write: Write, width: Width) {
        let offset = address - base;
        let mut modeled = true;
        match base {
            WATCHDOG => self.watchdog.write(offset, write, self.now),
            I2C2 => {
                let release = self.i2c.release(self.now);
                let was_on = self.i2c.is_on();
                modeled = self.i2c.write(offset, write, self.now);
                if was_on && !self.i2c.is_on() {
                    self.i2c_release = Some(release);
                }
            }
            SYSCFG if (0x08..0x18).contains(&offset) => {
                self.exti.write_choice(offset as usize / 4 - 2, write);
                self.pins_changed();
            }
            EXTI => {
                self.exti.write(offset, write);
                self.exti.drive(&mut self.lines);
            }
            ADC => modeled = self.adc.write(offset, write, self.now),
            SPI1 => modeled = self.spi.write(offset, write, width != Width::Byte, self.now),
            DMA1 => modeled = self.dma.write(offset, write),
            RCC => {
                let reset = self.rcc.write(offset, write);
                self.clocks_changed();
                if let Some((bus, bits)) = reset {
                    self.reset_peripherals(bus, bits);
                }
            }
            FLASH => {
                self.flash_change = self.flash.write(offset, write).or(self.flash_change);
                self.check_clocks();
            }
            GPIO..=GPIO_LAST => {
                if let Some(port) = self.ports.get_mut(((base - GPIO) / BLOCK) as usize) {
                    port.write(offset, write);
                    self.pins_changed();
                }
            }
            _ => match TIMERS.iter().position(|(timer, _, _)| *timer == base) {
                Some(number) => {
                    modeled = self.timers[number].write(offset, write, self.now);
                    self.update_timer_line(number);
                }
                None => {
                    self.note_unknown(base, address);
                    let word = self.storage.entry(address).or_insert(0);
                    *word = write.merge(*word);
                }
            },
        }
        if !modeled {
            self.unknown.entry(base).or_insert(address);
        }
        if matches!(base, I2C2 | ADC | SPI1 | DMA1 | FLASH | RCC) {
            self.update_lines();
        }
    }

    /// Performs a write of the core to the flash, over the halfword `old`.
    pub fn program(&mut self, address: u32, old: u16, new: u16) -> Option<FlashChange> {
        let change = self.flash.program(address, old, new);
        self.update_lines();
        change
    }

    fn clocks_changed(&mut self) {
        let clocks = self.rcc.clocks();
        if clocks == std::mem::replace(&mut self.clocks, clocks) {
            return self.check_clocks();
        }
        for number in 0..self.timers.len() {
            self.timers[number].set_clock(clocks.timers, self.now);
            self.update_timer_line(number);
        }
        self.spi.set_clock(clocks.pclk);
        self.i2c.set_clock(clocks.pclk);
        self.adc.set_clock(clocks.pclk, clocks.hsi14);
        self.check_clocks();
    }

    fn check_clocks(&mut self) {
        let hclk = self.clocks.hclk;
        for error in self.rcc.errors().into_iter().chain(self.flash.error(hclk)) {
            self.errors.report(error);
        }
    }

    /// Resets peripherals through RCC_xxxRSTR, whose bits are those of RCC_xxxENR.
    fn reset_peripherals(&mut self, bus: ResetRegister, bits: u32) {
        let is_set = |of: ResetRegister, bit: usize| bus == of && bits >> bit & 1 != 0;
        for (number, port) in self.ports.iter_mut().enumerate() {
            if is_set(ResetRegister::Ahb, 17 + number) {
                port.reset();
            }
        }
        let clocks = self.rcc.clocks();
        let bits = [
            (ResetRegister::Apb2, 11),
            (ResetRegister::Apb1, 0),
            (ResetRegister::Apb1, 1),
            (ResetRegister::Apb1, 8),
            (ResetRegister::Apb2, 16),
            (ResetRegister::Apb2, 17),
            (ResetRegister::Apb2, 18),
        ];
        for (timer, (bus, bit)) in self.timers.iter_mut().zip(bits) {
            if is_set(bus, bit) {
                *timer = Timer::new(timer.kind(), clocks.timers, self.now);
            }
        }
        if is_set(ResetRegister::Apb2, 9) {
            self.adc = Adc::new(clocks.pclk, clocks.hsi14, self.adc.battery_volts);
        }
        if is_set(ResetRegister::Apb2, 12) {
            self.spi = Spi::new(clocks.pclk);
        }
        if is_set(ResetRegister::Apb1, 22) {
            self.restart_i2c();
        }
        (0..self.timers.len()).for_each(|number| self.update_timer_line(number));
        self.pins_changed();
    }
}
