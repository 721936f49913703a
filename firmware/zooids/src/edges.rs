//! Pins whose edges matter: the photodiodes, each edge with its time, and the radio's interrupt line.
//!
//! embassy-stm32's own driver wakes a task for an edge and has it switched on again by that task: too late for the next
//! edge of a photodiode, 333 µs later, if a task computes for so long. Here the interrupt itself takes the time and decodes.

use embassy_stm32::interrupt::{self, InterruptExt};
use embassy_stm32::pac;
use embassy_time::Instant;

use crate::eyes::{self, Side};
use crate::pins::{LEFT, RADIO_IRQ, RIGHT, is_high};
use crate::radio::nrf24::IRQ;

/// Ports, as SYSCFG_EXTICR numbers them (RM0091 9.1.2).
const PORT_A: u8 = 0;
const PORT_B: u8 = 1;

/// Begins.
pub fn watch() {
    // A line of the external interrupts has its pin's number.
    pac::SYSCFG.exticr(RIGHT / 4).modify(|w| w.set_exti(RIGHT % 4, PORT_B));
    pac::SYSCFG.exticr(LEFT / 4).modify(|w| w.set_exti(LEFT % 4, PORT_B));
    pac::SYSCFG.exticr(RADIO_IRQ / 4).modify(|w| w.set_exti(RADIO_IRQ % 4, PORT_A));
    const PHOTODIODES: u32 = 1 << RIGHT | 1 << LEFT;
    const ALL: u32 = PHOTODIODES | 1 << RADIO_IRQ;
    pac::EXTI.rtsr(0).write(|w| w.0 = PHOTODIODES);
    pac::EXTI.ftsr(0).write(|w| w.0 = ALL);
    pac::EXTI.imr(0).write(|w| w.0 = ALL);
    // SAFETY: what the handlers need is there from the start, and nothing relies on them being off.
    unsafe {
        interrupt::EXTI0_1.enable();
        interrupt::EXTI4_15.enable();
    }
}

#[embassy_stm32::interrupt]
fn EXTI0_1() {
    pac::EXTI.pr(0).write(|w| w.set_line(LEFT, true));
    eyes::edge(Side::Left, Instant::now(), is_high(pac::GPIOB, LEFT));
}

#[embassy_stm32::interrupt]
fn EXTI4_15() {
    let pending = pac::EXTI.pr(0).read();
    if pending.line(RIGHT) {
        pac::EXTI.pr(0).write(|w| w.set_line(RIGHT, true));
        eyes::edge(Side::Right, Instant::now(), is_high(pac::GPIOB, RIGHT));
    }
    if pending.line(RADIO_IRQ) {
        pac::EXTI.pr(0).write(|w| w.set_line(RADIO_IRQ, true));
        IRQ.signal(());
    }
}
