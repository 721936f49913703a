//! The data-ready pulses of the gyroscope: pin INT3, at PC14.
//!
//! `ExtiInput` of embassy-stm32 is not used: it has neither the time of the pulse nor the number of
//! pulses that came before it was awaited.

use core::cell::Cell;
use core::future::poll_fn;
use core::task::Poll;

use embassy_stm32::Peri;
use embassy_stm32::gpio::{Input, Pull};
use embassy_stm32::interrupt::typelevel::{Binding, EXTI15_10, Handler, Interrupt};
use embassy_stm32::pac;
use embassy_stm32::peripherals::PC14;
use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::waitqueue::AtomicWaker;
use embassy_time::Instant;

/// The number of the pin, and of its line.
const LINE: usize = 14;
/// Port C, as SYSCFG_EXTICR4 has it (RM0090 9.2.6).
const PORT: u8 = 2;

static WAKER: AtomicWaker = AtomicWaker::new();
static PULSES: Mutex<CriticalSectionRawMutex, Cell<Pulses>> =
    Mutex::new(Cell::new(Pulses { count: 0, last: Instant::MIN }));

/// The pulses since the last one that a task has taken.
#[derive(Clone, Copy)]
pub struct Pulses {
    /// The number of pulses, at least 1; more than 1 if the task came too late.
    pub count: u32,
    /// The time of the last of them.
    pub last: Instant,
}

/// The interrupt of the pulses.
pub struct Interrupts;

impl Handler<EXTI15_10> for Interrupts {
    unsafe fn on_interrupt() {
        pac::EXTI.pr(0).write(|w| w.set_line(LINE, true));
        PULSES.lock(|pulses| {
            pulses.set(Pulses { count: pulses.get().count + 1, last: Instant::now() });
        });
        WAKER.wake();
    }
}

/// The pin of the pulses.
pub struct DataReady {
    _pin: Input<'static>,
}

impl DataReady {
    /// Enables the interrupt of the rising edge. The gyroscope drives the pin once it is configured.
    pub fn new(pin: Peri<'static, PC14>, _irq: impl Binding<EXTI15_10, Interrupts>) -> Self {
        let pin = Input::new(pin, Pull::None);
        pac::RCC.apb2enr().modify(|w| w.set_syscfgen(true));
        pac::SYSCFG.exticr(LINE / 4).modify(|w| w.set_exti(LINE % 4, PORT));
        // Another task changes the same registers for the link's flow control, but not after the
        // start.
        pac::EXTI.rtsr(0).modify(|w| w.set_line(LINE, true));
        pac::EXTI.pr(0).write(|w| w.set_line(LINE, true));
        pac::EXTI.imr(0).modify(|w| w.set_line(LINE, true));
        EXTI15_10::unpend();
        // SAFETY: everything that the handler needs is set up, and no code relies on the interrupt
        // being off.
        unsafe { EXTI15_10::enable() };
        DataReady { _pin: pin }
    }

    /// Forgets the pulses until now.
    pub fn clear(&mut self) {
        PULSES.lock(|pulses| pulses.set(Pulses { count: 0, ..pulses.get() }));
    }

    /// Waits until there is a pulse, and takes all of them.
    pub async fn wait(&mut self) -> Pulses {
        poll_fn(|context| {
            WAKER.register(context.waker());
            let taken = PULSES.lock(|pulses| {
                let now = pulses.get();
                pulses.set(Pulses { count: 0, ..now });
                now
            });
            if taken.count > 0 { Poll::Ready(taken) } else { Poll::Pending }
        })
        .await
    }
}
