//! A model of the flash loader in Bitcraze's bootloader of the STM32 (crazyflie2-stm-bootloader,
//! commit c79feab), which takes firmware by radio. It has the loader's replies and effects on the
//! flash, not its code, which has another license.
//!
//! A CRTP packet for the loader has the header 0xff; then come the target, 0xff, and a command:
//!
//! | command | parameters | reply |
//! |---|---|---|
//! | 0x10 get info | | sizes in pages, 12 bytes without meaning, version |
//! | 0x12 get mapping | | sectors, in groups of a number and a size in pages |
//! | 0x14 load buffer | page, offset, up to 25 bytes | none |
//! | 0x15 read buffer, 0x1c read flash | page, offset | parameters, up to 25 bytes |
//! | 0x18 write flash | buffer page, flash page, number of pages | done, error |
//!
//! The loader's manual also has 0x19, flash status, and 0x11, set address. The program ignores both:
//! the one is not in it, the other is commented out. It has no command for a reset either, which is
//! the work of the radio's processor.
//!
//! The loader has no checksum: it answers a write flash for a buffer that misses a packet as it
//! answers any other.

/// Bytes of the flash and of a page.
pub const FLASH_BYTES: usize = 1 << 20;
/// Bytes of a page.
pub const PAGE: usize = 1024;
/// Pages of the buffer.
pub const BUFFER_PAGES: usize = 10;
/// The first page after the loader, where a program starts.
pub const PROGRAM_PAGE: usize = 16;

/// Sizes of the sectors in pages (RM0090 3.4): a number of sectors and the size of each.
const MAPPING: [u8; 6] = [4, 16, 1, 64, 7, 128];
const VERSION: u8 = 0x10;
const HEADER: u8 = 0xff;
const TARGET: u8 = 0xff;
const CPU_ID_BYTES: usize = 12;
/// Bytes of flash or buffer in a reply.
const READ_BYTES: usize = 25;
/// Bytes that are programmed at once.
const WORD: usize = 4;

/// The program that starts after a reset.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StartedProgram {
    /// The loader, which waits for packets.
    Loader,
    /// The program at [`PROGRAM_PAGE`], complete or not.
    Firmware,
}

/// An operation that changes the flash.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FlashOperation {
    /// Erases a sector, whose first page is this.
    Erase(usize),
    /// Programs the word at this offset.
    Program(usize),
}

/// The reasons of the loader to refuse a write, with its numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
enum WriteError {
    None = 0,
    /// The pages are outside of flash or buffer, or belong to the loader.
    Bounds = 1,
}

/// The loader with the flash that it writes.
#[derive(Clone)]
pub struct Loader {
    flash: Vec<u8>,
    buffer: [u8; BUFFER_PAGES * PAGE],
    /// Operations on the flash up to the one at which the power fails; `None` if it does not.
    operations_left: Option<usize>,
    /// The operations since the start of the model.
    pub operations: Vec<FlashOperation>,
}

impl Loader {
    /// Creates a loader with this content of the flash, which begins with the loader itself.
    pub fn new(flash: Vec<u8>) -> Self {
        assert_eq!(flash.len(), FLASH_BYTES);
        let buffer = [0; BUFFER_PAGES * PAGE];
        Loader { flash, buffer, operations_left: None, operations: Vec::new() }
    }

    /// Returns the whole flash.
    pub fn flash(&self) -> &[u8] {
        &self.flash
    }

    /// Lets the power fail at an operation, counted from 1 on. That operation has no effect here; on
    /// the chip its sector or word may then have any content (RM0090 3.6). The loader answers no
    /// packets until [`reset`](Self::reset).
    pub fn cut_power_at(&mut self, operation: usize) {
        self.operations_left = Some(operation);
    }

    /// Returns true if the power has failed.
    pub fn is_off(&self) -> bool {
        self.operations_left == Some(0)
    }

    /// Turns the power on, or resets the chip, which clears the buffer. `asks_for_loader` is the
    /// level of the pin by which the radio's processor starts the loader.
    pub fn reset(&mut self, asks_for_loader: bool) -> StartedProgram {
        self.operations_left = None;
        self.buffer = [0; BUFFER_PAGES * PAGE];
        // The loader looks at no more than the first word, the initial stack pointer.
        let first = &self.flash[PROGRAM_PAGE * PAGE..][..WORD];
        if asks_for_loader || first.iter().all(|byte| *byte == u8::MAX) {
            StartedProgram::Loader
        } else {
            StartedProgram::Firmware
        }
    }

    /// Receives a CRTP packet, and returns the reply.
    pub fn receive(&mut self, packet: &[u8]) -> Option<Vec<u8>> {
        let [HEADER, TARGET, command, parameters @ ..] = packet else { return None };
        if self.is_off() {
            return None;
        }
        let field = |number: usize| {
            let bytes = parameters.get(2 * number..2 * number + 2).unwrap_or(&[0, 0]);
            usize::from(u16::from_le_bytes([bytes[0], bytes[1]]))
        };
        let (page, start) = (field(0), field(0) * PAGE + field(1));
        let reply = match command {
            0x10 => info(),
            0x12 => MAPPING.to_vec(),
            0x14 => {
                let bytes = parameters.get(4..).unwrap_or_default();
                let places = self.buffer.iter_mut().skip(start);
                places.zip(bytes).for_each(|(place, byte)| *place = *byte);
                return None;
            }
            0x15 => [parameters, read(&self.buffer, start)].concat(),
            0x1c => [parameters, read(&self.flash, start)].concat(),
            0x18 => {
                let error = self.write(page, field(1), field(2))?;
                vec![u8::from(error == WriteError::None), error as u8]
            }
            _ => return None,
        };
        Some([&[HEADER, TARGET, *command], &reply[..]].concat())
    }

    /// Erases each sector whose first page is among the pages, and then programs the pages. Returns
    /// `None` if the power fails.
    fn write(&mut self, buffer_page: usize, flash_page: usize, pages: usize) -> Option<WriteError> {
        let all_pages = FLASH_BYTES / PAGE;
        let end = flash_page + pages;
        if flash_page < PROGRAM_PAGE
            || flash_page >= all_pages
            || end > all_pages
            || buffer_page >= BUFFER_PAGES
        {
            return Some(WriteError::Bounds);
        }
        for (first, size) in sectors().filter(|(first, _)| (flash_page..end).contains(first)) {
            self.operate(FlashOperation::Erase(first))?;
            self.flash[first * PAGE..][..size * PAGE].fill(u8::MAX);
        }
        for offset in (0..pages * PAGE).step_by(WORD) {
            let target = flash_page * PAGE + offset;
            self.operate(FlashOperation::Program(target))?;
            for byte in 0..WORD {
                // A program operation only clears bits. Bytes after the buffer are other variables
                // of the loader, here zeros.
                let source = buffer_page * PAGE + offset + byte;
                self.flash[target + byte] &= self.buffer.get(source).copied().unwrap_or(0);
            }
        }
        Some(WriteError::None)
    }

    /// Counts an operation; returns `None` if the power fails at it.
    fn operate(&mut self, operation: FlashOperation) -> Option<()> {
        if let Some(left) = &mut self.operations_left {
            *left = left.checked_sub(1)?;
            if *left == 0 {
                return None;
            }
        }
        self.operations.push(operation);
        Some(())
    }
}

fn info() -> Vec<u8> {
    let pages = [PAGE, BUFFER_PAGES, FLASH_BYTES / PAGE, PROGRAM_PAGE];
    let pages = pages.into_iter().flat_map(|number| (number as u16).to_le_bytes());
    pages.chain([0; CPU_ID_BYTES]).chain([VERSION]).collect()
}

fn read(memory: &[u8], start: usize) -> &[u8] {
    let start = start.min(memory.len());
    &memory[start..memory.len().min(start + READ_BYTES)]
}

/// Returns first page and size of each sector.
fn sectors() -> impl Iterator<Item = (usize, usize)> {
    let sizes = MAPPING
        .chunks(2)
        .flat_map(|group| std::iter::repeat_n(usize::from(group[1]), usize::from(group[0])));
    sizes.scan(0, |next, size| {
        let first = *next;
        *next += size;
        Some((first, size))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const WRITE: [u8; 3] = [HEADER, TARGET, 0x18];

    fn write(loader: &mut Loader, buffer: u16, page: u16, pages: u16) -> Option<Vec<u8>> {
        let fields = [buffer, page, pages].map(u16::to_le_bytes).concat();
        loader.receive(&[&WRITE[..], &fields].concat())
    }

    fn loader(content: u8) -> Loader {
        Loader::new(vec![content; FLASH_BYTES])
    }

    #[test]
    fn sectors_are_those_of_the_chip() {
        let firsts: Vec<usize> = sectors().map(|(first, _)| first).collect();
        assert_eq!(firsts, [0, 16, 32, 48, 64, 128, 256, 384, 512, 640, 768, 896]);
        assert_eq!(sectors().map(|(_, size)| size * PAGE).sum::<usize>(), FLASH_BYTES);
    }

    #[test]
    fn a_sector_is_erased_with_its_first_page_alone() {
        let mut loader = loader(0);
        assert_eq!(write(&mut loader, 0, 17, 1).unwrap()[3..], [1, 0]);
        assert!(loader.operations.iter().all(|op| matches!(op, FlashOperation::Program(_))));
        assert_eq!(write(&mut loader, 9, 31, 2).unwrap()[3..], [1, 0]);
        let erased = |op: &&FlashOperation| matches!(op, FlashOperation::Erase(_));
        let erased: Vec<_> = loader.operations.iter().filter(erased).collect();
        assert_eq!(erased, [&FlashOperation::Erase(32)]);
        assert_eq!(loader.flash()[34 * PAGE..48 * PAGE], [0xff; 14 * PAGE]);
    }

    #[test]
    fn writes_outside_of_the_bounds_are_refused() {
        let mut loader = loader(0);
        for (buffer, page, pages) in [(0, 15, 1), (0, 1024, 0), (0, 1023, 2), (10, 16, 1)] {
            assert_eq!(write(&mut loader, buffer, page, pages).unwrap()[3..], [0, 1]);
        }
        assert!(loader.operations.is_empty());
    }

    #[test]
    fn what_the_program_lacks_is_not_answered() {
        let mut loader = loader(0);
        for packet in [
            &[HEADER, TARGET, 0x19][..],
            &[HEADER, TARGET, 0x11, 1, 2, 3, 4, 5],
            &[HEADER, 0xfe, 0x10],
            &[0xf3, TARGET, 0x10],
            &[HEADER, TARGET],
            &[HEADER],
            &[],
        ] {
            assert_eq!(loader.receive(packet), None, "{packet:x?}");
        }
    }

    #[test]
    fn the_first_word_alone_decides_about_the_start() {
        let mut loader = loader(0xff);
        assert_eq!(loader.reset(false), StartedProgram::Loader);
        loader.receive(&[HEADER, TARGET, 0x14, 0, 0, 0, 0, 1]);
        loader.cut_power_at(3);
        assert_eq!(write(&mut loader, 0, 16, 1), None);
        assert!(loader.is_off());
        assert_eq!(loader.flash()[16 * PAGE..][..8], [1, 0, 0, 0, 0xff, 0xff, 0xff, 0xff]);
        assert_eq!(loader.reset(false), StartedProgram::Firmware);
        assert_eq!(loader.reset(true), StartedProgram::Loader);
    }
}
