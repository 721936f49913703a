//! `bbz flash`: writes a script, and if asked the firmware, to a robot.

use std::path::{Path, PathBuf};

use bittybuzz_compiler::fit;
use bittybuzz_isp::memories;
use bittybuzz_robot_spec::{Layout, NumberProfile, Robot, SettingError};
use bittybuzz_vm_core::ImageError;
use clap::Args;

use crate::exit::ExitStatus;
use crate::firmware;
use crate::isp::{Programmer, ProgrammingTask};
use crate::output::{self, OutputError};
use crate::probe_rs::{self, ProbeRs};
use crate::problem::Problem;
use crate::program::LoadedProgram;
use crate::program::RefusedImage;
use crate::scratch::ScratchFile;
use crate::selection::RobotChoice;

/// A reason why a robot cannot be flashed as the command line asks for.
#[derive(Debug, thiserror::Error)]
enum FlashError {
    /// Options for programmers were given, but the robot with this title is flashed through a debug
    /// probe.
    #[error("the {0} is flashed through a debug probe, not through a programmer")]
    NoProgrammer(String),
    /// The robot with this title cannot be assigned an id.
    #[error("the {0} has no place for an id")]
    NoIdRegion(String),
    /// A `--set` that the robot does not know or accept.
    #[error(transparent)]
    RobotSetting(#[from] SettingError),
    /// An image for another profile than the robot's.
    #[error("`{path}` was built for the {} profile, which is not that of the {robot}", .image.name())]
    RobotProfile {
        /// The file of the image.
        path: PathBuf,
        image: NumberProfile,
        /// Title of the robot.
        robot: String,
    },
    /// An image that does not fit the robot.
    #[error("`{path}`: {message}")]
    Capacity {
        /// The file of the image.
        path: PathBuf,
        message: String,
        help: String,
    },
}

impl Problem for FlashError {
    fn help(&self) -> Option<String> {
        Some(match self {
            FlashError::NoProgrammer(_) => {
                "environment variable PROBE_RS_PROBE chooses among several probes".to_owned()
            }
            FlashError::NoIdRegion(_) => {
                "its robot file has no `id` in its [layout]: flash that it shares with nothing"
                    .to_owned()
            }
            FlashError::RobotSetting(error) => error.help(),
            FlashError::RobotProfile { .. } => "build it without --profile".to_owned(),
            FlashError::Capacity { help, .. } => help.clone(),
        })
    }
}

const EXAMPLES: &str = "\
Examples:
  bbz flash blink.bzz --robot crazyflie                 exchange the script, keep the firmware
  bbz flash blink.bbi --robot crazyflie                 the same with what `bbz build` has made
  bbz flash blink.bzz --robot crazyflie --firmware crazyflie.elf    firmware and script
  bbz flash blink.bzz --robot crazyflie --id 7          also make it robot 7, from now on
  bbz flash blink.bzz --robot zooids --set range_mm=300 it does not hear robots that are farther away, from now on
  bbz flash blink.bzz --robot kilobot --firmware kilobot.elf --programmer avrisp2 --port usb    by avrdude
  bbz flash blink.bzz --robot crazyflie --dry-run       check everything, and print what would be called

The script has a part of the flash of its own, where firmware looks for it that was built for this robot file. probe-rs
does the writing (environment variable PROBE_RS_PROBE chooses among several probes); the robot starts anew
afterwards. Not tried on hardware.

An AVR robot's program is written as a whole, by avrdude and a programmer on its header: without --firmware the script is
exchanged in the program that the robot has. Boot loader and EEPROM are read before, and written again. Without a
programmer KiloGUI sends what `bbz build --firmware` makes.

Exit status: 0, or 2 compile error, 3 wrong command line or file, an image that the robot would refuse, no probe.";

/// Arguments of `bbz flash`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct FlashArguments {
    /// Script (.bzz), Buzz object file (.bo) or image (.bbi)
    file: PathBuf,
    /// Robot: its name (crazyflie) or the path of a robot file (*.toml)
    #[arg(long, value_name = "NAME|PATH.toml")]
    robot: String,
    /// Also write this firmware (ELF; a Kilobot's may be Intel hex)
    #[arg(long, value_name = "ELF")]
    firmware: Option<PathBuf>,
    /// Also assign this id to the robot; it keeps it when other scripts and firmware are flashed
    #[arg(long, value_name = "N")]
    id: Option<u16>,
    /// Also set what the robot file calls a setting; all that are not given are as if never set. May be given several times
    #[arg(long, value_name = "NAME=VALUE")]
    set: Vec<String>,
    #[command(flatten)]
    programmer: Programmer,
    /// Only check, and print the calls of probe-rs or avrdude
    #[arg(long)]
    dry_run: bool,
    /// Folder to search for included files; may be given several times
    #[arg(short = 'I', value_name = "DIR")]
    include: Vec<PathBuf>,
}

/// Carries out the command.
pub fn execute(arguments: &FlashArguments) -> Result<ExitStatus, Box<dyn Problem>> {
    let selection = RobotChoice::new(Some(&arguments.robot), None)?;
    let robot =
        selection.robot.as_ref().expect("`--robot` is required, and an unknown one is an error");
    if memories::is_programmed_by_isp(robot) {
        return by_programmer(arguments, &selection, robot);
    }
    if arguments.programmer.is_given() {
        return Err(FlashError::NoProgrammer(robot.title.clone()).into());
    }
    let (chip, layout) = (probe_rs::chip(robot)?, probe_rs::layout(robot)?);
    let opened = LoadedProgram::open(&arguments.file, &arguments.include, &selection)?;
    let Some(program) = opened else { return Ok(ExitStatus::CompileError) };
    check(&arguments.file, &program, robot)?;
    let section = probe_rs::script_section(robot, &arguments.file, &program.image)?;
    if let Some(path) = &arguments.firmware {
        firmware::check(path, &layout)?;
    }
    let file = ScratchFile::create(&arguments.file, "script.bin")?;
    let id = arguments.id.map(|id| assign(id, robot, &layout, &arguments.file)).transpose()?;
    let settings = robot.settings_content(&arguments.set).map_err(FlashError::from)?;
    let settings = settings.map(|(address, section)| {
        let file = ScratchFile::create(&arguments.file, "settings.bin")?;
        Ok::<_, Box<dyn Problem>>(RegionContent { address, section, file })
    });
    let assignments = [id, settings.transpose()?];
    let firmware = arguments.firmware.as_deref().map(|path| firmware_call(chip, path));
    let assigned = assignments.iter().flatten().map(|assignment| assignment.call(chip));
    // The script is written last, because its last call restarts the robot.
    let scripts = script_calls(chip, &layout, file.path());
    let calls: Vec<ProbeRs> = firmware.into_iter().chain(assigned).chain(scripts).collect();
    if arguments.dry_run {
        let calls: String = calls.iter().map(|call| format!("{call}\n")).collect();
        output::write(&calls)?;
        return Ok(ExitStatus::Success);
    }
    file.write(&section)?;
    for assignment in assignments.iter().flatten() {
        assignment.file.write(&assignment.section)?;
    }
    calls.into_iter().try_for_each(ProbeRs::run)?;
    Ok(done(&arguments.file, &program, robot)?)
}

/// Flashes a robot whose whole program is written by a programmer.
fn by_programmer(
    arguments: &FlashArguments,
    selection: &RobotChoice,
    robot: &Robot,
) -> Result<ExitStatus, Box<dyn Problem>> {
    let Some(program) = LoadedProgram::open(&arguments.file, &arguments.include, selection)? else {
        return Ok(ExitStatus::CompileError);
    };
    check(&arguments.file, &program, robot)?;
    // A robot without a place for settings refuses each.
    robot.settings_content(&arguments.set).map_err(FlashError::from)?;
    let task = ProgrammingTask {
        robot,
        programmer: &arguments.programmer,
        script: (&arguments.file, &program),
        firmware: arguments.firmware.as_deref(),
        id: arguments.id,
    };
    task.execute(arguments.dry_run)?;
    if arguments.dry_run {
        return Ok(ExitStatus::Success);
    }
    Ok(done(&arguments.file, &program, robot)?)
}

fn done(script: &Path, program: &LoadedProgram, robot: &Robot) -> Result<ExitStatus, OutputError> {
    let (script, title) = (script.display(), &robot.title);
    let bytes = program.image.len();
    output::write(&format!("`{script}` ({bytes} bytes) is on the {title}, which restarts\n"))?;
    Ok(ExitStatus::Success)
}

/// Checks that the robot would run the image.
fn check(path: &Path, program: &LoadedProgram, robot: &Robot) -> Result<(), Box<dyn Problem>> {
    if program.profile != robot.profile {
        let error = FlashError::RobotProfile {
            path: path.to_owned(),
            image: program.profile,
            robot: robot.title.clone(),
        };
        return Err(error.into());
    }
    match fit::verify(&program.image, program.profile, robot) {
        // Too many globals are reported below, together with the number that fits.
        Ok(()) | Err(ImageError::TooManyGlobals(_)) => {}
        Err(cause) => return Err(RefusedImage::new(path, cause).into()),
    }
    // An image that was compiled just now has no such error: the compiler has checked it.
    let Some(misfit) = fit::capacity_errors(&program.image, robot).into_iter().next() else {
        return Ok(());
    };
    let name = |number: u16| {
        let functions = program.symbols.as_ref().map(|symbols| &symbols.functions);
        let known = functions.and_then(|functions| functions.get(usize::from(number)));
        known.map_or(format!("function {number}"), |function| function.name.clone())
    };
    let message = misfit.message(robot, &name);
    Err(FlashError::Capacity { path: path.to_owned(), message, help: misfit.help() }.into())
}

/// Returns the call that writes the firmware. Its file contains a script too, so the selected
/// script is written afterwards.
fn firmware_call(chip: &str, path: &Path) -> ProbeRs {
    ProbeRs::new("download", chip).args(["--verify", "--binary-format", "elf"]).arg(path)
}

/// Returns the calls that write the script to each of its addresses in turn: while one sector is
/// erased, another sector of the log holds a whole script. The last call restarts the robot.
fn script_calls(chip: &str, layout: &Layout, script: &Path) -> Vec<ProbeRs> {
    let addresses = layout.script_addresses();
    let last = addresses.last().copied();
    let call = |address: u32| {
        let call = ProbeRs::new("download", chip).args(["--verify"]);
        let call = if Some(address) == last { call.args(["--reset"]) } else { call };
        let address = format!("{address:#010x}");
        call.args(["--binary-format", "bin", "--base-address", &address]).arg(script)
    };
    addresses.into_iter().map(call).collect()
}

/// Bytes for a region of the flash that keeps its content when scripts and firmware are flashed.
struct RegionContent {
    address: u32,
    section: Vec<u8>,
    file: ScratchFile,
}

/// Returns the bytes that give a robot its id; fails if its layout has no region for an id.
fn assign(
    id: u16,
    robot: &Robot,
    layout: &Layout,
    script: &Path,
) -> Result<RegionContent, Box<dyn Problem>> {
    let region = layout.id.ok_or_else(|| FlashError::NoIdRegion(robot.title.clone()))?;
    let section = Layout::id_section(id).to_vec();
    let file = ScratchFile::create(script, "id.bin")?;
    Ok(RegionContent { address: region.address, section, file })
}

impl RegionContent {
    fn call(&self, chip: &str) -> ProbeRs {
        let address = format!("{:#010x}", self.address);
        ProbeRs::new("download", chip)
            .args(["--verify", "--binary-format", "bin", "--base-address", &address])
            .arg(self.file.path())
    }
}
