//! The ELF file of a firmware.

use std::path::{Path, PathBuf};

use object::elf;
use object::read::elf::{ElfFile32, ProgramHeader};
use object::{Endianness, Object, ObjectSymbol, SymbolKind};

/// Where the flash begins, and so where an image without bootloader does.
const FLASH: u32 = 0x0800_0000;
/// Where Bitcraze's bootloader expects the application.
const APPLICATION: u32 = 0x0800_4000;
const FLASH_END: u32 = 0x0810_0000;

/// The content of a firmware's ELF file.
#[derive(Clone, Debug)]
pub struct Image {
    segments: Vec<(u32, Vec<u8>)>,
    vectors: u32,
    symbols: Vec<Symbol>,
}

#[derive(Clone, Debug)]
struct Symbol {
    name: String,
    address: u32,
    function: bool,
}

impl Image {
    /// Reads the file at `path`.
    pub fn open(path: &Path) -> Result<Self, ImageError> {
        let bytes = std::fs::read(path)
            .map_err(|source| ImageError::Unreadable { path: path.into(), source })?;
        Self::parse(&bytes)
    }

    /// Reads the content of a file.
    pub fn parse(bytes: &[u8]) -> Result<Self, ImageError> {
        let elf = ElfFile32::<Endianness>::parse(bytes)
            .map_err(|error| ImageError::NotElf { reason: error.to_string() })?;
        let endian = elf.endian();
        if elf.elf_header().e_machine.get(endian) != elf::EM_ARM || endian != Endianness::Little {
            return Err(ImageError::NotArm);
        }
        let mut segments = Vec::new();
        for header in elf.elf_program_headers() {
            if header.p_type(endian) != elf::PT_LOAD || header.p_filesz(endian) == 0 {
                continue;
            }
            let data = header.data(endian, bytes).map_err(|()| ImageError::NotElf {
                reason: "a segment ends beyond the file".into(),
            })?;
            segments.push((header.p_paddr(endian), data.to_vec()));
        }
        let vectors = segments
            .iter()
            .map(|(address, _)| *address)
            .filter(|address| (FLASH..FLASH_END).contains(address))
            .min()
            .ok_or(ImageError::NothingInFlash)?;
        if vectors != FLASH && vectors != APPLICATION {
            return Err(ImageError::WrongStart { address: vectors });
        }
        let symbols = elf
            .symbols()
            .filter_map(|symbol| {
                Some(Symbol {
                    name: symbol.name().ok()?.into(),
                    address: symbol.address() as u32,
                    function: symbol.kind() == SymbolKind::Text,
                })
            })
            .filter(|symbol| !symbol.name.is_empty())
            .collect();
        Ok(Image { segments, vectors, symbols })
    }

    /// What is to be written where: physical addresses and bytes.
    pub fn segments(&self) -> impl Iterator<Item = (u32, &[u8])> {
        self.segments.iter().map(|(address, bytes)| (*address, bytes.as_slice()))
    }

    /// Address of the vector table: its first word is the stack pointer, its second where to start.
    pub fn vectors(&self) -> u32 {
        self.vectors
    }

    /// Address of the symbol with exactly this name.
    pub fn symbol(&self, name: &str) -> Option<u32> {
        self.symbols.iter().find(|symbol| symbol.name == name).map(|symbol| symbol.address)
    }

    /// Address of the function called `name`: exactly so in the symbol table, else the only one whose path
    /// contains `name`.
    pub fn function(&self, name: &str) -> Result<u32, ImageError> {
        let functions = || self.symbols.iter().filter(|symbol| symbol.function);
        if let Some(symbol) = functions().find(|symbol| symbol.name == name) {
            return Ok(symbol.address & !1);
        }
        let mut found: Vec<(u32, String)> = functions()
            .map(|symbol| {
                (symbol.address & !1, format!("{:#}", rustc_demangle::demangle(&symbol.name)))
            })
            .filter(|(_, path)| path.contains(name))
            .collect();
        found.sort();
        found.dedup_by_key(|(address, _)| *address);
        match found.as_slice() {
            [] => Err(ImageError::NoFunction { name: name.into() }),
            [(address, _)] => Ok(*address),
            _ => Err(ImageError::ManyFunctions {
                name: name.into(),
                paths: found.into_iter().map(|(_, path)| path).collect(),
            }),
        }
    }
}

/// Why an image cannot be used.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ImageError {
    /// The file cannot be read.
    #[error("cannot read {}: {source}", path.display())]
    Unreadable {
        /// Path of the file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// Not a 32-bit ELF file.
    #[error("not a 32-bit ELF file ({reason}): give the file that cargo built, not a .bin or .hex")]
    NotElf {
        /// What the reader says.
        reason: String,
    },
    /// Another processor.
    #[error("the ELF file is not for a little-endian ARM: build it for thumbv7em-none-eabihf")]
    NotArm,
    /// Nothing would be flashed.
    #[error("the ELF file has nothing for the flash at 0x08000000: is its memory.x used?")]
    NothingInFlash,
    /// Nobody would start it there.
    #[error(
        "the image starts at {address:#010x}: Bitcraze's bootloader starts one at 0x08004000, \
         the chip without it one at 0x08000000"
    )]
    WrongStart {
        /// Where it starts.
        address: u32,
    },
    /// No such function.
    #[error(
        "no function is called \"{name}\": it may be inlined; mark it #[inline(never)] or choose its caller"
    )]
    NoFunction {
        /// The name that was asked for.
        name: String,
    },
    /// More than one function.
    #[error("\"{name}\" may be any of {}: give more of the path", paths.join(", "))]
    ManyFunctions {
        /// The name that was asked for.
        name: String,
        /// All that it could be.
        paths: Vec<String>,
    },
}
