//! The small blocks: power controller (RM0090 5), backup registers (26) and the identity of the
//! chip (38, 39).

use crate::stm32::Write;

/// DBGMCU_IDCODE of the STM32F405, revision Y (38.6.1).
pub(crate) const DEBUG_ID: u32 = 0x100f_6413;

const PWR_CR_DBP: u32 = 1 << 8;
const PWR_CR_VOS: u32 = 1 << 14;
const PWR_CSR_VOSRDY: u32 = 1 << 14;

/// The power controller. The voltage regulator is ready at once.
pub(crate) struct Power {
    cr: u32,
    csr: u32,
}

impl Power {
    pub fn new() -> Self {
        Power { cr: PWR_CR_VOS, csr: 0 }
    }

    /// Returns true at voltage scale 1, which allows 168 MHz; scale 2 allows 144 MHz (5.1.3).
    pub fn is_scale_1(&self) -> bool {
        self.cr & PWR_CR_VOS != 0
    }

    /// Returns true if DBP is set; otherwise the backup domain is write-protected (5.1.2).
    pub fn is_backup_writable(&self) -> bool {
        self.cr & PWR_CR_DBP != 0
    }

    pub fn read(&self, offset: u32) -> u32 {
        match offset {
            0x00 => self.cr,
            0x04 => self.csr | PWR_CSR_VOSRDY,
            _ => 0,
        }
    }

    pub fn write(&mut self, offset: u32, write: Write) {
        match offset {
            // CWUF and CSBF clear flags and read as 0.
            0x00 => self.cr = write.merge(self.cr) & !0xc,
            0x04 => self.csr = write.merge(self.csr) & 0x300,
            _ => {}
        }
    }
}

/// Offset of the first backup register of the real-time clock, and their number (26.6.20).
const BACKUP: u32 = 0x50;
const BACKUP_REGISTERS: usize = 20;

/// The backup registers of the real-time clock. Only the reset of the backup domain clears them.
/// They need neither the clock of the RTC nor its write key (26.3.5). The real-time clock itself
/// has no model.
pub(crate) struct Backup {
    registers: [u32; BACKUP_REGISTERS],
}

impl Backup {
    pub fn new() -> Self {
        Backup { registers: [0; BACKUP_REGISTERS] }
    }

    /// Fills the registers with `content`.
    pub fn fill(&mut self, mut content: impl FnMut() -> u32) {
        self.registers.fill_with(&mut content);
    }

    fn index(offset: u32) -> Option<usize> {
        let index = offset.checked_sub(BACKUP)? as usize / 4;
        (index < BACKUP_REGISTERS).then_some(index)
    }

    /// Returns the register at this offset; none if it is no backup register.
    pub fn read(&self, offset: u32) -> Option<u32> {
        Self::index(offset).map(|index| self.registers[index])
    }

    /// Writes the register at this offset; returns false if it is no backup register.
    pub fn write(&mut self, offset: u32, write: Write) -> bool {
        let Some(index) = Self::index(offset) else {
            return false;
        };
        self.registers[index] = write.merge(self.registers[index]);
        true
    }
}

const AREA: u32 = 0x1fff_7000;
const AREA_END: u32 = 0x1fff_8000;
/// Offset of the one-time programmable bytes (3.8). Bitcraze stores the device type in the first
/// slot of 32 bytes.
const DEVICE_TYPE: usize = 0x800;
const DEVICE_TYPE_SLOT: usize = 32;
/// The one-time programmable bytes of all 16 slots.
pub const OTP: usize = 16 * DEVICE_TYPE_SLOT;
const UNIQUE_ID: usize = 0xa10;
const FLASH_KBYTES: usize = 0xa22;

/// The read-only bytes at 0x1fff_7000.
pub(crate) struct Identity {
    bytes: Vec<u8>,
}

impl Identity {
    pub fn new(unique_id: [u8; 12], device_type: &str) -> Self {
        let mut bytes = vec![0xff; (AREA_END - AREA) as usize];
        let slot = &mut bytes[DEVICE_TYPE..DEVICE_TYPE + DEVICE_TYPE_SLOT];
        slot.fill(0);
        // The slot ends with at least one zero.
        for (to, from) in slot[..DEVICE_TYPE_SLOT - 1].iter_mut().zip(device_type.bytes()) {
            *to = from;
        }
        bytes[UNIQUE_ID..UNIQUE_ID + 12].copy_from_slice(&unique_id);
        bytes[FLASH_KBYTES..FLASH_KBYTES + 2].copy_from_slice(&1024_u16.to_le_bytes());
        Identity { bytes }
    }

    /// Replaces the one-time programmable bytes, starting with the first; the rest is erased.
    pub fn set_otp(&mut self, content: &[u8]) {
        let otp = &mut self.bytes[DEVICE_TYPE..DEVICE_TYPE + OTP];
        otp.fill(0xff);
        for (to, from) in otp.iter_mut().zip(content) {
            *to = *from;
        }
    }

    /// Returns the word at `address`, if it is in this area.
    pub fn read(&self, address: u32) -> Option<u32> {
        if !(AREA..AREA_END).contains(&address) {
            return None;
        }
        let at = (address - AREA) as usize;
        let word = self.bytes.get(at..at + 4)?;
        Some(u32::from_le_bytes(word.try_into().ok()?))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Width;

    #[test]
    fn there_are_twenty_backup_registers() {
        let mut backup = Backup::new();
        let word = |value| Write::new(0, Width::Word, value);
        assert!(backup.write(0x50, word(7)) && backup.write(0x9c, word(9)));
        assert!(!backup.write(0x4c, word(1)) && !backup.write(0xa0, word(1)));
        assert_eq!(
            [0x4c, 0x50, 0x9c, 0xa0].map(|offset| backup.read(offset)),
            [None, Some(7), Some(9), None]
        );
    }

    #[test]
    fn identity_has_the_manuals_address() {
        let identity = Identity::new(*b"0123456789ab", "0;CF21");
        assert_eq!(identity.read(0x1fff_7a10), Some(u32::from_le_bytes(*b"0123")));
        assert_eq!(identity.read(0x1fff_7a18), Some(u32::from_le_bytes(*b"89ab")));
        assert_eq!(identity.read(0x1fff_7800), Some(u32::from_le_bytes(*b"0;CF")));
        assert_eq!(identity.read(0x1fff_7a20).map(|word| word >> 16), Some(1024));
        assert_eq!(identity.read(0x4000_0000), None);
    }

    #[test]
    fn unprogrammed_otp_bytes_read_as_erased() {
        let mut identity = Identity::new(*b"0123456789ab", "0;CF21");
        identity.set_otp(b"\0\0\0\0buzz");
        let words = [0x1fff_7800, 0x1fff_7804, 0x1fff_7808, 0x1fff_79fc];
        let word = |bytes: [u8; 4]| Some(u32::from_le_bytes(bytes));
        let expected = [word([0; 4]), word(*b"buzz"), word([0xff; 4]), word([0xff; 4])];
        assert_eq!(words.map(|address| identity.read(address)), expected);
        identity.set_otp(&[1; OTP + 100]);
        assert_eq!(identity.read(0x1fff_7a10), word(*b"0123"), "no further than their end");
    }
}
