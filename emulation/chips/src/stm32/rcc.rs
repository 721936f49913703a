//! The parts of reset and clock control that are the same in every STM32 (RM0090 6, RM0091 6).

use crate::ResetCause;

pub(crate) const CR_HSION: u32 = 1 << 0;
pub(crate) const CR_HSEON: u32 = 1 << 16;
pub(crate) const CR_HSEBYP: u32 = 1 << 18;
pub(crate) const CR_PLLON: u32 = 1 << 24;
/// The value of CR after a reset: HSI runs, with its trimming in the middle.
pub(crate) const CR_RESET: u32 = 0x83;
const BDCR_BDRST: u32 = 1 << 16;
const BDCR_LSERDY: u32 = 1 << 1;
const CSR_LSION: u32 = 1 << 0;
pub(crate) const CSR_RMVF: u32 = 1 << 24;
const CSR_PINRSTF: u32 = 1 << 26;
const CSR_SFTRSTF: u32 = 1 << 28;
const CSR_IWDGRSTF: u32 = 1 << 29;

/// The source of the system clock, in the order of SW and SWS in CFGR.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ClockSource {
    Hsi,
    Hse,
    Pll,
}

impl ClockSource {
    /// Returns the source after a write to CR or CFGR. The clock switches as soon as the selected
    /// source is ready (6.2.6). `control` is the value that a read of CR returns.
    pub fn after_write(self, cfgr: u32, control: u32) -> Self {
        let wanted = match cfgr & 3 {
            0 => ClockSource::Hsi,
            1 => ClockSource::Hse,
            2 => ClockSource::Pll,
            _ => return self,
        };
        // The ready bit of each source is one above the bit that turns the source on.
        if control & wanted.on() << 1 != 0 { wanted } else { self }
    }

    /// Returns the bit of CR that turns this source on. The source cannot be turned off while it
    /// drives the system clock (6.3.1, 6.4.1).
    pub fn on(self) -> u32 {
        match self {
            ClockSource::Hsi => CR_HSION,
            ClockSource::Hse => CR_HSEON,
            ClockSource::Pll => CR_PLLON,
        }
    }
}

/// Returns the value that a read of CR returns. For each bit of `oscillators`, the ready bit is one
/// above. Oscillators are ready at once. A crystal whose driver is bypassed never becomes ready,
/// and neither does a PLL in `plls_without_input`.
pub(crate) fn read_control(
    control: u32,
    oscillators: u32,
    has_crystal: bool,
    plls_without_input: u32,
) -> u32 {
    let mut ready = control & oscillators & !plls_without_input;
    if !crystal_runs(control | CR_HSEON, has_crystal) {
        ready &= !CR_HSEON;
    }
    control & !(oscillators << 1) | ready << 1
}

/// Returns true if the crystal oscillates.
pub(crate) fn crystal_runs(control: u32, has_crystal: bool) -> bool {
    control & (CR_HSEON | CR_HSEBYP) == CR_HSEON && has_crystal
}

/// Returns the value that a read of CFGR returns: SWS is the source of the system clock.
pub(crate) fn read_configuration(configuration: u32, source: ClockSource) -> u32 {
    configuration & !0xc | (source as u32) << 2
}

/// Returns the value that a read of BDCR returns. No board has a crystal of 32768 Hz, so LSE is
/// never ready.
pub(crate) fn read_backup(backup: u32) -> u32 {
    backup & !BDCR_LSERDY
}

/// Returns BDCR after a write: the reset of the backup domain clears all other bits.
pub(crate) fn write_backup(new: u32) -> u32 {
    if is_backup_reset(new) { BDCR_BDRST } else { new }
}

/// Returns true while the firmware keeps the backup domain in reset (6.3.20).
pub(crate) fn is_backup_reset(backup: u32) -> bool {
    backup & BDCR_BDRST != 0
}

/// Returns the value that a read of CSR returns: LSI is ready once it is on.
pub(crate) fn read_status(status: u32) -> u32 {
    status & !2 | (status & CSR_LSION) << 1
}

/// Returns true if LSI is on.
pub(crate) fn lsi_is_on(status: u32) -> bool {
    status & CSR_LSION != 0
}

/// Returns CSR after a write. RMVF clears all flags, which are the bits in `causes`.
pub(crate) fn write_status(old: u32, new: u32, causes: u32) -> u32 {
    if new & CSR_RMVF != 0 { new & CSR_LSION } else { old & causes | new & CSR_LSION }
}

/// Returns the flags of CSR that a reset sets, without those of the supply, which each type of chip
/// sets itself. Every cause inside the chip also pulls the reset pin (6.1.1, 6.1.2).
pub(crate) fn flags(cause: ResetCause) -> u32 {
    match cause {
        ResetCause::PowerOn | ResetCause::PowerOff | ResetCause::BrownOut => 0,
        ResetCause::Pin => CSR_PINRSTF,
        ResetCause::Software => CSR_SFTRSTF | CSR_PINRSTF,
        ResetCause::IndependentWatchdog => CSR_IWDGRSTF | CSR_PINRSTF,
    }
}

/// Returns the exponent of the power of two by which the field HPRE divides.
pub(crate) fn ahb_shift(configuration: u32) -> u32 {
    match configuration >> 4 & 0xf {
        divider @ 8..=11 => divider - 7,
        divider @ 12..=15 => divider - 6,
        _ => 0,
    }
}

/// Returns the exponent of the power of two by which a field PPRE divides.
pub(crate) fn apb_shift(field: u32) -> u32 {
    if field & 4 == 0 { 0 } else { (field & 3) + 1 }
}

/// Returns the clock of the timers on a bus: twice the clock of the bus, unless the bus is
/// undivided (6.2).
pub(crate) fn timers(bus_hz: u64, apb_shift: u32) -> u64 {
    if apb_shift == 0 { bus_hz } else { 2 * bus_hz }
}
