//! One transaction on an I2C bus, carried out by interrupts. The task that waits for it is woken once, at
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
    Binding, DMA1_STREAM0, DMA1_STREAM2, Handler, I2C1_ER, I2C1_EV, I2C3_ER, I2C3_EV, Interrupt,
};
use embassy_stm32::pac;
use embassy_stm32::pac::dma::vals::{Dir, Pl};
use embassy_stm32::pac::i2c::I2c;
use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::waitqueue::AtomicWaker;

use super::BusError;

/// The most bytes of a write: the configuration of a VL53L1X with the number of its register.
pub const WRITE_MAX: usize = 90;
/// The most bytes of a read: the calibration of a barometer with its checksum has 22.
pub const READ_MAX: usize = 24;

/// The controller of the expansion port.
pub static I2C1: Controller = Controller::new(pac::I2C1, 0, 1);
/// The controller of the sensors on the board.
pub static I2C3: Controller = Controller::new(pac::I2C3, 2, 3);

/// A peripheral, the DMA stream that receives from it, and its transaction.
pub struct Controller {
    pub i2c: I2c,
    /// The stream of DMA1, and its channel.
    stream: usize,
    channel: u8,
    transfer: Mutex<CriticalSectionRawMutex, RefCell<Transfer>>,
    waker: AtomicWaker,
    /// The bytes that the DMA controller writes. They are atomics, since it writes them at any time.
    received: [AtomicU8; READ_MAX],
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

/// A transaction: bytes to write, then bytes to read.
struct Transfer {
    /// The address of the chip, with seven bits.
    address: u8,
    bytes: [u8; WRITE_MAX],
    write_count: usize,
    read_count: usize,
    phase: Phase,
}

/// The interrupts of the buses.
pub struct Interrupts;

impl Handler<I2C1_EV> for Interrupts {
    unsafe fn on_interrupt() {
        I2C1.with(Transfer::advance);
    }
}

impl Handler<I2C1_ER> for Interrupts {
    unsafe fn on_interrupt() {
        I2C1.with(Transfer::fail);
    }
}

impl Handler<DMA1_STREAM0> for Interrupts {
    unsafe fn on_interrupt() {
        I2C1.with(Transfer::end_read);
    }
}

impl Handler<I2C3_EV> for Interrupts {
    unsafe fn on_interrupt() {
        I2C3.with(Transfer::advance);
    }
}

impl Handler<I2C3_ER> for Interrupts {
    unsafe fn on_interrupt() {
        I2C3.with(Transfer::fail);
    }
}

impl Handler<DMA1_STREAM2> for Interrupts {
    unsafe fn on_interrupt() {
        I2C3.with(Transfer::end_read);
    }
}

impl Transfer {
    const NONE: Transfer = Transfer {
        address: 0,
        bytes: [0; WRITE_MAX],
        write_count: 0,
        read_count: 0,
        phase: Phase::Ended(Ok(())),
    };

    /// Handles an event of the peripheral.
    fn advance(&mut self, of: &Controller) {
        let i2c = of.i2c;
        let status = i2c.sr1().read();
        if status.start() {
            let reads = self.phase == Phase::Reading;
            i2c.dr().write(|w| w.set_dr(self.address << 1 | u8::from(reads)));
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
            self.write_next(of);
        } else if status.btf() {
            self.write_next(of);
        }
    }

    /// Gives the next byte to the peripheral, or ends the write.
    fn write_next(&mut self, of: &Controller) {
        let Phase::Writing(written) = self.phase else { return };
        let i2c = of.i2c;
        let bytes = self.bytes.get(..self.write_count);
        if let Some(byte) = bytes.and_then(|bytes| bytes.get(written)) {
            i2c.dr().write(|w| w.set_dr(*byte));
            self.phase = Phase::Writing(written + 1);
        } else if self.read_count > 0 {
            i2c.cr1().modify(|w| w.set_start(true));
            self.phase = Phase::Reading;
            // BTF, and with it this interrupt, would last until the start condition is on the bus.
            // Reading DR clears it (27.6.6).
            i2c.dr().read();
        } else {
            i2c.cr1().modify(|w| w.set_stop(true));
            self.conclude(of, Ok(()));
        }
    }

    /// Handles an error of the peripheral (27.3.4). The task resets it.
    fn fail(&mut self, of: &Controller) {
        if matches!(self.phase, Phase::Ended(_)) {
            return;
        }
        let status = of.i2c.sr1().read();
        self.conclude(
            of,
            Err(if status.af() {
                BusError::NoAcknowledge
            } else if status.arlo() {
                BusError::ArbitrationLost
            } else {
                BusError::Misplaced
            }),
        );
    }

    /// Handles the end of the DMA stream.
    fn end_read(&mut self, of: &Controller) {
        let flags = pac::DMA1.isr(of.stream / 4).read();
        of.clear_flags();
        if self.phase != Phase::Reading {
            return;
        }
        if flags.tcif(of.stream % 4) {
            of.i2c.cr1().modify(|w| w.set_stop(true));
            self.conclude(of, Ok(()));
        } else {
            self.conclude(of, Err(BusError::Dma));
        }
    }

    /// Turns the interrupts of the peripheral off, and wakes the task.
    fn conclude(&mut self, of: &Controller, outcome: Result<(), BusError>) {
        of.silence();
        self.phase = Phase::Ended(outcome);
        of.waker.wake();
    }
}

impl Controller {
    const fn new(i2c: I2c, stream: usize, channel: u8) -> Self {
        Controller {
            i2c,
            stream,
            channel,
            transfer: Mutex::new(RefCell::new(Transfer::NONE)),
            waker: AtomicWaker::new(),
            received: [const { AtomicU8::new(0) }; READ_MAX],
        }
    }

    /// Calls a function with the transaction.
    fn with<R>(&self, action: impl FnOnce(&mut Transfer, &Controller) -> R) -> R {
        self.transfer.lock(|transfer| action(&mut transfer.borrow_mut(), self))
    }

    fn silence(&self) {
        self.i2c.cr2().modify(|w| {
            w.set_dmaen(false);
            w.set_last(false);
            w.set_itevten(false);
            w.set_iterren(false);
        });
    }

    /// Clears all flags of the DMA stream.
    fn clear_flags(&self) {
        let stream = self.stream % 4;
        pac::DMA1.ifcr(self.stream / 4).write(|w| {
            w.set_tcif(stream, true);
            w.set_htif(stream, true);
            w.set_teif(stream, true);
            w.set_dmeif(stream, true);
            w.set_feif(stream, true);
        });
    }

    /// Begins a transaction. The peripheral must be on and idle, there must be at least one byte to
    /// write or to read, and at most [`WRITE_MAX`] and [`READ_MAX`].
    pub fn begin(&self, address: u8, written: &[u8], read_count: usize) {
        self.with(|transfer, _| {
            transfer.address = address;
            transfer.bytes.iter_mut().zip(written).for_each(|(to, from)| *to = *from);
            (transfer.write_count, transfer.read_count) = (written.len(), read_count);
            transfer.phase = if written.is_empty() { Phase::Reading } else { Phase::Writing(0) };
            if read_count > 0 {
                self.prepare_stream(read_count);
            }
            self.i2c.cr2().modify(|w| {
                w.set_itevten(true);
                w.set_iterren(true);
            });
            self.i2c.cr1().modify(|w| {
                w.set_ack(read_count != 1);
                w.set_start(true);
            });
        });
    }

    /// Lets the DMA stream wait for bytes. It is off, since its last transfer is complete or was
    /// aborted.
    fn prepare_stream(&self, count: usize) {
        self.clear_flags();
        let stream = pac::DMA1.st(self.stream);
        stream.par().write_value(self.i2c.dr().as_ptr() as u32);
        stream.m0ar().write_value(self.received.as_ptr() as u32);
        stream.ndtr().write(|w| w.set_ndt(count as u16));
        // Byte by byte, without the FIFO.
        stream.cr().write(|w| {
            w.set_chsel(self.channel);
            w.set_dir(Dir::PERIPHERAL_TO_MEMORY);
            w.set_minc(true);
            w.set_pl(Pl::HIGH);
            w.set_tcie(true);
            w.set_teie(true);
            w.set_en(true);
        });
    }

    /// Waits for the end of the transaction.
    pub async fn end(&self) -> Result<(), BusError> {
        poll_fn(|context| {
            self.waker.register(context.waker());
            match self.with(|transfer, _| transfer.phase) {
                Phase::Ended(outcome) => Poll::Ready(outcome),
                _ => Poll::Pending,
            }
        })
        .await
    }

    /// Copies the bytes that a transaction has read.
    pub fn copy_received(&self, bytes: &mut [u8]) {
        // The bytes were written before the interrupt that ended the transaction.
        fence(Ordering::Acquire);
        for (byte, received) in bytes.iter_mut().zip(&self.received) {
            *byte = received.load(Ordering::Relaxed);
        }
    }

    /// Ends a transaction at any point. The peripheral and the bus must be reset afterwards.
    pub fn abort(&self) {
        self.with(|transfer, _| {
            self.silence();
            pac::DMA1.st(self.stream).cr().modify(|w| w.set_en(false));
            transfer.phase = Phase::Ended(Ok(()));
        });
    }
}

/// Enables the interrupts of the expansion port's bus in the NVIC.
pub fn enable_i2c1(
    _irq: impl Binding<I2C1_EV, Interrupts>
    + Binding<I2C1_ER, Interrupts>
    + Binding<DMA1_STREAM0, Interrupts>,
) {
    enable::<I2C1_EV>();
    enable::<I2C1_ER>();
    enable::<DMA1_STREAM0>();
}

/// Enables the interrupts of the sensors' bus in the NVIC.
pub fn enable_i2c3(
    _irq: impl Binding<I2C3_EV, Interrupts>
    + Binding<I2C3_ER, Interrupts>
    + Binding<DMA1_STREAM2, Interrupts>,
) {
    enable::<I2C3_EV>();
    enable::<I2C3_ER>();
    enable::<DMA1_STREAM2>();
}

fn enable<I: Interrupt>() {
    I::unpend();
    // SAFETY: the peripheral requests no interrupt before `begin`, and no code relies on the
    // interrupt being off.
    unsafe { I::enable() };
}
