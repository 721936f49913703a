//! Firmware images: the workspace of each board, and how it is built.

use crate::elf;
use crate::failure::Failure;
use crate::shell::{Line, root};
use bittybuzz_compiler::compile::{Options, compile};
use bittybuzz_compiler::fit;
use bittybuzz_compiler::include::{DiskFiles, Loader};
use bittybuzz_robots::Robot;
use bittybuzz_vm_core::Parts;
use std::ffi::OsStr;
use std::fs;
use std::path::{Path, PathBuf};

/// A robot's firmware.
pub struct Board {
    /// Its robot's name.
    pub robot: &'static str,
    /// Its workspace, from the root.
    pub folder: &'static str,
    target: &'static str,
    program: &'static str,
    /// Leaves out what only a debug probe reads.
    untold: &'static [&'static str],
    /// The script with which it is measured, from the root; its own if there is none.
    measured: Option<&'static str>,
    /// Its flash holds not much more of the machine than those parts that the script uses: `BBZ_PARTS` of its build script.
    is_tight: bool,
}

/// The Crazyflie's.
pub const CRAZYFLIE: Board = Board {
    robot: "crazyflie",
    folder: "firmware/crazyflie",
    target: "thumbv7em-none-eabihf",
    program: "bittybuzz-crazyflie",
    untold: &[],
    measured: None,
    is_tight: false,
};

/// The Zooid's.
pub const ZOOIDS: Board = Board {
    robot: "zooids",
    folder: "firmware/zooids",
    target: "thumbv6m-none-eabi",
    program: "bittybuzz-zooids",
    // It would take a sixth of the RAM.
    untold: &["--no-default-features"],
    // The longest of all examples.
    measured: Some("examples/swarm/herding.bzz"),
    is_tight: false,
};

/// The Kilobot's.
pub const KILOBOT: Board = Board {
    robot: "kilobot",
    folder: "firmware/kilobot-avr",
    target: "avr-none",
    program: "bittybuzz-kilobot-avr.elf",
    untold: &[],
    measured: None,
    is_tight: true,
};

/// All of them.
pub const BOARDS: [&Board; 3] = [&CRAZYFLIE, &ZOOIDS, &KILOBOT];

/// For people.
const NAMES: &str = "`crazyflie`, `zooids` or `kilobot`";

/// Behaviours of which each has an image of its own, from the root.
pub const BEHAVIOURS: &str = "examples/kilobot";

/// The script of a board if none is named, in its folder.
const OWN_SCRIPT: &str = "hello.bzz";

/// `build BOARD [--script FILE] [--profile tiny]`, or `build behaviours`
pub fn run(arguments: &[String]) -> Result<(), Failure> {
    if let [what] = arguments
        && what == "behaviours"
    {
        let folder = KILOBOT.build_behaviours(false)?;
        println!("{}", folder.display());
        return Ok(());
    }
    let Build { robot, script, tiny } = read(arguments)?;
    let board = find(robot)?;
    // Relative to where the user is; the build runs elsewhere.
    let script = script.map(std::path::absolute).transpose();
    let script = script.map_err(|reason| Failure::Read { path: PathBuf::from("."), reason })?;
    let image = match tiny {
        true => board.build_tiny(script.as_deref())?,
        false => board.build(script.as_deref(), false)?,
    };
    let footprint = elf::footprint(&image)?;
    println!("{}", image.display());
    println!("{} bytes of flash, {} bytes of static RAM", footprint.flash, footprint.ram);
    if board.is_tight { board.write_hex(script.as_deref(), &image) } else { Ok(()) }
}

/// What is to be built.
#[derive(Debug, PartialEq, Eq)]
struct Build<'a> {
    robot: &'a str,
    script: Option<&'a str>,
    /// For a swarm with smaller robots in it.
    tiny: bool,
}

fn read(arguments: &[String]) -> Result<Build<'_>, Failure> {
    let usage = |message: String| Err(Failure::Usage(message));
    let (mut board, mut script, mut tiny) = (None, None, false);
    let mut rest = arguments.iter().map(String::as_str);
    while let Some(argument) = rest.next() {
        match argument {
            "--script" => match rest.next() {
                Some(file) => script = Some(file),
                None => return usage("`--script` needs a file".to_owned()),
            },
            "--profile" => match rest.next() {
                Some("tiny") => tiny = true,
                _ => {
                    return usage(
                        "`--profile` needs `tiny`; else it is the robot's own".to_owned(),
                    );
                }
            },
            _ if !argument.starts_with('-') && board.is_none() => board = Some(argument),
            _ => return usage(format!("`build` cannot use `{argument}`")),
        }
    }
    match board {
        Some(robot) => Ok(Build { robot, script, tiny }),
        None => usage(format!("which board? {NAMES}")),
    }
}

fn find(robot: &str) -> Result<&'static Board, Failure> {
    let board = BOARDS.into_iter().find(|board| board.robot == robot);
    board.ok_or_else(|| Failure::Usage(format!("there is no board `{robot}`; try {NAMES}")))
}

impl Board {
    /// Builds the image with this script, or the board's own; returns where it is.
    pub fn build(&self, script: Option<&Path>, quiet: bool) -> Result<PathBuf, Failure> {
        self.build_with(&[], script, quiet)
    }

    /// Builds the image with numbers as small as those of the smallest robots, beside the other one.
    pub fn build_tiny(&self, script: Option<&Path>) -> Result<PathBuf, Failure> {
        let target = target_of(self.folder).join("tiny");
        let folder = target.display().to_string();
        let mut line = Line::new("cargo", &["build", "--release", "--target-dir", &folder]);
        if let Some(script) = script {
            line = line.env("BBZ_SCRIPT", &script.display().to_string());
        }
        line.env("BBZ_PROFILE", "tiny").in_workspace(self.folder).run()?;
        Ok(self.image_in(&target))
    }

    /// Builds an image for each of the behaviours that are tested on images of their own, with what it uses; returns the folder
    /// where they are, named as their scripts.
    pub fn build_behaviours(&self, quiet: bool) -> Result<PathBuf, Failure> {
        let folder = target_of(self.folder).join("behaviours");
        let unwritable = |reason| Failure::Write { path: folder.clone(), reason };
        fs::create_dir_all(&folder).map_err(unwritable)?;
        let scripts = root().join(BEHAVIOURS);
        let unreadable = |reason| Failure::Read { path: scripts.clone(), reason };
        for entry in fs::read_dir(&scripts).map_err(unreadable)? {
            let script = entry.map_err(unreadable)?.path();
            let (Some(name), true) =
                (script.file_stem(), script.extension() == Some("bzz".as_ref()))
            else {
                continue;
            };
            let image = self.build_parts(Some("used"), &[], Some(&script), quiet)?;
            let excess = self.excess(&image)?;
            if excess != 0 {
                return Err(Failure::TooLarge { script, excess, costs: Vec::new() });
            }
            let copy = folder.join(name).with_extension("elf");
            fs::copy(&image, &copy).map_err(unwritable)?;
        }
        Ok(folder)
    }

    /// The image that is measured: without what only a debug probe reads.
    pub fn build_measured(&self, quiet: bool) -> Result<PathBuf, Failure> {
        let script = self.measured.map(|script| root().join(script));
        self.build_with(self.untold, script.as_deref(), quiet)
    }

    fn build_with(
        &self,
        arguments: &[&str],
        script: Option<&Path>,
        quiet: bool,
    ) -> Result<PathBuf, Failure> {
        let image = self.build_parts(None, arguments, script, quiet)?;
        if !self.is_tight || self.excess(&image)? == 0 {
            return Ok(image);
        }
        // The whole language is for scripts that leave room for it.
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
        Err(Failure::TooLarge { script: self.script(script), excess, costs })
    }

    /// Builds with these parts of the machine, as `BBZ_PARTS` says.
    fn build_parts(
        &self,
        parts: Option<&str>,
        arguments: &[&str],
        script: Option<&Path>,
        quiet: bool,
    ) -> Result<PathBuf, Failure> {
        let mut line = Line::new("cargo", &[&["build", "--release"], arguments].concat());
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

    /// How many bytes of flash an image needs that the robot does not have.
    fn excess(&self, image: &Path) -> Result<u64, Failure> {
        let most = self.shipped()?.budget.map_or(u64::MAX, |budget| budget.flash_bytes.into());
        Ok(elf::footprint(image)?.flash.saturating_sub(most))
    }

    fn shipped(&self) -> Result<Robot, Failure> {
        bittybuzz_robots::find(self.robot).map_err(|error| Failure::Robot(error.to_string()))
    }

    /// The script, or the board's own.
    fn script(&self, script: Option<&Path>) -> PathBuf {
        script.map_or_else(|| root().join(self.folder).join(OWN_SCRIPT), Path::to_owned)
    }

    /// The parts of the machine that a script uses. Of a script with errors none: the build tells them.
    pub fn parts(&self, script: Option<&Path>) -> Result<Parts, Failure> {
        let path = self.script(script);
        let text = fs::read_to_string(&path)
            .map_err(|reason| Failure::Read { path: path.clone(), reason })?;
        let loader = Loader { folders: vec![root().join("lib")], ..Loader::new(&DiskFiles) };
        let options = Options {
            profile: None,
            robot: Some(self.shipped()?),
            robots: bittybuzz_robots::all_shipped(),
        };
        let image = compile(&path, text, &loader, &options).image.unwrap_or_default();
        Ok(fit::parts(&image))
    }

    /// Writes the file that is sent to robots beside the image.
    fn write_hex(&self, script: Option<&Path>, image: &Path) -> Result<(), Failure> {
        let (script, output) = (self.script(script), image.with_extension(""));
        let [script, image, output] =
            [&script, image, &output].map(|path| path.display().to_string());
        let run = ["run", "--quiet", "--package", "bbz", "--", "build", &script];
        let build = ["--robot", self.robot, "--firmware", &image, "-o", &output];
        Line::new("cargo", &[&run[..], &build].concat()).run()
    }

    /// The image of a build with this target folder.
    pub fn image_in(&self, target: &Path) -> PathBuf {
        target.join(self.target).join("release").join(self.program)
    }
}

/// Where cargo puts what it builds for a workspace of its own.
pub fn target_of(folder: &str) -> PathBuf {
    let chosen = std::env::var_os("CARGO_TARGET_DIR");
    root().join(folder).join(chosen.as_deref().unwrap_or(OsStr::new("target")))
}

#[cfg(test)]
mod tests {
    use super::*;
    use bittybuzz_vm_core::Part;

    fn arguments(line: &str) -> Vec<String> {
        line.split_whitespace().map(str::to_owned).collect()
    }

    #[test]
    fn board_and_script_in_any_order() {
        for line in ["crazyflie --script a.bzz", "--script a.bzz crazyflie"] {
            let build = Build { robot: "crazyflie", script: Some("a.bzz"), tiny: false };
            assert_eq!(read(&arguments(line)).unwrap(), build);
        }
        let build = Build { robot: "kilobot", script: None, tiny: false };
        assert_eq!(read(&arguments("kilobot")).unwrap(), build);
        let build = Build { robot: "crazyflie", script: None, tiny: true };
        assert_eq!(read(&arguments("crazyflie --profile tiny")).unwrap(), build);
        for line in [
            "",
            "--script a.bzz",
            "crazyflie --script",
            "crazyflie zooids",
            "-v crazyflie",
            "crazyflie --profile full",
        ] {
            assert!(matches!(read(&arguments(line)), Err(Failure::Usage(_))), "{line}");
        }
    }

    #[test]
    fn parts_are_those_that_a_script_uses() {
        let parts = |script: &str| KILOBOT.parts(Some(&root().join(script))).unwrap();
        assert_eq!(parts("examples/blink.bzz"), Parts::NONE);
        assert_eq!(parts("examples/swarm/gradient.bzz"), Parts::of(&[Part::Messages]));
        assert!(KILOBOT.parts(Some(Path::new("nowhere.bzz"))).is_err());
    }

    #[test]
    fn boards_are_found_by_their_robots() {
        for robot in ["crazyflie", "zooids", "kilobot"] {
            assert_eq!(find(robot).ok().map(|board| board.robot), Some(robot));
        }
        assert!(matches!(find("crazyfly"), Err(Failure::Usage(_))));
    }
}
