//! Programs for robots whose script directly follows the program in flash: exchanges the script,
//! and makes the file (Intel hex) that is sent to robots.

use std::fmt;
use std::path::{Path, PathBuf};

use bittybuzz_compiler::fit::{self, CapacityError};
use bittybuzz_compiler::symbols::Symbols;
use bittybuzz_robot_spec::{NoSection, Robot, find_script_section, script_section};
use bittybuzz_toml_reader::file;
use bittybuzz_vm_core::Part;
use bittybuzz_vm_core::image::VERSION;
use ihex::{Reader, Record, create_object_file_representation};
use object::Endianness;
use object::elf::{EM_AVR, FileHeader32, PT_LOAD};
use object::read::elf::{FileHeader, ProgramHeader};

use crate::file_error::FileError;
use crate::problem::Problem;
use crate::program::RefusedImage;

/// The first address of RAM in an ELF file (binutils' convention for the AVR).
const RAM: u32 = 0x80_0000;

/// The most bytes of a program, because addresses in the hex file have 16 bits.
const PROGRAM_BYTES_MAX: usize = 0x1_0000;

/// Bytes in a line of a hex file.
const LINE: usize = 16;

/// A reason why a script cannot be put into a program.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ProgramError {
    /// The file is neither ELF nor Intel hex.
    Unknown,
    /// A line of the hex file is wrong.
    Line(String),
    /// The ELF file is for another kind of processor.
    NotAvr,
    /// The address of missing bytes: the program has a gap, which KiloGUI would not send, or does
    /// not begin at 0.
    Gap(u32),
    /// The program has initialized variables, whose values belong after the script.
    Variables,
    /// The firmware's machine lacks a part that the script uses.
    Part {
        part: Part,
        /// The script's first use of the part: function, file, line.
        at: Option<(String, String, u32)>,
    },
    /// There is no place for a script.
    Section(NoSection),
    /// The program with the script is longer than the flash for both.
    TooLong {
        /// Bytes of program and script.
        bytes: usize,
        /// Bytes of flash for program and script.
        bytes_max: usize,
    },
}

impl fmt::Display for ProgramError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            ProgramError::Unknown => write!(f, "is neither an ELF nor an Intel hex file"),
            ProgramError::Line(reason) => write!(f, "is no Intel hex file: {reason}"),
            ProgramError::NotAvr => write!(f, "is for another processor than the robot's"),
            ProgramError::Gap(at) => write!(f, "has no bytes at {at:#06x}, within the program"),
            ProgramError::Variables => write!(f, "has variables with a value"),
            ProgramError::Part { part, at } => {
                write!(f, "was built without `{}` ({}), which ", part.name(), part.what())?;
                match at {
                    Some((function, file, line)) => {
                        write!(f, "`{function}` uses at {file}:{line}")
                    }
                    None => write!(f, "the script uses"),
                }
            }
            ProgramError::Section(NoSection::Missing) => write!(f, "has no place for a script"),
            ProgramError::Section(NoSection::Version(version)) => {
                write!(
                    f,
                    "was built by another version: its own script is an image of version {version}, this `bbz` builds \
                     version {VERSION}"
                )
            }
            ProgramError::Section(NoSection::Ambiguous) => {
                write!(f, "has several places for a script, or data after it")
            }
            ProgramError::TooLong { bytes, bytes_max } => {
                write!(f, "needs {bytes} bytes with the script, the robot has room for {bytes_max}")
            }
        }
    }
}

impl ProgramError {
    /// Returns advice on how to mend the error.
    pub fn help(&self) -> &'static str {
        match self {
            ProgramError::TooLong { .. } => "shorten the script, or leave out what it does not use",
            ProgramError::Part { .. } => {
                "build it with this script: `cargo xtask build kilobot --script FILE`"
            }
            ProgramError::Section(NoSection::Version(_)) => {
                "build the firmware again: `cargo xtask build kilobot`"
            }
            _ => "name the .elf or .hex file that `cargo xtask build kilobot` has made",
        }
    }
}

/// A script that cannot be put into the program in a file.
#[derive(Debug, thiserror::Error)]
#[error("`{path}` {error}")]
struct ProgramFileError {
    /// The path from `--firmware`; `the robot's flash` for the program on a robot.
    path: PathBuf,
    error: ProgramError,
}

impl ProgramFileError {
    fn new(path: &Path, error: ProgramError) -> Self {
        ProgramFileError { path: path.to_owned(), error }
    }
}

impl Problem for ProgramFileError {
    fn help(&self) -> Option<String> {
        Some(self.error.help().to_owned())
    }
}

/// Returns the program in `path`, with `image` in the place of its script, as a hex file.
pub fn with_script(
    path: &Path,
    script: &Path,
    image: &[u8],
    symbols: Option<&Symbols>,
    robot: &Robot,
) -> Result<String, Box<dyn Problem>> {
    let program = exchanged(path, &read(path)?, (script, symbols), image, robot)?;
    Ok(hex(&program).map_err(|error| ProgramFileError::new(path, error))?)
}

/// Reads the program in a file.
pub fn read(path: &Path) -> Result<Vec<u8>, Box<dyn Problem>> {
    let bytes =
        file::read(path, file::MOST_PROGRAM).map_err(|error| FileError::reading(path, error))?;
    Ok(program(&bytes).map_err(|error| ProgramFileError::new(path, error))?)
}

/// Returns the program that was read from `path`, with `image` in the place of its script.
pub fn exchanged(
    path: &Path,
    program: &[u8],
    (script, symbols): (&Path, Option<&Symbols>),
    image: &[u8],
    robot: &Robot,
) -> Result<Vec<u8>, Box<dyn Problem>> {
    let wrong = |error| ProgramFileError::new(path, error);
    let (at, parts) =
        find_script_section(program).map_err(|error| wrong(ProgramError::Section(error)))?;
    let limited = robot.clone().limited_to(parts);
    for misfit in fit::capacity_errors(image, &limited) {
        if let CapacityError::Part { part, at } = misfit {
            let at = at.and_then(|at| place(symbols?, u32::try_from(at).ok()?));
            return Err(wrong(ProgramError::Part { part, at }).into());
        }
    }
    let sealed = fit::sealed(image, &limited).map_err(|cause| RefusedImage::new(script, cause))?;
    let bytes_max = robot
        .budget
        .map_or(PROGRAM_BYTES_MAX, |budget| PROGRAM_BYTES_MAX.min(budget.flash_bytes as usize));
    let section = script_section(parts, &sealed);
    let whole = section.map(|section| [&program[..at], &section].concat());
    match whole {
        Some(whole) if whole.len() <= bytes_max => Ok(whole),
        other => {
            let bytes = other.map_or(at + sealed.len(), |whole| whole.len());
            Err(wrong(ProgramError::TooLong { bytes, bytes_max }).into())
        }
    }
}

/// Returns function, file and line of an instruction.
fn place(symbols: &Symbols, at: u32) -> Option<(String, String, u32)> {
    let place = symbols.position(at)?;
    let function = symbols.function(at)?;
    Some((function.name.clone(), symbols.file(place.file)?.to_owned(), place.line))
}

/// Returns the content of the flash, from address 0 on.
fn program(bytes: &[u8]) -> Result<Vec<u8>, ProgramError> {
    let mut pieces = if bytes.starts_with(b"\x7fELF") { of_elf(bytes)? } else { of_hex(bytes)? };
    pieces.sort_by_key(|(address, _)| *address);
    let mut program = Vec::new();
    for (address, piece) in pieces {
        if address as usize != program.len() {
            return Err(ProgramError::Gap(program.len() as u32));
        }
        program.extend(piece);
    }
    Ok(program)
}

fn of_elf(bytes: &[u8]) -> Result<Vec<(u32, Vec<u8>)>, ProgramError> {
    let header = FileHeader32::<Endianness>::parse(bytes).map_err(|_| ProgramError::Unknown)?;
    let endian = header.endian().map_err(|_| ProgramError::Unknown)?;
    if header.e_machine(endian) != EM_AVR {
        return Err(ProgramError::NotAvr);
    }
    let segments = header.program_headers(endian, bytes).map_err(|_| ProgramError::Unknown)?;
    let mut pieces = Vec::new();
    for segment in segments {
        if segment.p_type(endian) != PT_LOAD || segment.p_filesz(endian) == 0 {
            continue;
        }
        if segment.p_vaddr(endian) >= RAM {
            return Err(ProgramError::Variables);
        }
        let content = segment.data(endian, bytes).map_err(|()| ProgramError::Unknown)?;
        pieces.push((segment.p_paddr(endian), content.to_owned()));
    }
    Ok(pieces)
}

fn of_hex(bytes: &[u8]) -> Result<Vec<(u32, Vec<u8>)>, ProgramError> {
    let text = std::str::from_utf8(bytes).map_err(|_| ProgramError::Unknown)?;
    if !text.trim_start().starts_with(':') {
        return Err(ProgramError::Unknown);
    }
    let mut base = 0;
    let mut pieces = Vec::new();
    for record in Reader::new(text) {
        match record.map_err(|error| ProgramError::Line(error.to_string()))? {
            Record::Data { offset, value } => pieces.push((base + u32::from(offset), value)),
            Record::ExtendedSegmentAddress(segment) => base = u32::from(segment) << 4,
            Record::ExtendedLinearAddress(upper) => base = u32::from(upper) << 16,
            Record::EndOfFile => break,
            Record::StartSegmentAddress { .. } | Record::StartLinearAddress(_) => {}
        }
    }
    Ok(pieces)
}

/// Returns a hex file of at most [`PROGRAM_BYTES_MAX`] bytes. KiloGUI needs its lines in ascending order without
/// gaps.
fn hex(program: &[u8]) -> Result<String, ProgramError> {
    let lines = program.chunks(LINE).zip((0_u16..).step_by(LINE));
    let data = lines.map(|(bytes, offset)| Record::Data { offset, value: bytes.to_vec() });
    let records: Vec<Record> = data.chain([Record::EndOfFile]).collect();
    create_object_file_representation(&records)
        .map_err(|error| ProgramError::Line(error.to_string()))
}
