//! USART6 with two rings of bytes, and the nRF51's flow control on PA4.
//!
//! embassy-stm32's buffered driver does not support a flow control line on another pin than the
//! USART's own CTS, and critical sections delay its interrupt. Here the interrupt reads the line
//! before each byte, so that only the bytes under way follow after the line rises. The interrupt is
//! never masked (see [`crate::critical`]) and therefore uses no critical sections: it owns its ends
//! of the rings, and a second interrupt wakes the tasks.
//!
//! `RingBufferedUartRx` of embassy-stm32 0.6.0 receives by DMA, so that no interrupt has to be
//! served in time. It is not used for these reasons:
//! * Each of its reads, and each wake-up, reads SR and then DR to clear flags, and discards a byte
//!   that the DMA controller has not fetched yet (usart/ringbuffered.rs, `check_idle_and_errors`).
//!   The frame would be lost without an error.
//! * After a framing error it restarts and discards the bytes in its ring, good frames among them.
//! * It is reported to stop on an STM32F4 (embassy issue 6705, open).
//!
//! It also takes 1,668 bytes more than this receiver. A received byte takes 200 instructions here,
//! most of them in the parser.
//!
//! Registers: RM0090 chapter 30, baud rate in 30.3.4. Pins and line: crazyflie-firmware, uart_syslink.h.

use core::cell::UnsafeCell;
use core::future::poll_fn;
use core::sync::atomic::{AtomicU32, Ordering};
use core::task::Poll;

use bittybuzz_comms::syslink::FRAME_MAX;
use cortex_m::peripheral::NVIC;
use embassy_stm32::Peri;
use embassy_stm32::gpio::{AfType, Flex, Input, OutputType, Pull, Speed};
use embassy_stm32::interrupt;
use embassy_stm32::interrupt::typelevel::{
    Binding, EXTI4, Handler, Interrupt, USART1 as Waking, USART6 as Usart6,
};
use embassy_stm32::pac;
use embassy_stm32::pac::gpio::vals::Idr;
use embassy_stm32::peripherals::{PA4, PC6, PC7, USART6};
use embassy_stm32::rcc;
use embassy_sync::waitqueue::AtomicWaker;
use heapless::spsc::{Consumer, Producer, Queue};
use static_cell::StaticCell;

/// The interrupt that is never masked.
pub const INTERRUPT: interrupt::Interrupt = Usart6::IRQ;
/// The interrupt of an unused peripheral, which wakes tasks.
const WAKING: interrupt::Interrupt = Waking::IRQ;

const BAUD: u32 = 1_000_000;

/// The alternate function of USART6 on PC6 and PC7 (data sheet, table 9).
const AF: u8 = 8;

/// The received bytes that can wait, plus one: 5 ms of a busy line.
const RX_RING: usize = 513;
/// The number of bytes after which the reader is woken; otherwise it is woken when the line is
/// idle. Waking it for each byte would take 1,100 instructions per byte.
const RX_BURST: usize = 64;
/// The bytes to be sent that can wait, plus one: a frame.
const TX_RING: usize = FRAME_MAX + 1;

static RX_WAKER: AtomicWaker = AtomicWaker::new();
static TX_WAKER: AtomicWaker = AtomicWaker::new();

/// The number of bytes that were lost, because the interrupt came late or the ring was full.
static OVERRUNS: AtomicU32 = AtomicU32::new(0);

/// The interrupt's ends of the rings.
struct Ends {
    received: Producer<'static, u8>,
    to_send: Consumer<'static, u8>,
}

/// A value that belongs to the interrupt once that is enabled.
struct InterruptOwned(UnsafeCell<Option<Ends>>);

// SAFETY: `open` writes the value while the interrupt is off. From then on only the interrupt
// accesses it, and that does not interrupt itself.
unsafe impl Sync for InterruptOwned {}

static ENDS: InterruptOwned = InterruptOwned(UnsafeCell::new(None));

/// The interrupts of the link.
pub struct Interrupts;

impl Handler<Usart6> for Interrupts {
    unsafe fn on_interrupt() {
        // SAFETY: this interrupt owns the value.
        if let Some(ends) = unsafe { &mut *ENDS.0.get() } {
            ends.serve();
        }
    }
}

impl Ends {
    #[inline]
    fn serve(&mut self) {
        let usart = pac::USART6;
        // Reading SR and then DR clears RXNE, IDLE and the errors (30.6.1). IDLE comes a byte's
        // time after the last byte, and DR is read long before the next byte arrives.
        let status = usart.sr().read();
        if status.rxne() || status.idle() || status.ore() || status.fe() || status.ne() {
            let byte = usart.dr().read().dr() as u8;
            // On an overrun, DR still holds the byte before the lost one. A byte with a wrong stop
            // bit is discarded.
            if status.ore() {
                OVERRUNS.fetch_add(1, Ordering::Relaxed);
            }
            if status.rxne() && !status.fe() && self.received.enqueue(byte).is_err() {
                OVERRUNS.fetch_add(1, Ordering::Relaxed);
            }
            if status.idle() || self.received.len() == RX_BURST {
                NVIC::pend(WAKING);
            }
        }
        if status.txe() && usart.cr1().read().txeie() {
            // The writer sleeps until the ring is empty, so the last byte wakes it.
            let is_last = self.to_send.len() == 1;
            match if may_send() { self.to_send.dequeue() } else { None } {
                Some(byte) => usart.dr().write(|w| w.set_dr(byte.into())),
                None => usart.cr1().modify(|w| w.set_txeie(false)),
            }
            if is_last {
                NVIC::pend(WAKING);
            }
        }
    }
}

impl Handler<Waking> for Interrupts {
    unsafe fn on_interrupt() {
        RX_WAKER.wake();
        TX_WAKER.wake();
    }
}

impl Handler<EXTI4> for Interrupts {
    unsafe fn on_interrupt() {
        pac::EXTI.pr(0).write(|w| w.set_line(4, true));
        go_on();
    }
}

/// Returns true while PA4 is low: the nRF51 has room for more bytes.
fn may_send() -> bool {
    pac::GPIOA.idr().read().idr(4) == Idr::LOW
}

/// Lets the interrupt send the bytes in the ring, once the line allows it.
fn go_on() {
    // The link's interrupt changes the same register, so it is masked here as well, for three
    // instructions.
    cortex_m::interrupt::free(|_| pac::USART6.cr1().modify(|w| w.set_txeie(true)));
}

/// Returns the number of bytes that were lost since the start.
pub fn overruns() -> u32 {
    OVERRUNS.load(Ordering::Relaxed)
}

/// The receiving end of the link.
pub struct Receiver {
    ring: Consumer<'static, u8>,
    _pins: (Flex<'static>, Flex<'static>, Input<'static>),
}

/// The sending end of the link.
pub struct Sender {
    ring: Producer<'static, u8>,
}

/// Sets the link up: 1 Mbaud, 8 data bits, no parity, one stop bit. The link owns the pins from
/// then on.
pub fn open(
    _usart: Peri<'static, USART6>,
    tx: Peri<'static, PC6>,
    rx: Peri<'static, PC7>,
    full: Peri<'static, PA4>,
    _irq: impl Binding<Usart6, Interrupts> + Binding<EXTI4, Interrupts> + Binding<Waking, Interrupts>,
) -> (Receiver, Sender) {
    static RX: StaticCell<Queue<u8, RX_RING>> = StaticCell::new();
    static TX: StaticCell<Queue<u8, TX_RING>> = StaticCell::new();
    let (received, rx_ring) = RX.init(Queue::new()).split();
    let (tx_ring, to_send) = TX.init(Queue::new()).split();
    // SAFETY: the interrupt is not enabled yet. This function is called once, since it takes the
    // peripheral.
    unsafe { *ENDS.0.get() = Some(Ends { received, to_send }) };

    rcc::enable_and_reset::<USART6>();
    let (mut tx, mut rx) = (Flex::new(tx), Flex::new(rx));
    tx.set_as_af_unchecked(AF, AfType::output(OutputType::PushPull, Speed::VeryHigh));
    rx.set_as_af_unchecked(AF, AfType::input(Pull::Up));
    let full = Input::new(full, Pull::Up);
    watch_flow_control();
    let usart = pac::USART6;
    // With 16 samples per bit, BRR holds the clock divided by the baud rate, in sixteenths.
    let divider = rcc::frequency::<USART6>().0 / BAUD;
    usart.brr().write_value(pac::usart::regs::Brr(divider));
    usart.cr1().write(|w| {
        w.set_ue(true);
        w.set_te(true);
        w.set_re(true);
        w.set_rxneie(true);
        w.set_idleie(true);
    });
    enable::<Usart6>();
    enable::<EXTI4>();
    enable::<Waking>();
    (Receiver { ring: rx_ring, _pins: (tx, rx, full) }, Sender { ring: tx_ring })
}

/// Enables the interrupt of line 4 of port A on the falling edge: the nRF51 has room again.
fn watch_flow_control() {
    pac::RCC.apb2enr().modify(|w| w.set_syscfgen(true));
    pac::SYSCFG.exticr(1).modify(|w| w.set_exti(0, 0));
    pac::EXTI.ftsr(0).modify(|w| w.set_line(4, true));
    pac::EXTI.pr(0).write(|w| w.set_line(4, true));
    pac::EXTI.imr(0).modify(|w| w.set_line(4, true));
}

fn enable<I: Interrupt>() {
    I::unpend();
    // SAFETY: everything that the handler needs is set up, and no code relies on the interrupt
    // being off.
    unsafe { I::enable() };
}

impl Receiver {
    /// Waits for at least one byte, and returns the number of bytes that were read.
    pub async fn read(&mut self, buffer: &mut [u8]) -> usize {
        poll_fn(|context| {
            RX_WAKER.register(context.waker());
            let mut count = 0;
            while let Some(slot) = buffer.get_mut(count)
                && let Some(byte) = self.ring.dequeue()
            {
                *slot = byte;
                count += 1;
            }
            if count > 0 { Poll::Ready(count) } else { Poll::Pending }
        })
        .await
    }
}

impl Sender {
    /// Writes a frame to the ring, which must be empty; see [`flush`](Self::flush).
    pub fn write(&mut self, frame: &[u8]) {
        for byte in frame {
            // An empty ring has room for a whole frame.
            let _ = self.ring.enqueue(*byte);
        }
        go_on();
    }

    /// Waits until the ring is empty: at most the last two bytes are still on their way.
    pub async fn flush(&mut self) {
        poll_fn(|context| {
            TX_WAKER.register(context.waker());
            if self.ring.is_empty() { Poll::Ready(()) } else { Poll::Pending }
        })
        .await
    }
}
