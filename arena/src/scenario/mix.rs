//! The check for groups of emulated robots that cannot be in one world.

use std::collections::HashMap;
use std::ops::Range;

use bittybuzz_toml_reader::Place;

use super::backend::{Backend, ImageSection};
use super::error::ScenarioCause;
use super::group::Group;
use super::read::Section;

/// Reports groups that cannot be in one world: one emulator program runs all robots of a model with
/// one firmware, and robots outside it do not receive their frames.
pub fn check(root: &Section<'_>, groups: &[Group]) {
    let fail = |group: &Group, cause| {
        let place = match &group.backend {
            Backend::Vm => &group.place,
            Backend::Firmware { place, .. } | Backend::Image(ImageSection { place, .. }) => place,
        };
        root.reader.fail_at(place, cause);
    };
    // The first group of each model, and the number of robots of the model.
    let mut models: HashMap<&str, (&Group, u32)> = HashMap::new();
    for group in groups {
        let (first, count) = models.entry(group.model.name()).or_insert((group, 0));
        *count = count.saturating_add(group.count);
        let (first, count) = (*first, *count);
        if first.backend.firmware().is_some() != group.backend.firmware().is_some() {
            fail(group, ScenarioCause::UnlikeBackends { line: first.place.line });
        }
        // The limits of emulators do not hold for virtual machines.
        if group.backend == Backend::Vm {
            continue;
        }
        if first.backend != Backend::Vm && !first.backend.is_like(&group.backend) {
            fail(group, ScenarioCause::UnlikeFirmware { line: first.place.line });
        }
        let emulation = group.model.emulation();
        let most = emulation.expect("the reader rejects firmware without an emulator").robots_max();
        if count > most {
            fail(group, ScenarioCause::TooManyEmulated { count, most });
        }
    }
    check_doors(root, groups);
}

/// Reports robots of two groups with doors at one port.
fn check_doors(root: &Section<'_>, groups: &[Group]) {
    let doors = groups.iter().filter_map(|group| {
        let door = group.backend.image()?.door.as_ref()?;
        let first = u32::from(door.first_port);
        Some((first..first + group.count, &door.place))
    });
    let doors: Vec<_> = doors.collect();
    for (number, (ports, place)) in doors.iter().enumerate() {
        let overlaps =
            |other: &&(Range<u32>, &Place)| other.0.start < ports.end && ports.start < other.0.end;
        if let Some((other, first)) = doors[..number].iter().find(overlaps) {
            let (port, line) = (ports.start.max(other.start), first.line);
            root.reader.fail_at(place, ScenarioCause::DuplicateDoor { port, line });
        }
    }
}
