//! The edges of the photodiodes, which hardware captures without the core, and the edge of the
//! radio's interrupt line.
//!
//! A photodiode sees up to 1,600 edges per second. An interrupt for each edge would take more time
//! than everything else together, and would be late while other interrupts run. Instead a timer
//! captures the time of each edge, and the DMA controller stores it.
//!
//! | photodiode | pin | captured by | stored by |
//! |---|---|---|---|
//! | 1, right | PB9 | TIM17, channel 1 | DMA channel 1 |
//! | 2, left | PB1 | TIM3, channel 4 | DMA channel 3 |
//!
//! TIM3 is also the [clock](crate::time), which does not use that channel. A capture is therefore
//! the low half of an [`Instant`](embassy_time::Instant) in µs. TIM17 is set to count in step with
//! it.
//!
//! embassy-stm32 0.6.0 has no driver that captures both edges by DMA on a timer that has another
//! use, too. Its `ExtiInput` clears an edge that comes while no task waits, where the [`IRQ`]
//! signal keeps the edge. `ExtiInput` also takes 0.7 kB more, and 2,000 more cycles for eight
//! messages.

use core::sync::atomic::AtomicU16;

use bittybuzz_motion::projector::{Decoder, Pixel};
use embassy_stm32::interrupt::{self, InterruptExt};
use embassy_stm32::pac;
use embassy_stm32::pac::bdma::vals::Size;
use embassy_stm32::pac::timer::vals::CcmrInputCcs;

use crate::pins::{LEFT, RADIO_IRQ, RIGHT, is_high};
use crate::radio::nrf24::IRQ;

/// The number of port A in SYSCFG_EXTICR (RM0091 9.1.2).
const PORT_A: u8 = 0;

/// Divides 48 MHz to µs.
const PRESCALER: u16 = 48;

/// The number of edges that are kept: those of nearly three frames.
const KEPT: usize = 64;
type Times = [AtomicU16; KEPT];

static RIGHT_TIMES: Times = [const { AtomicU16::new(0) }; KEPT];
static LEFT_TIMES: Times = [const { AtomicU16::new(0) }; KEPT];

/// A photodiode with its captured edges.
pub struct Eye {
    times: &'static Times,
    /// The DMA channel, counted from 0.
    channel: usize,
    /// The pin of port B.
    pin: usize,
    /// The index of the next time to be read.
    next: usize,
    /// The decoder of the photodiode's edges.
    pub decoder: Decoder,
}

impl Eye {
    /// Starts the DMA transfers from the capture register `register`. The timer's channel is still
    /// off.
    fn open(times: &'static Times, channel: usize, register: *mut (), pin: usize) -> Self {
        let dma = pac::DMA1.ch(channel);
        dma.par().write_value(register as u32);
        dma.mar().write_value(times.as_ptr() as u32);
        dma.ndtr().write(|w| w.set_ndt(KEPT as u16));
        dma.cr().write(|w| {
            w.set_psize(Size::BITS16);
            w.set_msize(Size::BITS16);
            w.set_minc(true);
            w.set_circ(true);
            w.set_en(true);
        });
        Eye { times, channel, pin, next: 0, decoder: Decoder::new() }
    }

    /// Passes the edges that were captured since the last call to the decoder.
    pub fn look(&mut self) {
        // NDTR counts down and restarts at `KEPT`.
        let left = usize::from(pac::DMA1.ch(self.channel).ndtr().read().ndt());
        let end = (KEPT - left) % KEPT;
        let (before, after) = self.times.split_at(self.next % KEPT);
        if end < self.next {
            self.decoder.edges(after);
            self.decoder.edges(&before[..end]);
        } else {
            self.decoder.edges(&after[..end - self.next]);
        }
        self.next = end;
    }

    /// Returns the position in the frame, as [`Decoder::pixel`] does.
    pub fn read(&mut self) -> Option<Pixel> {
        self.decoder.pixel(is_high(pac::GPIOB, self.pin))
    }
}

/// Starts the capture, and returns the right and the left photodiode.
pub fn open() -> [Eye; 2] {
    let (right, left) = (pac::TIM17, pac::TIM3);
    let eyes = [
        Eye::open(&RIGHT_TIMES, 0, right.ccr(0).as_ptr().cast(), RIGHT),
        Eye::open(&LEFT_TIMES, 2, left.ccr(3).as_ptr().cast(), LEFT),
    ];
    // The timers capture both edges of the channel's own pin (RM0091 20.6.6, 20.6.8; 18.4.8,
    // 18.4.9).
    right.ccmr_input(0).write(|w| w.set_ccs(0, CcmrInputCcs::TI4));
    right.ccer().write(|w| {
        w.set_cce(0, true);
        w.set_ccp(0, true);
        w.set_ccnp(0, true);
    });
    right.dier().write(|w| w.set_ccde(0, true));
    right.psc().write_value(PRESCALER - 1);
    right.egr().write(|w| w.set_ug(true));
    right.cnt().write(|w| w.set_cnt(left.cnt().read().cnt()));
    right.cr1().write(|w| w.set_cen(true));

    left.ccmr_input(1).write(|w| w.set_ccs(1, CcmrInputCcs::TI4));
    left.ccer().write(|w| {
        w.set_cce(3, true);
        w.set_ccp(3, true);
        w.set_ccnp(3, true);
    });
    // The other bits of the register belong to the clock.
    left.dier().modify(|w| w.set_ccde(3, true));
    eyes
}

/// Enables the interrupt of the radio.
pub fn watch() {
    // A line of the external interrupts has the number of its pin.
    pac::SYSCFG.exticr(RADIO_IRQ / 4).modify(|w| w.set_exti(RADIO_IRQ % 4, PORT_A));
    pac::EXTI.ftsr(0).write(|w| w.set_line(RADIO_IRQ, true));
    pac::EXTI.imr(0).write(|w| w.set_line(RADIO_IRQ, true));
    // SAFETY: everything that the handler needs exists from the start, and no code relies on the
    // interrupt being off.
    unsafe { interrupt::EXTI4_15.enable() };
}

#[embassy_stm32::interrupt]
fn EXTI4_15() {
    pac::EXTI.pr(0).write(|w| w.set_line(RADIO_IRQ, true));
    IRQ.signal(());
}
