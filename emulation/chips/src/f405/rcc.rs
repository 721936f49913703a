//! Reset and clock control (RM0090 6).

use crate::stm32::Write;
use crate::stm32::rcc::{self, CR_HSEON, CR_HSION, CR_PLLON, CR_RESET, ClockSource};
use crate::{HardwareError, ResetCause};

/// Registers by offset / 4.
const CR: usize = 0;
const PLLCFGR: usize = 1;
const CFGR: usize = 0x08 / 4;
const AHB1RSTR: usize = 0x10 / 4;
const AHB1ENR: usize = 0x30 / 4;
const AHB2ENR: usize = 0x34 / 4;
const APB1ENR: usize = 0x40 / 4;
const APB2ENR: usize = 0x44 / 4;
const AHB1LPENR: usize = 0x50 / 4;
const BDCR: usize = 0x70 / 4;
const CSR: usize = 0x74 / 4;
const PLLI2SCFGR: usize = 0x84 / 4;
const REGISTERS: usize = PLLI2SCFGR + 1;

const CR_PLLI2SON: u32 = 1 << 26;
const CR_ON: u32 = CR_HSION | CR_HSEON | CR_PLLON | CR_PLLI2SON;
const PLLCFGR_PLLSRC_HSE: u32 = 1 << 22;
const CSR_CAUSES: u32 = 0xfe00_0000;

const HSI_HZ: u64 = 16_000_000;
/// The crystal on the Crazyflie's board.
const HSE_HZ: u64 = 8_000_000;

/// The frequencies in Hz that the registers set.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Clocks {
    pub sysclk: u64,
    /// The frequency of AHB and the core.
    pub hclk: u64,
    pub pclk1: u64,
    pub pclk2: u64,
    /// The frequency of the timers on APB1.
    pub timers1: u64,
}

pub(crate) struct Rcc {
    registers: [u32; REGISTERS],
    source: ClockSource,
    /// False if the crystal never oscillates.
    has_crystal: bool,
}

impl Rcc {
    pub fn new() -> Self {
        let registers = [0; REGISTERS];
        let mut rcc = Rcc { registers, source: ClockSource::Hsi, has_crystal: true };
        rcc.reset(ResetCause::PowerOn);
        rcc
    }

    /// Sets all registers to their reset values, except those of the backup domain. The flags of
    /// the causes accumulate until the firmware clears them or power is cut (6.3.21). Every cause
    /// inside the chip also pulls the reset pin (6.1.1).
    pub fn reset(&mut self, cause: ResetCause) {
        let (backup, causes) = match cause {
            ResetCause::PowerOn => (0, 0),
            _ => (self.registers[BDCR], self.registers[CSR] & CSR_CAUSES),
        };
        self.registers = [0; REGISTERS];
        self.registers[CR] = CR_RESET;
        self.registers[PLLCFGR] = 0x2400_3010;
        self.registers[AHB1ENR] = 0x0010_0000;
        // AHB1LPENR to APB2LPENR have the values of the chips of this family that have Ethernet and
        // a camera interface.
        for (register, value) in
            [0x7e67_91ff, 0xf1, 1, 0, 0x36fe_c9ff, 0x0007_5f33].into_iter().enumerate()
        {
            self.registers[AHB1LPENR + register] = value;
        }
        self.registers[PLLI2SCFGR] = 0x2000_3000;
        self.registers[BDCR] = backup;
        self.registers[CSR] = causes
            | match cause {
                ResetCause::PowerOn => 0x0e00_0000,
                ResetCause::BrownOut => 1 << 26 | 1 << 25,
                _ => rcc::flags(cause),
            };
        self.source = ClockSource::Hsi;
    }

    pub fn read(&self, offset: u32) -> u32 {
        let register = offset as usize / 4;
        let value = self.registers.get(register).copied().unwrap_or(0);
        match register {
            CR => {
                let without_input =
                    if self.pll_input_hz() == 0 { CR_PLLON | CR_PLLI2SON } else { 0 };
                rcc::read_control(value, CR_ON, self.has_crystal, without_input)
            }
            CFGR => rcc::read_configuration(value, self.source),
            BDCR => rcc::read_backup(value),
            CSR => rcc::read_status(value),
            _ => value,
        }
    }

    /// Writes a register. If it is a register that resets peripherals, returns its number (0 for
    /// AHB1RSTR to 5 for APB2RSTR) and the bits that were set.
    pub fn write(&mut self, offset: u32, write: Write) -> Option<(usize, u32)> {
        let register = offset as usize / 4;
        let old = *self.registers.get(register)?;
        let mut new = write.merge(old);
        match register {
            CR => new |= self.source.on(),
            // The PLL's configuration is locked while it runs (6.3.2).
            PLLCFGR if self.registers[CR] & CR_PLLON != 0 => new = old,
            BDCR => new = rcc::write_backup(new),
            CSR => new = rcc::write_status(old, new, CSR_CAUSES),
            _ => {}
        }
        self.registers[register] = new;
        self.source = self.source.after_write(self.registers[CFGR], self.read(0));
        (AHB1RSTR..=AHB1RSTR + 5).contains(&register).then(|| (register - AHB1RSTR, new & !old))
    }

    /// Sets the crystal's state: it oscillates when it is turned on, or never does.
    pub fn set_crystal(&mut self, works: bool) {
        self.has_crystal = works;
    }

    /// Returns true while the firmware keeps the backup domain in reset (6.3.20).
    pub fn is_backup_reset(&self) -> bool {
        rcc::is_backup_reset(self.registers[BDCR])
    }

    fn pll_input_hz(&self) -> u64 {
        let source = if self.registers[PLLCFGR] & PLLCFGR_PLLSRC_HSE == 0 {
            if self.registers[CR] & CR_HSION != 0 { HSI_HZ } else { 0 }
        } else if rcc::crystal_runs(self.registers[CR], self.has_crystal) {
            HSE_HZ
        } else {
            0
        };
        let divider = u64::from(self.registers[PLLCFGR] & 0x3f);
        source.checked_div(divider).unwrap_or(0)
    }

    fn vco_hz(&self) -> u64 {
        self.pll_input_hz() * u64::from(self.registers[PLLCFGR] >> 6 & 0x1ff)
    }

    pub fn clocks(&self) -> Clocks {
        let sysclk = match self.source {
            ClockSource::Hsi => HSI_HZ,
            ClockSource::Hse => HSE_HZ,
            ClockSource::Pll => {
                self.vco_hz() / (2 * (u64::from(self.registers[PLLCFGR] >> 16 & 3) + 1))
            }
        };
        let cfgr = self.registers[CFGR];
        let (apb1, apb2) = (rcc::apb_shift(cfgr >> 10), rcc::apb_shift(cfgr >> 13));
        let hclk = sysclk >> rcc::ahb_shift(cfgr);
        let pclk1 = hclk >> apb1;
        let timers1 = rcc::timers(pclk1, apb1);
        Clocks { sysclk, hclk, pclk1, pclk2: hclk >> apb2, timers1 }
    }

    /// Returns an error for each frequency in the clock tree that is out of range, at voltage scale
    /// 1 or 2.
    pub fn errors(&self, scale_1: bool) -> Vec<HardwareError> {
        let clocks = self.clocks();
        let core = if scale_1 { 168_000_000 } else { 144_000_000 };
        let mut errors = Vec::new();
        for (clock, hz, limit_hz) in [
            ("SYSCLK", clocks.sysclk, 168_000_000),
            ("AHB", clocks.hclk, core),
            ("APB1", clocks.pclk1, 42_000_000),
            ("APB2", clocks.pclk2, 84_000_000),
        ] {
            if hz > limit_hz {
                errors.push(HardwareError::ClockTooFast { clock, hz, limit_hz });
            }
        }
        let (input_hz, vco_hz) = (self.pll_input_hz(), self.vco_hz());
        let in_range = (950_000..=2_100_000).contains(&input_hz)
            && (100_000_000..=432_000_000).contains(&vco_hz);
        if self.registers[CR] & CR_PLLON != 0 && !in_range {
            errors.push(HardwareError::PllOutOfRange { input_hz, vco_hz });
        }
        errors
    }

    /// Returns true if the clock of the peripheral whose registers begin at `base` is on.
    pub fn is_clocked(&self, base: u32) -> bool {
        let slot = base >> 10 & 0x3f;
        let (register, bit) = match base {
            // RTC and the independent watchdog have clocks of their own.
            0x4000_2800 | 0x4000_3000 => return true,
            // The bits of APB1 have the order of the addresses.
            0x4000_0000..=0x4000_7fff => (APB1ENR, slot),
            // External interrupts have no enable bit.
            0x4001_3c00 => return true,
            // ADC1 to ADC3, and their common registers.
            0x4001_2000 => (APB2ENR, 8),
            0x4001_2100 => (APB2ENR, 9),
            0x4001_2200 => (APB2ENR, 10),
            0x4001_2300 => return self.registers[APB2ENR] & 7 << 8 != 0,
            0x4001_0000..=0x4001_4bff => (APB2ENR, slot),
            0x4002_0000..=0x4002_23ff => (AHB1ENR, slot),
            0x4002_3000 => (AHB1ENR, 12),
            0x4002_6000 => (AHB1ENR, 21),
            0x4002_6400 => (AHB1ENR, 22),
            0x4004_0000..=0x4007_ffff => (AHB1ENR, 29),
            0x5000_0000..=0x5003_ffff => (AHB2ENR, 7),
            0x5006_0800 => (AHB2ENR, 6),
            _ => return true,
        };
        self.registers[register] >> bit & 1 != 0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Width;
    use crate::stm32::rcc::{CR_HSEBYP, CSR_RMVF};

    fn word(value: u32) -> Write {
        Write::new(0, Width::Word, value)
    }

    /// Bitcraze's clock tree: 8 MHz / 8 * 336 / 2, APB1 / 4, APB2 / 2.
    fn crazyflie(n: u32) -> Rcc {
        let mut rcc = Rcc::new();
        rcc.write(0x00, word(0x83 | CR_HSEON));
        rcc.write(0x04, word(8 | n << 6 | PLLCFGR_PLLSRC_HSE | 7 << 24));
        rcc.write(0x00, word(0x83 | CR_HSEON | CR_PLLON));
        rcc.write(0x08, word(2 | 0b101 << 10 | 0b100 << 13));
        rcc
    }

    #[test]
    fn reset_values_are_the_manuals() {
        // RM0090 6.3: RCC_CR 0x0000 XX83, PLLCFGR 0x2400 3010, CFGR 0, AHB1ENR 0x0010 0000, CSR 0x0E00 0000.
        let rcc = Rcc::new();
        assert_eq!(rcc.read(0x00) & 0xff, 0x83);
        assert_eq!(rcc.read(0x04), 0x2400_3010);
        assert_eq!(rcc.read(0x08), 0);
        assert_eq!(rcc.read(0x30), 0x0010_0000);
        assert_eq!(rcc.read(0x74), 0x0e00_0000);
        assert_eq!(rcc.clocks().hclk, 16_000_000);
        assert_eq!(rcc.clocks().timers1, 16_000_000, "undivided APB1 does not double");
    }

    #[test]
    fn the_crazyflies_clock_tree() {
        let rcc = crazyflie(336);
        let expected = Clocks {
            sysclk: 168_000_000,
            hclk: 168_000_000,
            pclk1: 42_000_000,
            pclk2: 84_000_000,
            timers1: 84_000_000,
        };
        assert_eq!(rcc.clocks(), expected);
        assert_eq!(rcc.read(0x08) >> 2 & 3, 2, "SWS shows the PLL");
        assert_eq!(rcc.errors(true), []);
        let too_fast =
            HardwareError::ClockTooFast { clock: "AHB", hz: 168_000_000, limit_hz: 144_000_000 };
        assert_eq!(rcc.errors(false), [too_fast]);
    }

    #[test]
    fn too_fast_a_pll_is_reported() {
        let rcc = crazyflie(400);
        let errors = rcc.errors(true);
        for clock in ["SYSCLK", "AHB", "APB1", "APB2"] {
            assert!(errors.iter().any(
                |error| matches!(error, HardwareError::ClockTooFast { clock: name, .. } if *name == clock)
            ));
        }
        let out_of_range =
            HardwareError::PllOutOfRange { input_hz: 1_000_000, vco_hz: 440_000_000 };
        assert!(crazyflie(440).errors(true).contains(&out_of_range));
    }

    #[test]
    fn the_switch_waits_for_its_source() {
        let mut rcc = Rcc::new();
        rcc.write(0x08, word(1));
        assert_eq!(rcc.read(0x08), 1, "SWS stays at HSI while HSE is off");
        rcc.write(0x00, word(0x83 | CR_HSEON));
        assert_eq!(rcc.read(0x08), 1 | 1 << 2);
        rcc.write(0x00, word(0x83));
        assert_ne!(rcc.read(0x00) & CR_HSEON, 0, "the source of the system clock stays on");
    }

    #[test]
    fn a_bypassed_crystal_does_not_oscillate() {
        let mut rcc = Rcc::new();
        rcc.write(0x00, word(0x83 | CR_HSEON | CR_HSEBYP));
        assert_eq!(rcc.read(0x00) & CR_HSEON << 1, 0);
    }

    #[test]
    fn a_dead_crystal_is_never_ready_and_drives_no_pll() {
        let mut rcc = Rcc::new();
        rcc.set_crystal(false);
        rcc.write(0x00, word(0x83 | CR_HSEON));
        rcc.write(0x04, word(8 | 336 << 6 | PLLCFGR_PLLSRC_HSE | 7 << 24));
        rcc.write(0x00, word(0x83 | CR_HSEON | CR_PLLON));
        assert_eq!(rcc.read(0x00) & (CR_HSEON | CR_PLLON) << 1, 0);
    }

    #[test]
    fn power_on_and_brown_out_are_distinguished() {
        let mut rcc = Rcc::new();
        rcc.write(0x74, word(CSR_RMVF));
        rcc.reset(ResetCause::BrownOut);
        // RM0090 6.3.21: BORRSTF bit 25, PINRSTF bit 26, PORRSTF bit 27.
        assert_eq!(rcc.read(0x74), 1 << 25 | 1 << 26);
        rcc.reset(ResetCause::Software);
        rcc.reset(ResetCause::PowerOn);
        assert_eq!(rcc.read(0x74), 0x0e00_0000, "power-on clears the other flags");
    }

    #[test]
    fn reset_causes_stay_until_removed() {
        let mut rcc = Rcc::new();
        rcc.write(0x74, word(CSR_RMVF));
        assert_eq!(rcc.read(0x74), 0);
        rcc.reset(ResetCause::IndependentWatchdog);
        rcc.reset(ResetCause::Software);
        assert_eq!(rcc.read(0x74), 1 << 26 | 1 << 28 | 1 << 29);
    }

    #[test]
    fn bits_of_the_clock_enable_registers() {
        let mut rcc = Rcc::new();
        // RM0090 6.3.10 to 6.3.14: bit of the register, first address of the peripheral.
        for (register, bit, base) in [
            (0x30, 2, 0x4002_0800),  // GPIOC
            (0x30, 22, 0x4002_6400), // DMA2
            (0x40, 0, 0x4000_0000),  // TIM2
            (0x40, 3, 0x4000_0c00),  // TIM5
            (0x40, 28, 0x4000_7000), // PWR
            (0x40, 23, 0x4000_5c00), // I2C3
            (0x44, 5, 0x4001_1400),  // USART6
            (0x44, 8, 0x4001_2000),  // ADC1
            (0x44, 9, 0x4001_2100),  // ADC2
            (0x44, 12, 0x4001_3000), // SPI1
            (0x40, 5, 0x4000_1400),  // TIM7
            (0x44, 14, 0x4001_3800), // SYSCFG
        ] {
            assert!(!rcc.is_clocked(base), "{base:#x}");
            rcc.write(register, word(1 << bit));
            assert!(rcc.is_clocked(base), "{base:#x}");
        }
    }
}
