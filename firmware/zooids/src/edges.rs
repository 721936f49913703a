//! Pins whose edges matter: the photodiodes, each edge with its time, and the radio's interrupt line.
//!
//! embassy-stm32's own driver wakes a task for an edge and has it switched on again by that task: too late for the next
//! edge of a photodiode, 333 µs later, if a task computes for so long. Here the interrupt itself takes the time and decodes.

use embassy_stm32::gpio::{Input, Pull};
use embassy_stm32::interrupt::{self, InterruptExt};
use embassy_stm32::peripherals::{PA15, PB1, PB9};
use embassy_stm32::{Peri, pac};
use embassy_time::Instant;

use crate::eyes::{self, Side};
use crate::radio;

/// Lines of the external interrupts: the pins' numbers.
const RIGHT: usize = 9;
const LEFT: usize = 1;
const RADIO: usize = 15;

/// Ports, as SYSCFG_EXTICR numbers them (RM0091 9.1.2).
const PORT_A: u8 = 0;
const PORT_B: u8 = 1;

/// Takes the pins for ever, and begins.
pub fn watch(right: Peri<'static, PB9>, left: Peri<'static, PB1>, radio: Peri<'static, PA15>) {
    core::mem::forget([
        Input::new(right, Pull::Up),
        Input::new(left, Pull::Up),
        Input::new(radio, Pull::None),
    ]);
    pac::RCC.apb2enr().modify(|w| w.set_syscfgen(true));
    for (line, port) in [(RIGHT, PORT_B), (LEFT, PORT_B), (RADIO, PORT_A)] {
        pac::SYSCFG.exticr(line / 4).modify(|w| w.set_exti(line % 4, port));
        pac::EXTI.ftsr(0).modify(|w| w.set_line(line, true));
        pac::EXTI.rtsr(0).modify(|w| w.set_line(line, line != RADIO));
        pac::EXTI.imr(0).modify(|w| w.set_line(line, true));
    }
    // SAFETY: what the handlers need is there from the start, and nothing relies on them being off.
    unsafe {
        interrupt::EXTI0_1.enable();
        interrupt::EXTI4_15.enable();
    }
}

#[embassy_stm32::interrupt]
fn EXTI0_1() {
    pac::EXTI.pr(0).write(|w| w.set_line(LEFT, true));
    eyes::edge(Side::Left, Instant::now(), is_high(LEFT));
}

#[embassy_stm32::interrupt]
fn EXTI4_15() {
    let pending = pac::EXTI.pr(0).read();
    if pending.line(RIGHT) {
        pac::EXTI.pr(0).write(|w| w.set_line(RIGHT, true));
        eyes::edge(Side::Right, Instant::now(), is_high(RIGHT));
    }
    if pending.line(RADIO) {
        pac::EXTI.pr(0).write(|w| w.set_line(RADIO, true));
        radio::nrf24::IRQ.signal(());
    }
}

/// Of port B.
fn is_high(pin: usize) -> bool {
    pac::GPIOB.idr().read().idr(pin) == pac::gpio::vals::Idr::HIGH
}
