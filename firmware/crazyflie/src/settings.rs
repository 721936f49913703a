//! The data of the individual robot: its id and the limits of its flight, which `bbz flash` writes to
//! separate sectors.

use core::hint::black_box;

use bittybuzz_board::log;
use bittybuzz_runtime::id::{Id, is_damaged, written};
use bittybuzz_station::{OwnerLimit, Station};
use bittybuzz_vm_core::hash::fnv_1a;
use embassy_stm32::uid;

use crate::robot::{ID_ADDRESS, SETTINGS_ADDRESS, setting};

/// The limits, with their places in the region of the settings.
const LIMITS: [(usize, OwnerLimit, &str); 7] = [
    (setting::SPEED_MM_S, OwnerLimit::Speed, "speed in mm/s"),
    (setting::CLIMB_MM_S, OwnerLimit::Climb, "vertical speed in mm/s"),
    (setting::HEIGHT_MM, OwnerLimit::Height, "height in mm"),
    (setting::FENCE_FRONT_MM, OwnerLimit::Front, "x in mm"),
    (setting::FENCE_BACK_MM, OwnerLimit::Back, "-x in mm"),
    (setting::FENCE_LEFT_MM, OwnerLimit::Left, "y in mm"),
    (setting::FENCE_RIGHT_MM, OwnerLimit::Right, "-y in mm"),
];

/// Returns the id in flash, or else one from the chip's unique id.
pub fn id() -> Id {
    Id::new(words(ID_ADDRESS), chip())
}

/// Returns a hash of the chip's unique id.
pub fn chip() -> u32 {
    fnv_1a(&uid::uid())
}

/// Gives the ground station the limits in flash, and writes them to the log. All of them are in mm or
/// mm/s.
pub fn limit(station: &mut Station) {
    for (place, limit, name) in LIMITS {
        if let Some(number) = written(section(place)) {
            log::info!("limit of flight: {=str} at most {=u16}", name, number);
            station.limit(limit, f32::from(number) / 1000.0);
        }
    }
}

/// Returns true if a limit in flash is damaged, so that the robot does not know how far it may fly.
pub fn are_limits_damaged() -> bool {
    LIMITS.iter().any(|(place, ..)| is_damaged(section(*place)))
}

fn section(place: usize) -> [u16; 2] {
    words(SETTINGS_ADDRESS + place * size_of::<[u16; 2]>())
}

fn words(address: usize) -> [u16; 2] {
    // SAFETY: both regions are flash, lie within the chip, are aligned, and are not written while
    // the program runs.
    unsafe { black_box(address as *const [u16; 2]).read() }
}
