//! Flashes Kilobots, whose whole program avrdude writes through a programmer for AVRs.
//!
//! A programmer erases the chip first, including the boot loader, through which KiloGUI reaches the
//! robot, and the EEPROM, which holds the robot's calibration. Both are therefore read first, and
//! written back with the program.

use std::fs;
use std::io;
use std::path::Path;
use std::process::{Command, ExitStatus, Stdio};

use bittybuzz_isp::memories::{self, ERASED_ID, Memories, MissingCalibration};
use bittybuzz_robot_spec::Robot;

use crate::file_error::FileError;
use crate::hex;
use crate::output;
use crate::problem::Problem;
use crate::program::LoadedProgram;
use crate::report;
use crate::scratch::ScratchFile;
use crate::shell;

/// A reason why a robot cannot be written by a programmer.
#[derive(Debug, thiserror::Error)]
enum ProgrammerError {
    #[error("avrdude is not installed")]
    NotInstalled,
    /// avrdude is installed, but does not start.
    #[error("cannot run avrdude: {0}")]
    Start(io::Error),
    #[error("avrdude has failed ({0})")]
    Failed(ExitStatus),
    /// The flash of the robot with this title cannot be read.
    #[error("the lock bits of the {0} do not let its flash be read")]
    Locked(String),
    /// The id for the robot with this title is the one that erased memory holds.
    #[error("the {0} cannot have the id {ERASED_ID}")]
    ErasedId(String),
    /// Writing failed, and the robot may already be erased.
    #[error("{error}, and the robot may be without a program now")]
    Unfinished {
        error: Box<ProgrammerError>,
        /// The command that writes the earlier content.
        restore: String,
    },
}

impl Problem for ProgrammerError {
    fn help(&self) -> Option<String> {
        let help = match self {
            ProgrammerError::NotInstalled => "on Debian: apt-get install avrdude",
            ProgrammerError::Start(_) => return None,
            ProgrammerError::Failed(_) => {
                "its messages above say why; --programmer and --port tell it where the programmer is"
            }
            ProgrammerError::Locked(_) => {
                "its boot loader would be lost: KiloGUI sends the file that `bbz build --firmware` makes"
            }
            ProgrammerError::ErasedId(_) => {
                "it is that of a robot without an id: choose one from 0 to 65534"
            }
            ProgrammerError::Unfinished { restore, .. } => {
                return Some(format!("what was on the robot is kept; this writes it: {restore}"));
            }
        };
        Some(help.to_owned())
    }
}

const PROGRAM: &str = "avrdude";

/// The access to the programmer, in avrdude's terms. Without it avrdude's own settings hold.
#[derive(Debug, Clone, Default, clap::Args)]
pub struct Programmer {
    /// Kilobots: avrdude's name of the programmer, such as avrisp2 or usbasp [default: that of ~/.avrduderc]
    #[arg(long, value_name = "NAME")]
    programmer: Option<String>,
    /// Kilobots: where the programmer is connected, such as usb or /dev/ttyUSB0 [default: that of ~/.avrduderc]
    #[arg(long, value_name = "PORT")]
    port: Option<String>,
}

impl Programmer {
    /// Returns true if an option is given.
    pub fn is_given(&self) -> bool {
        self.programmer.is_some() || self.port.is_some()
    }
}

/// Warns if a robot refuses to run scripts because its calibration is incomplete.
fn warn_of_erased(missing: MissingCalibration, title: &str) {
    let missing = match (missing.has_no_id, missing.has_no_duties) {
        (true, true) => "id and motor duties",
        (true, false) => "id",
        (false, _) => "motor duties",
    };
    let text = format!("the {title} has no {missing}: it shows magenta and runs no script");
    report::warning(&text, Some("--id N gives it an id, calibration by KiloGUI an id and duties"));
}

/// The content to write to a robot.
pub struct ProgrammingTask<'a> {
    /// The robot, for which [`memories::is_programmed_by_isp`] is true.
    pub robot: &'a Robot,
    /// The access to the robot.
    pub programmer: &'a Programmer,
    /// The path of the script, and its image.
    pub script: (&'a Path, &'a LoadedProgram),
    /// The firmware whose script is replaced; `None` for the firmware on the robot.
    pub firmware: Option<&'a Path>,
    /// The id that the robot gets.
    pub id: Option<u16>,
}

impl ProgrammingTask<'_> {
    /// Returns the firmware from a file, with the script in it.
    fn program(&self, path: &Path) -> Result<Vec<u8>, Box<dyn Problem>> {
        self.exchanged(path, &hex::read(path)?)
    }

    fn exchanged(&self, path: &Path, program: &[u8]) -> Result<Vec<u8>, Box<dyn Problem>> {
        let (script, LoadedProgram { image, symbols, .. }) = self.script;
        hex::exchanged(path, program, (script, symbols.as_ref()), image, self.robot)
    }

    /// Writes the content to the robot; a dry run only checks the files and prints the calls.
    pub fn execute(&self, dry_run: bool) -> Result<(), Box<dyn Problem>> {
        if self.id == Some(ERASED_ID) {
            return Err(ProgrammerError::ErasedId(self.robot.title.clone()).into());
        }
        let program = self.firmware.map(|path| self.program(path)).transpose()?;
        let file = |content| ScratchFile::create(self.script.0, content);
        let [lock, flash, eeprom] = [file("lock.bin")?, file("flash.bin")?, file("eeprom.bin")?];
        let read =
            self.call(&[('r', "lock", &lock), ('r', "flash", &flash), ('r', "eeprom", &eeprom)]);
        let [new_flash, new_eeprom] = [file("new-flash.bin")?, file("new-eeprom.bin")?];
        let write = self.call(&[('w', "flash", &new_flash), ('w', "eeprom", &new_eeprom)]);
        if dry_run {
            let [read, write] = [&read, &write].map(|call| shell::line(&call.0));
            output::write(&format!("{read}\n{write}\n"))?;
            return Ok(());
        }
        read.run()?;
        // avrdude leaves out a lock byte with the value of erased memory, which forbids nothing.
        if content(&lock)?.first().is_some_and(|bits| !memories::is_readable(*bits)) {
            return Err(ProgrammerError::Locked(self.robot.title.clone()).into());
        }
        let mut memories = Memories::new(content(&flash)?, content(&eeprom)?, self.robot);
        let program = match program {
            Some(program) => program,
            None => self.exchanged(Path::new("the robot's flash"), memories.program())?,
        };
        if !memories.has_boot_loader() {
            let text = format!("the {} has no boot loader", self.robot.title);
            report::warning(&text, Some("KiloGUI cannot program it; an ISP programmer can"));
        }
        memories.set_program(&program);
        if let Some(id) = self.id {
            memories.set_id(id);
        }
        if let Some(missing) = memories.missing_calibration() {
            warn_of_erased(missing, &self.robot.title);
        }
        new_flash.write(&memories.flash)?;
        new_eeprom.write(&memories.eeprom)?;
        Ok(write.run().map_err(|error| {
            // The chip may be erased already, so the files with its earlier content are kept.
            let restore = self.call(&[('w', "flash", &flash), ('w', "eeprom", &eeprom)]);
            flash.keep();
            eeprom.keep();
            ProgrammerError::Unfinished { error: Box::new(error), restore: shell::line(&restore.0) }
        })?)
    }

    /// Returns a call of avrdude that reads (`r`) or writes (`w`) these memories.
    fn call(&self, operations: &[(char, &str, &ScratchFile)]) -> Avrdude {
        let mut call = Command::new(PROGRAM);
        // Robot files name chips as avrdude does.
        let chip = self.robot.chip.as_deref().expect("`is_programmed_by_isp` has compared it");
        call.args(["-q", "-p", chip]);
        let Programmer { programmer, port } = self.programmer;
        for (option, value) in [("-c", programmer), ("-P", port)] {
            call.args(value.iter().flat_map(|value| [option, value]));
        }
        for (direction, memory, file) in operations {
            call.args(["-U", &format!("{memory}:{direction}:{}:r", file.path().display())]);
        }
        Avrdude(call)
    }
}

/// Returns the bytes that avrdude has read.
fn content(file: &ScratchFile) -> Result<Vec<u8>, FileError> {
    fs::read(file.path()).map_err(|error| FileError::reading(file.path(), error))
}

/// A call of avrdude.
struct Avrdude(Command);

impl Avrdude {
    /// Runs avrdude; its messages go to standard error.
    fn run(mut self) -> Result<(), ProgrammerError> {
        let status = self.0.stdin(Stdio::null()).status().map_err(|error| match error.kind() {
            io::ErrorKind::NotFound => ProgrammerError::NotInstalled,
            _ => ProgrammerError::Start(error),
        })?;
        if status.success() { Ok(()) } else { Err(ProgrammerError::Failed(status)) }
    }
}
