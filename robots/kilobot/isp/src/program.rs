//! Programs: the firmware with the script that directly follows it in flash.

use std::fmt;

use bittybuzz_compiler::fit::{self, CapacityError};
use bittybuzz_compiler::refusal;
use bittybuzz_compiler::symbols::Symbols;
use bittybuzz_robot_spec::{NoSection, Robot, find_script_section, script_section};
use bittybuzz_vm_core::image::VERSION;
use bittybuzz_vm_core::{ImageError, Part};
use ihex::{Reader, Record, create_object_file_representation};
use object::Endianness;
use object::elf::{EM_AVR, FileHeader32, PT_LOAD};
use object::read::elf::{FileHeader, ProgramHeader};

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

impl std::error::Error for ProgramError {}

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

/// A reason why the script of a program cannot be exchanged.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ExchangeError {
    /// The program has no place for the script.
    #[error(transparent)]
    Program(#[from] ProgramError),
    /// The virtual machine of the program refuses the image.
    #[error("the script {}", refusal::sentence(.0))]
    Image(ImageError),
}

/// Returns the content of the flash, from address 0 on, of a file in ELF or Intel hex.
pub fn read(bytes: &[u8]) -> Result<Vec<u8>, ProgramError> {
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

/// Returns the program with `image` in the place of its script. It has at most 65,536 bytes.
pub fn exchange_script(
    program: &[u8],
    image: &[u8],
    symbols: Option<&Symbols>,
    robot: &Robot,
) -> Result<Vec<u8>, ExchangeError> {
    let (at, parts) = find_script_section(program).map_err(ProgramError::Section)?;
    let limited = robot.clone().limited_to(parts);
    for misfit in fit::capacity_errors(image, &limited) {
        if let CapacityError::Part { part, at } = misfit {
            let at = at.and_then(|at| place(symbols?, u32::try_from(at).ok()?));
            return Err(ProgramError::Part { part, at }.into());
        }
    }
    let sealed = fit::sealed(image, &limited).map_err(ExchangeError::Image)?;
    let bytes_max = robot
        .budget
        .map_or(PROGRAM_BYTES_MAX, |budget| PROGRAM_BYTES_MAX.min(budget.flash_bytes as usize));
    let section = script_section(parts, &sealed);
    let whole = section.map(|section| [&program[..at], &section].concat());
    match whole {
        Some(whole) if whole.len() <= bytes_max => Ok(whole),
        other => {
            let bytes = other.map_or(at + sealed.len(), |whole| whole.len());
            Err(ProgramError::TooLong { bytes, bytes_max }.into())
        }
    }
}

/// Returns a program of [`exchange_script`] as an Intel hex file. KiloGUI needs its lines in
/// ascending order without gaps.
pub fn to_hex(program: &[u8]) -> String {
    let lines = program.chunks(LINE).zip((0_u16..).step_by(LINE));
    let data = lines.map(|(bytes, offset)| Record::Data { offset, value: bytes.to_vec() });
    let records: Vec<Record> = data.chain([Record::EndOfFile]).collect();
    create_object_file_representation(&records).expect("only the last record ends the file")
}

/// Returns function, file and line of an instruction.
fn place(symbols: &Symbols, at: u32) -> Option<(String, String, u32)> {
    let place = symbols.position(at)?;
    let function = symbols.function(at)?;
    Some((function.name.clone(), symbols.file(place.file)?.to_owned(), place.line))
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
