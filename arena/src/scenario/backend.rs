//! `backend`: what runs the scripts of a group, and what robots that run their firmware cannot be asked for.

use std::path::{Path, PathBuf};

use bittybuzz_robot_spec::{Profile, Robot};
use bittybuzz_toml_reader::{Place, file};

use super::body::Body;
use super::error::Cause;
use super::read::Section;
use super::robots::Group;

/// What runs the script of a group.
#[derive(Debug, Clone, PartialEq)]
pub enum Backend {
    /// A virtual machine in this process.
    Vm,
    /// The robot's firmware, in an emulator.
    Firmware {
        /// What would be flashed (ELF).
        image: PathBuf,
        /// Where the file asks for it.
        place: Place,
    },
}

impl Backend {
    /// The firmware, if it is one.
    pub fn firmware(&self) -> Option<&Path> {
        match self {
            Backend::Vm => None,
            Backend::Firmware { image, .. } => Some(image),
        }
    }
}

/// Where cargo puts the firmware of each kind, from the project's folder; that of Crazyflies in profile `full` and `tiny`.
const ZOOIDS: &str = "firmware/zooids/target/thumbv6m-none-eabi/release/bittybuzz-zooids";
const KILOBOTS: &str = "firmware/kilobot-avr/target/avr-none/release/bittybuzz-kilobot-avr.elf";
const CRAZYFLIES: [(Profile, &str); 2] = [
    (Profile::Full, "firmware/crazyflie/target/thumbv7em-none-eabihf/release/bittybuzz-crazyflie"),
    (
        Profile::Tiny,
        "firmware/crazyflie/target/tiny/thumbv7em-none-eabihf/release/bittybuzz-crazyflie",
    ),
];

/// As many robots as an emulator plays.
const MOST: u32 = 100;
/// Each Crazyflie has a process of its own.
const MOST_CRAZYFLIES: u32 = 20;

/// What the group says.
pub fn of_group(
    section: &Section<'_>,
    body: Option<Body>,
    robot: Option<&Robot>,
    folder: &Path,
) -> Option<Backend> {
    let Some(entry) = section.get("backend") else { return Some(Backend::Vm) };
    if !section.word("backend", &[("vm", false), ("firmware", true)])? {
        return Some(Backend::Vm);
    }
    let (body, robot) = (body?, robot?);
    let has_id = robot.layout.as_ref().is_some_and(|layout| layout.id.is_some());
    let usual = match body {
        Body::Zooid if has_id => Some(ZOOIDS),
        Body::Crazyflie if has_id => {
            let mut of_profile = CRAZYFLIES.iter().filter(|(known, _)| *known == robot.profile);
            of_profile.next().map(|(_, path)| *path)
        }
        // Its id is in the EEPROM, as kilolib has it.
        Body::Kilobot => Some(KILOBOTS),
        _ => None,
    };
    let Some(usual) = usual else {
        entry.fail(Cause::NoEmulator { robot: robot.name.clone() });
        return None;
    };
    if section.boolean("present") == Some(false)
        && let Some(present) = section.get("present")
    {
        present.fail(Cause::NotEmulated { key: "present = false" });
    }
    for key in ["link", "on_fault"] {
        if let Some(entry) = section.get(key) {
            entry.fail(Cause::NotEmulated { key });
        }
    }
    Some(Backend::Firmware { image: image(section, folder, usual)?, place: entry.place() })
}

/// The file that the section names, or the usual one.
pub fn image(section: &Section<'_>, folder: &Path, usual: &str) -> Option<PathBuf> {
    let Some(entry) = section.get("firmware") else {
        // An unreadable working folder has no firmware either.
        let start = std::path::absolute(folder).unwrap_or_default();
        let found = start.ancestors().map(|folder| folder.join(usual)).find(|path| path.is_file());
        if found.is_none() {
            let reason = "no folder above the scenario has it".to_owned();
            let cause = Cause::NoFirmware { path: usual.to_owned(), reason };
            match section.get("backend") {
                Some(backend) => backend.fail(cause),
                None => section.fail(cause),
            }
        }
        return found;
    };
    let text = entry.string()?;
    let path = folder.join(text);
    let reason = match path.metadata() {
        Ok(metadata) if metadata.is_file() && metadata.len() <= file::MOST_PROGRAM => {
            return Some(path);
        }
        Ok(metadata) if metadata.is_dir() => "it is a folder".to_owned(),
        Ok(metadata) if metadata.is_file() => {
            file::ReadError::TooLarge { limit: file::MOST_PROGRAM }.to_string()
        }
        Ok(_) => "it is a device or a pipe".to_owned(),
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => {
            "there is no such file".to_owned()
        }
        Err(error) => error.to_string(),
    };
    entry.fail(Cause::NoFirmware { path: text.to_owned(), reason });
    None
}

/// Notes groups that cannot be in one world: one program emulates all robots of a kind with one firmware, and only these hear
/// others of their kind.
pub fn check(root: &Section<'_>, groups: &[Group]) {
    let fail = |group: &Group, cause| {
        let place = match &group.backend {
            Backend::Vm => &group.place,
            Backend::Firmware { place, .. } => place,
        };
        root.reader.fail_at(place, cause);
    };
    for (number, group) in groups.iter().enumerate() {
        let first = groups.iter().find(|first| first.body == group.body);
        if let Some(first) = first
            && first.backend.firmware().is_some() != group.backend.firmware().is_some()
        {
            fail(group, Cause::UnlikeBackends { line: first.place.line });
        }
        let Some(firmware) = group.backend.firmware() else { continue };
        if let Some(first) = first
            && first.backend.firmware().is_some_and(|of_first| of_first != firmware)
        {
            fail(group, Cause::UnlikeFirmware { line: first.place.line });
        }
        let alike = groups.iter().take(number + 1).filter(|other| other.body == group.body);
        let count = alike.map(|other| other.count).sum();
        let most = if group.body == Body::Crazyflie { MOST_CRAZYFLIES } else { MOST };
        if count > most {
            fail(group, Cause::TooManyEmulated { count, most });
        }
    }
}
