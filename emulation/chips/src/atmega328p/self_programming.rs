//! Self-programming: a program erases and writes the flash (chapter 27).

/// SPMCSR.
const SPMIE: u8 = 1 << 7;
const RWWSB: u8 = 1 << 6;
const RWWSRE: u8 = 1 << 4;
const BLBSET: u8 = 1 << 3;
const PGWRT: u8 = 1 << 2;
const PGERS: u8 = 1 << 1;
const SELFPRGEN: u8 = 1 << 0;

/// Bytes of a page.
pub const PAGE: u16 = 128;
/// The first address of the boot loader's section, for a BOOTSZ of 2048 words.
pub const BOOT_SECTION: u16 = 0x7000;
/// From this address on, the flash cannot be read while it is written (27.6, table 27-6).
const NO_READ_WHILE_WRITE: u16 = 0x7000;
/// Erasing or writing a page takes 3.7 to 4.5 ms; this number of cycles of the calibrated
/// oscillator is 4 ms.
const BUSY: u64 = 32_000;
const UNLOCKED: u64 = 4;

/// A change of the flash by the program.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Change {
    /// The page that begins at this address becomes 0xff.
    Erase(u16),
    /// Bits of the page that begins at this address become 0.
    Program(u16, Box<[u8; PAGE as usize]>),
}

/// The reason why `spm` did nothing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mistake {
    /// The instruction is below the boot loader's section.
    Outside,
    /// SPMCSR was not written in the four cycles before, or a page is still being written.
    Locked,
}

/// SPMCSR and the page buffer.
#[derive(Clone, Debug)]
pub struct SelfProgramming {
    control: u8,
    unlocked_until: u64,
    buffer: [u8; PAGE as usize],
    done: Option<u64>,
}

impl SelfProgramming {
    pub fn new() -> Self {
        SelfProgramming { control: 0, unlocked_until: 0, buffer: [0xff; PAGE as usize], done: None }
    }

    pub fn next_event(&self) -> Option<u64> {
        self.done
    }

    pub fn advance(&mut self, now: u64) {
        if self.done.is_some_and(|done| done <= now) {
            self.done = None;
            self.control &= !(SELFPRGEN | PGERS | PGWRT);
        }
    }

    pub fn is_busy(&self) -> bool {
        self.done.is_some()
    }

    /// Returns true if the application's section cannot be read.
    pub fn is_application_busy(&self) -> bool {
        self.control & RWWSB != 0
    }

    pub fn interrupts(&self) -> bool {
        self.control & SPMIE != 0 && self.control & SELFPRGEN == 0
    }

    pub fn control(&mut self, now: u64) -> u8 {
        if self.done.is_none() && now > self.unlocked_until {
            self.control &= !(SELFPRGEN | PGERS | PGWRT | RWWSRE | BLBSET);
        }
        self.control
    }

    pub fn set_control(&mut self, value: u8, now: u64) {
        if self.done.is_some() {
            self.control = self.control & !SPMIE | value & SPMIE;
            return;
        }
        self.control = self.control & RWWSB | value & !RWWSB;
        if value & SELFPRGEN != 0 {
            self.unlocked_until = now + UNLOCKED;
        }
    }

    /// Executes `spm` at address `pc`, with Z and R1:R0. Returns the change of the flash, and the
    /// number of cycles for which the core halts.
    pub fn execute(
        &mut self,
        pc: u16,
        z: u16,
        word: u16,
        now: u64,
    ) -> Result<(Option<Change>, u64), Mistake> {
        if pc < BOOT_SECTION {
            return Err(Mistake::Outside);
        }
        if self.control & SELFPRGEN == 0 || now > self.unlocked_until || self.done.is_some() {
            return Err(Mistake::Locked);
        }
        let page = z & 0x7fff & !(PAGE - 1);
        let change = match self.control & (RWWSRE | BLBSET | PGWRT | PGERS) {
            PGERS => Change::Erase(page),
            PGWRT => {
                let full = std::mem::replace(&mut self.buffer, [0xff; PAGE as usize]);
                Change::Program(page, Box::new(full))
            }
            operation => {
                let at = usize::from((z % PAGE) & !1);
                if operation == 0 {
                    self.buffer[at..at + 2].copy_from_slice(&word.to_le_bytes());
                } else if operation == RWWSRE {
                    self.control &= !RWWSB;
                }
                self.control &= !(SELFPRGEN | operation);
                return Ok((None, 0));
            }
        };
        self.done = Some(now + BUSY);
        if page >= NO_READ_WHILE_WRITE {
            return Ok((Some(change), BUSY));
        }
        self.control |= RWWSB;
        Ok((Some(change), 0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_page_is_erased_filled_and_written_as_avr_libc_does_it() {
        let mut flash = SelfProgramming::new();
        flash.set_control(PGERS | SELFPRGEN, 0);
        assert_eq!(flash.execute(0x7100, 0x1280, 0, 2), Ok((Some(Change::Erase(0x1280)), 0)));
        assert!(flash.is_busy() && flash.is_application_busy());
        assert_eq!(flash.execute(0x7100, 0x1280, 0, 3), Err(Mistake::Locked), "busy");
        flash.advance(2 + BUSY);
        assert_eq!(flash.control(40_000) & SELFPRGEN, 0);
        for at in [0, 126] {
            flash.set_control(SELFPRGEN, 40_000);
            assert_eq!(flash.execute(0x7100, 0x1280 + at, 0x1234 + at, 40_001), Ok((None, 0)));
        }
        flash.set_control(PGWRT | SELFPRGEN, 50_000);
        let Ok((Some(Change::Program(0x1280, page)), 0)) = flash.execute(0x7100, 0x12ff, 0, 50_001)
        else {
            panic!("not written")
        };
        assert_eq!((&page[..3], &page[126..]), (&[0x34, 0x12, 0xff][..], &[0xb2, 0x12][..]));
        flash.advance(50_001 + BUSY);
        assert!(flash.is_application_busy(), "until it is enabled anew");
        flash.set_control(RWWSRE | SELFPRGEN, 90_000);
        assert_eq!(flash.execute(0x7100, 0, 0, 90_001), Ok((None, 0)));
        assert!(!flash.is_application_busy());
    }

    #[test]
    fn only_the_boot_loader_writes_and_only_at_once() {
        let mut flash = SelfProgramming::new();
        flash.set_control(PGERS | SELFPRGEN, 0);
        assert_eq!(flash.execute(0x6ffe, 0, 0, 2), Err(Mistake::Outside));
        assert_eq!(flash.execute(0x7000, 0, 0, 5), Err(Mistake::Locked));
        assert_eq!(flash.control(5), 0);
    }
}
