//! The place of a script in a Kilobot's flash: after the program, where the program's marker is.

use std::path::Path;

use bittybuzz_compiler::fit::{self, CapacityError};
use bittybuzz_compiler::refusal;
use bittybuzz_emulation::{AVR_FLASH_SIZE, FirmwareImage};
use bittybuzz_robot_spec::{NoSection, Robot, find_script_section, script_section};
use bittybuzz_vm_core::image::VERSION;

use bittybuzz_arena::scenario::ScenarioCause;

/// First address after the flash.
const FLASH_END: u32 = 0x8000;

/// Returns the address and the bytes of the script `image` for the flash of a robot that runs the
/// program at `path`.
pub fn section(path: &Path, image: &[u8], robot: &Robot) -> Result<(u32, Vec<u8>), ScenarioCause> {
    let unusable = |reason: String| ScenarioCause::NoFirmware {
        robots: crate::ROBOTS,
        path: path.display().to_string(),
        reason,
    };
    let program = FirmwareImage::open_avr(path, AVR_FLASH_SIZE)
        .map_err(|error| unusable(error.to_string()))?;
    let program = flash(&program);
    let (at, parts) = find_script_section(&program).map_err(|error| {
        unusable(match error {
            NoSection::Missing => "it has no place for a script".to_owned(),
            NoSection::Ambiguous => {
                "it has several places for a script, or data after it".to_owned()
            }
            NoSection::Version(version) => format!(
                "it was built by another version: its own script is an image of version {version}, not {VERSION}; build \
                 it again"
            ),
        })
    })?;
    let limited = robot.clone().limited_to(parts);
    for misfit in fit::capacity_errors(image, &limited) {
        if let CapacityError::Part { part, .. } = misfit {
            let (name, what) = (part.name(), part.what());
            let reason = format!("it was built without `{name}` ({what}), which the script uses");
            return Err(unusable(reason));
        }
    }
    let sealed = fit::sealed(image, &limited)
        .map_err(|cause| ScenarioCause::ScriptRefused { reason: refusal::sentence(&cause) })?;
    let most =
        robot.budget.map_or(FLASH_END, |budget| budget.flash_bytes).saturating_sub(at as u32);
    match script_section(parts, &sealed) {
        Some(section) if section.len() <= most as usize => Ok((at as u32, section)),
        _ => Err(ScenarioCause::ScriptTooLong { bytes: sealed.len(), most }),
    }
}

/// Returns the content of the flash from address 0 on; gaps are erased.
pub fn flash(image: &FirmwareImage) -> Vec<u8> {
    let mut program = Vec::new();
    for (address, bytes) in image.segments().filter(|(address, _)| *address < FLASH_END) {
        let start = address as usize;
        if program.len() < start + bytes.len() {
            program.resize(start + bytes.len(), 0xff);
        }
        program[start..start + bytes.len()].copy_from_slice(bytes);
    }
    program
}
