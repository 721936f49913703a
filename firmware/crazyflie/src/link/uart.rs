//! USART6 with two rings of bytes, and the nRF51's flow control on PA4.
//!
//! embassy-stm32's buffered driver has no place for a flow control line that is not the USART's own CTS pin; here the
//! interrupt looks at the line before each byte, so that only the bytes under way follow its rise.
//!
//! Registers: RM0090 chapter 30, baud rate in 30.3.4. Pins and line: crazyflie-firmware, uart_syslink.h.

use core::sync::atomic::{AtomicU32, Ordering};

use embassy_stm32::Peri;
use embassy_stm32::gpio::{AfType, Flex, Input, OutputType, Pull, Speed};
use embassy_stm32::interrupt::typelevel::{Binding, EXTI4, Handler, Interrupt, USART6 as IRQ};
use embassy_stm32::pac;
use embassy_stm32::pac::gpio::vals::Idr;
use embassy_stm32::peripherals::{PA4, PC6, PC7, USART6};
use embassy_stm32::rcc;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::pipe::Pipe;

const BAUD: u32 = 1_000_000;

/// Alternate function of USART6 on PC6 and PC7 (data sheet, table 9).
const AF: u8 = 8;

/// Bytes that wait to be read: 5 ms of a busy line.
const RX_RING: usize = 512;
/// Bytes that wait to be sent.
const TX_RING: usize = 128;

static RX: Pipe<CriticalSectionRawMutex, RX_RING> = Pipe::new();
static TX: Pipe<CriticalSectionRawMutex, TX_RING> = Pipe::new();

/// Bytes that were lost: by the USART because the interrupt came late, or because the ring was full.
static OVERRUNS: AtomicU32 = AtomicU32::new(0);

/// The interrupts of the link.
pub struct Interrupts;

impl Handler<IRQ> for Interrupts {
    unsafe fn on_interrupt() {
        let usart = pac::USART6;
        // Reading SR and then DR clears RXNE and the errors (30.6.1).
        let status = usart.sr().read();
        if status.rxne() || status.ore() || status.fe() || status.ne() {
            let byte = usart.dr().read().dr() as u8;
            // With an overrun DR still holds the byte before the lost one. A byte with a wrong stop bit is none.
            let lost = u32::from(status.ore());
            let whole = status.rxne() && !status.fe();
            let kept = !whole || RX.try_write(&[byte]).is_ok();
            OVERRUNS.fetch_add(lost + u32::from(!kept), Ordering::Relaxed);
        }
        if status.txe() && usart.cr1().read().txeie() {
            let mut byte = [0];
            if may_send() && TX.try_read(&mut byte).is_ok() {
                usart.dr().write(|w| w.set_dr(byte[0].into()));
            } else {
                usart.cr1().modify(|w| w.set_txeie(false));
            }
        }
    }
}

impl Handler<EXTI4> for Interrupts {
    unsafe fn on_interrupt() {
        pac::EXTI.pr(0).write(|w| w.set_line(4, true));
        go_on();
    }
}

/// PA4 is low while the nRF51 has room for more bytes.
fn may_send() -> bool {
    pac::GPIOA.idr().read().idr(4) == Idr::LOW
}

/// Lets the interrupt send what is in the ring, once the line allows it.
fn go_on() {
    // The interrupt changes the same register.
    cortex_m::interrupt::free(|_| pac::USART6.cr1().modify(|w| w.set_txeie(true)));
}

/// Bytes lost since the start.
pub fn overruns() -> u32 {
    OVERRUNS.load(Ordering::Relaxed)
}

/// Both directions of the link. The pins are its own for ever.
pub struct Uart {
    _pins: (Flex<'static>, Flex<'static>, Input<'static>),
}

impl Uart {
    /// 1 Mbaud, 8 data bits, no parity, one stop bit.
    pub fn new(
        _usart: Peri<'static, USART6>,
        tx: Peri<'static, PC6>,
        rx: Peri<'static, PC7>,
        full: Peri<'static, PA4>,
        _irq: impl Binding<IRQ, Interrupts> + Binding<EXTI4, Interrupts>,
    ) -> Self {
        rcc::enable_and_reset::<USART6>();
        let (mut tx, mut rx) = (Flex::new(tx), Flex::new(rx));
        tx.set_as_af_unchecked(AF, AfType::output(OutputType::PushPull, Speed::VeryHigh));
        rx.set_as_af_unchecked(AF, AfType::input(Pull::Up));
        let full = Input::new(full, Pull::Up);
        watch_flow_control();
        let usart = pac::USART6;
        // With 16 samples a bit, BRR in sixteenths is the clock over the baud rate.
        let divider = rcc::frequency::<USART6>().0 / BAUD;
        usart.brr().write_value(pac::usart::regs::Brr(divider));
        usart.cr1().write(|w| {
            w.set_ue(true);
            w.set_te(true);
            w.set_re(true);
            w.set_rxneie(true);
        });
        enable::<IRQ>();
        enable::<EXTI4>();
        Uart { _pins: (tx, rx, full) }
    }

    /// Both directions, to be used by two tasks.
    pub fn split(self) -> (Receiver, Sender) {
        (Receiver { _uart: self }, Sender {})
    }
}

/// Line 4 from port A, falling edge: the nRF51 has room again.
fn watch_flow_control() {
    pac::RCC.apb2enr().modify(|w| w.set_syscfgen(true));
    pac::SYSCFG.exticr(1).modify(|w| w.set_exti(0, 0));
    pac::EXTI.ftsr(0).modify(|w| w.set_line(4, true));
    pac::EXTI.pr(0).write(|w| w.set_line(4, true));
    pac::EXTI.imr(0).modify(|w| w.set_line(4, true));
}

fn enable<I: Interrupt>() {
    I::unpend();
    // SAFETY: what the handler needs has been set up; nothing relies on the interrupt being off.
    unsafe { I::enable() };
}

/// Bytes from the nRF51.
pub struct Receiver {
    _uart: Uart,
}

impl Receiver {
    /// Waits for at least one byte.
    pub async fn read(&mut self, buffer: &mut [u8]) -> usize {
        RX.read(buffer).await
    }
}

/// Bytes to the nRF51.
pub struct Sender {}

impl Sender {
    /// Puts at least one byte into the ring, once there is room; returns how many.
    pub async fn write(&mut self, bytes: &[u8]) -> usize {
        let written = TX.write(bytes).await;
        go_on();
        written
    }

    /// Forgets what has not been sent.
    pub fn clear(&mut self) {
        TX.clear();
    }
}
