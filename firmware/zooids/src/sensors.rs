//! Battery, charger and touch: looked at from time to time.

use bittybuzz_runtime::liveness::{BEAT, Pulse};
use embassy_stm32::pac;
use embassy_stm32::pac::adc::vals::{Ckmode, Res, SampleTime};
use embassy_time::Timer;
use portable_atomic::{AtomicBool, AtomicU16, Ordering};

use crate::i2c;
use crate::pins::{CHARGING as CHARGER, is_high};
use crate::touch::Touch;

static CHARGING: AtomicBool = AtomicBool::new(false);
static TOUCHED: AtomicBool = AtomicBool::new(false);
static BATTERY_MV: AtomicU16 = AtomicU16::new(0);

/// Whether the battery is being charged: then neither motors nor radio have power.
pub fn is_charging() -> bool {
    CHARGING.load(Ordering::Relaxed)
}

/// Whether a finger touches the robot.
pub fn is_touched() -> bool {
    TOUCHED.load(Ordering::Relaxed)
}

/// The battery's voltage in mV.
pub fn battery_mv() -> u16 {
    BATTERY_MV.load(Ordering::Relaxed)
}

/// Beats between two looks at the battery: a second.
const BATTERY_BEATS: u8 = 20;

/// The first look, before any script can ask.
pub fn begin() {
    i2c::start();
    start_adc();
    look_at_charger();
    look_at_battery();
}

fn look_at_charger() {
    CHARGING.store(!is_high(pac::GPIOB, CHARGER), Ordering::Relaxed);
}

fn look_at_battery() {
    BATTERY_MV.store(measure_battery(), Ordering::Relaxed);
}

/// The task.
#[embassy_executor::task]
pub async fn sense(pulse: Pulse) -> ! {
    let mut touch = Touch::default();
    let mut beats = BATTERY_BEATS;
    loop {
        pulse.beat();
        look_at_charger();
        if let Some(touched) = touch.changed() {
            TOUCHED.store(touched, Ordering::Relaxed);
        }
        beats -= 1;
        if beats == 0 {
            look_at_battery();
            beats = BATTERY_BEATS;
        }
        Timer::after(BEAT).await;
    }
}

/// Calibrates the converter and turns it on (RM0091 13.4).
fn start_adc() {
    let adc = pac::ADC1;
    // A quarter of 48 MHz.
    adc.cfgr2().write(|w| w.set_ckmode(Ckmode::PCLK_DIV4));
    adc.cr().write(|w| w.set_adcal(true));
    while adc.cr().read().adcal() {}
    adc.cfgr1().write(|w| w.set_res(Res::BITS12));
    adc.smpr().write(|w| w.set_smp(SampleTime::CYCLES239_5));
    adc.chselr().write(|w| w.set_chsel_x(VBAT, true));
    // Not within four cycles of the calibration's end: turned on again until it is (13.4.1).
    while !adc.isr().read().adrdy() {
        adc.cr().modify(|w| w.set_aden(true));
    }
}

/// The battery's channel.
const VBAT: usize = 18;

/// In mV: half the battery's voltage (RM0091 13.9), of 3.3 V in 4095 steps. Takes 21 µs.
fn measure_battery() -> u16 {
    let adc = pac::ADC1;
    // The divider takes current all the time.
    adc.ccr().modify(|w| w.set_vbaten(true));
    adc.cr().modify(|w| w.set_adstart(true));
    while !adc.isr().read().eoc() {}
    let steps = u32::from(adc.dr().read().data());
    adc.ccr().modify(|w| w.set_vbaten(false));
    // 6602 / 4096 = 2 * 3300 / 4095
    ((steps * 6602) >> 12) as u16
}
