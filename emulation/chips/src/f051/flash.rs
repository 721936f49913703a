//! The flash interface (RM0091 3): wait states, and erasing and programming of the main memory by
//! the firmware.

use crate::stm32::Write;
use crate::{HardwareError, Time};

const ACR: u32 = 0x00;
const KEYR: u32 = 0x04;
const OPTKEYR: u32 = 0x08;
const SR: u32 = 0x0c;
const CR: u32 = 0x10;
const AR: u32 = 0x14;
const OBR: u32 = 0x1c;
const WRPR: u32 = 0x20;

const KEYS: [u32; 2] = [0x4567_0123, 0xcdef_89ab];
const SR_PGERR: u32 = 1 << 2;
const SR_WRPRTERR: u32 = 1 << 4;
const SR_EOP: u32 = 1 << 5;
const CR_PG: u32 = 1 << 0;
const CR_PER: u32 = 1 << 1;
const CR_STRT: u32 = 1 << 6;
const CR_LOCK: u32 = 1 << 7;
const CR_ERRIE: u32 = 1 << 10;
const CR_EOPIE: u32 = 1 << 12;

pub(super) const START: u32 = 0x0800_0000;
pub(super) const SIZE: u32 = 64 * 1024;
pub(super) const PAGE: u32 = 1024;
/// Typical durations from the data sheet (DS8668, table "Flash memory characteristics"): erasing a
/// page, programming a halfword.
const ERASE: Time = Time::from_millis(30);
const PROGRAM: Time = Time::from_nanos(53_500);

/// A change of the flash, during which the core waits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FlashChange {
    /// First address that changes.
    pub address: u32,
    /// The new content.
    pub content: FlashContent,
    /// The time for which a core that runs from the flash waits (3.2.2).
    pub takes: Time,
}

/// The new content of the changed part of the flash.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FlashContent {
    /// A page of this number of bytes, all 0xff.
    Erased(u32),
    /// A halfword.
    Halfword(u16),
}

pub(crate) struct FlashInterface {
    acr: u32,
    sr: u32,
    cr: u32,
    ar: u32,
    /// The number of keys written in the right order. A wrong key locks the interface until the
    /// next reset.
    keys: usize,
    locked_for_good: bool,
}

impl FlashInterface {
    pub fn new() -> Self {
        FlashInterface { acr: 0x30, sr: 0, cr: CR_LOCK, ar: 0, keys: 0, locked_for_good: false }
    }

    /// Returns an error if there are too few wait states: the flash needs one above 24 MHz (3.5.1).
    pub fn error(&self, hz: u64) -> Option<HardwareError> {
        let wait_states = self.acr & 7;
        let needed = u32::from(hz > 24_000_000);
        (wait_states < needed).then_some(HardwareError::FlashTooSlow { hz, wait_states, needed })
    }

    pub fn interrupt(&self) -> bool {
        self.sr & SR_EOP != 0 && self.cr & CR_EOPIE != 0
            || self.sr & (SR_PGERR | SR_WRPRTERR) != 0 && self.cr & CR_ERRIE != 0
    }

    pub fn read(&self, offset: u32) -> u32 {
        match offset {
            ACR => self.acr,
            // BSY is never visible, because the core waits until an operation is over.
            SR => self.sr,
            CR => self.cr,
            AR => self.ar,
            // The option bytes as delivered, without protection (3.5.7, 3.5.8).
            OBR => 0x03ff_fff2,
            WRPR => 0xffff_ffff,
            _ => 0,
        }
    }

    /// Writes a register; returns the change of the flash.
    pub fn write(&mut self, offset: u32, write: Write) -> Option<FlashChange> {
        match offset {
            // PRFTBS follows PRFTBE.
            ACR => {
                let new = write.merge(self.acr) & 0x1f;
                self.acr = new | (new & 0x10) << 1;
            }
            KEYR if !self.locked_for_good => {
                if KEYS.get(self.keys) == Some(&write.ones()) {
                    self.keys += 1;
                    if self.keys == KEYS.len() {
                        self.cr &= !CR_LOCK;
                    }
                } else {
                    self.locked_for_good = true;
                }
            }
            OPTKEYR => {}
            SR => self.sr &= !(write.ones() & (SR_PGERR | SR_WRPRTERR | SR_EOP)),
            AR => self.ar = write.merge(self.ar),
            CR if self.cr & CR_LOCK == 0 => {
                self.cr = write.merge(self.cr);
                if self.cr & CR_LOCK != 0 {
                    self.keys = 0;
                }
                if self.cr & CR_STRT != 0 {
                    self.cr &= !CR_STRT;
                    if self.cr & CR_PER != 0 && self.ar.wrapping_sub(START) < SIZE {
                        self.sr |= SR_EOP;
                        let content = FlashContent::Erased(PAGE);
                        let address = self.ar & !(PAGE - 1);
                        return Some(FlashChange { address, content, takes: ERASE });
                    }
                }
            }
            _ => {}
        }
        None
    }

    /// Performs a write of a halfword by the core to the main memory, over `old`. Only an erased
    /// halfword can be programmed, or any halfword to zero (3.2.2).
    pub fn program(&mut self, address: u32, old: u16, new: u16) -> Option<FlashChange> {
        if self.cr & (CR_LOCK | CR_PG) != CR_PG {
            self.sr |= SR_PGERR;
            return None;
        }
        if old != 0xffff && new != 0 {
            self.sr |= SR_PGERR;
            return None;
        }
        self.sr |= SR_EOP;
        Some(FlashChange { address, content: FlashContent::Halfword(new), takes: PROGRAM })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Width;

    fn write(flash: &mut FlashInterface, offset: u32, value: u32) -> Option<FlashChange> {
        flash.write(offset, Write::new(offset, Width::Word, value))
    }

    fn unlocked() -> FlashInterface {
        let mut flash = FlashInterface::new();
        for key in KEYS {
            assert_eq!(write(&mut flash, KEYR, key), None);
        }
        assert_eq!(flash.read(CR), 0);
        flash
    }

    #[test]
    fn reset_values_and_wait_states_are_the_manuals() {
        // RM0091 3.5.1 and 3.5.5; table of ACR.LATENCY.
        let mut flash = FlashInterface::new();
        assert_eq!(flash.read(ACR), 0x30);
        assert_eq!(flash.read(CR), 0x80);
        assert_eq!(flash.error(24_000_000), None);
        let error = HardwareError::FlashTooSlow { hz: 48_000_000, wait_states: 0, needed: 1 };
        assert_eq!(flash.error(48_000_000), Some(error));
        write(&mut flash, ACR, 0x11);
        assert_eq!(flash.error(48_000_000), None);
    }

    #[test]
    fn erases_the_page_of_the_address_register() {
        let mut flash = unlocked();
        write(&mut flash, CR, CR_PER);
        write(&mut flash, AR, 0x0800_fc10);
        let change = write(&mut flash, CR, CR_PER | CR_STRT).unwrap();
        assert_eq!(change.address, 0x0800_fc00);
        assert_eq!(change.content, FlashContent::Erased(1024));
        assert_eq!(flash.read(SR), SR_EOP);
        write(&mut flash, SR, SR_EOP);
        assert_eq!(flash.read(SR), 0);
    }

    #[test]
    fn programs_erased_halfwords_only() {
        let mut flash = unlocked();
        assert_eq!(flash.program(START, 0xffff, 1), None, "PG is not set");
        assert_eq!(flash.read(SR), SR_PGERR);
        write(&mut flash, SR, SR_PGERR);
        write(&mut flash, CR, CR_PG);
        let change = flash.program(START + 2, 0xffff, 0x1234).unwrap();
        assert_eq!(change.content, FlashContent::Halfword(0x1234));
        assert_eq!(
            flash.program(START + 2, 0x1234, 0x1230),
            None,
            "bits cannot go down one by one"
        );
        assert!(flash.program(START + 2, 0x1234, 0).is_some(), "but all of them can");
    }

    #[test]
    fn a_wrong_key_locks_until_reset() {
        let mut flash = FlashInterface::new();
        write(&mut flash, KEYR, KEYS[0]);
        write(&mut flash, KEYR, 0);
        for key in KEYS {
            write(&mut flash, KEYR, key);
        }
        assert_eq!(flash.read(CR), CR_LOCK);
        assert_eq!(write(&mut flash, CR, CR_PER | CR_STRT), None);
    }
}
