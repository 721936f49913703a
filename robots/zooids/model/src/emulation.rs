//! The Zooid in an emulator: it runs its firmware image under a projector.

use std::time::Duration;

use bittybuzz_arena::engine::{LinkStatistics, Media, Pose};
use bittybuzz_arena::robot::{Emulation, FlashJob, layout_section};
use bittybuzz_arena::scenario::ScenarioCause;
use bittybuzz_emulation::message::{BoardStatistics, Command, RobotStatistics};
use bittybuzz_robot_spec::{Layout, Robot};

use crate::{ProjectorFaults, ZooidModel, table};

/// The longest delay until a change of motion reaches the emulator.
const EXCHANGE_PERIOD: Duration = Duration::from_micros(2500);

impl Emulation for ZooidModel {
    fn program(&self) -> &'static str {
        "bbz-emulate-m0"
    }

    fn shared_program_robot(&self) -> Option<&'static str> {
        Some("zooids")
    }

    fn robots_max(&self) -> u32 {
        100
    }

    fn image(&self, robot: &Robot) -> Option<&'static str> {
        robot.layout.as_ref()?.id?;
        Some("firmware/zooids/target/thumbv6m-none-eabi/release/bittybuzz-zooids")
    }

    fn has_trace(&self) -> bool {
        true
    }

    fn origin(&self) -> [f64; 2] {
        table::middle()
    }

    fn is_lit(&self, pose: &Pose) -> bool {
        table::is_lit(pose)
    }

    fn exchange_period(&self) -> Duration {
        EXCHANGE_PERIOD
    }

    /// Returns the script, and the range of the link as a setting if the scenario has one.
    fn sections(&self, flash: &FlashJob<'_>) -> Result<Vec<(u32, Vec<u8>)>, ScenarioCause> {
        let mut sections = layout_section(flash)?;
        sections.extend(range(flash.robot, flash.media)?);
        Ok(sections)
    }

    fn set_up(&self, number: usize, seed: u64, _: &Media) -> Vec<Command> {
        let ProjectorFaults { lose, jitter_us, glitches_per_s } = self.light;
        let seed = seed.wrapping_add(number as u64 + 1);
        let light = Command::Light { lose, jitter_us, glitches_per_s, seed };
        vec![light, Command::PowerDetector { reading: self.power_detector }]
    }

    fn count(&self, statistics: &RobotStatistics, links: &mut LinkStatistics) -> u64 {
        // The caller names the emulator's program, which may be that of another robot.
        let BoardStatistics::Zooid(board) = &statistics.board else { return 0 };
        links.sent += board.radio_sent;
        links.received += board.radio_received;
        links.deaf += board.radio_unheard;
        board.radio_overflown
    }
}

/// Returns the setting for the range of the link: address and bytes.
fn range(robot: &Robot, media: &Media) -> Result<Option<(u32, Vec<u8>)>, ScenarioCause> {
    let Some(range) = media.nrf24.link.range.map(f64::from) else { return Ok(None) };
    let setting = robot.settings.iter().position(|setting| setting.name == "range_mm");
    let region = robot.layout.as_ref().and_then(|layout| layout.settings);
    let (Some(place), Some(region)) = (setting, region) else {
        return Err(ScenarioCause::NotEmulated { key: "range" });
    };
    let mut values = vec![None; robot.settings.len()];
    // A range above the setting's maximum is stored as no limit.
    let range = Some(range.round()).filter(|range| *range <= f64::from(robot.settings[place].most));
    values[place] = range.map(|range| range as u16);
    Ok(Some((region.address, Layout::settings_section(&values))))
}
