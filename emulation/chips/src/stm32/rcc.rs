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

/// The source of the system clock, as SW and SWS of CFGR number it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Source {
    Hsi,
    Hse,
    Pll,
}

impl Source {
    /// The source after a write to CR or CFGR: it is switched as soon as the wanted one is ready (6.2.6). `control` is CR as
    /// it is read.
    pub fn after_write(self, cfgr: u32, control: u32) -> Self {
        let wanted = match cfgr & 3 {
            0 => Source::Hsi,
            1 => Source::Hse,
            2 => Source::Pll,
            _ => return self,
        };
        // Each source has its ready bit one above the one that turns it on.
        if control & wanted.on() << 1 != 0 { wanted } else { self }
    }

    /// The bit of CR that turns it on. While it drives the system clock it cannot be turned off (6.3.1, 6.4.1).
    pub fn on(self) -> u32 {
        match self {
            Source::Hsi => CR_HSION,
            Source::Hse => CR_HSEON,
            Source::Pll => CR_PLLON,
        }
    }
}

/// CR as it is read: of the bits `oscillators`, the ready bits stand one above. Oscillators are ready at once; a crystal whose
/// driver is bypassed does not oscillate, nor does a PLL of the bits `plls_without_input`.
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

/// CFGR as it is read: SWS names the source of the system clock.
pub(crate) fn read_configuration(configuration: u32, source: Source) -> u32 {
    configuration & !0xc | (source as u32) << 2
}

/// BDCR as it is read. No board has a crystal of 32768 Hz: it is never ready.
pub(crate) fn read_backup(backup: u32) -> u32 {
    backup & !BDCR_LSERDY
}

/// BDCR after a write: the reset of the backup domain clears the rest.
pub(crate) fn write_backup(new: u32) -> u32 {
    if is_backup_reset(new) { BDCR_BDRST } else { new }
}

/// Returns true while the firmware keeps the backup domain in reset (6.3.20).
pub(crate) fn is_backup_reset(backup: u32) -> bool {
    backup & BDCR_BDRST != 0
}

/// CSR as it is read: LSI is ready once it is on.
pub(crate) fn read_status(status: u32) -> u32 {
    status & !2 | (status & CSR_LSION) << 1
}

/// Returns true if LSI is on.
pub(crate) fn lsi_is_on(status: u32) -> bool {
    status & CSR_LSION != 0
}

/// CSR after a write: of its flags, the bits `causes`, RMVF clears all.
pub(crate) fn write_status(old: u32, new: u32, causes: u32) -> u32 {
    if new & CSR_RMVF != 0 { new & CSR_LSION } else { old & causes | new & CSR_LSION }
}

/// Flags of CSR that a reset sets, but those of the supply, which are the chip's own. Every cause inside the chip also pulls the
/// reset pin (6.1.1, 6.1.2).
pub(crate) fn flags(cause: ResetCause) -> u32 {
    match cause {
        ResetCause::PowerOn | ResetCause::PowerOff | ResetCause::BrownOut => 0,
        ResetCause::Pin => CSR_PINRSTF,
        ResetCause::Software => CSR_SFTRSTF | CSR_PINRSTF,
        ResetCause::IndependentWatchdog => CSR_IWDGRSTF | CSR_PINRSTF,
    }
}

/// The power of two by which HPRE divides.
pub(crate) fn ahb_shift(configuration: u32) -> u32 {
    match configuration >> 4 & 0xf {
        divider @ 8..=11 => divider - 7,
        divider @ 12..=15 => divider - 6,
        _ => 0,
    }
}

/// The power of two by which a field PPRE divides.
pub(crate) fn apb_shift(field: u32) -> u32 {
    if field & 4 == 0 { 0 } else { (field & 3) + 1 }
}

/// The clock of the timers on a bus: twice that of the bus, unless that is undivided (6.2).
pub(crate) fn timers(bus_hz: u64, apb_shift: u32) -> u64 {
    if apb_shift == 0 { bus_hz } else { 2 * bus_hz }
}
