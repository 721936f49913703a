//! Files with programs: firmware whose script is exchanged, and Intel hex for robots.

use std::path::{Path, PathBuf};

use bittybuzz_compiler::symbols::Symbols;
use bittybuzz_isp::program::{self, ExchangeError, ProgramError};
use bittybuzz_robot_spec::Robot;
use bittybuzz_toml_reader::file;

use crate::file_error::FileError;
use crate::problem::Problem;
use crate::program::RefusedImage;

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
    Ok(program::to_hex(&program))
}

/// Reads the program in a file.
pub fn read(path: &Path) -> Result<Vec<u8>, Box<dyn Problem>> {
    let bytes = file::read(path, file::PROGRAM_BYTES_MAX)
        .map_err(|error| FileError::reading(path, error))?;
    Ok(program::read(&bytes).map_err(|error| ProgramFileError::new(path, error))?)
}

/// Returns the program that was read from `path`, with `image` in the place of its script.
pub fn exchanged(
    path: &Path,
    program: &[u8],
    (script, symbols): (&Path, Option<&Symbols>),
    image: &[u8],
    robot: &Robot,
) -> Result<Vec<u8>, Box<dyn Problem>> {
    match program::exchange_script(program, image, symbols, robot) {
        Ok(program) => Ok(program),
        Err(ExchangeError::Program(error)) => Err(ProgramFileError::new(path, error).into()),
        Err(ExchangeError::Image(cause)) => Err(RefusedImage::new(script, cause).into()),
    }
}
