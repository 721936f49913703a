//! The check for groups of emulated robots that cannot be in one world.

use super::backend::Backend;
use super::error::ScenarioCause;
use super::group::Group;
use super::read::Section;

/// Reports groups that cannot be in one world: one emulator program runs all robots of a model with
/// one firmware, and robots outside it do not receive their frames.
pub fn check(root: &Section<'_>, groups: &[Group]) {
    let fail = |group: &Group, cause| {
        let place = match &group.backend {
            Backend::Vm => &group.place,
            Backend::Firmware { place, .. } => place,
        };
        root.reader.fail_at(place, cause);
    };
    for (number, group) in groups.iter().enumerate() {
        let first = groups.iter().find(|first| first.model.name() == group.model.name());
        if let Some(first) = first
            && first.backend.firmware().is_some() != group.backend.firmware().is_some()
        {
            fail(group, ScenarioCause::UnlikeBackends { line: first.place.line });
        }
        // The limits of emulators do not hold for virtual machines.
        let Some(firmware) = group.backend.firmware() else { continue };
        if let Some(first) = first
            && first.backend.firmware().is_some_and(|of_first| of_first != firmware)
        {
            fail(group, ScenarioCause::UnlikeFirmware { line: first.place.line });
        }
        let alike =
            groups.iter().take(number + 1).filter(|other| other.model.name() == group.model.name());
        let count = alike.map(|other| other.count).sum();
        let emulation = group.model.emulation();
        let most = emulation.expect("the reader rejects firmware without an emulator").robots_max();
        if count > most {
            fail(group, ScenarioCause::TooManyEmulated { count, most });
        }
    }
}
