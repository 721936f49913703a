//! The memories of an ATmega328P that a programmer reads and writes.

use bittybuzz_kilobot::calibration::{DUTIES, EEPROM, ERASED_DUTY, ID};
use bittybuzz_robot_spec::{Robot, find_script_section};

pub use bittybuzz_kilobot::calibration::ERASED_ID;

/// Bytes of the flash.
const FLASH_BYTES: usize = 0x8000;

/// The value of erased memory.
const ERASED: u8 = 0xff;

/// Bits of the lock byte that are all 0 if the flash cannot be read (data sheet, table 28-2).
const UNREADABLE: u8 = 0b11;

/// The length of a script's seal in bytes. The seal can end in bytes that look erased.
const SEAL: usize = 4;

/// Returns true if this robot is programmed through its ISP header.
pub fn is_programmed_by_isp(robot: &Robot) -> bool {
    robot.layout.is_none() && robot.chip.as_deref() == Some("ATmega328P")
}

/// Returns true if the lock byte lets the flash be read.
pub fn is_readable(lock: u8) -> bool {
    lock & UNREADABLE != 0
}

/// The calibration that a robot lacks. Its firmware then runs no script.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MissingCalibration {
    pub has_no_id: bool,
    /// True if one of the motor duties is erased.
    pub has_no_duties: bool,
}

/// The content of flash and EEPROM.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Memories {
    pub flash: Vec<u8>,
    pub eeprom: Vec<u8>,
    /// Bytes of the flash that the program may use; the boot loader follows them.
    program_bytes: usize,
}

impl Memories {
    /// Returns the memories of a robot from the bytes that were read. Erased bytes at the end may
    /// be missing, as in files of avrdude.
    pub fn new(mut flash: Vec<u8>, mut eeprom: Vec<u8>, robot: &Robot) -> Self {
        flash.resize(FLASH_BYTES, ERASED);
        eeprom.resize(EEPROM.into(), ERASED);
        let budget = robot.budget.map_or(FLASH_BYTES, |budget| budget.flash_bytes as usize);
        Memories { flash, eeprom, program_bytes: budget.min(FLASH_BYTES) }
    }

    /// Returns the program in the flash: up to the last byte that is not erased, and as many bytes
    /// more as its script needs.
    pub fn program(&self) -> &[u8] {
        let flash = &self.flash[..self.program_bytes];
        let last = flash.iter().rposition(|byte| *byte != ERASED).map_or(0, |last| last + 1);
        let mut programs = (last..=flash.len().min(last + SEAL)).map(|end| &flash[..end]);
        // Without a script there is no program, which the exchange of the script reports.
        programs.find(|program| find_script_section(program).is_ok()).unwrap_or(flash)
    }

    /// Returns true if there is a boot loader.
    pub fn has_boot_loader(&self) -> bool {
        self.flash[self.program_bytes..].iter().any(|byte| *byte != ERASED)
    }

    /// Replaces the program. The boot loader stays.
    pub fn set_program(&mut self, program: &[u8]) {
        let (used, free) = self.flash[..self.program_bytes].split_at_mut(program.len());
        used.copy_from_slice(program);
        free.fill(ERASED);
    }

    /// Replaces the id in the calibration.
    pub fn set_id(&mut self, id: u16) {
        let at = usize::from(ID);
        self.eeprom[at..at + 2].copy_from_slice(&id.to_le_bytes());
    }

    /// Returns the missing part of the calibration; `None` if it is complete.
    pub fn missing_calibration(&self) -> Option<MissingCalibration> {
        let cell = |address: u16| self.eeprom[usize::from(address)];
        let missing = MissingCalibration {
            has_no_id: cell(ID) == ERASED && cell(ID + 1) == ERASED,
            has_no_duties: DUTIES.iter().any(|address| cell(*address) == ERASED_DUTY),
        };
        (missing.has_no_id || missing.has_no_duties).then_some(missing)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bittybuzz_robot_files::find;

    fn memories(flash: &[u8], eeprom: &[u8]) -> Memories {
        Memories::new(flash.to_vec(), eeprom.to_vec(), &find("kilobot").unwrap())
    }

    #[test]
    fn missing_bytes_are_erased() {
        let memories = memories(&[1, 2], &[]);
        assert_eq!(memories.flash.len(), 0x8000);
        assert_eq!(memories.flash[..4], [1, 2, 0xff, 0xff]);
        assert_eq!(memories.eeprom, vec![0xff; 1024]);
        assert!(!memories.has_boot_loader());
    }

    /// The boot loader of kilolib begins at 0x7000.
    #[test]
    fn a_program_leaves_the_boot_loader() {
        let mut memories = memories(&vec![7; 0x8000], &[]);
        memories.set_program(&[1; 100]);
        let end = memories.program_bytes;
        assert_eq!(memories.flash[..100], [1; 100]);
        assert!(memories.flash[100..end].iter().all(|byte| *byte == 0xff));
        assert!(memories.flash[end..].iter().all(|byte| *byte == 7));
        assert!(end <= 0x7000 && memories.has_boot_loader());
    }

    #[test]
    fn an_id_completes_the_calibration() {
        let mut memories = memories(&[], &[0; 0xb0]);
        let missing = MissingCalibration { has_no_id: true, has_no_duties: false };
        assert_eq!(memories.missing_calibration(), Some(missing));
        memories.set_id(0x1234);
        assert_eq!(memories.eeprom[0xb0..0xb2], [0x34, 0x12]);
        assert_eq!(memories.missing_calibration(), None);
    }

    #[test]
    fn lock_bits_protect_the_flash() {
        assert!(is_readable(0xff) && !is_readable(0xfc));
    }
}
