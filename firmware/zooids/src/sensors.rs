//! The sensors for battery, charger and touch, which are polled.
//!
//! | battery below | for | reaction |
//! |---|---|---|
//! | 3.42 V | 5 s | warns by its LED (SwarmUI's limit: 530 of 1023 steps, sensors.c) |
//! | 3.3 V | 5 s more | stops the motors: the regulator can no longer hold its 3.3 V |
//! | 3.0 V | 5 s more | stops script and radio, since an empty lithium cell is damaged |
//!
//! A battery recovers without its load, so only the charger or power-on leads back up.
//!
//! The converter is read by its registers. `Adc` of embassy-stm32 0.6.0 takes 2.2 kB more, half of
//! it a 64-bit division, and needs an interrupt for each conversion of 21 µs.

use bittybuzz_runtime::battery::{Charge, Ladder};
use bittybuzz_runtime::liveness::{BEAT, Pulse};
use cortex_m::peripheral::SCB;
use embassy_stm32::gpio::Input;
use embassy_stm32::pac;
use embassy_stm32::pac::adc::vals::{Ckmode, Res, SampleTime};
use embassy_time::Timer;
use portable_atomic::{AtomicBool, AtomicU8, AtomicU16, Ordering};

use crate::touch::Touch;
use crate::{failure, i2c};

static CHARGING: AtomicBool = AtomicBool::new(false);
static TOUCHED: AtomicBool = AtomicBool::new(false);
static BATTERY_MV: AtomicU16 = AtomicU16::new(0);

/// Returns true while the battery is charged. Motors and radio then have no power.
pub fn is_charging() -> bool {
    CHARGING.load(Ordering::Relaxed)
}

/// Returns true if a finger touches the robot.
pub fn is_touched() -> bool {
    TOUCHED.load(Ordering::Relaxed)
}

/// Returns the battery's voltage in mV.
pub fn battery_mv() -> u16 {
    BATTERY_MV.load(Ordering::Relaxed)
}

/// The voltage in mV below which each state of charge begins.
const LADDER_MV: [u16; 3] = [3420, 3300, 3000];

static CHARGE: AtomicU8 = AtomicU8::new(Charge::Enough as u8);

/// Returns the battery's charge. A robot with [`Charge::Flat`] has switched itself off and only
/// watches for the charger.
pub fn charge() -> Charge {
    Charge::of_number(CHARGE.load(Ordering::Relaxed))
}

/// Returns true if the radio has no power.
pub fn radio_rests() -> bool {
    is_charging() || charge() == Charge::Flat
}

/// Sets the charge with which the robot starts.
pub fn set_charge(charge: Charge) {
    CHARGE.store(charge as u8, Ordering::Relaxed);
}

/// Processes a reading of the battery, and acts upon the new charge.
fn judge(ladder: &mut Ladder) {
    let now = ladder.update(battery_mv(), is_charging());
    match (charge(), now) {
        // The script restarts as after power-on.
        (Charge::Flat, Charge::Enough) => SCB::sys_reset(),
        (Charge::Empty, Charge::Flat) => failure::switch_off(),
        _ => set_charge(now),
    }
}

/// The number of beats between two readings of the battery: a second.
const BATTERY_BEATS: u8 = 20;

/// Starts the sensors and reads them once, before the script starts. The input `charger` is low
/// while the battery is charged.
pub fn begin(charger: &Input<'static>) {
    i2c::start();
    start_adc();
    read_charger(charger);
    read_battery();
}

fn read_charger(charger: &Input<'static>) {
    CHARGING.store(charger.is_low(), Ordering::Relaxed);
}

fn read_battery() {
    BATTERY_MV.store(measure_battery(), Ordering::Relaxed);
}

/// Runs the task that polls the sensors.
#[embassy_executor::task]
pub async fn sense(
    charger: Input<'static>,
    mut touch: Touch,
    watches_battery: bool,
    pulse: Pulse,
) -> ! {
    let mut beats = BATTERY_BEATS;
    let mut ladder = watches_battery.then(|| Ladder::new(LADDER_MV, charge()));
    loop {
        pulse.beat();
        read_charger(&charger);
        if let Some(touched) = touch.changed() {
            TOUCHED.store(touched, Ordering::Relaxed);
        }
        beats -= 1;
        if beats == 0 {
            read_battery();
            if let Some(ladder) = &mut ladder {
                judge(ladder);
            }
            beats = BATTERY_BEATS;
        }
        Timer::after(BEAT).await;
    }
}

/// Calibrates the converter and turns it on (RM0091 13.4).
fn start_adc() {
    let adc = pac::ADC1;
    // The converter's clock is a quarter of 48 MHz.
    adc.cfgr2().write(|w| w.set_ckmode(Ckmode::PCLK_DIV4));
    adc.cr().write(|w| w.set_adcal(true));
    while adc.cr().read().adcal() {}
    adc.cfgr1().write(|w| w.set_res(Res::BITS12));
    adc.smpr().write(|w| w.set_smp(SampleTime::CYCLES239_5));
    adc.chselr().write(|w| {
        w.set_chsel_x(VREFINT, true);
        w.set_chsel_x(VBAT, true);
    });
    // ADEN is ignored within four cycles of the calibration's end, so it is set until the converter
    // is ready (13.4.1).
    while !adc.isr().read().adrdy() {
        adc.cr().modify(|w| w.set_aden(true));
    }
}

/// The channels of the internal reference and of the battery, which the converter reads in this
/// order.
const VREFINT: usize = 17;
const VBAT: usize = 18;
/// The address of the reference's reading at a supply of 3.3 V, which the chip's maker measured
/// (DS8668, table 4).
const VREFINT_CAL: *const u16 = 0x1fff_f7ba as _;

/// Returns the battery's voltage in mV, in 42 µs. Half of the voltage is converted (RM0091 13.9),
/// in 4095 steps of the supply. The supply is 3.3 V, or the battery's voltage if that is lower; the
/// reference shows which (13.8).
fn measure_battery() -> u16 {
    let adc = pac::ADC1;
    // Divider and reference draw current permanently, so they are only on during the measurement.
    adc.ccr().modify(|w| {
        w.set_vbaten(true);
        w.set_vrefen(true);
    });
    adc.cr().modify(|w| w.set_adstart(true));
    let reference = converted();
    let steps = converted();
    adc.ccr().write(|_| {});
    // SAFETY: this is a halfword that the chip's maker programmed.
    let calibrated = u32::from(unsafe { VREFINT_CAL.read_volatile() });
    // Scales the reading to a supply of 3.3 V.
    let steps = steps * calibrated / reference.max(1);
    // 6602 / 4096 = 2 * 3300 / 4095
    ((steps * 6602) >> 12) as u16
}

/// Waits for the next conversion and returns its result.
fn converted() -> u32 {
    while !pac::ADC1.isr().read().eoc() {}
    pac::ADC1.dr().read().data().into()
}
