//! The Kilobot in an emulator. The script is placed after the program in flash, duties and id in
//! the EEPROM.

use std::path::Path;
use std::time::Duration;

use bittybuzz_arena::engine::{LinkStatistics, Loss, Media, RobotView, Stream};
use bittybuzz_arena::robot::{Emulation, FlashJob};
use bittybuzz_arena::scenario::ScenarioCause;
use bittybuzz_emulation::message::{BoardStatistics, Command, RobotStatistics};
use bittybuzz_emulation::{AVR_FLASH_SIZE, ClientError, Emulator, FirmwareImage};
use bittybuzz_kilobot::calibration;
use bittybuzz_robot_spec::Robot;

use crate::{KilobotModel, script};

/// The address of the EEPROM in the emulator's protocol.
const EEPROM: u32 = 0x81_0000;

/// The longest delay until a change of motion reaches the emulator: a Kilobot moves less than a mm
/// in this time.
const EXCHANGE_PERIOD: Duration = Duration::from_millis(20);

/// Room temperature in degrees Celsius.
const CELSIUS: f64 = 25.0;

/// Range in mm for light that reaches every robot.
const EVERYWHERE_MM: f64 = 1e6;

impl Emulation for KilobotModel {
    fn program(&self) -> &'static str {
        "bbz-emulate-avr"
    }

    fn shared_program_robot(&self) -> Option<&'static str> {
        Some("kilobot")
    }

    fn robots_max(&self) -> u32 {
        100
    }

    /// Returns the image for any robot file: the id of a Kilobot is in the EEPROM, as kilolib has
    /// it.
    fn image(&self, _: &Robot) -> Option<&'static str> {
        Some("firmware/kilobot-avr/target/avr-none/release/bittybuzz-kilobot-avr.elf")
    }

    fn listener(&self) -> Option<&'static str> {
        Some("firmware/kilobot-avr/target/avr-none/release/bittybuzz-kilobot-ear.elf")
    }

    fn listener_flash(&self, path: &Path) -> Result<Vec<u8>, String> {
        let program =
            FirmwareImage::open_avr(path, AVR_FLASH_SIZE).map_err(|error| error.to_string())?;
        Ok(script::flash(&program))
    }

    fn has_trace(&self) -> bool {
        false
    }

    fn counts_steps(&self) -> bool {
        true
    }

    fn exchange_period(&self) -> Duration {
        EXCHANGE_PERIOD
    }

    /// Returns the script, and the duties of the calibration.
    fn sections(&self, flash: &FlashJob<'_>) -> Result<Vec<(u32, Vec<u8>)>, ScenarioCause> {
        let mut sections = vec![script::section(flash.firmware, flash.script, flash.robot)?];
        let KilobotModel { turn_duty, straight_duty, .. } = *self;
        let duties = [turn_duty, turn_duty, straight_duty, straight_duty];
        let cells = calibration::DUTIES.into_iter().zip(duties);
        sections.extend(cells.map(|(cell, duty)| (EEPROM + u32::from(cell), vec![duty])));
        Ok(sections)
    }

    fn id_section(&self, _: &Robot, id: u16) -> Option<(u32, Vec<u8>)> {
        Some((EEPROM + u32::from(calibration::ID), id.to_le_bytes().to_vec()))
    }

    fn set_up(&self, number: usize, seed: u64, media: &Media) -> Vec<Command> {
        let error = Stream::for_brain(seed, number as u16).normal().clamp(-3.0, 3.0);
        let error_ppm = f64::from(1e6 * media.infrared.clock_sigma * error);
        vec![Command::Clock { error_ppm }]
    }

    fn air(&self, media: &Media, seed: u64) -> Option<Command> {
        let reach = |range| f64::from(range) + 2.0 * f64::from(self.radius);
        let range_mm = media.infrared.link.range.map_or(EVERYWHERE_MM, reach);
        let edge_mm = media.infrared.link.edge.into();
        let noise_mm = media.infrared.distance_sigma.into();
        Some(Command::Infrared { range_mm, edge_mm, noise_mm, seed })
    }

    /// Returns the mean of the medium's loss for robots in contact and at the limit of the range.
    fn loss(&self, loss: Loss) -> f64 {
        f64::midpoint(loss.near.into(), loss.far.into())
    }

    /// Sends the overhead controller's message that starts programs; programs that already run
    /// ignore it.
    fn start(&self, emulator: &mut Emulator, now: Duration) -> Result<(), ClientError> {
        emulator.start_kilobots(now)
    }

    fn sense(&self, _: &RobotView, light: u16) -> Option<Command> {
        Some(Command::Surroundings { light, celsius: CELSIUS })
    }

    fn duties(&self, [left, right, ..]: [f64; 4]) -> [f32; 2] {
        [left, right].map(|duty| (100.0 * duty) as f32)
    }

    fn count(&self, statistics: &RobotStatistics, links: &mut LinkStatistics) -> u64 {
        // The caller names the emulator's program, which may be that of another robot.
        if let BoardStatistics::Kilobot(board) = &statistics.board {
            links.sent += board.infrared_sent;
            links.received += board.infrared_arrived;
        }
        0
    }
}
