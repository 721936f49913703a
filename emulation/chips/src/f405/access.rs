//! The core's reads and writes of peripherals.

use super::*;

impl F405 {
    fn has_clock(&mut self, address: u32) -> bool {
        let base = address & !(BLOCK - 1);
        // The three converters have a clock each, and their common registers any of them.
        let base = if base == ADC { address & !0xff } else { base };
        self.errors.check_clock(base, self.rcc.is_clocked(base))
    }

    /// Reads a register, at an address that is aligned to `width`.
    pub fn read(&mut self, address: u32, width: Width) -> u32 {
        let word = address & !3;
        let value = if let Some(value) = self.identity.read(word) {
            value
        } else {
            let base = word & !(BLOCK - 1);
            if self.has_clock(word) { self.read_block(base, word) } else { 0 }
        };
        width.part(value, address)
    }

    fn read_block(&mut self, base: u32, address: u32) -> u32 {
        let offset = address - base;
        let value = match base {
            TIM2..=TIM7 => self.timers[((base - TIM2) / BLOCK) as usize].read(offset, self.now),
            WATCHDOG => self.watchdog.read(offset),
            RTC if self.backup.read(offset).is_some() => self.backup.read(offset).unwrap_or(0),
            POWER => self.power.read(offset),
            USART3 => self.usart3.read(offset, self.now),
            USART6 => self.usart.read(offset, self.now),
            I2C1 => self.i2c[0].read(offset, self.now),
            I2C3 => self.i2c[1].read(offset, self.now),
            SPI1 => self.spi.read(offset),
            ADC => self.adc.read(offset, self.now),
            SYSCFG if (0x08..0x18).contains(&offset) => {
                self.exti.read_choice(offset as usize / 4 - 2)
            }
            EXTI => self.exti.read(offset),
            GPIO..=GPIO_LAST => self.ports[((base - GPIO) / BLOCK) as usize].read(offset),
            RCC => self.rcc.read(offset),
            FLASH => self.flash.read(offset),
            DMA1 => self.dma[0].read(offset),
            DMA2 => self.dma[1].read(offset),
            USB_OTG..=USB_OTG_LAST => usb::read(address - USB_OTG, self.stored(address)),
            DEBUG if offset == 0 => system::DEBUG_ID,
            _ => {
                self.note_unknown(base, address);
                self.stored(address)
            }
        };
        if F405::reading_acts(address) {
            self.update_line(base);
        }
        value
    }

    /// Returns true if a read of the register at this address may have a side effect.
    pub fn reading_acts(address: u32) -> bool {
        let base = address & !(BLOCK - 1);
        match base {
            // A firmware polls CR1 while a condition is on the bus.
            I2C1 | I2C3 => address != base,
            _ => matches!(base, TIM2..=TIM7 | USART3 | USART6 | SPI1 | ADC),
        }
    }

    fn stored(&self, address: u32) -> u32 {
        self.storage.get(&address).copied().unwrap_or(0)
    }

    fn note_unknown(&mut self, base: u32, address: u32) {
        // The other registers of SYSCFG and DBGMCU are storage on the chip, too.
        if base != SYSCFG && base != DEBUG {
            self.unknown.entry(base).or_insert(address);
        }
    }

    /// Writes a register, at an address that is aligned to `width`.
    pub fn write(&mut self, address: u32, width: Width, value: u32) {
        let word = address & !3;
        let base = word & !(BLOCK - 1);
        if self.identity.read(word).is_none() && self.has_clock(word) {
            let is_modeled = self.write_block(base, word, Write::new(address, width, value));
            if !is_modeled {
                self.note_unknown(base, word);
            }
            self.update_line(base);
        }
    }

    /// Writes a register; returns false if that enables a function without a model.
    fn write_block(&mut self, base: u32, address: u32, write: Write) -> bool {
        let offset = address - base;
        let now = self.now;
        match base {
            TIM2..=TIM7 => {
                return self.timers[((base - TIM2) / BLOCK) as usize].write(offset, write, now);
            }
            // Without DBP nothing is written; while the domain is in reset all registers stay 0.
            RTC if self.backup.read(offset).is_some() => {
                if self.power.is_backup_writable() && !self.rcc.is_backup_reset() {
                    self.backup.write(offset, write);
                }
            }
            WATCHDOG => self.watchdog.write(offset, write, now),
            POWER => {
                self.power.write(offset, write);
                self.check_clocks();
            }
            USART3 => self.usart3.write(offset, write, now),
            USART6 => self.usart.write(offset, write, now),
            I2C1 => return self.i2c[0].write(offset, write, now),
            I2C3 => return self.i2c[1].write(offset, write, now),
            SPI1 => return self.spi.write(offset, write, now),
            ADC => return self.adc.write(offset, write, now),
            SYSCFG if (0x08..0x18).contains(&offset) => {
                self.exti.write_choice(offset as usize / 4 - 2, write);
                self.pins_changed();
            }
            EXTI => self.exti.write(offset, write),
            GPIO..=GPIO_LAST => {
                self.ports[((base - GPIO) / BLOCK) as usize].write(offset, write);
                self.pins_changed();
            }
            RCC => {
                let reset = self.rcc.write(offset, write);
                if self.rcc.is_backup_reset() {
                    self.backup = Backup::new();
                }
                self.clocks_changed();
                if let Some((register, bits)) = reset {
                    self.reset_peripherals(register, bits);
                }
            }
            FLASH => {
                self.flash.write(offset, write);
                self.check_clocks();
            }
            DMA1 | DMA2 => match self.dma[((base - DMA1) / BLOCK) as usize].write(offset, write) {
                DmaWrite::Modeled => {}
                DmaWrite::Unmodeled => return false,
                DmaWrite::Locked => self.errors.report(HardwareError::DmaLocked { base }),
            },
            _ => {
                let word = self.storage.entry(address).or_insert(0);
                *word = write.merge(*word);
                return (USB_OTG..=USB_OTG_LAST).contains(&base);
            }
        }
        true
    }

    pub(super) fn clocks_changed(&mut self) {
        let clocks = self.rcc.clocks();
        for timer in &mut self.timers {
            timer.set_clock(clocks.timers1, self.now);
        }
        for i2c in &mut self.i2c {
            i2c.set_clock(clocks.pclk1);
        }
        self.usart3.set_clock(clocks.pclk1);
        self.usart.set_clock(clocks.pclk2);
        self.spi.set_clock(clocks.pclk2);
        self.adc.set_clock(clocks.pclk2);
        self.check_clocks();
    }

    fn check_clocks(&mut self) {
        let hclk = self.rcc.clocks().hclk;
        let errors = self.rcc.errors(self.power.is_scale_1());
        for error in errors.into_iter().chain(self.flash.error(hclk)) {
            self.errors.report(error);
        }
    }

    /// Resets peripherals through RCC_xxxRSTR, whose bits are those of RCC_xxxENR.
    fn reset_peripherals(&mut self, register: usize, bits: u32) {
        let is_set = |number: usize, bit: usize| register == number && bits >> bit & 1 != 0;
        for (number, port) in self.ports.iter_mut().enumerate() {
            if is_set(0, number) {
                port.reset();
            }
        }
        for (number, dma) in self.dma.iter_mut().enumerate() {
            if is_set(0, 21 + number) {
                *dma = Dma::new();
            }
        }
        let clocks = self.rcc.clocks();
        for (number, timer) in self.timers.iter_mut().enumerate() {
            if is_set(4, number) {
                *timer = Timer::new(timer.kind(), clocks.timers1, self.now);
            }
        }
        if is_set(4, 18) {
            self.usart3.reset();
        }
        for (i2c, bit) in self.i2c.iter_mut().zip([21, 23]) {
            if is_set(4, bit) {
                i2c.reset(self.now);
            }
        }
        if is_set(4, 28) {
            self.power = Power::new();
        }
        if is_set(5, 5) {
            self.usart.reset();
        }
        if is_set(5, 8) {
            self.adc = Adc::new(clocks.pclk2);
        }
        if is_set(5, 12) {
            self.spi = Spi::new(clocks.pclk2);
        }
        self.pins_changed();
    }
}
