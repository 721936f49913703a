//! `[bridge]`: what carries messages between unlike media.

use std::path::{Path, PathBuf};

use bittybuzz_toml_reader::Place;

use super::backend::{Backend, image};
use super::body::Body;
use super::error::Cause;
use super::keys::BRIDGE;
use super::read::Section;
use super::robots::Group;
use super::world::{World, point_inside};

/// A computer between the media: it hears Kilobots by a listening one on its debug line, speaks to them by an overhead
/// controller, and has a dongle for each radio.
#[derive(Debug, Clone, PartialEq)]
pub struct Bridge {
    /// Where the listening Kilobot lies, in mm.
    pub at: [f64; 2],
    /// What is flashed to it; `None` if there are no Kilobots.
    pub image: Option<PathBuf>,
    /// As whom it passes on what does not say who sends it.
    pub id: u16,
    /// Where it is written.
    pub place: Place,
}

/// Where cargo puts the image of a Kilobot that listens, from the project's folder.
const EAR: &str = "firmware/kilobot-avr/target/avr-none/release/bittybuzz-kilobot-ear.elf";

/// The bridge of the file, which needs robots that run their firmware on both sides.
pub fn read(root: &Section<'_>, folder: &Path, world: &World, groups: &[Group]) -> Option<Bridge> {
    let section = root.section("bridge", BRIDGE)?;
    for group in groups.iter().filter(|group| group.backend == Backend::Vm) {
        root.reader.fail_at(&group.place, Cause::NotBridged);
    }
    let at = match section.get("at") {
        Some(entry) => point_inside(&entry, world)?,
        None => [0.0; 2],
    };
    let hears_kilobots = groups.iter().any(|group| group.body == Body::Kilobot);
    let image = match hears_kilobots {
        true => Some(image(&section, folder, EAR)?),
        false => None,
    };
    let id = section.integer("id", 0..=0xffff).map_or(u16::MAX, |id| id as u16);
    Some(Bridge { at, image, id, place: section.place() })
}
