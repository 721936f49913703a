//! `backend`: what runs the scripts of a group, and what robots that run their firmware cannot be asked for.

use std::path::{Path, PathBuf};

use bittybuzz_robots::{Place, Robot};

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

/// Where cargo puts the firmware of Zooids and Kilobots, from the project's folder.
const ZOOIDS: &str = "firmware/zooids/target/thumbv6m-none-eabi/release/bittybuzz-zooids";
const KILOBOTS: &str = "firmware/kilobot-avr/target/avr-none/release/bittybuzz-kilobot-avr.elf";

/// As many robots as the emulator plays.
const MOST: u32 = 100;

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
    let usual = match body {
        Body::Zooid if robot.layout.as_ref().is_some_and(|layout| layout.id.is_some()) => {
            Some(ZOOIDS)
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
    if let Some(link) = section.get("link") {
        link.fail(Cause::NotEmulated { key: "link" });
    }
    Some(Backend::Firmware { image: image(section, folder, usual)?, place: entry.place() })
}

fn image(section: &Section<'_>, folder: &Path, usual: &str) -> Option<PathBuf> {
    let Some(entry) = section.get("firmware") else {
        // An unreadable working folder has no firmware either.
        let start = std::path::absolute(folder).unwrap_or_default();
        let found = start.ancestors().map(|folder| folder.join(usual)).find(|path| path.is_file());
        if found.is_none()
            && let Some(backend) = section.get("backend")
        {
            let reason = "no folder above the scenario has it".to_owned();
            backend.fail(Cause::NoFirmware { path: usual.to_owned(), reason });
        }
        return found;
    };
    let text = entry.string()?;
    let path = folder.join(text);
    let reason = match path.metadata() {
        Ok(metadata) if metadata.is_file() => return Some(path),
        Ok(_) => "it is a folder".to_owned(),
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => {
            "there is no such file".to_owned()
        }
        Err(error) => error.to_string(),
    };
    entry.fail(Cause::NoFirmware { path: text.to_owned(), reason });
    None
}

/// Notes groups that cannot be in one world: one program emulates all robots with one firmware, and only these hear others of
/// their kind.
pub fn check(root: &Section<'_>, groups: &[Group]) {
    let fail = |group: &Group, cause| {
        let place = match &group.backend {
            Backend::Vm => &group.place,
            Backend::Firmware { place, .. } => place,
        };
        root.reader.fail_at(place, cause);
    };
    let mut emulated: Option<&Group> = None;
    let mut count = 0;
    for group in groups {
        let firsts = groups.iter().find(|first| first.body == group.body);
        if let Some(first) = firsts
            && first.backend.firmware().is_some() != group.backend.firmware().is_some()
        {
            fail(group, Cause::UnlikeBackends { line: first.place.line });
        }
        let Some(firmware) = group.backend.firmware() else { continue };
        let first = *emulated.get_or_insert(group);
        if first.body != group.body || first.backend.firmware() != Some(firmware) {
            fail(group, Cause::UnlikeFirmware { line: first.place.line });
        }
        count += group.count;
        if count > MOST {
            fail(group, Cause::TooManyEmulated { count, most: MOST });
        }
    }
}
