//! Checks firmware (ELF) before it is flashed.

use std::fmt;
use std::path::{Path, PathBuf};

use bittybuzz_robot_spec::{Layout, Region};
use bittybuzz_toml_reader::file;
use object::Endianness;
use object::elf::{EM_ARM, FileHeader32, PT_LOAD};
use object::read::elf::{FileHeader, ProgramHeader};

use crate::file_error::FileError;
use crate::problem::Problem;

/// A reason why a file is not the firmware of a robot.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum FirmwareFileError {
    /// The file is not ELF, or it is damaged.
    NotElf,
    /// The file is for another kind of processor.
    NotArm,
    /// A segment lies in this region, which does not belong to the firmware.
    Outside(Region),
    /// No segment begins at this address, where the robot's firmware begins.
    Elsewhere(u32),
}

impl fmt::Display for FirmwareFileError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            FirmwareFileError::NotElf => write!(f, "is no ELF file for a 32-bit processor"),
            FirmwareFileError::NotArm => write!(f, "is for another processor than the robot's"),
            FirmwareFileError::Outside(Region { address, size }) => {
                write!(f, "has {size} bytes for {address:#010x}, which is no place for firmware")
            }
            FirmwareFileError::Elsewhere(address) => {
                write!(f, "has nothing for {address:#010x}, where the robot's firmware begins")
            }
        }
    }
}

impl FirmwareFileError {
    /// Returns advice on how to mend the error.
    pub fn help(&self) -> &'static str {
        match self {
            FirmwareFileError::NotElf => "name the file that cargo built, without extension",
            FirmwareFileError::NotArm => "was it built for this robot, not for this computer?",
            FirmwareFileError::Outside(_) | FirmwareFileError::Elsewhere(_) => {
                "build it with the [layout] of the robot file; what has another one, such as \
                 firmware in place of the boot loader, is flashed with probe-rs itself"
            }
        }
    }
}

/// A file that is not the firmware of a robot.
#[derive(Debug, thiserror::Error)]
#[error("`{path}` {error}")]
struct FirmwareError {
    path: PathBuf,
    error: FirmwareFileError,
}

impl Problem for FirmwareError {
    fn help(&self) -> Option<String> {
        Some(self.error.help().to_owned())
    }
}

/// Checks that the file at `path` is firmware for a robot with this layout.
pub fn check(path: &Path, layout: &Layout) -> Result<(), Box<dyn Problem>> {
    let bytes = file::read(path, file::PROGRAM_BYTES_MAX)
        .map_err(|error| FileError::reading(path, error))?;
    check_bytes(&bytes, layout).map_err(|error| FirmwareError { path: path.to_owned(), error })?;
    Ok(())
}

/// Checks the bytes of such a file.
pub fn check_bytes(bytes: &[u8], layout: &Layout) -> Result<(), FirmwareFileError> {
    let header = FileHeader32::<Endianness>::parse(bytes).map_err(|_| FirmwareFileError::NotElf)?;
    let endian = header.endian().map_err(|_| FirmwareFileError::NotElf)?;
    if header.e_machine(endian) != EM_ARM {
        return Err(FirmwareFileError::NotArm);
    }
    let segments = header.program_headers(endian, bytes).map_err(|_| FirmwareFileError::NotElf)?;
    let loaded = segments.iter().filter(|segment| segment.p_type(endian) == PT_LOAD);
    // Segments without content, such as stacks and variables that start as 0, are not written.
    let written = loaded.filter(|segment| segment.p_filesz(endian) > 0);
    let mut begins = false;
    for segment in written {
        let region = Region { address: segment.p_paddr(endian), size: segment.p_filesz(endian) };
        if ![layout.application, layout.script].iter().any(|place| place.contains(region)) {
            return Err(FirmwareFileError::Outside(region));
        }
        begins |= region.address == layout.application.address;
    }
    if begins { Ok(()) } else { Err(FirmwareFileError::Elsewhere(layout.application.address)) }
}
