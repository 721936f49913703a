//! Reset and clock control (RM0091 6).

use crate::stm32::Write;
use crate::stm32::rcc::{self, CR_HSEON, CR_HSION, CR_PLLON, CR_RESET, ClockSource};
use crate::{HardwareError, ResetCause};

/// Registers by offset / 4.
const CR: usize = 0;
const CFGR: usize = 1;
const APB2RSTR: usize = 0x0c / 4;
const APB1RSTR: usize = 0x10 / 4;
const AHBENR: usize = 0x14 / 4;
const APB2ENR: usize = 0x18 / 4;
const APB1ENR: usize = 0x1c / 4;
const BDCR: usize = 0x20 / 4;
const CSR: usize = 0x24 / 4;
const AHBRSTR: usize = 0x28 / 4;
const CFGR2: usize = 0x2c / 4;
const CR2: usize = 0x34 / 4;
const REGISTERS: usize = CR2 + 1;

const CR_ON: u32 = CR_HSION | CR_HSEON | CR_PLLON;
const CFGR_PLLSRC_HSE: u32 = 1 << 16;
/// This bit is the same as the lowest one of CFGR2_PREDIV.
const CFGR_PLLXTPRE: u32 = 1 << 17;
/// The fields that are locked while the PLL runs: PLLMUL, PLLXTPRE, PLLSRC.
const CFGR_PLL: u32 = 0xf << 18 | CFGR_PLLXTPRE | CFGR_PLLSRC_HSE;
const CSR_CAUSES: u32 = 0xfe80_0000;
const CR2_HSI14ON: u32 = 1 << 0;

const HSI_HZ: u64 = 8_000_000;
const HSI14_HZ: u64 = 14_000_000;
/// The data sheet's typical frequency of LSI.
pub(super) const LSI_HZ: u64 = 40_000;
/// The crystal on the Zooid's board.
const HSE_HZ: u64 = 16_000_000;

/// The frequencies in Hz that the registers set.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Clocks {
    pub sysclk: u64,
    /// The frequency of AHB and the core.
    pub hclk: u64,
    pub pclk: u64,
    pub timers: u64,
    /// The frequency of the converter's own oscillator; 0 while it is off.
    pub hsi14: u64,
    /// The frequency at the pin MCO; 0 for no signal.
    pub mco: u64,
}

/// The bus of a peripheral, which selects the register that resets the peripheral.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ResetRegister {
    Ahb,
    Apb1,
    Apb2,
}

pub(crate) struct Rcc {
    registers: [u32; REGISTERS],
    source: ClockSource,
    /// Frequency of LSI in Hz, which differs from chip to chip.
    pub lsi_hz: u64,
    /// False if the crystal never oscillates.
    pub has_crystal: bool,
}

impl Rcc {
    pub fn new() -> Self {
        let registers = [0; REGISTERS];
        let mut rcc =
            Rcc { registers, source: ClockSource::Hsi, lsi_hz: LSI_HZ, has_crystal: true };
        rcc.reset(ResetCause::PowerOn);
        rcc
    }

    /// Sets all registers to their reset values, except those of the backup domain. The flags of
    /// the causes accumulate until the firmware clears them (6.4.10). Every cause inside the chip
    /// also pulls the reset pin (6.1.2).
    pub fn reset(&mut self, cause: ResetCause) {
        let backup = self.registers[BDCR];
        let causes = match cause {
            ResetCause::PowerOn | ResetCause::BrownOut => 0,
            _ => self.registers[CSR] & CSR_CAUSES,
        };
        self.registers = [0; REGISTERS];
        self.registers[CR] = CR_RESET;
        self.registers[AHBENR] = 0x14;
        self.registers[BDCR] = backup;
        self.registers[CR2] = 0x80;
        self.registers[CSR] = causes
            | match cause {
                // The chip has no brown-out detector. The power-down detector resets it and sets
                // PORRSTF, too (6.4.10).
                ResetCause::PowerOn | ResetCause::BrownOut => 1 << 27 | 1 << 26,
                _ => rcc::flags(cause),
            };
        self.source = ClockSource::Hsi;
    }

    pub fn read(&self, offset: u32) -> u32 {
        let register = offset as usize / 4;
        let value = self.registers.get(register).copied().unwrap_or(0);
        match register {
            CR => {
                let without_input = if self.pll_input_hz() == 0 { CR_PLLON } else { 0 };
                rcc::read_control(value, CR_ON, self.has_crystal, without_input)
            }
            CFGR => rcc::read_configuration(value, self.source),
            BDCR => rcc::read_backup(value),
            CSR => rcc::read_status(value),
            CR2 => value & !2 | (value & CR2_HSI14ON) << 1,
            _ => value,
        }
    }

    /// Writes a register. If it is a register that resets peripherals, returns its bus and the bits
    /// that were set.
    pub fn write(&mut self, offset: u32, write: Write) -> Option<(ResetRegister, u32)> {
        let register = offset as usize / 4;
        let old = *self.registers.get(register)?;
        let mut new = write.merge(old);
        let pll_is_on = self.registers[CR] & CR_PLLON != 0;
        match register {
            CR => new |= self.source.on(),
            CFGR if pll_is_on => new = new & !CFGR_PLL | old & CFGR_PLL,
            CFGR2 if pll_is_on => new = old,
            BDCR => new = rcc::write_backup(new),
            CSR => new = rcc::write_status(old, new, CSR_CAUSES),
            _ => {}
        }
        self.registers[register] = new;
        match register {
            CFGR => {
                let prediv = (new & CFGR_PLLXTPRE) >> 17;
                self.registers[CFGR2] = self.registers[CFGR2] & !1 | prediv;
            }
            CFGR2 => {
                let prediv = (new & 1) << 17;
                self.registers[CFGR] = self.registers[CFGR] & !CFGR_PLLXTPRE | prediv;
            }
            _ => {}
        }
        self.source = self.source.after_write(self.registers[CFGR], self.read(0));
        let bus = match register {
            APB2RSTR => ResetRegister::Apb2,
            APB1RSTR => ResetRegister::Apb1,
            AHBRSTR => ResetRegister::Ahb,
            _ => return None,
        };
        Some((bus, new & !old))
    }

    fn hse_hz(&self) -> u64 {
        if rcc::crystal_runs(self.registers[CR], self.has_crystal) { HSE_HZ } else { 0 }
    }

    fn hsi_hz(&self) -> u64 {
        if self.registers[CR] & CR_HSION != 0 { HSI_HZ } else { 0 }
    }

    /// Returns the frequency at the PLL's input: half of HSI, or HSE divided by PREDIV + 1 (6.4.2,
    /// 6.4.12).
    fn pll_input_hz(&self) -> u64 {
        if self.registers[CFGR] & CFGR_PLLSRC_HSE == 0 {
            self.hsi_hz() / 2
        } else {
            self.hse_hz() / (u64::from(self.registers[CFGR2] & 0xf) + 1)
        }
    }

    fn pll_hz(&self) -> u64 {
        let multiplier = u64::from(self.registers[CFGR] >> 18 & 0xf) + 2;
        self.pll_input_hz() * multiplier.min(16)
    }

    pub fn clocks(&self) -> Clocks {
        let sysclk = match self.source {
            ClockSource::Hsi => HSI_HZ,
            ClockSource::Hse => HSE_HZ,
            ClockSource::Pll => self.pll_hz(),
        };
        let cfgr = self.registers[CFGR];
        let apb = rcc::apb_shift(cfgr >> 8);
        let hclk = sysclk >> rcc::ahb_shift(cfgr);
        let pclk = hclk >> apb;
        let hsi14 = if self.registers[CR2] & CR2_HSI14ON != 0 { HSI14_HZ } else { 0 };
        let pll = if self.registers[CR] & CR_PLLON != 0 { self.pll_hz() } else { 0 };
        let lsi = if rcc::lsi_is_on(self.registers[CSR]) { self.lsi_hz } else { 0 };
        // Half of the PLL, because the STM32F051 does not have PLLNODIV (6.4.2).
        let mco = match cfgr >> 24 & 7 {
            1 => hsi14,
            2 => lsi,
            4 => sysclk,
            5 => self.hsi_hz(),
            6 => self.hse_hz(),
            7 => pll / 2,
            _ => 0,
        };
        Clocks { sysclk, hclk, pclk, timers: rcc::timers(pclk, apb), hsi14, mco }
    }

    /// Returns an error for each frequency in the clock tree that is out of range (6.2; data sheet
    /// DS8668, table "PLL characteristics").
    pub fn errors(&self) -> Vec<HardwareError> {
        let sysclk = self.clocks().sysclk;
        let mut errors = Vec::new();
        if sysclk > 48_000_000 {
            errors.push(HardwareError::ClockTooFast {
                clock: "SYSCLK",
                hz: sysclk,
                limit_hz: 48_000_000,
            });
        }
        let (input_hz, vco_hz) = (self.pll_input_hz(), self.pll_hz());
        let in_range = (1_000_000..=24_000_000).contains(&input_hz)
            && (16_000_000..=48_000_000).contains(&vco_hz);
        if self.registers[CR] & CR_PLLON != 0 && !in_range {
            errors.push(HardwareError::PllOutOfRange { input_hz, vco_hz });
        }
        errors
    }

    /// Returns true if the clock of the peripheral whose registers begin at `base` is on (6.4.6 to
    /// 6.4.8).
    pub fn is_clocked(&self, base: u32) -> bool {
        let (register, bit) = match base {
            // RTC and the independent watchdog have clocks of their own; EXTI has no enable bit.
            0x4000_2800 | 0x4000_3000 | 0x4001_0400 => return true,
            // The bits of both peripheral buses have the order of the addresses.
            0x4000_0000..=0x4000_7fff => (APB1ENR, base >> 10 & 0x1f),
            0x4001_0000 => (APB2ENR, 0),
            0x4001_2400 => (APB2ENR, 9),
            0x4001_2c00..=0x4001_5800 => (APB2ENR, base >> 10 & 0x1f),
            0x4002_0000 => (AHBENR, 0),
            0x4002_3000 => (AHBENR, 6),
            0x4002_4000 => (AHBENR, 24),
            0x4800_0000..=0x4800_17ff => (AHBENR, 17 + (base >> 10 & 7)),
            _ => return true,
        };
        self.registers[register] >> bit & 1 != 0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Width;
    use crate::stm32::rcc::CSR_RMVF;

    fn word(value: u32) -> Write {
        Write::new(0, Width::Word, value)
    }

    /// The Zooid's clock tree: 16 MHz / 2 * `multiplier`, with HSE at MCO.
    fn zooid(multiplier: u32) -> Rcc {
        let mut rcc = Rcc::new();
        rcc.write(0x00, word(0x83 | CR_HSEON));
        rcc.write(0x2c, word(1));
        rcc.write(0x04, word((multiplier - 2) << 18 | CFGR_PLLSRC_HSE | 6 << 24));
        rcc.write(0x2c, word(1));
        rcc.write(0x00, word(0x83 | CR_HSEON | CR_PLLON));
        let cfgr = rcc.read(0x04);
        rcc.write(0x04, word(cfgr | 2));
        rcc
    }

    #[test]
    fn reset_values_are_the_manuals() {
        // RM0091 6.4: CR 0x0000 XX83, CFGR 0, AHBENR 0x14, CSR 0x0C00 0000 after power-on, CR2 0x0000 XX80.
        let rcc = Rcc::new();
        assert_eq!(rcc.read(0x00) & 0xff, 0x83);
        assert_eq!(rcc.read(0x04), 0);
        assert_eq!(rcc.read(0x14), 0x14);
        assert_eq!(rcc.read(0x24), 0x0c00_0000);
        assert_eq!(rcc.read(0x34) & 0xff, 0x80);
        assert_eq!(rcc.clocks().hclk, 8_000_000);
        assert_eq!(rcc.clocks().mco, 0);
    }

    #[test]
    fn the_zooids_clock_tree() {
        let rcc = zooid(6);
        let clocks = rcc.clocks();
        assert_eq!([clocks.sysclk, clocks.hclk, clocks.pclk, clocks.timers], [48_000_000; 4]);
        assert_eq!(clocks.mco, 16_000_000);
        assert_eq!(rcc.read(0x04) >> 2 & 3, 2, "SWS shows the PLL");
        assert_eq!(rcc.errors(), []);
    }

    #[test]
    fn the_predivider_is_one_bit_in_two_registers() {
        let mut rcc = Rcc::new();
        rcc.write(0x04, word(CFGR_PLLXTPRE));
        assert_eq!(rcc.read(0x2c), 1);
        rcc.write(0x2c, word(4));
        assert_eq!(rcc.read(0x04), 0);
    }

    #[test]
    fn too_fast_a_pll_is_reported() {
        let errors = zooid(7).errors();
        let too_fast =
            HardwareError::ClockTooFast { clock: "SYSCLK", hz: 56_000_000, limit_hz: 48_000_000 };
        let out_of_range = HardwareError::PllOutOfRange { input_hz: 8_000_000, vco_hz: 56_000_000 };
        assert_eq!(errors, [too_fast, out_of_range]);
    }

    #[test]
    fn a_running_pll_keeps_its_factors() {
        let mut rcc = zooid(6);
        rcc.write(0x04, word(2 | 1 << 18 | CFGR_PLLSRC_HSE));
        assert_eq!(rcc.clocks().sysclk, 48_000_000);
        assert_eq!(rcc.clocks().mco, 0, "the rest of the register is open");
    }

    #[test]
    fn a_divided_bus_gives_timers_twice_its_clock() {
        let mut rcc = zooid(6);
        rcc.write(0x04, word(rcc.read(0x04) | 0b101 << 8));
        let clocks = rcc.clocks();
        assert_eq!((clocks.pclk, clocks.timers), (12_000_000, 24_000_000));
    }

    #[test]
    fn reset_causes_stay_until_removed() {
        let mut rcc = Rcc::new();
        rcc.write(0x24, word(CSR_RMVF));
        assert_eq!(rcc.read(0x24), 0);
        rcc.reset(ResetCause::IndependentWatchdog);
        rcc.reset(ResetCause::Software);
        assert_eq!(rcc.read(0x24), 1 << 26 | 1 << 28 | 1 << 29);
    }

    #[test]
    fn a_brown_out_looks_like_power_on() {
        let mut rcc = Rcc::new();
        rcc.write(0x24, word(CSR_RMVF));
        rcc.reset(ResetCause::Software);
        rcc.reset(ResetCause::BrownOut);
        assert_eq!(rcc.read(0x24), Rcc::new().read(0x24));
    }

    #[test]
    fn bits_of_the_clock_enable_registers() {
        let mut rcc = Rcc::new();
        // RM0091 6.4.6 to 6.4.8: bit of the register, first address of the peripheral.
        for (register, bit, base) in [
            (0x14, 0, 0x4002_0000),  // DMA
            (0x14, 6, 0x4002_3000),  // CRC
            (0x14, 17, 0x4800_0000), // GPIOA
            (0x14, 22, 0x4800_1400), // GPIOF
            (0x18, 0, 0x4001_0000),  // SYSCFG
            (0x18, 9, 0x4001_2400),  // ADC
            (0x18, 11, 0x4001_2c00), // TIM1
            (0x18, 12, 0x4001_3000), // SPI1
            (0x18, 14, 0x4001_3800), // USART1
            (0x18, 16, 0x4001_4000), // TIM15
            (0x18, 18, 0x4001_4800), // TIM17
            (0x18, 22, 0x4001_5800), // DBGMCU
            (0x1c, 0, 0x4000_0000),  // TIM2
            (0x1c, 4, 0x4000_1000),  // TIM6
            (0x1c, 8, 0x4000_2000),  // TIM14
            (0x1c, 21, 0x4000_5400), // I2C1
            (0x1c, 22, 0x4000_5800), // I2C2
            (0x1c, 28, 0x4000_7000), // PWR
        ] {
            assert!(!rcc.is_clocked(base), "{base:#x}");
            rcc.write(register, word(1 << bit));
            assert!(rcc.is_clocked(base), "{base:#x}");
        }
    }
}
