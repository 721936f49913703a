//! One transaction on I2C3, carried out by interrupts. The task that waits for it is woken once, at
//! the end.
//!
//! The I2C driver of embassy-stm32 0.6.0 is not used for these reasons:
//! * It wakes its task at every step, about 7 times per read of a register (i2c/v1.rs). At 1,100
//!   instructions per wake-up, two reads per millisecond would take 16 % of the core.
//! * It sends no stop condition when a future is dropped, for example by a timeout.
//! * It has no function that frees the bus from a chip that holds SDA low.
//! * It needs a DMA stream for sending as well, although a register's number is one byte.
//!
//! # Steps
//! | event | reaction |
//! |---|---|
//! | SB: a start condition was sent | the address, which clears SB |
//! | ADDR, for a write | SR2 is read, which clears ADDR; the first byte |
//! | BTF: a byte was sent and acknowledged | the next byte, or the second start, or a stop |
//! | ADDR, for a read | DMA on, then SR2 is read |
//! | the DMA stream is complete | a stop |
//!
//! LAST lets the peripheral refuse the byte that the DMA controller moves last, so that the chip
//! stops sending (RM0090 27.3.7). A single byte is refused by ACK instead (27.3.3).
//!
//! Reads go by DMA, since a byte takes 23 µs and an interrupt for each would cost more than the
//! rest. The DMA controller does not reach the core-coupled memory, where the stack lies, so the
//! bytes come to a static buffer. It remains valid if the waiting future is dropped.
//!
//! Critical sections mask these interrupts, unlike the link's, so that a mutex protects what
//! interrupts and task share.
//!
//! Registers: RM0090 chapter 27, order of events in 27.3.3; DMA in chapter 10, request mapping in
//! table 42.

use core::cell::RefCell;
use core::future::poll_fn;
use core::sync::atomic::{AtomicU8, Ordering, fence};
use core::task::Poll;

use embassy_stm32::interrupt::typelevel::{
    Binding, DMA1_STREAM2, Handler, I2C3_ER, I2C3_EV, Interrupt,
};
use embassy_stm32::pac;
use embassy_stm32::pac::dma::vals::{Dir, Pl};
use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::waitqueue::AtomicWaker;

use super::BusError;

/// The most bytes of a write: a register and the values that follow it.
pub const WRITE_MAX: usize = 4;
/// The most bytes of a read: the calibration of a barometer with its checksum has 22.
pub const READ_MAX: usize = 24;

/// The DMA stream that receives from I2C3, and its channel.
const STREAM: usize = 2;
const CHANNEL: u8 = 3;

/// The bytes that the DMA controller writes. They are atomics, since it writes them at any time.
static RECEIVED: [AtomicU8; READ_MAX] = [const { AtomicU8::new(0) }; READ_MAX];

static WAKER: AtomicWaker = AtomicWaker::new();

static TRANSFER: Mutex<CriticalSectionRawMutex, RefCell<Transfer>> =
    Mutex::new(RefCell::new(Transfer::NONE));

/// A transaction: bytes to write, then bytes to read.
#[derive(Clone, Copy)]
pub struct Request {
    /// The address of the chip, with seven bits.
    pub address: u8,
    /// The bytes to write.
    pub bytes: [u8; WRITE_MAX],
    pub write_count: usize,
    pub read_count: usize,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Phase {
    /// The chip is addressed for writing, and this many bytes were given to the peripheral.
    Writing(usize),
    /// The chip is addressed for reading.
    Reading,
    /// The peripheral is idle, or ends the transaction with a stop condition.
    Ended(Result<(), BusError>),
}

struct Transfer {
    request: Request,
    phase: Phase,
}

/// The interrupts of the bus.
pub struct Interrupts;

impl Handler<I2C3_EV> for Interrupts {
    unsafe fn on_interrupt() {
        TRANSFER.lock(|transfer| transfer.borrow_mut().advance());
    }
}

impl Handler<I2C3_ER> for Interrupts {
    unsafe fn on_interrupt() {
        TRANSFER.lock(|transfer| transfer.borrow_mut().fail());
    }
}

impl Handler<DMA1_STREAM2> for Interrupts {
    unsafe fn on_interrupt() {
        TRANSFER.lock(|transfer| transfer.borrow_mut().end_read());
    }
}

impl Transfer {
    const NONE: Transfer = Transfer {
        request: Request { address: 0, bytes: [0; WRITE_MAX], write_count: 0, read_count: 0 },
        phase: Phase::Ended(Ok(())),
    };

    /// Handles an event of the peripheral.
    fn advance(&mut self) {
        let i2c = pac::I2C3;
        let status = i2c.sr1().read();
        if status.start() {
            let reads = self.phase == Phase::Reading;
            i2c.dr().write(|w| w.set_dr(self.request.address << 1 | u8::from(reads)));
        } else if status.addr() {
            if self.phase == Phase::Reading {
                // The remaining steps are those of the DMA controller. DMAEN must be set before
                // ADDR is cleared (27.3.7).
                i2c.cr2().modify(|w| {
                    w.set_dmaen(true);
                    w.set_last(true);
                    w.set_itevten(false);
                });
            }
            // Reading SR1 and then SR2 clears ADDR (27.6.7).
            i2c.sr2().read();
            self.write_next();
        } else if status.btf() {
            self.write_next();
        }
    }

    /// Gives the next byte to the peripheral, or ends the write.
    fn write_next(&mut self) {
        let Phase::Writing(written) = self.phase else { return };
        let i2c = pac::I2C3;
        let bytes = self.request.bytes.get(..self.request.write_count);
        if let Some(byte) = bytes.and_then(|bytes| bytes.get(written)) {
            i2c.dr().write(|w| w.set_dr(*byte));
            self.phase = Phase::Writing(written + 1);
        } else if self.request.read_count > 0 {
            i2c.cr1().modify(|w| w.set_start(true));
            self.phase = Phase::Reading;
            // BTF, and with it this interrupt, would last until the start condition is on the bus.
            // Reading DR clears it (27.6.6).
            i2c.dr().read();
        } else {
            i2c.cr1().modify(|w| w.set_stop(true));
            self.conclude(Ok(()));
        }
    }

    /// Handles an error of the peripheral (27.3.4). The task resets it.
    fn fail(&mut self) {
        if matches!(self.phase, Phase::Ended(_)) {
            return;
        }
        let status = pac::I2C3.sr1().read();
        self.conclude(Err(if status.af() {
            BusError::NoAcknowledge
        } else if status.arlo() {
            BusError::ArbitrationLost
        } else {
            BusError::Misplaced
        }));
    }

    /// Handles the end of the DMA stream.
    fn end_read(&mut self) {
        let flags = pac::DMA1.isr(STREAM / 4).read();
        clear_flags();
        if self.phase != Phase::Reading {
            return;
        }
        if flags.tcif(STREAM % 4) {
            pac::I2C3.cr1().modify(|w| w.set_stop(true));
            self.conclude(Ok(()));
        } else {
            self.conclude(Err(BusError::Dma));
        }
    }

    /// Turns the interrupts of the peripheral off, and wakes the task.
    fn conclude(&mut self, outcome: Result<(), BusError>) {
        silence();
        self.phase = Phase::Ended(outcome);
        WAKER.wake();
    }
}

fn silence() {
    pac::I2C3.cr2().modify(|w| {
        w.set_dmaen(false);
        w.set_last(false);
        w.set_itevten(false);
        w.set_iterren(false);
    });
}

/// Clears all flags of the DMA stream.
fn clear_flags() {
    pac::DMA1.ifcr(STREAM / 4).write(|w| {
        w.set_tcif(STREAM % 4, true);
        w.set_htif(STREAM % 4, true);
        w.set_teif(STREAM % 4, true);
        w.set_dmeif(STREAM % 4, true);
        w.set_feif(STREAM % 4, true);
    });
}

/// Enables the interrupts of the bus in the NVIC.
pub fn enable(
    _irq: impl Binding<I2C3_EV, Interrupts>
    + Binding<I2C3_ER, Interrupts>
    + Binding<DMA1_STREAM2, Interrupts>,
) {
    fn enable<I: Interrupt>() {
        I::unpend();
        // SAFETY: the peripheral requests no interrupt before `begin`, and no code relies on the
        // interrupt being off.
        unsafe { I::enable() };
    }
    enable::<I2C3_EV>();
    enable::<I2C3_ER>();
    enable::<DMA1_STREAM2>();
}

/// Begins a transaction. The peripheral must be on and idle, and `request` must have a byte at
/// least.
pub fn begin(request: Request) {
    let i2c = pac::I2C3;
    TRANSFER.lock(|transfer| {
        let mut transfer = transfer.borrow_mut();
        transfer.request = request;
        transfer.phase = if request.write_count > 0 { Phase::Writing(0) } else { Phase::Reading };
        if request.read_count > 0 {
            prepare_stream(request.read_count);
        }
        i2c.cr2().modify(|w| {
            w.set_itevten(true);
            w.set_iterren(true);
        });
        i2c.cr1().modify(|w| {
            w.set_ack(request.read_count != 1);
            w.set_start(true);
        });
    });
}

/// Lets the DMA stream wait for bytes. It is off, since its last transfer is complete or was
/// aborted.
fn prepare_stream(count: usize) {
    clear_flags();
    let stream = pac::DMA1.st(STREAM);
    stream.par().write_value(pac::I2C3.dr().as_ptr() as u32);
    stream.m0ar().write_value(RECEIVED.as_ptr() as u32);
    stream.ndtr().write(|w| w.set_ndt(count as u16));
    // Byte by byte, without the FIFO.
    stream.cr().write(|w| {
        w.set_chsel(CHANNEL);
        w.set_dir(Dir::PERIPHERAL_TO_MEMORY);
        w.set_minc(true);
        w.set_pl(Pl::HIGH);
        w.set_tcie(true);
        w.set_teie(true);
        w.set_en(true);
    });
}

/// Waits for the end of the transaction.
pub async fn end() -> Result<(), BusError> {
    poll_fn(|context| {
        WAKER.register(context.waker());
        match TRANSFER.lock(|transfer| transfer.borrow().phase) {
            Phase::Ended(outcome) => Poll::Ready(outcome),
            _ => Poll::Pending,
        }
    })
    .await
}

/// Copies the bytes that a transaction has read.
pub fn copy_received(bytes: &mut [u8]) {
    // The bytes were written before the interrupt that ended the transaction.
    fence(Ordering::Acquire);
    for (byte, received) in bytes.iter_mut().zip(&RECEIVED) {
        *byte = received.load(Ordering::Relaxed);
    }
}

/// Ends a transaction at any point. The peripheral and the bus must be reset afterwards.
pub fn abort() {
    TRANSFER.lock(|transfer| {
        silence();
        pac::DMA1.st(STREAM).cr().modify(|w| w.set_en(false));
        transfer.borrow_mut().phase = Phase::Ended(Ok(()));
    });
}
