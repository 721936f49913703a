//! `bbz build`: writes the image of a script, and its symbols, for a robot.

use std::path::{Path, PathBuf};

use bittybuzz_compiler::compile::Compiled;
use bittybuzz_compiler::fit;
use clap::Args;
use serde_json::json;

use crate::exit::ExitStatus;
use crate::hex;
use crate::json;
use crate::messages;
use crate::output;
use crate::problem::Problem;
use crate::program::RefusedImage;
use crate::program::{self, InputKind};
use crate::report;
use crate::selection::{ProfileName, RobotChoice};
use crate::whole_file::{self, Inputs, with_suffix};

/// `--firmware` for the robot with this title, whose script has a region of its own.
#[derive(Debug, thiserror::Error)]
#[error("on the {0} the script has a place of its own, next to the firmware")]
struct OwnRegion(String);

impl Problem for OwnRegion {
    fn help(&self) -> Option<String> {
        Some("`bbz flash --firmware` writes both".to_owned())
    }
}

const EXAMPLES: &str = "\
Examples:
  bbz build blink.bzz --robot kilobot                 writes blink.bbi and blink.sym beside the script
  bbz build blink.bzz --robot kilobot -o out/blink    writes out/blink.bbi and out/blink.sym
  bbz build swarm.bzz --robot crazyflie --profile tiny    for a swarm with smaller robots in it
  bbz build blink.bzz --robot kilobot --firmware kilobot.elf    also writes blink.hex, for KiloGUI

Exit status: 0, or 2 compile error, 3 wrong command line or file.";

/// Arguments of `bbz build`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct BuildArguments {
    /// Script (.bzz) or Buzz object file (.bo)
    file: PathBuf,
    /// Robot: its name (see `bbz robots`) or the path of a robot file (*.toml)
    #[arg(long, value_name = "NAME|PATH.toml")]
    robot: String,
    /// Number profile: 16-bit or 32-bit numbers [default: the robot's]
    #[arg(long)]
    profile: Option<ProfileName>,
    /// Write OUT.bbi and OUT.sym [default: next to the script]
    #[arg(short, long, value_name = "OUT")]
    output: Option<PathBuf>,
    /// Also put the script into this firmware (.elf or .hex), and write OUT.hex; for robots whose script has no region of its own
    #[arg(long, value_name = "FILE")]
    firmware: Option<PathBuf>,
    /// Folder to search for included files; may be given several times
    #[arg(short = 'I', value_name = "DIR")]
    include: Vec<PathBuf>,
    /// Write messages and sizes to standard output, as a JSON object
    #[arg(long)]
    json: bool,
}

/// Carries out the command.
pub fn execute(arguments: &BuildArguments) -> Result<ExitStatus, Box<dyn Problem>> {
    let kind = InputKind::of(&arguments.file)?;
    let selection = RobotChoice::new(Some(&arguments.robot), arguments.profile)?;
    let Compiled { image, symbols, messages: sent, diagnostics, sources } =
        program::compiled(&arguments.file, kind, &arguments.include, &selection)?;
    if !arguments.json {
        report::diagnostics(&sources, &diagnostics);
    }
    let (errors, warnings) = report::count(&diagnostics);
    let mut result = json::messages(&json::diagnostics(&sources, &diagnostics), errors, warnings);
    let robot =
        selection.robot.as_ref().expect("`--robot` is required, and an unknown one is an error");
    // After an error of the script there is neither of them.
    let (Some(image), Some(symbols)) = (image, symbols) else {
        if arguments.json {
            output::write(&format!("{result}\n"))?;
        }
        return Ok(ExitStatus::CompileError);
    };
    fit::verify(&image, selection.effective_profile(), robot)
        .map_err(|cause| RefusedImage::new(&arguments.file, cause))?;

    let hex = match &arguments.firmware {
        Some(_) if robot.layout.is_some() => return Err(OwnRegion(robot.title.clone()).into()),
        Some(firmware) => {
            Some(hex::with_script(firmware, &arguments.file, &image, Some(&symbols), robot)?)
        }
        None => None,
    };
    let base = base(&arguments.file, arguments.output.as_deref());
    let (image_path, symbols_path) = (with_suffix(&base, ".bbi"), with_suffix(&base, ".sym"));
    let hex_path = hex.as_ref().map(|_| with_suffix(&base, ".hex"));
    let mut inputs = Inputs::default();
    program::add_inputs(&arguments.file, Some(&sources), &mut inputs);
    inputs.add(Path::new(&arguments.robot));
    arguments.firmware.iter().for_each(|firmware| inputs.add(firmware));
    for output in [&image_path, &symbols_path].into_iter().chain(&hex_path) {
        inputs.refuse(output)?;
    }
    // The image is written last, so that a new image never lies next to older symbols.
    whole_file::write(&symbols_path, symbols.to_json().as_bytes())?;
    whole_file::write(&image_path, &image)?;
    if let (Some(path), Some(hex)) = (&hex_path, &hex) {
        whole_file::write(path, hex.as_bytes())?;
    }

    let budget = robot.budget.map(|budget| budget.flash_bytes);
    if arguments.json {
        result["messages"] = messages::json(&sent, &sources, robot);
        result["image"] = json!({
            "path": image_path.display().to_string(),
            "symbols": symbols_path.display().to_string(),
            "bytes": image.len(),
            "script_hash": format!("{:08x}", symbols.script_hash),
            "robot": robot.name,
            "profile": selection.effective_profile().name(),
            "flash_budget": budget,
            "hex": hex_path.map(|path| path.display().to_string()),
        });
        output::write(&format!("{result}\n"))?;
        return Ok(ExitStatus::Success);
    }
    let mut line = format!("{}: {} bytes for {}", image_path.display(), image.len(), robot.title);
    if let Some(budget) = budget {
        line.push_str(&format!(", whose flash holds {budget} bytes of firmware and script"));
    }
    output::write(&format!("{line}\n"))?;
    if !sent.is_empty() {
        output::write("messages:\n")?;
    }
    for line in messages::lines(&sent, &sources, robot) {
        output::write(&format!("{line}\n"))?;
    }
    if let Some(path) = hex_path {
        output::write(&format!(
            "{}: firmware and script, to be sent by KiloGUI\n",
            path.display()
        ))?;
    }
    Ok(ExitStatus::Success)
}

/// Returns the path of the written files without extension. Files in a folder are named after the
/// script.
fn base(script: &Path, output: Option<&Path>) -> PathBuf {
    let Some(output) = output else { return script.with_extension("") };
    let ends_in_separator = output.to_string_lossy().ends_with(std::path::is_separator);
    match (ends_in_separator || output.is_dir(), script.file_stem()) {
        (true, Some(stem)) => output.join(stem),
        _ if output.extension().is_some_and(|extension| extension == "bbi") => {
            output.with_extension("")
        }
        _ => output.to_owned(),
    }
}
