//! Builds firmware images, each in the workspace of its board.

use crate::elf;
use crate::raw_binary::{self, Individual, PAGE_BYTES, PROGRAM, RawBinaryError};
use crate::release_zip;
use crate::shell::{Invocation, root};
use anyhow::{Context, Error, Result, anyhow};
use bittybuzz_compiler::compile::{Compiled, Options, compile};
use bittybuzz_compiler::fit;
use bittybuzz_compiler::include::{DiskFiles, IncludeLoader};
use bittybuzz_compiler::render::{ColorChoice, Renderer};
use bittybuzz_robot_spec::{NumberProfile, Robot};
use bittybuzz_vm_core::{Part, Parts};
use fs_err as fs;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};

/// A robot's firmware.
pub struct FirmwareBuild {
    /// The robot's name.
    pub robot: &'static str,
    /// The folder of the workspace, from the root.
    pub folder: &'static str,
    pub target: &'static str,
    program: &'static str,
    /// Arguments of cargo that leave out data that only a debug probe reads.
    no_trace_features: &'static [&'static str],
    /// The script with which the firmware is measured, from the root; `None` for the board's own.
    measured: Option<&'static str>,
    /// True if the flash has little room beyond the parts of the machine that the script uses.
    /// `BBZ_PARTS` of the board's build script selects the parts.
    is_built_by_parts: bool,
    /// True if Bitcraze's bootloader takes the firmware by radio.
    is_sent_by_radio: bool,
}

/// The Crazyflie's firmware.
pub const CRAZYFLIE: FirmwareBuild = FirmwareBuild {
    robot: "crazyflie",
    folder: "firmware/crazyflie",
    target: "thumbv7em-none-eabihf",
    program: "bittybuzz-crazyflie",
    no_trace_features: &[],
    measured: None,
    is_built_by_parts: false,
    is_sent_by_radio: true,
};

/// The Zooid's firmware.
pub const ZOOIDS: FirmwareBuild = FirmwareBuild {
    robot: "zooids",
    folder: "firmware/zooids",
    target: "thumbv6m-none-eabi",
    program: "bittybuzz-zooids",
    // The trace would take a sixth of the RAM.
    no_trace_features: &["--no-default-features"],
    // The longest script of all examples.
    measured: Some("examples/swarm/herding.bzz"),
    is_built_by_parts: false,
    is_sent_by_radio: false,
};

/// The Kilobot's firmware.
pub const KILOBOT: FirmwareBuild = FirmwareBuild {
    robot: "kilobot",
    folder: "firmware/kilobot-avr",
    target: "avr-none",
    program: "bittybuzz-kilobot-avr.elf",
    no_trace_features: &[],
    measured: None,
    is_built_by_parts: true,
    is_sent_by_radio: false,
};

/// All boards.
pub const BOARDS: [&FirmwareBuild; 3] = [&CRAZYFLIE, &ZOOIDS, &KILOBOT];

/// The name of [`BEHAVIORS`] as an argument of `build`.
const BEHAVIORS_BOARD: &str = "behaviors";

/// The folder of the behaviors, each of which has an image of its own, from the root.
pub const BEHAVIORS: &str = "examples/kilobot";
/// The folder of scripts for Kilobots that only tests use.
const TESTED: &str = "tests/hil/scripts";

/// The script of a board if no other is named, in the board's folder.
const OWN_SCRIPT: &str = "hello.bzz";

/// Options of `build`.
#[derive(Debug, clap::Args)]
pub struct BoardArguments {
    /// Which firmware; `behaviors` is an image for each of examples/kilobot
    #[arg(value_parser = ["crazyflie", "zooids", "kilobot", BEHAVIORS_BOARD])]
    board: String,
    /// The script in it; its own `hello.bzz` if none is given
    #[arg(long, value_name = "FILE")]
    script: Option<PathBuf>,
    /// Numbers as small as those of the smallest robots, for a swarm that has some; else the robot's own
    #[arg(long, value_parser = ["tiny"])]
    profile: Option<String>,
    /// Also write the raw binary that cfloader sends to a Crazyflie by radio
    #[arg(long)]
    bin: bool,
    /// The robot's id in the raw binary; without it the robot keeps its own
    #[arg(long, value_name = "N", requires = "bin")]
    id: Option<u16>,
    /// Also set what the robot file calls a setting in the raw binary; all that are not given are as if never set. May be
    /// given several times; without it the robot keeps its own, unless it gets an id
    #[arg(long, value_name = "NAME=VALUE", requires = "bin")]
    set: Vec<String>,
    /// The raw binary, or with the extension .zip the release that cfclient sends; next to the image if none is given
    #[arg(long, value_name = "FILE", requires = "bin")]
    output: Option<PathBuf>,
}

/// Builds an image, or the images of the behaviors, and prints the paths and sizes.
pub fn run(arguments: &BoardArguments) -> Result<()> {
    if arguments.board == BEHAVIORS_BOARD {
        println!("{}", KILOBOT.build_behaviors(false)?.display());
        return Ok(());
    }
    let board = BOARDS.into_iter().find(|board| board.robot == arguments.board);
    let board = board.with_context(|| format!("there is no board `{}`", arguments.board))?;
    // The path is relative to the user's folder, but the build runs in another one.
    let script = arguments.script.as_ref().map(std::path::absolute).transpose()?;
    if arguments.bin {
        board.check_for_radio(script.as_deref(), arguments)?;
    }
    let image = match arguments.profile {
        Some(_) => board.build_tiny(script.as_deref())?,
        None => board.build(script.as_deref(), false)?,
    };
    let footprint = elf::footprint(&image)?;
    println!("{}", image.display());
    println!("{} bytes of flash, {} bytes of static RAM", footprint.flash, footprint.ram);
    if arguments.bin {
        return board.write_raw_binary(&image, arguments);
    }
    if board.is_built_by_parts { board.write_hex(script.as_deref(), &image) } else { Ok(()) }
}

impl FirmwareBuild {
    /// Builds the image with this script, or with the board's own. Returns the path of the image.
    pub fn build(&self, script: Option<&Path>, quiet: bool) -> Result<PathBuf> {
        self.build_with(&[], script, quiet)
    }

    /// Builds the image with the number profile of the smallest robots, in a folder next to that of
    /// the ordinary image.
    pub fn build_tiny(&self, script: Option<&Path>) -> Result<PathBuf> {
        let target = target_of(self.folder).join("tiny");
        let folder = target.display().to_string();
        let mut line = Invocation::cargo(&["build", "--release", "--target-dir", &folder]);
        if let Some(script) = script {
            line = line.env("BBZ_SCRIPT", &script.display().to_string());
        }
        line.env("BBZ_PROFILE", "tiny").in_workspace(self.folder).run()?;
        Ok(self.image_in(&target))
    }

    /// Builds an image for each of the behaviors and of the tests' scripts, with the parts of the machine that the behavior
    /// uses. Tests run each behavior on its own image. Returns the folder of the images, which are
    /// named after their scripts.
    pub fn build_behaviors(&self, quiet: bool) -> Result<PathBuf> {
        let folder = target_of(self.folder).join("behaviors");
        fs::create_dir_all(&folder)?;
        let folders = [BEHAVIORS, TESTED].map(|folder| fs::read_dir(root().join(folder)));
        let [examples, tested] = folders;
        for entry in examples?.chain(tested?) {
            let script = entry?.path();
            let (Some(name), true) =
                (script.file_stem(), script.extension() == Some("bzz".as_ref()))
            else {
                continue;
            };
            let image = self.build_parts(Some("used"), &[], Some(&script), quiet)?;
            let excess = self.excess(&image)?;
            if excess != 0 {
                return Err(too_large(&script, excess, &[]));
            }
            let copy = folder.join(name).with_extension("elf");
            fs::copy(&image, &copy)?;
        }
        Ok(folder)
    }

    /// Builds the image that is measured, without data that only a debug probe reads.
    pub fn build_measured(&self, quiet: bool) -> Result<PathBuf> {
        let script = self.measured.map(|script| root().join(script));
        self.build_with(self.no_trace_features, script.as_deref(), quiet)
    }

    fn build_with(
        &self,
        arguments: &[&str],
        script: Option<&Path>,
        quiet: bool,
    ) -> Result<PathBuf> {
        let image = self.build_parts(None, arguments, script, quiet)?;
        if !self.is_built_by_parts || self.excess(&image)? == 0 {
            return Ok(image);
        }
        // The image contains the whole language only if the script leaves room for it.
        let image = self.build_parts(Some("used"), arguments, script, quiet)?;
        let excess = self.excess(&image)?;
        if excess == 0 {
            return Ok(image);
        }
        let whole = elf::footprint(&image)?.flash;
        let mut costs = Vec::new();
        for part in self.parts(script)?.iter() {
            let image = self.build_parts(Some(part.name()), arguments, script, true)?;
            let bytes = whole.saturating_sub(elf::footprint(&image)?.flash);
            costs.push((bytes, part));
        }
        costs.sort_by_key(|(bytes, _)| std::cmp::Reverse(*bytes));
        Err(too_large(&self.script(script), excess, &costs))
    }

    /// Builds the image with these parts of the machine, the value of `BBZ_PARTS`.
    fn build_parts(
        &self,
        parts: Option<&str>,
        arguments: &[&str],
        script: Option<&Path>,
        quiet: bool,
    ) -> Result<PathBuf> {
        let alone = self.alone();
        let is_own = script.is_none() && parts.is_none();
        let selection = if is_own { &[] } else { &alone[..] };
        let mut line = Invocation::cargo(&[&["build", "--release"], selection, arguments].concat());
        if let Some(script) = script {
            line = line.env("BBZ_SCRIPT", &script.display().to_string());
        }
        if let Some(parts) = parts {
            line = line.env("BBZ_PARTS", parts);
        }
        let line = line.in_workspace(self.folder);
        if quiet { line.unannounced() } else { line }.run()?;
        Ok(self.image_in(&target_of(self.folder)))
    }

    /// Returns cargo's arguments that build the robot's program alone. The program of a Kilobot that
    /// reports what it hears has no script, and is built with the board's own image.
    pub fn alone(&self) -> [&'static str; 2] {
        ["--bin", self.program.trim_end_matches(".elf")]
    }

    /// Returns the number of bytes by which an image exceeds the robot's flash.
    fn excess(&self, image: &Path) -> Result<u64> {
        let most = self.shipped()?.budget.map_or(u64::MAX, |budget| budget.flash_bytes.into());
        Ok(elf::footprint(image)?.flash.saturating_sub(most))
    }

    fn shipped(&self) -> Result<Robot> {
        Ok(bittybuzz_robot_files::find(self.robot)?)
    }

    /// Returns the path of the script, or that of the board's own.
    fn script(&self, script: Option<&Path>) -> PathBuf {
        script.map_or_else(|| root().join(self.folder).join(OWN_SCRIPT), Path::to_owned)
    }

    /// Returns the parts of the machine that a script uses. For a script with errors there are
    /// none, because the build reports the errors.
    pub fn parts(&self, script: Option<&Path>) -> Result<Parts> {
        let image = compiled(&self.script(script), self.shipped()?)?.image.unwrap_or_default();
        Ok(fit::parts(&image))
    }

    /// Checks, before the firmware is built, that the bootloader takes it and that the script has no errors. Prints the errors of
    /// the script.
    fn check_for_radio(&self, script: Option<&Path>, arguments: &BoardArguments) -> Result<()> {
        let mut robot = self.shipped()?;
        if !self.is_sent_by_radio {
            return Err(RawBinaryError::NoBootloader(robot.title).into());
        }
        if arguments.profile.is_some() {
            robot.profile = NumberProfile::Tiny;
        }
        settings(&robot, &arguments.set)?;
        let path = self.script(script);
        let compiled = compiled(&path, robot)?;
        if compiled.image.is_some() {
            return Ok(());
        }
        let renderer = Renderer::new(&compiled.sources);
        for diagnostic in &compiled.diagnostics {
            eprintln!("{}", renderer.text(diagnostic, ColorChoice::Never));
        }
        Err(RawBinaryError::Script(path).into())
    }

    /// Writes the raw binary of an image, and prints its path, its size and the command that sends it.
    fn write_raw_binary(&self, image: &Path, arguments: &BoardArguments) -> Result<()> {
        let robot = self.shipped()?;
        let settings = settings(&robot, &arguments.set)?;
        let is_reset = arguments.id.is_some() && settings.is_none() && !robot.settings.is_empty();
        let individual = Individual { settings, id: arguments.id };
        let layout = robot.layout.context("the robot file has no [layout]")?;
        let content = raw_binary::content(&fs::read(image)?, &layout, &individual)?;
        let path = arguments.output.clone().unwrap_or_else(|| image.with_extension("bin"));
        let is_release = path.extension() == Some("zip".as_ref());
        fs::write(
            &path,
            if is_release { release_zip::release(&content) } else { content.clone() },
        )?;
        let (path, bytes) = (path.display(), content.len());
        let pages = bytes.div_ceil(PAGE_BYTES);
        let id = arguments.id.map_or(String::new(), |id| format!(", robot id {id}"));
        println!("{path}");
        let set = if arguments.set.is_empty() { "" } else { ", settings" };
        println!("{bytes} bytes from {PROGRAM:#010x} on, {pages} pages: firmware, script{set}{id}");
        if is_reset {
            println!("with its id the robot loses all of its settings: --set writes them");
        }
        match is_release {
            true => println!("cfclient: Connect, Bootloader, Cold boot, From file"),
            false => println!("cfloader flash {path} stm32-fw -w radio://0/80/2M/E7E7E7E7E7"),
        }
        Ok(())
    }

    /// Writes the file that is sent to robots, next to the image.
    fn write_hex(&self, script: Option<&Path>, image: &Path) -> Result<()> {
        let (script, output) = (self.script(script), image.with_extension(""));
        let [script, image, output] =
            [&script, image, &output].map(|path| path.display().to_string());
        let run = ["run", "--quiet", "--package", "bbz", "--", "build", &script];
        let build = ["--robot", self.robot, "--firmware", &image, "-o", &output];
        Invocation::cargo(&[&run[..], &build].concat()).run()
    }

    /// Returns the path of the image in this target folder.
    pub fn image_in(&self, target: &Path) -> PathBuf {
        target.join(self.target).join("release").join(self.program)
    }
}

/// Returns the address and the bytes of a robot's settings, if there are any.
fn settings(robot: &Robot, assignments: &[String]) -> Result<Option<(u32, Vec<u8>)>> {
    robot.settings_content(assignments).map_err(|error| anyhow!("{error}\n      {}", error.help()))
}

/// Compiles a script for a robot, with the libraries of `lib`.
fn compiled(script: &Path, robot: Robot) -> Result<Compiled> {
    let text = fs::read_to_string(script)?;
    let loader =
        IncludeLoader { folders: vec![root().join("lib")], ..IncludeLoader::new(&DiskFiles) };
    let options = Options {
        robot: Some(robot),
        robots: bittybuzz_robot_files::all_shipped(),
        ..Options::default()
    };
    Ok(compile(script, text, &loader, &options))
}

/// Returns cargo's target folder for a workspace of its own.
pub fn target_of(folder: &str) -> PathBuf {
    let chosen = std::env::var_os("CARGO_TARGET_DIR");
    root().join(folder).join(chosen.as_deref().unwrap_or(OsStr::new("target")))
}

/// Returns the error for a script that needs more flash than its robot has. `costs` are the bytes
/// of each part that the script could do without.
fn too_large(script: &Path, excess: u64, costs: &[(u64, Part)]) -> Error {
    let mut text = format!(
        "{} needs {excess} bytes of flash more than there are; a script saves these bytes if it does without",
        script.display()
    );
    for (bytes, part) in costs {
        text += &format!("\n{bytes:7} bytes: {}", part.what());
    }
    anyhow!(text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_are_those_that_a_script_uses() {
        let parts = |script: &str| KILOBOT.parts(Some(&root().join(script))).unwrap();
        assert_eq!(parts("examples/blink.bzz"), Parts::NONE);
        assert_eq!(parts("examples/swarm/gradient.bzz"), Parts::of(&[Part::Messages]));
        assert!(KILOBOT.parts(Some(Path::new("nowhere.bzz"))).is_err());
    }
}
