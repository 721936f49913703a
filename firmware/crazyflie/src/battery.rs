//! The battery, which the nRF51 measures and charges.
//!
//! | below | for | reaction |
//! |---|---|---|
//! | 3.2 V | 5 s | warns by the right red LED (Bitcraze's limit, platform_defaults_cf2.h) |
//! | 3.1 V | 5 s more | stops the motors: the rest keeps LEDs and radio on for a while |
//! | 3.0 V | 5 s more | asks the nRF51 to cut all power, to protect the cell (see below) |
//!
//! The last limit is Bitcraze's critical one; a lower voltage damages a lithium cell. Power on USB
//! resets the state to the top. When all power is cut, only the nRF51 sleeps, and its button turns
//! the robot on again.

use core::sync::atomic::{AtomicU8, Ordering};

use bittybuzz_comms::syslink::SyslinkPacket;
use bittybuzz_runtime::battery::{Charge, Ladder};
use bittybuzz_runtime::liveness::{BEAT, Pulse};
use embassy_time::Timer;

use crate::link;
use bittybuzz_board::log;

/// The voltage in mV below which each state of charge begins.
const LADDER_MV: [u16; 3] = [3200, 3100, 3000];

/// The number of beats between two readings of the battery: a second.
const READING_BEATS: u8 = 20;

static CHARGE: AtomicU8 = AtomicU8::new(Charge::Enough as u8);

/// Returns the battery's charge.
pub fn charge() -> Charge {
    Charge::of_number(CHARGE.load(Ordering::Relaxed))
}

/// Runs the task that reads the battery's voltage and acts upon it.
#[embassy_executor::task]
pub async fn watch_battery(pulse: Pulse) -> ! {
    let mut ladder = Ladder::new(LADDER_MV, Charge::Enough);
    loop {
        for _ in 0..READING_BEATS {
            pulse.beat();
            Timer::after(BEAT).await;
        }
        let Some(mv) = link::STATE.battery_mv() else { continue };
        let now = ladder.update(mv, link::STATE.is_usb_powered());
        if now != charge() {
            report(now, mv);
        }
        if now == Charge::Flat {
            // The request is repeated every second, because a frame may be lost.
            link::send::send(&SyslinkPacket::SwitchOff);
        }
        CHARGE.store(now as u8, Ordering::Relaxed);
    }
}

fn report(charge: Charge, mv: u16) {
    match charge {
        Charge::Enough => log::info!("battery charging, at {=u16} mV", mv),
        Charge::Low => log::warning!("battery low, at {=u16} mV: charge it", mv),
        Charge::Empty => log::error!("battery empty, at {=u16} mV: no power for the motors", mv),
        Charge::Flat => {
            log::error!("battery flat, at {=u16} mV: the robot switches itself off", mv)
        }
    }
}
