//! I2C2 as a master at 400 kHz (RM0091 26.4). The core waits 0.1 ms for a transfer of four bytes.
//! Transfers are rare, so this is acceptable.
//!
//! `I2c` of embassy-stm32 0.6.0 takes 1.3 kB more and waits as long, as no DMA channel is free for
//! it.

use cortex_m::asm;
use embassy_stm32::pac::gpio::vals::Moder;
use embassy_stm32::pac::i2c::regs::{Isr, Timingr};
use embassy_stm32::pac::i2c::vals::{Autoend, Dir};
use embassy_stm32::pac::{GPIOB, I2C2};

use crate::pins;

/// The error of a transfer: no device answers, or the bus hangs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NoAnswer;

/// The timing of 400 kHz at 48 MHz, as in the makers' firmware.
const TIMING: Timingr = Timingr(0x0090_1850);

/// The number of status readings before a transfer fails: more than 2 ms.
const PATIENCE: u32 = 20_000;

/// Half a period of the clock with which a device is freed, in cycles of the core: 5 µs, which is
/// enough for a device of 100 kHz.
const HALF_PERIOD: u32 = 240;

/// Frees the bus, and turns the peripheral on.
pub fn start() {
    free_bus();
    I2C2.timingr().write_value(TIMING);
    I2C2.cr1().write(|w| w.set_pe(true));
}

/// Lets a device that holds SDA low finish its byte. The devices do not notice a reset of this chip, and
/// one that was sending then waits for the clock. It lets SDA go within nine periods (UM10204 3.1.16),
/// and the next start condition ends its transfer.
#[inline(never)] // Its variables are not on the stack of the tasks.
fn free_bus() {
    let drive = |level: bool| {
        GPIOB
            .bsrr()
            .write(|w| if level { w.set_bs(pins::SCL, true) } else { w.set_br(pins::SCL, true) })
    };
    drive(true);
    GPIOB.moder().modify(|w| w.set_moder(pins::SCL, Moder::OUTPUT));
    for _ in 0..9 {
        if pins::is_high(GPIOB, pins::SDA) {
            break;
        }
        drive(false);
        asm::delay(HALF_PERIOD);
        drive(true);
        asm::delay(HALF_PERIOD);
    }
    GPIOB.moder().modify(|w| w.set_moder(pins::SCL, Moder::ALTERNATE));
}

/// Writes at most 255 bytes to a device.
pub fn write(address: u8, bytes: &[u8]) -> Result<(), NoAnswer> {
    let result = send(address, bytes, Autoend::AUTOMATIC).and_then(|()| wait(|isr| isr.stopf()));
    settle(result)
}

/// Writes a byte to a device and reads at most 255 bytes from it.
pub fn write_read(address: u8, byte: u8, bytes: &mut [u8]) -> Result<(), NoAnswer> {
    let result = send(address, &[byte], Autoend::SOFTWARE)
        .and_then(|()| wait(|isr| isr.tc()))
        .and_then(|()| {
            begin(address, Dir::READ, bytes.len(), Autoend::AUTOMATIC);
            for byte in bytes {
                wait(|isr| isr.rxne())?;
                *byte = I2C2.rxdr().read().rxdata();
            }
            wait(|isr| isr.stopf())
        });
    settle(result)
}

fn send(address: u8, bytes: &[u8], end: Autoend) -> Result<(), NoAnswer> {
    begin(address, Dir::WRITE, bytes.len(), end);
    for byte in bytes {
        wait(|isr| isr.txis())?;
        I2C2.txdr().write(|w| w.set_txdata(*byte));
    }
    Ok(())
}

fn begin(address: u8, dir: Dir, count: usize, end: Autoend) {
    I2C2.cr2().write(|w| {
        w.set_sadd(u16::from(address) << 1);
        w.set_dir(dir);
        w.set_nbytes(count as u8);
        w.set_autoend(end);
        w.set_start(true);
    });
}

fn wait(is_done: impl Fn(Isr) -> bool) -> Result<(), NoAnswer> {
    for _ in 0..PATIENCE {
        let isr = I2C2.isr().read();
        if isr.nackf() {
            break;
        }
        if is_done(isr) {
            return Ok(());
        }
    }
    Err(NoAnswer)
}

/// Ends a transfer. After a failure it resets the peripheral: once PE was low for three cycles of
/// the peripheral's clock, all flags and the state of the bus are as after a reset (26.4.5).
fn settle(result: Result<(), NoAnswer>) -> Result<(), NoAnswer> {
    I2C2.icr().write(|w| w.set_stopcf(true));
    if result.is_err() {
        I2C2.cr1().write(|w| w.set_pe(false));
        while I2C2.cr1().read().pe() {}
        I2C2.cr1().write(|w| w.set_pe(true));
    }
    result
}
