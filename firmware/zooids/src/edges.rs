//! Edges that matter: those of the photodiodes, captured without the core's doing, and that of the radio's interrupt line.
//!
//! A photodiode sees up to 1,600 edges a second. An interrupt for each would take more time than everything else together, and come
//! late while others run; here a timer captures when one comes, and the DMA controller writes that down.
//!
//! | photodiode | pin | captured by | written down by |
//! |---|---|---|---|
//! | 1, right | PB9 | TIM17, channel 1 | DMA channel 1 |
//! | 2, left | PB1 | TIM3, channel 4 | DMA channel 3 |
//!
//! TIM3 is also the [clock](crate::time), which has no use for that channel: a capture is the low half of an
//! [`Instant`](embassy_time::Instant) in µs. TIM17 is made to count the same.
//!
//! embassy-stm32 0.6.0 has no driver that captures both edges by DMA for a timer that has another use, too. Its `ExtiInput`
//! clears an edge that came while no task waited, where the [`IRQ`] signal keeps it, and takes 0.7 kB and 2,000 cycles for eight
//! messages more.

use core::sync::atomic::AtomicU16;

use bittybuzz_motion::projector::{Decoder, Pixel};
use embassy_stm32::interrupt::{self, InterruptExt};
use embassy_stm32::pac;
use embassy_stm32::pac::bdma::vals::Size;
use embassy_stm32::pac::timer::vals::CcmrInputCcs;

use crate::pins::{LEFT, RADIO_IRQ, RIGHT, is_high};
use crate::radio::nrf24::IRQ;

/// Ports, as SYSCFG_EXTICR numbers them (RM0091 9.1.2).
const PORT_A: u8 = 0;

/// 48 MHz to µs.
const PRESCALER: u16 = 48;

/// Edges that are kept: those of nearly three frames.
const KEPT: usize = 64;
type Times = [AtomicU16; KEPT];

static RIGHT_TIMES: Times = [const { AtomicU16::new(0) }; KEPT];
static LEFT_TIMES: Times = [const { AtomicU16::new(0) }; KEPT];

/// A photodiode.
pub struct Eye {
    times: &'static Times,
    /// DMA channel, counted from 0.
    channel: usize,
    /// The pin of port B.
    pin: usize,
    /// The next to be read.
    next: usize,
    /// The decoder of its edges.
    pub decoder: Decoder,
}

impl Eye {
    /// Captures from `register` on. The timer's channel is set up, but off.
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

    /// Passes on the edges captured since the last time.
    pub fn look(&mut self) {
        // It counts down and begins anew.
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

/// Both photodiodes: the right one, and the left one.
pub fn open() -> [Eye; 2] {
    let (right, left) = (pac::TIM17, pac::TIM3);
    let eyes = [
        Eye::open(&RIGHT_TIMES, 0, right.ccr(0).as_ptr().cast(), RIGHT),
        Eye::open(&LEFT_TIMES, 2, left.ccr(3).as_ptr().cast(), LEFT),
    ];
    // The channel's own pin; both edges (RM0091 20.6.6, 20.6.8; 18.4.8, 18.4.9).
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
    // The rest of the register is the clock's.
    left.dier().modify(|w| w.set_ccde(3, true));
    eyes
}

/// From now on the radio's interrupts come.
pub fn watch() {
    // A line of the external interrupts has its pin's number.
    pac::SYSCFG.exticr(RADIO_IRQ / 4).modify(|w| w.set_exti(RADIO_IRQ % 4, PORT_A));
    pac::EXTI.ftsr(0).write(|w| w.set_line(RADIO_IRQ, true));
    pac::EXTI.imr(0).write(|w| w.set_line(RADIO_IRQ, true));
    // SAFETY: everything that the handler needs is there from the start, and nothing relies on it
    // being off.
    unsafe { interrupt::EXTI4_15.enable() };
}

#[embassy_stm32::interrupt]
fn EXTI4_15() {
    pac::EXTI.pr(0).write(|w| w.set_line(RADIO_IRQ, true));
    IRQ.signal(());
}
