//! Firmware images: the workspace of each board, and how it is built.

use crate::elf;
use crate::failure::Failure;
use crate::shell::{Line, root};
use std::ffi::OsStr;
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
}

/// The Crazyflie's.
pub const CRAZYFLIE: Board = Board {
    robot: "crazyflie",
    folder: "firmware/crazyflie",
    target: "thumbv7em-none-eabihf",
    program: "bittybuzz-crazyflie",
    untold: &[],
    measured: None,
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
};

/// All of them.
pub const BOARDS: [&Board; 2] = [&CRAZYFLIE, &ZOOIDS];

/// For people.
const NAMES: &str = "`crazyflie` or `zooids`";

/// `build BOARD [--script FILE]`
pub fn run(arguments: &[String]) -> Result<(), Failure> {
    let (robot, script) = read(arguments)?;
    let board = find(robot)?;
    // Relative to where the user is; the build runs elsewhere.
    let script = script.map(std::path::absolute).transpose();
    let script = script.map_err(|reason| Failure::Read { path: PathBuf::from("."), reason })?;
    let image = board.build(script.as_deref(), false)?;
    let footprint = elf::footprint(&image)?;
    println!("{}", image.display());
    println!("{} bytes of flash, {} bytes of static RAM", footprint.flash, footprint.ram);
    Ok(())
}

/// Board and script.
fn read(arguments: &[String]) -> Result<(&str, Option<&str>), Failure> {
    let usage = |message: String| Err(Failure::Usage(message));
    let (mut board, mut script) = (None, None);
    let mut rest = arguments.iter().map(String::as_str);
    while let Some(argument) = rest.next() {
        match argument {
            "--script" => match rest.next() {
                Some(file) => script = Some(file),
                None => return usage("`--script` needs a file".to_owned()),
            },
            _ if !argument.starts_with('-') && board.is_none() => board = Some(argument),
            _ => return usage(format!("`build` cannot use `{argument}`")),
        }
    }
    match board {
        Some(board) => Ok((board, script)),
        None => usage(format!("which board? {NAMES}")),
    }
}

fn find(robot: &str) -> Result<&'static Board, Failure> {
    if let Some(board) = BOARDS.into_iter().find(|board| board.robot == robot) {
        return Ok(board);
    }
    match bittybuzz_robots::all_shipped().iter().any(|known| known.name == robot) {
        true => Err(Failure::NoFirmware { robot: robot.to_owned() }),
        false => Err(Failure::Usage(format!("there is no board `{robot}`; try {NAMES}"))),
    }
}

impl Board {
    /// Builds the image with this script, or the board's own; returns where it is.
    pub fn build(&self, script: Option<&Path>, quiet: bool) -> Result<PathBuf, Failure> {
        self.build_with(&[], script, quiet)
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
        let mut line = Line::new("cargo", &[&["build", "--release"], arguments].concat());
        if let Some(script) = script {
            line = line.env("BBZ_SCRIPT", &script.display().to_string());
        }
        let line = line.in_workspace(self.folder);
        if quiet { line.unannounced() } else { line }.run()?;
        Ok(self.image_in(&target_of(self.folder)))
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

    fn arguments(line: &str) -> Vec<String> {
        line.split_whitespace().map(str::to_owned).collect()
    }

    #[test]
    fn board_and_script_in_any_order() {
        for line in ["crazyflie --script a.bzz", "--script a.bzz crazyflie"] {
            assert_eq!(read(&arguments(line)).unwrap(), ("crazyflie", Some("a.bzz")));
        }
        assert_eq!(read(&arguments("kilobot")).unwrap(), ("kilobot", None));
        for line in ["", "--script a.bzz", "crazyflie --script", "crazyflie zooids", "-v crazyflie"]
        {
            assert!(matches!(read(&arguments(line)), Err(Failure::Usage(_))), "{line}");
        }
    }

    #[test]
    fn robots_without_firmware_are_told_from_unknown_ones() {
        for robot in ["crazyflie", "zooids"] {
            assert_eq!(find(robot).ok().map(|board| board.robot), Some(robot));
        }
        assert!(matches!(find("kilobot"), Err(Failure::NoFirmware { .. })));
        assert!(matches!(find("crazyfly"), Err(Failure::Usage(_))));
    }
}
