//! `backend`: the program that runs the scripts of a group, and the keys that robots with firmware
//! cannot have. `image` is a foreign image: firmware from outside of this project, which runs no script.

use std::path::{Path, PathBuf};

use bittybuzz_compiler::include::FileKind;
use bittybuzz_robot_spec::Robot;
use bittybuzz_toml_reader::{Place, file};

use crate::robot::RobotModel;

use super::error::ScenarioCause;
use super::folder::Folder;
use super::read::{Entry, Section};

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
    /// A foreign image in an emulator. The robots have no script.
    Image(ImageSection),
}

/// A foreign image.
#[derive(Debug, Clone, PartialEq)]
pub struct ImageSection {
    /// The file that would be flashed (ELF).
    pub path: PathBuf,
    /// The place of the key `image` in the scenario.
    pub place: Place,
    /// The doors of the robots for ground stations.
    pub door: Option<DoorSection>,
}

/// The doors of a group: one UDP port of this computer for each robot.
#[derive(Debug, Clone, PartialEq)]
pub struct DoorSection {
    /// The port of the first robot; the others follow.
    pub first_port: u16,
    /// The place of the key `door` in the scenario.
    pub place: Place,
}

impl DoorSection {
    /// Returns the port of a robot by its number in the group.
    pub fn port(&self, within: u16) -> u16 {
        self.first_port + within
    }
}

impl Backend {
    /// Returns the path of the firmware; `None` for a virtual machine.
    pub fn firmware(&self) -> Option<&Path> {
        match self {
            Backend::Vm => None,
            Backend::Firmware { image, .. } => Some(image),
            Backend::Image(section) => Some(&section.path),
        }
    }

    /// Returns the foreign image, if the robots run one.
    pub fn image(&self) -> Option<&ImageSection> {
        match self {
            Backend::Image(section) => Some(section),
            _ => None,
        }
    }

    /// Returns true if robots with these backends can be emulated in one world.
    pub fn is_like(&self, other: &Backend) -> bool {
        self.firmware() == other.firmware() && self.image().is_some() == other.image().is_some()
    }
}

/// Returns the backend of a group; `None` after an error.
pub fn of_group(
    section: &Section<'_>,
    model: Option<&dyn RobotModel>,
    robot: Option<&Robot>,
    folder: Folder<'_>,
    count: u32,
) -> Option<Backend> {
    if let Some(door) = section.get("door")
        && section.get("image").is_none()
    {
        door.fail(ScenarioCause::Without { key: "door", needs: "image" });
    }
    let Some(entry) = section.get("backend") else { return in_vm(section) };
    if !section.word("backend", &[("vm", false), ("firmware", true)])? {
        return in_vm(section);
    }
    if !cfg!(feature = "emulators") {
        entry.fail(ScenarioCause::NoEmulators);
        return None;
    }
    let (model, robot) = (model?, robot?);
    let emulation = model.emulation();
    let usual = emulation.as_ref().and_then(|emulation| emulation.image(robot));
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
    let Some(image) = section.get("image") else {
        let keys = emulation.as_ref().filter(|emulation| emulation.flies());
        for key in keys.map_or_else(Vec::new, |emulation| emulation.unsupported_in_flight()) {
            section.get("model").unwrap_or(entry.clone()).fail(ScenarioCause::NotEmulated { key });
        }
        let image = self::image(section, model, folder, usual)?;
        return Some(Backend::Firmware { image, place: entry.place() });
    };
    if emulation.is_none_or(|emulation| emulation.image_memory().is_none()) {
        image.fail(ScenarioCause::NoImages { robot: robot.name.clone() });
        return None;
    }
    image_section(section, &image, model, folder, count).map(Backend::Image)
}

/// Returns a virtual machine, which runs no image.
fn in_vm(section: &Section<'_>) -> Option<Backend> {
    let Some(image) = section.get("image") else { return Some(Backend::Vm) };
    image.fail(ScenarioCause::Without { key: "image", needs: "backend = \"firmware\"" });
    None
}

/// Keys about scripts and about the flash of our firmware, which do not exist with `image`.
const OF_SCRIPTS: [&str; 4] = ["script", "firmware", "profile", "settings"];

/// Reads the keys of robots with a foreign image.
fn image_section(
    section: &Section<'_>,
    image: &Entry<'_>,
    model: &dyn RobotModel,
    folder: Folder<'_>,
    count: u32,
) -> Option<ImageSection> {
    for key in OF_SCRIPTS {
        if let Some(entry) = section.get(key) {
            entry.fail(ScenarioCause::NotWithImage { key });
        }
    }
    for key in model.unusual_surroundings() {
        let place = section.get("model").unwrap_or(image.clone());
        place.fail(ScenarioCause::NotWithImage { key: key.name });
    }
    let path = image.string().and_then(|text| {
        let path = folder.file(text, Some(file::PROGRAM_BYTES_MAX));
        path.map_err(|reason| {
            image.fail(ScenarioCause::NoImage { path: text.to_owned(), reason });
        })
        .ok()
    });
    let door = match section.get("door") {
        None => None,
        Some(entry) => Some(door(&entry, count)?),
    };
    Some(ImageSection { path: path?, place: image.place(), door })
}

/// Reads the doors of a group of `count` robots.
fn door(entry: &Entry<'_>, count: u32) -> Option<DoorSection> {
    let first = entry.integer(1..=u32::from(u16::MAX))?;
    let last = first + count.saturating_sub(1);
    if last > u32::from(u16::MAX) {
        entry.fail(ScenarioCause::PortsExhausted { last });
    }
    Some(DoorSection { first_port: u16::try_from(first).ok()?, place: entry.place() })
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
