//! Tests of the model with `bmi088`, an independent driver of the chip.
//!
//! The driver has SPI only, whose registers are those of I2C. The adapter translates its accesses:
//! the first byte is the register with bit 7 for reading, and the accelerometer sends one byte of
//! padding first (data sheet 6.1.2).

use bmi088::Builder;
use embedded_hal::i2c::{ErrorKind, I2c};
use embedded_hal::spi::{ErrorKind as SpiErrorKind, ErrorType, Operation, SpiDevice};

use super::*;
use crate::devices::test_bus::TestBus;

struct SpiAdapter {
    bus: TestBus<Bmi088>,
    address: u8,
}

impl ErrorType for SpiAdapter {
    type Error = SpiErrorKind;
}

impl SpiDevice for SpiAdapter {
    fn transaction(&mut self, list: &mut [Operation<'_, u8>]) -> Result<(), SpiErrorKind> {
        let is_failed = |_: ErrorKind| SpiErrorKind::Other;
        let padding = usize::from(self.address == ACCELEROMETER_ADDRESS);
        for operation in list {
            match operation {
                Operation::TransferInPlace(bytes) if bytes[0] & 0x80 != 0 => {
                    let register = bytes[0] & 0x7f;
                    self.bus
                        .write_read(self.address, &[register], &mut bytes[1 + padding..])
                        .map_err(is_failed)?;
                }
                Operation::TransferInPlace(bytes) => {
                    self.bus.write(self.address, bytes).map_err(is_failed)?;
                }
                Operation::Write(bytes) => {
                    self.bus.write(self.address, bytes).map_err(is_failed)?;
                }
                _ => unreachable!("the driver has no other accesses"),
            }
        }
        Ok(())
    }
}

/// The driver starts the accelerometer with ACC_PWR_CTRL alone.
#[test]
fn an_unmodified_driver_starts_both_parts_and_reads_them() {
    let start = AccelerometerStart::PowerControl;
    let settings = Bmi088Settings { start, ..Bmi088Settings::default() };
    let bus = TestBus::new(Bmi088::new(settings, Time::ZERO));
    bus.wait(Time::from_millis(100));
    bus.device.borrow_mut().set_motion([10, -20, 30], [100, -200, 300], bus.now.get());
    let part = |address| SpiAdapter { bus: bus.clone(), address };
    let mut accelerometer = Builder::new_accel_spi(part(ACCELEROMETER_ADDRESS));
    accelerometer.setup(&mut bus.clone()).unwrap();
    let mut gyroscope = Builder::new_gyro_spi(part(GYROSCOPE_ADDRESS));
    gyroscope.setup(&mut bus.clone()).unwrap();
    bus.wait(Time::from_millis(40));
    // The driver leaves the range at ±6 g, and sets ±2000 °/s.
    assert_eq!(accelerometer.get_accel().unwrap(), [400, -800, 1200]);
    assert_eq!(gyroscope.get_gyro().unwrap(), [10, -20, 30]);
    bus.device.borrow_mut().set_fault(Some(Bmi088Fault::GyroscopeId(0)), bus.now.get());
    assert!(!gyroscope.probe(&mut bus.clone()).unwrap());
}
