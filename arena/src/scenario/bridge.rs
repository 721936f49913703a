//! `[bridge]`: a station that forwards messages between different media.

use std::path::PathBuf;

use bittybuzz_toml_reader::Place;

use super::backend::{Backend, image};
use super::error::ScenarioCause;
use super::folder::Folder;
use super::group::Group;
use super::keys::BRIDGE;
use super::read::Section;
use super::world::{WorldSection, point_inside};

/// A computer between the media. It receives infrared through a listening robot on its debug line,
/// sends infrared through an overhead controller, and has a dongle for each radio.
#[derive(Debug, Clone, PartialEq)]
pub struct BridgeSection {
    /// The position of the listening robot in mm.
    pub at: [f64; 2],
    /// The program of the listening robot; `None` if no group needs such a robot.
    pub image: Option<PathBuf>,
    /// The sender id for forwarded messages that do not name their sender.
    pub id: u16,
    /// The place of the section in the file.
    pub place: Place,
}

/// Reads the bridge of the file. All groups must run their firmware.
pub fn read<'g>(
    root: &Section<'_>,
    folder: Folder<'_>,
    world: &WorldSection,
    groups: &'g [Group],
) -> Option<BridgeSection> {
    let section = root.section("bridge", BRIDGE)?;
    for group in groups.iter().filter(|group| group.backend == Backend::Vm) {
        root.reader.fail_at(&group.place, ScenarioCause::NotBridged);
    }
    let at = match section.get("at") {
        Some(entry) => point_inside(&entry, world)?,
        None => [0.0; 2],
    };
    let listener = |group: &'g Group| Some((&*group.model, group.model.emulation()?.listener()?));
    let image = match groups.iter().find_map(listener) {
        Some((model, usual)) => Some(image(&section, model, folder, usual)?),
        None => None,
    };
    let id = section.integer("id", 0..=0xffff).map_or(u16::MAX, |id| id as u16);
    Some(BridgeSection { at, image, id, place: section.place() })
}
