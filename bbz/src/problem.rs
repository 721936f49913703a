//! The mistakes of a command line, or of the files that it names.

use std::fmt;
use std::io;
use std::path::{Path, PathBuf};
use std::process::ExitStatus;

#[cfg(feature = "view")]
use bittybuzz_arena::output::recording::RecordingError;
use bittybuzz_compiler::bo::error::BoError;
use bittybuzz_compiler::refusal;
use bittybuzz_compiler::symbols::SymbolsError;
use bittybuzz_emulation::ClientError;
use bittybuzz_kilobot::calibration::ERASED_ID;
use bittybuzz_robot_spec::{NumberProfile, RobotErrors};
use bittybuzz_toml_reader::file::ReadError;
use bittybuzz_vm_core::ImageError;

use crate::firmware::FirmwareFileError;
use crate::hex::ProgramError;
use crate::sim::MOST_RUNS;

/// A reason why a command cannot be carried out, one variant for each cause.
#[derive(Debug)]
pub enum Problem {
    /// The file cannot be read.
    Unreadable {
        /// The help suggests a similar name if this file does not exist.
        path: PathBuf,
        error: ReadError,
    },
    /// The output file is also read by the same command.
    ReadAndWritten(PathBuf),
    /// The seed is given by `--seed` and by `--set`.
    TwoSeeds,
    /// A value of `--set` that cannot be written into the text of the scenario.
    #[cfg(feature = "view")]
    NoPlace(String),
    /// `--checks` with several values of `--set`.
    ChecksOfMany,
    /// `--view` with several values of `--set`.
    #[cfg(feature = "view")]
    ViewOfMany,
    /// Values of `--set` that change the columns of the table.
    UnlikeColumns,
    /// `--resume` with a table that goes to a stream.
    NothingToResume(PathBuf),
    /// The folder for the journal of a batch holds other files.
    BatchFolder(PathBuf),
    /// Another process is working on the batch.
    BatchBusy(PathBuf),
    /// The batch was stopped before, and is not to be resumed.
    BatchUnfinished(PathBuf),
    /// The journal belongs to another batch.
    BatchDiffers {
        folder: PathBuf,
        /// Options and files that have changed.
        what: Vec<String>,
    },
    /// A part of a journal that is damaged.
    BatchPart {
        path: PathBuf,
        /// The line, from 1.
        line: usize,
    },
    /// There are more than [`MOST_RUNS`] runs.
    TooManyRuns {
        /// Runs of each combination of values.
        runs: u32,
        /// Combinations of values, at most the largest `usize`.
        variants: usize,
    },
    /// A folder where a file is needed.
    Folder(PathBuf),
    /// The name of the file has no known extension.
    UnknownKind(PathBuf),
    /// An image where a script is needed.
    NotAScript(PathBuf),
    /// `--fix` without a file to change.
    FixStandardInput,
    /// An object file that is damaged, or that no Buzz compiler has made.
    Object {
        path: PathBuf,
        /// The reader's error.
        error: BoError,
    },
    /// `--robot` names no robot, or the robot file is wrong.
    Robot(RobotErrors),
    /// `--profile` asks for another profile than the image has.
    Profile {
        path: PathBuf,
        /// The profile of the image.
        image: NumberProfile,
    },
    /// The virtual machine refuses the image.
    Refused {
        /// The file of the image.
        path: PathBuf,
        /// The verifier's error.
        cause: ImageError,
    },
    /// A file cannot be written.
    Unwritable {
        path: PathBuf,
        /// The error of the system.
        error: io::Error,
    },
    /// `bbz explain` was asked for a code that does not exist.
    UnknownCode {
        code: String,
        /// The code that was probably meant.
        likely: Option<String>,
    },
    /// Symbols that cannot be used.
    Symbols {
        path: PathBuf,
        /// The reader's error.
        error: SymbolsError,
    },
    /// The command needs a robot, and none is named.
    NoRobot,
    /// The robot with this title can neither be flashed nor traced yet.
    NotYet(String),
    /// The robot with this title cannot be assigned an id.
    NoIdRegion(String),
    /// A `--set` that is not `KEY=VALUE`.
    Setting(String),
    /// A `--set` that the robot does not know or accept.
    RobotSetting {
        argument: String,
        robot: String,
        /// The settings of the robot, a line each.
        settings: Vec<String>,
    },
    /// `--emulate` was given without a firmware file.
    NoFirmware,
    /// Symbols where an image is needed.
    NoImage(PathBuf),
    /// An image for another profile than the robot's.
    RobotProfile {
        /// The file of the image.
        path: PathBuf,
        image: NumberProfile,
        /// Title of the robot.
        robot: String,
    },
    /// An image that does not fit the robot.
    CapacityError {
        /// The file of the image.
        path: PathBuf,
        message: String,
        help: String,
    },
    /// The file is not firmware for the robot.
    Firmware {
        /// The path from `--firmware`.
        path: PathBuf,
        error: FirmwareFileError,
    },
    /// The script cannot be put into the program in the file.
    Program {
        /// The path from `--firmware`; `the robot's flash` for the program on a robot.
        path: PathBuf,
        error: ProgramError,
    },
    /// `--firmware` for the robot with this title, whose script has a region of its own.
    OwnRegion(String),
    /// The script does not fit into its region of the flash.
    TooLong {
        /// The file of the script.
        path: PathBuf,
        /// Bytes of its image.
        bytes: usize,
        /// The most bytes that fit.
        most: u32,
    },
    /// The firmware has no table of messages.
    NoMessages {
        path: PathBuf,
        /// The mistake in the table, if there is one.
        reason: Option<String>,
    },
    /// The emulator cannot do the requested work.
    Emulator(ClientError),
    /// probe-rs is not installed.
    NoProbeRs,
    /// probe-rs is installed, but does not start.
    ProbeRsStart(io::Error),
    /// probe-rs finds no debug probe.
    NoProbe,
    /// probe-rs has failed.
    ProbeRs(ExitStatus),
    /// avrdude is not installed.
    NoAvrdude,
    /// avrdude is installed, but does not start.
    AvrdudeStart(io::Error),
    /// avrdude has failed.
    Avrdude(ExitStatus),
    /// The flash of the robot with this title cannot be read.
    Locked(String),
    /// The id for the robot with this title is the one that erased memory holds.
    ErasedId(String),
    /// Writing failed, and the robot may already be erased.
    Unfinished {
        error: Box<Problem>,
        /// The command that writes the earlier content.
        restore: String,
    },
    /// Options for programmers were given, but the robot with this title is flashed through a debug
    /// probe.
    NoProgrammer(String),
    /// `--emulator` names one program, but the robots need several.
    SeveralEmulators,
    /// Standard input, or the output of another program, cannot be read.
    Input(io::Error),
    /// Ctrl-C cannot be taken over.
    Interrupt(ctrlc::Error),
    /// A recording that cannot be read.
    #[cfg(feature = "view")]
    Recording {
        /// The path from the command line.
        path: PathBuf,
        error: RecordingError,
    },
    /// The folder to be graded has no scenario, or several.
    WhichAssignment(PathBuf),
    /// The folder to be graded has no results.
    NothingHandedIn(PathBuf),
    /// The assignment does not run: the mistakes of its scenario and scripts.
    Assignment(String),
    /// The page cannot be served.
    #[cfg(feature = "view")]
    Page(bittybuzz_page::PageError),
    /// Standard output cannot be written.
    Output(io::Error),
}

impl Problem {
    /// Returns the problem of a file that cannot be read.
    pub fn unreadable(path: &Path, error: impl Into<ReadError>) -> Problem {
        match error.into() {
            ReadError::Folder => Problem::Folder(path.to_owned()),
            error => Problem::Unreadable { path: path.to_owned(), error },
        }
    }

    /// Returns the problem of a file that cannot be written.
    pub fn unwritable(path: &Path, error: io::Error) -> Problem {
        Problem::Unwritable { path: path.to_owned(), error }
    }

    /// Returns the problem of an image that the virtual machine refuses.
    pub fn refused(path: &Path, cause: ImageError) -> Problem {
        Problem::Refused { path: path.to_owned(), cause }
    }

    /// Returns advice on how to mend the problem.
    pub fn help(&self) -> Option<String> {
        match self {
            Problem::Unreadable { path, error: ReadError::Io(error) }
                if error.kind() == io::ErrorKind::NotFound =>
            {
                likely_file(path).map(|likely| format!("did you mean `{}`?", likely.display()))
            }
            Problem::Folder(_) => Some("name a file in it".to_owned()),
            Problem::ReadAndWritten(_) => Some("name another file".to_owned()),
            Problem::TwoSeeds => Some("leave out one of them".to_owned()),
            #[cfg(feature = "view")]
            Problem::NoPlace(_) => Some("change it in the file".to_owned()),
            Problem::ChecksOfMany => Some("give each key of `--set` one value".to_owned()),
            #[cfg(feature = "view")]
            Problem::ViewOfMany => Some("give each key of `--set` one value".to_owned()),
            Problem::UnlikeColumns => {
                Some("use `bbz sim` once for each, with a table of its own".to_owned())
            }
            Problem::NothingToResume(_) => {
                Some("name a file, next to which finished runs can be kept".to_owned())
            }
            Problem::BatchFolder(_) => {
                Some("name another file for the table, or move the folder".to_owned())
            }
            Problem::BatchBusy(_) => {
                Some("wait for it, or name another file for the table".to_owned())
            }
            Problem::BatchUnfinished(_) => {
                Some("--resume goes on with it; to start again, remove the folder".to_owned())
            }
            Problem::BatchDiffers { .. } => Some(
                "give the options and files that it was started with; to start again, remove the folder"
                    .to_owned(),
            ),
            Problem::BatchPart { .. } => {
                Some("remove the file: its runs are simulated again".to_owned())
            }
            Problem::TooManyRuns { .. } => {
                Some(format!("all runs together can be {MOST_RUNS}; use `bbz sim` several times"))
            }
            Problem::UnknownKind(_) => Some(
                "a script ends in .bzz, a Buzz object file in .bo, an image in .bbi".to_owned(),
            ),
            Problem::FixStandardInput => {
                Some("with --json each message carries its changes as `edits`".to_owned())
            }
            Problem::NotAScript(_) => {
                Some("name the .bzz script that it was built from".to_owned())
            }
            Problem::Profile { image, .. } => Some(format!(
                "leave out --profile, or build the script again with --profile {}",
                match image {
                    NumberProfile::Tiny => NumberProfile::Full.name(),
                    NumberProfile::Full => NumberProfile::Tiny.name(),
                }
            )),
            Problem::Refused { cause, .. } => refusal::help(cause),
            Problem::UnknownCode { likely, .. } => Some(match likely {
                Some(likely) => format!("did you mean {likely}? `bbz explain` lists all codes"),
                None => "`bbz explain` lists all codes".to_owned(),
            }),
            Problem::Object { .. } => Some("compile its script instead".to_owned()),
            Problem::Symbols { .. } => Some("`bbz build` writes it again".to_owned()),
            Problem::Setting(_) => Some("write it as `--set medium.ir.loss=0.1`".to_owned()),
            Problem::NoRobot => Some("name it, as in --robot NAME; `bbz robots` lists them".to_owned()),
            Problem::NotYet(_) => {
                Some("its robot file has no [layout]: where firmware and script lie".to_owned())
            }
            Problem::NoIdRegion(_) => Some(
                "its robot file has no `id` in its [layout]: flash that it shares with nothing"
                    .to_owned(),
            ),
            Problem::RobotSetting { settings, .. } if settings.is_empty() => {
                Some("its robot file has no [[setting]]".to_owned())
            }
            Problem::RobotSetting { settings, .. } => Some(settings.join("\n      ")),
            Problem::NoFirmware => Some("name the firmware (ELF) in place of -".to_owned()),
            Problem::NoImage(_) => {
                Some("name the script (.bzz), or its image (.bbi) next to the symbols".to_owned())
            }
            Problem::RobotProfile { .. } => Some("build it without --profile".to_owned()),
            Problem::CapacityError { help, .. } => Some(help.clone()),
            Problem::Firmware { error, .. } => Some(error.help().to_owned()),
            Problem::Program { error, .. } => Some(error.help().to_owned()),
            Problem::OwnRegion(_) => Some("`bbz flash --firmware` writes both".to_owned()),
            Problem::TooLong { .. } => Some("shorten the script".to_owned()),
            Problem::NoMessages { .. } => {
                Some("name the ELF file that cargo built, with its symbols".to_owned())
            }
            Problem::NoProbeRs => Some(
                "cargo install probe-rs-tools --locked (on Debian it needs the packages \
                 libudev-dev and pkg-config); https://probe.rs tells of other ways"
                    .to_owned(),
            ),
            Problem::NoProbe => Some(
                "plug in the probe, and power the robot; on Linux, udev rules must let you use it: \
                 https://probe.rs/docs/getting-started/probe-setup"
                    .to_owned(),
            ),
            Problem::ProbeRs(_) => Some("its messages above say why".to_owned()),
            Problem::NoAvrdude => Some("on Debian: apt-get install avrdude".to_owned()),
            Problem::Avrdude(_) => Some(
                "its messages above say why; --programmer and --port tell it where the programmer is".to_owned(),
            ),
            Problem::Locked(_) => Some(
                "its boot loader would be lost: KiloGUI sends the file that `bbz build --firmware` makes"
                    .to_owned(),
            ),
            Problem::ErasedId(_) => {
                Some("it is that of a robot without an id: choose one from 0 to 65534".to_owned())
            }
            Problem::Unfinished { restore, .. } => {
                Some(format!("what was on the robot is kept; this writes it: {restore}"))
            }
            Problem::SeveralEmulators => {
                Some("without --emulator they are searched next to this program, and in PATH".to_owned())
            }
            Problem::NoProgrammer(_) => {
                Some("environment variable PROBE_RS_PROBE chooses among several probes".to_owned())
            }
            Problem::WhichAssignment(_) => Some("name it with `--scenario FILE`".to_owned()),
            Problem::NothingHandedIn(_) => {
                Some("the page of an assignment writes them by `Hand in`".to_owned())
            }
            Problem::Unreadable { .. }
            | Problem::Assignment(_)
            | Problem::Robot(_)
            | Problem::AvrdudeStart(_)
            | Problem::Emulator(_)
            | Problem::ProbeRsStart(_)
            | Problem::Input(_)
            | Problem::Unwritable { .. }
            | Problem::Interrupt(_)
            | Problem::Output(_) => None,
            #[cfg(feature = "view")]
            Problem::Page(_) => None,
            #[cfg(feature = "view")]
            Problem::Recording { error: RecordingError::NotARecording, .. } => {
                Some("`bbz sim SCENARIO.toml --record FILE` makes one".to_owned())
            }
            #[cfg(feature = "view")]
            Problem::Recording { .. } => None,
        }
    }
}

impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Problem::Unreadable { path, error } => match error {
                ReadError::Io(error) if error.kind() == io::ErrorKind::NotFound => {
                    write!(f, "there is no file `{}`", path.display())
                }
                ReadError::Io(error) if error.kind() == io::ErrorKind::PermissionDenied => {
                    write!(f, "no permission to read `{}`", path.display())
                }
                _ => write!(f, "cannot read `{}`: {error}", path.display()),
            },
            Problem::ReadAndWritten(path) => {
                write!(f, "`{}` is read by this command, and would be replaced", path.display())
            }
            Problem::TwoSeeds => {
                write!(f, "`--seed` and `--set world.seed` both give the seed")
            }
            #[cfg(feature = "view")]
            Problem::NoPlace(value) => {
                write!(
                    f,
                    "`--set {value}` has no place in the text of the scenario, which the page shows"
                )
            }
            Problem::ChecksOfMany => {
                write!(f, "`--checks` reports one run, and `--set` asks for several")
            }
            #[cfg(feature = "view")]
            Problem::ViewOfMany => {
                write!(f, "`--view` shows one run, and `--set` asks for several")
            }
            Problem::UnlikeColumns => {
                write!(f, "the values of `--set` change which columns the table has")
            }
            Problem::NothingToResume(path) => {
                write!(f, "`{}` is no file, so there is no batch to resume", path.display())
            }
            Problem::BatchFolder(path) => {
                write!(
                    f,
                    "`{}` is where finished runs are kept, and holds other files",
                    path.display()
                )
            }
            Problem::BatchBusy(path) => {
                write!(f, "another `bbz` is at work on the runs in `{}`", path.display())
            }
            Problem::BatchUnfinished(path) => {
                write!(f, "`{}` has finished runs of a batch that was stopped", path.display())
            }
            Problem::BatchDiffers { folder, what } => write!(
                f,
                "`{}` has runs of another batch; not as they were: {}",
                folder.display(),
                what.join(", ")
            ),
            Problem::BatchPart { path, line } => {
                write!(f, "line {line} of `{}` is damaged, or of another batch", path.display())
            }
            Problem::TooManyRuns { runs, variants } => {
                write!(f, "{runs} runs of {variants} combinations of values are too many")
            }
            Problem::Folder(path) => write!(f, "`{}` is a folder, not a file", path.display()),
            Problem::UnknownKind(path) => {
                write!(f, "the name `{}` does not show what kind of file it is", path.display())
            }
            Problem::FixStandardInput => {
                f.write_str("standard input cannot be mended in its place")
            }
            Problem::NotAScript(path) => {
                write!(f, "`{}` is an image already", path.display())
            }
            Problem::Object { path, error } => {
                write!(f, "`{}` cannot be used: {error}", path.display())
            }
            Problem::Robot(errors) => errors.fmt(f),
            Problem::Profile { path, image } => write!(
                f,
                "`{}` was built for the {} profile, which --profile cannot change",
                path.display(),
                image.name()
            ),
            Problem::Refused { path, cause } => {
                write!(f, "`{}` {}", path.display(), refusal::sentence(cause))
            }
            Problem::Unwritable { path, error } => {
                write!(f, "cannot write `{}`: {error}", path.display())
            }
            Problem::UnknownCode { code, .. } => write!(f, "there is no code `{code}`"),
            Problem::Symbols { path, error } => write!(f, "`{}` is {error}", path.display()),
            Problem::NoRobot => write!(f, "the robot is not named"),
            Problem::NotYet(robot) => {
                write!(f, "the {robot} cannot be flashed or traced by this `bbz` yet")
            }
            Problem::NoIdRegion(robot) => write!(f, "the {robot} has no place for an id"),
            Problem::Setting(argument) => write!(f, "`--set {argument}` gives no value"),
            Problem::RobotSetting { argument, robot, .. } => {
                write!(f, "the {robot} cannot be set by `--set {argument}`")
            }
            Problem::NoFirmware => write!(f, "there is no firmware to emulate"),
            Problem::NoImage(path) => {
                write!(f, "`{}` describes a script, but is not one", path.display())
            }
            Problem::RobotProfile { path, image, robot } => write!(
                f,
                "`{}` was built for the {} profile, which is not that of the {robot}",
                path.display(),
                image.name()
            ),
            Problem::CapacityError { path, message, .. } => {
                write!(f, "`{}`: {message}", path.display())
            }
            Problem::Firmware { path, error } => write!(f, "`{}` {error}", path.display()),
            Problem::Program { path, error } => write!(f, "`{}` {error}", path.display()),
            Problem::OwnRegion(robot) => {
                write!(f, "on the {robot} the script has a place of its own, next to the firmware")
            }
            Problem::TooLong { path, bytes, most } => {
                write!(f, "`{}` needs {bytes} bytes, the robot has room for {most}", path.display())
            }
            Problem::NoMessages { path, reason: None } => {
                write!(f, "`{}` has no defmt messages", path.display())
            }
            Problem::NoMessages { path, reason: Some(reason) } => {
                write!(f, "the defmt messages of `{}` cannot be used: {reason}", path.display())
            }
            Problem::Emulator(error) => error.fmt(f),
            Problem::NoProbeRs => write!(f, "probe-rs is not installed"),
            Problem::ProbeRsStart(error) => write!(f, "cannot run probe-rs: {error}"),
            Problem::NoProbe => write!(f, "no debug probe is connected"),
            Problem::ProbeRs(status) => write!(f, "probe-rs has failed ({status})"),
            Problem::NoAvrdude => write!(f, "avrdude is not installed"),
            Problem::AvrdudeStart(error) => write!(f, "cannot run avrdude: {error}"),
            Problem::Avrdude(status) => write!(f, "avrdude has failed ({status})"),
            Problem::Locked(robot) => {
                write!(f, "the lock bits of the {robot} do not let its flash be read")
            }
            Problem::ErasedId(robot) => write!(f, "the {robot} cannot have the id {ERASED_ID}"),
            Problem::Unfinished { error, .. } => {
                write!(f, "{error}, and the robot may be without a program now")
            }
            Problem::SeveralEmulators => {
                write!(
                    f,
                    "the robots of this scenario need several emulators, not the one of --emulator"
                )
            }
            Problem::NoProgrammer(robot) => {
                write!(f, "the {robot} is flashed through a debug probe, not through a programmer")
            }
            Problem::Input(error) => write!(f, "cannot read the robot's messages: {error}"),
            Problem::Interrupt(error) => write!(f, "cannot take over Ctrl-C: {error}"),
            #[cfg(feature = "view")]
            Problem::Page(error) => error.fmt(f),
            #[cfg(feature = "view")]
            Problem::Recording { path, error } => {
                write!(f, "cannot show `{}`: {error}", path.display())
            }
            Problem::WhichAssignment(folder) => {
                write!(f, "`{}` does not have one scenario (*.toml)", folder.display())
            }
            Problem::NothingHandedIn(folder) => {
                write!(f, "`{}` has no results (*.json)", folder.display())
            }
            Problem::Assignment(mistakes) => {
                write!(f, "the assignment does not run: {}", mistakes.trim_end())
            }
            Problem::Output(error) => write!(f, "cannot write to standard output: {error}"),
        }
    }
}

impl std::error::Error for Problem {}

/// Returns the file next to the missing one whose name is most similar.
fn likely_file(path: &Path) -> Option<PathBuf> {
    let wanted = path.file_name()?.to_str()?;
    let folder = path.parent()?;
    let searched = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    let names = searched.read_dir().ok()?.flatten().filter_map(|entry| {
        let name = entry.file_name().into_string().ok()?;
        ([".bzz", ".bo", ".bbi", ".toml"].iter().any(|end| name.ends_with(end))).then_some(name)
    });
    let scored = names.map(|name| (strsim::jaro_winkler(wanted, &name), name));
    let best = scored.max_by(|a, b| a.0.total_cmp(&b.0))?;
    (best.0 > 0.85).then(|| folder.join(best.1))
}
