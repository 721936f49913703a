//! The EEPROM (chapter 8.4).

/// EECR.
const EERE: u8 = 1 << 0;
const EEPE: u8 = 1 << 1;
const EEMPE: u8 = 1 << 2;
const EERIE: u8 = 1 << 3;
const MODE: u8 = 3 << 4;

/// Bytes of EEPROM.
pub const SIZE: usize = 1024;
/// The duration of an erase and write in cycles of the calibrated oscillator (table 8-2).
const ERASE_AND_WRITE: u64 = 26_368;
/// The number of cycles after which hardware clears EEMPE. The write comes at least one cycle after
/// EEMPE.
const UNLOCKED: u64 = 4;
/// Cycles for which the core halts (8.6.3).
const READ_HALT: u64 = 4;
const WRITE_HALT: u64 = 2;

/// The EEPROM and its registers.
#[derive(Clone, Debug)]
pub struct Eeprom {
    pub cells: [u8; SIZE],
    address: u16,
    data: u8,
    control: u8,
    unlocked_until: u64,
    done: Option<u64>,
}

impl Eeprom {
    pub fn new(cells: [u8; SIZE]) -> Self {
        Eeprom { cells, address: 0, data: 0, control: 0, unlocked_until: 0, done: None }
    }

    /// Sets the registers to their reset values; a write in progress goes on.
    pub fn reset(&mut self) {
        (self.control, self.unlocked_until) = (0, 0);
    }

    /// Aborts a write in progress because the supply is too low. Its cell then holds `value`, and
    /// all others are unchanged (8.4.2, "Preventing EEPROM Corruption").
    pub fn cut(&mut self, value: u8) {
        if self.done.take().is_some() {
            self.cells[usize::from(self.address)] = value;
        }
    }

    pub fn next_event(&self) -> Option<u64> {
        self.done
    }

    pub fn advance(&mut self, now: u64) {
        if self.done.is_some_and(|done| done <= now) {
            self.done = None;
            self.control &= !EEPE;
        }
    }

    pub fn interrupts(&self) -> bool {
        self.control & EERIE != 0 && self.done.is_none()
    }

    pub fn control(&self) -> u8 {
        self.control | if self.done.is_some() { EEPE } else { 0 }
    }

    pub fn data(&self) -> u8 {
        self.data
    }

    pub fn set_data(&mut self, data: u8) {
        self.data = data;
    }

    pub fn address(&self) -> [u8; 2] {
        self.address.to_le_bytes()
    }

    /// Writes a byte of EEAR, which is not possible while a cell is written (8.6.3).
    pub fn set_address(&mut self, byte: usize, value: u8) {
        if self.done.is_some() {
            return;
        }
        let mut bytes = self.address();
        bytes[byte] = value;
        self.address = u16::from_le_bytes(bytes) % SIZE as u16;
    }

    /// Writes EECR and returns the number of cycles for which the core halts. A write does not
    /// start while the flash is written.
    pub fn set_control(&mut self, value: u8, now: u64, is_flash_busy: bool) -> u64 {
        let is_unlocked = self.control & EEMPE != 0 && now <= self.unlocked_until;
        self.control = value & (EERIE | MODE);
        if value & EEMPE != 0 && value & EEPE == 0 {
            self.control |= EEMPE;
            self.unlocked_until = now + UNLOCKED;
        }
        if self.done.is_some() {
            return 0;
        }
        if value & EEPE != 0 && is_unlocked && !is_flash_busy {
            let cell = &mut self.cells[usize::from(self.address)];
            // Erase and write; erase only; write only.
            let time = match value >> 4 & 3 {
                0 => {
                    *cell = self.data;
                    ERASE_AND_WRITE
                }
                1 => {
                    *cell = 0xff;
                    ERASE_AND_WRITE / 2
                }
                _ => {
                    *cell &= self.data;
                    ERASE_AND_WRITE / 2
                }
            };
            self.done = Some(now + time);
            return WRITE_HALT;
        }
        if value & EERE != 0 {
            self.data = self.cells[usize::from(self.address)];
            return READ_HALT;
        }
        0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn eeprom() -> Eeprom {
        let mut eeprom = Eeprom::new([0xff; SIZE]);
        eeprom.set_address(0, 0xb0);
        eeprom.set_data(0x5a);
        eeprom
    }

    #[test]
    fn a_write_takes_its_time_and_only_one_at_a_time_is_done() {
        let mut eeprom = eeprom();
        assert_eq!(eeprom.set_control(EEMPE, 10, false), 0);
        assert_eq!(eeprom.set_control(EEMPE | EEPE, 12, false), 2);
        assert_eq!(eeprom.next_event(), Some(12 + 26_368));
        eeprom.set_data(0);
        eeprom.set_control(EEMPE, 20, false);
        eeprom.set_control(EEMPE | EEPE, 21, false);
        eeprom.advance(12 + 26_367);
        assert_ne!(eeprom.control() & EEPE, 0);
        eeprom.advance(12 + 26_368);
        assert_eq!(eeprom.control() & EEPE, 0);
        assert_eq!(eeprom.set_control(EERE, 30_000, false), 4);
        assert_eq!(eeprom.data(), 0x5a);
    }

    #[test]
    fn a_cut_write_leaves_its_cell_undefined_and_no_other() {
        let mut eeprom = eeprom();
        eeprom.set_control(EEMPE, 10, false);
        eeprom.set_control(EEMPE | EEPE, 12, false);
        eeprom.set_address(0, 0xb1);
        assert_eq!(eeprom.set_control(EERE, 20, false), 0, "nor is anything read meanwhile");
        eeprom.advance(12 + 26_367);
        eeprom.cut(0x77);
        assert_eq!(
            (eeprom.cells[0xb0], eeprom.cells[0xb1], eeprom.next_event()),
            (0x77, 0xff, None)
        );
        eeprom.cut(0x78);
        assert_eq!(eeprom.cells[0xb0], 0x77, "nothing is under way");
    }

    #[test]
    fn without_the_key_nothing_is_written() {
        let mut late = eeprom();
        late.set_control(EEPE, 5, false);
        late.set_control(EEMPE, 10, false);
        late.set_control(EEPE, 16, false);
        assert_eq!(late.cells[0xb0], 0xff);
        late.set_control(EEMPE, 20, false);
        late.set_control(EEPE, 22, true);
        assert_eq!((late.cells[0xb0], late.next_event()), (0xff, None), "the flash is written");
    }

    #[test]
    fn writing_alone_only_clears_bits() {
        let mut eeprom = eeprom();
        eeprom.cells[0xb0] = 0xf0;
        eeprom.set_control(2 << 4 | EEMPE, 1, false);
        eeprom.set_control(2 << 4 | EEMPE | EEPE, 2, false);
        assert_eq!(eeprom.cells[0xb0], 0x50);
    }
}
