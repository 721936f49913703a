//! The flash interface (RM0090 3): wait states, and the errors of a firmware that writes to the
//! flash. Erasing and programming have no model: every sector counts as write-protected.

use crate::HardwareError;
use crate::stm32::Write;

const ACR: u32 = 0x00;
const KEYR: u32 = 0x04;
const SR: u32 = 0x0c;
const CR: u32 = 0x10;
const OPTCR: u32 = 0x14;

const KEYS: [u32; 2] = [0x4567_0123, 0xcdef_89ab];
const SR_WRPERR: u32 = 1 << 4;
const SR_PGSERR: u32 = 1 << 7;
/// The flags that are cleared by writing ones: end of operation, and the errors.
const SR_FLAGS: u32 = 0xf3;
const CR_PG: u32 = 1 << 0;
const CR_SER_MER: u32 = 3 << 1;
const CR_STRT: u32 = 1 << 16;
const CR_LOCK: u32 = 1 << 31;

pub(crate) struct Flash {
    acr: u32,
    sr: u32,
    cr: u32,
    optcr: u32,
    /// The number of keys written in the right order. A wrong key locks the interface until the
    /// next reset.
    keys: usize,
    is_locked_for_good: bool,
}

impl Flash {
    pub fn new() -> Self {
        let optcr = 0x0fff_aaed;
        Flash { acr: 0, sr: 0, cr: CR_LOCK, optcr, keys: 0, is_locked_for_good: false }
    }

    /// Returns an error if there are too few wait states: at 2.7 to 3.6 V, one for every started 30
    /// MHz beyond the first (3.5.1, table 10).
    pub fn error(&self, hz: u64) -> Option<HardwareError> {
        let wait_states = self.acr & 7;
        let needed = hz.div_ceil(30_000_000).saturating_sub(1) as u32;
        (wait_states < needed).then_some(HardwareError::FlashTooSlow { hz, wait_states, needed })
    }

    pub fn read(&self, offset: u32) -> u32 {
        match offset {
            ACR => self.acr,
            SR => self.sr,
            CR => self.cr,
            OPTCR => self.optcr,
            // The key registers cannot be read.
            _ => 0,
        }
    }

    pub fn write(&mut self, offset: u32, write: Write) {
        match offset {
            ACR => self.acr = write.merge(self.acr),
            KEYR if !self.is_locked_for_good => {
                if KEYS.get(self.keys) == Some(&write.ones()) {
                    self.keys += 1;
                    if self.keys == KEYS.len() {
                        self.cr &= !CR_LOCK;
                    }
                } else {
                    self.is_locked_for_good = true;
                    self.cr |= CR_LOCK;
                }
            }
            SR => self.sr &= !(write.ones() & SR_FLAGS),
            CR if self.cr & CR_LOCK == 0 => {
                self.cr = write.merge(self.cr);
                if self.cr & CR_LOCK != 0 {
                    self.keys = 0;
                }
                if self.cr & CR_STRT != 0 {
                    self.cr &= !CR_STRT;
                    let erases = self.cr & CR_SER_MER != 0;
                    self.sr |= if erases { SR_WRPERR } else { SR_PGSERR };
                }
            }
            // The option bytes have no model.
            _ => {}
        }
    }

    /// Performs a write of the core to the main memory, which never changes it. Without PG the write
    /// is a sequence error, and nothing else happens (3.9.5, PGSERR).
    pub fn program(&mut self) {
        self.sr |= if self.cr & CR_PG == 0 { SR_PGSERR } else { SR_WRPERR };
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Width;

    fn write(flash: &mut Flash, offset: u32, value: u32) {
        flash.write(offset, Write::new(offset, Width::Word, value));
    }

    #[test]
    fn wait_states_are_the_manuals() {
        // RM0090 table 10, 2.7 to 3.6 V: 0 up to 30 MHz, 1 up to 60, ... 5 up to 168.
        for (hz, needed) in [
            (16_000_000, 0),
            (30_000_000, 0),
            (30_000_001, 1),
            (60_000_000, 1),
            (120_000_000, 3),
            (150_000_000, 4),
            (168_000_000, 5),
        ] {
            let mut flash = Flash::new();
            flash.write(0, Write::new(0, Width::Word, needed));
            assert_eq!(flash.error(hz), None, "{hz}");
            if needed > 0 {
                flash.write(0, Write::new(0, Width::Word, needed - 1));
                let wait_states = needed - 1;
                let error = HardwareError::FlashTooSlow { hz, wait_states, needed };
                assert_eq!(flash.error(hz), Some(error));
            }
        }
    }

    #[test]
    fn a_write_to_locked_flash_is_a_sequence_error() {
        // RM0090 3.9.5: PGSERR is bit 7, WRPERR bit 4; both are cleared by writing 1.
        let mut flash = Flash::new();
        write(&mut flash, CR, CR_PG);
        assert_eq!(flash.read(CR), CR_LOCK, "LOCK protects it");
        flash.program();
        assert_eq!(flash.read(SR), 1 << 7);
        write(&mut flash, SR, 1 << 7);
        assert_eq!(flash.read(SR), 0);
    }

    #[test]
    fn two_keys_unlock_and_all_sectors_are_protected() {
        let mut flash = Flash::new();
        for key in KEYS {
            write(&mut flash, KEYR, key);
        }
        write(&mut flash, CR, CR_PG);
        assert_eq!(flash.read(CR), CR_PG);
        flash.program();
        assert_eq!(flash.read(SR), 1 << 4);
        write(&mut flash, CR, CR_LOCK);
        write(&mut flash, KEYR, KEYS[1]);
        write(&mut flash, KEYR, KEYS[0]);
        write(&mut flash, KEYR, KEYS[1]);
        assert_eq!(flash.read(CR), CR_LOCK, "a wrong key locks until the next reset");
    }
}
