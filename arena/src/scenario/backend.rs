//! `backend`: the program that runs the scripts of a group, and the keys that robots with firmware
//! cannot have.

use std::path::{Path, PathBuf};

use bittybuzz_compiler::include::FileKind;
use bittybuzz_robot_spec::Robot;
use bittybuzz_toml_reader::{Place, file};

use crate::robot::RobotModel;

use super::error::ScenarioCause;
use super::folder::Folder;
use super::read::Section;

/// The program that runs the script of a group.
#[derive(Debug, Clone, PartialEq)]
pub enum Backend {
    /// A virtual machine in this process.
    Vm,
    /// The robot's firmware in an emulator.
    Firmware {
        /// The file that would be flashed (ELF).
        image: PathBuf,
        /// The place of the key `backend` in the scenario.
        place: Place,
    },
}

impl Backend {
    /// Returns the path of the firmware; `None` for a virtual machine.
    pub fn firmware(&self) -> Option<&Path> {
        match self {
            Backend::Vm => None,
            Backend::Firmware { image, .. } => Some(image),
        }
    }
}

/// Returns the backend of a group; `None` after an error.
pub fn of_group(
    section: &Section<'_>,
    model: Option<&dyn RobotModel>,
    robot: Option<&Robot>,
    folder: Folder<'_>,
) -> Option<Backend> {
    let Some(entry) = section.get("backend") else { return Some(Backend::Vm) };
    if !section.word("backend", &[("vm", false), ("firmware", true)])? {
        return Some(Backend::Vm);
    }
    if !cfg!(feature = "emulators") {
        entry.fail(ScenarioCause::NoEmulators);
        return None;
    }
    let (model, robot) = (model?, robot?);
    let usual = model.emulation().and_then(|emulation| emulation.image(robot));
    let Some(usual) = usual else {
        entry.fail(ScenarioCause::NoEmulator { robot: robot.name.clone() });
        return None;
    };
    if section.boolean("present") == Some(false)
        && let Some(present) = section.get("present")
    {
        present.fail(ScenarioCause::NotEmulated { key: "present = false" });
    }
    for key in ["link", "on_fault", "clock_skew", "brown_out_every"] {
        if let Some(entry) = section.get(key) {
            entry.fail(ScenarioCause::NotEmulated { key });
        }
    }
    Some(Backend::Firmware { image: image(section, model, folder, usual)?, place: entry.place() })
}

/// Returns the firmware of robots with that model: the file that the section names, or the usual
/// one in a folder above the scenario.
pub fn image(
    section: &Section<'_>,
    model: &dyn RobotModel,
    folder: Folder<'_>,
    usual: &str,
) -> Option<PathBuf> {
    let unusable = |path: &str, reason| ScenarioCause::NoFirmware {
        robots: model.robots(),
        path: path.to_owned(),
        reason,
    };
    let Some(entry) = section.get("firmware") else {
        // An unreadable working folder has no firmware either, so the error is ignored.
        let start = std::path::absolute(folder.path).unwrap_or_default();
        let is_file = |path: &PathBuf| matches!(folder.files.kind(path), Ok(FileKind::File { .. }));
        let found = start.ancestors().map(|folder| folder.join(usual)).find(is_file);
        if found.is_none() {
            let reason = "no folder above the scenario has it".to_owned();
            let cause = unusable(usual, reason);
            match section.get("backend") {
                Some(backend) => backend.fail(cause),
                None => section.fail(cause),
            }
        }
        return found;
    };
    let text = entry.string()?;
    match folder.file(text, Some(file::PROGRAM_BYTES_MAX)) {
        Ok(path) => Some(path),
        Err(reason) => {
            entry.fail(unusable(text, reason));
            None
        }
    }
}
