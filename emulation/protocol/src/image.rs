//! The ELF file of a firmware.

use std::io;
use std::ops::Range;
use std::path::{Path, PathBuf};

use bittybuzz_chips::MemoryMap;
use object::Endianness;
use object::elf;
use object::read::elf::{ElfFile32, ProgramHeader};

use crate::symbol::ElfSymbol;

/// First address of the flash: the start of an image that runs without a bootloader.
const FLASH: u32 = 0x0800_0000;
/// The address at which Bitcraze's bootloader expects the application.
const APPLICATION: u32 = 0x0800_4000;
const FLASH_END: u32 = 0x0810_0000;
/// The offset that an AVR's tools add to addresses of RAM; EEPROM, fuses and lock bits come after
/// it.
const AVR_RAM: u32 = 0x80_0000;
/// Flash size of an ATmega328P in bytes.
pub const AVR_FLASH_SIZE: usize = 0x8000;

/// The content of a firmware's ELF file.
#[derive(Clone, Debug)]
pub struct FirmwareImage {
    segments: Vec<(u32, Vec<u8>)>,
    /// The memory that the program uses while it runs, also the parts that the file does not fill.
    used: Vec<Range<u64>>,
    vectors: u32,
    symbols: Vec<ElfSymbol>,
}

impl FirmwareImage {
    /// Reads the file at `path`.
    pub fn open(path: &Path) -> Result<Self, FirmwareImageError> {
        Self::read(path, Self::parse)
    }

    /// Reads the ELF or Intel hex file of an AVR at `path`.
    pub fn open_avr(path: &Path, flash_size: usize) -> Result<Self, FirmwareImageError> {
        Self::read(path, |bytes| Self::parse_avr(bytes, flash_size))
    }

    fn read(
        path: &Path,
        parse: impl FnOnce(&[u8]) -> Result<Self, FirmwareImageError>,
    ) -> Result<Self, FirmwareImageError> {
        let unreadable = |source| FirmwareImageError::Unreadable { path: path.into(), source };
        // WebAssembly has no files; the early return keeps the parsers out of the downloaded module.
        if cfg!(target_family = "wasm") {
            return Err(unreadable(io::ErrorKind::Unsupported.into()));
        }
        parse(&std::fs::read(path).map_err(unreadable)?)
    }

    /// Parses the content of an AVR's file: ELF, or Intel hex, which has no symbols.
    pub fn parse_avr(bytes: &[u8], flash_size: usize) -> Result<Self, FirmwareImageError> {
        let image = if bytes.starts_with(b":") {
            let segments = hex(bytes)?;
            FirmwareImage { segments, used: Vec::new(), vectors: 0, symbols: Vec::new() }
        } else {
            let elf = ElfFile32::<Endianness>::parse(bytes)
                .map_err(|error| FirmwareImageError::NotElf { reason: error.to_string() })?;
            if elf.elf_header().e_machine.get(elf.endian()) != elf::EM_AVR {
                return Err(FirmwareImageError::NotAvr);
            }
            FirmwareImage {
                segments: segments(&elf, bytes)?,
                used: Vec::new(),
                vectors: 0,
                symbols: ElfSymbol::all(&elf),
            }
        };
        let is_flash =
            |(address, bytes): &(u32, Vec<u8>)| *address as usize + bytes.len() <= flash_size;
        match image.segments.iter().find(|(address, _)| *address < AVR_RAM) {
            None => Err(FirmwareImageError::NothingInAvrFlash),
            Some(_) => match image.segments.iter().find(|s| s.0 < AVR_RAM && !is_flash(s)) {
                Some((address, bytes)) => Err(FirmwareImageError::TooLong {
                    end: *address as usize + bytes.len(),
                    flash_size,
                }),
                None => Ok(image),
            },
        }
    }

    /// Parses the content of a Cortex-M's ELF file.
    pub fn parse(bytes: &[u8]) -> Result<Self, FirmwareImageError> {
        let elf = ElfFile32::<Endianness>::parse(bytes)
            .map_err(|error| FirmwareImageError::NotElf { reason: error.to_string() })?;
        let endian = elf.endian();
        if elf.elf_header().e_machine.get(endian) != elf::EM_ARM || endian != Endianness::Little {
            return Err(FirmwareImageError::NotArm);
        }
        let segments = segments(&elf, bytes)?;
        let vectors = segments
            .iter()
            .map(|(address, _)| *address)
            .filter(|address| (FLASH..FLASH_END).contains(address))
            .min()
            .ok_or(FirmwareImageError::NothingInFlash)?;
        if vectors != FLASH && vectors != APPLICATION {
            return Err(FirmwareImageError::WrongStart { address: vectors });
        }
        let symbols = ElfSymbol::all(&elf);
        Ok(FirmwareImage { segments, used: used(&elf), vectors, symbols })
    }

    /// Checks that the image can start on a Cortex-M with this memory: all of it is there, and a
    /// vector table is at its begin.
    ///
    /// # Errors
    /// The image needs memory that the chip does not have, or has no vector table.
    pub fn check(&self, memory: &MemoryMap) -> Result<(), FirmwareImageError> {
        let loaded = self.segments.iter().map(|(address, bytes)| {
            let begin = u64::from(*address);
            begin..begin + bytes.len() as u64
        });
        let is_there = |used: &Range<u64>| {
            let mut regions = memory.regions();
            regions.any(|(begin, bytes)| {
                let begin = u64::from(begin);
                begin <= used.start && used.end <= begin + u64::from(bytes)
            })
        };
        if let Some(Range { start, end }) = loaded.chain(self.used.clone()).find(|r| !is_there(r)) {
            return Err(FirmwareImageError::NoMemory { begin: start, end });
        }
        // The segment at the vectors is the first one in the flash.
        let first = self.segments.iter().find(|(address, _)| *address == self.vectors);
        let word = |number: usize| {
            let (_, bytes) = first?;
            let bytes = bytes.get(4 * number..4 * number + 4)?;
            Some(u32::from_le_bytes(bytes.try_into().ok()?))
        };
        let (stack, entry) = (word(0).unwrap_or(0), word(1).unwrap_or(0));
        // The stack grows downwards, so that it may begin at the end of the RAM.
        let is_in_ram = |(begin, bytes): (u32, u32)| (begin + 1..=begin + bytes).contains(&stack);
        let code = u64::from(entry & !1);
        let is_code = |(address, bytes): &(u32, Vec<u8>)| {
            let begin = u64::from(*address);
            (begin..begin + bytes.len() as u64).contains(&code)
        };
        let can_start = memory.rams().any(is_in_ram) && entry & 1 == 1;
        if can_start && self.segments.iter().any(is_code) {
            Ok(())
        } else {
            Err(FirmwareImageError::NoVectorTable { address: self.vectors, stack, entry })
        }
    }

    /// Creates an image without symbols from bytes of flash, which begin with the vector table at
    /// `vectors`.
    pub fn of_flash(vectors: u32, bytes: Vec<u8>) -> Self {
        let (segments, used, symbols) = (vec![(vectors, bytes)], Vec::new(), Vec::new());
        FirmwareImage { segments, used, vectors, symbols }
    }

    /// Returns the bytes to be written to memory, with their physical addresses.
    pub fn segments(&self) -> impl Iterator<Item = (u32, &[u8])> {
        self.segments.iter().map(|(address, bytes)| (*address, bytes.as_slice()))
    }

    /// Returns the address of the vector table: its first word is the initial stack pointer, its
    /// second the entry point.
    pub fn vectors(&self) -> u32 {
        self.vectors
    }

    /// Returns the address of the symbol with exactly this name.
    pub fn symbol(&self, name: &str) -> Option<u32> {
        self.symbols.iter().find(|symbol| symbol.name == name).map(|symbol| symbol.address)
    }

    /// Returns the address of the function called `name`: the one with exactly this name in the
    /// symbol table, otherwise the only one whose demangled path contains `name`.
    pub fn function(&self, name: &str) -> Result<u32, FirmwareImageError> {
        let functions = || self.symbols.iter().filter(|symbol| symbol.is_function);
        if let Some(symbol) = functions().find(|symbol| symbol.name == name) {
            return Ok(symbol.address);
        }
        let mut found: Vec<(u32, String)> = functions()
            .map(|symbol| (symbol.address, format!("{:#}", rustc_demangle::demangle(&symbol.name))))
            .filter(|(_, path)| path.contains(name))
            .collect();
        found.sort();
        found.dedup_by_key(|(address, _)| *address);
        match found.as_slice() {
            [] => Err(FirmwareImageError::NoFunction { name: name.into() }),
            [(address, _)] => Ok(*address),
            _ => Err(FirmwareImageError::ManyFunctions {
                name: name.into(),
                paths: found.into_iter().map(|(_, path)| path).collect(),
            }),
        }
    }
}

/// Returns the memory that the segments use while the program runs.
fn used(elf: &ElfFile32<'_, Endianness>) -> Vec<Range<u64>> {
    let endian = elf.endian();
    let headers = elf.elf_program_headers().iter();
    let loaded = headers.filter(|header| header.p_type(endian) == elf::PT_LOAD);
    let ranges = loaded.map(|header| {
        let begin = u64::from(header.p_vaddr(endian));
        begin..begin + u64::from(header.p_memsz(endian))
    });
    ranges.filter(|range| !range.is_empty()).collect()
}

fn segments(
    elf: &ElfFile32<'_, Endianness>,
    bytes: &[u8],
) -> Result<Vec<(u32, Vec<u8>)>, FirmwareImageError> {
    let endian = elf.endian();
    let mut segments = Vec::new();
    for header in elf.elf_program_headers() {
        if header.p_type(endian) != elf::PT_LOAD || header.p_filesz(endian) == 0 {
            continue;
        }
        let data = header.data(endian, bytes).map_err(|()| FirmwareImageError::NotElf {
            reason: "a segment ends beyond the file".into(),
        })?;
        segments.push((header.p_paddr(endian), data.to_vec()));
    }
    Ok(segments)
}

/// Returns the content of the data records of an Intel hex file.
fn hex(bytes: &[u8]) -> Result<Vec<(u32, Vec<u8>)>, FirmwareImageError> {
    let wrong = |line: usize, reason: String| FirmwareImageError::NotHex { line, reason };
    let text = std::str::from_utf8(bytes).map_err(|error| wrong(1, error.to_string()))?;
    let mut segments: Vec<(u32, Vec<u8>)> = Vec::new();
    let mut base = 0;
    for (number, line) in text.lines().enumerate() {
        if line.trim().is_empty() {
            continue;
        }
        let record = ihex::Record::from_record_string(line.trim());
        match record.map_err(|error| wrong(number + 1, error.to_string()))? {
            ihex::Record::Data { offset, value } => {
                let address = base + u32::from(offset);
                match segments.last_mut() {
                    Some((start, bytes)) if *start + bytes.len() as u32 == address => {
                        bytes.extend(value);
                    }
                    _ => segments.push((address, value)),
                }
            }
            ihex::Record::ExtendedSegmentAddress(segment) => base = u32::from(segment) << 4,
            ihex::Record::ExtendedLinearAddress(upper) => base = u32::from(upper) << 16,
            // A file that was joined from two has the first one's end record in the middle.
            ihex::Record::EndOfFile
            | ihex::Record::StartSegmentAddress { .. }
            | ihex::Record::StartLinearAddress(_) => {}
        }
    }
    Ok(segments)
}

/// A reason why an image cannot be used.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FirmwareImageError {
    /// The file cannot be read.
    #[error("cannot read {}: {source}", path.display())]
    Unreadable {
        /// Path of the file.
        path: PathBuf,
        /// The operating system's error.
        source: std::io::Error,
    },
    /// Not a 32-bit ELF file.
    #[error(
        "not a 32-bit ELF file ({reason}): give the file that the linker wrote, not a .bin or .hex"
    )]
    NotElf {
        /// The reader's error.
        reason: String,
    },
    /// The ELF file is for another processor than a little-endian ARM.
    #[error("the ELF file is not for a little-endian ARM: build it for thumbv7em-none-eabihf")]
    NotArm,
    /// The ELF file is for another processor than an AVR.
    #[error(
        "the ELF file is not for an AVR: build it for avr-none, or with avr-gcc -mmcu=atmega328p"
    )]
    NotAvr,
    /// The file is not valid Intel hex.
    #[error("line {line} is not Intel hex: {reason}")]
    NotHex {
        /// Line number, counted from 1.
        line: usize,
        /// The reader's error.
        reason: String,
    },
    /// The file has no segment in the AVR's flash.
    #[error("the file has nothing for the flash, which begins at 0")]
    NothingInAvrFlash,
    /// The image is larger than the chip's flash.
    #[error("the image ends at {end:#x}; the flash ends at {flash_size:#x}")]
    TooLong {
        /// Address after the image's last byte.
        end: usize,
        /// Flash size in bytes.
        flash_size: usize,
    },
    /// The ELF file has no segment in the flash of the STM32.
    #[error("the ELF file has nothing for the flash at 0x08000000: is its memory.x used?")]
    NothingInFlash,
    /// The image is neither at the start of the flash nor at the address that the bootloader
    /// starts.
    #[error(
        "the image starts at {address:#010x}: Bitcraze's bootloader starts one at 0x08004000, \
         the chip without it one at 0x08000000"
    )]
    WrongStart {
        /// The start of the image.
        address: u32,
    },
    /// The image needs memory that the chip does not have.
    #[error(
        "the image needs memory from {begin:#010x} to {end:#010x}, which the chip does not have: is it for another one?"
    )]
    NoMemory {
        /// First address.
        begin: u64,
        /// Address after the last byte.
        end: u64,
    },
    /// The image begins with something else than a vector table.
    #[error(
        "no vector table is at {address:#010x}: the first two words, {stack:#010x} and {entry:#010x}, are not the end of a \
         stack in the RAM and the address of a function"
    )]
    NoVectorTable {
        /// Address of the image.
        address: u32,
        /// The first word.
        stack: u32,
        /// The second word.
        entry: u32,
    },
    /// No function has this name.
    #[error(
        "no function is called \"{name}\": it may be inlined; mark it #[inline(never)] or choose its caller"
    )]
    NoFunction {
        /// The name that was asked for.
        name: String,
    },
    /// The name matches more than one function.
    #[error("\"{name}\" may be any of {}: give more of the path", paths.join(", "))]
    ManyFunctions {
        /// The name that was asked for.
        name: String,
        /// The paths of all functions that match.
        paths: Vec<String>,
    },
}
